"""Records of drive lines from the two-evaluation core, several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.running import RunningLine
from gensig.driveline.side_by_side.line_mesh_states import line_mesh_state
from gensig.dynamics.backends.base import N_SEEN, Integration, Motions
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind
from gensig.dynamics.backends.registry import BACKENDS, EXPLICIT_BACKEND
from gensig.dynamics.mesh_state import MeshState
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import SimulationError
from gensig.systems.integration_checks import (
    checks,
    not_finite,
    records_by_kind,
)
from gensig.systems.run import CleanRecord, Run

Array = NDArray[np.float64]
LineRun = Run[Any]  # of a ``LineMachine``, whose module imports this one
Channel = tuple[str, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineSignals:
    """Signals of a line by channel, (sample,), and the nominal motion of its reference.

    A channel is a kind, ``acceleration`` or ``angle``, and a degree of freedom; signals are
    deviations from nominal rotation in m/s2, rad/s2 or rad.
    """

    signals: dict[Channel, Array]
    nominal_angle: Array
    nominal_speed: Array


def simulate_lines(runs: Sequence[LineRun]) -> list[CleanRecord | SimulationError]:
    """Records of runs, in the order of the runs; lines of the same bodies are integrated together.

    A record's bits do not depend on the other runs. A motion that does not stay finite, or a
    machine that the core does not cover, gives its error in place of its record.
    """
    return records_by_kind(
        runs, dynamics_of=_checked_line, kind_of=_kind, integrate=_together
    )


def _checked_line(run: LineRun) -> RunningLine:
    line = running_line_of(run)
    for number, mesh in enumerate(line.dynamics.system.meshes):
        if number not in line.teeth:
            raise SimulationError(
                "solver.backend = nystroem takes meshes of tabulated teeth, but mesh "
                f"{mesh.name} has none; take solver.backend=newmark"
            )
    per_sample = run.system.solver.oversampling
    BACKENDS[EXPLICIT_BACKEND].check_step(line.dynamics, _rate(run), per_sample)
    return line


def running_line_of(run: LineRun) -> RunningLine:
    """The line of one run; its first angle is that of the followed mesh's driving gear.

    Where the run asks for the loads of the teeth, the driving gears of all meshes are among them.
    """
    machine = run.system
    engine, line = machine.engine, machine.engine.drive.line
    turned = [machine.driving_node, *(wheel.node for wheel in engine.wheels.values())]
    if run.with_mesh_state:
        nodes = [line.gears[mesh.driving].node for mesh in line.meshes]
        turned += [engine.drive.numbers[node] for node in nodes]
    running: RunningLine = machine.line(run)
    return running.with_angles(turned)


def _rate(run: LineRun) -> float:
    return float(run.system.sensing.sampling_rate)


def _kind(run: LineRun, running: RunningLine) -> tuple[object, ...]:
    """All values that runs must share to be integrated in one call."""
    machine, line = run.system, running.dynamics
    touched = [tuple(mesh.touched) for mesh in line.system.meshes]
    return (
        machine.sensing.sampling_rate,
        machine.sensing.channels,
        machine.operating.duration,
        machine.operating.is_steady,
        machine.mesh_number,
        run.with_mesh_state,
        machine.solver,
        machine.mesh.roll_torque,
        line.dofs,
        tuple(touched),
        group_kind(line.equations),
        line.system.angles,
        tuple(source.dof for source in line.sources),
    )


def _together(
    runs: Sequence[LineRun], lines: Sequence[RunningLine]
) -> list[CleanRecord | SimulationError]:
    machine, first = runs[0].system, lines[0].dynamics
    rate, solver = _rate(runs[0]), machine.solver
    kinds = machine.signals(lines[0])
    dofs = [dof for kind, dof in kinds if kind == "acceleration"]
    integration = Integration(
        sampling_rate=rate,
        duration=machine.operating.duration,
        # a line without an acceleration has one all the same, by which its steps are checked
        channels=tuple(first.dofs[dof] for dof in dofs or [first.system.angles[0]]),
        with_mesh_state=runs[0].with_mesh_state,
        oversampling=solver.oversampling,
        precision=solver.precision,
        max_error=solver.max_error,
    )
    motions = BACKENDS[EXPLICIT_BACKEND].integrate(
        [line.dynamics for line in lines], integration
    )
    errors, verdicts = checks(motions, solver, rate)
    records: list[CleanRecord | SimulationError] = []
    for index, (run, running) in enumerate(zip(runs, lines, strict=True)):
        line = running.dynamics
        if not motions.finite[index]:
            records.append(not_finite(run, line.teeth))
            continue
        signals = _signals(line, motions, index, dofs, rate)
        number, mesh = run.system.mesh_number, None
        further: list[MeshState] = []
        if run.with_mesh_state:
            further = _mesh_states(run, line, motions, index)
            mesh = further.pop(number)
        records.append(
            CleanRecord(
                acceleration=run.system.rows(run, running, signals),
                shaft_angle=motions.angle[index][0],
                mean_speed=float(motions.mean_speed[index]),
                contact_loss_fraction=float(motions.contact_loss[index, number]),
                integration_error=float(errors[index]),
                integration_check=verdicts[index],
                mesh=mesh,
                further_meshes=tuple(further),
            )
        )
    return records


def _mesh_states(
    run: LineRun, line: Dynamics, motions: Motions, index: int
) -> list[MeshState]:
    """Loads of the teeth of all meshes in one of some motions."""
    states = []
    for m, mesh in enumerate(line.system.meshes):
        seen = motions.seen[index][m * N_SEEN : (m + 1) * N_SEEN]
        angle = motions.angle[index][line.system.angles.index(mesh.turn)]
        states.append(line_mesh_state(run, mesh.teeth, m, seen, angle))
    return states


def _signals(
    line: Dynamics, motions: Motions, index: int, dofs: Sequence[int], rate: float
) -> LineSignals:
    """Signals of one of some motions by channel; angles are deviations."""
    angles = motions.angle[index]
    times = np.arange(angles.shape[1]) / rate
    nominal_angle, nominal_speed = line.nominal.over(times)
    rotation = line.system.rotation
    signals: dict[Channel, Array] = {
        ("acceleration", dof): motions.acceleration[index][row]
        for row, dof in enumerate(dofs)
    }
    for dof, angle in zip(line.system.angles, angles, strict=True):
        signals["angle", dof] = angle - rotation[dof] * nominal_angle
    return LineSignals(
        signals=signals, nominal_angle=nominal_angle, nominal_speed=nominal_speed
    )
