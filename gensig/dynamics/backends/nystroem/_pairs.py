"""Two-evaluation core: the pairs of teeth and the reading of their tables."""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._tables import CUBIC_MIDDLE
from gensig.dynamics._vector import (
    EIGHT,
    any_above,
    at,
    cells,
    compiled,
    fused,
    get_row,
    joined,
    load_wide,
    lower,
    set_row,
    spread,
    store,
    truncated,
    upper,
    where_above,
    width,
)
from gensig.dynamics._written import any_of, either, traced, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._layout import FOLLOWED, N_NODE, PER_COMPLIANCE

MISSING_GAP, MISSING_COMPLIANCE = 1.0, 1e-6  # m and m/N of a pair without a tooth
CELL = 2 * layout.COLUMNS  # numbers of two nodes
OUT_OF_MESH = -1.0  # N: margin of a pair that was not followed before
SURELY_SLIDING = 1.0 - 1e-6  # product of directions above which both are the same


@written
def locate(group, work, wide):
    """Set the positions of all pairs; true if one has left the path in any lane."""
    n, exact, has_left = width(work), group.exact, []
    for first in range(0, n, EIGHT):
        roll = load_wide(wide, at(layout.BASE, first, n))
        pitch = load_wide(exact, at(layout.PITCH, first, n))
        path = load_wide(group.numbers, at(layout.PATH, first, n))
        reach = 0.5 * path + 1.5 * pitch
        for j in range(FOLLOWED):
            number = load_wide(wide, at(rows.NUMBER + j, first, n))
            position = roll - number * pitch
            store(wide, at(rows.POSITION + j, first, n), position)
            has_left.append(any_above(position, reach))
    return any_of(*has_left)


@compiled
def enter(group, lane, j, number, work, wide):
    """Let a slot of one lane follow the pair of a number."""
    n = width(work)
    indices, wides = group.indices[lane::n], wide[lane::n]
    tooth_p = (number + indices[layout.START_PINION]) % indices[layout.PINION_TEETH]
    tooth_w = (number + indices[layout.START_WHEEL]) % indices[layout.WHEEL_TEETH]
    tooth_p += indices[layout.PINION_TOOTH]
    tooth_w += indices[layout.WHEEL_TOOTH]
    row_p, row_w = group.tooth_row[tooth_p], group.tooth_row[tooth_w]
    start, stride = indices[layout.TABLE], indices[layout.STRIDE]
    wheel_rows = indices[layout.WHEEL_ROWS]
    missing = len(group.table) - 2 * CELL
    pinion, per_cell = missing, 0
    wheel, per_wheel_cell = missing + CELL, 0
    if row_p >= 0 and row_w >= 0:
        per_cell = layout.COLUMNS
        pinion = start + (row_p * indices[layout.PINION_ROWS] + row_w) * stride
        if wheel_rows > 0:
            pinion = start + row_p * stride
            wheel = start + (wheel_rows + row_w) * stride
            per_wheel_cell = layout.COLUMNS
    wides[rows.NUMBER + j] = number
    roll = wides[layout.BASE]
    wides[rows.POSITION + j] = roll - number * group.exact[at(layout.PITCH, lane, n)]
    wides[rows.AT_PINION + j], wides[rows.AT_WHEEL + j] = pinion, wheel
    wides[rows.PER_CELL + j] = per_cell
    wides[rows.PER_WHEEL_CELL + j] = per_wheel_cell
    wides[rows.LAST_CELL] = indices[layout.LAST_CELL]
    error = group.tooth_error[tooth_p] + group.tooth_error[tooth_w]
    tilt = group.tooth_tilt[tooth_p] + group.tooth_tilt[tooth_w]
    work[at(layout.ERROR + j, lane, n)] = error
    work[at(layout.TILT + j, lane, n)] = tilt
    work[at(rows.MARGIN + j, lane, n)] = OUT_OF_MESH
    work[at(rows.PAIR_FORCE + j, lane, n)] = 0.0


@compiled
def take_pairs(group, by_tooth, work, wide):
    """Let slots whose pair has left follow the pair that comes next, and read its begin."""
    n = width(work)
    for j in range(FOLLOWED):
        entered = False
        for lane in range(n):
            path = group.numbers[at(layout.PATH, lane, n)]
            pitch = group.exact[at(layout.PITCH, lane, n)]
            flag = 0.0
            if wide[at(rows.POSITION + j, lane, n)] > 0.5 * path + 1.5 * pitch:
                number = int(wide[at(rows.NUMBER + j, lane, n)]) + FOLLOWED
                enter(group, lane, j, number, work, wide)
                flag, entered = 1.0, True
            work[at(rows.FRESH, lane, n)] = flag
        if entered:
            read_begin(group, by_tooth, j, work, wide)


@compiled
def first_pairs(group, fresh, work, wide):
    """Let all slots of the fresh lanes follow the pairs around the middle of the path."""
    n = width(work)
    for lane in range(n):
        work[at(rows.FRESH, lane, n)] = fresh[lane]
        if fresh[lane] > 0.0:
            path = group.numbers[at(layout.PATH, lane, n)]
            pitch = group.exact[at(layout.PITCH, lane, n)]
            roll = wide[at(layout.BASE, lane, n)]
            first = int(np.ceil((roll - 0.5 * path) / pitch - 1.5))
            for number in range(first, first + FOLLOWED):
                enter(group, lane, number % FOLLOWED, number, work, wide)
            work[at(rows.BEHIND, lane, n)] = 0.0


@written
def _between_nodes(low, high, slope_low, slope_high, part, bend):
    """Value and slope in a cell: slopes are straight, values are their integral."""
    step = slope_high - slope_low
    value = fused(part, high - low, low) - bend * step
    return value, fused(part, step, slope_low)


@written
def _find(group, j, ahead, first, wide, n):
    """Place of a pair, share of its table cell, and the cell, of eight lanes from one on."""
    zero = spread(wide, 0.0)
    place = load_wide(wide, at(rows.POSITION + j, first, n)) + ahead
    beyond = place - load_wide(group.exact, at(layout.TABLE_START, first, n))
    x = beyond * load_wide(group.exact, at(layout.NODES_PER_METER, first, n))
    x = where_above(x, zero, x, zero)  # what is no number becomes 0, too
    cell, last = truncated(x), load_wide(wide, at(rows.LAST_CELL, first, n))
    cell = where_above(last, cell, cell, last)
    return place, x - cell, cell


@written
def _index(cell, at_row, per_row, first, wide, n):
    """Index of a cell in the table, of eight lanes from one on."""
    index = cell * load_wide(wide, at(per_row, first, n))
    return index + load_wide(wide, at(at_row, first, n))


@written
def _find_all(group, j, ahead, work, wide):
    """Place of a pair and share of its table cell, and the cells of both halves of the lanes."""
    n = width(work)
    place, part, cell = _find(group, j, lower(ahead), 0, wide, n)
    last_place, last_part, last_cell = place, part, cell
    if n > EIGHT:
        last_place, last_part, last_cell = _find(group, j, upper(ahead), EIGHT, wide, n)
    part, place = joined(work, part, last_part), joined(work, place, last_place)
    return place, part, cell, last_cell


@written
def _read_cells(group, at_row, per_row, cell, last_cell, work, wide):
    """Numbers of two nodes of the table."""
    n = width(work)
    low = _index(cell, at_row, per_row, 0, wide, n)
    high = low
    if n > EIGHT:
        high = _index(last_cell, at_row, per_row, EIGHT, wide, n)
    return cells(group.table, low, high)


@written
def _sums(some, more):
    return tuple(a + b for a, b in zip(some, more, strict=True))


@written
def _in_cell(group, j, place, part, nodes, work):
    """Own compliance, its slope, gap and its slope of a pair, from the nodes of its cell."""
    numbers = group.numbers
    c_0, soft_0, g_0, rise_0, c_1, soft_1, g_1, rise_1 = nodes
    bend = part * (1.0 - part) * get_row(work, rows.BEND)
    c, soft = _between_nodes(c_0, c_1, soft_0, soft_1, part, bend)
    g, rise = _between_nodes(g_0, g_1, rise_0, rise_1, part, bend)
    tilt = get_row(work, layout.TILT + j)
    beyond = place - get_row(numbers, layout.MIDDLE_POINT)
    g = fused(tilt, beyond, g + get_row(work, layout.ERROR + j))
    c = PER_COMPLIANCE * (c - get_row(numbers, layout.SHARED))
    return c, PER_COMPLIANCE * soft, g, rise + tilt


def _read(group, by_tooth, j, ahead, work, wide):
    """Place of a pair ``ahead`` of the step, share of its cell, and the nodes of the cell."""
    place, part, cell, last_cell = _find_all(group, j, ahead, work, wide)
    at_row, per_row = rows.AT_PINION + j, rows.PER_CELL + j
    nodes = _read_cells(group, at_row, per_row, cell, last_cell, work, wide)

    def with_wheel():
        at_row, per_row = rows.AT_WHEEL + j, rows.PER_WHEEL_CELL + j
        more = _read_cells(group, at_row, per_row, cell, last_cell, work, wide)
        return _sums(nodes, more)

    return place, part, either(by_tooth, with_wheel, nodes)


@written
def sliding(numbers, place):
    """Friction coefficient times direction of sliding, and the integral of the direction.

    The direction turns smoothly at the pitch point, as in ``_mesh_kernels``.
    """
    one = spread(numbers, 1.0)
    beyond = place - get_row(numbers, layout.PITCH_POINT)
    raw = beyond * get_row(numbers, layout.PER_FRICTION_WIDTH)
    x = where_above(0.0 - one, raw, 0.0 - one, raw)
    x = where_above(x, one, one, x)
    over = raw - x
    over = where_above(0.0 * one, over, 0.0 - over, over)
    square = x * x
    integral = square * (0.75 - 0.125 * square) + over
    return x * (1.5 - 0.5 * square), integral


@written
def _set_fresh(row, value, work):
    """Set a row in the lanes that ``FRESH`` marks."""
    fresh, zero = get_row(work, rows.FRESH), spread(work, 0.0)
    set_row(work, row, where_above(fresh, zero, value, get_row(work, row)))


@traced
def read_begin(group, by_tooth, j, work, wide):
    """Read a pair at the begin of the step, in the lanes that ``FRESH`` marks."""
    behind = get_row(work, rows.BEHIND)
    place, part, nodes = _read(group, by_tooth, j, behind, work, wide)
    _set_begin(group, j, place, part, nodes, work)


@written
def _set_begin(group, j, place, part, nodes, work):
    c, soft, gap, rise = _in_cell(group, j, place, part, nodes, work)
    direction, slid = sliding(group.numbers, place)
    node = rows.NODES + j * N_NODE
    _set_fresh(node + rows.COMPLIANCE, c, work)
    _set_fresh(node + rows.SOFTENING, soft, work)
    _set_fresh(node + rows.GAP, gap, work)
    _set_fresh(node + rows.GAP_SLOPE, rise, work)
    _set_fresh(node + rows.SLIDING, direction, work)
    _set_fresh(node + rows.PLACE, place, work)
    _set_fresh(node + rows.SLID, slid, work)


@written
def _cubic(before, after, slope_before, slope_after, span, per_span):
    """Value and slope half-way; Simpson's rule over the slopes gives the growth."""
    growth = (CUBIC_MIDDLE.slope_by_values * per_span) * (after - before)
    slope = fused(-CUBIC_MIDDLE.slope_by_slopes, slope_before + slope_after, growth)
    bend = (CUBIC_MIDDLE.value_by_slopes * span) * (slope_before - slope_after)
    return fused(CUBIC_MIDDLE.value_by_values, before + after, bend), slope


@traced
def read_step(group, by_tooth, j, ahead, span, per_span, work, wide):
    """Set the rows of a pair in the middle of the step, and then those at its end.

    No gap is smaller in the middle than at both ends. Sliding in the middle is such that
    Simpson's rule gives its mean over the step.
    """
    place, part, nodes = _read(group, by_tooth, j, ahead, work, wide)
    _set_step(group, j, place, part, nodes, span, per_span, work)


@written
def _set_step(group, j, place, part, nodes, span, per_span, work):
    node, middle = rows.NODES + j * N_NODE, rows.MIDDLE + j * N_NODE
    c, soft, gap, rise = _in_cell(group, j, place, part, nodes, work)
    direction, slid = sliding(group.numbers, place)
    c_0, soft_0 = (
        get_row(work, node + rows.COMPLIANCE),
        get_row(work, node + rows.SOFTENING),
    )
    value, slope = _cubic(c_0, c, soft_0, soft, span, per_span)
    set_row(work, middle + rows.COMPLIANCE, value)
    set_row(work, middle + rows.SOFTENING, slope)
    gap_0, rise_0 = get_row(work, node + rows.GAP), get_row(work, node + rows.GAP_SLOPE)
    value, slope = _cubic(gap_0, gap, rise_0, rise, span, per_span)
    least = where_above(gap_0, gap, gap, gap_0)
    set_row(work, middle + rows.GAP, where_above(value, least, value, least))
    set_row(work, middle + rows.GAP_SLOPE, slope)
    direction_0 = get_row(work, node + rows.SLIDING)
    growth = slid - get_row(work, node + rows.SLID)
    growth = growth * (CUBIC_MIDDLE.slope_by_values * per_span)
    mean = growth * get_row(work, rows.FRICTION_WIDTH)
    mean = mean - CUBIC_MIDDLE.slope_by_slopes * (direction_0 + direction)
    turning = spread(work, SURELY_SLIDING)
    mean = where_above(direction_0 * direction, turning, direction, mean)
    set_row(work, middle + rows.SLIDING, mean)
    place_0 = get_row(work, node + rows.PLACE)
    set_row(work, middle + rows.PLACE, 0.5 * (place_0 + place))
    set_row(work, node + rows.COMPLIANCE, c)
    set_row(work, node + rows.SOFTENING, soft)
    set_row(work, node + rows.GAP, gap)
    set_row(work, node + rows.GAP_SLOPE, rise)
    set_row(work, node + rows.SLIDING, direction)
    set_row(work, node + rows.PLACE, place)
    set_row(work, node + rows.SLID, slid)
