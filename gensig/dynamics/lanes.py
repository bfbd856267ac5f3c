"""Gear pairs side by side: from their equations to the flat arrays of the compiled core."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, FAR_NEAR, Group, HelicalGroup
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.helical import half_lag, pitches
from gensig.dynamics.mesh_statics import least_gaps
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.pair import PairDynamics
from gensig.mesh.pair_table import GearTable, PairTable
from gensig.mesh.sliced.sliced_statics import left_out_energy
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]

CELLS_PER_SECOND = 1000.0  # speed and torque are linear in each cell
MOST_PAIRS = 2  # for each distinct tooth; with more, spur teeth are stored one by one


MachineT = TypeVar("MachineT")
GroupT = TypeVar("GroupT", bound=Any)


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothRows:
    """Distinct teeth of one mesh, as rows of the core's table.

    Parameters
    ----------
    values : (row, chord, node, column)    the first row is that of healthy teeth; helical teeth
        have the columns of ``Group.chord_table`` after those of ``Group.table``
    row : (tooth,)    row of every tooth of pinion and wheel, -1 for a missing one
    pinion_stride : rows from one pinion tooth to the next
    wheel_first : first row of the wheel where teeth are stored one by one, else 0
    """

    values: Array
    row: NDArray[np.int64]
    pinion_stride: int
    wheel_first: int


def fill_lanes(dynamics: Sequence[MachineT], precision: str) -> list[MachineT]:
    """One machine a lane; lanes without one repeat the first."""
    return [*dynamics, *[dynamics[0]] * (n_lanes(precision) - len(dynamics))]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshLanes:
    """The teeth of one mesh in every lane.

    Parameters
    ----------
    rows : of each lane
    exact, indices : (lane, row)    of ``Group``
    depth : (lane, chord) m         from which chords hold, infinite for absent ones
    bend : (lane, 4)
    tooth_row, tooth_error, tooth_tilt : (tooth,)    pinion and wheel, lane after lane
    """

    rows: list[ToothRows]
    exact: Array
    indices: NDArray[np.int64]
    depth: Array
    bend: Array
    tooth_row: NDArray[np.int64]
    tooth_error: Array
    tooth_tilt: Array

    @classmethod
    def of(cls, meshes: Sequence[MeshTeeth], turned: Array | float = 0.0) -> MeshLanes:
        """The same mesh of all lanes, whose pinions have ``turned`` rad where states are 0."""
        rows = [tooth_rows(mesh.table) for mesh in meshes]
        exact = np.array([_exact_numbers(mesh) for mesh in meshes])
        exact[:, layout.START_ROLL] += exact[:, layout.EXACT_RADIUS] * turned
        half_cell = 0.5 / exact[:, layout.NODES_PER_METER]
        return cls(
            rows=rows,
            exact=exact,
            indices=_mesh_indices(meshes, rows),
            depth=_chord_depths(meshes),
            bend=np.outer(half_cell, [1.0, 0.0, 1.0, 0.0]),
            tooth_row=np.concatenate([each.row for each in rows]),
            tooth_error=np.concatenate([e for mesh in meshes for e in mesh.errors]),
            tooth_tilt=np.concatenate([t for mesh in meshes for t in mesh.tilts]),
        )

    def table(self) -> list[Array]:
        """Values of ``Group.table``, lane after lane."""
        return [each.values[..., :COLUMNS].ravel() for each in self.rows]


def side_by_side(values: Array, precision: str) -> NDArray[np.floating]:
    """Values (lane, row...) flat, with the lanes along the last axis."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1), dtype=precision).ravel()


def pack(
    dynamics: Sequence[PairDynamics],
    step: float,
    precision: str = "float64",
    span: tuple[float, float] = (0.0, 0.0),
    *,
    end: Sequence[float] | Array = (),
) -> Group:
    """Gear pairs of one mesh law as one group.

    Parameters
    ----------
    step : s    of integration, over which the paper's law switches a pair
    span : s    begin and end of the required course of speed and torque, where they change
    end : values after the last lane's in ``Group.table``
    """
    packed = partial(side_by_side, precision=precision)
    lanes = fill_lanes(dynamics, precision)
    mesh = MeshLanes.of([machine.teeth for machine in lanes])
    systems = [machine.system() for machine in lanes]
    rests = np.stack([machine.rest() for machine in lanes])
    reach = np.stack([machine.approach_direction() for machine in lanes])
    mean_force = np.array([machine.mesh_force for machine in lanes])
    numbers = np.array(
        [
            pair_numbers(machine, step, rest)
            for machine, rest in zip(lanes, rests, strict=True)
        ]
    )
    chords = [each.values[..., COLUMNS:].ravel() for each in mesh.rows]

    def stacked(name: str) -> Array:
        return np.stack([getattr(system, name) for system in systems])

    mass, rotation = stacked("mass"), stacked("rotation")
    stiffness, damping = stacked("stiffness"), stacked("damping")
    dofs = np.arange(mass.shape[1])
    coupled = np.any((stiffness != 0.0) | (damping != 0.0), axis=0)
    coupled[dofs, dofs] = False
    row, column = np.nonzero(coupled)
    set_force = stacked("force") - mean_force[:, None] * reach
    profile, profile_first, cells_per_second = _profile(lanes, span)
    options = lanes[0].table.options
    kind = HelicalGroup if lanes[0].is_helical else Group
    return kind(
        numbers=packed(numbers),
        exact=mesh.exact.T.ravel(),
        indices=mesh.indices.T.ravel(),
        n_pairs=int(mesh.indices[:, layout.FOLLOWED].max()),
        n_chords=mesh.depth.shape[1],
        table=np.concatenate([*mesh.table(), end], dtype=np.dtype(precision)),
        depth=mesh.depth.astype(precision).ravel(),
        chord_table=np.concatenate(chords, dtype=np.dtype(precision)),
        bend=mesh.bend.astype(precision).ravel(),
        tooth_row=mesh.tooth_row,
        tooth_error=mesh.tooth_error,
        tooth_tilt=mesh.tooth_tilt,
        one_sided=options.law == "one_sided",
        consistent=options.roll_torque == "consistent",
        prescribed=options.phase == "prescribed",
        reach=packed(reach),
        inverse_mass=packed(1.0 / mass),
        stiffness=packed(stiffness[:, dofs, dofs]),
        damping=packed(damping[:, dofs, dofs]),
        other_first=np.searchsorted(row, np.arange(len(dofs) + 1)),
        other_column=np.ascontiguousarray(column),
        other_stiffness=packed(stiffness[:, row, column]),
        other_damping=packed(damping[:, row, column]),
        force=packed(set_force - np.einsum("lij,lj->li", stiffness, rests)),
        set_force=packed(set_force),
        rest=np.ascontiguousarray(rests.T),
        rotation=packed(rotation),
        held=packed(np.einsum("lij,lj->li", stiffness, rotation)),
        carried=packed(mass * rotation),
        profile=profile,
        profile_first=profile_first,
        cells_per_second=cells_per_second,
    )


def at_step(group: GroupT, before: float, after: float) -> GroupT:
    """The same group for another step, s; only the paper's law depends on it."""
    if group.one_sided:
        return group
    numbers = group.numbers.copy().reshape(layout.N_NUMBERS, -1)
    numbers[layout.PER_SWITCH_WIDTH] *= before / after
    return group._replace(numbers=numbers.ravel())


def pair_numbers(dynamics: PairDynamics, step: float, rest: Array) -> tuple[float, ...]:
    """The mesh of a pair as numbers, see ``mesh_numbers``.

    Parameters
    ----------
    step : s    of the integration
    rest : (dof,)    the equilibrium from which the state is counted
    """
    damping = dynamics.mesh_damping
    if dynamics.table.options.law == "one_sided":
        damping = damping / dynamics.mesh_force
    speed = dynamics.table.pair.pinion.base_radius * dynamics.operating.speed
    return mesh_numbers(
        dynamics.teeth,
        damping=damping,
        mean_force=dynamics.mesh_force,
        rest_approach=float(dynamics.approach_direction() @ rest),
        per_switch_width=2.0 / (speed * step),
    )


def mesh_numbers(
    teeth: MeshTeeth,
    *,
    damping: float,
    mean_force: float,
    rest_approach: float,
    per_switch_width: float = 0.0,
) -> tuple[float, ...]:
    """The mesh as numbers, in the order of the rows of ``_layout.Group.numbers``.

    Parameters
    ----------
    damping : N s/m, of the one-sided law per N of the force of a pair of teeth
    mean_force : N, that the forces of the group leave out
    rest_approach : m, at the equilibrium from which the state is counted
    per_switch_width : 1/m, of the paper's law
    """
    table, options, pair = teeth.table, teeth.table.options, teeth.pair
    lag = half_lag(table)
    return (
        pair.pinion.base_radius,
        pair.wheel.base_radius,
        pair.path_of_contact,
        pair.pitch_point,
        pair.start_curvature_radius,
        pair.tangent_length,
        table.shared_compliance,
        damping,
        options.friction_coefficient,
        2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
        per_switch_width,
        pair.backlash,
        mean_force,
        rest_approach,
        lag,
        pair.pitch_point + lag,
    )


def _exact_numbers(teeth: MeshTeeth) -> tuple[float, ...]:
    """Numbers that locate the pairs, in the order of the rows of ``_layout.Group.exact``."""
    options, pair = teeth.table.options, teeth.pair
    near = -math.inf, math.inf
    if options.law == "one_sided":
        near = near_positions(teeth)
    return (
        pair.pinion.base_radius,
        pair.base_pitch,
        1.0 / pair.base_pitch,
        options.points_per_pitch / pair.base_pitch,
        teeth.start_roll,
        *near,
        pitches(teeth.table)[0] * pair.base_pitch,
    )


def near_positions(teeth: MeshTeeth) -> tuple[float, float]:
    """Positions s outside of which no pair comes within ``FAR_NEAR`` of touching, m."""
    position = teeth.table.position
    near = np.flatnonzero(nearest_gaps(teeth) < FAR_NEAR)
    first, last = 0, len(position) - 1
    if len(near) > 0:  # else every pair may be as near as any other
        first, last = max(near[0] - 1, first), min(near[-1] + 1, last)
    return float(position[first]), float(position[last])


def nearest_gaps(teeth: MeshTeeth) -> Array:
    """No less than these are the gaps of any pair of teeth, with their errors, (node,) m."""
    table = teeth.table
    beyond = table.position - table.pair.pitch_point - half_lag(table)
    gears = zip(least_gaps(table), teeth.errors, teeth.tilts, strict=True)
    nearest = [
        flank + error.min() + np.minimum(tilt.min() * beyond, tilt.max() * beyond)
        for flank, error, tilt in gears
    ]
    return np.asarray(nearest[0] + nearest[1])


def _mesh_indices(
    meshes: Sequence[MeshTeeth], teeth: Sequence[ToothRows]
) -> NDArray[np.int64]:
    """Indices of every lane into the tables, (lane, row of ``Group.indices``)."""
    indices = []
    first_tooth, first_value = 0, 0
    for mesh, rows in zip(meshes, teeth, strict=True):
        table, pair = mesh.table, mesh.pair
        _, n_chords, n_nodes, _ = rows.values.shape
        first_pitch, last_pitch = pitches(table)
        per_chord = n_nodes * COLUMNS
        coast = first_value
        if isinstance(table, SlicedTable):
            coast += per_chord * table.set_chord
        indices.append(
            (
                pair.pinion.n_teeth,
                pair.wheel.n_teeth,
                *mesh.start_teeth,
                first_tooth,
                first_tooth + pair.pinion.n_teeth,
                first_value,
                n_chords * per_chord,
                n_nodes - 2,
                rows.pinion_stride,
                rows.wheel_first,
                first_pitch,
                last_pitch - first_pitch,
                per_chord,
                coast,
            )
        )
        first_tooth += len(rows.row)
        first_value += len(rows.values) * n_chords * per_chord
    return np.array(indices, dtype=np.int64)


def profile_cells(span: tuple[float, float]) -> tuple[int, Array]:
    """Number of the first cell of a profile over a span in s, and edges of all, (cell + 1,) s.

    Cells begin at multiples of their length, so that an instant has the same bits in any span.
    """
    first = math.floor(span[0] * CELLS_PER_SECOND)
    last = max(math.ceil(span[1] * CELLS_PER_SECOND), first + 1)
    return first, np.arange(first, last + 1) / CELLS_PER_SECOND


def _profile(
    lanes: Sequence[PairDynamics], span: tuple[float, float]
) -> tuple[Array, int, float]:
    """Nominal motion and torque by cells of time, the number of the first cell, cells a second.

    Values are (cell, 5, lane) flat. Speed and torque are linear in a cell; where neither changes
    there is one cell.
    """
    if all(machine.operating.is_steady for machine in lanes):
        profile = np.zeros((1, layout.N_PROFILE, len(lanes)))
        profile[0, layout.NOMINAL_SPEED] = [
            machine.operating.speed for machine in lanes
        ]
        profile[0, layout.TORQUE] = 1.0
        return profile.ravel(), 0, 1.0
    first, edges = profile_cells(span)
    profile = np.empty((len(edges) - 1, layout.N_PROFILE, len(lanes)))
    for lane, machine in enumerate(lanes):
        nominal = machine.nominal(edges)
        speed, torque = nominal.speed, nominal.torque_factor
        turned = 0.5 * (speed[1:] + speed[:-1]) / CELLS_PER_SECOND
        before = -np.cumsum(turned[:-first][::-1])[::-1]
        angle = np.concatenate([before, [0.0], np.cumsum(turned[-first:])])
        profile[:, layout.NOMINAL_ANGLE, lane] = angle[:-1]
        profile[:, layout.NOMINAL_SPEED, lane] = speed[:-1]
        gain = np.diff(speed) * CELLS_PER_SECOND
        profile[:, layout.NOMINAL_ACCELERATION, lane] = gain
        profile[:, layout.TORQUE, lane] = torque[:-1]
        profile[:, layout.TORQUE_SLOPE, lane] = np.diff(torque) * CELLS_PER_SECOND
    return profile.ravel(), first, CELLS_PER_SECOND


def _chord_depths(meshes: Sequence[MeshTeeth]) -> Array:
    """Penetrations from which chords hold, (lane, chord) m, infinite for absent chords."""
    depths = [getattr(mesh.table, "depth", np.zeros(1)) for mesh in meshes]
    filled = np.full((len(meshes), max(len(depth) for depth in depths)), np.inf)
    for row, depth in zip(filled, depths, strict=True):
        row[: len(depth)] = depth
    return filled


def tooth_rows(table: PairTable | SlicedTable) -> ToothRows:
    """Rows of the distinct pairs of teeth.

    Spur teeth are stored one by one where pairs of them would take much more memory.
    """
    if isinstance(table, SlicedTable):
        kinds = table.pinion_kind, table.wheel_kind
        present = table.pinion_present[kinds[0]], table.wheel_present[kinds[1]]
    else:
        kinds = table.pinion.kind, table.wheel.kind
        present = table.pinion.present[kinds[0]], table.wheel.present[kinds[1]]
    pinion_kinds, pinion_row = np.unique(kinds[0], return_inverse=True)
    wheel_kinds, wheel_row = np.unique(kinds[1], return_inverse=True)
    n_kinds = len(pinion_kinds), len(wheel_kinds)
    are_many = math.prod(n_kinds) > MOST_PAIRS * sum(n_kinds)
    if isinstance(table, PairTable) and are_many:
        return _teeth_one_by_one(table, np.concatenate(present))
    pinion = np.repeat(pinion_kinds, len(wheel_kinds))
    wheel = np.tile(wheel_kinds, len(pinion_kinds))
    if pinion[0] != 0 or wheel[0] != 0:  # back flanks are those of healthy teeth
        pinion, wheel = np.append(0, pinion), np.append(0, wheel)
        wheel_row = wheel_row + 1
    if isinstance(table, SlicedTable):
        columns = _sliced_columns(table)
        values = np.stack([column[pinion, wheel] for column in columns], axis=-1)
    else:
        sides = zip(_columns(table.pinion), _columns(table.wheel), strict=True)
        values = np.empty((len(pinion), 1, len(table.position), COLUMNS))
        for column, (of_pinion, of_wheel) in enumerate(sides):
            for row, (p, w) in enumerate(zip(pinion, wheel, strict=True)):
                np.add(of_pinion[p], of_wheel[w], out=values[row, 0, :, column])
    rows = np.concatenate([pinion_row, wheel_row])
    return ToothRows(
        values=values,
        row=np.where(np.concatenate(present), rows, -1),
        pinion_stride=len(wheel_kinds),
        wheel_first=0,
    )


def _teeth_one_by_one(table: PairTable, present: NDArray[np.bool_]) -> ToothRows:
    """Rows of the distinct teeth of both gears; ``present`` (tooth,)."""
    sides = table.pinion, table.wheel
    values = np.concatenate([np.stack(_columns(side), axis=-1) for side in sides])
    kinds = np.concatenate([side.kind for side in sides])
    return ToothRows(
        values=values[:, None],
        row=np.where(present, kinds, -1),
        pinion_stride=1,
        wheel_first=len(table.pinion.compliance),
    )


def _columns(side: GearTable) -> tuple[Array, ...]:
    """Table columns c, c', g, g', (distinct, node) each."""
    return side.compliance, side.compliance_slope, side.gap, side.gap_slope


def _sliced_columns(table: SlicedTable) -> list[Array]:
    """Columns of ``Group.table`` and ``Group.chord_table``, (pinion, wheel, chord, node) each."""
    touch = table.gap[:, :, :1], table.gap_slope[:, :, :1]
    return [
        table.compliance,
        table.compliance_slope,
        table.gap,
        table.gap_slope,
        *left_out_energy(table),
        *[np.broadcast_to(values, table.gap.shape) for values in touch],
    ]
