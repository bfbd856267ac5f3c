"""Motion of helical gears along their axes, and their tilts.

Derived in ``docs/theory/motion.md``.
"""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.dynamics._layout import MOST_PAIRS
from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.mesh.tooth_table import ToothTable

AXIAL_DOFS = (
    "pinion_z",
    "pinion_tilt_x",
    "pinion_tilt_y",
    "wheel_z",
    "wheel_tilt_x",
    "wheel_tilt_y",
)


def axial_reach(pair: GearPair) -> Array:
    """Gradient of the approach over ``AXIAL_DOFS``, (dof,); 1, m.

    The axial share of the normal force, tan(beta_b) of the transverse one, acts at the pitch
    point in the middle of the face. A right-handed pinion comes closer to the wheel's flank as it
    moves along +z.
    """
    slant = math.copysign(math.tan(pair.base_helix_angle), pair.pinion.helix_angle)
    across = math.tan(pair.working_pressure_angle)
    pinion, wheel = pair.pinion.base_radius, pair.wheel.base_radius
    on_pinion, on_wheel = (
        (1.0, -pinion * across, -pinion),
        (-1.0, -wheel * across, -wheel),
    )
    return slant * np.array([*on_pinion, *on_wheel])


def pitches(table: ToothTable) -> tuple[int, int]:
    """Whole base pitches from A at which a table begins and ends.

    The difference is the number of pairs followed at once.

    Raises
    ------
    ConfigError    for more pairs than are followed
    """
    if table.n_pairs > MOST_PAIRS:
        raise ConfigError(
            f"{table.n_pairs} pairs of teeth would have to be followed at once, of a total contact "
            f"ratio of {table.pair.total_contact_ratio:.3g}; at most {MOST_PAIRS} are: reduce "
            "face_width_mm or helix_angle_deg"
        )
    return table.first_pitch, table.last_pitch
