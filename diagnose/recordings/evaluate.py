"""A trained network on a data set, its own or another one, if the two fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.data.at_rate import at_rate
from diagnose.data.windows import Segments, Task, all_segments, subset_segments, task_of
from diagnose.training.store import ModelDescription, data_fingerprint, schema_version
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from torch import nn

    from gensig.dataset.reader import Dataset


def evaluate_model(
    model: nn.Module,
    description: ModelDescription,
    dataset: Dataset,
    *,
    protocol: str | None = None,
    subset: str | None = None,
    channels: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Score a network by record.

    On the data set it was trained on it is judged on the test part of its protocol; on another one, on every record,
    unless `protocol` and `subset` say otherwise. A network of ``cross_sensor`` is judged on the channels of its test on
    the test part of that protocol, elsewhere on those of its training, unless `channels` says otherwise.

    Parameters
    ----------
    model, description : of `diagnose.training.store.load_model`
    dataset : open data set
    protocol, subset : part of a split of that data set
    channels : in place of those it was trained on, in their order

    Returns
    -------
    plain dictionary: scores with intervals over units, confusion, recall, and what was judged

    Raises
    ------
    DatasetError    if schema version, sampling rate, channels or classes do not fit the network
    ConfigError    for a protocol or subset that does not exist, another number of channels
    """
    from diagnose.networks.calibration import calibration_scores
    from diagnose.networks.registry import input_of
    from diagnose.scoring.metrics import over_records
    from diagnose.studies.study import score_predictions
    from diagnose.training.classes import predict_windows

    task = _matching_task(description, dataset, channels)
    segments, part, shown = chosen_segments(task, description, protocol, subset)
    windows = input_of(description.model).load(shown, segments)
    record, log_probability = over_records(predict_windows(model, windows), windows.record)
    scores = score_predictions(task, [(record, log_probability.argmax(axis=1))], description.n_bootstrap)
    return {
        "data": str(dataset.folder),
        "part": part,
        "n_records": int(record.size),
        "n_units": int(np.unique(np.asarray(dataset.column("unit_id"))[record]).size),
        "class_names": list(description.class_names),
        "channel_names": list(shown.channel_names),
        "model": str(description.model.get("name", "network")),
        "trained_on_protocol": description.protocol,
        "seed": description.seed,
        "calibration": calibration_scores([log_probability], [task.labels()[record]], [description.temperature]),
        **scores,
    }


def _matching_task(description: ModelDescription, dataset: Dataset, channels: Sequence[str] | None) -> Task:
    """Task as the network was trained for, on this data set; refuses what does not fit."""
    wanted = fitting_channels(description, dataset, channels)
    known, offered = description.class_names, tuple(dataset.class_names)
    own = data_fingerprint(dataset) == description.data_fingerprint
    if set(known) - set(offered) or (set(offered) - set(known) and not own):
        raise DatasetError(
            f"{dataset.folder} does not fit the model: its classes are {', '.join(offered)}, the model knows "
            f"{', '.join(known)}"
        )
    task = task_of(
        at_rate(dataset, description.sampling_rate_hz),
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        classes=known,
        channels=wanted,
    )
    if description.test_channel_names is None:
        return task
    tested = description.test_channel_names if channels is None else wanted
    return replace(task, cross_channels=(wanted, tested))


def fitting_channels(
    description: ModelDescription, dataset: Dataset, channels: Sequence[str] | None
) -> tuple[str, ...]:
    """Channels of a data set for those of a network; refuses another format, a lower rate and what it has not."""
    where = f"{dataset.folder} does not fit the model"
    if schema_version(dataset) != description.data_schema_version:
        raise DatasetError(
            f"{where}: data schema {schema_version(dataset)}, trained on schema {description.data_schema_version}"
        )
    if dataset.sampling_rate < description.sampling_rate_hz * (1 - 1e-9):
        raise DatasetError(
            f"{where}: sampled at {dataset.sampling_rate:g} Hz, trained at {description.sampling_rate_hz:g} Hz"
        )
    if channels is not None and len(channels) != len(description.channel_names):
        raise ConfigError(
            f"channels={','.join(channels)}: the model takes {len(description.channel_names)}, in the order of "
            f"{', '.join(description.channel_names)}"
        )
    wanted = tuple(channels or description.channel_names)
    if missing := [name for name in wanted if name not in dataset.channel_names]:
        raise DatasetError(
            f"{where}: it has no channel {', '.join(missing)} (it has {', '.join(dataset.channel_names)})"
        )
    return wanted


def chosen_segments(
    task: Task, description: ModelDescription, protocol: str | None, subset: str | None
) -> tuple[Segments, str, Task]:
    """What to judge, in words, and the task with the channels of that part."""
    own = data_fingerprint(task.dataset) == description.data_fingerprint
    if protocol is None and subset is not None and not own:
        raise ConfigError(f"subset={subset} needs protocol=..., one of {', '.join(task.dataset.protocols)}")
    if protocol is None and own:
        protocol = description.protocol
    if protocol is None:
        return all_segments(task), "all records", task
    subset = subset or "test"
    note = " (the data set it was trained on)" if own else ""
    return subset_segments(task, protocol, subset), f"{subset} part of {protocol}{note}", task.part(protocol, subset)


def write_evaluation(folder: Path, result: dict[str, Any]) -> None:
    """Write ``metrics.json`` and ``confusion.png``."""
    import json

    from diagnose.report.figures import confusion_figure

    text = json.dumps(result, indent=2, allow_nan=False)
    (folder / "metrics.json").write_text(text + "\n", encoding="utf-8")
    title = f"{result['model']}, {result['part']}"
    confusion_figure(folder / "confusion.png", result["confusion"], result["class_names"], title)
