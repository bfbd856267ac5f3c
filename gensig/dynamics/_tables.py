"""Compiled core: reading the tables of the gear mesh, several records side by side."""

from __future__ import annotations

import numpy as np

from gensig.dynamics._layout import (
    AHEAD,
    AT_PINION,
    AT_WHEEL,
    BESIDE,
    BESIDE_ROWS,
    CHORD,
    CHORD_STRIDE,
    COLUMNS,
    ERROR,
    FAR,
    FAR_NEAR,
    FIRST_NEAR,
    FIRST_PITCH,
    FLAGS,
    FOLLOWED,
    GAP,
    GAP_SLOPE,
    LAST_CELL,
    LAST_NEAR,
    LEFT_OUT,
    LEFT_OUT_SLOPE,
    LOCAL,
    MIDDLE_POINT,
    MOST_PAIRS,
    N_KEPT,
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
    SLOT_ROWS,
    SPAN,
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
    followed,
    is_helical,
)  # fmt: skip
from gensig.dynamics._vector import (
    FOUR,
    compiled,
    inlined,
    load,
    load_four,
    second_and_fourth,
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
    n_pinion, n_wheel = places[PINION_TEETH * n + lane], places[WHEEL_TEETH * n + lane]
    first_p, first_w = places[PINION_TOOTH * n + lane], places[WHEEL_TOOTH * n + lane]
    start, stride = places[TABLE * n + lane], places[STRIDE * n + lane]
    tooth_p = (newest + places[START_PINION * n + lane]) % n_pinion
    tooth_w = (newest + places[START_WHEEL * n + lane]) % n_wheel
    for k in range(places[FOLLOWED * n + lane]):
        row_p, row_w = group.tooth_row[first_p + tooth_p], group.tooth_row[first_w + tooth_w]
        there = row_p >= 0 and row_w >= 0
        pinion, wheel = row_p * places[PINION_ROWS * n + lane] + row_w, -1
        if places[WHEEL_ROWS * n + lane] > 0:
            pinion, wheel = row_p, start + (places[WHEEL_ROWS * n + lane] + row_w) * stride
        near[(AT_PINION + k) * n + lane] = start + pinion * stride if there else -1
        near[(AT_WHEEL + k) * n + lane] = wheel
        near[(CHORD + k) * n + lane] = 0
        work[(ERROR + k) * n + lane] = group.tooth_error[first_p + tooth_p] + group.tooth_error[first_w + tooth_w]
        work[(TILT + k) * n + lane] = group.tooth_tilt[first_p + tooth_p] + group.tooth_tilt[first_w + tooth_w]
        tooth_p = tooth_p - 1 if tooth_p > 0 else n_pinion - 1
        tooth_w = tooth_w - 1 if tooth_w > 0 else n_wheel - 1


@compiled
def gather(group, slot, renew, work, wide, near):
    """Read the tables at the rolls of a slot; returns whether a newest pair or a chord is another than before.

    Pairs keep their place, the newest first. ``renew`` looks who is newest and how deep they bite; otherwise that
    stays, and only the lanes that ``FLAGS`` marks are read. The first span of a slot holds the pairs that were read in
    any lane; rows outside of it are stale. The second holds those that come near their mates: the others carry nothing.
    """
    n = width(work)
    exact, n_pairs = group.exact, followed(group)
    changed = False
    first, last, near_first, near_last = MOST_PAIRS, 0, MOST_PAIRS, 0
    for lane in range(n):
        if not renew and work[FLAGS * n + lane] == 0.0:
            continue
        roll = wide[(ROLL + slot) * n + lane]
        pitch, nodes = exact[PITCH * n + lane], exact[NODES_PER_METER * n + lane]
        if renew:
            newest = int(np.floor(roll * exact[PER_PITCH * n + lane])) - group.places[FIRST_PITCH * n + lane]
            if newest != near[NEWEST * n + lane]:
                near[NEWEST * n + lane] = newest
                changed = True
                _meet(group, lane, newest, work, near)
        lowest, highest = exact[FIRST_NEAR * n + lane], exact[LAST_NEAR * n + lane]
        last_cell, within = group.places[LAST_CELL * n + lane], work[WITHIN * n + lane]
        start = exact[TABLE_START * n + lane]
        position = roll - near[NEWEST * n + lane] * pitch
        for k in range(n_pairs):
            here = RAW * n + (k * n + lane) * COLUMNS
            pinion = near[(AT_PINION + k) * n + lane]
            if pinion >= 0 and (lowest <= position <= highest or within >= FAR_NEAR):
                x = (position - start) * nodes
                cell = min(max(int(x), 0), last_cell)
                if is_helical(group):
                    if renew:
                        changed = _choose(group, lane, k, pinion, cell, x - cell, position, work, near) or changed
                    pinion += near[(CHORD + k) * n + lane] * group.places[CHORD_STRIDE * n + lane]
                    _read_beside(group, lane, k, pinion + cell * COLUMNS, x - cell, work)
                p, wheel = pinion + cell * COLUMNS, near[(AT_WHEEL + k) * n + lane]
                low, high = load_four(group.table, p), load_four(group.table, p + COLUMNS)
                if wheel >= 0:
                    w = wheel + cell * COLUMNS
                    low, high = low + load_four(group.table, w), high + load_four(group.table, w + COLUMNS)
                step, part = high - low, x - cell
                bent = (part * (1.0 - part)) * load_four(group.bend, lane * COLUMNS)
                store(work, here, low + part * step - bent * second_and_fourth(step))
                first, last = min(first, k), max(last, k + 1)
                tilted = work[(TILT + k) * n + lane] * (position - group.numbers[MIDDLE_POINT * n + lane])
                if work[here + GAP] + work[(ERROR + k) * n + lane] + tilted < within:
                    near_first, near_last = min(near_first, k), max(near_last, k + 1)
            else:
                work[here + OWN], work[here + OWN_SLOPE] = YIELDING, 0.0
                work[here + GAP], work[here + GAP_SLOPE] = FAR, 0.0
            work[(slot * SLOT_ROWS + k * N_KEPT + POSITION) * n + lane] = position
            position += pitch
    span = SPAN * n + 4 * slot
    near[span], near[span + 1], near[span + 2], near[span + 3] = first, last, near_first, near_last
    for k in range(first, last):
        _spread_rows(group, slot, k, work)
        if is_helical(group):
            _spread_beside(group, slot, k, work)
    return changed


@inlined
def _choose(group, lane, k, pair, cell, part, position, work, near):
    """Take the chord of how deep a pair bites into what the others deflect; whether it is another than before."""
    n = width(work)
    p = pair + cell * COLUMNS
    step, step_slope = group.table[p + COLUMNS + GAP] - group.table[p + GAP], 0.0
    step_slope = group.table[p + COLUMNS + GAP_SLOPE] - group.table[p + GAP_SLOPE]
    gap = group.table[p + GAP] + part * step - part * (1.0 - part) * group.bend[lane * COLUMNS + GAP] * step_slope
    tilted = work[(TILT + k) * n + lane] * (position - group.numbers[MIDDLE_POINT * n + lane])
    bite = work[LOCAL * n + lane] - (gap + work[(ERROR + k) * n + lane] + tilted)
    chord = 0
    while chord + 1 < group.n_chords and bite > group.depth[lane * group.n_chords + chord + 1]:
        chord += 1
    before = near[(CHORD + k) * n + lane]
    near[(CHORD + k) * n + lane] = chord
    return chord != before


@inlined
def _read_beside(group, lane, k, p, part, work):
    """What stands beside the table, as the table is read."""
    low, high = load_four(group.beside, p), load_four(group.beside, p + COLUMNS)
    step = high - low
    bent = (part * (1.0 - part)) * load_four(group.bend, lane * COLUMNS)
    n = width(work)
    store(work, RAW_BESIDE * n + (k * n + lane) * COLUMNS, low + part * step - bent * second_and_fourth(step))


@inlined
def _spread_rows(group, slot, k, work):
    """What was read lane by lane as rows of the slot."""
    n = width(work)
    pair = (slot * SLOT_ROWS + k * N_KEPT) * n
    for lane in range(0, n, FOUR):
        here = RAW * n + (k * n + lane) * COLUMNS
        own, own_slope, gap, gap_slope = transpose(
            load_four(work, here), load_four(work, here + FOUR), load_four(work, here + 2 * FOUR),
            load_four(work, here + 3 * FOUR),
        )  # fmt: skip
        own = own - load_four(group.numbers, SHARED * n + lane)
        store(work, pair + OWN * n + lane, own)
        store(work, pair + OWN_SLOPE * n + lane, own_slope)
        tilt = load_four(work, (TILT + k) * n + lane)
        beyond = load_four(work, pair + POSITION * n + lane) - load_four(group.numbers, MIDDLE_POINT * n + lane)
        store(work, pair + GAP * n + lane, gap + load_four(work, (ERROR + k) * n + lane) + tilt * beyond)
        store(work, pair + GAP_SLOPE * n + lane, gap_slope + tilt)
        store(work, pair + STIFFNESS * n + lane, 1.0 / own)


@inlined
def _spread_beside(group, slot, k, work):
    """The same for what stands beside the table."""
    n = width(work)
    row, pair = (BESIDE + slot * BESIDE_ROWS + k * COLUMNS) * n, (slot * SLOT_ROWS + k * N_KEPT) * n
    for lane in range(0, n, FOUR):
        here = RAW_BESIDE * n + (k * n + lane) * COLUMNS
        energy, energy_slope, touch, touch_slope = transpose(
            load_four(work, here), load_four(work, here + FOUR), load_four(work, here + 2 * FOUR),
            load_four(work, here + 3 * FOUR),
        )  # fmt: skip
        tilt = load_four(work, (TILT + k) * n + lane)
        beyond = load_four(work, pair + POSITION * n + lane) - load_four(group.numbers, MIDDLE_POINT * n + lane)
        store(work, row + LEFT_OUT * n + lane, energy)
        store(work, row + LEFT_OUT_SLOPE * n + lane, energy_slope)
        store(work, row + TOUCH * n + lane, touch + load_four(work, (ERROR + k) * n + lane) + tilt * beyond)
        store(work, row + TOUCH_SLOPE * n + lane, touch_slope + tilt)


@inlined
def cover(slot, first, last, work, near):
    """Make the rows of a slot good for the pairs ``first`` to ``last`` too: there is nobody where none was read."""
    span = SPAN * width(work) + 4 * slot
    for k in range(first, last):
        if not near[span] <= k < near[span + 1]:
            _nobody(slot, k, work)


@inlined
def _nobody(slot, k, work):
    n = width(work)
    pair = (slot * SLOT_ROWS + k * N_KEPT) * n
    zero = spread(work, 0.0)
    store(work, pair + OWN * n, spread(work, YIELDING))
    store(work, pair + OWN_SLOPE * n, zero)
    store(work, pair + GAP * n, spread(work, FAR))
    store(work, pair + GAP_SLOPE * n, zero)
    store(work, pair + STIFFNESS * n, zero)


@inlined
def between(a, b, middle, first, last, work):
    """The slot half-way between two: cubic in gap and compliance, from values and slopes at both ends.

    Its slopes are such that Simpson's rule over them gives what the values grow by, kinks between or not. No gap is
    smaller there than at both ends, so that pairs that come near at neither may be left out.
    """
    n = width(work)
    begin, end = load(work, (AHEAD + a) * n), load(work, (AHEAD + b) * n)
    eighth, growth = 0.125 * (end - begin), 1.5 / (end - begin)
    store(work, (AHEAD + middle) * n, 0.5 * (begin + end))
    for k in range(first, last):
        p, q = (a * SLOT_ROWS + k * N_KEPT) * n, (b * SLOT_ROWS + k * N_KEPT) * n
        m = (middle * SLOT_ROWS + k * N_KEPT) * n
        for value, slope in ((OWN, OWN_SLOPE), (GAP, GAP_SLOPE)):
            before, after = load(work, p + value * n), load(work, q + value * n)
            slope_p, slope_q = load(work, p + slope * n), load(work, q + slope * n)
            found = 0.5 * (before + after) + eighth * (slope_p - slope_q)
            least = where_above(before, after, after, before)
            store(work, m + value * n, where_above(found, least, found, least))
            store(work, m + slope * n, growth * (after - before) - 0.25 * (slope_p + slope_q))
        store(work, m + STIFFNESS * n, 1.0 / load(work, m + OWN * n))
        store(work, m + POSITION * n, 0.5 * (load(work, p + POSITION * n) + load(work, q + POSITION * n)))


@inlined
def beside_between(a, b, middle, first, last, work):
    """The same for what stands beside the tables of chords."""
    n = width(work)
    begin, end = load(work, (AHEAD + a) * n), load(work, (AHEAD + b) * n)
    eighth, growth = 0.125 * (end - begin), 1.5 / (end - begin)
    for k in range(first, last):
        pair = BESIDE + k * COLUMNS
        p, q = (pair + a * BESIDE_ROWS) * n, (pair + b * BESIDE_ROWS) * n
        m = (pair + middle * BESIDE_ROWS) * n
        for value, slope in ((LEFT_OUT, LEFT_OUT_SLOPE), (TOUCH, TOUCH_SLOPE)):
            before, after = load(work, p + value * n), load(work, q + value * n)
            slope_p, slope_q = load(work, p + slope * n), load(work, q + slope * n)
            store(work, m + value * n, 0.5 * (before + after) + eighth * (slope_p - slope_q))
            store(work, m + slope * n, growth * (after - before) - 0.25 * (slope_p + slope_q))
