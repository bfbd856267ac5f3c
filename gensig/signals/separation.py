"""Separation of the parts of a signal that repeat with either gear of a pair, tooth by tooth.

Neither average holds a part of the other's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.signals.averaging import interpolate

# of one passage of a tooth: decides only about teeth that pass too seldom to be separated
RIDGE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class GearTurns:
    """Signal as the mean passage of a mesh and the addition of each tooth of either gear.

    Attributes
    ----------
    driving, driven : (..., sample)    one turn of the gear, ``samples_per_tooth`` for each tooth
        in the order of mesh
    mesh : (..., sample)               mean of all passages: ``samples_per_tooth``
    """

    driving: FloatArray
    driven: FloatArray
    mesh: FloatArray

    def of_channel(self, index: int) -> GearTurns:
        """Turns of one channel, the first axis, which keeps its axis."""
        chosen = slice(index, index + 1)
        return GearTurns(
            driving=self.driving[chosen],
            driven=self.driven[chosen],
            mesh=self.mesh[chosen],
        )


def separate_gears(
    signal: ArrayLike,
    sampling_rate: float,
    mesh_frequency: float,
    n_teeth: tuple[int, int],
    *,
    samples_per_tooth: int,
) -> GearTurns:
    """Take a signal of constant speed apart by the teeth of both gears.

    Parameters
    ----------
    signal : (..., sample)
    sampling_rate : Hz
    mesh_frequency : Hz            passages of a tooth per second
    n_teeth : of the driving and the driven gear
    samples_per_tooth : even; orders of the mesh above half of it are taken away

    Returns
    -------
    GearTurns, turns and passages begin at the first sample

    Raises
    ------
    ValueError    for less than one turn of the driving gear, or an odd number of samples

    Notes
    -----
    Passage n is mesh + driving[n mod z1] + driven[n mod z2] + rest, solved for by least squares
    over all passages. A time-synchronous average is the same without the other gear, whose teeth
    it takes for noise: in a second of 8 turns they weigh as much as the noise. The teeth of either
    gear are 0 in the mean; one that never passes is 0.

    Two-way layout without interaction: H. Scheffe (1959), "The analysis of variance", chapter 4.
    """
    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True)
    if samples_per_tooth < 2 or samples_per_tooth % 2:
        raise ValueError(
            f"samples_per_tooth must be even and at least 2, not {samples_per_tooth}"
        )
    in_a_passage = sampling_rate / mesh_frequency
    n_passages = math.floor((x.shape[-1] + 1e-6) / in_a_passage)
    if n_passages < n_teeth[0]:
        raise ValueError(
            f"{x.shape[-1]} samples hold {n_passages} passages of a tooth, less than "
            f"{n_teeth[0]}: a turn"
        )
    # nothing aliases
    fine = samples_per_tooth * max(math.ceil(in_a_passage / samples_per_tooth), 1)
    points = np.arange(n_passages * fine).reshape(n_passages, fine)
    position = points * (in_a_passage / fine)
    passages = np.moveaxis(interpolate(x, position), -2, 0)
    mesh = passages.mean(axis=0)
    deviations = (passages - mesh).reshape(n_passages, -1)
    teeth = _tooth_parts(deviations, n_teeth).reshape(-1, *mesh.shape)
    n_driving = n_teeth[0]
    last_driven = min(sum(n_teeth), n_driving + n_passages)
    for of_gear in (slice(0, n_driving), slice(n_driving, last_driven)):
        # of the teeth that pass: it belongs to no tooth
        common = teeth[of_gear].mean(axis=0)
        teeth[of_gear] -= common
        mesh = mesh + common

    def turn(of_teeth: FloatArray) -> FloatArray:
        whole = np.moveaxis(of_teeth, 0, -2).reshape(*x.shape[:-1], -1)
        return _fewer_samples(whole, whole.shape[-1] // fine * samples_per_tooth)

    return GearTurns(
        driving=turn(teeth[:n_driving]),
        driven=turn(teeth[n_driving:]),
        mesh=turn(mesh[None]),
    )


def _tooth_parts(passages: FloatArray, n_teeth: tuple[int, int]) -> FloatArray:
    """(tooth of either gear, value) whose sums come nearest to the passages, (passage, value)."""
    passage, first = np.arange(len(passages)), n_teeth[0]
    design = np.zeros((len(passages), sum(n_teeth)))
    design[passage, passage % first] = 1.0
    design[passage, first + passage % n_teeth[1]] = 1.0
    normal = design.T @ design + RIDGE * np.eye(design.shape[1])
    return np.linalg.solve(normal, design.T @ passages)


def _fewer_samples(turn: FloatArray, n_samples: int) -> FloatArray:
    """A periodic signal (..., sample) by fewer samples, orders above half of them taken away."""
    if n_samples == turn.shape[-1]:
        return turn
    spectrum = np.fft.rfft(turn, axis=-1)[..., : n_samples // 2 + 1]
    spectrum[..., -1] = spectrum[..., -1].real
    return np.fft.irfft(spectrum, n=n_samples, axis=-1) * (n_samples / turn.shape[-1])
