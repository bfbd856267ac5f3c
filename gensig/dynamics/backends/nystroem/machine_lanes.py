"""Machines side by side: from their equations to the flat arrays of the compiled core."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Flags
from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, GAP, GAP_SLOPE
from gensig.dynamics._vector import aligned
from gensig.dynamics.backends.nystroem import _group as groups
from gensig.dynamics.backends.nystroem._group import (
    AnyLawPairGroup,
    AxialChordGroup,
    ChordGroup,
    Group,
    HelicalPairGroup,
    SpurGroup,
    SpurPairGroup,
)
from gensig.dynamics.backends.nystroem._pairs import MISSING_COMPLIANCE, MISSING_GAP
from gensig.dynamics.backends.nystroem.force_law import ForceLaw, of_law
from gensig.dynamics.equations import A_TURN, N_IN_PLANE, Equations
from gensig.dynamics.lanes import (
    MeshLanes,
    ToothRows,
    fill_lanes,
    mesh_numbers,
    side_by_side,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import SimulationError

CELLS_PER_SECOND = 1000.0  # speed and forces are linear in each cell
# beyond it a pair may carry outside of the path that the three pairs are followed on
MOST_CONTACT_RATIO = 2.5
# of the diagonals: entries of a matrix below it are what rounding leaves
ROUNDED = 1e-12


def is_followed_by_three(teeth: MeshTeeth) -> bool:
    """True for teeth of which three pairs are followed: spur, one-sided, of low contact ratio."""
    pair, options = teeth.pair, teeth.table.options
    contact_ratio = pair.path_of_contact / pair.base_pitch
    return (
        teeth.table.is_separable
        and options.law == "one_sided"
        and contact_ratio <= MOST_CONTACT_RATIO
    )


def group_kind(equations: Equations) -> type[Group]:
    """The type of the group that machines of such equations make."""
    is_pair, first = equations.is_gear_pair, equations.meshes[0]
    if len(first.touched) > N_IN_PLANE:
        return HelicalPairGroup if is_pair else AxialChordGroup
    if all(is_followed_by_three(mesh.teeth) for mesh in equations.meshes):
        return SpurPairGroup if is_pair else SpurGroup
    if is_pair and first.teeth.table.is_separable:
        return AnyLawPairGroup
    return ChordGroup


@dataclass(frozen=True, slots=True, kw_only=True)
class Lane:
    """A machine and its equations, with the rest about which it moves, (dof,)."""

    dynamics: Dynamics
    equations: Equations
    rest: Array

    @classmethod
    def of(cls, dynamics: Dynamics) -> Lane:
        """The lane of a machine."""
        return cls(dynamics=dynamics, equations=dynamics.equations, rest=dynamics.rest)


def pack(
    dynamics: Sequence[Dynamics],
    step: float,
    precision: str = "float64",
    span: tuple[float, float] = (0.0, 0.0),
    forces: Mapping[str, ForceLaw] | None = None,
) -> Group:
    """Machines of the same bodies, meshes, elements and laws as one group.

    Parameters
    ----------
    step : s    of integration, over which the paper's law switches a pair
    span : s    begin and end of the required course of speed and torque, where they change
    forces : laws of elements by name
    """
    lanes = fill_lanes([Lane.of(each) for each in dynamics], precision)
    first = lanes[0].equations
    kind, profile = group_kind(first), _profile(lanes, span)
    fields: dict[str, Any] = {
        **_meshes(lanes, step, precision, has_chords=issubclass(kind, ChordGroup)),
        **_bodies(lanes, precision),
        **_sources(lanes, precision),
        "elements": _elements(lanes, forces or {}, precision),
        "force": side_by_side(profile.steady, precision),
        "profile": profile.values.ravel(),
        "profile_first": profile.first,
        "cells_per_second": profile.cells_per_second,
        "rest": np.stack([lane.rest for lane in lanes], axis=-1),
        "reference": first.reference,
        "angles": np.array(first.angles, dtype=np.int64),
    }
    for name, values in fields.items():
        if isinstance(values, np.ndarray):
            fields[name] = aligned(np.ascontiguousarray(values))
    return kind(**fields)


def _meshes(
    lanes: Sequence[Lane], step: float, precision: str, *, has_chords: bool
) -> Mapping[str, Any]:
    """Fields of the group that are of meshes and their teeth."""
    first = lanes[0].equations.meshes
    meshes = [_mesh_lanes(lanes, m) for m in range(len(first))]
    tables = [mesh.table() for mesh in meshes]
    values = np.cumsum([0, *[sum(map(len, table)) for table in tables]]).tolist()
    teeth = np.cumsum([0, *[len(mesh.tooth_row) for mesh in meshes]]).tolist()
    indices = []
    for mesh, n_values, n_teeth in zip(meshes, values, teeth, strict=False):
        mesh.indices[:, [layout.TABLE, layout.COAST_TABLE]] += n_values
        mesh.indices[:, [layout.PINION_TOOTH, layout.WHEEL_TOOTH]] += n_teeth
        indices.append(mesh.indices.T.ravel())
    chords = [np.empty(0)]
    if has_chords:
        chords = [_chord_columns(rows).ravel() for mesh in meshes for rows in mesh.rows]

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(mesh, name).ravel() for mesh in meshes])

    def of_motions(name: str) -> NDArray[Any]:
        of_lanes = [
            [getattr(mesh, name) for mesh in lane.equations.meshes] for lane in lanes
        ]
        return side_by_side(np.array(of_lanes), precision)

    numbers = [
        [mesh_numbers(mesh, lane.rest, step) for mesh in lane.equations.meshes]
        for lane in lanes
    ]
    n_chords = max(mesh.depth.shape[1] for mesh in meshes)
    depth = np.full((len(meshes), len(lanes), n_chords), np.inf)
    for row, mesh in zip(depth, meshes, strict=True):
        row[:, : mesh.depth.shape[1]] = mesh.depth
    touched = np.array([mesh.touched for mesh in first])
    options = first[0].teeth.table.options
    return {
        "n_meshes": len(meshes),
        "numbers": side_by_side(np.array(numbers), precision),
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
        "by_tooth": any(mesh.indices[:, layout.WHEEL_ROWS].any() for mesh in meshes),
        "one_sided": options.law == "one_sided",
        "consistent": options.roll_torque == "consistent",
        "prescribed": options.phase == "prescribed",
        # a gear that does not move has no reach: any degree of freedom stands for its own
        "touched": np.maximum(touched, 0).ravel(),
        "reach": of_motions("reach"),
        "slide": of_motions("slide"),
    }


def _mesh_lanes(lanes: Sequence[Lane], m: int) -> MeshLanes:
    """Mesh ``m`` of all lanes; rolls are counted from where its driving gear rests."""
    meshes = [lane.equations.meshes[m] for lane in lanes]
    turned = [
        lane.rest[mesh.touched[A_TURN]]
        for lane, mesh in zip(lanes, meshes, strict=True)
    ]
    return MeshLanes.of([mesh.teeth for mesh in meshes], np.array(turned))


def _elements(
    lanes: Sequence[Lane], forces: Mapping[str, ForceLaw], precision: str
) -> tuple[Any, ...]:
    """Arrays of every force law that the machines have beside meshes.

    Raises
    ------
    SimulationError    for an element without a law
    """
    rests, packed = np.stack([lane.rest for lane in lanes]), []
    for element in lanes[0].equations.elements:
        if element.law not in forces:
            raise SimulationError(
                f"no force law {element.law!r}; there are: {', '.join(forces) or 'none'}"
            )
    for name, law in forces.items():
        elements = [of_law(lane.equations.elements, name) for lane in lanes]
        if elements[0]:
            arrays = law.pack(elements, rests, precision)
            packed.append(law.rows(*map(aligned, arrays)))
    return tuple(packed)


def missing_cells() -> Array:
    """The end of a table: a cell of a missing pair, and a cell of zeros."""
    node = MISSING_COMPLIANCE, 0.0, MISSING_GAP, 0.0
    return np.array([*node, *node, *np.zeros(2 * len(node))])


def _bodies(lanes: Sequence[Lane], precision: str) -> Mapping[str, Any]:
    """Fields of the group that are of bodies, springs, dampers and the governor."""

    def stacked(name: str) -> Array:
        return np.stack([getattr(lane.equations, name) for lane in lanes])

    mass, rotation, held = stacked("mass"), stacked("rotation"), stacked("held")
    stiffness, damping = stacked("stiffness"), stacked("damping")
    is_sprung, is_damped = _is_entry(stiffness), _is_entry(damping)
    row, column = np.nonzero(np.triu(is_sprung, 1))
    far, near = np.nonzero(np.tril(is_damped & ~is_sprung, -1))
    turning = [mesh.touched[A_TURN] for mesh in lanes[0].equations.meshes]
    rows = {
        "inverse_mass": 1.0 / mass,
        "stiffness": np.einsum("lii->li", stiffness),
        "damping": np.einsum("lii->li", damping),
        "sprung": stiffness[:, row, column],
        "damped": damping[:, row, column],
        "damper": damping[:, far, near],
        "rotation": rotation,
        "held": held,
        "held_damping": stacked("held_damping")[:, None],
        "carried": mass * rotation,
    }
    return {
        **{name: side_by_side(values, precision) for name, values in rows.items()},
        "coupled": np.stack([row, column], axis=-1).ravel(),
        "damper_first": np.searchsorted(far, np.arange(mass.shape[1] + 1)),
        "damper_other": near,
        "turning": rotation[:, turning].T.ravel(),
        "held_dofs": np.flatnonzero(held.any(axis=0)),
        "exact_rotation": rotation.T.ravel(),
    }


def _is_entry(matrices: Array) -> Flags:
    """True where symmetric matrices (lane, row, column) hold more than what is rounded."""
    diagonal = np.sqrt(np.abs(np.einsum("lii->li", matrices)))
    least = ROUNDED * diagonal[:, :, None] * diagonal[:, None, :]
    return np.any(np.abs(matrices) > least, axis=0)


def _sources(lanes: Sequence[Lane], precision: str) -> Mapping[str, Any]:
    """Fields of the group that are of torques over an angle."""
    sources = lanes[0].equations.sources
    numbers = np.zeros((len(lanes), len(sources), groups.N_SOURCE))
    tables: list[Array] = []
    begin = 0
    for row, lane in zip(numbers, lanes, strict=True):
        for s, source in enumerate(lane.equations.sources):
            n_nodes = len(source.nodes)
            shift = source.shift + source.per_rad * lane.rest[source.turned_by]
            # places are positive: a fraction is then cut off downwards
            shift += groups.PERIODS_BEFORE * n_nodes
            row[s] = source.per_rad, shift, n_nodes, 1.0 / n_nodes, begin
            # the first node again, where rounding makes a place of a whole period
            nodes = np.append(source.nodes, source.nodes[0])
            rise = np.diff(nodes, append=nodes[1])
            tables.append(np.stack([nodes, rise], axis=-1).ravel())
            begin += len(tables[-1])
    tables.append(np.zeros(groups.READ_AT_ONCE))
    return {
        "sources": np.array([each.dof for each in sources], dtype=np.int64),
        "turned_by": np.array([each.turned_by for each in sources], dtype=np.int64),
        "source_numbers": np.moveaxis(numbers, 0, -1).ravel(),
        "source_table": np.concatenate(tables).astype(precision),
    }


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

    Forces are without those that hold rests and mean mesh forces.

    Parameters
    ----------
    values : (cell, row, lane)    rows of ``_group``
    first : number of the first cell
    steady : (lane, dof)    forces that the profile does not hold: all of them where none changes
    """

    values: Array
    first: int
    cells_per_second: float
    steady: Array


def _profile(lanes: Sequence[Lane], span: tuple[float, float]) -> Profile:
    """Course of some machines, with one cell where nothing changes."""
    n_dof = len(lanes[0].rest)
    at_sources = groups.N_PROFILE + 2 * n_dof
    n_rows = at_sources + 2 * len(lanes[0].equations.sources)
    holding = np.stack([lane.equations.holding(lane.rest) for lane in lanes])
    if all(lane.dynamics.nominal.is_steady for lane in lanes):
        now = np.zeros(1)
        values = np.zeros((1, n_rows, len(lanes)))
        for number, lane in enumerate(lanes):
            values[0, groups.SPEED, number] = lane.dynamics.nominal.over(now)[1][0]
            values[0, at_sources::2, number] = lane.dynamics.factors(now)[0]
        steady = np.stack([lane.dynamics.forces(now)[0] for lane in lanes])
        return Profile(
            values=values, first=0, cells_per_second=1.0, steady=steady - holding
        )
    first, edges = profile_cells(span)
    values = np.zeros((len(edges) - 1, n_rows, len(lanes)))
    for number, lane in enumerate(lanes):
        angle, speed = lane.dynamics.nominal.over(edges)
        forces = lane.dynamics.forces(edges) - holding[number]
        values[:, groups.ANGLE, number] = angle[:-1]
        values[:, groups.SPEED, number] = speed[:-1]
        values[:, groups.GAIN, number] = np.diff(speed) * CELLS_PER_SECOND
        changing = np.concatenate([forces, lane.dynamics.factors(edges)], axis=1)
        values[:, groups.N_PROFILE :: 2, number] = changing[:-1]
        slopes = np.diff(changing, axis=0) * CELLS_PER_SECOND
        values[:, groups.N_PROFILE + 1 :: 2, number] = slopes
    return Profile(
        values=values,
        first=first,
        cells_per_second=CELLS_PER_SECOND,
        steady=np.zeros((len(lanes), n_dof)),
    )


def profile_cells(span: tuple[float, float]) -> tuple[int, Array]:
    """Number of the first cell of a profile over a span in s, and edges of all, (cell + 1,) s.

    Cells begin at multiples of their length, so that an instant has the same bits in any span.
    Time 0 is one of their edges.
    """
    first = min(math.floor(span[0] * CELLS_PER_SECOND), 0)
    last = max(math.ceil(span[1] * CELLS_PER_SECOND), first + 1, 0)
    return first, np.arange(first, last + 1) / CELLS_PER_SECOND
