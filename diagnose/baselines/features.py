"""Condition indicators of whole stretches of signal, for the baselines.

A stretch (a whole record, or what the split gives to the subset) rather than a short window:
averaging needs turns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import Segments, Task, read_signal
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

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
GEARS = ("pinion", "wheel")
LEVEL = "log_rms"  # at the end of the names of columns
INDICATORS = (
    LEVEL,
    "kurtosis",
    "crest_factor",
    *(f"{name}_{gear}" for gear in GEARS for name in ("fm4", "sideband_ratio")),
)
FURTHER = (
    "spectral_kurtosis",
    *(
        f"{name}_{gear}"
        for gear in GEARS
        for name in ("fm0", "m6a", "m8a", "energy_ratio", "na4", "nb4")
    ),
)
FEATURES = {"basic": INDICATORS, "all": INDICATORS + FURTHER}
BURST_WINDOW = (
    0.005  # s, assumed: shorter than a turn, longer than a gearbox mode rings
)
Cache = dict[
    tuple[tuple[str, ...], int, int, int], FloatArray
]  # channels, record, first and last sample


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
    features : of `FEATURES`; "all" takes no average of fewer than `gensig.signals.averaging.MIN_TURNS` turns, has the
               largest line of the spectral kurtosis, and NA4 and NB4 of a stretch that has no history

    Returns
    -------
    (channel, indicator); NaN where the stretch holds no whole turn of the gear, or too few
    """
    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True)
    with np.errstate(divide="ignore"):
        columns = [np.log(rms(x)), kurtosis(x), crest_factor(x)]
    min_turns = 1 if features == "basic" else MIN_TURNS
    averages = {gear: np.full((x.shape[0], 1), np.nan) for gear in GEARS}
    for gear in GEARS:
        try:
            average = time_synchronous_average(
                x, sampling_rate, rotation_frequency[gear], min_turns=min_turns
            )
            averages[gear] = average
            columns += [
                fm4(average, n_teeth[gear]),
                sideband_ratio(average, n_teeth[gear]),
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
        for indicator in (fm0, m6a, m8a, energy_ratio):
            columns.append(_or_unknown(indicator, averages[gear], n_teeth[gear]))
        for of_history in (na4, nb4):
            columns.append(
                _or_unknown(of_history, averages[gear][:, None], n_teeth[gear]).reshape(
                    -1
                )
            )
    return columns


def _bursts(x: FloatArray, sampling_rate: float) -> FloatArray:
    """(channel,) largest line of the spectral kurtosis."""
    return spectral_kurtosis(x, sampling_rate, round(BURST_WINDOW * sampling_rate))[
        1
    ].max(axis=-1)


def _or_unknown(
    indicator: Callable[..., FloatArray], signal: FloatArray, *values: float
) -> FloatArray:
    """The indicator, NaN where the signal is too short for it."""
    try:
        return indicator(signal, *values)
    except ValueError:
        return np.full(signal.shape[0], np.nan)


def feature_table(
    task: Task,
    segments: Segments,
    *,
    features: str = "basic",
    cache: Cache | None = None,
    n_threads: int = 1,
) -> FeatureTable:
    """Indicators of every stretch, one column per channel and indicator.

    Parameters
    ----------
    task, segments : which signals
    features : of `FEATURES`
    cache : filled and used, so that protocols share what they have in common; for the same features
    n_threads : stretches computed at once; the values do not depend on it
    """
    known: Cache = {} if cache is None else cache
    speed, n_teeth = known_rotation(task)
    keys = list(
        zip(
            segments.record.tolist(),
            segments.start.tolist(),
            segments.stop.tolist(),
            strict=True,
        )
    )

    def compute(key: tuple[int, int, int]) -> FloatArray:
        frequency = {gear: values[key[0]] for gear, values in speed.items()}
        return indicators(
            signals[key],
            task.dataset.sampling_rate,
            frequency,
            n_teeth,
            features=features,
        ).ravel()

    missing = [key for key in keys if (task.channel_names, *key) not in known]
    with ThreadPoolExecutor(max_workers=n_threads) as pool:
        for first in range(0, len(missing), 32):
            block = missing[first : first + 32]
            signals = {key: read_signal(task, *key) for key in block}
            names = [(task.channel_names, *key) for key in block]
            known.update(zip(names, pool.map(compute, block), strict=True))
    return FeatureTable(
        values=np.stack([known[(task.channel_names, *key)] for key in keys]),
        names=tuple(
            f"{channel}/{name}"
            for channel in task.channel_names
            for name in FEATURES[features]
        ),
        label=task.labels()[segments.record],
        record=segments.record,
    )


def known_rotation(task: Task) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Rotation frequency in Hz, (record,), and number of teeth of each of `GEARS`."""
    pinion = np.asarray(task.dataset.column("speed_rpm"), dtype=float) / 60
    n_teeth = {gear: _n_teeth(task.dataset.attributes, gear) for gear in GEARS}
    return {
        "pinion": pinion,
        "wheel": pinion * n_teeth["pinion"] / n_teeth["wheel"],
    }, n_teeth


def _n_teeth(attributes: Mapping[str, Any], gear: str) -> int:
    try:
        return int(attributes[f"n_teeth_{gear}"])
    except KeyError:
        raise DatasetError(
            f"the data set does not say n_teeth_{gear}; indicators need it (baselines=false)"
        ) from None
