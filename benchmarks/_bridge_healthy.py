"""Networks, most with healthy recordings of a machine beside, judged on a world as it is.

No record of a world takes part in any choice. The threshold, what is added to the log-probability
of healthy, is fitted on healthy records of machines that the training held back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import (
    HEALTHY,
    IS_REFERENCE,
    Segments,
    Task,
    all_segments,
    subset_segments,
    task_of,
)
from diagnose.networks.network import Network
from diagnose.networks.registry import input_of
from diagnose.scoring.metrics import (
    balanced_accuracy,
    confusion_by_unit,
    over_records,
)
from diagnose.training.classes import predict_windows
from diagnose.training.store import ModelDescription, load_model
from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]

RECALL = 0.95  # of healthy records, that the threshold is to leave
N_BOOTSTRAP = 2000
HELD_BACK = ("validation", "test")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """Answers of networks for records.

    Attributes
    ----------
    label, unit : (record,)
    log_probability : (network, record, class)
    shift : (network,) added to that of healthy
    """

    label: IntArray
    unit: NDArray[Any]
    log_probability: FloatArray
    shift: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Judge:
    """Networks of one training, one a seed, with the threshold of each.

    Attributes
    ----------
    networks : the networks
    description : of the first; the others differ by their seed
    shift : (network,) added to the log-probability of healthy
    """

    networks: tuple[Network, ...]
    description: ModelDescription
    shift: FloatArray

    def answers(self, world: Dataset) -> Answers:
        """Answers for all records of a world.

        Networks on turns compare each with the sound ones of its machine.
        """
        task = _task(self.description, world)
        windows = input_of(self.description.network).load(task, _examples(task))
        said = [
            over_records(predict_windows(network, windows), windows.record)[1]
            for network in self.networks
        ]
        record = np.unique(windows.record)
        return Answers(
            label=task.labels()[record],
            unit=np.asarray(world.column("unit_id"))[record],
            log_probability=np.stack(said),
            shift=self.shift,
        )


def judge_of(models: Sequence[Path], trained_on: Dataset) -> Judge:
    """Networks of one training; each threshold is fitted on machines that the training held back.

    Parameters
    ----------
    models : folders of the networks
    trained_on : data set of the training
    """
    loaded = [load_model(folder) for folder in models]
    description = loaded[0][1]
    networks = tuple(network for network, _ in loaded)
    task = _task(description, trained_on)
    inputs = input_of(description.network)
    held_back = [
        inputs.load(
            task, subset_segments(task, description.protocol, subset), training=True
        )
        for subset in HELD_BACK
    ]
    label = np.concatenate([part.label for part in held_back])
    healthy = task.class_names.index(HEALTHY)
    shifts = [
        healthy_shift(
            np.concatenate([predict_windows(network, part) for part in held_back]),
            label,
            healthy,
        )
        for network in networks
    ]
    return Judge(networks=networks, description=description, shift=np.array(shifts))


def healthy_shift(
    log_probability: FloatArray, label: IntArray, healthy: int, recall: float = RECALL
) -> float:
    """Number that is added to the log-probability of healthy, so that a share of healthy records
    is found.

    Parameters
    ----------
    log_probability : (record, class)
    label : (record,)
    healthy : number of the class
    recall : share to be found
    """
    rows = log_probability[label == healthy]
    others = np.delete(rows, healthy, axis=1).max(axis=1)
    return float(np.quantile(others - rows[:, healthy], recall, method="higher"))


def scores_of(
    answers: Answers, class_names: Sequence[str], *, shifted: bool = False
) -> dict[str, Any]:
    """Balanced accuracy with its 95 % interval over units and networks, and recall by class."""
    healthy, n_classes = list(class_names).index(HEALTHY), len(class_names)
    log_probability = answers.log_probability.copy()
    if shifted:
        log_probability[:, :, healthy] += answers.shift[:, None]
    confusion = np.stack(
        [
            confusion_by_unit(
                answers.label, rows.argmax(axis=1), answers.unit, n_classes
            )
            for rows in log_probability
        ]
    )
    n_networks, n_units = len(confusion), np.unique(answers.unit).size
    rng = np.random.default_rng(20240607)
    times = rng.multinomial(n_units, np.full(n_units, 1 / n_units), size=N_BOOTSTRAP)
    networks = rng.integers(n_networks, size=(N_BOOTSTRAP, n_networks))
    resampled = balanced_accuracy(np.einsum("bu,sutp->bstp", times, confusion))
    drawn = np.take_along_axis(resampled, networks, axis=1).mean(axis=1)
    total = confusion.sum(axis=(0, 1))
    share = np.diagonal(total) / total.sum(axis=1)
    return {
        "balanced_accuracy": float(balanced_accuracy(confusion.sum(axis=1)).mean()),
        "interval": [float(each) for each in np.quantile(drawn, [0.025, 0.975])],
        "recall": dict(zip(class_names, share.tolist(), strict=True)),
        "n_units": n_units,
        "n_records": int(answers.label.size),
    }


def _examples(task: Task) -> Segments:
    """Whole records of a task that are no references."""
    whole = all_segments(task)
    is_reference = np.asarray(task.dataset.column(IS_REFERENCE))[whole.record] == 1
    return Segments(
        record=whole.record[~is_reference],
        start=whole.start[~is_reference],
        stop=whole.stop[~is_reference],
    )


def _task(description: ModelDescription, dataset: Dataset) -> Task:
    return task_of(
        dataset,
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        classes=description.class_names,
        channels=description.channel_names,
    )
