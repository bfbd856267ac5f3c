"""Loads of the teeth of all meshes in a motion of a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.running import RunningLine
from gensig.driveline.teeth import felt_there
from gensig.driveline.time.newmark import LineMotion
from gensig.dynamics.backends.base import SEEN_FORCE
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.faults.base import faulty_teeth
from gensig.systems.run import Run

Array = NDArray[np.float64]
LineRun = Run[Any]  # of a ``LineMachine``, whose module imports this one


def line_mesh_state(
    run: LineRun, teeth: MeshTeeth, m: int, seen: Array, angle: Array
) -> MeshState:
    """Loads of the teeth of mesh ``m`` in a motion.

    Parameters
    ----------
    seen : (row, sample)    state of its pairs
    angle : (sample,) rad   of its driving gear since time 0
    """
    machine, drive = run.system, run.system.engine.drive
    felt = felt_there(drive, machine.mesh_number, m, run.faults)
    return mesh_state(teeth, seen, angle, faulty_teeth(teeth.pair, felt))


def angle_channels(running: RunningLine) -> list[tuple[str, int]]:
    """Channels of a motion that ``line_mesh_states`` needs: angles of all driving gears."""
    return [("angle", mesh.turn) for mesh in running.dynamics.system.meshes]


def line_mesh_states(
    run: LineRun, running: RunningLine, motion: LineMotion
) -> tuple[MeshState, tuple[MeshState, ...]]:
    """Loads of the teeth of the followed mesh, and of the others in the order of the line.

    The motion has ``angle_channels`` and the state of its pairs. A mesh without tabulated teeth has
    a force alone.
    """
    states = []
    for m, channel in enumerate(angle_channels(running)):
        nominal = running.dynamics.system.rotation[channel[1]] * motion.nominal_angle
        if m in running.teeth:
            angle = nominal + motion.signals[channel]
            seen = motion.seen[m]
            states.append(line_mesh_state(run, running.teeth[m], m, seen, angle))
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
