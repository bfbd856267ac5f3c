"""Layout of the arrays of a geared shaft line's compiled core."""

from __future__ import annotations

from typing import Any, NamedTuple

from gensig.dynamics._vector import inlined

# numbers of a mesh
(
    BACKLASH, DAMPING, SHARED, START, NOMINAL_PITCHES, PITCHES_PER_RAD, MIRROR, UPRIGHT,
    LEAST_GAP, LEAST_COAST_GAP, AT_FRICTION,
) = range(11)  # fmt: skip
# behind them those of ``MeshFriction.numbers``: the pair stands at its pitches times BASE_PITCH,
# less LAG; PER_WIDTH is 2 over the length in which sliding turns round
(
    COEFFICIENT, BASE_PITCH, LAG, PITCH_POINT, PER_WIDTH, PATH, START_CURVATURE,
    TANGENT_LENGTH, N_FRICTION,
) = range(9)  # fmt: skip
N_NUMBERS = AT_FRICTION + N_FRICTION
# whole numbers of a mesh; those called AT_ say where a flat array begins
(
    ROLL_DOF, N_PAIRS, FIRST, NODES, AT_TABLE, AT_ROWS, AT_COAST_ROWS, TEETH_A, TEETH_B,
    AT_KIND_A, AT_KIND_B, AT_ERROR_A, AT_ERROR_B, START_A, START_B, N_KINDS_B, N_CHORDS,
    AT_DEPTH, N_INTEGERS,
) = range(19)  # fmt: skip
# what is gathered of every chord of a pair, each with how fast it grows as the mesh rolls on; the
# gap of the first chord is that of the first touch
GAP, GAP_SLOPE, COMPLIANCE, COMPLIANCE_SLOPE, LEFT_OUT, LEFT_OUT_SLOPE, PER_CHORD = (
    range(7)
)
# behind the chords: where the pair stands, pitches from A, and its normal force
PLACE, PRESSED, N_BEHIND = -2, -1, 2
DRIVE, COAST, N_FLANKS = range(3)
# what a mesh does at an instant; LOST is a power, ALONG the force on the roll coordinate, J per
# pitch; RUBBING the friction force, MOMENT_A and MOMENT_B its moments about both gears
(
    FORCE, TANGENT, RATE_TANGENT, STORED, LOST, ALONG, RUBBING, MOMENT_A, MOMENT_B, N_LAW,
) = range(10)  # fmt: skip
N_RUBBING = 3
# what a mesh has done: contact lost and back flanks loaded in steps, extreme forces
APART, BEHIND, LARGEST, LEAST, N_TALLY = range(5)
# sums of a run in J, then counts
INPUT, PASSING, DISSIPATED, THROUGHPUT, ROUNDS, N_SUMS = range(6)


@inlined
def node_offset(integers, row, n_cells, cell):
    """Offset in ``Meshes.table`` of the node before a cell of a row.

    ``integers`` are the whole numbers of the mesh.
    """
    n_columns = PER_CHORD * integers[N_CHORDS]
    return integers[AT_TABLE] + (row * (n_cells + 1) + cell) * n_columns


class Rows(NamedTuple):
    """A sparse matrix row by row.

    Row i holds ``column`` and ``value`` from ``first[i]`` to ``first[i + 1]``.
    """

    first: Any
    column: Any
    value: Any


class Padded(NamedTuple):
    """A symmetric matrix: where sparse, its rows filled up to ``width`` numbers, ``column`` and
    ``value`` (width, dof), else ``value`` (dof, dof) alone and no ``column``."""

    column: Any
    value: Any


class Factor(NamedTuple):
    """A = L D L^T under the envelope of A: row i of L ends before its diagonal and has
    ``reach[i]`` numbers.

    ``lower`` holds the rows one after the other from ``first`` (dof,) on, ``inverse_pivot``
    (dof,) is 1 / D. ``turn`` (dof,) is an order in which rows can be solved where neighbours do
    not wait for each other. ``inverse`` (dof, dof) is that of A where A is so full that it costs
    less, else empty; ``spare`` (dof,) is its scratch.
    """

    first: Any
    reach: Any
    turn: Any
    lower: Any
    inverse_pivot: Any
    inverse: Any
    spare: Any


class Meshes(NamedTuple):
    """All meshes: ``number`` (mesh, N_NUMBERS), ``integers`` (mesh, N_INTEGERS), and flat
    arrays for all of them.

    ``table`` holds, node after node of row after row and chord after chord, the gap in m, the
    compliance in m/N without what pairs share and the energy left out in J, each with its slope
    per cell; ``depth`` where chords begin beyond the first gap, m; ``rows`` the row of every pair
    of kinds, -1 for a pair that never touches; ``kind``, ``error`` and ``tilt`` one number a
    tooth, the last two where ``AT_ERROR_`` says.
    """

    number: Any
    integers: Any
    table: Any
    depth: Any
    rows: Any
    kind: Any
    error: Any
    tilt: Any


class Torques(NamedTuple):
    """Torques and forces on degrees of freedom: ``steady`` (knot, dof), and those over an angle.

    Source i acts on ``dof`` (source,) with its ``table`` from ``first`` (source + 1,) on. It
    follows the angle of ``turned_by`` (source,), ``per_rad[i]`` nodes a radian from ``shift[i]``
    nodes on, times ``factor`` (source, knot).
    """

    steady: Any
    dof: Any
    turned_by: Any
    first: Any
    table: Any
    per_rad: Any
    shift: Any
    factor: Any


class Knots(NamedTuple):
    """Knots of the nominal rotation.

    ``time`` (knot,) s, ``speed`` rad/s, straight between, ``angle`` rad and ``gain`` rad/s2.
    """

    time: Any
    speed: Any
    angle: Any
    gain: Any


class Line(NamedTuple):
    """A line at one step: matrices, the factor of 4 M / h^2 + 2 C / h + K and what meshes do to it.

    ``direction`` are the gradients of the approaches as rows; ``answer`` (mesh, dof) what one
    newton of a mesh moves, ``compliance`` (mesh, mesh) what it takes from the approaches.
    ``rubbing`` has three rows a mesh, along which its friction and both moments act.
    ``rotation`` (dof,) is the nominal rotation of each per that of the reference, ``carried`` M
    times it.
    """

    mass: Padded
    damping: Padded
    stiffness: Padded
    direction: Rows
    rubbing: Rows
    factor: Factor
    answer: Any
    compliance: Any
    rotation: Any
    carried: Any


class Work(NamedTuple):
    """Scratch of the core: (dof,), then (mesh,), then of other shapes."""

    ahead_q: Any
    ahead_v: Any
    moved: Any
    force: Any
    turned: Any
    roll_rate: Any
    free: Any
    approach: Any
    right: Any
    near: Any
    matrix: Any
    law: Any
    pairs: Any
    reach: Any
