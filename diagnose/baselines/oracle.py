"""The oracle: what a classifier finds that is given the healthy twin of every record, in as much noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.classic import best_candidate, judged
from diagnose.baselines.features import INDICATORS, FeatureTable, indicators, known_rotation
from diagnose.data.turns import load_inputs
from diagnose.data.windows import SUBSETS, Segments, Task, WindowSet, read_signal, subset_segments
from diagnose.networks.domain import band_levels
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit
from diagnose.scoring.predictions import Prediction, Rows

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
TWIN = "healthy_twin"  # of the data set, dataset.store_healthy_twin=true
NETWORK, ON_INDICATORS = "oracle_network", "oracle_indicators"
Cache = dict[tuple[int, int, int], FloatArray]


def has_twin(dataset: Dataset) -> bool:
    """Whether every record has its healthy twin beside it."""
    return TWIN in getattr(dataset, "signal_names", ())


def oracle_windows(
    task: Task, segments: Segments, model_config: Mapping[str, Any], *, training: bool = False
) -> WindowSet:
    """Inputs of a network (2 x channel, sample): the record, then the record less its twin, both by the same divisor.

    Under ``normalise=rms`` that is the twin's RMS over the stretch, channel by channel. Record and difference say what
    record and twin say; no kernel has to learn to subtract.
    """
    windows = load_inputs(task, segments, model_config, training=training, read=_record_and_difference)
    return replace(windows, normalise="none")


def _record_and_difference(task: Task, record: int, start: int, stop: int) -> NDArray[np.float32]:
    signal, twin = (read_signal(task, record, start, stop, name=name) for name in ("acceleration", TWIN))
    both = np.concatenate([signal, signal - twin])
    if task.normalise == "none":
        return both
    level = np.std(twin, axis=-1, keepdims=True)
    return both * np.tile(np.divide(1, level, out=np.zeros_like(level), where=level > 0), (2, 1))


def oracle_table(task: Task, segments: Segments, cache: Cache) -> FeatureTable:
    """Indicators and band levels of stretches, (row, feature).

    Of every channel: the indicators of record, twin and difference, the levels of the difference in bands, and those of
    the record over the twin's. ``cache`` is filled and used, so that protocols share what they have in common.
    """
    speed, n_teeth = known_rotation(task)
    keys = list(zip(segments.record.tolist(), segments.start.tolist(), segments.stop.tolist(), strict=True))
    for key in keys:
        if key not in cache:
            signal, twin = (read_signal(task, *key, name=name).astype(float) for name in ("acceleration", TWIN))
            three = (signal, twin, signal - twin)
            rotation = {gear: values[key[0]] for gear, values in speed.items()}
            of_each = [indicators(one, task.dataset.sampling_rate, rotation, n_teeth) for one in three]
            own, sound, rest = (band_levels(one) for one in three)
            cache[key] = np.concatenate([*of_each, rest, own - sound], axis=1).ravel()
    n_bands = cache[keys[0]].size // len(task.channel_names) - 3 * len(INDICATORS)
    of_channel = [f"{part}/{name}" for part in ("record", "twin", "difference") for name in INDICATORS]
    of_channel += [f"{part}/band_{band}" for part in ("difference", "ratio") for band in range(n_bands // 2)]
    return FeatureTable(
        values=np.stack([cache[key] for key in keys]),
        names=tuple(f"{channel}/{name}" for channel in task.channel_names for name in of_channel),
        label=task.labels()[segments.record],
        record=segments.record,
    )


def fit_oracle_indicators(task: Task, protocol: str, cache: Cache) -> Prediction:
    """Logistic regression or gradient boosting on `oracle_table`, the better one on the validation units."""
    n_classes = len(task.class_names)
    train, validation, test = (oracle_table(task, subset_segments(task, protocol, subset), cache) for subset in SUBSETS)
    name, model = best_candidate(train, validation, n_classes=n_classes)
    record, log_probability = judged(model, test, n_classes)
    held_out, held_out_scores = judged(model, validation, n_classes)
    return Prediction(
        protocol=protocol,
        method=ON_INDICATORS,
        seed=0,
        record=record,
        log_probability=log_probability,
        detail=name,
        validation=Rows(record=held_out, log_probability=held_out_scores),
    )


def chosen_oracle(task: Task, runs: Sequence[Prediction]) -> str | None:
    """Name of the better of the two on the validation units, mean over its seeds; None where neither ran."""
    labels, n_classes = task.labels(), len(task.class_names)
    scores: dict[str, list[float]] = {}
    for run in runs:
        if run.method in (NETWORK, ON_INDICATORS) and run.validation is not None:
            label, guess = labels[run.validation.record], run.validation.log_probability.argmax(axis=1)
            confusion = confusion_by_unit(label, guess, np.zeros_like(label), n_classes)[0]
            scores.setdefault(run.method, []).append(float(balanced_accuracy(confusion)))
    return max(scores, key=lambda name: float(np.mean(scores[name])), default=None)
