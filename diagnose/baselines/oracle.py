"""The oracle: a classifier that also reads the healthy twin of every record, with its noise."""

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
    Key,
    indicators,
    known_rotation,
    of_channels,
    stretch_table,
)
from diagnose.data.inputs import NetworkInput
from diagnose.data.windows import FloatArray, Segments, Task, WindowSet, read_signal
from diagnose.networks.domain import N_BANDS, band_levels

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

TWIN = "healthy_twin"  # of the data set, dataset.store_healthy_twin=true


def has_twin(dataset: Dataset) -> bool:
    """True if the data set stores the healthy twin of every record."""
    return TWIN in getattr(dataset, "signal_names", ())


def oracle_windows(
    task: Task, segments: Segments, inputs: NetworkInput, *, training: bool = False
) -> WindowSet:
    """Inputs of a network (2 x channel, sample): the record, then the record less its twin.

    Both have the same divisor: with ``normalise=rms`` the twin's RMS over the stretch, channel by
    channel. Record and difference hold the same as record and twin, but no kernel has to learn to
    subtract. Redraws have no twin, so an oracle has none.
    """
    stored, read = inputs.of_stored_records, _record_and_difference
    windows = stored.load(task, segments, training=training, read=read)
    return replace(windows, normalise="none")


def _record_and_difference(
    task: Task, record: int, start: int, stop: int
) -> NDArray[np.float32]:
    signal = read_signal(task, record, start, stop)
    twin = read_signal(task, record, start, stop, name=TWIN)
    both = np.concatenate([signal, signal - twin])
    if task.normalise == "none":
        return both
    level = np.std(twin, axis=-1, keepdims=True)
    factor = np.divide(1, level, out=np.zeros_like(level), where=level > 0)
    return both * np.tile(factor, (2, 1))


def oracle_table(task: Task, segments: Segments, cache: Cache) -> FeatureTable:
    """Indicators and band levels of stretches, (row, feature).

    For every channel: the indicators of record, twin and difference, the band levels of the
    difference, and those of the record over the twin's. ``cache`` is filled and used, so that
    protocols share common values.
    """
    rotation = known_rotation(task)
    rate = task.dataset.sampling_rate

    def values(key: Key) -> FloatArray:
        signal = read_signal(task, *key[1:]).astype(float)
        twin = read_signal(task, *key[1:], name=TWIN).astype(float)
        three = (signal, twin, signal - twin)
        frequency, n_teeth = rotation.frequencies(key[1]), rotation.n_teeth(key[1])
        columns = [indicators(part, rate, frequency, n_teeth) for part in three]
        faulty, sound, rest = (band_levels(part) for part in three)
        return np.concatenate([*columns, rest, faulty - sound], axis=1).ravel()

    bands = [f"band_{band}" for band in range(N_BANDS)]
    groups = {
        ("record", "twin", "difference"): INDICATORS,
        ("difference", "ratio"): bands,
    }
    of_channel = [
        f"{part}/{name}"
        for parts, names in groups.items()
        for part in parts
        for name in names
    ]
    return stretch_table(task, segments, of_channels(task, of_channel), values, cache)


def twin_tables(source: Source) -> Parts:
    """Tables of records and twins in every subset."""
    return source.tables(TWIN_INPUT.name, oracle_table)


TWIN_INPUT = Input(name="with_twins", make=twin_tables)


@final
class OracleIndicators(ChosenModelBaseline):
    """Logistic regression or gradient boosting on `oracle_table`."""

    text = MethodText(
        name="oracle_indicators",
        label="indicators",
        card_label=None,
        meaning="logistic regression or gradient boosting (chosen on validation machines) on "
        "indicators and band levels of the record, its healthy twin and their difference.",
    )
    role = Role.BOUND
    reads = TWIN_INPUT
