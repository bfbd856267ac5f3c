"""What the teeth of a drive line's record mesh carry at a set-point, mesh by mesh, from the running machine itself.

``docs/theory/degradation.md``.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.newmark import LineSolver
from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.systems.line_records import MOST_ENERGY_RESIDUAL, SETTLING, LineMachine
from gensig.systems.pair_machine import Run

Array = NDArray[np.float64]

SECONDS = 0.5  # of steady running that stand for a set-point
SHARED = 0.5  # of the mesh force on one tooth where two pairs carry; assumed
LEAST_TORQUE = 1e-6  # N m, of a mesh that passes without touching: laws take roots and logarithms


def mesh_torques(machine: LineMachine, speed: float, torque: float) -> Array:
    """Loads that a tooth of the record mesh meets at a set-point, one a mesh, as torques of the pinion.

    Parameters
    ----------
    speed : rad/s    of the pinion's shaft
    torque : N m     brake torque at the crank

    Returns
    -------
    (mesh,) N m      all equally likely

    The sound, nominal machine runs ``SECONDS`` s at the set-point, and every pair of teeth that meets gives one load: a
    load spectrum of the machine's own, as ISO 6336-6 counts damage. The mean load alone would miss the impacts of a
    mesh that rattles.

    Raises
    ------
    ConfigError        for helical record meshes and machines that do not run steadily
    SimulationError    for a motion that cannot be integrated
    """
    if machine.pair.pinion.helix_angle != 0.0:
        raise ConfigError("life: on a drive line damage grows in a spur record mesh; choose one, system.record_mesh")
    if not machine.operating.is_steady:
        raise ConfigError("life: on a drive line set-points are steady; take operating=rated")
    machine = replace(machine, operating=replace(machine.operating, speed=speed, torque=torque))
    line = machine.line(Run(system=machine, faults=()))
    drive = machine.engine.drive
    shaft = line.dof(drive.numbers[drive.line.gears[drive.line.meshes[machine.place].driving].node])
    motion = line.run(
        LineSolver(
            sampling_rate=machine.sensing.sampling_rate,
            oversampling=machine.solver.oversampling,
            max_energy_residual=MOST_ENERGY_RESIDUAL,
        ),
        duration=SECONDS,
        channels=[("mesh_force", machine.place), ("angle", shaft)],
        settling=SETTLING,
    )
    angle = machine.ratio * motion.nominal_angle + motion.signals["angle", shaft]
    return greatest_loads(machine.pair, angle, motion.signals["mesh_force", machine.place])


def greatest_loads(pair: GearPair, angle: Array, force: Array) -> Array:
    """Greatest load of every pair of teeth that is seen from its entry to its exit, as torque of the pinion.

    Parameters
    ----------
    angle : (sample,) rad    of the pinion; a pair of teeth enters at every pitch of it
    force : (sample,) N      of the mesh, negative on the back flanks

    Returns
    -------
    (pair of teeth,) N m

    A tooth has the whole force where its pair is alone, ``SHARED`` of it where another one carries too; the back flanks
    close cracks and are left out.
    """
    roll = pair.pinion.base_radius * angle
    entered = np.arange(math.ceil(roll[0] / pair.base_pitch), math.floor(roll[-1] / pair.base_pitch)) * pair.base_pitch
    found = []
    for entry in entered[entered + pair.path_of_contact <= roll[-1]]:
        place = roll - entry
        engaged = (place >= 0.0) & (place <= pair.path_of_contact)
        alone = (place > pair.path_of_contact - pair.base_pitch) & (place < pair.base_pitch)
        load = np.where(alone, 1.0, SHARED)[engaged] * np.maximum(force[engaged], 0.0)
        found.append(float(load.max(initial=0.0)))
    return np.maximum(np.array(found) * pair.pinion.base_radius, LEAST_TORQUE)
