"""Lines of toothed meshes side by side: from their motions to the flat arrays of the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
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
    MeshLanes,
    ToothRows,
    fill_lanes,
    mesh_numbers,
    profile_cells,
    side_by_side,
)

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
        **_meshes(lanes, rests, precision),
        **_machines(lanes, rests, precision),
        **_sources(lanes, rests, precision),
        "force": side_by_side(profile.steady - _held_at(lanes, rests), precision),
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


def _meshes(
    lanes: Sequence[LineDynamics], rests: Array, precision: str
) -> Mapping[str, Any]:
    """Fields of the group that are of meshes and their teeth."""
    first = lanes[0]
    meshes = [_mesh_lanes(lanes, m, rests) for m in range(len(first.teeth))]
    tables = [mesh.table() for mesh in meshes]
    values = np.cumsum([0, *[sum(map(len, table)) for table in tables]]).tolist()
    teeth = np.cumsum([0, *[len(mesh.tooth_row) for mesh in meshes]]).tolist()
    indices = []
    for mesh, n_values, n_teeth in zip(meshes, values, teeth, strict=False):
        mesh.indices[:, [layout.TABLE, layout.COAST_TABLE]] += n_values
        mesh.indices[:, [layout.PINION_TOOTH, layout.WHEEL_TOOTH]] += n_teeth
        indices.append(mesh.indices.T.ravel())
    chords = [_chord_columns(rows).ravel() for mesh in meshes for rows in mesh.rows]

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(mesh, name).ravel() for mesh in meshes])

    numbers = [_numbers(lanes, m, rests) for m in range(len(meshes))]
    n_chords = max(mesh.depth.shape[1] for mesh in meshes)
    depth = np.full((len(meshes), len(lanes), n_chords), np.inf)
    for row, mesh in zip(depth, meshes, strict=True):
        row[:, : mesh.depth.shape[1]] = mesh.depth
    return {
        "n_meshes": len(meshes),
        "numbers": np.concatenate([side_by_side(row, precision) for row in numbers]),
        "exact": np.concatenate([mesh.exact.T.ravel() for mesh in meshes]),
        "indices": np.concatenate(indices),
        "n_pairs": max(int(mesh.indices[:, layout.FOLLOWED].max()) for mesh in meshes),
        "n_chords": n_chords,
        "table": np.concatenate(
            [*chain(*tables), missing_cells()], dtype=np.dtype(precision)
        ),
        "depth": depth.astype(precision).ravel(),
        "chord_table": np.concatenate(chords, dtype=np.dtype(precision)),
        "bend": joined("bend").astype(precision),
        "tooth_row": joined("tooth_row"),
        "tooth_error": joined("tooth_error"),
        "tooth_tilt": joined("tooth_tilt"),
        "one_sided": True,
        "consistent": first.teeth[0].table.options.roll_torque == "consistent",
        # a gear that does not move has no reach: any degree of freedom stands for its own
        "touched": np.maximum(first.touched, 0).ravel(),
        "reach": side_by_side(np.stack([lane.reach for lane in lanes]), precision),
        "slide": side_by_side(np.stack([lane.slide for lane in lanes]), precision),
    }


def _mesh_lanes(lanes: Sequence[LineDynamics], m: int, rests: Array) -> MeshLanes:
    """Mesh ``m`` of all lanes; rolls are counted from where its driving gear rests."""
    turned = [
        rest[lane.touched[m, lines.A_TURN]]
        for lane, rest in zip(lanes, rests, strict=True)
    ]
    return MeshLanes.of([lane.teeth[m] for lane in lanes], np.array(turned))


def _numbers(lanes: Sequence[LineDynamics], m: int, rests: Array) -> Array:
    """Numbers of mesh ``m`` of all lanes, whose states are counted from ``rests``, (lane, row)."""
    numbers = []
    for lane, rest in zip(lanes, rests, strict=True):
        mesh, force = lane.running.line.meshes[m], lane.running.mesh_force[m]
        numbers.append(
            mesh_numbers(
                lane.teeth[m],
                damping=mesh.damping,
                mean_force=float(force),
                rest_approach=float(mesh.direction @ rest),
            )
        )
    return np.array(numbers)


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
    is_sprung, is_damped = _is_entry(stiffness), _is_entry(damping)
    row, column = np.nonzero(np.triu(is_sprung, 1))
    far, near = np.nonzero(np.tril(is_damped & ~is_sprung, -1))
    turning = rotation[:, lanes[0].touched[:, lines.A_TURN]]
    rows = {
        "inverse_mass": 1.0 / mass,
        "stiffness": np.einsum("lii->li", stiffness),
        "damping": np.einsum("lii->li", damping),
        "sprung": stiffness[:, row, column],
        "damped": damping[:, row, column],
        "damper": damping[:, far, near],
        "rotation": rotation,
        "held": held,
        "held_damping": slowed[:, None],
        "carried": mass * rotation,
    }
    return {
        **{name: side_by_side(values, precision) for name, values in rows.items()},
        "coupled": np.stack([row, column], axis=-1).ravel(),
        "damper_first": np.searchsorted(far, np.arange(mass.shape[1] + 1)),
        "damper_other": near,
        "turning": turning.T.ravel(),
        "turning_dofs": np.flatnonzero(rotation.any(axis=0)),
        "exact_rotation": rotation.T.ravel(),
    }


def _sources(
    lanes: Sequence[LineDynamics], rests: Array, precision: str
) -> Mapping[str, Any]:
    """Fields of the group that are of torques over an angle."""
    dofs = [source.dof for source in lanes[0].sources]
    numbers = np.zeros((len(lanes), len(dofs), lines.N_SOURCE))
    tables: list[Array] = []
    begin = 0
    for lane, (line, rest) in enumerate(zip(lanes, rests, strict=True)):
        for s, source in enumerate(line.sources):
            n_nodes, sense = len(source.table), line.sense(source)
            per_rad = n_nodes / source.period
            shift = (source.phase + sense * rest[source.dof]) * per_rad
            # places are positive: a fraction is then cut off downwards
            shift += lines.PERIODS_BEFORE * n_nodes
            numbers[lane, s] = sense * per_rad, shift, n_nodes, 1.0 / n_nodes, begin
            # the first node again, where rounding makes a place of a whole period
            nodes = sense * np.append(source.table, source.table[0])
            rise = np.diff(nodes, append=nodes[1])
            tables.append(np.stack([nodes, rise], axis=-1).ravel())
            begin += len(tables[-1])
    tables.append(np.zeros(lines.READ_AT_ONCE))
    return {
        "sources": np.array(dofs, dtype=np.int64),
        "source_numbers": np.moveaxis(numbers, 0, -1).ravel(),
        "source_table": np.concatenate(tables).astype(precision),
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


def _is_entry(matrices: Array) -> NDArray[np.bool_]:
    """True where symmetric matrices (lane, row, column) hold more than what is rounded."""
    diagonal = np.sqrt(np.abs(np.einsum("lii->li", matrices)))
    least = ROUNDED * diagonal[:, :, None] * diagonal[:, None, :]
    return np.any(np.abs(matrices) > least, axis=0)


def _chord_columns(teeth: ToothRows) -> Array:
    """Columns of ``Group.chord_table``; those of spur teeth leave nothing out."""
    columns = teeth.values[..., COLUMNS:]
    if columns.shape[-1] > 0:
        return columns
    touch = teeth.values[..., GAP : GAP_SLOPE + 1]
    return np.concatenate([np.zeros_like(touch), touch], axis=-1)


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
    at_sources = lines.N_PROFILE + 2 * n_dof
    n_rows = at_sources + 2 * len(lanes[0].sources)
    if all(len(lane.running.course.time) == 1 for lane in lanes):
        values = np.zeros((1, n_rows, len(lanes)))
        values[0, lines.SPEED] = [lane.running.course.speed[0] for lane in lanes]
        values[0, at_sources::2] = np.stack(
            [lane.factors(np.zeros(1))[0] for lane in lanes], axis=-1
        )
        steady = np.stack([lane.forces(np.zeros(1))[0] for lane in lanes])
        return Profile(values=values, first=0, cells_per_second=1.0, steady=steady)
    first, edges = profile_cells(span)
    values = np.zeros((len(edges) - 1, n_rows, len(lanes)))
    for number, lane in enumerate(lanes):
        angle, speed = lane.running.course.nominal(edges)
        forces = lane.forces(edges)
        values[:, lines.ANGLE, number] = angle[:-1]
        values[:, lines.SPEED, number] = speed[:-1]
        values[:, lines.GAIN, number] = np.diff(speed) * CELLS_PER_SECOND
        changing = np.concatenate([forces, lane.factors(edges)], axis=1)
        values[:, lines.N_PROFILE :: 2, number] = changing[:-1]
        slopes = np.diff(changing, axis=0) * CELLS_PER_SECOND
        values[:, lines.N_PROFILE + 1 :: 2, number] = slopes
    return Profile(
        values=values,
        first=first,
        cells_per_second=CELLS_PER_SECOND,
        steady=np.zeros((len(lanes), n_dof)),
    )
