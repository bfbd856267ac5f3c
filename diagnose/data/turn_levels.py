"""Levels of turns in bands of mesh orders: what tells whether a machine is of a known kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Edges of the bands, in orders of the mesh; assumed, about an octave each.
EDGES = (1, 2, 4, 8, 16, 32)
FLOOR = 1e-12  # of the mean power, so that silence has a finite level

Floats = NDArray[np.floating]


def turn_levels(driving: Floats, driven: Floats, mesh: Floats) -> NDArray[np.float32]:
    """Levels of the mean passage and of the teeth beside it, whatever the number of teeth.

    Parameters
    ----------
    driving, driven : (channel, tooth, sample) deviations from the mean passage
    mesh : (channel, sample)

    Returns
    -------
    (feature,) natural logarithms of powers, over the power of their channel
    """
    teeth = np.concatenate([driving, driven], axis=1)
    of_teeth = _powers(teeth).mean(axis=1)
    powers = np.stack([_powers(mesh), of_teeth], axis=1)  # (channel, kind, band)
    total = powers.sum(axis=(1, 2), keepdims=True) + np.finfo(float).tiny
    return np.log(powers / total + FLOOR).ravel().astype(np.float32)


def _powers(passages: Floats) -> Floats:
    """(..., band) power of periodic passages (..., sample) in the bands of `EDGES`."""
    n_samples = passages.shape[-1]
    power = np.square(np.abs(np.fft.rfft(passages, axis=-1))) / n_samples**2
    edges = [edge for edge in EDGES if edge <= n_samples // 2]
    return np.add.reduceat(power, edges, axis=-1)[..., : len(edges) - 1]
