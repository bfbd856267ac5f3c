"""The teeth of the meshes of a line as gear pairs, and their loads in a motion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.line_gears import STILL
from gensig.driveline.running import RunningLine, reference_force
from gensig.driveline.teeth import felt_there
from gensig.driveline.time.newmark import LineMotion
from gensig.dynamics.backends.base import SEEN_FORCE
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.dynamics.pair import Body, PairDynamics
from gensig.faults.base import faulty_teeth
from gensig.operation.setpoint import Operating
from gensig.sensing.manufacturing import GearErrors
from gensig.systems.run import Run

Array = NDArray[np.float64]
# what a gear pair asks for, helical ones for motions out of their plane too
UNREAD = Body(
    mass=1.0,
    inertia=1.0,
    support=replace(STILL, stiffness_z=1.0, stiffness_tilt=1.0),
    tilt_inertia=1.0,
)
LineRun = Run[Any]  # of a ``LineMachine``, whose module imports this one


def mesh_pair(running: RunningLine, m: int, operating: Operating) -> PairDynamics:
    """The teeth of mesh ``m`` under its mean force, on bodies that are not read.

    Speed and torque of ``operating`` are not read either.

    Raises
    ------
    KeyError    for a mesh without tabulated teeth
    """
    mesh, tabulated = running.line.meshes[m], running.tabulated[m]
    table, speed = tabulated.table, float(running.course.speed[0])
    pair, force = table.pair, float(running.mesh_force[m])
    force = reference_force(running.machine, m, force)
    point = replace(
        operating,
        speed=speed * float(running.line.rotation[mesh.roll_dof]),
        torque=force * pair.pinion.base_radius,
    )
    n_teeth = pair.pinion.n_teeth, pair.wheel.n_teeth
    perfect = [GearErrors(error=np.zeros(n), tilt=np.zeros(n)) for n in n_teeth]
    driving, driven = tabulated.errors or perfect
    return PairDynamics(
        table=table,
        pinion=UNREAD,
        wheel=UNREAD,
        operating=point,
        pinion_error=driving.error,
        wheel_error=driven.error,
        pinion_tilt=driving.tilt,
        wheel_tilt=driven.tilt,
        start_tooth_pinion=mesh.start_teeth[0],
        start_tooth_wheel=mesh.start_teeth[1],
        start_phase=mesh.start_phase,
    )


def line_mesh_state(
    run: LineRun, pair: PairDynamics, m: int, seen: Array, angle: Array
) -> MeshState:
    """Loads of the teeth of mesh ``m`` in a motion.

    Parameters
    ----------
    pair : the teeth of the mesh, see ``mesh_pair``
    seen : (row, sample)    state of its pairs
    angle : (sample,) rad   of its driving gear since time 0
    """
    machine, drive = run.system, run.system.engine.drive
    felt = felt_there(drive, machine.mesh_number, m, run.faults)
    return mesh_state(pair, seen, angle, faulty_teeth(pair.table.pair, felt))


def angle_channels(running: RunningLine) -> list[tuple[str, int]]:
    """Channels of a motion that ``line_mesh_states`` needs: angles of all driving gears."""
    return [("angle", mesh.roll_dof) for mesh in running.line.meshes]


def line_mesh_states(
    run: LineRun, running: RunningLine, motion: LineMotion
) -> tuple[MeshState, tuple[MeshState, ...]]:
    """Loads of the teeth of the followed mesh, and of the others in the order of the line.

    The motion has ``angle_channels`` and the state of its pairs. A mesh without tabulated teeth has
    a force alone.
    """
    states = []
    for m, channel in enumerate(angle_channels(running)):
        nominal = running.line.rotation[channel[1]] * motion.nominal_angle
        if m in running.tabulated:
            pair = mesh_pair(running, m, run.system.operating)
            angle = nominal + motion.signals[channel]
            states.append(line_mesh_state(run, pair, m, motion.seen[m], angle))
        else:
            states.append(_force_alone(motion.seen[m, SEEN_FORCE]))
    followed = states.pop(run.system.mesh_number)
    return followed, tuple(states)


def _force_alone(force: Array) -> MeshState:
    teeth = np.zeros((0, len(force)), dtype=np.int16)
    return MeshState(
        pinion_tooth=teeth,
        wheel_tooth=teeth,
        load_share=np.zeros(teeth.shape),
        force=force.copy(),
        contact_lost=force == 0.0,
        fault_engaged=np.zeros(len(force), dtype=np.bool_),
    )
