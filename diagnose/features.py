"""Condition indicators of whole stretches of signal, for the baselines.

A stretch (a whole record, or what the split gives to the subset) rather than a short window: averaging needs turns.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.windows import Segments, Task, read_signal
from gensig.errors import DatasetError
from gensig.signals.averaging import time_synchronous_average
from gensig.signals.indicators import crest_factor, fm4, kurtosis, rms, sideband_ratio

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
GEARS = ("pinion", "wheel")
INDICATORS = (
    "log_rms",
    "kurtosis",
    "crest_factor",
    *(f"{name}_{gear}" for gear in GEARS for name in ("fm4", "sideband_ratio")),
)
Cache = dict[tuple[int, int, int], FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureTable:
    """Indicators (row, feature) of stretches, with the label and record of each row."""

    values: FloatArray
    names: tuple[str, ...]
    label: IntArray
    record: IntArray


def indicators(
    signal: FloatArray, sampling_rate: float, rotation_frequency: Mapping[str, float], n_teeth: Mapping[str, int]
) -> FloatArray:
    """Indicators of one stretch, in the order of `INDICATORS`.

    Parameters
    ----------
    signal : (channel, sample) m/s^2
    sampling_rate : Hz
    rotation_frequency : Hz, of each of `GEARS`
    n_teeth : of each of `GEARS`

    Returns
    -------
    (channel, indicator); NaN where the stretch holds no whole turn of the gear
    """
    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True)
    with np.errstate(divide="ignore"):
        columns = [np.log(rms(x)), kurtosis(x), crest_factor(x)]
    for gear in GEARS:
        try:
            average = time_synchronous_average(x, sampling_rate, rotation_frequency[gear])
            columns += [fm4(average, n_teeth[gear]), sideband_ratio(average, n_teeth[gear])]
        except ValueError:
            columns += [np.full(x.shape[0], np.nan)] * 2
    table = np.stack(columns, axis=1)
    return np.where(np.isfinite(table), table, np.nan)


def feature_table(task: Task, segments: Segments, *, cache: Cache | None = None, n_threads: int = 1) -> FeatureTable:
    """Indicators of every stretch, one column per channel and indicator.

    Parameters
    ----------
    task, segments : which signals
    cache : filled and used, so that protocols share what they have in common
    n_threads : stretches computed at once; the values do not depend on it
    """
    known: Cache = {} if cache is None else cache
    speed_rpm = np.asarray(task.dataset.column("speed_rpm"), dtype=float)
    n_teeth = {gear: _n_teeth(task.dataset.attributes, gear) for gear in GEARS}
    keys = list(zip(segments.record.tolist(), segments.start.tolist(), segments.stop.tolist(), strict=True))

    def compute(key: tuple[int, int, int]) -> FloatArray:
        pinion = speed_rpm[key[0]] / 60
        frequency = {"pinion": pinion, "wheel": pinion * n_teeth["pinion"] / n_teeth["wheel"]}
        return indicators(signals[key], task.dataset.sampling_rate, frequency, n_teeth).ravel()

    missing = [key for key in keys if key not in known]
    with ThreadPoolExecutor(max_workers=n_threads) as pool:
        for first in range(0, len(missing), 32):
            block = missing[first : first + 32]
            signals = {key: read_signal(task, *key) for key in block}
            known.update(zip(block, pool.map(compute, block), strict=True))
    return FeatureTable(
        values=np.stack([known[key] for key in keys]),
        names=tuple(f"{channel}/{name}" for channel in task.channel_names for name in INDICATORS),
        label=task.labels()[segments.record],
        record=segments.record,
    )


def _n_teeth(attributes: Mapping[str, Any], gear: str) -> int:
    try:
        return int(attributes[f"n_teeth_{gear}"])
    except KeyError:
        raise DatasetError(f"the data set does not say n_teeth_{gear}; indicators need it (baselines=false)") from None
