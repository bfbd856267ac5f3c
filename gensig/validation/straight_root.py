"""The simplified tooth of the older literature, to measure what the true root transition curve buys."""

from __future__ import annotations

import math

import numpy as np

from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import N_FLANK_CELLS, N_ROOT_CELLS, ToothProfile, involute_point


def straight_root_profile(gear: Gear) -> ToothProfile:
    """Outline whose involute runs down to the base circle and goes on straight, with constant thickness, to the root.

    Where the root circle is the larger one the involute runs down to it, and nothing straight is left.
    """
    lowest = math.sqrt(max(gear.root_radius**2 - gear.base_radius**2, 0.0))
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    curvature = np.linspace(lowest, tip, N_FLANK_CELLS + 1)
    x, y = involute_point(gear, curvature)
    n_root = N_ROOT_CELLS if gear.root_radius < gear.base_radius else 0
    root = math.sqrt(gear.root_radius**2 - float(y[0]) ** 2)
    return ToothProfile(
        gear=gear,
        abscissa=np.concatenate([np.linspace(root, float(x[0]), n_root + 1)[:n_root], x]),
        half_thickness=np.concatenate([np.full(n_root, y[0]), y]),
        n_root_cells=n_root,
        curvature_radius=curvature,
    )


def straight_root_tooth(gear: Gear) -> Tooth:
    """A sound tooth on that outline."""
    return healthy_tooth(gear, straight_root_profile(gear))
