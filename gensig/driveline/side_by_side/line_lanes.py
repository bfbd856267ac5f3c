"""Lines of toothed meshes side by side: from their motions to the flat arrays of the core."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.side_by_side.line_dynamics import LineDynamics
from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, GAP, GAP_SLOPE
from gensig.dynamics._vector import aligned
from gensig.dynamics.backends.nystroem import _line_layout as lines
from gensig.dynamics.backends.nystroem._line_layout import ChordLineGroup, LineGroup
from gensig.dynamics.backends.nystroem.method import missing_cells
from gensig.dynamics.lanes import (
    CELLS_PER_SECOND,
    ToothRows,
    chord_depths,
    exact_numbers,
    fill_lanes,
    mesh_indices,
    mesh_numbers,
    tooth_rows,
)
from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ROUNDED = (
    1e-12  # of the diagonals: entries of a matrix below it are what rounding leaves
)


def pack_lines(
    dynamics: Sequence[LineDynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
) -> LineGroup:
    """Lines of the same bodies and meshes as one group; arguments are those of ``lanes.pack``."""
    lanes = fill_lanes(dynamics, precision)
    first, rests = lanes[0], np.stack([lane.rest for lane in lanes])
    profile = _profile(lanes, span)
    fields: dict[str, Any] = {
        **_meshes(lanes, step, rests, precision),
        **_machines(lanes, rests, precision),
        "force": _side_by_side(profile.steady - _held_at(lanes, rests), precision),
        "profile": profile.values.ravel(),
        "profile_first": profile.first,
        "cells_per_second": profile.cells_per_second,
        "rest": np.ascontiguousarray(rests.T),
        "reference": first.reference,
        "angles": np.array(first.angles, dtype=np.int64),
    }
    for name, values in fields.items():
        if isinstance(values, np.ndarray):
            fields[name] = aligned(np.ascontiguousarray(values))
    return (ChordLineGroup if first.has_chords else LineGroup)(**fields)


def _side_by_side(values: Array, precision: str) -> NDArray[np.floating]:
    """Values (lane, row...) flat, with the lanes along the last axis."""
    return np.ascontiguousarray(np.moveaxis(values, 0, -1), dtype=precision).ravel()


def _meshes(
    lanes: Sequence[LineDynamics], step: float, rests: Array, precision: str
) -> Mapping[str, Any]:
    """Fields of the group that are of meshes and their teeth."""
    first = lanes[0]
    meshes = [MeshLanes.of(lanes, m, step, rests) for m in range(len(first.pairs))]
    values = np.cumsum([0, *[len(mesh.table) for mesh in meshes]]).tolist()
    teeth = np.cumsum([0, *[len(mesh.tooth_row) for mesh in meshes]]).tolist()
    indices = [
        mesh.moved(n_values, n_teeth).T.ravel()
        for mesh, n_values, n_teeth in zip(meshes, values, teeth, strict=False)
    ]
    table = np.concatenate([*[mesh.table for mesh in meshes], missing_cells()])

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(mesh, name).ravel() for mesh in meshes])

    numbers = [_side_by_side(mesh.numbers, precision) for mesh in meshes]
    n_chords = max(mesh.depth.shape[1] for mesh in meshes)
    depth = np.full((len(meshes), len(lanes), n_chords), np.inf)
    for row, mesh in zip(depth, meshes, strict=True):
        row[:, : mesh.depth.shape[1]] = mesh.depth
    return {
        "n_meshes": len(meshes),
        "numbers": np.concatenate(numbers),
        "exact": np.concatenate([mesh.exact.T.ravel() for mesh in meshes]),
        "indices": np.concatenate(indices),
        "n_pairs": max(int(mesh.indices[:, layout.FOLLOWED].max()) for mesh in meshes),
        "n_chords": n_chords,
        "table": table.astype(precision),
        "depth": depth.astype(precision).ravel(),
        "chord_table": joined("chord_table").astype(precision),
        "bend": joined("bend").astype(precision),
        "tooth_row": joined("tooth_row"),
        "tooth_error": joined("tooth_error"),
        "tooth_tilt": joined("tooth_tilt"),
        "one_sided": True,
        "consistent": first.pairs[0].table.options.roll_torque == "consistent",
        # a gear that does not move has no reach: any degree of freedom stands for its own
        "touched": np.maximum(first.touched, 0).ravel(),
        "reach": _side_by_side(np.stack([lane.reach for lane in lanes]), precision),
        "slide": _side_by_side(np.stack([lane.slide for lane in lanes]), precision),
    }


def _machines(
    lanes: Sequence[LineDynamics], rests: Array, precision: str
) -> Mapping[str, Any]:
    """Fields of the group that are of bodies, springs and dampers."""
    lines_of = [lane.running.line for lane in lanes]
    mass = np.stack([np.diag(line.mass) for line in lines_of])
    rotation = np.stack([line.rotation for line in lines_of])
    held = np.zeros_like(mass)
    for row, line in zip(held, lines_of, strict=True):
        if line.held is not None:
            row[:] = line.held
    slowed = np.array([line.held_damping for line in lines_of])
    rigid = held[:, :, None] * held[:, None, :]
    stiffness = np.stack([line.stiffness for line in lines_of]) - rigid
    damping = np.stack([line.damping for line in lines_of])
    damping = damping - slowed[:, None, None] * rigid
    row, column = _coupled(stiffness, damping)
    turning = rotation[:, lanes[0].touched[:, lines.A_TURN]]
    rows = {
        "inverse_mass": 1.0 / mass,
        "stiffness": np.einsum("lii->li", stiffness),
        "damping": np.einsum("lii->li", damping),
        "sprung": stiffness[:, row, column],
        "damped": damping[:, row, column],
        "rotation": rotation,
        "held": held,
        "held_damping": slowed[:, None],
        "carried": mass * rotation,
    }
    return {
        **{name: _side_by_side(values, precision) for name, values in rows.items()},
        "coupled": np.stack([row, column], axis=-1).ravel(),
        "turning": turning.T.ravel(),
        "turning_dofs": np.flatnonzero(rotation.any(axis=0)),
        "exact_rotation": rotation.T.ravel(),
    }


def _held_at(lanes: Sequence[LineDynamics], rests: Array) -> Array:
    """Forces that hold every line at rest and balance its mean mesh forces, (lane, dof)."""
    held = []
    for lane, rest in zip(lanes, rests, strict=True):
        line = lane.running.line
        meshes = zip(line.meshes, lane.running.mesh_force, strict=True)
        pushed = sum(force * mesh.direction for mesh, force in meshes)
        held.append(line.stiffness @ rest + pushed)
    return np.stack(held)


def _coupled(*matrices: Array) -> tuple[Index, Index]:
    """Rows and columns, the lower number first, of what symmetric matrices (lane, row, column)
    hold beside their diagonals, but for what is rounded.
    """
    is_entry = np.zeros(matrices[0].shape[1:], dtype=np.bool_)
    for matrix in matrices:
        diagonal = np.sqrt(np.abs(np.einsum("lii->li", matrix)))
        least = ROUNDED * diagonal[:, :, None] * diagonal[:, None, :]
        is_entry |= np.any(np.abs(matrix) > least, axis=0)
    row, column = np.nonzero(np.triu(is_entry, 1))
    return row, column


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshLanes:
    """One mesh of all lanes: ``numbers``, ``exact``, ``indices`` (lane, row), and its teeth.

    ``bend`` (lane, 4), ``depth`` (lane, chord); what belongs to teeth lies lane after lane.
    """

    numbers: Array
    exact: Array
    indices: Index
    table: Array
    depth: Array
    chord_table: Array
    bend: Array
    tooth_row: Index
    tooth_error: Array
    tooth_tilt: Array

    @classmethod
    def of(
        cls, lanes: Sequence[LineDynamics], m: int, step: float, rests: Array
    ) -> MeshLanes:
        """Mesh ``m`` of all lanes, whose states are counted from ``rests`` (lane, dof)."""
        pairs = [lane.pairs[m] for lane in lanes]
        teeth = [tooth_rows(pair.table) for pair in pairs]
        numbers = np.array([mesh_numbers(pair, step, _no_rest(pair)) for pair in pairs])
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
            depth=chord_depths(pairs),
            chord_table=np.concatenate(
                [_chord_columns(rows).ravel() for rows in teeth]
            ),
            bend=bend,
            tooth_row=np.concatenate([rows.row for rows in teeth]),
            tooth_error=of_teeth("error"),
            tooth_tilt=of_teeth("tilt"),
        )

    def moved(self, n_values: int, n_teeth: int) -> Index:
        """Indices into a table and teeth that so many others stand before, (lane, row)."""
        indices = self.indices.copy()
        indices[:, [layout.TABLE, layout.COAST_TABLE]] += n_values
        indices[:, [layout.PINION_TOOTH, layout.WHEEL_TOOTH]] += n_teeth
        return indices


def _chord_columns(teeth: ToothRows) -> Array:
    """Columns of ``Group.chord_table``; those of spur teeth leave nothing out."""
    columns = teeth.values[..., COLUMNS:]
    if columns.shape[-1] > 0:
        return columns
    touch = teeth.values[..., GAP : GAP_SLOPE + 1]
    return np.concatenate([np.zeros_like(touch), touch], axis=-1)


def _no_rest(pair: PairDynamics) -> Array:
    return np.zeros_like(pair.approach_direction())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Profile:
    """Nominal motion and forces by cells of time.

    Parameters
    ----------
    values : (cell, row, lane)    rows of ``_line_layout``
    first : number of the first cell
    steady : (lane, dof)    forces that the profile does not hold: all of them where none changes
    """

    values: Array
    first: int
    cells_per_second: float
    steady: Array


def _profile(lanes: Sequence[LineDynamics], span: tuple[float, float]) -> Profile:
    """Course of some lines, with one cell where nothing changes."""
    n_dof = len(lanes[0].dofs)
    n_rows = lines.N_PROFILE + 2 * n_dof
    if all(len(lane.running.course.time) == 1 for lane in lanes):
        values = np.zeros((1, n_rows, len(lanes)))
        values[0, lines.SPEED] = [lane.running.course.speed[0] for lane in lanes]
        steady = np.stack([lane.forces(np.zeros(1))[0] for lane in lanes])
        return Profile(values=values, first=0, cells_per_second=1.0, steady=steady)
    # cells begin at multiples of their length, so that an instant has the same bits in any span
    first = math.floor(span[0] * CELLS_PER_SECOND)
    last = max(math.ceil(span[1] * CELLS_PER_SECOND), first + 1)
    edges = np.arange(first, last + 1) / CELLS_PER_SECOND
    values = np.zeros((last - first, n_rows, len(lanes)))
    for number, lane in enumerate(lanes):
        angle, speed = lane.running.course.nominal(edges)
        forces = lane.forces(edges)
        values[:, lines.ANGLE, number] = angle[:-1]
        values[:, lines.SPEED, number] = speed[:-1]
        values[:, lines.GAIN, number] = np.diff(speed) * CELLS_PER_SECOND
        values[:, lines.N_PROFILE :: 2, number] = forces[:-1]
        slopes = np.diff(forces, axis=0) * CELLS_PER_SECOND
        values[:, lines.N_PROFILE + 1 :: 2, number] = slopes
    return Profile(
        values=values,
        first=first,
        cells_per_second=CELLS_PER_SECOND,
        steady=np.zeros((len(lanes), n_dof)),
    )
