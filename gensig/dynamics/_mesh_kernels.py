"""Compiled core: the law of the gear mesh, several records side by side.

The symbols are those of ``docs/theory/spur_dynamics.md``.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics._layout import (
    AHEAD,
    BACKLASH,
    BASE,
    BITE,
    COAST,
    COAST_TABLE,
    COLUMNS,
    DAMPING,
    FIRST_PITCH,
    FOLLOWED,
    FRICTION,
    GAP,
    GAP_SLOPE,
    HALF_LAG,
    LAST_CELL,
    LAW,
    LEFT_OUT,
    LEFT_OUT_SLOPE,
    MIDDLE_POINT,
    MOST_PAIRS,
    MOTION_APPROACH,
    MOTION_RATE,
    MOTION_ROLL,
    MOTION_ROLL_RATE,
    N_LAW,
    NODES_PER_METER,
    OWN,
    OWN_SLOPE,
    PAIR_FORCE,
    PATH,
    PER_FRICTION_WIDTH,
    PER_SWITCH_WIDTH,
    PINION_TEETH,
    PINION_TOOTH,
    PITCH,
    PITCH_POINT,
    POSITION,
    SHARED,
    START_CURVATURE,
    START_PINION,
    START_WHEEL,
    STIFFNESS,
    STRIDE,
    TABLE_START,
    TANGENT_LENGTH,
    TOTAL,
    TOUCH_SLOPE,
    WHEEL_ROWS,
    WHEEL_TEETH,
    WHEEL_TOOTH,
    Law,
    chord_rows,
    is_helical,
    pair_rows,
)
from gensig.dynamics._vector import (
    any_above,
    at,
    compiled,
    get_row,
    inlined,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.mesh.pair_table import N_PAIRS


@inlined
def _clip(x, low, high):
    x = where_above(low, x, low, x)
    return where_above(x, high, high, x)


@inlined
def _sliding(numbers, position):
    """Direction of sliding, smooth through the pitch point, -1 before it and 1 after it."""
    x = (position - get_row(numbers, PITCH_POINT)) * get_row(
        numbers, PER_FRICTION_WIDTH
    )
    x = _clip(x, spread(numbers, -1.0), spread(numbers, 1.0))
    return x * (1.5 - 0.5 * x * x)


@inlined
def _rubbed(numbers, position, load_of_pair):
    """Friction force, and its moments about pinion and wheel."""
    force = get_row(numbers, FRICTION) * load_of_pair * _sliding(numbers, position)
    arm = get_row(numbers, START_CURVATURE) + _clip(
        position, spread(numbers, 0.0), get_row(numbers, PATH)
    )
    return force, 0.0 - force * arm, force * (get_row(numbers, TANGENT_LENGTH) - arm)


@inlined
def _total_load(numbers, rounds, first, last, slot, work):
    """Load of all pairs, and the sum of their stiffnesses; those that the shared deflection lifts
    off get a bite of 0.

    Each that leaves raises the total, so the loop ends after at most as many rounds as there are
    pairs.
    """
    zero, shared = spread(work, 0.0), get_row(numbers, SHARED)
    total, stiffness = zero, zero
    for _ in range(rounds):
        stiffness, force = zero, zero
        for k in range(first, last):
            bite = get_row(work, BITE + k)
            own = get_row(work, pair_rows(slot, k) + STIFFNESS)
            stiffness = stiffness + where_above(bite, zero, own, zero)
            force = force + bite * own
        total = force / (1.0 + shared * stiffness)
        lifted = zero
        for k in range(first, last):
            bite = get_row(work, BITE + k)
            kept = where_above(bite, shared * total, bite, zero)
            lifted = lifted + (bite - kept)
            set_row(work, BITE + k, kept)
        if not any_above(lifted, zero):
            break
    return total, stiffness


@inlined
def one_sided_law(
    numbers, consistent, helical, first, last, slot, margin, ahead, approach, approach_rate, roll_rate, work
):  # fmt: skip
    """One-sided contact of the gathered pairs, ``ahead`` m of roll after the instant they were
    gathered at.

    Rows ``margin`` take how deep every pair bites into the body that the others deflect, negative
    where it does not, and ``PAIR_FORCE`` its normal force; none if negative. Helical teeth are
    damped by the gap of their first touch, for those of chords jump from one to the next, and the
    energy that the springs of chords leave out is stored too.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping = get_row(numbers, SHARED), get_row(numbers, DAMPING)
    middle = ahead
    if helical:
        middle = ahead - get_row(numbers, HALF_LAG)
    # beyond half the backlash the teeth touch on their back flanks, if at all
    driven = approach + 0.5 * get_row(numbers, BACKLASH)
    for k in range(first, last):
        pair = pair_rows(slot, k)
        bite = approach - (
            get_row(work, pair + GAP) + ahead * get_row(work, pair + GAP_SLOPE)
        )
        if margin >= 0:
            set_row(work, margin + k, bite)
        bite = where_above(bite, zero, bite, zero)
        set_row(work, BITE + k, where_above(driven, zero, bite, zero))
    rounds = MOST_PAIRS if helical else N_PAIRS
    total, stiffness = _total_load(numbers, rounds, first, last, slot, work)
    normal, friction, moment_p, moment_w, along, lost, loaded = (
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
        zero,
    )
    stored = 0.0 - 0.5 * shared * total * total
    for k in range(first, last):
        pair = pair_rows(slot, k)
        bite = get_row(work, BITE + k)
        if margin >= 0:
            others = stiffness - where_above(
                bite, zero, get_row(work, pair + STIFFNESS), zero
            )
            deep = get_row(work, margin + k) - shared * total
            alone = deep * ((1.0 + shared * stiffness) / (1.0 + shared * others))
            set_row(work, margin + k, where_above(bite, zero, alone, deep))
        slope = get_row(work, pair + GAP_SLOPE)
        elastic = (bite - shared * total) * get_row(work, pair + STIFFNESS)
        elastic = where_above(bite, zero, elastic, zero)
        felt = slope
        if helical:
            felt = get_row(work, chord_rows(slot, k) + TOUCH_SLOPE)
        rate = approach_rate - felt * roll_rate
        force = elastic * (1.0 + damping * rate)
        force = where_above(force, zero, force, zero)
        if margin >= 0:
            set_row(work, PAIR_FORCE + k, force)
        normal = normal + force
        loaded = loaded + where_above(force, zero, one, zero)
        stored = stored + elastic * (bite - 0.5 * get_row(work, pair + OWN) * elastic)
        lost = lost + (force - elastic) * rate
        along = (
            along
            + force * slope
            + 0.5 * elastic * elastic * get_row(work, pair + OWN_SLOPE)
        )
        position = get_row(work, pair + POSITION) + middle
        sliding, moment, reaction = _rubbed(numbers, position, force)
        friction, moment_p, moment_w = (
            friction + sliding,
            moment_p + moment,
            moment_w + reaction,
        )
    if helical:
        set_row(work, TOTAL, total)
        for k in range(first, last):
            pair, chord = pair_rows(slot, k), chord_rows(slot, k)
            bite, slope = get_row(work, BITE + k), get_row(work, chord + LEFT_OUT_SLOPE)
            left_out = get_row(work, chord + LEFT_OUT) + ahead * slope
            elastic = (bite - shared * total) * get_row(work, pair + STIFFNESS)
            felt = get_row(work, chord + TOUCH_SLOPE)
            rate = approach_rate - felt * roll_rate
            force = elastic * (1.0 + damping * rate)
            damped = where_above(force, zero, force, zero) - elastic
            turned = damped * (felt - get_row(work, pair + GAP_SLOPE)) - slope
            stored = stored + where_above(bite, zero, left_out, zero)
            along = along + where_above(bite, zero, turned, zero)
    if not consistent:
        along = zero
    return Law(normal, friction, moment_p, moment_w, along, stored, lost, loaded)


@inlined
def papers_law(
    numbers, first, last, slot, margin, ahead, approach, approach_rate, work
):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs in and out over one integration step.

    Rows ``margin`` take how far every pair is in, from 0 to 1 and beyond, ``PAIR_FORCE`` its
    force; none if negative.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping, half_lag = (
        get_row(numbers, SHARED),
        get_row(numbers, DAMPING),
        get_row(numbers, HALF_LAG),
    )
    path = get_row(numbers, PATH) + 2.0 * half_lag
    stiffness, loaded = zero, zero
    for k in range(first, last):
        pair = pair_rows(slot, k)
        position = get_row(work, pair + POSITION) + ahead
        inside = where_above(position, path - position, path - position, position)
        share = 0.5 * (1.0 + inside * get_row(numbers, PER_SWITCH_WIDTH))
        # a pair that is not there is never in
        share = where_above(
            get_row(work, pair + STIFFNESS),
            spread(work, 1e-20),
            share,
            spread(work, -1.0),
        )
        if margin >= 0:
            set_row(work, margin + k, share)
        share = _clip(share, zero, one)
        loaded = (
            loaded
            + where_above(share, zero, one, zero)
            + where_above(one, share, zero, one)
        )
        own = share * get_row(work, pair + STIFFNESS)
        set_row(work, BITE + k, own)
        stiffness = stiffness + own
    together = stiffness / (1.0 + shared * stiffness)
    normal = together * approach + damping * approach_rate
    per_stiffness = where_above(
        stiffness, zero, 1.0 / where_above(stiffness, zero, stiffness, one), zero
    )
    friction, moment_p, moment_w = zero, zero, zero
    for k in range(first, last):
        position = get_row(work, pair_rows(slot, k) + POSITION) + (ahead - half_lag)
        part = normal * get_row(work, BITE + k) * per_stiffness
        if margin >= 0:
            set_row(work, PAIR_FORCE + k, part)
        sliding, moment, reaction = _rubbed(numbers, position, part)
        friction, moment_p, moment_w = (
            friction + sliding,
            moment_p + moment,
            moment_w + reaction,
        )
    stored, lost = (
        0.5 * together * approach * approach,
        damping * approach_rate * approach_rate,
    )
    return Law(normal, friction, moment_p, moment_w, zero, stored, lost, loaded)


@compiled
def coast_law(group, lane, roll, approach, rate, roll_rate, work):
    """Contact on the back flanks of one lane, written over its drive law; sound teeth without
    errors, no friction.

    Teeth count backwards along the mirrored roll. What is kept of the pairs goes to slot
    ``COAST`` and the bites.
    """
    n = width(work)
    numbers, exact, places, table = (
        group.numbers,
        group.exact,
        group.places,
        group.table,
    )
    pitch, shared = exact[at(PITCH, lane, n)], numbers[at(SHARED, lane, n)]
    mirrored = 2.0 * numbers[at(MIDDLE_POINT, lane, n)] + 0.5 * pitch - roll
    within = -approach - numbers[at(BACKLASH, lane, n)]
    newest = int(np.floor(mirrored / pitch)) - places[at(FIRST_PITCH, lane, n)]
    start, stride = places[at(COAST_TABLE, lane, n)], places[at(STRIDE, lane, n)]
    n_pairs = places[at(FOLLOWED, lane, n)] if is_helical(group) else N_PAIRS
    wheel = places[at(WHEEL_ROWS, lane, n)] * stride
    for k in range(n_pairs):
        tooth_p = (places[at(START_PINION, lane, n)] - newest + k) % places[
            at(PINION_TEETH, lane, n)
        ]
        tooth_w = (places[at(START_WHEEL, lane, n)] - newest + k) % places[
            at(WHEEL_TEETH, lane, n)
        ]
        there = (
            group.tooth_row[places[at(PINION_TOOTH, lane, n)] + tooth_p] >= 0
            and group.tooth_row[places[at(WHEEL_TOOTH, lane, n)] + tooth_w] >= 0
        )
        x = (mirrored - (newest - k) * pitch - exact[at(TABLE_START, lane, n)]) * exact[
            at(NODES_PER_METER, lane, n)
        ]
        cell = min(max(int(x), 0), places[at(LAST_CELL, lane, n)])
        p = start + cell * COLUMNS
        pair = pair_rows(COAST, k)
        for column in range(COLUMNS):
            low, high = table[p + column], table[p + COLUMNS + column]
            if wheel > 0:
                low += table[p + wheel + column]
                high += table[p + wheel + COLUMNS + column]
            work[at(pair + column, lane, n)] = low + (x - cell) * (high - low)
            if column in (OWN_SLOPE, GAP_SLOPE):
                bent = (
                    (x - cell)
                    * (1.0 - (x - cell))
                    * group.bend[lane * COLUMNS + column - 1]
                )
                work[at(pair + column - 1, lane, n)] -= bent * (high - low)
        work[at(pair + OWN, lane, n)] -= shared
        bite = within - work[at(pair + GAP, lane, n)]
        work[at(BITE + k, lane, n)] = bite if there and bite > 0.0 else 0.0
    total = 0.0
    for _ in range(n_pairs):
        stiffness, force, lifted = 0.0, 0.0, False
        for k in range(n_pairs):
            if work[at(BITE + k, lane, n)] > 0.0:
                own = work[at(pair_rows(COAST, k) + OWN, lane, n)]
                stiffness += 1.0 / own
                force += work[at(BITE + k, lane, n)] / own
        total = force / (1.0 + shared * stiffness)
        for k in range(n_pairs):
            if 0.0 < work[at(BITE + k, lane, n)] <= shared * total:
                work[at(BITE + k, lane, n)] = 0.0
                lifted = True
        if not lifted:
            break
    normal, along, stored, lost, loaded = (
        0.0,
        0.0,
        -0.5 * shared * total * total,
        0.0,
        0.0,
    )
    for k in range(n_pairs):
        bite, pair = work[at(BITE + k, lane, n)], pair_rows(COAST, k)
        if bite > 0.0:
            own, slope = (
                work[at(pair + OWN, lane, n)],
                work[at(pair + GAP_SLOPE, lane, n)],
            )
            elastic = (bite - shared * total) / own
            pair_rate = slope * roll_rate - rate
            part = max(0.0, elastic * (1.0 + numbers[at(DAMPING, lane, n)] * pair_rate))
            normal += part
            loaded += part > 0.0
            stored += elastic * (bite - 0.5 * own * elastic)
            lost += (part - elastic) * pair_rate
            along += (
                part * slope
                + 0.5 * elastic * elastic * work[at(pair + OWN_SLOPE, lane, n)]
            )
    mirrored_along = 0.0
    if group.consistent:
        mirrored_along = -along
    values = Law(-normal, 0.0, 0.0, 0.0, mirrored_along, stored, lost, -loaded)
    for row in range(N_LAW):
        work[at(LAW + row, lane, n)] = values[row]


@inlined
def mesh_law(
    group, first, last, slot, margin, turned, approach, rate, roll_rate, work, wide
):
    """The law of the chosen kind in every lane, on whichever flank it touches, ``turned`` m of
    roll after ``BASE``.
    """
    n = width(work)
    numbers = group.numbers
    ahead = turned - get_row(work, AHEAD + slot)
    if group.one_sided:
        law = one_sided_law(
            numbers,
            group.consistent,
            is_helical(group),
            first,
            last,
            slot,
            margin,
            ahead,
            approach,
            rate,
            roll_rate,
            work,
        )
        play = 0.0 - get_row(numbers, BACKLASH)
        if any_above(play, approach):
            for row in range(N_LAW):
                set_row(work, LAW + row, law[row])
            set_row(work, MOTION_ROLL, turned)
            set_row(work, MOTION_APPROACH, approach)
            set_row(work, MOTION_RATE, rate)
            set_row(work, MOTION_ROLL_RATE, roll_rate)
            for lane in range(n):
                if work[at(MOTION_APPROACH, lane, n)] < -numbers[at(BACKLASH, lane, n)]:
                    coast_law(
                        group,
                        lane,
                        wide[at(BASE, lane, n)] + work[at(MOTION_ROLL, lane, n)],
                        work[at(MOTION_APPROACH, lane, n)],
                        work[at(MOTION_RATE, lane, n)],
                        work[at(MOTION_ROLL_RATE, lane, n)],
                        work,
                    )
            law = Law(
                get_row(work, LAW),
                get_row(work, LAW + 1),
                get_row(work, LAW + 2),
                get_row(work, LAW + 3),
                get_row(work, LAW + 4),
                get_row(work, LAW + 5),
                get_row(work, LAW + 6),
                get_row(work, LAW + 7),
            )
    else:
        law = papers_law(
            numbers, first, last, slot, margin, ahead, approach, rate, work
        )
    return law
