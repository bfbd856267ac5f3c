"""Samples that get lost on their way from the converter to the file."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array, Flags

FILLS = ("hold", "zero")


def draw_dropped(
    rng: np.random.Generator, share: float, n_run: int, n_samples: int
) -> Flags:
    """Mask of lost samples, (sample,).

    Samples travel in packets of ``n_run``. Each packet is lost with probability ``share``,
    independent of the others. The first packet began anywhere before the record.
    """
    begun = int(rng.integers(n_run))
    lost = rng.random((begun + n_samples - 1) // n_run + 1) < share
    return np.repeat(lost, n_run)[begun : begun + n_samples]


def filled(signal: Array, dropped: Flags, fill: str) -> Array:
    """Signal, (sensor, sample), with its losses filled.

    ``hold`` repeats the last sample that came; before the first one it takes that one. ``zero``
    is 0. Where nothing came at all, both give 0.
    """
    if fill == "zero" or dropped.all():
        return np.where(dropped, 0.0, signal)
    came = np.flatnonzero(~dropped)
    last = np.searchsorted(came, np.arange(len(dropped)), side="right") - 1
    return signal[:, came[np.maximum(last, 0)]]
