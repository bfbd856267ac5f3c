"""Table of teeth of one stiffness wherever they stand, for meshes that are a spring alone."""

from __future__ import annotations

import numpy as np

from gensig.geometry.contact import GearPair
from gensig.mesh.options import MeshOptions
from gensig.mesh.tooth_table import GearTeeth, TablePart, ToothTable

OPTIONS = MeshOptions(
    law="one_sided",
    pair_coupling="sum",
    contact="linear",
    elasticity="plane_strain",
    body="ring",
    tooth="to_centreline",
    crack="calibrated",
    bending="whole",
    roll_torque="consistent",
    phase="rotation",
    damping_ratio=0.0,
    friction_coefficient=0.0,
    friction_transition=0.02,
    points_per_pitch=32,
    allow_extrapolation=False,
)


def even_table(pair: GearPair, stiffness: float) -> ToothTable:
    """Teeth that are all alike, of a stiffness in N/m and without friction.

    One pair is in contact, from A to a base pitch behind it.
    """
    flat = np.zeros((1, 1, 1, 2))
    part = TablePart(
        compliance=flat + 1.0 / stiffness,
        compliance_slope=flat,
        gap=flat,
        gap_slope=flat,
    )
    pinion, wheel = (
        GearTeeth(
            kind=np.zeros(gear.n_teeth, dtype=np.int64),
            present=np.ones(1, dtype=np.bool_),
        )
        for gear in pair.gears.values()
    )
    return ToothTable(
        pair=pair,
        options=OPTIONS,
        position=np.array([0.0, pair.base_pitch]),
        first_pitch=0,
        last_pitch=1,
        depth=np.zeros(1),
        pinion=pinion,
        wheel=wheel,
        parts=(part,),
        shared_compliance=0.0,
    )
