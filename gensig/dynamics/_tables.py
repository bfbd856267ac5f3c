"""Compiled core: reading the tables of the gear mesh, several records side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import (
    AHEAD,
    AT_PINION,
    AT_WHEEL,
    CHORD,
    COLUMNS,
    COMPLIANCE,
    COMPLIANCE_SLOPE,
    ERROR,
    FAR,
    GAP,
    GAP_SLOPE,
    MOST_PAIRS,
    NEWEST,
    POSITION,
    RAW,
    RAW_CHORD,
    STIFFNESS,
    TILT,
    YIELDING,
    chord_rows,
    followed,
    is_helical,
    pair_rows,
    raw_index,
    span_index,
)
from gensig.dynamics._vector import (
    FOUR,
    at,
    compiled,
    get_row,
    inlined,
    load_four,
    second_and_fourth,
    set_row,
    spread,
    store,
    transpose,
    where_above,
    width,
)
from gensig.dynamics._written import fold, written


class CubicMiddle(NamedTuple):
    """Value and slope of a cubic half-way between two ends at a distance d.

    value = value_by_values (y_0 + y_1) + value_by_slopes d (y'_0 - y'_1)
    slope = slope_by_values (y_1 - y_0) / d - slope_by_slopes (y'_0 + y'_1)

    Simpson's rule over the slopes of both ends and of the middle gives y_1 - y_0.
    """

    value_by_values: float
    value_by_slopes: float
    slope_by_values: float
    slope_by_slopes: float


CUBIC_MIDDLE = CubicMiddle(
    value_by_values=0.5,
    value_by_slopes=0.125,
    slope_by_values=1.5,
    slope_by_slopes=0.25,
)
NEAR_CHORD = (
    2e-7  # m: from the depth at which a chord begins, within which it may begin
)


@inlined
def _find_teeth(group, lane, newest, work, near):
    """Store table rows and gap offsets of the pairs of one lane, the newest first."""
    n = width(work)
    # the rows of this lane
    indices, counts, rows = group.indices[lane::n], near[lane::n], work[lane::n]
    n_pinion, n_wheel = indices[layout.PINION_TEETH], indices[layout.WHEEL_TEETH]
    start, stride = indices[layout.TABLE], indices[layout.STRIDE]
    wheel_rows = indices[layout.WHEEL_ROWS]
    for k in range(indices[layout.FOLLOWED]):
        index = newest - k
        tooth_p = (index + indices[layout.START_PINION]) % n_pinion
        tooth_w = (index + indices[layout.START_WHEEL]) % n_wheel
        tooth_p += indices[layout.PINION_TOOTH]
        tooth_w += indices[layout.WHEEL_TOOTH]
        row_p, row_w = group.tooth_row[tooth_p], group.tooth_row[tooth_w]
        pinion, wheel = row_p * indices[layout.PINION_ROWS] + row_w, -1
        if wheel_rows > 0:
            pinion, wheel = row_p, start + (wheel_rows + row_w) * stride
        counts[AT_PINION + k] = start + pinion * stride
        if row_p < 0 or row_w < 0:
            counts[AT_PINION + k] = -1
        counts[AT_WHEEL + k] = wheel
        counts[CHORD + k] = 0
        rows[ERROR + k] = group.tooth_error[tooth_p] + group.tooth_error[tooth_w]
        rows[TILT + k] = group.tooth_tilt[tooth_p] + group.tooth_tilt[tooth_w]
    for k in range(indices[layout.FOLLOWED], followed(group)):
        counts[AT_PINION + k] = -1


@compiled
def gather(group, slot, renew, work, wide, near):
    """Read the tables at the rolls of a slot; true if a newest pair or a chord has changed.

    Pairs are in fixed order, the newest first. ``renew`` looks for the newest pair, and chooses
    the chords in the lanes that ``FLAGS`` marks; otherwise these stay, and only such lanes are
    read. The first
    span of a slot holds the pairs that were read in any lane; rows outside of it are stale. The
    second holds those that come near their mates: the others carry nothing.
    """
    n = width(work)
    exact, n_pairs = group.exact, followed(group)
    changed = False
    first, last, near_first, near_last = MOST_PAIRS, 0, MOST_PAIRS, 0
    for lane in range(n):
        is_marked = work[at(layout.FLAGS, lane, n)] > 0.0
        if not (renew or is_marked):
            continue
        roll = wide[at(layout.ROLL + slot, lane, n)]
        pitch = exact[at(layout.PITCH, lane, n)]
        nodes = exact[at(layout.NODES_PER_METER, lane, n)]
        if renew:
            newest = int(np.floor(roll * exact[at(layout.PER_PITCH, lane, n)]))
            newest = newest - group.indices[at(layout.FIRST_PITCH, lane, n)]
            if newest != near[at(NEWEST, lane, n)]:
                near[at(NEWEST, lane, n)] = newest
                changed = True
                _find_teeth(group, lane, newest, work, near)
        lowest = exact[at(layout.FIRST_NEAR, lane, n)]
        highest = exact[at(layout.LAST_NEAR, lane, n)]
        last_cell = group.indices[at(layout.LAST_CELL, lane, n)]
        within = work[at(layout.WITHIN, lane, n)]
        start = exact[at(layout.TABLE_START, lane, n)]
        position = roll - near[at(NEWEST, lane, n)] * pitch
        for k in range(n_pairs):
            raw = raw_index(RAW, k, lane, n)
            pinion = near[at(AT_PINION + k, lane, n)]
            reached = lowest <= position <= highest or within >= layout.FAR_NEAR
            if pinion >= 0 and reached:
                x = (position - start) * nodes
                cell = min(max(int(x), 0), last_cell)
                part, row = x - cell, cell * COLUMNS
                if is_helical(group):
                    if renew and is_marked:
                        p, ahead = pinion + row, work[at(AHEAD + slot, lane, n)]
                        other = _choose(
                            group, lane, k, p, part, position, ahead, work, near
                        )
                        changed = other or changed
                    stride = group.indices[at(layout.CHORD_STRIDE, lane, n)]
                    pinion += near[at(CHORD + k, lane, n)] * stride
                p, wheel = pinion + row, near[at(AT_WHEEL + k, lane, n)]
                if wheel >= 0:
                    wheel += row
                store(work, raw, _read(group, group.table, lane, p, wheel, part))
                if is_helical(group):
                    chord = _read(group, group.chord_table, lane, p, wheel, part)
                    store(work, raw_index(RAW_CHORD, k, lane, n), chord)
                first, last = min(first, k), max(last, k + 1)
                offset = _offset(group, lane, k, position, work)
                if work[raw + GAP] + work[at(ERROR + k, lane, n)] + offset < within:
                    near_first, near_last = min(near_first, k), max(near_last, k + 1)
            else:
                work[raw + COMPLIANCE], work[raw + COMPLIANCE_SLOPE] = YIELDING, 0.0
                work[raw + GAP], work[raw + GAP_SLOPE] = FAR, 0.0
            work[at(pair_rows(slot, k) + POSITION, lane, n)] = position
            position += pitch
    span = span_index(slot, n)
    near[span + layout.FIRST_READ], near[span + layout.LAST_READ] = first, last
    near[span + layout.FIRST_NEAR_PAIR] = near_first
    near[span + layout.LAST_NEAR_PAIR] = near_last
    for k in range(first, last):
        pair = pair_rows(slot, k)
        _spread_rows(group, RAW, k, pair, pair + POSITION, work)
        for lane in range(0, n, FOUR):
            compliance = load_four(work, at(pair + COMPLIANCE, lane, n))
            shared = load_four(group.numbers, at(layout.SHARED, lane, n))
            compliance = compliance - shared
            store(work, at(pair + COMPLIANCE, lane, n), compliance)
            store(work, at(pair + STIFFNESS, lane, n), 1.0 / compliance)
        if is_helical(group):
            chord = chord_rows(slot, k)
            _spread_rows(group, RAW_CHORD, k, chord, pair + POSITION, work)
    return changed


@inlined
def _read(group, table, lane, p, wheel, part):
    """Values between two nodes, from table index ``p`` on; ``wheel``, if not negative, is added."""
    low, high = load_four(table, p), load_four(table, p + COLUMNS)
    if wheel >= 0:
        low = low + load_four(table, wheel)
        high = high + load_four(table, wheel + COLUMNS)
    return _bent(group, lane, low, high, part)


@written
def _bent(group, lane, low, high, part):
    """Table values between two nodes, bent as their slopes say."""
    step = high - low
    bent = (part * (1.0 - part)) * load_four(group.bend, lane * COLUMNS)
    return low + part * step - bent * second_and_fourth(step)


@inlined
def _offset(group, lane, k, position, work):
    """Gap of a pair at a position that the tilts of its teeth add."""
    n = width(work)
    beyond = position - group.numbers[at(layout.MIDDLE_POINT, lane, n)]
    return work[at(TILT + k, lane, n)] * beyond


@inlined
def _choose(group, lane, k, p, part, position, ahead, work, near):
    """Set the chord of a pair from its penetration; true if it is another than before.

    The penetration is into what the other pairs deflect, in the middle of the step at whose end
    the tables are read, ``ahead`` m of roll after its begin. ``p`` is the table index of the cell.
    Between nodes chords meet a little off their depths: near these the lower one holds up to where
    their forces are equal, so that the force has no step.
    """
    n, n_chords = width(work), group.n_chords
    bite, chord, first = (
        _bite(group, lane, k, p, part, position, ahead, work),
        0,
        lane * n_chords,
    )
    while chord + 1 < n_chords and bite > group.depth[first + chord + 1]:
        chord += 1
    upper = 0
    if chord + 1 < n_chords and group.depth[first + chord + 1] - bite < NEAR_CHORD:
        upper = chord + 1
    elif chord > 0 and bite - group.depth[first + chord] < NEAR_CHORD:
        upper = chord
    if upper > 0:
        stride = group.indices[at(layout.CHORD_STRIDE, lane, n)]
        p_upper = p + upper * stride
        p_lower = p_upper - stride
        deep = _bite(group, lane, k, p_upper, part, position, ahead, work)
        shallow = _bite(group, lane, k, p_lower, part, position, ahead, work)
        soft = _own_compliance(group, lane, p_upper, part, ahead, work)
        softer = _own_compliance(group, lane, p_lower, part, ahead, work)
        chord = upper
        if (deep * softer - shallow * soft) * (softer - soft) < 0.0:
            chord = upper - 1
    before = near[at(CHORD + k, lane, n)]
    near[at(CHORD + k, lane, n)] = chord
    return chord != before


@inlined
def _bite(group, lane, k, p, part, position, ahead, work):
    """Penetration of a pair by the gap of a chord, half of ``ahead`` before a position, m."""
    n = width(work)
    offset = work[at(ERROR + k, lane, n)] + _offset(group, lane, k, position, work)
    gap = _before(group, lane, p + GAP, part, ahead) + offset
    gap = gap - 0.5 * ahead * work[at(TILT + k, lane, n)]
    return work[at(layout.LOCAL, lane, n)] - gap


@inlined
def _own_compliance(group, lane, p, part, ahead, work):
    """Compliance of a pair by a chord without what pairs share, half of ``ahead`` before, m/N."""
    shared = group.numbers[at(layout.SHARED, lane, width(work))]
    return _before(group, lane, p + COMPLIANCE, part, ahead) - shared


@inlined
def _before(group, lane, p, part, ahead):
    """Value of a column with a slope, between two nodes and half of ``ahead`` before."""
    low, slope = group.table[p], group.table[p + 1]
    step, step_slope = (
        group.table[p + COLUMNS] - low,
        group.table[p + COLUMNS + 1] - slope,
    )
    bend = part * (1.0 - part) * group.bend[lane * COLUMNS + GAP]
    value = low + part * step - bend * step_slope
    return value - 0.5 * ahead * (slope + part * step_slope)


@written
def _spread_rows(group, block, k, target, position, work):
    """Write what was read lane by lane to four rows from ``target`` on.

    The last two rows are a gap and its slope, to which error and tilt of the teeth are added.
    """
    n = width(work)
    for lane in range(0, n, FOUR):
        raw = raw_index(block, k, lane, n)
        value, slope, gap, gap_slope = transpose(
            load_four(work, raw),
            load_four(work, raw + FOUR),
            load_four(work, raw + 2 * FOUR),
            load_four(work, raw + 3 * FOUR),
        )
        tilt = load_four(work, at(TILT + k, lane, n))
        error = load_four(work, at(ERROR + k, lane, n))
        middle = load_four(group.numbers, at(layout.MIDDLE_POINT, lane, n))
        beyond = load_four(work, at(position, lane, n)) - middle
        store(work, at(target, lane, n), value)
        store(work, at(target + 1, lane, n), slope)
        store(work, at(target + 2, lane, n), gap + error + tilt * beyond)
        store(work, at(target + 3, lane, n), gap_slope + tilt)


@inlined
def cover(slot, first, last, work, near):
    """Make the rows of a slot valid for the pairs ``first`` to ``last``.

    Pairs that were not read are absent.
    """
    span, zero = span_index(slot, width(work)), spread(work, 0.0)
    for k in range(first, last):
        if not near[span + layout.FIRST_READ] <= k < near[span + layout.LAST_READ]:
            pair = pair_rows(slot, k)
            set_row(work, pair + COMPLIANCE, spread(work, YIELDING))
            set_row(work, pair + COMPLIANCE_SLOPE, zero)
            set_row(work, pair + GAP, spread(work, FAR))
            set_row(work, pair + GAP_SLOPE, zero)
            set_row(work, pair + STIFFNESS, zero)


@written
def _cubic_middle(p, q, m, distance, work):
    """Set value and slope at row ``m`` half-way between rows ``p`` and ``q``, from the cubic.

    Returns the values at both ends and in the middle. The slope is such that Simpson's rule over
    the slopes gives the growth of the value, with or without kinks between.
    """
    bend = CUBIC_MIDDLE.value_by_slopes * distance
    growth = CUBIC_MIDDLE.slope_by_values / distance
    before, after = get_row(work, p), get_row(work, q)
    slope_p, slope_q = get_row(work, p + 1), get_row(work, q + 1)
    middle = CUBIC_MIDDLE.value_by_values * (before + after)
    middle = middle + bend * (slope_p - slope_q)
    set_row(work, m, middle)
    slope = CUBIC_MIDDLE.slope_by_slopes * (slope_p + slope_q)
    set_row(work, m + 1, growth * (after - before) - slope)
    return before, after, middle


@written
def between(a, b, middle, first, last, work):
    """Fill the slot half-way between two: cubic in gap and compliance.

    No gap is smaller there than at both ends, so that pairs that come near at neither end may be
    left out.
    """
    begin, end = get_row(work, AHEAD + a), get_row(work, AHEAD + b)
    set_row(work, AHEAD + middle, 0.5 * (begin + end))

    def fill(k):
        p, q, m = pair_rows(a, k), pair_rows(b, k), pair_rows(middle, k)
        for value in (COMPLIANCE, GAP):
            before, after, mean = _cubic_middle(
                p + value, q + value, m + value, end - begin, work
            )
            least = where_above(before, after, after, before)
            set_row(work, m + value, where_above(mean, least, mean, least))
        set_row(work, m + STIFFNESS, 1.0 / get_row(work, m + COMPLIANCE))
        position = get_row(work, p + POSITION) + get_row(work, q + POSITION)
        set_row(work, m + POSITION, 0.5 * position)
        return ()

    fold(first, last, fill, ())


@written
def chords_between(a, b, middle, first, last, work):
    """Fill the rows of chords in the slot half-way between two."""
    distance = get_row(work, AHEAD + b) - get_row(work, AHEAD + a)

    def fill(k):
        p, q, m = chord_rows(a, k), chord_rows(b, k), chord_rows(middle, k)
        for value in (layout.LEFT_OUT, layout.TOUCH):
            _cubic_middle(p + value, q + value, m + value, distance, work)
        return ()

    fold(first, last, fill, ())
