"""Comparison of a data set with published measurements.

``python -m benchmarks.realism`` is the whole comparison, with records made for it. This module has
the quantities that need no two records at the same set-points, or find them.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.reader import Dataset
from gensig.report.realism import Comparison, RangeKey, compare, read_ranges
from gensig.report.values import Measured
from gensig.signals.indicators import kurtosis, rms
from gensig.signals.resampling import rate_change

RATE = 5000.0  # Hz, of the measured records
ALL, ELSEWHERE = "all conditions", "elsewhere"


def at_measured_rate(signal: FloatArray, sampling_rate: float) -> dict[str, FloatArray]:
    """RMS and kurtosis of the band that the measured records have.

    Signal (channel, sample), results (channel,).
    """
    if sampling_rate < RATE:
        unknown = np.full(signal.shape[0], np.nan)
        return {"rms_5_khz": unknown, "kurtosis_5_khz": unknown}
    x = rate_change(sampling_rate, RATE).apply(signal)
    return {"rms_5_khz": rms(x), "kurtosis_5_khz": kurtosis(x)}


def compare_with_measurements(
    data: Dataset, measured: Measured, units: list[str]
) -> list[Comparison]:
    """Every quantity with a measured range for which the data set has values.

    Parameters
    ----------
    units : of the channels of `measured`; ranges are of accelerations in m/s^2
    """
    shown = [number for number, unit in enumerate(units) if unit == "m/s^2"]
    if not shown or not measured.records.size:
        return []
    values = {name: of[:, shown] for name, of in measured.values.items()}
    label = data.column("label_name")[measured.records]
    result: dict[RangeKey, FloatArray] = {}
    for name in data.class_names:
        mine = label == name
        for at in (ALL, ELSEWHERE):
            result[f"{name}.kurtosis", at] = values["kurtosis_5_khz"][mine]
    result |= _ratios(data, measured, values)
    ranges = read_ranges()
    compared = [
        compare(ranges[key], of)
        for key, of in result.items()
        if key in ranges and np.isfinite(of).any()
    ]
    return [row for row in compared if row.low is not None or row.high is not None]


def _ratios(
    data: Dataset, measured: Measured, values: dict[str, FloatArray]
) -> dict[RangeKey, FloatArray]:
    """Faulty record over healthy one of another set of gears, in one gearbox at one set-point."""
    records = measured.records
    if "speed_set_rpm" not in data.column_names:
        return {}
    keys = [
        data.column(name)[records].tolist()
        for name in ("gearbox_id", "speed_set_rpm", "torque_nm")
    ]
    condition = list(zip(*keys, strict=True))
    specimen = data.column("specimen_id")[records]
    label = data.column("label_name")[records]
    sound: dict[tuple[object, ...], list[int]] = defaultdict(list)
    for row in np.flatnonzero(label == "healthy").tolist():
        sound[condition[row]].append(row)
    result: dict[RangeKey, list[FloatArray]] = defaultdict(list)
    for row in np.flatnonzero(label != "healthy").tolist():
        for other in sound[condition[row]]:
            if specimen[row] != specimen[other]:
                for name in ("rms", "kurtosis"):
                    level = values[f"{name}_5_khz"]
                    ratio = level[row] / level[other]
                    result[f"{label[row]}.{name}_ratio", ALL].append(ratio)
    return {name: np.concatenate(ratios) for name, ratios in result.items()}
