"""Lines of spur meshes side by side in the two-evaluation core."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.line_gears import STILL
from gensig.driveline.running import RunningLine, reference_force
from gensig.driveline.time.newmark import static_start
from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS
from gensig.dynamics._vector import aligned
from gensig.dynamics.backends.base import Integration, Motions
from gensig.dynamics.backends.group_motions import integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.nystroem import _line_kernels
from gensig.dynamics.backends.nystroem import _line_layout as lines
from gensig.dynamics.backends.nystroem._line_layout import LineGroup, line_scratch
from gensig.dynamics.backends.nystroem._pairs import CELL
from gensig.dynamics.backends.nystroem.method import (
    OTHER_BACKEND,
    missing_cells,
    refuse,
)
from gensig.dynamics.backends.nystroem.stability import stable_rate
from gensig.dynamics.backends.step_limits import (
    COARSE_STABILITY,
    LONGEST_SETTLING,
    SETTLED,
)
from gensig.dynamics.integrator import Solver
from gensig.dynamics.lanes import (
    CELLS_PER_SECOND,
    exact_numbers,
    fill_lanes,
    mesh_indices,
    mesh_numbers,
    tooth_rows,
)
from gensig.dynamics.pair import Body, PairDynamics
from gensig.errors import SimulationError
from gensig.mesh.pair_table import PairTable
from gensig.operation.setpoint import Operating

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ROUNDED = (
    1e-12  # of the diagonals, at most, are entries of damping that rounding leaves
)
STIFFER = 1.2  # than their mean stiffness are meshes taken for the longest step


@dataclass(frozen=True, kw_only=True, eq=False)
class LineDynamics:
    """All parameters of the motion of one line of spur meshes.

    No slots: what follows from them is cached.

    Parameters
    ----------
    running : the line with its course, torques and mean mesh forces
    pairs : the teeth of every mesh with their law; their supports are not read
    touched : (mesh, 6) degrees of freedom of x, y and rotation of gear a and of gear b, -1 for a
        gear that does not move so
    senses : (mesh,) 1 where gear a turns from x to y, else -1
    drive : degree of freedom that makes up for the mean friction
    angles : degrees of freedom whose angles are given out
    """

    running: RunningLine
    pairs: tuple[PairDynamics, ...]
    touched: Index
    senses: Array
    drive: int
    angles: tuple[int, ...]

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.running.line.names

    @cached_property
    def reach(self) -> Array:
        """Gradient of the approach along the degrees of freedom of every mesh, (mesh, 6)."""
        reach = np.zeros(self.touched.shape)
        for row, mesh, dofs in zip(
            reach, self.running.line.meshes, self.touched, strict=True
        ):
            row[dofs >= 0] = mesh.direction[dofs[dofs >= 0]]
        return reach

    @property
    def slide(self) -> Array:
        """Direction of friction along the degrees of freedom of every mesh, (mesh, 6).

        Gear a of a pair that turns against its frame feels it along x, which is y turned back by a
        right angle; a mirrored pair feels it the other way.
        """
        slide = np.zeros_like(self.reach)
        # the gradient is -y of the frame on gear a and y on gear b, and so is friction along x
        for first in (lines.A_X, lines.B_X):
            slide[:, first] = self.senses * self.reach[:, first + 1]
            slide[:, first + 1] = -self.senses * self.reach[:, first]
        return slide

    @cached_property
    def friction_torque(self) -> float:
        """Mean friction torque of all meshes, reduced to the drive, N m."""
        rotation = self.running.line.rotation
        lost = [
            pair.friction_torque() * rotation[dofs[lines.A_TURN]]
            for pair, dofs in zip(self.pairs, self.touched, strict=True)
        ]
        return float(sum(lost) / rotation[self.drive])

    @cached_property
    def stiff_rates(self) -> NDArray[np.complex128]:
        """Eigenvalues with the meshes held at 1.2 times their mean stiffness, 1/s."""
        return self._rates(STIFFER)

    @property
    def settling_time(self) -> float:
        """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
        rates = -np.real(self._rates(1.0))
        slowest = float(rates[rates > 1e-3].min(initial=np.inf))
        return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / slowest)

    def _rates(self, stiffer: float) -> NDArray[np.complex128]:
        line = self.running.line
        stiffness, n = line.stiffness.copy(), len(line.names)
        for mesh, pair in zip(line.meshes, self.pairs, strict=True):
            held = stiffer * pair.mean_mesh_stiffness
            stiffness += held * np.outer(mesh.direction, mesh.direction)
        per_mass = 1.0 / np.diag(line.mass)[:, None]
        state = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-stiffness * per_mass, -line.damping * per_mass],
            ]
        )
        return np.linalg.eigvals(state).astype(np.complex128)

    @cached_property
    def rest(self) -> Array:
        """Deflection about which the line moves, its reference not turned, (dof,)."""
        start, rotation = self.static_start(0.0), self.running.line.rotation
        return np.asarray(start - rotation * start[self.reference])

    @property
    def reference(self) -> int:
        """Degree of freedom that turns with the reference."""
        return int(np.argmin(np.abs(self.running.line.rotation - 1.0)))

    def static_start(self, time: float) -> Array:
        """Deflection under the mean torques at a nominal time, (dof,)."""
        running = self.running
        return static_start(running.line, running.course, running.torques, time=time)

    def forces(self, times: Array) -> Array:
        """Torques and forces on the degrees of freedom at times in s, (time, dof)."""
        forces = np.zeros((len(times), len(self.dofs)))
        for torque in self.running.torques:
            factor: Array | float = 1.0
            if torque.factor is not None:
                factor = np.interp(times, self.running.course.time, torque.factor)
            forces[:, torque.dof] += float(torque.table.mean()) * factor
        forces[:, self.drive] += self.friction_torque
        return forces


def line_dynamics(
    running: RunningLine,
    operating: Operating,
    *,
    drive: int,
    angles: Sequence[int],
) -> LineDynamics:
    """The motion of a line whose meshes all have tables of spur teeth.

    Parameters
    ----------
    operating : options of the set-point; its speed and torque are not read
    drive : number of the node that turns the line
    angles : numbers of the nodes whose angles are given out
    """
    speed = float(running.course.speed[0])
    meshes = range(len(running.line.meshes))
    return LineDynamics(
        running=running,
        pairs=tuple(_pair(running, m, operating, speed) for m in meshes),
        touched=np.array([running.touched(m) for m in meshes], dtype=np.int64),
        senses=np.array([running.sense(m) for m in meshes]),
        drive=running.dof(drive),
        angles=tuple(running.dof(node) for node in angles),
    )


def check_line(line: LineDynamics, solver: Solver, sampling_rate: float) -> None:
    """Raise SimulationError for an unstable step or a line that the core does not cover."""
    for pair in line.pairs:
        refuse(pair)
    for torque in line.running.torques:
        if len(torque.table) > 1:
            raise SimulationError(
                f"solver.backend = nystroem takes torques that do not follow an angle, but that "
                f"on '{line.dofs[torque.dof]}' does; {OTHER_BACKEND}"
            )
    needed = math.ceil(stable_rate(line.stiff_rates) / sampling_rate)
    if needed > solver.oversampling:
        raise SimulationError(
            f"solver.oversampling = {solver.oversampling} makes too long steps for "
            f"solver.backend=nystroem; raise solver.oversampling to at least {needed}"
        )


def _pair(
    running: RunningLine, m: int, operating: Operating, speed: float
) -> PairDynamics:
    """The teeth of a mesh under its mean force, on bodies that are not read."""
    mesh, tabulated = running.line.meshes[m], running.tabulated.get(m)
    if tabulated is None or not isinstance(tabulated.table, PairTable):
        raise SimulationError(
            f"solver.backend = nystroem takes meshes of spur teeth, but mesh {mesh.name} has "
            f"helical ones; {OTHER_BACKEND}"
        )
    table = tabulated.table
    pair, force = table.pair, float(running.mesh_force[m])
    force = reference_force(running.machine, m, force)
    point = replace(
        operating,
        speed=speed * float(running.line.rotation[mesh.roll_dof]),
        torque=force * pair.pinion.base_radius,
    )
    n_teeth = pair.pinion.n_teeth, pair.wheel.n_teeth
    errors = tabulated.errors or (np.zeros(n_teeth[0]), np.zeros(n_teeth[1]))
    body = Body(mass=1.0, inertia=1.0, support=STILL)
    return PairDynamics(
        table=table,
        pinion=body,
        wheel=body,
        operating=point,
        pinion_error=errors[0],
        wheel_error=errors[1],
        pinion_tilt=np.zeros(n_teeth[0]),
        wheel_tilt=np.zeros(n_teeth[1]),
        start_tooth_pinion=mesh.start_teeth[0],
        start_tooth_wheel=mesh.start_teeth[1],
        start_phase=mesh.start_phase,
    )


def line_core(n_meshes: int, n_angles: int) -> Core[LineDynamics]:
    """The core for lines of so many meshes and angles."""
    return Core(
        pack=pack_lines,
        scratch=partial(_scratch, n_meshes),
        integrate=_line_kernels.integrate,
        coarsest_oversampling=_coarsest_oversampling,
        settling_time=lambda line: line.settling_time,
        n_meshes=n_meshes,
        n_angles=n_angles,
    )


def integrate_lines(
    machines: Sequence[LineDynamics], integration: Integration
) -> Motions:
    """Motions of lines of the same bodies and meshes; rows as ``Motions`` says."""
    first = machines[0]
    core = line_core(len(first.pairs), len(first.angles))
    motions = integrate_machines(machines, integration, core)
    rests = np.array([line.rest[list(line.angles)] for line in machines])
    return replace(motions, angle=motions.angle + rests[:, :, None])


def _scratch(n_meshes: int, n_dof: int, n_channels: int, precision: str):
    return line_scratch(n_meshes, n_dof, precision)


def _coarsest_oversampling(
    line: LineDynamics, oversampling: int, sampling_rate: float
) -> int:
    least = stable_rate(line.stiff_rates) / (COARSE_STABILITY * sampling_rate)
    return min(oversampling, math.ceil(least))


def pack_lines(
    dynamics: Sequence[LineDynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
) -> LineGroup:
    """Lines of the same bodies and meshes as one group; arguments are those of ``lanes.pack``."""
    lanes = fill_lanes(dynamics, precision)
    first = lanes[0]
    n_meshes = len(first.pairs)
    rests = np.stack([lane.rest for lane in lanes])
    meshes = [_MeshRows.of(lanes, m, step, rests) for m in range(n_meshes)]
    tables, teeth = [], 0
    indices = []
    n_values = 0
    for mesh in meshes:
        moved = mesh.indices.copy()
        moved[:, [layout.TABLE, layout.COAST_TABLE]] += n_values
        moved[:, [layout.PINION_TOOTH, layout.WHEEL_TOOTH]] += teeth
        indices.append(moved)
        tables.append(mesh.table)
        n_values += len(mesh.table)
        teeth += len(mesh.tooth_row)
    table = np.concatenate([*tables, missing_cells()])
    assert len(table) == n_values + 2 * CELL

    def side_by_side(values: Array) -> NDArray[np.floating]:
        """Values (lane, row...) flat, with the lanes along the last axis."""
        return np.ascontiguousarray(np.moveaxis(values, 0, -1), dtype=precision).ravel()

    lines_of = [lane.running.line for lane in lanes]
    mass = np.stack([np.diag(line.mass) for line in lines_of])
    stiffness = np.stack([line.stiffness for line in lines_of])
    damping = np.stack([line.damping for line in lines_of])
    rotation = np.stack([line.rotation for line in lines_of])
    dofs = np.arange(mass.shape[1])
    sprung, damped = _couplings(stiffness), _couplings(damping)
    mean = np.stack([lane.running.mesh_force for lane in lanes])
    held = np.einsum("lij,lj->li", stiffness, rests)
    for row, lane, forces in zip(held, lanes, mean, strict=True):
        row += sum(
            force * mesh.direction
            for force, mesh in zip(forces, lane.running.line.meshes, strict=True)
        )
    profile, profile_first, per_second, steady = _profile(lanes, span)
    reach = np.stack([lane.reach for lane in lanes])
    slide = np.stack([lane.slide for lane in lanes])
    turning = rotation[:, first.touched[:, lines.A_TURN]]
    group = LineGroup(
        n_meshes=n_meshes,
        numbers=np.concatenate([side_by_side(mesh.numbers) for mesh in meshes]),
        exact=np.concatenate([mesh.exact.T.ravel() for mesh in meshes]),
        indices=np.concatenate([values.T.ravel() for values in indices]),
        table=table.astype(precision),
        bend=np.concatenate([mesh.bend.ravel() for mesh in meshes]).astype(precision),
        tooth_row=np.concatenate([mesh.tooth_row for mesh in meshes]),
        tooth_error=np.concatenate([mesh.tooth_error for mesh in meshes]),
        tooth_tilt=np.concatenate([mesh.tooth_tilt for mesh in meshes]),
        one_sided=True,
        consistent=first.pairs[0].table.options.roll_torque == "consistent",
        touched=np.ascontiguousarray(first.touched).ravel(),
        reach=side_by_side(reach),
        slide=side_by_side(slide),
        turning=turning.T.ravel(),
        inverse_mass=side_by_side(1.0 / mass),
        stiffness=side_by_side(stiffness[:, dofs, dofs]),
        damping=side_by_side(damping[:, dofs, dofs]),
        sprung_first=sprung.first,
        sprung_column=sprung.column,
        sprung=side_by_side(sprung.value),
        damped_first=damped.first,
        damped_column=damped.column,
        damped=side_by_side(damped.value),
        force=side_by_side(steady - held),
        rest=np.ascontiguousarray(rests.T),
        rotation=side_by_side(rotation),
        exact_rotation=rotation.T.ravel(),
        held=side_by_side(np.einsum("lij,lj->li", stiffness, rotation)),
        carried=side_by_side(mass * rotation),
        profile=profile,
        profile_first=profile_first,
        cells_per_second=per_second,
        reference=first.reference,
        angles=np.array(first.angles, dtype=np.int64),
    )
    fields = group._asdict()
    for name, values in fields.items():
        if isinstance(values, np.ndarray):
            fields[name] = aligned(np.ascontiguousarray(values))
    return LineGroup(**fields)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Couplings:
    """Entries of matrices beside their diagonals, row after row.

    ``first`` (row + 1,), ``column`` (entry,), ``value`` (lane, entry).
    """

    first: Index
    column: Index
    value: Array


def _couplings(matrices: Array) -> _Couplings:
    """Entries beside the diagonals of matrices (lane, row, column), but for what is rounded."""
    diagonal = np.sqrt(np.abs(np.einsum("lii->li", matrices)))
    least = ROUNDED * diagonal[:, :, None] * diagonal[:, None, :]
    is_entry = np.any(np.abs(matrices) > least, axis=0)
    np.fill_diagonal(is_entry, False)
    row, column = np.nonzero(is_entry)
    first = np.searchsorted(row, np.arange(matrices.shape[1] + 1))
    return _Couplings(
        first=first, column=column, value=np.ascontiguousarray(matrices[:, row, column])
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _MeshRows:
    """One mesh of all lanes: ``numbers``, ``exact``, ``indices`` (lane, row), and its teeth."""

    numbers: Array
    exact: Array
    indices: Index
    table: Array
    bend: Array
    tooth_row: Index
    tooth_error: Array
    tooth_tilt: Array

    @classmethod
    def of(
        cls, lanes: Sequence[LineDynamics], m: int, step: float, rests: Array
    ) -> _MeshRows:
        """Mesh ``m`` of all lanes, whose states are counted from ``rests`` (lane, dof)."""
        pairs = [lane.pairs[m] for lane in lanes]
        teeth = [tooth_rows(pair.table) for pair in pairs]
        numbers = np.array([mesh_numbers(pair, step, np.zeros(6)) for pair in pairs])
        for row, lane, rest in zip(numbers, lanes, rests, strict=True):
            mesh = lane.running.line.meshes[m]
            row[layout.DAMPING] = mesh.damping
            row[layout.MEAN_FORCE] = lane.running.mesh_force[m]
            row[layout.REST_APPROACH] = mesh.direction @ rest
        exact = np.array([exact_numbers(pair) for pair in pairs])
        # rolls are counted from where the gear rests
        turned = [
            rest[lane.touched[m, lines.A_TURN]]
            for lane, rest in zip(lanes, rests, strict=True)
        ]
        exact[:, layout.START_ROLL] += exact[:, layout.EXACT_RADIUS] * turned
        bend = np.outer(0.5 / exact[:, layout.NODES_PER_METER], [1.0, 0.0, 1.0, 0.0])

        def of_teeth(key: str) -> Array:
            sides = ("pinion", "wheel")
            return np.concatenate(
                [getattr(pair, f"{side}_{key}") for pair in pairs for side in sides]
            )

        return cls(
            numbers=numbers,
            exact=exact,
            indices=mesh_indices(pairs, teeth),
            table=np.concatenate(
                [rows.values[..., :COLUMNS].ravel() for rows in teeth]
            ),
            bend=bend,
            tooth_row=np.concatenate([rows.row for rows in teeth]),
            tooth_error=of_teeth("error"),
            tooth_tilt=of_teeth("tilt"),
        )


def _profile(
    lanes: Sequence[LineDynamics], span: tuple[float, float]
) -> tuple[Array, int, float, Array]:
    """Nominal motion and forces by cells of time, first cell, cells a second, constant forces.

    Forces (lane, dof) are constant, and not in the profile, where nothing changes.
    """
    n_dof = len(lanes[0].dofs)
    if all(len(lane.running.course.time) == 1 for lane in lanes):
        profile = np.zeros((1, lines.N_PROFILE + 2 * n_dof, len(lanes)))
        profile[0, lines.SPEED] = [lane.running.course.speed[0] for lane in lanes]
        steady = np.stack([lane.forces(np.zeros(1))[0] for lane in lanes])
        return profile.ravel(), 0, 1.0, steady
    first = math.floor(span[0] * CELLS_PER_SECOND)
    last = max(math.ceil(span[1] * CELLS_PER_SECOND), first + 1)
    edges = np.arange(first, last + 1) / CELLS_PER_SECOND
    profile = np.zeros((last - first, lines.N_PROFILE + 2 * n_dof, len(lanes)))
    for number, lane in enumerate(lanes):
        angle, speed = lane.running.course.nominal(edges)
        profile[:, lines.ANGLE, number] = angle[:-1]
        profile[:, lines.SPEED, number] = speed[:-1]
        profile[:, lines.GAIN, number] = np.diff(speed) * CELLS_PER_SECOND
        forces = lane.forces(edges)
        profile[:, lines.N_PROFILE :: 2, number] = forces[:-1]
        slopes = np.diff(forces, axis=0) * CELLS_PER_SECOND
        profile[:, lines.N_PROFILE + 1 :: 2, number] = slopes
    return profile.ravel(), first, CELLS_PER_SECOND, np.zeros((len(lanes), n_dof))
