"""Compiled core: reading the tables of the gear mesh, several records side by side."""

from __future__ import annotations

import numpy as np

from gensig.dynamics._layout import (
    AHEAD,
    AT_PINION,
    AT_WHEEL,
    CHORD,
    CHORD_STRIDE,
    COLUMNS,
    ERROR,
    FAR,
    FAR_NEAR,
    FIRST_NEAR,
    FIRST_NEAR_PAIR,
    FIRST_PITCH,
    FIRST_READ,
    FLAGS,
    FOLLOWED,
    GAP,
    GAP_SLOPE,
    LAST_CELL,
    LAST_NEAR,
    LAST_NEAR_PAIR,
    LAST_READ,
    LEFT_OUT,
    LEFT_OUT_SLOPE,
    LOCAL,
    MIDDLE_POINT,
    MOST_PAIRS,
    NEWEST,
    NODES_PER_METER,
    OWN,
    OWN_SLOPE,
    PER_PITCH,
    PINION_ROWS,
    PINION_TEETH,
    PINION_TOOTH,
    PITCH,
    POSITION,
    RAW,
    RAW_BESIDE,
    ROLL,
    SHARED,
    START_PINION,
    START_WHEEL,
    STIFFNESS,
    STRIDE,
    TABLE,
    TABLE_START,
    TILT,
    TOUCH,
    TOUCH_SLOPE,
    WHEEL_ROWS,
    WHEEL_TEETH,
    WHEEL_TOOTH,
    WITHIN,
    YIELDING,
    chord_rows,
    followed,
    is_helical,
    pair_rows,
    raw_place,
    span_place,
)  # fmt: skip
from gensig.dynamics._tableau import CUBIC_MIDDLE
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


@inlined
def _meet(group, lane, newest, work, near):
    """Remember the table rows and the gap offsets of the pairs of one lane, the newest first."""
    n = width(work)
    places = group.places
    n_pinion, n_wheel = (
        places[at(PINION_TEETH, lane, n)],
        places[at(WHEEL_TEETH, lane, n)],
    )
    first_p, first_w = (
        places[at(PINION_TOOTH, lane, n)],
        places[at(WHEEL_TOOTH, lane, n)],
    )
    start, stride = places[at(TABLE, lane, n)], places[at(STRIDE, lane, n)]
    tooth_p = (newest + places[at(START_PINION, lane, n)]) % n_pinion
    tooth_w = (newest + places[at(START_WHEEL, lane, n)]) % n_wheel
    for k in range(places[at(FOLLOWED, lane, n)]):
        row_p, row_w = (
            group.tooth_row[first_p + tooth_p],
            group.tooth_row[first_w + tooth_w],
        )
        there = row_p >= 0 and row_w >= 0
        pinion, wheel = row_p * places[at(PINION_ROWS, lane, n)] + row_w, -1
        if places[at(WHEEL_ROWS, lane, n)] > 0:
            pinion, wheel = (
                row_p,
                start + (places[at(WHEEL_ROWS, lane, n)] + row_w) * stride,
            )
        near[at(AT_PINION + k, lane, n)] = start + pinion * stride if there else -1
        near[at(AT_WHEEL + k, lane, n)] = wheel
        near[at(CHORD + k, lane, n)] = 0
        work[at(ERROR + k, lane, n)] = (
            group.tooth_error[first_p + tooth_p] + group.tooth_error[first_w + tooth_w]
        )
        work[at(TILT + k, lane, n)] = (
            group.tooth_tilt[first_p + tooth_p] + group.tooth_tilt[first_w + tooth_w]
        )
        tooth_p = tooth_p - 1 if tooth_p > 0 else n_pinion - 1
        tooth_w = tooth_w - 1 if tooth_w > 0 else n_wheel - 1


@compiled
def gather(group, slot, renew, work, wide, near):
    """Read the tables at the rolls of a slot; returns whether a newest pair or a chord is another
    than before.

    Pairs keep their place, the newest first. ``renew`` looks who is newest and how deep they
    bite; otherwise that stays, and only the lanes that ``FLAGS`` marks are read. The first span
    of a slot holds the pairs that were read in any lane; rows outside of it are stale. The second
    holds those that come near their mates: the others carry nothing.
    """
    n = width(work)
    exact, n_pairs = group.exact, followed(group)
    changed = False
    first, last, near_first, near_last = MOST_PAIRS, 0, MOST_PAIRS, 0
    for lane in range(n):
        if not renew and work[at(FLAGS, lane, n)] == 0.0:
            continue
        roll = wide[at(ROLL + slot, lane, n)]
        pitch, nodes = exact[at(PITCH, lane, n)], exact[at(NODES_PER_METER, lane, n)]
        if renew:
            newest = (
                int(np.floor(roll * exact[at(PER_PITCH, lane, n)]))
                - group.places[at(FIRST_PITCH, lane, n)]
            )
            if newest != near[at(NEWEST, lane, n)]:
                near[at(NEWEST, lane, n)] = newest
                changed = True
                _meet(group, lane, newest, work, near)
        lowest, highest = exact[at(FIRST_NEAR, lane, n)], exact[at(LAST_NEAR, lane, n)]
        last_cell, within = (
            group.places[at(LAST_CELL, lane, n)],
            work[at(WITHIN, lane, n)],
        )
        start = exact[at(TABLE_START, lane, n)]
        position = roll - near[at(NEWEST, lane, n)] * pitch
        for k in range(n_pairs):
            here = raw_place(RAW, k, lane, n)
            pinion = near[at(AT_PINION + k, lane, n)]
            if pinion >= 0 and (lowest <= position <= highest or within >= FAR_NEAR):
                x = (position - start) * nodes
                cell = min(max(int(x), 0), last_cell)
                if is_helical(group):
                    if renew:
                        changed = (
                            _choose(
                                group,
                                lane,
                                k,
                                pinion,
                                cell,
                                x - cell,
                                position,
                                work,
                                near,
                            )
                            or changed
                        )
                    pinion += (
                        near[at(CHORD + k, lane, n)]
                        * group.places[at(CHORD_STRIDE, lane, n)]
                    )
                    _read_beside(
                        group, lane, k, pinion + cell * COLUMNS, x - cell, work
                    )
                p, wheel = pinion + cell * COLUMNS, near[at(AT_WHEEL + k, lane, n)]
                low, high = (
                    load_four(group.table, p),
                    load_four(group.table, p + COLUMNS),
                )
                if wheel >= 0:
                    w = wheel + cell * COLUMNS
                    low, high = (
                        low + load_four(group.table, w),
                        high + load_four(group.table, w + COLUMNS),
                    )
                step, part = high - low, x - cell
                bent = (part * (1.0 - part)) * load_four(group.bend, lane * COLUMNS)
                store(work, here, low + part * step - bent * second_and_fourth(step))
                first, last = min(first, k), max(last, k + 1)
                tilted = work[at(TILT + k, lane, n)] * (
                    position - group.numbers[at(MIDDLE_POINT, lane, n)]
                )
                if work[here + GAP] + work[at(ERROR + k, lane, n)] + tilted < within:
                    near_first, near_last = min(near_first, k), max(near_last, k + 1)
            else:
                work[here + OWN], work[here + OWN_SLOPE] = YIELDING, 0.0
                work[here + GAP], work[here + GAP_SLOPE] = FAR, 0.0
            work[at(pair_rows(slot, k) + POSITION, lane, n)] = position
            position += pitch
    span = span_place(slot, n)
    near[span + FIRST_READ], near[span + LAST_READ] = first, last
    near[span + FIRST_NEAR_PAIR], near[span + LAST_NEAR_PAIR] = near_first, near_last
    for k in range(first, last):
        _spread_rows(group, slot, k, work)
        if is_helical(group):
            _spread_beside(group, slot, k, work)
    return changed


@inlined
def _choose(group, lane, k, pair, cell, part, position, work, near):
    """Take the chord of how deep a pair bites into what the others deflect.

    Whether it is another than before.
    """
    n = width(work)
    p = pair + cell * COLUMNS
    step = group.table[p + COLUMNS + GAP] - group.table[p + GAP]
    step_slope = group.table[p + COLUMNS + GAP_SLOPE] - group.table[p + GAP_SLOPE]
    gap = (
        group.table[p + GAP]
        + part * step
        - part * (1.0 - part) * group.bend[lane * COLUMNS + GAP] * step_slope
    )
    tilted = work[at(TILT + k, lane, n)] * (
        position - group.numbers[at(MIDDLE_POINT, lane, n)]
    )
    bite = work[at(LOCAL, lane, n)] - (gap + work[at(ERROR + k, lane, n)] + tilted)
    chord = 0
    while (
        chord + 1 < group.n_chords
        and bite > group.depth[lane * group.n_chords + chord + 1]
    ):
        chord += 1
    before = near[at(CHORD + k, lane, n)]
    near[at(CHORD + k, lane, n)] = chord
    return chord != before


@inlined
def _read_beside(group, lane, k, p, part, work):
    """What stands beside the table, as the table is read."""
    low, high = load_four(group.beside, p), load_four(group.beside, p + COLUMNS)
    step = high - low
    bent = (part * (1.0 - part)) * load_four(group.bend, lane * COLUMNS)
    here = raw_place(RAW_BESIDE, k, lane, width(work))
    store(work, here, low + part * step - bent * second_and_fourth(step))


@inlined
def _columns(work, block, pair, lane):
    """What was read of a pair for the four records from ``lane`` on, column by column."""
    here = raw_place(block, pair, lane, width(work))
    return transpose(
        load_four(work, here),
        load_four(work, here + FOUR),
        load_four(work, here + 2 * FOUR),
        load_four(work, here + 3 * FOUR),
    )


@inlined
def _spread_rows(group, slot, k, work):
    """Write what was read lane by lane to the rows of the slot."""
    n, pair = width(work), pair_rows(slot, k)
    for lane in range(0, n, FOUR):
        own, own_slope, gap, gap_slope = _columns(work, RAW, k, lane)
        own = own - load_four(group.numbers, at(SHARED, lane, n))
        store(work, at(pair + OWN, lane, n), own)
        store(work, at(pair + OWN_SLOPE, lane, n), own_slope)
        tilt, error = (
            load_four(work, at(TILT + k, lane, n)),
            load_four(work, at(ERROR + k, lane, n)),
        )
        position = load_four(work, at(pair + POSITION, lane, n))
        beyond = position - load_four(group.numbers, at(MIDDLE_POINT, lane, n))
        store(work, at(pair + GAP, lane, n), gap + error + tilt * beyond)
        store(work, at(pair + GAP_SLOPE, lane, n), gap_slope + tilt)
        store(work, at(pair + STIFFNESS, lane, n), 1.0 / own)


@inlined
def _spread_beside(group, slot, k, work):
    """Write what was read beside the table lane by lane to the rows of the slot."""
    n, pair, chord = width(work), pair_rows(slot, k), chord_rows(slot, k)
    for lane in range(0, n, FOUR):
        energy, energy_slope, touch, touch_slope = _columns(work, RAW_BESIDE, k, lane)
        tilt, error = (
            load_four(work, at(TILT + k, lane, n)),
            load_four(work, at(ERROR + k, lane, n)),
        )
        position = load_four(work, at(pair + POSITION, lane, n))
        beyond = position - load_four(group.numbers, at(MIDDLE_POINT, lane, n))
        store(work, at(chord + LEFT_OUT, lane, n), energy)
        store(work, at(chord + LEFT_OUT_SLOPE, lane, n), energy_slope)
        store(work, at(chord + TOUCH, lane, n), touch + error + tilt * beyond)
        store(work, at(chord + TOUCH_SLOPE, lane, n), touch_slope + tilt)


@inlined
def cover(slot, first, last, work, near):
    """Make the rows of a slot valid for the pairs ``first`` to ``last``.

    Pairs that were not read are absent.
    """
    span = span_place(slot, width(work))
    for k in range(first, last):
        if not near[span + FIRST_READ] <= k < near[span + LAST_READ]:
            _nobody(slot, k, work)


@inlined
def _nobody(slot, k, work):
    """Write the rows of an absent pair."""
    pair, zero = pair_rows(slot, k), spread(work, 0.0)
    set_row(work, pair + OWN, spread(work, YIELDING))
    set_row(work, pair + OWN_SLOPE, zero)
    set_row(work, pair + GAP, spread(work, FAR))
    set_row(work, pair + GAP_SLOPE, zero)
    set_row(work, pair + STIFFNESS, zero)


@inlined
def between(a, b, middle, first, last, work):
    """Fill the slot half-way between two: cubic in gap and compliance, from values and slopes at
    both ends.

    Its slopes are such that Simpson's rule over them gives what the values grow by, kinks between
    or not. No gap is smaller there than at both ends, so that pairs that come near at neither may
    be left out.
    """
    begin, end = get_row(work, AHEAD + a), get_row(work, AHEAD + b)
    bend = CUBIC_MIDDLE.value_by_slopes * (end - begin)
    growth = CUBIC_MIDDLE.slope_by_values / (end - begin)
    set_row(work, AHEAD + middle, 0.5 * (begin + end))
    for k in range(first, last):
        p, q, m = pair_rows(a, k), pair_rows(b, k), pair_rows(middle, k)
        for value, slope in ((OWN, OWN_SLOPE), (GAP, GAP_SLOPE)):
            before, after = get_row(work, p + value), get_row(work, q + value)
            slope_p, slope_q = get_row(work, p + slope), get_row(work, q + slope)
            mean = CUBIC_MIDDLE.value_by_values * (before + after) + bend * (
                slope_p - slope_q
            )
            least = where_above(before, after, after, before)
            set_row(work, m + value, where_above(mean, least, mean, least))
            set_row(
                work,
                m + slope,
                growth * (after - before)
                - CUBIC_MIDDLE.slope_by_slopes * (slope_p + slope_q),
            )
        set_row(work, m + STIFFNESS, 1.0 / get_row(work, m + OWN))
        set_row(
            work,
            m + POSITION,
            0.5 * (get_row(work, p + POSITION) + get_row(work, q + POSITION)),
        )


@inlined
def beside_between(a, b, middle, first, last, work):
    """Fill what stands beside the tables of chords in the slot half-way between two."""
    begin, end = get_row(work, AHEAD + a), get_row(work, AHEAD + b)
    bend = CUBIC_MIDDLE.value_by_slopes * (end - begin)
    growth = CUBIC_MIDDLE.slope_by_values / (end - begin)
    for k in range(first, last):
        p, q, m = chord_rows(a, k), chord_rows(b, k), chord_rows(middle, k)
        for value, slope in ((LEFT_OUT, LEFT_OUT_SLOPE), (TOUCH, TOUCH_SLOPE)):
            before, after = get_row(work, p + value), get_row(work, q + value)
            slope_p, slope_q = get_row(work, p + slope), get_row(work, q + slope)
            mean = CUBIC_MIDDLE.value_by_values * (before + after) + bend * (
                slope_p - slope_q
            )
            set_row(work, m + value, mean)
            set_row(
                work,
                m + slope,
                growth * (after - before)
                - CUBIC_MIDDLE.slope_by_slopes * (slope_p + slope_q),
            )
