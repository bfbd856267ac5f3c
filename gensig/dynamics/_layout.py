"""Row names of the arrays of the compiled core.

Arrays are flat. A row holds one number for every record of the group: ``get_row``, ``set_row``
and ``at`` of ``_vector`` turn a row into an index. A slot is an instant at which the tables were
read.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from gensig.dynamics._vector import FOUR
from gensig.dynamics._written import type_test, written
from gensig.mesh.pair_table import N_PAIRS

MOST_PAIRS = 8  # that may be followed at once; spur gears have 4
# m: a pair is followed through a step if its gap exceeds the approach by less than this;
# no pair approaches faster
NEAR = 2e-5
FAR, YIELDING = 1.0, 1e30  # gap in m and compliance in m/N of an absent pair
FAR_NEAR = (
    1e-4  # m: approaches below need only the pairs between FIRST_NEAR and LAST_NEAR
)

# rows of Group.numbers
(
    PINION_RADIUS,
    PATH,
    PITCH_POINT,
    START_CURVATURE,
    TANGENT_LENGTH,
    SHARED,
    DAMPING,
    FRICTION,
    PER_FRICTION_WIDTH,
    PER_SWITCH_WIDTH,
    BACKLASH,
    MEAN_FORCE,
    REST_APPROACH,
    HALF_LAG,
    MIDDLE_POINT,
    N_NUMBERS,
) = range(16)
# rows of Group.exact, float64 in every precision: a long roll must not lose the pairs' positions
(
    EXACT_RADIUS,
    PITCH,
    PER_PITCH,
    NODES_PER_METER,
    START_ROLL,
    FIRST_NEAR,
    LAST_NEAR,
    TABLE_START,
    N_EXACT,
) = range(9)
# rows of Group.indices
(
    PINION_TEETH,
    WHEEL_TEETH,
    START_PINION,
    START_WHEEL,
    PINION_TOOTH,
    WHEEL_TOOTH,
    TABLE,
    STRIDE,
    LAST_CELL,
    PINION_ROWS,
    WHEEL_ROWS,
    FIRST_PITCH,
    FOLLOWED,
    CHORD_STRIDE,
    COAST_TABLE,
    N_INDICES,
) = range(16)
# rows of one pair in a slot of the scratch
COMPLIANCE, COMPLIANCE_SLOPE, GAP, GAP_SLOPE, STIFFNESS, POSITION, N_KEPT = range(7)
# slots; EVEN and ODD alternate as begin and end of a step
COAST, EVEN, ODD, MIDDLE, PART, N_SLOTS = range(6)
SLOT_ROWS = MOST_PAIRS * N_KEPT
COLUMNS = FOUR  # of a table: compliance, its slope, gap, its slope
# rows of the scratch behind the slots
BITE = N_SLOTS * SLOT_ROWS  # penetration of each pair
MARGIN = BITE + MOST_PAIRS  # two blocks: at the first and at the last stage of a step
ERROR = MARGIN + 2 * MOST_PAIRS
TILT = ERROR + MOST_PAIRS
AHEAD = TILT + MOST_PAIRS  # roll of a slot, less that at the begin of the step
WITHIN = AHEAD + N_SLOTS
FLAGS = WITHIN + 1
BEGUN = FLAGS + 1  # of drive lines: rotation of gear a at the begin of the step
# motion of the mesh at a stage; the roll is counted from the begin of the step
MOTION_ROLL, MOTION_APPROACH, MOTION_RATE, MOTION_ROLL_RATE = range(
    BEGUN + 1, BEGUN + 5
)
N_LAW = 8
LAW = MOTION_ROLL_RATE + 1  # fields of ``Law``
RAW = LAW + N_LAW  # table rows as they are read, lane by lane
PAIR_FORCE = RAW + MOST_PAIRS * COLUMNS
# of chords only: force that bends the shared structure, the same at the end of the last step,
# approach less that deflection in the middle of the step, table rows as read, and by slot and pair
TOTAL = PAIR_FORCE + MOST_PAIRS
LAST_TOTAL, LOCAL, RAW_CHORD = TOTAL + 1, TOTAL + 2, TOTAL + 3
CHORD_DATA = RAW_CHORD + MOST_PAIRS * COLUMNS
LEFT_OUT, LEFT_OUT_SLOPE, TOUCH, TOUCH_SLOPE = range(COLUMNS)
CHORD_SLOT_ROWS = MOST_PAIRS * COLUMNS
PAIR_DAMPED = (
    CHORD_DATA + N_SLOTS * CHORD_SLOT_ROWS
)  # factor of the damping of every pair
MOST_DAMPER = PAIR_DAMPED + MOST_PAIRS  # largest damper of a pair, N s/m
N_MESH = MOST_DAMPER + 1
# rows of the drive at the begin of a step: nominal speed of the reference, its change, and rotation
# that the state does not hold
DRIVE_SPEED, DRIVE_GAIN, DRIVE_CENTER, N_DRIVE = range(4)
# rows of the mesh at an output sample: the newest pair, the normal force, that of every pair
SEEN_NEWEST, SEEN_FORCE, SEEN_PAIRS, N_SEEN = 0, 1, 2, 2 + MOST_PAIRS
# rows of the float64 scratch
BASE, CENTER, NOMINAL, ROLL, N_WIDE = 0, 1, 2, 3, 3 + N_SLOTS
# rows of the integer scratch
NEWEST, AT_PINION, AT_WHEEL, CHORD = 0, 1, 1 + MOST_PAIRS, 1 + 2 * MOST_PAIRS
SPAN = CHORD + MOST_PAIRS
N_COUNTS = SPAN + N_SLOTS
# spans of pairs in a slot: pairs that were read, and pairs that come near their mates
FIRST_READ, LAST_READ, FIRST_NEAR_PAIR, LAST_NEAR_PAIR, N_SPAN = range(5)
NO_PAIR = -(2**62)


class Law(NamedTuple):
    """Law of the gear mesh at an instant, a row each.

    Parameters
    ----------
    normal, friction : N               forces
    moment_p, moment_w : N m           of the friction, about pinion and wheel
    along : N                          force on the roll coordinate, of the energy balance
    stored : J
    lost : W                           in the mesh damping
    loaded : number of loaded pairs, negative on the back flanks
    """

    normal: Any
    friction: Any
    moment_p: Any
    moment_w: Any
    along: Any
    stored: Any
    lost: Any
    loaded: Any


class Helical:
    """Helical gears.

    A type of its own, so that spur gears are compiled without the code of helical ones.
    """


is_helical = type_test(Helical)


@written
def followed(group):
    """Pairs that are followed at once."""
    return group.n_pairs if is_helical(group) else N_PAIRS


@written
def pair_rows(slot, pair):
    """First row of a pair in a slot; ``COMPLIANCE`` to ``POSITION`` count from there."""
    return slot * SLOT_ROWS + pair * N_KEPT


@written
def chord_rows(slot, pair):
    """First row of a pair's chord in a slot; ``LEFT_OUT`` to ``TOUCH_SLOPE`` count from there."""
    return CHORD_DATA + slot * CHORD_SLOT_ROWS + pair * COLUMNS


@written
def raw_index(block, pair, lane, n):
    """Index of the table row that was read for a pair of one record.

    ``block`` is ``RAW`` or ``RAW_CHORD``.
    """
    return block * n + (pair * n + lane) * COLUMNS


@written
def span_index(slot, n):
    """Index of the spans of a slot; ``FIRST_READ`` to ``LAST_NEAR_PAIR`` count from there."""
    return SPAN * n + N_SPAN * slot
