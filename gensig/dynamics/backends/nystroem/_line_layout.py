"""Row names of the two-evaluation core for machines of several meshes.

The scratch holds the rows of every mesh, ``N_FIXED`` each, and then the ``N_BLOCKS`` rows of every
degree of freedom. Rows of the drive are those of the last mesh.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import COLUMNS, Helical
from gensig.dynamics._vector import n_lanes
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import tail
from gensig.dynamics.backends.nystroem._layout import block

# block behind those of a pair: all forces on the machine
ON = rows.N_BLOCKS
N_BLOCKS = ON + 1
# row of a spur mesh, which one pair holds in registers: roll over the step at whose end the nodes
# were read
AHEAD = layout.AHEAD
BEGUN = layout.BEGUN
# of the machine: pull of the governor on each of ``held``; no torque has a row of its own
PULL = rows.DRIVE + layout.DRIVE_TORQUE
# degrees of freedom that a mesh acts on: x, y and rotation of its driving gear a and its driven
# gear b; NONE for a gear that does not move so
A_X, A_Y, A_TURN, B_X, B_Y, B_TURN, N_TOUCHED = range(7)
NONE = -1
# rows of a cell of ``LineGroup.profile``; behind them follow force and its slope of every degree of
# freedom, then factor and its slope of every source
ANGLE, SPEED, GAIN, N_PROFILE = range(4)
# rows of ``LineGroup.source_numbers``: nodes per radian, place at angle 0 in nodes, nodes of a
# period and one over them, index of the first node
NODES_PER_RAD, SHIFT, NODES, PER_NODES, FIRST_NODE, N_SOURCE = range(6)
PERIODS_BEFORE = 1024  # of a source, before its angle 0
# numbers of a node of ``LineGroup.source_table``, its torque and the rise to the next, and those
# that a reading takes from there on
PER_NODE, READ_AT_ONCE = 2, 8


class LineGroup(NamedTuple):
    """Machines of several spur meshes side by side, all of the same bodies and meshes.

    ``numbers``, ``exact`` and ``indices`` (mesh, row, lane), ``bend`` (mesh, lane, 4), ``depth``
    (mesh, lane, chord) and all that belongs to teeth are those of
    ``gensig.dynamics._layout.Group``, mesh after mesh; the table ends with one cell of a missing
    pair and one cell of zeros.

    The machine is M q'' + C q' + K q = f + mesh forces; q is the deviation from nominal rotation.
    The state is q less ``rest`` (dof, lane). ``touched`` (mesh, 6) are the degrees of freedom of a
    mesh, ``reach`` (mesh, 6, lane) is the gradient of its approach along them, ``slide``
    (mesh, 6, lane) the direction of its friction; where a gear does not move both are 0, and the
    first degree of freedom stands there. ``turning`` (mesh, lane) is the rotation of gear
    a with the reference, in float64 like ``exact_rotation`` (dof, lane). ``force`` (dof, lane) is
    what holds neither rest nor mean mesh forces; ``profile`` (cell, row, lane) holds the nominal
    motion of the reference and the forces that come with it. ``reference`` is the degree of
    freedom whose rotation is 1, ``angles`` those whose angles are given out. ``stiffness`` and
    ``damping`` are diagonals; their other entries (entry, lane) are ``sprung`` and ``damped``, of
    the degrees of freedom ``coupled`` (entry, 2), each pair once. Where there is no spring,
    ``damper`` (entry, lane) are those of a degree of freedom from its ``damper_first`` (dof + 1,)
    on, with others before it, ``damper_other`` (entry,). The governor is
    no part of them: its stiffness is ``held`` (dof, lane) times ``held``, its damping
    ``held_damping`` (lane,) s times as much, on ``turning_dofs``. ``sources`` are the degrees of
    freedom on which torques act that follow their angle: ``source_numbers`` (source, row, lane)
    say where the nodes of each are in ``source_table``. Other fields are those of ``Group``.
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
    one_sided: bool
    consistent: bool
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
    turning_dofs: Any
    carried: Any
    profile: Any
    profile_first: int
    cells_per_second: float
    reference: int
    angles: Any
    sources: Any
    source_numbers: Any
    source_table: Any


class ChordLineGroup(LineGroup):
    """Machines of meshes of which some are helical, or have more than three pairs in contact.

    Spur teeth have one chord.
    """


class MeshFields(NamedTuple):
    """Fields of one mesh of a ``LineGroup``."""

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


class Mesh(MeshFields):
    """One mesh of a ``LineGroup``, for the functions that know one mesh."""


class ChordMesh(MeshFields, Helical):
    """One mesh of a ``ChordLineGroup``, for the functions that know one mesh."""


@written
def of(name, d):
    """Row of a degree of freedom in the scratch of the machine, by the name of its block."""
    return block(name, 1) + d * N_BLOCKS


@written
def mesh_of(group, m, n):
    """Mesh ``m`` of a group of ``n`` lanes; views, not copies."""
    return Mesh(*_fields_of(group, m, n))


@written
def chord_mesh_of(group, m, n):
    """Mesh ``m`` of a group whose meshes have chords; views, not copies."""
    return ChordMesh(*_fields_of(group, m, n))


def _fields_of(group, m, n):
    return (
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


def line_scratch(n_meshes, n_dof, precision="float64"):
    """Work rows, float64 rows and integer rows of ``integrate`` for so many meshes."""
    n = n_lanes(precision)
    work = np.zeros((n_meshes * rows.N_FIXED + N_BLOCKS * n_dof) * n, dtype=precision)
    near = np.zeros(n_meshes * rows.N_COUNTS * n, dtype=np.int64)
    return work, np.zeros(n_meshes * rows.N_WIDE * n), near
