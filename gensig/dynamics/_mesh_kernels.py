"""Compiled core: the law of the gear mesh, several records side by side.

The symbols are those of ``docs/theory/spur_dynamics.md``.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import (
    BACKLASH,
    BITE,
    COAST,
    COLUMNS,
    COMPLIANCE,
    COMPLIANCE_SLOPE,
    GAP,
    GAP_SLOPE,
    LAW,
    MOST_PAIRS,
    N_LAW,
    PAIR_FORCE,
    POSITION,
    SHARED,
    STIFFNESS,
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
from gensig.dynamics._written import written
from gensig.mesh.pair_table import N_PAIRS


@written
def _clip(x, low, high):
    x = where_above(low, x, low, x)
    return where_above(x, high, high, x)


@written
def _sliding(numbers, position):
    """Direction of sliding, smooth through the pitch point, -1 before it and 1 after it."""
    beyond = position - get_row(numbers, layout.PITCH_POINT)
    x = beyond * get_row(numbers, layout.PER_FRICTION_WIDTH)
    x = _clip(x, spread(numbers, -1.0), spread(numbers, 1.0))
    return x * (1.5 - 0.5 * x * x)


@written
def rubbed(numbers, position, load):
    """Friction force of a pair, and its moments about pinion and wheel."""
    coefficient = get_row(numbers, layout.FRICTION)
    force = coefficient * load * _sliding(numbers, position)
    on_path = _clip(position, spread(numbers, 0.0), get_row(numbers, layout.PATH))
    arm = get_row(numbers, layout.START_CURVATURE) + on_path
    arm_w = get_row(numbers, layout.TANGENT_LENGTH) - arm
    return force, 0.0 - force * arm, force * arm_w


@inlined
def _total_load(numbers, rounds, first, last, slot, work):
    """Load of all pairs, and the sum of their stiffnesses.

    Pairs that the shared deflection lifts off get a bite of 0. Each of them raises the total, so
    the loop ends after at most as many rounds as there are pairs.
    """
    zero, shared = spread(work, 0.0), get_row(numbers, SHARED)
    total, stiffness = zero, zero
    for _ in range(rounds):
        stiffness, force = zero, zero
        for k in range(first, last):
            bite = get_row(work, BITE + k)
            of_pair = get_row(work, pair_rows(slot, k) + STIFFNESS)
            stiffness = stiffness + where_above(bite, zero, of_pair, zero)
            force = force + bite * of_pair
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
def _followed_damping(damping, elastic, work):
    """Damping over the elastic force of a pair, at most what ``MOST_DAMPER`` allows."""
    most = get_row(work, layout.MOST_DAMPER)
    if any_above(damping * elastic, most):
        damping = where_above(damping * elastic, most, most / elastic, damping)
    return damping


@inlined
def one_sided_law(
    numbers,
    consistent,
    helical,
    first,
    last,
    slot,
    margin,
    ahead,
    approach,
    approach_rate,
    roll_rate,
    work,
):
    """One-sided contact of the gathered pairs, ``ahead`` m of roll after their reading.

    Rows ``margin`` take the penetration of every pair into the body that the others deflect,
    negative without contact, and ``PAIR_FORCE`` its normal force; none if ``margin`` is negative.
    The damping of helical teeth follows the gap of their first touch, because the gaps of chords
    jump from one to the next. The energy that the springs of chords leave out is stored too.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping = get_row(numbers, SHARED), get_row(numbers, layout.DAMPING)
    middle = ahead
    if helical:
        middle = ahead - get_row(numbers, layout.HALF_LAG)
    for k in range(first, last):
        pair = pair_rows(slot, k)
        grown = ahead * get_row(work, pair + GAP_SLOPE)
        bite = approach - (get_row(work, pair + GAP) + grown)
        if margin >= 0:
            set_row(work, margin + k, bite)
        set_row(work, BITE + k, where_above(bite, zero, bite, zero))
    rounds = MOST_PAIRS if helical else N_PAIRS
    total, stiffness = _total_load(numbers, rounds, first, last, slot, work)
    normal, along, lost, loaded = zero, zero, zero, zero
    friction, moment_p, moment_w = zero, zero, zero
    stored = 0.0 - 0.5 * shared * total * total
    for k in range(first, last):
        pair = pair_rows(slot, k)
        bite, spring = get_row(work, BITE + k), get_row(work, pair + STIFFNESS)
        if margin >= 0:
            others = stiffness - where_above(bite, zero, spring, zero)
            deep = get_row(work, margin + k) - shared * total
            alone = deep * ((1.0 + shared * stiffness) / (1.0 + shared * others))
            set_row(work, margin + k, where_above(bite, zero, alone, deep))
        slope = get_row(work, pair + GAP_SLOPE)
        elastic = where_above(bite, zero, (bite - shared * total) * spring, zero)
        damped_slope = slope
        if helical:
            damped_slope = get_row(work, chord_rows(slot, k) + layout.TOUCH_SLOPE)
        rate = approach_rate - damped_slope * roll_rate
        damped = 1.0 + _followed_damping(damping, elastic, work) * rate
        force = elastic * damped
        force = where_above(force, zero, force, zero)
        if margin >= 0:
            set_row(work, PAIR_FORCE + k, force)
            set_row(work, layout.PAIR_DAMPED + k, damped)
        normal = normal + force
        loaded = loaded + where_above(force, zero, one, zero)
        compliance = get_row(work, pair + COMPLIANCE)
        stored = stored + elastic * (bite - 0.5 * compliance * elastic)
        lost = lost + (force - elastic) * rate
        softening = 0.5 * elastic * elastic * get_row(work, pair + COMPLIANCE_SLOPE)
        along = along + force * slope + softening
        position = get_row(work, pair + POSITION) + middle
        sliding, moment, reaction = rubbed(numbers, position, force)
        friction, moment_p = friction + sliding, moment_p + moment
        moment_w = moment_w + reaction
    if helical:
        set_row(work, layout.TOTAL, total)
        for k in range(first, last):
            pair, chord = pair_rows(slot, k), chord_rows(slot, k)
            bite = get_row(work, BITE + k)
            slope = get_row(work, chord + layout.LEFT_OUT_SLOPE)
            left_out = get_row(work, chord + layout.LEFT_OUT) + ahead * slope
            elastic = (bite - shared * total) * get_row(work, pair + STIFFNESS)
            damped_slope = get_row(work, chord + layout.TOUCH_SLOPE)
            rate = approach_rate - damped_slope * roll_rate
            followed = _followed_damping(damping, elastic, work)
            force = elastic * (1.0 + followed * rate)
            damped = where_above(force, zero, force, zero) - elastic
            turned = damped * (damped_slope - get_row(work, pair + GAP_SLOPE)) - slope
            stored = stored + where_above(bite, zero, left_out, zero)
            along = along + where_above(bite, zero, turned, zero)
    if not consistent:
        along = zero
    return Law(normal, friction, moment_p, moment_w, along, stored, lost, loaded)


@inlined
def papers_law(
    numbers, first, last, slot, margin, ahead, approach, approach_rate, work
):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs switched over one integration step.

    Rows ``margin`` take the share of every pair in contact, from 0 to 1 and beyond, ``PAIR_FORCE``
    its force; none if ``margin`` is negative.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping = get_row(numbers, SHARED), get_row(numbers, layout.DAMPING)
    half_lag = get_row(numbers, layout.HALF_LAG)
    per_width = get_row(numbers, layout.PER_SWITCH_WIDTH)
    path = get_row(numbers, layout.PATH) + 2.0 * half_lag
    least, absent = spread(work, 1e-20), spread(work, -1.0)
    stiffness, loaded = zero, zero
    for k in range(first, last):
        pair = pair_rows(slot, k)
        position = get_row(work, pair + POSITION) + ahead
        spring = get_row(work, pair + STIFFNESS)
        inside = where_above(position, path - position, path - position, position)
        share = 0.5 * (1.0 + inside * per_width)
        share = where_above(spring, least, share, absent)
        if margin >= 0:
            set_row(work, margin + k, share)
        share = _clip(share, zero, one)
        entered = where_above(share, zero, one, zero)
        loaded = loaded + entered + where_above(one, share, zero, one)
        of_pair = share * spring
        set_row(work, BITE + k, of_pair)
        stiffness = stiffness + of_pair
    together = stiffness / (1.0 + shared * stiffness)
    normal = together * approach + damping * approach_rate
    divisor = where_above(stiffness, zero, stiffness, one)
    per_stiffness = where_above(stiffness, zero, 1.0 / divisor, zero)
    friction, moment_p, moment_w = zero, zero, zero
    for k in range(first, last):
        position = get_row(work, pair_rows(slot, k) + POSITION) + (ahead - half_lag)
        part = normal * get_row(work, BITE + k) * per_stiffness
        if margin >= 0:
            set_row(work, PAIR_FORCE + k, part)
        sliding, moment, reaction = rubbed(numbers, position, part)
        friction, moment_p = friction + sliding, moment_p + moment
        moment_w = moment_w + reaction
    stored = 0.5 * together * approach * approach
    lost = damping * approach_rate * approach_rate
    return Law(normal, friction, moment_p, moment_w, zero, stored, lost, loaded)


@compiled
def coast_law(group, lane, work, wide):
    """Contact on the back flanks of one lane, added to its drive law.

    Sound teeth without errors, no friction. Teeth count backwards along the mirrored roll. The
    pairs are kept in slot ``COAST`` and in the bites.
    """
    n = width(work)
    # the rows of this lane
    numbers, exact = group.numbers[lane::n], group.exact[lane::n]
    indices, rows = group.indices[lane::n], work[lane::n]
    table, tooth_row = group.table, group.tooth_row
    roll = wide[at(layout.BASE, lane, n)] + rows[layout.MOTION_ROLL]
    rate, roll_rate = rows[layout.MOTION_RATE], rows[layout.MOTION_ROLL_RATE]
    pitch, shared = exact[layout.PITCH], numbers[SHARED]
    mirrored = 2.0 * numbers[layout.MIDDLE_POINT] + 0.5 * pitch - roll
    within = -rows[layout.MOTION_APPROACH] - numbers[BACKLASH]
    newest = int(np.floor(mirrored / pitch)) - indices[layout.FIRST_PITCH]
    n_pairs = N_PAIRS
    if is_helical(group):
        n_pairs = indices[layout.FOLLOWED]
    wheel = indices[layout.WHEEL_ROWS] * indices[layout.STRIDE]
    first_p, first_w = indices[layout.PINION_TOOTH], indices[layout.WHEEL_TOOTH]
    start_p, start_w = indices[layout.START_PINION], indices[layout.START_WHEEL]
    for k in range(n_pairs):
        index = newest - k
        tooth_p = (start_p - index) % indices[layout.PINION_TEETH]
        tooth_w = (start_w - index) % indices[layout.WHEEL_TEETH]
        x = mirrored - index * pitch - exact[layout.TABLE_START]
        x = x * exact[layout.NODES_PER_METER]
        cell = min(max(int(x), 0), indices[layout.LAST_CELL])
        p = indices[layout.COAST_TABLE] + cell * COLUMNS
        pair = pair_rows(COAST, k)
        for column in range(COLUMNS):
            low, high = table[p + column], table[p + COLUMNS + column]
            if wheel > 0:
                low += table[p + wheel + column]
                high += table[p + wheel + COLUMNS + column]
            rows[pair + column] = low + (x - cell) * (high - low)
            if column in (COMPLIANCE_SLOPE, GAP_SLOPE):
                bend = group.bend[lane * COLUMNS + column - 1]
                bent = (x - cell) * (1.0 - (x - cell)) * bend
                rows[pair + column - 1] -= bent * (high - low)
        rows[pair + COMPLIANCE] -= shared
        row_p, row_w = tooth_row[first_p + tooth_p], tooth_row[first_w + tooth_w]
        bite = within - rows[pair + GAP]
        rows[BITE + k] = 0.0
        if row_p >= 0 and row_w >= 0 and bite > 0.0:
            rows[BITE + k] = bite
    total = 0.0
    for _ in range(n_pairs):
        stiffness, force, lifted = 0.0, 0.0, False
        for k in range(n_pairs):
            if rows[BITE + k] > 0.0:
                compliance = rows[pair_rows(COAST, k) + COMPLIANCE]
                stiffness += 1.0 / compliance
                force += rows[BITE + k] / compliance
        total = force / (1.0 + shared * stiffness)
        for k in range(n_pairs):
            if 0.0 < rows[BITE + k] <= shared * total:
                rows[BITE + k] = 0.0
                lifted = True
        if not lifted:
            break
    normal, along, lost, loaded = 0.0, 0.0, 0.0, 0.0
    stored = -0.5 * shared * total * total
    for k in range(n_pairs):
        bite, pair = rows[BITE + k], pair_rows(COAST, k)
        if bite > 0.0:
            compliance, slope = rows[pair + COMPLIANCE], rows[pair + GAP_SLOPE]
            elastic = (bite - shared * total) / compliance
            pair_rate = slope * roll_rate - rate
            damping = 1.0 + numbers[layout.DAMPING] * pair_rate
            part = max(0.0, elastic * damping)
            normal += part
            loaded += part > 0.0
            stored += elastic * (bite - 0.5 * compliance * elastic)
            lost += (part - elastic) * pair_rate
            softening = 0.5 * elastic * elastic * rows[pair + COMPLIANCE_SLOPE]
            along += part * slope + softening
    mirrored_along = 0.0
    if group.consistent:
        mirrored_along = -along
    law = Law(-normal, 0.0, 0.0, 0.0, mirrored_along, stored, lost, -loaded)
    for row in range(N_LAW):
        rows[LAW + row] += law[row]


@inlined
def mesh_law(
    group, first, last, slot, margin, turned, approach, rate, roll_rate, work, wide
):
    """The law of the chosen kind in every lane, on either flank, ``turned`` m after ``BASE``."""
    numbers = group.numbers
    ahead = turned - get_row(work, layout.AHEAD + slot)
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
        if any_above(0.0 - get_row(numbers, BACKLASH), approach):
            for row in range(N_LAW):
                set_row(work, LAW + row, law[row])
            set_row(work, layout.MOTION_ROLL, turned)
            set_row(work, layout.MOTION_APPROACH, approach)
            set_row(work, layout.MOTION_RATE, rate)
            set_row(work, layout.MOTION_ROLL_RATE, roll_rate)
            for lane in range(width(work)):
                coast = work[at(layout.MOTION_APPROACH, lane, width(work))]
                if coast < -numbers[at(BACKLASH, lane, width(work))]:
                    coast_law(group, lane, work, wide)
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
