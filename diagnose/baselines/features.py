"""Condition indicators of whole stretches of signal, for the baselines.

A stretch is a whole record, or the part that the split gives to the subset. Short windows are not
enough: averaging needs turns.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from diagnose.data.teeth import GEARS, missing_teeth, teeth_of_records
from diagnose.data.windows import FloatArray, IntArray, Segments, Task, read_signal
from gensig.errors import DatasetError
from gensig.signals.averaging import MIN_TURNS, time_synchronous_average
from gensig.signals.history import na4, nb4
from gensig.signals.indicators import (
    crest_factor,
    energy_ratio,
    fm0,
    fm4,
    kurtosis,
    m6a,
    m8a,
    rms,
    sideband_ratio,
)
from gensig.signals.spectral_kurtosis import spectral_kurtosis

LEVEL = "log_rms"  # at the end of the names of columns


def _of_gears(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{gear}" for gear in GEARS for name in names)


INDICATORS = (LEVEL, "kurtosis", "crest_factor", *_of_gears("fm4", "sideband_ratio"))
FURTHER = (
    "spectral_kurtosis",
    *_of_gears("fm0", "m6a", "m8a", "energy_ratio", "na4", "nb4"),
)
FEATURES = {"basic": INDICATORS, "all": INDICATORS + FURTHER}
BURST_WINDOW = (
    0.005  # s, assumed: shorter than a turn, longer than the decay of a gearbox mode
)
# channels, record, first sample and sample after the last -> values
Key = tuple[tuple[str, ...], int, int, int]
Cache = dict[Key, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureTable:
    """Indicators (row, feature) of stretches, with the label and record of each row."""

    values: FloatArray
    names: tuple[str, ...]
    label: IntArray
    record: IntArray


def indicators(
    signal: FloatArray,
    sampling_rate: float,
    rotation_frequency: Mapping[str, float],
    n_teeth: Mapping[str, int],
    *,
    features: str = "basic",
) -> FloatArray:
    """Indicators of one stretch, in the order of `FEATURES`.

    Parameters
    ----------
    signal : (channel, sample) m/s^2
    sampling_rate : Hz
    rotation_frequency : Hz, of each of `GEARS`
    n_teeth : of each of `GEARS`
    features : of `FEATURES`; "all" takes no average of fewer than
        `gensig.signals.averaging.MIN_TURNS` turns, has the largest line of the spectral kurtosis,
        and NA4 and NB4 of a stretch that has no history

    Returns
    -------
    (channel, indicator); NaN if the stretch holds no whole turn of the gear, or too few
    """
    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True)
    with np.errstate(divide="ignore"):
        columns = [np.log(rms(x)), kurtosis(x), crest_factor(x)]
    min_turns = 1 if features == "basic" else MIN_TURNS
    averages = {}
    for gear in GEARS:
        averages[gear] = np.full((x.shape[0], 1), np.nan)
        try:
            averages[gear] = time_synchronous_average(
                x, sampling_rate, rotation_frequency[gear], min_turns=min_turns
            )
            columns += [
                indicator(averages[gear], n_teeth[gear])
                for indicator in (fm4, sideband_ratio)
            ]
        except ValueError:
            columns += [np.full(x.shape[0], np.nan)] * 2
    if features == "all":
        columns += _further(x, sampling_rate, averages, n_teeth)
    table = np.stack(columns, axis=1)
    return np.where(np.isfinite(table), table, np.nan)


def _further(
    x: FloatArray,
    sampling_rate: float,
    averages: Mapping[str, FloatArray],
    n_teeth: Mapping[str, int],
) -> list[FloatArray]:
    """Columns of `FURTHER`, (channel,) each."""
    columns = [_or_unknown(_bursts, x, sampling_rate)]
    for gear in GEARS:
        average, teeth = averages[gear], n_teeth[gear]
        for indicator in (fm0, m6a, m8a, energy_ratio):
            columns.append(_or_unknown(indicator, average, teeth))
        for of_history in (na4, nb4):
            column = _or_unknown(of_history, average[:, None], teeth)
            columns.append(column.reshape(-1))
    return columns


def _bursts(x: FloatArray, sampling_rate: float) -> FloatArray:
    """(channel,) largest line of the spectral kurtosis."""
    n_window = round(BURST_WINDOW * sampling_rate)
    return spectral_kurtosis(x, sampling_rate, n_window)[1].max(axis=-1)


def _or_unknown(
    indicator: Callable[..., FloatArray], signal: FloatArray, *values: float
) -> FloatArray:
    """The indicator, or NaN if the signal is too short for it."""
    try:
        return indicator(signal, *values)
    except ValueError:
        return np.full(signal.shape[0], np.nan)


def feature_table(
    task: Task,
    segments: Segments,
    cache: Cache | None = None,
    *,
    features: str = "basic",
) -> FeatureTable:
    """Indicators of every stretch, one column per channel and indicator.

    Parameters
    ----------
    task, segments : stretches of the signals
    cache : filled and used, so that protocols share common values; for the same features
    features : of `FEATURES`
    """
    rotation = known_rotation(task)
    rate = task.dataset.sampling_rate

    def values(key: Key) -> FloatArray:
        return indicators(
            read_signal(task, *key[1:]),
            rate,
            rotation.frequencies(key[1]),
            rotation.n_teeth(key[1]),
            features=features,
        ).ravel()

    names = of_channels(task, FEATURES[features])
    return stretch_table(task, segments, names, values, cache)


def keys_of(task: Task, segments: Segments) -> list[Key]:
    """Keys of a `Cache`, one for each stretch."""
    return [(task.channel_names, *row) for row in segments.rows()]


def of_channels(task: Task, names: Sequence[str]) -> tuple[str, ...]:
    """Columns of these names for each channel."""
    return tuple(
        "/".join(pair) for pair in itertools.product(task.channel_names, names)
    )


def stretch_table(
    task: Task,
    segments: Segments,
    names: tuple[str, ...],
    values: Callable[[Key], FloatArray],
    cache: Cache | None = None,
) -> FeatureTable:
    """Table with one row a stretch.

    Parameters
    ----------
    task, segments : stretches of the signals
    names : of the columns
    values : returns the row (column,) of a stretch
    cache : filled and used
    """
    if cache is None:
        cache = {}
    keys = keys_of(task, segments)
    for key in keys:
        if key not in cache:
            cache[key] = values(key)
    return FeatureTable(
        values=np.stack([cache[key] for key in keys]),
        names=names,
        label=task.labels()[segments.record],
        record=segments.record,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotation:
    """Rotation and teeth of the gears of every record.

    Attributes
    ----------
    pinion_frequency : (record,) Hz
    teeth : (record, gear) of `GEARS`
    """

    pinion_frequency: FloatArray
    teeth: IntArray

    def n_teeth(self, record: int) -> dict[str, int]:
        """Teeth of each of `GEARS` in one record."""
        return dict(zip(GEARS, self.teeth[record].tolist(), strict=True))

    def frequencies(self, record: int) -> dict[str, float]:
        """Rotation frequency in Hz of each of `GEARS` in one record."""
        pinion, mesh = self.pinion_frequency[record], self.mesh_frequency(record)
        return {GEARS[0]: float(pinion), GEARS[1]: mesh / int(self.teeth[record, 1])}

    def mesh_frequency(self, record: int) -> float:
        """Passages of a tooth per second in one record."""
        return float(self.pinion_frequency[record] * self.teeth[record, 0])


def known_rotation(task: Task) -> Rotation:
    """Rotation of the records of a task.

    Raises
    ------
    DatasetError    for a data set that does not say the teeth
    """
    if name := missing_teeth(task.dataset):
        raise DatasetError(
            f"the data set does not say {name}; indicators need it (baselines=false)"
        )
    return Rotation(
        pinion_frequency=np.asarray(task.dataset.column("speed_rpm"), dtype=float) / 60,
        teeth=teeth_of_records(task.dataset),
    )
