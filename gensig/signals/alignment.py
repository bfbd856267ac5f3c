"""Rotation of the turns of one recording to those of another one of the same machine.

Two recordings begin at different teeth. The deviations of the teeth from their mean passage are a
property of the gears, at any speed and load, and tell by how many teeth.
"""

from __future__ import annotations

import numpy as np

from gensig.signals.separation import FloatArray, GearTurns


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


def _of_unit_power(turn: FloatArray) -> FloatArray:
    """A turn with each channel divided by the root of its mean square; silent ones stay."""
    level = np.sqrt(np.mean(np.square(turn), axis=-1, keepdims=True))
    return np.divide(turn, level, out=np.zeros_like(turn), where=level > 0)
