"""From data sets to the numbers of the yardstick.

Indicators a record and sensor, quantities over pairs of records.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.dataset.reader import Dataset
from gensig.report.realism import RangeKey
from gensig.signals.averaging import samples_per_turn_for
from gensig.signals.impacts import impact_decay, impacts_per_turn, peak_over_rms
from gensig.signals.indicators import fm4, kurtosis, rms
from gensig.signals.rotation import resample_by_angle
from gensig.signals.synchronous import (
    mesh_harmonics,
    nonsynchronous_share,
    residual_turns,
)

FloatArray = NDArray[np.floating]

RATE = 5000.0  # Hz, of the measured records
N_HARMONICS = 3
SLOW, ELSEWHERE, ALL = "slow and light", "elsewhere", "all conditions"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """One row a record.

    Plain columns (record,), and indicators (record, channel) or (record, channel, harmonic).
    """

    columns: dict[str, NDArray[Any]]
    indicators: dict[str, FloatArray]
    n_failed: int


def to_rate(signal: ArrayLike, sampling_rate: float, rate: float) -> FloatArray:
    """A signal less its mean at another rate, by a polyphase filter against aliasing.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate, rate : Hz

    Returns
    -------
    (..., sample)
    """
    from scipy.signal import resample_poly

    x = np.asarray(signal, dtype=float)
    ratio = Fraction(rate / sampling_rate).limit_denominator(4096)
    return resample_poly(
        x - x.mean(axis=-1, keepdims=True), ratio.numerator, ratio.denominator, axis=-1
    )


def record_values(
    acceleration: ArrayLike,
    angle: ArrayLike,
    sampling_rate: float,
    rotation_frequency: float,
    n_teeth: int,
) -> dict[str, FloatArray]:
    """Indicators of one record.

    Parameters
    ----------
    acceleration : (channel, sample) m/s^2
    angle : (sample,) rad           of the faulted gear's shaft
    sampling_rate : Hz
    rotation_frequency : Hz         mean turns of that shaft per second
    n_teeth : teeth of the faulted gear
    """
    full = np.asarray(acceleration, dtype=float)
    full = full - full.mean(axis=-1, keepdims=True)
    x = to_rate(full, sampling_rate, RATE)
    turned = np.interp(
        np.arange(x.shape[-1]) / RATE, np.arange(full.shape[-1]) / sampling_rate, angle
    )
    turns = resample_by_angle(x, turned, samples_per_turn_for(RATE, rotation_frequency))
    average, residual = turns.mean(axis=-2), residual_turns(turns, n_teeth)
    return {
        "rms": rms(x),
        "kurtosis": kurtosis(x),
        "rms_full_band": rms(full),
        "kurtosis_full_band": kurtosis(full),
        "fm4": fm4(average, n_teeth),
        "mesh": mesh_harmonics(average, n_teeth, N_HARMONICS),
        "nonsynchronous_share": nonsynchronous_share(turns),
        "impacts_per_turn": impacts_per_turn(residual, n_teeth),
        "peak_over_residual": peak_over_rms(residual),
        "impact_decay": 1e3 * impact_decay(residual, 1.0 / rotation_frequency),
        "n_turns": np.full(x.shape[0], float(turns.shape[-2])),
    }


def read_table(data: Dataset) -> Table:
    """Indicators of all records that did not fail.

    The faulted gear is that of the record's fault, else the pinion.
    """
    usable = np.flatnonzero(data.usable)
    names = (
        "label_name",
        "unit_id",
        "gearbox_id",
        "specimen_id",
        "condition_id",
        "speed_set_rpm",
        "torque_nm",
    )
    columns = {name: np.asarray(data.column(name))[usable] for name in names}
    rows = [_values_at(data, index) for index in usable.tolist()]
    indicators = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Table(
        columns=columns, indicators=indicators, n_failed=data.n_records - usable.size
    )


def _values_at(data: Dataset, index: int) -> dict[str, FloatArray]:
    teeth = {
        gear: int(data.attributes[f"n_teeth_{gear}"]) for gear in ("pinion", "wheel")
    }
    gear = str(data.column("fault_gear")[index]) or "pinion"
    slower = (
        teeth["pinion"] / teeth[gear]
    )  # turns of the faulted gear for one of the driving pinion
    angle = slower * np.asarray(data.trace(index, "shaft_angle"))
    rotation = slower * float(data.column("speed_rpm")[index]) / 60.0
    return record_values(
        data.signals(index), angle, data.sampling_rate, rotation, teeth[gear]
    )


def quantities(table: Table) -> dict[RangeKey, FloatArray]:
    """Every quantity of the yardstick by id and conditions, all its values in one row."""
    result: dict[RangeKey, list[FloatArray]] = {}
    for quantity, where, values in _quantities(table):
        result.setdefault((quantity, where), []).append(np.ravel(values))
    return {place: np.concatenate(values) for place, values in result.items()}


def _quantities(table: Table) -> Iterator[tuple[str, str, FloatArray]]:
    columns, values = table.columns, table.indicators
    slow = _slow_and_light(columns)
    healthy = np.flatnonzero(columns["label_name"] == "healthy")
    for name in ("kurtosis", "kurtosis_full_band", "nonsynchronous_share"):
        yield f"healthy.{name}", ALL, values[name][healthy]
    for one, other in _pairs(columns, healthy, healthy, another=True):
        yield (
            "healthy.mesh_amplitude_ratio",
            ALL,
            values["mesh"][one, :, 0] / values["mesh"][other, :, 0],
        )
    for unit in np.unique(columns["unit_id"][healthy]):
        mine = healthy[columns["unit_id"][healthy] == unit]
        yield "healthy.harmonic_decades", ALL, harmonic_decades(values["mesh"][mine])
    for name in np.unique(columns["label_name"]):
        if name == "healthy":
            continue
        faulty = np.flatnonzero(columns["label_name"] == name)
        for one in faulty:
            where = SLOW if slow[one] else ELSEWHERE
            for indicator in (
                "kurtosis",
                "kurtosis_full_band",
                "impacts_per_turn",
                "impact_decay",
                "peak_over_residual",
            ):
                for place in (where, ALL):
                    yield f"{name}.{indicator}", place, values[indicator][one]
        for another, suffix in ((True, ""), (False, "_same_unit")):
            for one, other in _pairs(columns, faulty, healthy, another=another):
                for indicator, of in RATIOS.items():
                    yield (
                        f"{name}.{indicator}{suffix}",
                        ALL,
                        values[of][one] / values[of][other],
                    )


RATIOS = {
    "rms_ratio": "rms",
    "kurtosis_ratio": "kurtosis",
    "fm4_ratio": "fm4",
    "rms_ratio_full_band": "rms_full_band",
    "kurtosis_ratio_full_band": "kurtosis_full_band",
}


def harmonic_decades(mesh: FloatArray) -> FloatArray:
    """Spread of the harmonic ratios of one unit over its sensors and conditions.

    Parameters
    ----------
    mesh : (condition, channel, harmonic) m/s^2

    Returns
    -------
    () decades, between the least and the largest ratio of a higher harmonic to the first
    """
    ratios = np.log10(mesh[..., 1:] / mesh[..., :1])
    return np.asarray(np.nanmax(ratios) - np.nanmin(ratios))


def _slow_and_light(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    speed, torque = columns["speed_set_rpm"], columns["torque_nm"]
    return (speed == speed.min()) & (torque == torque.min())


def _pairs(
    columns: Mapping[str, NDArray[Any]],
    faulty: NDArray[np.intp],
    healthy: NDArray[np.intp],
    *,
    another: bool,
) -> Iterator[tuple[int, int]]:
    """Faulty and healthy records of one gearbox at one set-point, of another specimen or of the
    same.
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    keys, specimen = (
        ("gearbox_id", "speed_set_rpm", "torque_nm"),
        columns["specimen_id"],
    )
    for other in healthy.tolist():
        groups.setdefault(tuple(columns[key][other] for key in keys), []).append(other)
    for one in faulty.tolist():
        for other in groups.get(tuple(columns[key][one] for key in keys), []):
            if one != other and bool(specimen[one] != specimen[other]) == another:
                yield one, other
