"""Times at which a machine is looked at during its life."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array
from gensig.life.growth import Course

SPACINGS = ("linear", "logarithmic", "adaptive")
LAST_SHARE = 1e-3  # of the life, left at the last look but one of a logarithmic row


def snapshot_times(
    course: Course, spacing: str, count: int, every: float | None = None
) -> Array:
    """Running times from new to the end of the life, (snapshot,) s.

    Parameters
    ----------
    spacing : ``linear``, equal steps of running time; ``logarithmic``, the time left falls by equal
        factors to ``LAST_SHARE`` of the life and then to 0, so that looks crowd at the end;
        ``adaptive``, equal steps of the size, and of the running time where it does not grow
    every : s between looks, the same for all lives, with ``linear`` and ``count`` the most there
        may be
    """
    life = float(course.running[-1])
    if every is not None:
        n_looks = min(count, int(life / every * (1.0 + 1e-12)) + 1)
        return every * np.arange(n_looks, dtype=np.float64)
    if spacing == "logarithmic":
        left = np.geomspace(1.0, LAST_SHARE, count - 1)
        return life * (1.0 - np.concatenate([left, [0.0]]))
    first, last = float(course.size[0]), float(course.size[-1])
    if spacing == "linear" or last <= first:
        return np.linspace(0.0, life, count)
    times = np.interp(np.linspace(first, last, count), course.size, course.running)
    return np.concatenate([[0.0], times[1:-1], [life]])
