"""Records of machines that the two-evaluation core integrates, several side by side."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

from gensig.dynamics.backends.base import N_SEEN, Motions
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind
from gensig.dynamics.integrator import integrate
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import SimulationError
from gensig.faults.base import faulty_teeth
from gensig.systems.base import Running
from gensig.systems.integration_checks import (
    checks,
    finer,
    is_too_coarse,
    not_finite,
)
from gensig.systems.run import CleanRecord, Run

Result = CleanRecord | SimulationError


def simulate_side_by_side(runs: Sequence[Run[Any]]) -> list[Result]:
    """Records of runs of one kind of machine, in the order of the runs.

    Runs that share bodies, laws, rate and duration are integrated in one call. The bits of a record
    do not depend on the other runs. A motion that cannot be integrated, or does not stay finite,
    gives its error in place of its record. Records that are too coarse are made again.
    """
    results: dict[int, Result] = {}
    machines: dict[int, Running] = {}
    kinds: dict[Hashable, list[int]] = {}
    for index, run in enumerate(runs):
        try:
            machines[index] = _at_rest(run)
        except SimulationError as error:
            results[index] = error
        else:
            kinds.setdefault(_kind(run, machines[index]), []).append(index)
    for same in kinds.values():
        records = _together([runs[i] for i in same], [machines[i] for i in same])
        results.update(zip(same, records, strict=True))
    coarse = [i for i, record in results.items() if is_too_coarse(runs[i], record)]
    if coarse:
        again = simulate_side_by_side([finer(runs[i]) for i in coarse])
        results.update(zip(coarse, again, strict=True))
    return [results[index] for index in range(len(runs))]


def _at_rest(run: Run[Any]) -> Running:
    """The machine of a run, which can be integrated and comes to rest; else SimulationError."""
    running: Running = run.system.ready(run)
    running.dynamics.check_rest()
    return running


def _kind(run: Run[Any], running: Running) -> Hashable:
    """All values that runs must share to be integrated in one call."""
    machine, dynamics = run.system, running.dynamics
    return (
        machine.sensing.sampling_rate,
        machine.sensing.channels,
        machine.operating.duration,
        machine.operating.is_steady,
        _followed(run),
        run.with_mesh_state,
        machine.solver,
        machine.mesh.law,
        machine.mesh.roll_torque,
        machine.mesh.phase,
        dynamics.dofs,
        tuple(tuple(mesh.touched) for mesh in dynamics.system.meshes),
        group_kind(dynamics.equations),
        dynamics.system.angles,
        tuple(source.dof for source in dynamics.sources),
    )


def _followed(run: Run[Any]) -> int:
    """Number of the mesh that records follow."""
    return next(k for k, mesh in enumerate(run.system.meshes) if mesh.followed)


def _together(runs: Sequence[Run[Any]], machines: Sequence[Running]) -> list[Result]:
    system = runs[0].system
    rate = system.sensing.sampling_rate
    motions = integrate(
        [running.dynamics for running in machines],
        system.solver,
        sampling_rate=rate,
        duration=system.operating.duration,
        channels=system.integrated(machines[0]),
        with_mesh_state=runs[0].with_mesh_state,
    )
    errors, verdicts = checks(motions, system.solver, rate)
    records: list[Result] = []
    for index, (run, running) in enumerate(zip(runs, machines, strict=True)):
        if not motions.finite[index]:
            records.append(not_finite(run, running.dynamics.teeth))
            continue
        number, mesh = _followed(run), None
        further: list[MeshState] = []
        if run.with_mesh_state:
            further = _mesh_states(run, running.dynamics, motions, index)
            mesh = further.pop(number)
        acceleration, angle = motions.acceleration[index], motions.angle[index]
        records.append(
            CleanRecord(
                acceleration=run.system.sensed(run, running, acceleration, angle),
                shaft_angle=angle[0],
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
    run: Run[Any], dynamics: Dynamics, motions: Motions, index: int
) -> list[MeshState]:
    """Loads of the teeth of all meshes in one of some motions."""
    states = []
    for number, mesh in enumerate(dynamics.system.meshes):
        seen = motions.seen[index][number * N_SEEN : (number + 1) * N_SEEN]
        angle = motions.angle[index][dynamics.system.angles.index(mesh.turn)]
        felt = run.system.felt(number, run.faults)
        faulty = faulty_teeth(mesh.teeth.pair, felt)
        states.append(mesh_state(mesh.teeth, seen, angle, faulty))
    return states
