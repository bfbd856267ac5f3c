"""One machine's gear mesh as plain numbers, for the scalar codes that the compiled core is
compared with.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from gensig.dynamics.pair import RunningPair


class MeshNumbers(NamedTuple):
    """Numbers of a gear mesh that a law reads, SI; named as in ``gensig.dynamics``."""

    pinion_radius: float
    wheel_radius: float
    pitch: float
    nodes_per_meter: float
    path: float
    pitch_point: float
    start_curvature: float
    tangent_length: float
    shared: float
    damping: float
    friction: float
    friction_half_width: float
    backlash: float
    start_roll: float
    speed: float
    start_pinion: int
    start_wheel: int
    consistent: bool


def mesh_numbers(running: RunningPair) -> MeshNumbers:
    """The numbers of one machine that runs at constant speed.

    Raises
    ------
    ValueError    for a law other than the one-sided one
    """
    table, pair, options = running.table, running.table.pair, running.table.options
    if options.law != "one_sided":
        raise ValueError(f"mesh.law={options.law}; only one_sided is written out here")
    viscous = (
        2.0
        * options.damping_ratio
        * math.sqrt(running.mean_mesh_stiffness * running.equivalent_mass)
    )
    return MeshNumbers(
        pinion_radius=pair.pinion.base_radius,
        wheel_radius=pair.wheel.base_radius,
        pitch=pair.base_pitch,
        nodes_per_meter=options.points_per_pitch / pair.base_pitch,
        path=pair.path_of_contact,
        pitch_point=pair.pitch_point,
        start_curvature=pair.start_curvature_radius,
        tangent_length=pair.tangent_length,
        shared=table.shared_compliance,
        damping=viscous / running.mesh_force,
        friction=options.friction_coefficient,
        friction_half_width=0.5 * options.friction_transition * pair.base_pitch,
        backlash=pair.backlash,
        start_roll=running.teeth.start_roll,
        speed=running.operating.speed,
        start_pinion=running.teeth.start_teeth[0],
        start_wheel=running.teeth.start_teeth[1],
        consistent=options.roll_torque == "consistent",
    )
