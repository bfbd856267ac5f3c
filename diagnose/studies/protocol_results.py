"""Result of one protocol that tells classes apart: scores, calibration and answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from diagnose.data.protocols import NEW_MACHINE
from diagnose.data.windows import Task
from diagnose.networks.calibration import calibration_scores
from diagnose.scoring.judged import BOOTSTRAP_SEED, class_scores, judged_runs
from diagnose.scoring.machines import machines_of
from diagnose.scoring.metrics import ACCURACY, SCORES, ratio_with_interval
from diagnose.scoring.predictions import LAST_EPOCH, Prediction, by_method
from diagnose.settings import TrainSettings
from diagnose.studies.answers import protocol_answers
from diagnose.studies.class_jobs import ORACLE
from diagnose.studies.controls import chosen_oracle, method_result
from diagnose.studies.counts import n_different, part_records, part_sizes, unit_ids
from diagnose.studies.result_files import Content, Entry, network_name
from diagnose.studies.verdicts import control_verdicts
from diagnose.training.entries import entry_scores
from diagnose.training.heads import head_scores

FAULT_GEAR = "fault_gear"  # column; "" for healthy records


def is_leaky(protocol: str) -> bool:
    """True if a protocol has the same record on both sides.

    Such a score is no measure of diagnosis.
    """
    return "leaky" in protocol


def main_protocol(results: Mapping[str, Entry]) -> str | None:
    """Protocol that answers for a study: that of new machines, else the first clean one.

    Parameters
    ----------
    results : ``protocols`` of ``metrics.json``, or any entries with ``leaky``
    """
    clean = [name for name, result in results.items() if not result["leaky"]]
    if NEW_MACHINE in clean:
        return NEW_MACHINE
    return next(iter(clean), None)


def test_score(task: Task, prediction: Prediction, n_bootstrap: int) -> Entry:
    """Score that is stored with a network.

    Balanced accuracy with its interval, chance, and the numbers of records and units.
    """
    record, judged = prediction.record, judged_runs(task, [prediction])
    accuracy = class_scores(judged, task.class_names, n_bootstrap)[ACCURACY]
    return {
        ACCURACY: {key: accuracy[key] for key in ("mean", "low", "high", "too_few")},
        "chance": 1.0 / n_different(task.labels()[record]),
        "n_records": int(record.size),
        "n_units": n_different(unit_ids(task)[record]),
        "leaky": is_leaky(prediction.protocol),
    }


def protocol_result(
    task: Task,
    settings: TrainSettings,
    protocol: str,
    predictions: Sequence[Prediction],
    shams: Content = MappingProxyType({}),
) -> Entry:
    """Entry of a protocol in ``metrics.json``.

    Parameters
    ----------
    task, settings : of the study
    predictions : of all protocols
    shams : scores of the trainings on the sham data set
    """
    runs = by_method(predictions, protocol)
    methods = {name: method_result(task, settings, mine) for name, mine in runs.items()}
    network = runs[network_name(settings)]
    methods["chance"] = _chance(task, network[0].record)
    mine = [run for of_method in runs.values() for run in of_method]
    over_oracle: Entry = {}
    oracle = chosen_oracle(task, mine)
    if oracle is not None:
        methods[ORACLE] = {**methods[oracle], "chosen": oracle}
        over_oracle = _over_oracle(task, settings, network, runs[oracle])
    methods |= shams
    answers, controls = None, {}
    if not is_leaky(protocol):
        name = network_name(settings)
        controls = control_verdicts(methods, runs, name)
        compared = [
            run for run in mine if run.method == name or _holds(controls, run.method)
        ]
        answers = protocol_answers(task, settings, compared)
    parts = part_records(task, protocol)
    return {
        "leaky": is_leaky(protocol),
        "channels": {
            subset: list(task.part(protocol, subset).channel_names)
            for subset in ("train", "test")
        },
        **part_sizes(task, parts),
        "resampled": machines_of(task.dataset, parts["test"]).counts(),
        "methods": methods,
        "controls": controls,
        "over_oracle": over_oracle,
        "validation_loss": [list(run.validation_loss) for run in network],
        "best_epoch": [run.best_epoch for run in network],
        "last_epoch": _last_epoch(task, settings, network),
        "calibration": _calibration(task, network),
        "heads": head_scores(
            task, parts["train"], network, n_bootstrap=settings.n_bootstrap
        ),
        "entry": entry_scores(task, network, n_bootstrap=settings.n_bootstrap),
        "by_gear": _by_gear(task, settings, network),
        "answers": answers,
    }


def _holds(controls: Content, method: str) -> bool:
    """False for a method with a control that failed."""
    return method not in controls or bool(controls[method]["holds"])


def _by_gear(
    task: Task, settings: TrainSettings, network: Sequence[Prediction]
) -> dict[str, Entry]:
    """Balanced accuracy of the healthy records and the faults of one gear, for each gear.

    Empty where the faults of the test records are on one gear.
    """
    if FAULT_GEAR not in task.dataset.column_names:
        return {}
    gear = np.asarray(task.dataset.column(FAULT_GEAR))[network[0].record]
    named = sorted(set(gear.tolist()) - {""})
    if len(named) < 2:
        return {}
    scores = {}
    for name in named:
        chosen = network[0].record[np.isin(gear, ["", name])]
        judged = judged_runs(task, network, chosen)
        of_gear = class_scores(judged, task.class_names, settings.n_bootstrap)
        scores[name] = of_gear[ACCURACY]
    return scores


def _chance(task: Task, tested: NDArray[np.integer]) -> dict[str, float]:
    """Scores of guessing, and of always naming the most frequent class."""
    labels = task.labels()[np.unique(tested)]
    counts = np.bincount(labels, minlength=len(task.class_names))
    return {
        "balanced_accuracy": 1.0 / int((counts > 0).sum()),
        "majority_accuracy": float(counts.max() / counts.sum()),
    }


def _over_oracle(
    task: Task,
    settings: TrainSettings,
    network: Sequence[Prediction],
    oracle: Sequence[Prediction],
) -> Entry:
    """Scores of the network as shares of the oracle's."""
    above, below = (judged_runs(task, runs) for runs in (network, oracle))
    return {
        name: ratio_with_interval(
            name,
            above.confusion(),
            below.confusion(),
            n_bootstrap=settings.n_bootstrap,
            rng=np.random.default_rng(BOOTSTRAP_SEED),
            machines=above.machines,
        )
        for name in SCORES
    }


def _last_epoch(
    task: Task, settings: TrainSettings, network: Sequence[Prediction]
) -> Entry:
    """Epochs run, and scores of the weights of the last one, for comparison with the best."""
    judged = judged_runs(task, network, further=LAST_EPOCH)
    scores = class_scores(judged, task.class_names, settings.n_bootstrap)
    return {
        "epoch": [len(run.validation_loss) for run in network],
        **{name: scores[name] for name in SCORES},
    }


def _calibration(task: Task, network: Sequence[Prediction]) -> Entry:
    """Calibration of the probabilities of test records."""
    labels = task.labels()
    return calibration_scores(
        [run.answers for run in network],
        [labels[run.record] for run in network],
        [run.temperature for run in network],
    )
