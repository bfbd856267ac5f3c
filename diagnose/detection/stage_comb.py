"""Speed of the input shaft from the mesh lines of all stages together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.gear_stages import GearStages
from diagnose.recordings.mesh_comb import line_decades
from gensig.signals.resampling import PASS_SHARE

FloatArray = NDArray[np.floating]

NEAR = 0.03  # share of the stated speed, looked at on either side
WIDE = (0.45, 2.2)  # multiples of the stated speed at which another one is looked for
MOST_HARMONICS = 10  # of each mesh
TURNS_A_SEGMENT = 4  # of the slowest shaft, as in mesh_comb
FINE = 0.25  # candidates lie this share of a line's width apart at the highest harmonic
APART = 2.0  # lines of one shaft's width at the lowest mesh: nearer candidates are one


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Speed at which the mesh lines of all stages stand out.

    Attributes
    ----------
    speed_rpm : r/min of the input shaft
    decades : by which all lines together stand above usual lines of the same spectrum
    by_stage : (stage,) the same, of each stage
    """

    speed_rpm: float
    decades: float
    by_stage: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedSearch:
    """Speeds found in a recording.

    Attributes
    ----------
    near : the best near the stated speed, then others there, best first
    elsewhere : the best one farther off; None without any
    width : relative width of a mesh line of the search
    """

    near: tuple[Candidate, ...]
    elsewhere: Candidate | None
    width: float


def search_speed(
    signal: FloatArray, sampling_rate: float, stages: GearStages, speed_rpm: float
) -> SpeedSearch:
    """Candidates for the speed of the input shaft, near a stated one and elsewhere.

    Parameters
    ----------
    signal : (channel, sample)
    sampling_rate : Hz
    speed_rpm : r/min    of the input shaft, as stated

    Notes
    -----
    Every harmonic of every stage within the usable band counts by the decades of `mesh_comb`. The
    stages share one speed, so that a sideband of one stage, which mimics its mesh at a slightly
    other speed, finds no line of the others.
    """
    stated = speed_rpm / 60.0
    orders = np.array(stages.mesh_orders)
    segment = TURNS_A_SEGMENT / (stages.slowest * stated)
    segment = min(segment, signal.shape[-1] / sampling_rate)
    # floor and padding of the spectrum are those of the slowest shaft
    highest = min(PASS_SHARE * sampling_rate, MOST_HARMONICS * orders.max() * stated)
    frequency, decades = line_decades(
        signal, sampling_rate, 1.0 / (stages.slowest * stated), highest
    )
    step = FINE / (highest * segment)
    width = 1.0 / (orders.min() * stated * segment)
    share = np.arange(1.0 - NEAR, 1.0 + NEAR + 0.5 * step, step)
    by_stage = _by_stage(share * stated, orders, frequency, decades, highest)
    near = _peaks(share * speed_rpm, by_stage, APART * width)
    far = np.arange(WIDE[0], WIDE[1], 2.0 * step)
    far = far[np.abs(far - 1.0) > NEAR + APART * width]
    elsewhere = _peaks(
        far * speed_rpm,
        _by_stage(far * stated, orders, frequency, decades, highest),
        APART * width,
    )
    best = elsewhere[0] if elsewhere else None
    return SpeedSearch(near=near, elsewhere=best, width=width)


def _by_stage(
    speeds: FloatArray,
    orders: FloatArray,
    frequency: FloatArray,
    decades: FloatArray,
    highest: float,
) -> FloatArray:
    """(stage, candidate) sums of the decades at the harmonics of every stage."""
    sums = np.zeros((orders.size, speeds.size))
    for stage, order in enumerate(orders):
        lowest = order * speeds.min()
        n_harmonics = min(MOST_HARMONICS, int(highest / lowest))
        for harmonic in range(1, n_harmonics + 1):
            at = harmonic * order * speeds
            inside = at <= highest
            sums[stage, inside] += np.interp(at[inside], frequency, decades)
    return sums


def _peaks(
    speeds: FloatArray, by_stage: FloatArray, apart: float
) -> tuple[Candidate, ...]:
    """The best three candidates at least ``apart`` from each other, relative; best first."""
    total = by_stage.sum(axis=0)
    left = np.ones(total.size, dtype=bool)
    found: list[Candidate] = []
    while left.any() and len(found) < 3:
        best = int(np.where(left, total, -np.inf).argmax())
        left &= np.abs(speeds / speeds[best] - 1.0) > apart
        candidate = Candidate(
            speed_rpm=float(speeds[best]),
            decades=float(total[best]),
            by_stage=tuple(float(value) for value in by_stage[:, best]),
        )
        found.append(candidate)
    return tuple(found)
