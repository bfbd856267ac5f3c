"""Teeth of gear meshes side by side: from their tables to flat arrays of the compiled core."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gensig.arrays import Array, Flags, FloatArray, Integers
from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, FAR_NEAR
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.equations import Mesh
from gensig.dynamics.helical import pitches
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.mesh.tooth_table import ToothTable, left_out_energy

MOST_PAIRS = 2  # for each distinct tooth; with more, spur teeth are stored one by one

MachineT = TypeVar("MachineT")


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
    row: Integers
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
    indices: Integers
    depth: Array
    bend: Array
    tooth_row: Integers
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


def side_by_side(values: Array, precision: str) -> FloatArray:
    """Values (lane, row...) flat, with the lanes along the last axis."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1), dtype=precision).ravel()


def at_step(group: Any, before: float, after: float) -> Any:
    """The same group for another step, s; only the paper's law depends on it."""
    if group.one_sided:
        return group
    numbers = group.numbers.copy().reshape(group.n_meshes, layout.N_NUMBERS, -1)
    numbers[:, layout.PER_SWITCH_WIDTH] *= before / after
    return group._replace(numbers=numbers.ravel())


def mesh_numbers(mesh: Mesh, rest: Array, step: float) -> tuple[float, ...]:
    """The mesh as numbers, in the order of the rows of ``_layout``.

    Parameters
    ----------
    rest : (dof,)    the equilibrium from which the state is counted
    step : s         of the integration, over which the paper's law switches a pair
    """
    table, options, pair = mesh.teeth.table, mesh.teeth.table.options, mesh.teeth.pair
    lag, per_switch_width = table.half_lag, 0.0
    if options.law != "one_sided":
        per_switch_width = 2.0 / (pair.pinion.base_radius * mesh.speed * step)
    return (
        pair.pinion.base_radius,
        pair.path_of_contact,
        pair.pitch_point,
        pair.start_curvature_radius,
        pair.tangent_length,
        table.shared_compliance,
        mesh.damping,
        options.friction_coefficient,
        2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
        per_switch_width,
        pair.backlash,
        mesh.mean_force,
        mesh.approach(rest),
        lag,
        pair.pitch_point + lag,
    )


def _exact_numbers(teeth: MeshTeeth) -> tuple[float, ...]:
    """Numbers that locate the pairs, in the order of the rows of ``_layout``."""
    options, pair = teeth.table.options, teeth.pair
    near = -math.inf, math.inf
    if options.law == "one_sided":
        near = near_positions(teeth)
    return (
        pair.pinion.base_radius,
        pair.base_pitch,
        1.0 / pair.base_pitch,
        teeth.table.nodes_per_pitch / pair.base_pitch,
        teeth.start_roll,
        *near,
        pitches(teeth.table)[0] * pair.base_pitch,
    )


def near_positions(teeth: MeshTeeth) -> tuple[float, float]:
    """Positions s outside of which no pair comes within ``FAR_NEAR`` of touching, m."""
    position = teeth.table.position
    near = np.flatnonzero(teeth.nearest_gaps < FAR_NEAR)
    first, last = 0, len(position) - 1
    if len(near) > 0:  # else every pair may be as near as any other
        first, last = max(near[0] - 1, first), min(near[-1] + 1, last)
    return float(position[first]), float(position[last])


def _mesh_indices(meshes: Sequence[MeshTeeth], teeth: Sequence[ToothRows]) -> Integers:
    """Indices of every lane into the tables, (lane, row)."""
    indices = []
    first_tooth, first_value = 0, 0
    for mesh, rows in zip(meshes, teeth, strict=True):
        table, pair = mesh.table, mesh.pair
        _, n_chords, n_nodes, _ = rows.values.shape
        first_pitch, last_pitch = pitches(table)
        per_chord = n_nodes * COLUMNS
        coast = first_value + per_chord * table.set_chord
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


def _chord_depths(meshes: Sequence[MeshTeeth]) -> Array:
    """Penetrations from which chords hold, (lane, chord) m, infinite for absent chords."""
    depths = [mesh.table.depth for mesh in meshes]
    filled = np.full((len(meshes), max(len(depth) for depth in depths)), np.inf)
    for row, depth in zip(filled, depths, strict=True):
        row[: len(depth)] = depth
    return filled


def tooth_rows(table: ToothTable) -> ToothRows:
    """Rows of the distinct pairs of teeth.

    Teeth of a separable table are stored one by one where their pairs would take much more memory.
    """
    gears = table.pinion, table.wheel
    is_there = np.concatenate([teeth.present[teeth.kind] for teeth in gears])
    pinion_kinds, pinion_row = np.unique(table.pinion.kind, return_inverse=True)
    wheel_kinds, wheel_row = np.unique(table.wheel.kind, return_inverse=True)
    n_kinds = len(pinion_kinds), len(wheel_kinds)
    are_many = math.prod(n_kinds) > MOST_PAIRS * sum(n_kinds)
    if table.is_separable and are_many:
        return _teeth_one_by_one(table, is_there)
    pinion = np.repeat(pinion_kinds, len(wheel_kinds))
    wheel = np.tile(wheel_kinds, len(pinion_kinds))
    if pinion[0] != 0 or wheel[0] != 0:  # back flanks are those of healthy teeth
        pinion, wheel = np.append(0, pinion), np.append(0, wheel)
        wheel_row = wheel_row + 1
    columns = list(table.pairs)
    if not table.is_separable:
        columns.extend(_chord_columns(table))
    rows = np.concatenate([pinion_row, wheel_row])
    return ToothRows(
        values=np.stack([column[pinion, wheel] for column in columns], axis=-1),
        row=np.where(is_there, rows, -1),
        pinion_stride=len(wheel_kinds),
        wheel_first=0,
    )


def _teeth_one_by_one(table: ToothTable, is_there: Flags) -> ToothRows:
    """Rows of the distinct teeth of both gears; ``is_there`` (tooth,)."""
    kinds = [table.pinion.kind, table.wheel.kind]
    rows = [
        np.stack(part, axis=-1).reshape(-1, *part.gap.shape[2:], COLUMNS)
        for part in table.parts
    ]
    return ToothRows(
        values=np.concatenate(rows),
        row=np.where(is_there, np.concatenate(kinds), -1),
        pinion_stride=1,
        wheel_first=len(rows[0]),
    )


def _chord_columns(table: ToothTable) -> list[Array]:
    """Columns of ``Group.chord_table``, (pinion kind, wheel kind, chord, node) each."""
    _, _, gap, gap_slope = table.pairs
    touch = gap[:, :, :1], gap_slope[:, :, :1]
    return [
        *left_out_energy(table),
        *[np.broadcast_to(values, gap.shape) for values in touch],
    ]
