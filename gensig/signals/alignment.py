"""Turns of two recordings of one machine: rotated to each other, and what is new in one of them.

Two recordings begin at different teeth. The deviations of the teeth from their mean passage are a
property of the gears, at any speed and load, and tell by how many teeth.

The errors of the gears excite a machine by the angle. Between two recordings only the transfer to
the sensor differs, which is smooth over the orders. What a smooth transfer cannot make of a sound
recording is new.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import FloatArray
from gensig.signals.separation import GearTurns

SpectrumArray = NDArray[np.complexfloating]

BAND = 1.0  # mesh orders over which the transfer is smoothed; assumed
RIDGE = 1e-3  # of the mean power of a healthy turn, beside that at every order; assumed
TINY = 1e-300


def aligned_turns(turns: GearTurns, to: GearTurns) -> GearTurns:
    """Turns of a recording, rotated so that its teeth lie where those of another recording do.

    Parameters
    ----------
    turns, to : of the same gears, with as many samples a tooth and as many channels

    Returns
    -------
    GearTurns; the mean passage is rotated with the driving gear

    Notes
    -----
    The rotation of each gear is that of the largest circular cross-correlation of the turns,
    summed over the channels, each divided by the root of its mean square.
    """
    driving = rotation(turns.driving, to.driving)
    driven = rotation(turns.driven, to.driven)
    return GearTurns(
        driving=np.roll(turns.driving, -driving, axis=-1),
        driven=np.roll(turns.driven, -driven, axis=-1),
        mesh=np.roll(turns.mesh, -(driving % turns.mesh.shape[-1]), axis=-1),
    )


def rotation(turn: FloatArray, to: FloatArray) -> int:
    """Samples by which a turn (channel, sample) begins before another one of the same gear."""
    spectrum, other = np.fft.rfft(_of_unit_power(turn)), np.fft.rfft(_of_unit_power(to))
    correlation = np.fft.irfft(spectrum * other.conj(), n=turn.shape[-1])
    return int(correlation.sum(axis=0).argmax())


def changed_turns(turns: GearTurns, sound: Sequence[GearTurns]) -> GearTurns:
    """Turns less what healthy recordings of the machine predict of them.

    Parameters
    ----------
    turns : of a recording
    sound : of one or more healthy recordings, begun anywhere, with as many channels, and samples a
        tooth

    Returns
    -------
    GearTurns; the mean passage is that of the recording

    Notes
    -----
    The spectra of all healthy turns, rotated to the recording, predict the spectrum of its turn by
    least squares over a Hann window of `BAND` mesh orders about each order. This is the conditioned
    spectrum of Bendat & Piersol (2010), "Random data", chapter 7, with shaft orders in place of
    averages.
    """
    samples_per_tooth = turns.mesh.shape[-1]
    rotated = [aligned_turns(other, turns) for other in sound]
    return GearTurns(
        driving=changed_turn(
            turns.driving, [other.driving for other in rotated], samples_per_tooth
        ),
        driven=changed_turn(
            turns.driven, [other.driven for other in rotated], samples_per_tooth
        ),
        mesh=turns.mesh,
    )


def changed_turn(
    turn: FloatArray, sound: Sequence[FloatArray], samples_per_tooth: float
) -> FloatArray:
    """Part of a turn that healthy turns of the same shaft do not predict.

    Parameters
    ----------
    turn : (channel, sample)
    sound : of one or more healthy recordings, as long, rotated to the turn
    samples_per_tooth : a mesh order is a turn's samples over these

    Returns
    -------
    (channel, sample), by the method of `changed_turns`
    """
    spectrum = np.fft.rfft(turn)
    known = np.fft.rfft(np.stack(sound, axis=1))  # (channel, recording, order)
    mesh_order = round(turn.shape[-1] / samples_per_tooth)
    window = np.hanning(2 * round(BAND * mesh_order / 2) + 3)[1:-1]
    cross = _smooth(known.conj() * spectrum[:, None], window)
    power = _smooth(known.conj()[:, :, None] * known[:, None], window)
    own = np.trace(power.mean(axis=-1).real, axis1=1, axis2=2) / len(sound)
    ridge = RIDGE * own[:, None, None, None] + TINY
    normal = np.moveaxis(power, -1, 1) + ridge * np.eye(len(sound))
    transfer = np.linalg.solve(normal, np.moveaxis(cross, -1, 1)[..., None])[..., 0]
    predicted = np.einsum("cok,cko->co", transfer, known)
    return np.fft.irfft(spectrum - predicted, n=turn.shape[-1])


def _smooth(values: SpectrumArray, window: FloatArray) -> SpectrumArray:
    """Weighted sums over neighboring orders, the last axis; spectra are mirrored at their ends."""
    from scipy.ndimage import convolve1d

    return convolve1d(values, window, axis=-1, mode="mirror")


def _of_unit_power(turn: FloatArray) -> FloatArray:
    """A turn with each channel divided by the root of its mean square; silent ones stay."""
    level = np.sqrt(np.mean(np.square(turn), axis=-1, keepdims=True))
    return np.divide(turn, level, out=np.zeros_like(turn), where=level > 0)
