"""Records of drive lines by Newmark's method, one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.driveline.channels import channel_rows
from gensig.driveline.running import RunningLine
from gensig.driveline.time.newmark import LineMotion
from gensig.dynamics.backends.base import SEEN_FORCE
from gensig.dynamics.linear_system import single_thread
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.faults.base import faulty_teeth
from gensig.systems.run import CleanRecord, Run

LineRun = Run[Any]  # of a ``LineMachine``, whose module imports this one
Channel = tuple[str, int]

# s before a record, until the start from the linear vibration has died away
SETTLING = 0.3


@single_thread
def newmark_record(run: LineRun) -> CleanRecord:
    """Record of one run; SimulationError for a motion that cannot be integrated."""
    machine = run.system
    line = machine.line(run)
    channels = machine.signals(line)
    if run.with_mesh_state:
        channels += _angle_channels(line)
    motion, angle = line_motion(
        machine,
        line,
        machine.operating.duration,
        channels,
        with_pairs=run.with_mesh_state,
    )
    turned = float(angle[-1] - angle[0])
    mesh: MeshState | None = None
    further: tuple[MeshState, ...] = ()
    if run.with_mesh_state:
        mesh, further = _mesh_states(run, line, motion)
    return CleanRecord(
        acceleration=channel_rows(run, line, motion, machine.mesh_number),
        shaft_angle=angle,
        mean_speed=turned * machine.sensing.sampling_rate / max(len(angle) - 1, 1),
        contact_loss_fraction=float(motion.contact_loss[machine.mesh_number]),
        integration_error=motion.energy_residual,
        integration_check="energy",
        mesh=mesh,
        further_meshes=further,
    )


def line_motion(
    machine: Any,
    line: RunningLine,
    duration: float,
    channels: list[Channel],
    *,
    with_pairs: bool = False,
) -> tuple[LineMotion, Array]:
    """Motion of a line, and the angle of the driving gear's shaft, (sample,) rad."""
    shaft = "angle", line.dof(machine.driving_node)
    motion = line.run(
        machine.line_solver,
        duration=duration,
        channels=list(dict.fromkeys([*channels, shaft])),
        settling=SETTLING,
        with_pairs=with_pairs,
    )
    return motion, machine.ratio * motion.nominal_angle + motion.signals[shaft]


def _angle_channels(running: RunningLine) -> list[Channel]:
    """Channels of a motion that ``_mesh_states`` needs: angles of all driving gears."""
    return [("angle", mesh.turn) for mesh in running.dynamics.system.meshes]


def _mesh_states(
    run: LineRun, running: RunningLine, motion: LineMotion
) -> tuple[MeshState, tuple[MeshState, ...]]:
    """Loads of the teeth of the followed mesh, and of the others in the order of the line.

    The motion has ``_angle_channels`` and the state of its pairs. A mesh without tabulated teeth
    has a force alone.
    """
    states = []
    for m, channel in enumerate(_angle_channels(running)):
        nominal = running.dynamics.system.rotation[channel[1]] * motion.nominal_angle
        if m in running.teeth:
            angle = nominal + motion.signals[channel]
            teeth = running.teeth[m]
            faulty = faulty_teeth(teeth.pair, run.system.felt(m, run.faults))
            states.append(mesh_state(teeth, motion.seen[m], angle, faulty))
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
