"""Turns of both gears of a recording in one array, which says how many teeth they have.

A packed array (channel, point) begins with the two tooth counts. The turns of the driving and of
the driven gear follow, then the mean passage of a tooth, then further turns of both gears. Arrays
of gears with fewer teeth are shorter; in a batch zeros are added behind them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

HEADER = 2  # points before the turns: teeth of the driving and of the driven gear

Floats = NDArray[np.floating]


def packed(
    turns: Sequence[Floats],
    mesh: Floats,
    further: Sequence[Floats] = (),
) -> NDArray[np.float32]:
    """One array of turns and passage.

    Parameters
    ----------
    turns : (channel, tooth, sample) of the driving and of the driven gear
    mesh : (channel, sample) mean passage
    further : other turns of the driving and of the driven gear, in turn

    Returns
    -------
    (channel, point) float32
    """
    n_channels = len(mesh)
    counts = [turn.shape[1] for turn in turns]
    parts = [np.tile(np.array(counts, dtype=float), (n_channels, 1))]
    parts += [turn.reshape(n_channels, -1) for turn in turns]
    parts.append(mesh)
    parts += [turn.reshape(n_channels, -1) for turn in further]
    return np.concatenate(parts, axis=-1).astype(np.float32)


def n_points(n_teeth: Sequence[int], samples_per_tooth: int, n_kinds: int) -> int:
    """Points of a packed array with so many kinds of turns of both gears."""
    return HEADER + samples_per_tooth * (1 + n_kinds * sum(n_teeth))


def tooth_counts(array: Floats) -> tuple[int, int]:
    """Teeth of the driving and the driven gear of a packed array (channel, point)."""
    driving, driven = array[0, :HEADER]
    return round(float(driving)), round(float(driven))


def turns_of(array: Floats, samples_per_tooth: int) -> tuple[Floats, Floats, Floats]:
    """First turns (channel, tooth, sample) of both gears and mean passage (channel, sample)."""
    ends = HEADER + samples_per_tooth * np.cumsum([*tooth_counts(array), 1])
    _, driving, driven, mesh, _ = np.split(array, [HEADER, *ends], axis=-1)
    shape = (len(array), -1, samples_per_tooth)
    return driving.reshape(shape), driven.reshape(shape), mesh
