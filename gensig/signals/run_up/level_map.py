"""Levels over speed and an axis, frame by frame, and the peaks of a level over speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.arrays import FloatArray

FEWEST_SPEEDS, MOST_SPEEDS = 12, 60  # of a map by speed
LEAST_PROMINENCE = 3.0  # dB; assumed


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelMap:
    """RMS values of the frames of a signal over an axis.

    Attributes
    ----------
    time : (frame,) s         middle of every frame
    speed : (frame,) rad/s    mean of the shaft within every frame
    axis : (bin,)             orders of the shaft, or frequencies in Hz
    rms : (..., frame, bin)   in the unit of the signal; NaN above the highest usable frequency
    total : (..., frame)      RMS of the whole frame less its mean
    resolution : width of a line at half of its power, in the unit of the axis
    """

    time: FloatArray
    speed: FloatArray
    axis: FloatArray
    rms: FloatArray
    total: FloatArray
    resolution: float

    def at(self, place: float) -> FloatArray:
        """RMS at the bin nearest to a place of the axis, (..., frame).

        A Hann window reads a line halfway between two bins 1.4 dB too low.
        """
        return self.rms[..., int(np.abs(self.axis - place).argmin())]

    def around(self, place: float, reach: float) -> FloatArray:
        """Median of the bins within a reach of a place of the axis, (..., frame): its floor."""
        near = np.abs(self.axis - place) <= reach
        return np.asarray(np.median(self.rms[..., near], axis=-1))

    def up_to(self, place: float) -> LevelMap:
        """The part of the map up to a place of its axis."""
        kept = self.axis <= place
        return LevelMap(
            time=self.time,
            speed=self.speed,
            axis=self.axis[kept],
            rms=self.rms[..., kept],
            total=self.total,
            resolution=self.resolution,
        )

    def by_speed(self) -> LevelMap:
        """The map at evenly spaced speeds, rising.

        Frames of one step of speed are averaged by power, whether the speed rose or fell. A step
        without a frame is NaN, its time too. The steps, at least `FEWEST_SPEEDS` and at most
        `MOST_SPEEDS`, are no narrower than the widest gap between two frames.
        """
        low, high = float(self.speed.min()), float(self.speed.max())
        gap = float(np.diff(np.sort(self.speed)).max(initial=0.0))
        n_steps = FEWEST_SPEEDS
        if gap > 0.0:
            widest = math.floor((high - low) / gap)
            n_steps = min(MOST_SPEEDS, max(FEWEST_SPEEDS, widest))
        edges = np.linspace(low, high, n_steps + 1)
        step = np.clip(np.searchsorted(edges, self.speed, "right") - 1, 0, n_steps - 1)
        member = (step == np.arange(n_steps)[:, None]).astype(float)  # (step, frame)
        total = _mean(member, np.square(self.total)[..., None])[..., 0]
        return LevelMap(
            time=_mean(member, self.time[:, None])[:, 0],
            speed=0.5 * (edges[1:] + edges[:-1]),
            axis=self.axis,
            rms=np.sqrt(_mean(member, np.square(self.rms))),
            total=np.sqrt(total),
            resolution=self.resolution,
        )


def _mean(member: FloatArray, values: FloatArray) -> FloatArray:
    """Means of values (..., frame, bin) over the frames of each step, (..., step, bin).

    ``member`` (step, frame) is 1 for the frames of a step. NaN values are left out; a step without
    others is NaN.
    """
    known = np.isfinite(values)
    count = member @ known.astype(float)
    mean = np.full(count.shape, np.nan)
    whole = member @ np.where(known, values, 0.0)
    return np.divide(whole, count, out=mean, where=count > 0.0)


def decibels(rms: ArrayLike, reference: float) -> FloatArray:
    """Level of RMS values over a reference in the same unit, dB; -inf for a value of 0."""
    with np.errstate(divide="ignore"):
        return 20.0 * np.log10(np.asarray(rms, dtype=float) / reference)


def peaks_over_speed(
    level: ArrayLike, *, most: int = 3, prominence: float = LEAST_PROMINENCE
) -> NDArray[np.intp]:
    """Indices of the most prominent peaks of a level over speed, in the order of the speed.

    Parameters
    ----------
    level : (speed,) dB        NaN is passed over
    most : int                 so many peaks at most
    prominence : dB            height over the higher of the two valleys beside a peak, at least

    Source: `scipy.signal.find_peaks`.
    """
    from scipy.signal import find_peaks

    values = np.asarray(level, dtype=float)
    known = np.flatnonzero(np.isfinite(values))
    found, facts = find_peaks(values[known], prominence=prominence)
    strongest = np.argsort(-facts["prominences"], kind="stable")[:most]
    return known[np.sort(found[strongest])]
