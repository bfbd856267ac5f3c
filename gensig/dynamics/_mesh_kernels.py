"""Compiled core: the law of the gear mesh, several records side by side.

The symbols are those of ``docs/theory/spur_dynamics.md``.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics._layout import (
    AHEAD,
    BACKLASH,
    BASE,
    BESIDE,
    BESIDE_ROWS,
    BITE,
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
    MOTION,
    N_KEPT,
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
    SLOT_ROWS,
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
    at_row,
    is_helical,
)  # fmt: skip
from gensig.dynamics._vector import any_above, compiled, inlined, load, spread, store, where_above, width
from gensig.mesh.pair_table import N_PAIRS


@inlined
def _clip(x, low, high):
    x = where_above(low, x, low, x)
    return where_above(x, high, high, x)


@inlined
def _sliding(numbers, position):
    """Direction of sliding, smooth through the pitch point, -1 before it and 1 after it."""
    x = (position - at_row(numbers, PITCH_POINT)) * at_row(numbers, PER_FRICTION_WIDTH)
    x = _clip(x, spread(numbers, -1.0), spread(numbers, 1.0))
    return x * (1.5 - 0.5 * x * x)


@inlined
def _rubbed(numbers, position, load_of_pair):
    """Friction force, and its moments about pinion and wheel."""
    force = at_row(numbers, FRICTION) * load_of_pair * _sliding(numbers, position)
    arm = at_row(numbers, START_CURVATURE) + _clip(position, spread(numbers, 0.0), at_row(numbers, PATH))
    return force, 0.0 - force * arm, force * (at_row(numbers, TANGENT_LENGTH) - arm)


@inlined
def _total_load(numbers, rounds, first, last, slot, work):
    """Load of all pairs, and the sum of their stiffnesses; those that the shared deflection lifts off get a bite of 0.

    Each that leaves raises the total, so the loop ends after at most as many rounds as there are pairs.
    """
    n = width(work)
    zero, shared = spread(work, 0.0), at_row(numbers, SHARED)
    total, stiffness = zero, zero
    for _ in range(rounds):
        stiffness, force = zero, zero
        for k in range(first, last):
            bite = load(work, (BITE + k) * n)
            own = load(work, (slot * SLOT_ROWS + k * N_KEPT + STIFFNESS) * n)
            stiffness = stiffness + where_above(bite, zero, own, zero)
            force = force + bite * own
        total = force / (1.0 + shared * stiffness)
        lifted = zero
        for k in range(first, last):
            bite = load(work, (BITE + k) * n)
            kept = where_above(bite, shared * total, bite, zero)
            lifted = lifted + (bite - kept)
            store(work, (BITE + k) * n, kept)
        if not any_above(lifted, zero):
            break
    return total, stiffness


@inlined
def one_sided_law(
    numbers, consistent, helical, first, last, slot, margin, ahead, approach, approach_rate, roll_rate, work
):  # fmt: skip
    """One-sided contact of the gathered pairs, ``ahead`` m of roll after the instant they were gathered at.

    Normal force, friction force, friction moments about pinion and wheel, force on the roll coordinate (energy
    balance), stored energy, power lost in mesh damping, number of loaded pairs; a vector each. Rows ``margin`` take
    how deep every pair bites into the body that the others deflect, negative where it does not, and ``PAIR_FORCE`` its
    normal force; none if negative. Helical teeth are damped by the gap of their first touch, for those of
    chords jump from one to the next, and the energy that the springs of chords leave out is stored too.
    """
    n = width(work)
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping = at_row(numbers, SHARED), at_row(numbers, DAMPING)
    middle = ahead
    if helical:
        middle = ahead - at_row(numbers, HALF_LAG)
    # beyond half the backlash the teeth touch on their back flanks, if at all
    driven = approach + 0.5 * at_row(numbers, BACKLASH)
    for k in range(first, last):
        pair = slot * SLOT_ROWS + k * N_KEPT
        bite = approach - (load(work, (pair + GAP) * n) + ahead * load(work, (pair + GAP_SLOPE) * n))
        if margin >= 0:
            store(work, (margin + k) * n, bite)
        bite = where_above(bite, zero, bite, zero)
        store(work, (BITE + k) * n, where_above(driven, zero, bite, zero))
    rounds = MOST_PAIRS if helical else N_PAIRS
    total, stiffness = _total_load(numbers, rounds, first, last, slot, work)
    normal, friction, moment_p, moment_w, along, lost, loaded = zero, zero, zero, zero, zero, zero, zero
    stored = 0.0 - 0.5 * shared * total * total
    for k in range(first, last):
        pair = slot * SLOT_ROWS + k * N_KEPT
        bite = load(work, (BITE + k) * n)
        if margin >= 0:
            others = stiffness - where_above(bite, zero, load(work, (pair + STIFFNESS) * n), zero)
            deep = load(work, (margin + k) * n) - shared * total
            alone = deep * ((1.0 + shared * stiffness) / (1.0 + shared * others))
            store(work, (margin + k) * n, where_above(bite, zero, alone, deep))
        slope = load(work, (pair + GAP_SLOPE) * n)
        elastic = (bite - shared * total) * load(work, (pair + STIFFNESS) * n)
        elastic = where_above(bite, zero, elastic, zero)
        felt = slope
        if helical:
            felt = load(work, (BESIDE + slot * BESIDE_ROWS + k * COLUMNS + TOUCH_SLOPE) * n)
        rate = approach_rate - felt * roll_rate
        force = elastic * (1.0 + damping * rate)
        force = where_above(force, zero, force, zero)
        if margin >= 0:
            store(work, (PAIR_FORCE + k) * n, force)
        normal = normal + force
        loaded = loaded + where_above(force, zero, one, zero)
        stored = stored + elastic * (bite - 0.5 * load(work, (pair + OWN) * n) * elastic)
        lost = lost + (force - elastic) * rate
        along = along + force * slope + 0.5 * elastic * elastic * load(work, (pair + OWN_SLOPE) * n)
        position = load(work, (pair + POSITION) * n) + middle
        sliding, moment, reaction = _rubbed(numbers, position, force)
        friction, moment_p, moment_w = friction + sliding, moment_p + moment, moment_w + reaction
    if helical:
        store(work, TOTAL * n, total)
        for k in range(first, last):
            pair, row = (slot * SLOT_ROWS + k * N_KEPT) * n, (BESIDE + slot * BESIDE_ROWS + k * COLUMNS) * n
            bite, slope = load(work, (BITE + k) * n), load(work, row + LEFT_OUT_SLOPE * n)
            left_out = load(work, row + LEFT_OUT * n) + ahead * slope
            elastic = (bite - shared * total) * load(work, pair + STIFFNESS * n)
            felt = load(work, row + TOUCH_SLOPE * n)
            rate = approach_rate - felt * roll_rate
            force = elastic * (1.0 + damping * rate)
            damped = where_above(force, zero, force, zero) - elastic
            turned = damped * (felt - load(work, pair + GAP_SLOPE * n)) - slope
            stored = stored + where_above(bite, zero, left_out, zero)
            along = along + where_above(bite, zero, turned, zero)
    if not consistent:
        along = zero
    return normal, friction, moment_p, moment_w, along, stored, lost, loaded


@inlined
def papers_law(numbers, first, last, slot, margin, ahead, approach, approach_rate, work):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs in and out over one integration step.

    Rows ``margin`` take how far every pair is in, from 0 to 1 and beyond, ``PAIR_FORCE`` its force; none if negative.
    """
    n = width(work)
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping, half_lag = at_row(numbers, SHARED), at_row(numbers, DAMPING), at_row(numbers, HALF_LAG)
    path = at_row(numbers, PATH) + 2.0 * half_lag
    stiffness, loaded = zero, zero
    for k in range(first, last):
        pair = slot * SLOT_ROWS + k * N_KEPT
        position = load(work, (pair + POSITION) * n) + ahead
        inside = where_above(position, path - position, path - position, position)
        share = 0.5 * (1.0 + inside * at_row(numbers, PER_SWITCH_WIDTH))
        # a pair that is not there is never in
        share = where_above(load(work, (pair + STIFFNESS) * n), spread(work, 1e-20), share, spread(work, -1.0))
        if margin >= 0:
            store(work, (margin + k) * n, share)
        share = _clip(share, zero, one)
        loaded = loaded + where_above(share, zero, one, zero) + where_above(one, share, zero, one)
        own = share * load(work, (pair + STIFFNESS) * n)
        store(work, (BITE + k) * n, own)
        stiffness = stiffness + own
    together = stiffness / (1.0 + shared * stiffness)
    normal = together * approach + damping * approach_rate
    per_stiffness = where_above(stiffness, zero, 1.0 / where_above(stiffness, zero, stiffness, one), zero)
    friction, moment_p, moment_w = zero, zero, zero
    for k in range(first, last):
        position = load(work, (slot * SLOT_ROWS + k * N_KEPT + POSITION) * n) + (ahead - half_lag)
        part = normal * load(work, (BITE + k) * n) * per_stiffness
        if margin >= 0:
            store(work, (PAIR_FORCE + k) * n, part)
        sliding, moment, reaction = _rubbed(numbers, position, part)
        friction, moment_p, moment_w = friction + sliding, moment_p + moment, moment_w + reaction
    stored, lost = 0.5 * together * approach * approach, damping * approach_rate * approach_rate
    return normal, friction, moment_p, moment_w, zero, stored, lost, loaded


@compiled
def coast_law(group, lane, roll, approach, rate, roll_rate, work):
    """Contact on the back flanks of one lane, written over its drive law; sound teeth without errors, no friction.

    Teeth count backwards along the mirrored roll. What is kept of the pairs goes to slot ``COAST`` and the bites.
    """
    n = width(work)
    numbers, exact, places, table = group.numbers, group.exact, group.places, group.table
    pitch, shared = exact[PITCH * n + lane], numbers[SHARED * n + lane]
    mirrored = 2.0 * numbers[MIDDLE_POINT * n + lane] + 0.5 * pitch - roll
    within = -approach - numbers[BACKLASH * n + lane]
    newest = int(np.floor(mirrored / pitch)) - places[FIRST_PITCH * n + lane]
    start, stride = places[COAST_TABLE * n + lane], places[STRIDE * n + lane]
    n_pairs = places[FOLLOWED * n + lane] if is_helical(group) else N_PAIRS
    wheel = places[WHEEL_ROWS * n + lane] * stride
    bites = BITE * n + lane
    for k in range(n_pairs):
        tooth_p = (places[START_PINION * n + lane] - newest + k) % places[PINION_TEETH * n + lane]
        tooth_w = (places[START_WHEEL * n + lane] - newest + k) % places[WHEEL_TEETH * n + lane]
        there = (
            group.tooth_row[places[PINION_TOOTH * n + lane] + tooth_p] >= 0
            and group.tooth_row[places[WHEEL_TOOTH * n + lane] + tooth_w] >= 0
        )
        x = (mirrored - (newest - k) * pitch - exact[TABLE_START * n + lane]) * exact[NODES_PER_METER * n + lane]
        cell = min(max(int(x), 0), places[LAST_CELL * n + lane])
        p = start + cell * COLUMNS
        here = k * N_KEPT * n + lane
        for column in range(COLUMNS):
            low, high = table[p + column], table[p + COLUMNS + column]
            if wheel > 0:
                low += table[p + wheel + column]
                high += table[p + wheel + COLUMNS + column]
            work[here + column * n] = low + (x - cell) * (high - low)
            if column in (OWN_SLOPE, GAP_SLOPE):
                bent = (x - cell) * (1.0 - (x - cell)) * group.bend[lane * COLUMNS + column - 1]
                work[here + (column - 1) * n] -= bent * (high - low)
        work[here + OWN * n] -= shared
        bite = within - work[here + GAP * n]
        work[bites + k * n] = bite if there and bite > 0.0 else 0.0
    total = 0.0
    for _ in range(n_pairs):
        stiffness, force, lifted = 0.0, 0.0, False
        for k in range(n_pairs):
            if work[bites + k * n] > 0.0:
                stiffness += 1.0 / work[(k * N_KEPT + OWN) * n + lane]
                force += work[bites + k * n] / work[(k * N_KEPT + OWN) * n + lane]
        total = force / (1.0 + shared * stiffness)
        for k in range(n_pairs):
            if 0.0 < work[bites + k * n] <= shared * total:
                work[bites + k * n] = 0.0
                lifted = True
        if not lifted:
            break
    normal, along, stored, lost, loaded = 0.0, 0.0, -0.5 * shared * total * total, 0.0, 0.0
    for k in range(n_pairs):
        bite, here = work[bites + k * n], k * N_KEPT * n + lane
        if bite > 0.0:
            own, slope = work[here + OWN * n], work[here + GAP_SLOPE * n]
            elastic = (bite - shared * total) / own
            pair_rate = slope * roll_rate - rate
            part = max(0.0, elastic * (1.0 + numbers[DAMPING * n + lane] * pair_rate))
            normal += part
            loaded += part > 0.0
            stored += elastic * (bite - 0.5 * own * elastic)
            lost += (part - elastic) * pair_rate
            along += part * slope + 0.5 * elastic * elastic * work[here + OWN_SLOPE * n]
    values = (-normal, 0.0, 0.0, 0.0, -along if group.consistent else 0.0, stored, lost, -loaded)
    for row in range(N_LAW):
        work[(LAW + row) * n + lane] = values[row]


@inlined
def mesh_law(group, first, last, slot, margin, turned, approach, rate, roll_rate, work, wide):
    """The law of the chosen kind in every lane, on whichever flank it touches, ``turned`` m of roll after ``BASE``."""
    n = width(work)
    numbers = group.numbers
    ahead = turned - load(work, (AHEAD + slot) * n)
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
        play = 0.0 - at_row(numbers, BACKLASH)
        if any_above(play, approach):
            for row in range(N_LAW):
                store(work, (LAW + row) * n, law[row])
            store(work, MOTION * n, turned)
            store(work, (MOTION + 1) * n, approach)
            store(work, (MOTION + 2) * n, rate)
            store(work, (MOTION + 3) * n, roll_rate)
            for lane in range(n):
                if work[(MOTION + 1) * n + lane] < -numbers[BACKLASH * n + lane]:
                    coast_law(
                        group, lane, wide[BASE * n + lane] + work[MOTION * n + lane], work[(MOTION + 1) * n + lane],
                        work[(MOTION + 2) * n + lane], work[(MOTION + 3) * n + lane], work,
                    )  # fmt: skip
            law = (
                load(work, LAW * n), load(work, (LAW + 1) * n), load(work, (LAW + 2) * n), load(work, (LAW + 3) * n),
                load(work, (LAW + 4) * n), load(work, (LAW + 5) * n), load(work, (LAW + 6) * n),
                load(work, (LAW + 7) * n),
            )  # fmt: skip
    else:
        law = papers_law(numbers, first, last, slot, margin, ahead, approach, rate, work)
    return law
