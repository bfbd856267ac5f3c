"""Teeth whose stiffness over the phase is given, to judge the law of a mesh."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.mesh.even_table import even_table
from gensig.mesh.tooth_table import GearTeeth, TablePart, ToothTable

Array = NDArray[np.float64]

PRESSURE_ANGLE = math.radians(20.0)


def plain_pair(
    n_teeth: tuple[int, int], base_radius: float, helix_angle: float = 0.0
) -> GearPair:
    """Two standard gears without backlash, of a base radius of the first in m; angles in rad."""
    across = math.atan(math.tan(PRESSURE_ANGLE) / math.cos(helix_angle))
    module = 2.0 * base_radius * math.cos(helix_angle) / (n_teeth[0] * math.cos(across))
    pinion, wheel = (
        Gear(
            name=name,
            n_teeth=n,
            normal_module=module,
            pressure_angle=PRESSURE_ANGLE,
            addendum_coefficient=1.0,
            clearance_coefficient=0.25,
            cutter_tip_radius_coefficient=0.38,
            profile_shift=0.0,
            face_width=10.0 * module,
            bore_radius=2.0 * module,
            helix_angle=hand * helix_angle,
        )
        for name, n, hand in (
            ("pinion", n_teeth[0], 1.0),
            ("wheel", n_teeth[1], -1.0),
        )
    )
    return GearPair(pinion=pinion, wheel=wheel, backlash=0.0)


def phase_table(
    pair: GearPair, stiffness: Array, gap: Array | None = None
) -> ToothTable:
    """Teeth whose whole stiffness is known over their phase: one spring k(u) behind one gap e(u).

    Parameters
    ----------
    stiffness : (1, node) or (n_teeth of the pinion, node) N/m    over one pitch, or pitch after
        pitch over a turn of the pinion, irregular teeth among them; the node that closes a pitch
        is the first of the next
    gap : the same shape, m    static transmission error and pitch errors, by which the teeth
        stand back; default 0
    """
    n_teeth = pair.pinion.n_teeth
    gaps = np.zeros_like(stiffness)
    if gap is not None:
        gaps = np.broadcast_to(gap, stiffness.shape)
    if stiffness.ndim != 2 or len(stiffness) not in (1, n_teeth):
        raise ConfigError(
            f"stiffness {stiffness.shape} must be (1, node) or ({n_teeth}, node), one row a tooth"
        )
    n_rows, n_cells = stiffness.shape
    # the mesh has rolled u = i + s where row i is at s, and the next row begins where it ends
    closed, closed_gap = (
        np.hstack([part, np.roll(part[:, :1], -1, axis=0)])[:, None, None]
        for part in (stiffness, gaps)
    )
    position = pair.base_pitch * np.arange(n_cells + 1) / n_cells
    compliance = 1.0 / closed
    part = TablePart(
        compliance=compliance,
        compliance_slope=np.gradient(compliance, position, axis=-1),
        gap=closed_gap,
        gap_slope=np.gradient(closed_gap, position, axis=-1),
    )
    kinds = GearTeeth(
        kind=np.arange(n_teeth) % n_rows, present=np.ones(n_rows, dtype=np.bool_)
    )
    even = even_table(pair, float(stiffness[0, 0]))
    return replace(even, position=position, pinion=kinds, parts=(part,))


def loaded_gap(approach: Array, stiffness: Array, force: float) -> Array:
    """Gap e(u) of a ``phase_table`` that statics at one load describe, (phase,) m.

    ``approach`` and tangent ``stiffness`` (phase,) in m and N/m under a ``force`` in N, as
    ``mesh.slices`` gives them for a helical pair: e = approach - F / k, so that the mesh is where
    statics put it under that force.
    """
    return approach - force / stiffness
