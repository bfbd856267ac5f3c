"""Machines side by side in the two-evaluation core: their arrays, and rows of its scratch.

The scratch holds the rows of every mesh, ``N_FIXED`` each, and then the ``N_BLOCKS`` rows of every
degree of freedom. Rows of the drive are those of the last mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, Helical, is_helical
from gensig.dynamics._vector import n_lanes, width
from gensig.dynamics._written import call, type_test, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import tail
from gensig.dynamics.equations import N_IN_PLANE, N_MOTIONS

# rows of a cell of ``Group.profile``; behind them follow force and its slope of every degree of
# freedom, then factor and its slope of every source
ANGLE, SPEED, GAIN, N_PROFILE = range(4)
# rows of ``Group.source_numbers``: nodes per radian, place at angle 0 in nodes, nodes of a
# period and one over them, index of the first node
NODES_PER_RAD, SHIFT, NODES, PER_NODES, FIRST_NODE, N_SOURCE = range(6)
PERIODS_BEFORE = 1024  # of a source, before its angle 0
# numbers of a node of ``Group.source_table``, its torque and the rise to the next, and those
# that a reading takes from there on
PER_NODE, READ_AT_ONCE = 2, 8


class Group(NamedTuple):
    """Machines side by side, all of the same bodies and meshes.

    ``numbers``, ``exact`` and ``indices`` (mesh, row, lane) hold rows as ``_layout`` names them,
    mesh after mesh, as all that belongs to teeth. ``table`` holds, lane after lane, the pairs of
    distinct teeth (pinion's times wheel's, node, [c, c', g, g']). Where those are many it holds
    the distinct teeth of the pinion and then those of the wheel, ``WHEEL_ROWS`` is not 0, and the
    group is ``by_tooth``. It
    ends with one cell of a missing pair and one cell of zeros. Helical pairs have ``n_chords``
    chords, one behind the other; spur teeth have one. ``depth`` (mesh, lane, chord) m is the
    penetration from which each chord holds. ``chord_table`` has the layout of the table and holds
    [energy in J that the chord's spring leaves out, its slope, gap of the first touch, its slope].
    ``n_pairs`` are followed at once. ``bend`` (mesh, lane, 4) is half the distance of nodes where
    a column is followed by its slope, else 0: values bend between nodes as their slopes say.
    ``tooth_row`` is the row of every tooth (-1 for a missing one), ``tooth_error`` its gap in m at
    the pitch point, ``tooth_tilt`` the growth of that gap along the path in m/m. ``prescribed``
    meshes roll by the nominal rotation, not by that of gear a.

    The machine is M q'' + C q' + K q = f + mesh forces; q is the deviation from nominal rotation.
    The state is q less ``rest`` (dof, lane), a static equilibrium, so that it stays small. Mean
    mesh forces are subtracted from mesh forces: large forces and torques balance before they are
    rounded. ``touched`` (mesh, motion) are the degrees of freedom of a mesh, ``reach``
    (mesh, motion, lane) is the gradient of its approach along them, ``slide``
    (mesh, motion, lane) the direction of its friction; where a gear does not move both are 0,
    and the first degree of freedom stands there. ``turning`` (mesh, lane) is the rotation of gear
    a with the reference, in float64 like ``exact_rotation`` (dof, lane). ``force`` (dof, lane) is
    what holds neither rest nor mean mesh forces; ``profile`` (cell, row, lane) holds the nominal
    motion of the reference and the forces that come with it, from cell ``profile_first`` on.
    ``carried`` is the mass of each degree of freedom times its ``rotation`` with the reference.
    ``reference`` is the degree of freedom whose rotation is 1, ``angles`` those whose angles are
    given out. ``stiffness`` and ``damping`` are diagonals; their other entries (entry, lane) are
    ``sprung`` and ``damped``, of the degrees of freedom ``coupled`` (entry, 2), each pair once.
    Where there is no spring, ``damper`` (entry, lane) are those of a degree of freedom from its
    ``damper_first`` (dof + 1,) on, with others before it, ``damper_other`` (entry,). The governor
    is no part of them: its stiffness is ``held`` (dof, lane) times ``held``, its damping
    ``held_damping`` (lane,) s times as much, on ``held_dofs``. ``sources``
    are the degrees of freedom on which torques and forces act that follow the angle of those in
    ``turned_by``: ``source_numbers`` (source, row, lane) say where the nodes of each are in
    ``source_table``. ``elements`` are the arrays of every force law that the machines have beside
    meshes, as its ``ForceLaw.rows``.
    """

    n_meshes: int
    numbers: Any
    exact: Any
    indices: Any
    n_pairs: int
    n_chords: int
    table: Any
    depth: Any
    chord_table: Any
    bend: Any
    tooth_row: Any
    tooth_error: Any
    tooth_tilt: Any
    by_tooth: bool
    one_sided: bool
    consistent: bool
    prescribed: bool
    touched: Any
    reach: Any
    slide: Any
    turning: Any
    inverse_mass: Any
    stiffness: Any
    damping: Any
    coupled: Any
    sprung: Any
    damped: Any
    damper_first: Any
    damper_other: Any
    damper: Any
    force: Any
    rest: Any
    rotation: Any
    exact_rotation: Any
    held: Any
    held_damping: Any
    held_dofs: Any
    carried: Any
    profile: Any
    profile_first: int
    cells_per_second: float
    reference: int
    angles: Any
    sources: Any
    turned_by: Any
    source_numbers: Any
    source_table: Any
    elements: Any


class SpurGroup(Group):
    """Machines of spur meshes of the one-sided law, in each of which three pairs are followed."""


class ChordGroup(Group, Helical):
    """Machines of meshes of which some are helical, or have more than three pairs in contact."""


class Axial:
    """Machines whose gears move along their axes and tilt: meshes act on twelve motions."""


class AxialChordGroup(ChordGroup, Axial):
    """Machines of helical meshes whose gears move along their axes and tilt."""


class GearPair:
    """Machines of which ``Equations.is_gear_pair`` holds.

    A type of its own: its code knows which degrees of freedom the mesh acts on.
    """


class SpurPairGroup(SpurGroup, GearPair):
    """Pairs of spur gears of the one-sided law, in which three pairs of teeth are followed."""


class AnyLaw:
    """Machines whose meshes may have the paper's law, and follow the nominal rotation alone."""


class AnyLawPairGroup(Group, GearPair, AnyLaw):
    """Pairs of spur gears of any law and contact ratio."""


class HelicalPairGroup(AxialChordGroup, GearPair):
    """Pairs of helical gears."""


is_gear_pair, has_any_law = type_test(GearPair), type_test(AnyLaw)
is_axial = type_test(Axial)


@written
def meshes_of(group):
    """Meshes of a machine."""
    return 1 if is_gear_pair(group) else group.n_meshes


@written
def motions_of(group):
    """Motions that a mesh acts on."""
    return N_MOTIONS if is_axial(group) else N_IN_PLANE


class MeshFields(NamedTuple):
    """Fields of one mesh of a ``Group``."""

    numbers: Any
    exact: Any
    indices: Any
    n_pairs: Any
    n_chords: Any
    table: Any
    depth: Any
    chord_table: Any
    bend: Any
    tooth_row: Any
    tooth_error: Any
    tooth_tilt: Any
    one_sided: bool
    consistent: bool


class SpurMesh(MeshFields):
    """One mesh of a group without chords, for the functions that know one mesh."""


class ChordMesh(MeshFields, Helical):
    """One mesh of a ``ChordGroup``, for the functions that know one mesh."""


@written
def of(name, d):
    """Row of a degree of freedom in the scratch of the machine, by the name of its block."""
    return rows.N_FIXED + name + d * rows.N_BLOCKS


@written
def mesh_of(group, m, n):
    """Mesh ``m`` of a group of ``n`` lanes; views, not copies."""
    kind = ChordMesh if is_helical(group) else SpurMesh
    return kind(
        tail(group.numbers, m * (layout.N_NUMBERS * n)),
        tail(group.exact, m * (layout.N_EXACT * n)),
        tail(group.indices, m * (layout.N_INDICES * n)),
        group.n_pairs,
        group.n_chords,
        group.table,
        tail(group.depth, m * (group.n_chords * n)),
        group.chord_table,
        tail(group.bend, m * (COLUMNS * n)),
        group.tooth_row,
        group.tooth_error,
        group.tooth_tilt,
        group.one_sided,
        group.consistent,
    )


@written
def mesh_rows(work, m, n):
    """Rows of one mesh in the scratch; a view."""
    return tail(work, m * (rows.N_FIXED * n))


@written
def wide_rows(wide, m, n):
    """Rows of one mesh in the float64 scratch; a view."""
    return tail(wide, m * (rows.N_WIDE * n))


@written
def integer_rows(near, m, n):
    """Rows of one mesh in the integer scratch; a view."""
    return tail(near, m * (rows.N_COUNTS * n))


@written
def machine_rows(work, n_meshes, n):
    """Rows of the machine: ``N_FIXED`` of its last mesh, and its blocks; a view."""
    return tail(work, (n_meshes - 1) * (rows.N_FIXED * n))


@dataclass(frozen=True, slots=True)
class Station:
    """A mesh of a group in the scratch, for functions that are written into compiled code.

    Parameters
    ----------
    m : number of the mesh
    mesh : its fields
    machine : rows of the machine
    own, wide, near : rows, float64 rows and integer rows of the mesh
    """

    group: Any
    m: Any
    mesh: Any
    machine: Any
    own: Any
    wide: Any
    near: Any

    @classmethod
    def of(cls, group: Any, m: Any, work: Any, wide: Any, near: Any) -> Station:
        """The station of a mesh in the scratch of a group."""
        n = width(work)
        return cls(
            group,
            m,
            mesh_of(group, m, n),
            machine_rows(work, meshes_of(group), n),
            mesh_rows(work, m, n),
            wide_rows(wide, m, n),
            integer_rows(near, m, n),
        )

    def call(self, function: Any, *values: Any) -> None:
        """Write a call of a compiled function with all parts of the station and other values."""
        rows_of_mesh = self.machine, self.own, self.wide, self.near
        call(function, self.group, self.m, self.mesh, *rows_of_mesh, *values)


def scratch(n_meshes, n_dof, precision):
    """Work rows, float64 rows and integer rows of ``integrate`` for so many meshes."""
    n = n_lanes(precision)
    n_rows = n_meshes * rows.N_FIXED + rows.N_BLOCKS * n_dof
    work = np.zeros(n_rows * n, dtype=precision)
    near = np.zeros(n_meshes * rows.N_COUNTS * n, dtype=np.int64)
    return work, np.zeros(n_meshes * rows.N_WIDE * n), near
