"""The oracle.

What a classifier finds that is given the healthy twin of every record, in as much noise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Input, MethodText, Parts, Role, Source
from diagnose.baselines.chosen_model import ChosenModelBaseline
from diagnose.baselines.features import (
    INDICATORS,
    Cache,
    FeatureTable,
    indicators,
    known_rotation,
)
from diagnose.data.inputs import NetworkInput
from diagnose.data.windows import Segments, Task, WindowSet, read_signal
from diagnose.networks.domain import band_levels

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
TWIN = "healthy_twin"  # of the data set, dataset.store_healthy_twin=true


def has_twin(dataset: Dataset) -> bool:
    """Whether every record has its healthy twin beside it."""
    return TWIN in getattr(dataset, "signal_names", ())


def oracle_windows(
    task: Task, segments: Segments, inputs: NetworkInput, *, training: bool = False
) -> WindowSet:
    """Inputs of a network (2 x channel, sample): the record, then the record less its twin, both
    by the same divisor.

    Under ``normalise=rms`` that is the twin's RMS over the stretch, channel by channel. Record
    and difference say what record and twin say; no kernel has to learn to subtract.
    """
    windows = inputs.load(
        task, segments, training=training, read=_record_and_difference
    )
    return replace(windows, normalise="none")


def _record_and_difference(
    task: Task, record: int, start: int, stop: int
) -> NDArray[np.float32]:
    signal, twin = (
        read_signal(task, record, start, stop, name=name)
        for name in ("acceleration", TWIN)
    )
    both = np.concatenate([signal, signal - twin])
    if task.normalise == "none":
        return both
    level = np.std(twin, axis=-1, keepdims=True)
    return both * np.tile(
        np.divide(1, level, out=np.zeros_like(level), where=level > 0), (2, 1)
    )


def oracle_table(task: Task, segments: Segments, cache: Cache) -> FeatureTable:
    """Indicators and band levels of stretches, (row, feature).

    Of every channel: the indicators of record, twin and difference, the levels of the difference
    in bands, and those of the record over the twin's. ``cache`` is filled and used, so that
    protocols share what they have in common.
    """
    speed, n_teeth = known_rotation(task)
    stretches = zip(
        segments.record.tolist(),
        segments.start.tolist(),
        segments.stop.tolist(),
        strict=True,
    )
    keys = [(task.channel_names, *stretch) for stretch in stretches]
    for key in keys:
        if key in cache:
            continue
        signal = read_signal(task, *key[1:]).astype(float)
        twin = read_signal(task, *key[1:], name=TWIN).astype(float)
        three = (signal, twin, signal - twin)
        rotation = {gear: values[key[1]] for gear, values in speed.items()}
        rate = task.dataset.sampling_rate
        columns = [indicators(part, rate, rotation, n_teeth) for part in three]
        faulty, sound, rest = (band_levels(part) for part in three)
        cache[key] = np.concatenate([*columns, rest, faulty - sound], axis=1).ravel()
    n_bands = cache[keys[0]].size // len(task.channel_names) - 3 * len(INDICATORS)
    of_channel = [
        f"{part}/{name}"
        for part in ("record", "twin", "difference")
        for name in INDICATORS
    ]
    of_channel += [
        f"{part}/band_{band}"
        for part in ("difference", "ratio")
        for band in range(n_bands // 2)
    ]
    return FeatureTable(
        values=np.stack([cache[key] for key in keys]),
        names=tuple(
            f"{channel}/{name}" for channel in task.channel_names for name in of_channel
        ),
        label=task.labels()[segments.record],
        record=segments.record,
    )


def twin_tables(source: Source) -> Parts:
    """Tables of records and twins in every subset."""
    cache = source.caches.setdefault(TWIN_INPUT.name, {})

    def table(subset: str) -> FeatureTable:
        return oracle_table(source.part(subset), source.segments(subset), cache)

    return Parts(
        train=table("train"), validation=table("validation"), test=table("test")
    )


TWIN_INPUT = Input(name="with_twins", make=twin_tables)


@final
class OracleIndicators(ChosenModelBaseline):
    """Logistic regression or gradient boosting on `oracle_table`."""

    text = MethodText(
        name="oracle_indicators",
        label="indicators",
        card_label=None,
        meaning="logistic regression or gradient boosting (chosen on validation units) on "
        "indicators and band levels of the record, its healthy twin and their difference.",
    )
    role = Role.BOUND
    reads = TWIN_INPUT
