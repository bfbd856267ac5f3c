"""Order map and waterfall of a shaft that speeds up or slows down."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.rotation import resample_by_angle
from gensig.signals.run_up.level_map import LevelMap

LEAST_CHANGE = 0.05  # of the speed, from which a record counts as a run-up
LEAST_TURNS = 8  # of a record with an order map
MOST_CHANGE = 0.10  # of the speed within a frame
TURNS_A_FRAME = 8  # at most
FRAMES = 16  # that stand side by side, at least, where the record has the turns
OVERLAP = 4  # frames begin so many times a frame
MOST_FRAMES = 400
HANN_WIDTH = 1.44  # bins between the points of half power


def speed_change(angle: ArrayLike) -> float:
    """Speed of the fastest whole turn of a shaft over that of the slowest, less 1.

    Parameters
    ----------
    angle : (sample,) rad    of the shaft, rising

    Returns
    -------
    float; 0 for fewer than two whole turns
    """
    turned = _turns(angle)
    whole = np.arange(math.floor(turned[-1]) + 1)
    ends = np.interp(whole, turned, np.arange(turned.size))
    lengths = np.diff(ends)
    if lengths.size < 2:
        return 0.0
    return float(lengths.max() / lengths.min()) - 1.0


def order_map(
    signal: ArrayLike,
    angle: ArrayLike,
    sampling_rate: float,
    *,
    n_turns: int | None = None,
) -> LevelMap:
    """RMS values over the orders of a shaft, frame by frame of a run-up.

    Parameters
    ----------
    signal : (..., sample)
    angle : (sample,) rad    of the shaft, rising
    sampling_rate : Hz
    n_turns : of a frame; default: up to `TURNS_A_FRAME`, fewer so that `FRAMES` frames stand side
        by side and the speed changes by `MOST_CHANGE` at most within each

    Returns
    -------
    LevelMap over orders in steps of 1 / n_turns. A sine of amplitude A on a bin gives A / sqrt(2).

    Raises
    ------
    ValueError    if the shaft stands still or turns back, the record has fewer turns than
        `LEAST_TURNS` or than a frame, or the speed changes by more than `MOST_CHANGE` in a frame

    Notes
    -----
    Computed order tracking: the signal is resampled by `gensig.signals.rotation.resample_by_angle`
    and each frame is weighted by a Hann window, so that an order is one bin whatever the speed. A
    line stays within 1.5 orders over ``n_turns`` of its place. Orders above `PASS_SHARE` of the
    sampling rate are NaN in the frames where they lie there.

    Source: K. R. Fyfe & E. D. S. Munck (1997), "Analysis of computed order tracking", Mechanical
    Systems and Signal Processing 11 (2), 187-205.
    """
    from scipy.signal import spectrogram

    _require_rise(angle, sampling_rate)
    turned = _turns(angle)
    n_whole = math.floor(turned[-1] + 1e-9)
    frame = _turns_a_frame(turned, n_whole, n_turns)
    turns = resample_by_angle(signal, angle)
    per_turn = turns.shape[-1]
    flat = turns.reshape(*turns.shape[:-2], -1)
    length = frame * per_turn
    hop = max(length // OVERLAP, flat.shape[-1] // MOST_FRAMES)
    order, middle, power = spectrogram(
        flat, per_turn, window="hann", nperseg=length, noverlap=length - hop,
        scaling="spectrum",
    )  # fmt: skip
    time = np.arange(turned.size) / sampling_rate
    start, stop = (
        np.interp(middle + side * frame / 2, turned, time) for side in (-1.0, 1.0)
    )
    speed = 2.0 * math.pi * frame / (stop - start)
    rms = np.sqrt(np.swapaxes(power, -1, -2))
    frequency = np.multiply.outer(speed / (2.0 * math.pi), order)
    rms = np.where(frequency <= PASS_SHARE * sampling_rate, rms, np.nan)
    return LevelMap(
        time=np.interp(middle, turned, time),
        speed=speed,
        axis=order,
        rms=rms,
        total=_total(flat, length, hop, len(middle)),
        resolution=HANN_WIDTH / frame,
    )


def frequency_map(
    signal: ArrayLike, angle: ArrayLike, sampling_rate: float, *, frame: float
) -> LevelMap:
    """RMS values over frequency, frame by frame of a run-up: a waterfall.

    Parameters
    ----------
    signal : (..., sample)
    angle : (sample,) rad    of the shaft, rising
    sampling_rate : Hz
    frame : s                length of a frame

    Returns
    -------
    LevelMap over frequencies in steps of 1 / frame Hz, up to half the sampling rate. A sine of
    amplitude A on a bin gives A / sqrt(2).

    Raises
    ------
    ValueError    if the shaft stands still or turns back, or the signal is shorter than a frame
    """
    from scipy.signal import spectrogram

    _require_rise(angle, sampling_rate)
    x, turned = np.asarray(signal, dtype=float), _turns(angle)
    length = max(round(frame * sampling_rate), 2)
    if length > x.shape[-1]:
        raise ValueError(
            f"the record of {x.shape[-1] / sampling_rate:.3g} s is shorter than a frame of "
            f"{frame:.3g} s"
        )
    hop = max(length // OVERLAP, x.shape[-1] // MOST_FRAMES, 1)
    frequency, middle, power = spectrogram(
        x, sampling_rate, window="hann", nperseg=length, noverlap=length - hop,
        scaling="spectrum",
    )  # fmt: skip
    time = np.arange(turned.size) / sampling_rate
    half = 0.5 * length / sampling_rate
    start, stop = np.maximum(middle - half, 0.0), np.minimum(middle + half, time[-1])
    advance = np.interp(stop, time, turned) - np.interp(start, time, turned)
    return LevelMap(
        time=middle,
        speed=2.0 * math.pi * advance / (stop - start),
        axis=frequency,
        rms=np.sqrt(np.swapaxes(power, -1, -2)),
        total=_total(x, length, hop, len(middle)),
        resolution=HANN_WIDTH * sampling_rate / length,
    )


def _turns(angle: ArrayLike) -> FloatArray:
    """Turns since the first sample, (sample,)."""
    given = np.asarray(angle, dtype=float)
    return (given - given[0]) / (2.0 * math.pi)


def _require_rise(angle: ArrayLike, sampling_rate: float) -> None:
    """Raise ValueError where the angle does not rise from sample to sample."""
    still = np.flatnonzero(~(np.diff(np.asarray(angle, dtype=float)) > 0.0))
    if still.size:
        raise ValueError(
            f"the shaft stands still or turns back at {still[0] / sampling_rate:.4g} s; orders "
            "need a speed above 0 throughout"
        )


def _turns_a_frame(turned: FloatArray, n_whole: int, given: int | None) -> int:
    """Turns of a frame; ValueError where the record is too short or too fast for it."""
    if n_whole < max(LEAST_TURNS, given or 0):
        raise ValueError(
            f"the record has {turned[-1]:.3g} turns of the shaft; orders over speed need "
            f"{max(LEAST_TURNS, given or 0)}"
        )
    if given is not None:
        candidates = [given]
    else:
        longest = min(TURNS_A_FRAME, max(1, n_whole // FRAMES))
        candidates = list(range(longest, 0, -1))
    for frame in candidates:
        change = _largest_change(turned, frame)
        if change <= MOST_CHANGE:
            return frame
    raise ValueError(
        f"the speed changes by up to {100.0 * change:.3g} % within {frame} turn(s) of the shaft; "
        f"orders over speed need {100.0 * MOST_CHANGE:g} % or less"
    )


def _largest_change(turned: FloatArray, frame: int) -> float:
    """Largest change of the speed within a frame of so many turns, over its mean.

    It is twice the difference between the mean speeds of both halves, which take the times
    ``first`` and ``second`` for as many turns.
    """
    starts = np.arange(0.0, turned[-1] - frame + 1e-9, 0.25 * frame)
    ends = starts[:, None] + frame * np.array([0.0, 0.5, 1.0])
    first, second = np.diff(np.interp(ends, turned, np.arange(turned.size))).T
    return float(np.max(np.abs(1.0 / first - 1.0 / second) * (first + second)))


def _total(signal: FloatArray, length: int, hop: int, n_frames: int) -> FloatArray:
    """RMS less the mean of frames, (..., frame)."""
    frames = np.lib.stride_tricks.sliding_window_view(signal, length, axis=-1)
    return frames[..., ::hop, :][..., :n_frames, :].std(axis=-1)
