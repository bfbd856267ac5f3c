"""Course of a wandering speed, read off the harmonics of the mesh in a spectrogram.

It is coarse, but sure of its lines.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.arrays import FloatArray
from gensig.errors import ConfigError, TooShortError
from gensig.signals.mesh_motion import SEARCH, Teeth, find_motion, in_hertz
from gensig.signals.recording import Recording

# of the faster gear: its sidebands, one turn away, are resolved from the mesh
TURNS_A_FRAME = 3
FRAMES_A_FRAME = 4  # hop is a quarter of the frame
MOST_HARMONICS = 10
FINER_SPECTRUM = 2  # bins of the frame's spectrum for one of the frame
LEAST_TURNS = 4  # of the slower gear, so that its sidebands are resolved from the mesh
# assumed: a course that follows noise reached 13.2 and 7.8 dB in 280 trials
LEAST_LINE_DB = 18.0  # of the strongest of the first harmonics,
LEAST_MEAN_DB = 10.0  # or of all of them on the average
FIRST_HARMONICS = 5
FINE = 0.25  # candidates lie this share of a bin apart at the highest harmonic
# assumed: standard deviation of the relative change of speed from one frame to the next
STEP_SHARE = 0.003
# of the distance from the mesh to its next sideband, one turn of the faster gear away: farther
# off a sideband could be taken for the mesh
TO_SIDEBANDS = 0.8


def wandering_mesh_cycles(
    recording: Recording,
    teeth: Teeth,
    speed_rpm: float,
    *,
    highest: float,
    options: str,
    longer: str,
) -> FloatArray:
    """Mesh cycles since the first sample, (sample,), where the speed wanders near a stated one.

    Parameters
    ----------
    speed_rpm : r/min    of the driving gear; the speed lies within `mesh_motion.SEARCH` of it
        throughout, and for many teeth within `TO_SIDEBANDS` of the distance to the next sideband
    highest, options, longer : see `gensig.signals.mesh_motion.find_motion`

    Raises
    ------
    TooShortError    for a recording that is too short
    ConfigError    where there is no sign of the mesh

    Notes
    -----
    The course of `mesh_frequency_course` makes the speed nearly steady; `find_motion` follows what
    is left. A course finds something that stands out in noise too, so that the lines must stand
    out more than for a steady speed.
    """
    rate, n_samples = recording.sampling_rate, recording.acceleration.shape[1]
    mesh = speed_rpm / 60.0 * teeth.driving
    fewest = min(teeth.driving, teeth.driven)
    search = min(SEARCH, TO_SIDEBANDS / fewest)
    if mesh * (1.0 + search) > highest:
        raise ConfigError(
            f"the mesh frequency of {mesh:.5g} Hz lies above {highest:.5g} Hz; check {options}"
        )
    turns = recording.duration * mesh / teeth.most
    if turns < LEAST_TURNS:
        raise TooShortError(
            f"too short: {recording.duration:.3g} s are {turns:.1f} turns of the slower gear, at "
            f"least {LEAST_TURNS} "
            f"are needed; {longer}{in_hertz(speed_rpm)}"
        )
    time, course = mesh_frequency_course(
        recording.acceleration, rate, fewest, mesh, search=search, highest=highest
    )
    samples = np.arange(n_samples)
    frequency = np.interp(samples / rate, time, course)
    steps = 0.5 * (frequency[1:] + frequency[:-1])
    coarse = np.concatenate([[0.0], np.cumsum(steps)]) / rate
    mean = float(coarse[-1] * rate / (n_samples - 1))
    warped = coarse / mean * rate  # position of every sample once the speed is steady
    rows = [np.interp(samples, warped, row) for row in recording.acceleration]
    motion = find_motion(
        replace(recording, acceleration=np.stack(rows)),
        teeth,
        mean / teeth.driving * 60.0,
        highest=highest,
        options=options,
        least_turns=LEAST_TURNS * (1.0 - search),
        search=search,
        longer=longer,
    )
    first = motion.line_db[:FIRST_HARMONICS]
    if first.max() < LEAST_LINE_DB and first.mean() < LEAST_MEAN_DB:
        raise ConfigError(
            f"no sure sign of the mesh near {mesh:.5g} Hz: followed, its lines stand at most "
            f"{first.max():.0f} dB over "
            f"their surroundings, {LEAST_LINE_DB:g} are needed; check {options}, or give a "
            "tachometer"
        )
    return np.interp(warped, samples, motion.cycles)


def mesh_frequency_course(
    signal: ArrayLike,
    sampling_rate: float,
    n_teeth: int,
    mesh_frequency: float,
    *,
    search: float,
    highest: float,
) -> tuple[FloatArray, FloatArray]:
    """Mesh frequency over time, near a stated one.

    Parameters
    ----------
    signal : (channel, sample)    channels are looked at together
    sampling_rate : Hz
    n_teeth : teeth of the gear that turns faster
    mesh_frequency : Hz           as stated
    search : share of it, to which the course is held on either side; below 1 / n_teeth, where
        sidebands are
    highest : Hz                  harmonics above are not looked at

    Returns
    -------
    time : (frame,) s             middle of each frame
    mesh_frequency : (frame,) Hz

    Raises
    ------
    ValueError    if the recording is shorter than a frame, or the search reaches sidebands or
        ``highest``

    Source: Q. Leclere, H. Andre & J. Antoni (2016), "A multi-order probabilistic approach for
    instantaneous angular speed tracking", Mechanical Systems and Signal Processing 81, 375-386:
    spectrum of each frame over its local floor, read at every harmonic of a candidate as its
    probability, multiplied over the harmonics. Their smoothing is replaced by the most probable
    whole course (Viterbi) with normal steps.
    """
    from scipy.signal import stft

    x = np.asarray(signal, dtype=float)
    length = round(TURNS_A_FRAME * n_teeth / mesh_frequency * sampling_rate)
    n_harmonics = min(
        MOST_HARMONICS, math.floor(highest / ((1.0 + search) * mesh_frequency))
    )
    if search * n_teeth >= 1.0 or n_harmonics < 1 or length > x.shape[-1]:
        raise ValueError(
            f"no course: {n_harmonics} harmonics, frames of {length} samples, search {search:g}"
        )
    hop = max(1, length // FRAMES_A_FRAME)
    frequency, time, spectrum = stft(
        x,
        sampling_rate,
        nperseg=length,
        noverlap=length - hop,
        nfft=FINER_SPECTRUM * length,
        boundary=None,
        padded=False,
        axis=-1,
    )
    power = np.square(np.abs(spectrum))
    standing = np.log(np.maximum(power / _floor(power), 1.0)).sum(axis=0)
    step = FINE / (n_harmonics * TURNS_A_FRAME * n_teeth)
    candidates = np.arange(-search, search + 0.5 * step, step)
    harmonic = np.arange(1, n_harmonics + 1)[:, None]
    at = harmonic * (1.0 + candidates) * mesh_frequency / frequency[1]
    bins = np.arange(frequency.size)
    likelihood = [np.interp(at, bins, row).sum(axis=0) for row in standing.T]
    best = _most_probable(np.stack(likelihood), candidates)
    return time, (1.0 + candidates[best]) * mesh_frequency


def _floor(power: FloatArray) -> FloatArray:
    """Median power of stretches of two orders of the gear, (channel, bin, frame)."""
    width = 2 * TURNS_A_FRAME * FINER_SPECTRUM
    n_stretches = max(1, power.shape[1] // width)
    edges = np.append(np.arange(n_stretches) * width, power.shape[1])
    floor = np.empty_like(power)
    for first, last in itertools.pairwise(edges):
        floor[:, first:last] = np.median(power[:, first:last], axis=1, keepdims=True)
    return np.maximum(floor, np.finfo(float).tiny)


def _most_probable(likelihood: FloatArray, candidates: FloatArray) -> NDArray[np.intp]:
    """Indices of the candidates along the best course, (frame,).

    ``likelihood`` (frame, candidate) are logarithms of probability.
    """
    # (to, from)
    distance = candidates[:, None] - candidates[None, :]
    change = -0.5 * np.square(distance / STEP_SHARE)
    total, origin = likelihood[0], []
    for row in likelihood[1:]:
        reached = change + total[None, :]
        origin.append(reached.argmax(axis=1))
        total = row + reached.max(axis=1)
    course = [int(total.argmax())]
    for before in reversed(origin):
        course.append(int(before[course[-1]]))
    return np.array(course[::-1], dtype=np.intp)
