"""Averaged turns of gears, rotated so that those of one condition can be subtracted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.reader import Dataset
from gensig.report.conditions import Shown
from gensig.report.rotation_frequencies import GEARS, Rotation
from gensig.signals.alignment import rotation as rotation_between
from gensig.signals.averaging import time_synchronous_average

TURN_POINTS = 4096  # at most, of a turn
POINTS_PER_TOOTH = 64  # at most
FINE_TEETH = 0.05
FINE_STEPS = 101  # odd, so that no rotation is one of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """Averaged turn of a gear.

    Parameters
    ----------
    values : (channel, point)    a whole number of points a tooth, from tooth 0 on where
                                 `from_tooth_0`
    n_turns : turns that were averaged
    from_tooth_0 : False where the data set does not tell the tooth of the first sample
    """

    values: FloatArray
    n_turns: int
    from_tooth_0: bool


def points_per_turn(n_teeth: int) -> int:
    """Points of a turn on the page."""
    return n_teeth * max(min(TURN_POINTS // n_teeth, POINTS_PER_TOOTH), 1)


def gear_teeth(data: Dataset, rotation: Rotation, gear: str, index: int) -> int | None:
    """Teeth of a gear of a record, None for a gear that is unknown."""
    if gear in rotation.n_teeth:
        return int(rotation.n_teeth[gear][index])
    if gear in rotation.further:
        return int(data.n_teeth(gear)[index])
    return None


def turned_gears(
    data: Dataset, rotation: Rotation, shown: Sequence[Shown]
) -> list[str]:
    """Gears whose turns are averaged: those with a fault in these records, or the first known."""
    known = [*rotation.n_teeth, *rotation.further]
    carrying: list[str] = []
    if "fault_gear" in data.column_names:
        column = data.column("fault_gear")
        carrying = [str(column[one.index]) for one in shown if not one.is_twin]
    gears = [gear for gear in dict.fromkeys(carrying) if gear in known]
    return gears or known[:1]


def averaged_turn(
    data: Dataset, rotation: Rotation, shown: Shown, signals: FloatArray, gear: str
) -> Turn | None:
    """Averaged turn of a gear of one record at its mean speed.

    None for a record that holds no whole turn, and for an unknown gear or speed.

    Parameters
    ----------
    signals : (channel, sample)    of the record or of its twin
    """
    index = shown.index
    n_teeth = gear_teeth(data, rotation, gear, index)
    rate = rotation.of(index).get(gear)
    if n_teeth is None or rate is None:
        return None
    n_turns = int((signals.shape[-1] + 1e-6) * rate / data.sampling_rate)
    if n_turns < 1:
        return None
    average = time_synchronous_average(signals, data.sampling_rate, rate)
    started = tooth_at_start(data, index, gear)
    values = turned(average, (started or 0.0) / n_teeth, points_per_turn(n_teeth))
    return Turn(values=values, n_turns=n_turns, from_tooth_0=started is not None)


def tooth_at_start(data: Dataset, index: int, gear: str) -> float | None:
    """Position in teeth of a gear at a record's first sample, None where it is not known."""
    names = (f"start_tooth_{gear}", "start_phase")
    if gear not in GEARS or not set(names) <= set(data.column_names):
        return None
    position = float(sum(data.column(name)[index] for name in names))
    if not np.isfinite(position) or position < 0.0:
        return None
    return position


def turned(average: FloatArray, start: float, n_points: int) -> FloatArray:
    """A turn (..., sample) that begins at position `start` of the gear, from position 0 on.

    Parameters
    ----------
    start : share of a turn
    n_points : of the result; fewer than samples leave out what they cannot show

    Returns
    -------
    (..., point)
    """
    n_samples = average.shape[-1]
    spectrum = np.fft.rfft(average, axis=-1)
    n_orders = (min(n_samples, n_points) + 1) // 2
    order = np.arange(n_orders)
    moved = spectrum[..., :n_orders] * np.exp(-2j * np.pi * order * start)
    return np.fft.irfft(moved, n=n_points, axis=-1) * (n_points / n_samples)


def aligned(turns: Sequence[Turn | None], n_teeth: int) -> list[Turn | None]:
    """Turns of one gear and condition, rotated to the first.

    Turns whose tooth 0 is known are rotated by at most `FINE_TEETH`: at the first sample, shafts
    lag behind the set-point by a little. Others are rotated as far as it takes. The rotation is
    that of the largest circular cross-correlation, summed over the channels.
    """
    first = next((turn for turn in turns if turn is not None), None)
    result: list[Turn | None] = []
    for turn in turns:
        if turn is None or first is None:
            result.append(None)
            continue
        values = turn.values
        if not (turn.from_tooth_0 and first.from_tooth_0):
            values = np.roll(values, -rotation_between(values, first.values), axis=-1)
        by = _fine_rotation(values, first.values, n_teeth)
        result.append(replace(turn, values=turned(values, by, values.shape[-1])))
    return result


def _fine_rotation(turn: FloatArray, to: FloatArray, n_teeth: int) -> float:
    """Share of a turn, at most `FINE_TEETH`, that a turn (channel, point) moves to fit another."""
    spectra = [np.fft.rfft(values, axis=-1) for values in (turn, to)]
    crossed = (spectra[0] * spectra[1].conj()).sum(axis=0)
    shifts = np.linspace(-FINE_TEETH, FINE_TEETH, FINE_STEPS) / n_teeth
    orders = np.arange(crossed.size)
    correlation = np.exp(-2j * np.pi * np.outer(shifts, orders)) @ crossed
    return float(shifts[np.argmax(correlation.real)])


def conspicuity(faulty: FloatArray, healthy: FloatArray) -> float:
    """RMS of the difference of two turns (point,) over the RMS of the healthy one."""
    level = float(np.sqrt(np.mean(np.square(healthy - healthy.mean()))))
    change = faulty - healthy
    difference = float(np.sqrt(np.mean(np.square(change - change.mean()))))
    if level == 0.0:
        return 0.0
    return difference / level
