"""An engine's drive line in time, steady or along a run-up.

Meshes are one-sided with backlash, some from tables of their teeth.

``docs/theory/drive_lines.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.linear.forced import closed_line, steady_response
from gensig.driveline.linear.matrices import LineMatrices
from gensig.driveline.linear.modal import with_local_losses, with_viscous_losses
from gensig.driveline.mesh_phase import start_phases
from gensig.driveline.time.newmark import (
    LineMotion,
    LineSolver,
    integrate_line,
)
from gensig.dynamics.equations import (
    A_TURN,
    A_X,
    A_Y,
    B_X,
    B_Y,
    N_IN_PLANE,
    NONE,
    Equations,
    Mesh,
)
from gensig.dynamics.linear_system import single_thread
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.course import LineCourse, ShaftTorque, constant_speed
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import ConfigError, StepError
from gensig.geometry.contact import GearPair
from gensig.mesh.even_table import even_table
from gensig.operation.setpoint import Operating

LEAST_APPROACH = 2e-6  # m, at which a mesh that carries next to nothing is taken
TABLE_STEP = 100.0 * math.pi / 30.0  # rad/s of the crank between tables of a run-up
TABLE_SHARE = 0.1  # of the largest torque between them
MOST_TABLES = 24
KNOT = 5e-3  # s between the knots of a course that changes
AFTER = 0.2  # s that a course goes on after a record: the low-pass looks ahead
MOST_STEPS = 64  # per sample, that are tried where steps turn out to be too long
LEAD_SAMPLES = 256  # before time 0: more than the low-pass looks back
ROUNDED = 1e-12  # of the largest torque, below which a course of it over the cycle is constant


@dataclass(frozen=True, slots=True, kw_only=True)
class Governor:
    """Spring and damper that hold the mean speed.

    They act on the rigid motion alone, so that no vibration feels them.
    """

    frequency: float
    damping_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineCourse:
    """Speed of the crank and brake torque over time.

    ``time`` (knot,) s, ``speed`` rad/s, ``torque`` N m.
    """

    time: Array
    speed: Array
    torque: Array

    def __post_init__(self) -> None:
        if not len(self.time) == len(self.speed) == len(self.torque) >= 1:
            raise ConfigError(
                "the course of an engine needs as many speeds and torques as times"
            )
        if not self.speed.min() > 0.0:
            raise ConfigError(
                f"the speed of the crank, {self.speed.min() * 30.0 / math.pi:g} "
                "r/min, must be positive"
            )


def steady_course(speed: float, torque: float) -> EngineCourse:
    """One speed (rad/s) and one brake torque (N m)."""
    return EngineCourse(
        time=np.zeros(1), speed=np.array([speed]), torque=np.array([torque])
    )


def operating_course(
    machine: EngineLine, operating: Operating, ratio: float, before: float
) -> EngineCourse:
    """Speed of the crank and brake torque along a record, from ``before`` s before it and more.

    ``ratio`` is the speed of the shaft that ``operating`` is of over the crank's.
    """
    if operating.is_steady:
        return steady_course(operating.speed / ratio, operating.torque)
    time = np.arange(-2.0 * before, operating.duration + AFTER, KNOT)
    nominal = operating.nominal(time)
    load = machine.load_at(operating.torque, nominal.speed / operating.speed)
    return EngineCourse(
        time=time, speed=nominal.speed / ratio, torque=load * nominal.torque_factor
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunningLine:
    """A line ready to be integrated.

    ``mesh_force`` (mesh,) N are the mean forces; ``teeth`` are those of meshes that are tabulated.
    """

    machine: EngineLine
    matrices: LineMatrices
    dynamics: Dynamics
    mesh_force: Array
    teeth: Mapping[int, MeshTeeth]

    def with_angles(self, nodes: Sequence[int]) -> RunningLine:
        """The line whose motion gives out the angles of nodes, by their numbers."""
        angles = tuple(self.dof(node) for node in nodes)
        system = replace(self.dynamics.system, angles=angles)
        return replace(self, dynamics=replace(self.dynamics, system=system))

    def dof(self, node: int) -> int:
        """Index of the degree of freedom that a node, by its number, turns with."""
        return _dof(self.matrices, self.machine.drive.numbers.index(node))

    @single_thread
    def run(
        self,
        solver: LineSolver,
        *,
        duration: float,
        channels: Sequence[tuple[str, int]],
        settling: float,
        with_pairs: bool = False,
    ) -> LineMotion:
        """Motion from the static deflection with the linear vibration on it.

        Integration begins at least ``settling`` s before time 0. A step that turns out to be too
        long is halved, as a gear pair's, up to ``MOST_STEPS`` a sample.
        """
        lead = max(settling, LEAD_SAMPLES / solver.sampling_rate)
        lead = math.ceil(lead * solver.sampling_rate) / solver.sampling_rate
        angle, rate = self.dynamics.vibration_at(-lead)
        start = self.dynamics.static_start(-lead) + angle, rate
        while True:
            try:
                return integrate_line(
                    self.dynamics,
                    solver,
                    duration=duration,
                    channels=channels,
                    lead_in=lead,
                    start=start,
                    with_pairs=with_pairs,
                )
            except StepError:
                if 2 * solver.oversampling > MOST_STEPS:
                    raise
                solver = replace(solver, oversampling=2 * solver.oversampling)


@single_thread
def running_line(
    machine: EngineLine,
    course: EngineCourse,
    *,
    governor: Governor,
    teeth: Mapping[int, MeshTeeth] | None = None,
    turned: float = 0.0,
    local_losses: bool = False,
) -> RunningLine:
    """The line of an engine with its torques along a course.

    Parameters
    ----------
    teeth : of meshes by the index of the mesh, whose start agrees with where the crank stands; all
        other meshes hold the stiffness of the table
    turned : rad, angle of the crank in its cycle at time 0; all meshes and torques follow from it
    local_losses : whether loss factors of shafts are dampers beside them, not of modes

    Raises
    ------
    ConfigError    for courses that the engine cannot run
    """
    merged = machine.matrices(merge_rigid=True)
    matrices = (
        with_local_losses(merged) if local_losses else with_viscous_losses(merged)
    )
    speed, torque = float(course.speed[0]), float(course.torque[0])
    first = _tables(machine, matrices, speed, torque)
    closed, elements = closed_line(matrices)
    linear = steady_response(closed, first, speed)
    mesh_force = linear.element_forces(elements)[0]
    nominal = constant_speed(speed)
    if len(course.time) > 1:
        nominal = LineCourse(time=course.time, speed=course.speed)
    system = _equations(
        machine, matrices, governor, mesh_force, teeth or {}, turned, speed
    )
    reference = [
        reference_force(machine, m, force)
        for m, force in enumerate(mesh_force.tolist())
    ]
    dynamics = Dynamics(
        dofs=matrices.names,
        system=system,
        nominal=nominal,
        torques=_torques(machine, matrices, course, turned, first),
        friction_torque=_friction_torque(
            machine, matrices, system, reference, teeth or {}
        ),
        reference_force=np.array(reference),
        vibration=linear,
        turned=turned,
    )
    return RunningLine(
        machine=machine,
        matrices=matrices,
        dynamics=dynamics,
        mesh_force=mesh_force,
        teeth=teeth or {},
    )


def mesh_forces(machine: EngineLine, speed: float, torque: float) -> Array:
    """Mean normal forces of the meshes at a speed of the crank and a brake torque, (mesh,) N."""
    closed, elements = machine.linear()
    response = steady_response(
        closed, machine.on_line(machine.torques(speed, torque)), speed, n_orders=1
    )
    return response.element_forces(elements)[0]


@lru_cache(maxsize=64)
def named_by_side(pair: GearPair) -> GearPair:
    """The pair with its gears named by their sides, as faults and mesh tables name them."""
    pinion, wheel = (replace(gear, name=side) for side, gear in pair.gears.items())
    return replace(pair, pinion=pinion, wheel=wheel)


def reference_force(machine: EngineLine, number: int, force: float) -> float:
    """The force at which a mesh's contact and damping are taken, N.

    Its mean, and what closes it by 2 um at least.
    """
    return max(abs(force), machine.drive.line.meshes[number].stiffness * LEAST_APPROACH)


def _equations(
    machine: EngineLine,
    matrices: LineMatrices,
    governor: Governor,
    forces: Array,
    teeth: Mapping[int, MeshTeeth],
    turned: float,
    speed: float,
) -> Equations:
    """Bodies, springs and meshes of a line; ``speed`` rad/s is that of the crank."""
    rotation, mass = matrices.rigid[0], np.diag(matrices.mass)
    momentum = mass * rotation
    rate = 2.0 * math.pi * governor.frequency
    meshes = []
    for number, phase in enumerate(start_phases(machine.drive, turned)):
        of_mesh = teeth.get(number) or _even_teeth(machine, matrices, number, phase)
        force = float(forces[number])
        meshes.append(_mesh(machine, matrices, number, of_mesh, force, speed))
    return Equations(
        mass=mass,
        stiffness=matrices.stiffness,
        damping=matrices.damping,
        rotation=rotation,
        held=rate / math.sqrt(float(rotation @ momentum)) * momentum,
        held_damping=2.0 * governor.damping_ratio / rate,
        meshes=tuple(meshes),
        sources=(),
        reference=int(np.argmin(np.abs(rotation - 1.0))),
        angles=(),
    )


def _friction_torque(
    machine: EngineLine,
    matrices: LineMatrices,
    system: Equations,
    forces: Sequence[float],
    teeth: Mapping[int, MeshTeeth],
) -> Array:
    """Torques on the driving shafts that make up for the mean friction of all meshes, (dof,)."""
    rotation, lost = system.rotation, 0.0
    for number, of_mesh in teeth.items():
        turning = float(rotation[system.meshes[number].turn])
        lost += of_mesh.friction_torque(forces[number]) * turning
    numbers, torques = machine.drive.numbers, np.zeros(len(rotation))
    driving = [_dof(matrices, numbers.index(n)) for n in machine.engine.driving_nodes]
    for dof in driving:
        torques[dof] += lost / (len(driving) * float(rotation[dof]))
    return torques


def _mesh(
    machine: EngineLine,
    matrices: LineMatrices,
    number: int,
    teeth: MeshTeeth,
    force: float,
    speed: float,
) -> Mesh:
    touched = np.array(_touched_dofs(machine, matrices, number))
    is_there = touched != NONE
    reach = np.where(is_there, matrices.directions[number][touched], 0.0)
    damping = float(matrices.mesh_damping[number])
    reference = reference_force(machine, number, force)
    return Mesh(
        name=machine.mesh_names[number],
        teeth=teeth,
        touched=touched,
        reach=reach,
        slide=_slide(reach, _turning_sense(machine, number)),
        stiffness=teeth.mean_stiffness(reference),
        # so many N s/m under the mean force; a mesh that carries less is damped less
        damping=damping / reference,
        mean_force=force,
        speed=abs(float(matrices.rigid[0][touched[A_TURN]])) * speed,
    )


def _even_teeth(
    machine: EngineLine, matrices: LineMatrices, number: int, phase: float
) -> MeshTeeth:
    """Teeth of the stiffness that the table of the meshes gives."""
    pair = replace(
        machine.drive.pairs[number], backlash=float(matrices.backlash[number])
    )
    table = even_table(pair, float(matrices.mesh_stiffness[number]))
    return MeshTeeth.perfect(table, start_phase=phase)


def _touched_dofs(
    machine: EngineLine, matrices: LineMatrices, number: int
) -> list[int]:
    """Degrees of freedom of x, y and rotation of both gears of a mesh, ``NONE`` for none."""
    line, dofs = machine.drive.line, []
    mesh = line.meshes[number]
    for gear in (line.gears[mesh.driving], line.gears[mesh.driven]):
        for axis in "xy":
            name = f"{gear.name} {axis}"
            dofs.append(NONE)
            if name in matrices.names:
                dofs[-1] = matrices.names.index(name)
        dofs.append(_dof(matrices, gear.node))
    return dofs


def _slide(reach: Array, sense: float) -> Array:
    """Direction of the friction of a mesh along the motions of its gears, (motion,).

    Where gear a turns against its frame (``sense`` -1), as in a gear pair, gear a feels it along
    x, which is y turned back by a right angle. Where it turns from x to y, it is the other way.
    """
    slide = np.zeros(N_IN_PLANE)
    for x, y in ((A_X, A_Y), (B_X, B_Y)):
        slide[x], slide[y] = sense * reach[y], -sense * reach[x]
    return slide


def _turning_sense(machine: EngineLine, number: int) -> float:
    """1 where the driving gear of a mesh turns from x to y, else -1."""
    line = machine.drive.line
    gear = line.gears[line.meshes[number].driving]
    return math.copysign(1.0, line.speed_ratio[gear.node])


def _dof(matrices: LineMatrices, number: int) -> int:
    """Degree of freedom that a node, by its index in the line, turns with."""
    return int(np.argmax(matrices.expand[number]))


def _tables(
    machine: EngineLine, matrices: LineMatrices, speed: float, torque: float
) -> Array:
    """Torques on the degrees of freedom over the cycle of the crank, (dof, point) N m."""
    on_nodes = machine.torques(speed, torque).on(machine.drive.numbers)
    return matrices.expand[: len(on_nodes)].T @ on_nodes


def _torques(
    machine: EngineLine,
    matrices: LineMatrices,
    course: EngineCourse,
    turned: float,
    first: Array,
) -> tuple[ShaftTorque, ...]:
    """Torques of the engine along a course, straight between tables at some times."""
    rotation, numbers = matrices.rigid[0], machine.drive.numbers
    throws = [_dof(matrices, numbers.index(n)) for n in machine.engine.driving_nodes]
    crank = abs(float(rotation[throws[0]]))
    knots = _table_times(course)
    torques: list[ShaftTorque] = []
    for number, time in enumerate(knots):
        tables, share = first, None
        if number > 0:
            speed = float(np.interp(time, course.time, course.speed))
            torque = float(np.interp(time, course.time, course.torque))
            tables = _tables(machine, matrices, speed, torque)
        if len(knots) > 1:
            share = np.interp(course.time, knots, np.eye(len(knots))[number])
        least = ROUNDED * float(np.abs(tables).max())
        for dof in np.flatnonzero(np.any(tables != 0.0, axis=1)):
            table, ratio = tables[dof], abs(float(rotation[dof])) / crank
            if np.ptp(table) <= least:
                table = table[:1]
            torques.append(
                ShaftTorque(
                    dof=int(dof),
                    table=table,
                    period=CYCLE * ratio,
                    phase=turned * ratio % (CYCLE * ratio),
                    factor=share,
                )
            )
    if len(course.time) > 1:
        # the throws, or the motor, also speed up the whole line
        inertia = float(rotation @ matrices.mass @ rotation) / crank
        rise = inertia * np.gradient(course.speed / crank, course.time)
        even = np.array([1.0 / len(throws)])
        torques += [ShaftTorque(dof=dof, table=even, factor=rise) for dof in throws]
    return tuple(torques)


def _table_times(course: EngineCourse) -> Array:
    """Times between whose torques a course goes straight."""
    if len(course.time) == 1:
        return course.time
    greatest = max(float(np.abs(course.torque).max()), 1e-9)
    steps = np.abs(np.diff(course.speed)) / TABLE_STEP
    steps = steps + np.abs(np.diff(course.torque)) / (TABLE_SHARE * greatest)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    n_tables = min(MOST_TABLES, 1 + math.ceil(travelled[-1]))
    if n_tables < 2:
        return course.time[:1]
    knots_at = np.searchsorted(
        travelled, np.linspace(0.0, travelled[-1], n_tables)[1:-1]
    )
    return course.time[np.unique([0, *knots_at, len(travelled) - 1])]
