"""Compiled core: the law of the gear mesh, several records side by side.

The symbols are those of ``docs/theory/motion.md``.
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
    MARGIN,
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
    chosen,
    compiled,
    get_row,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics._written import call, choose, either, fold, repeat, written
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


@written
def _touch(k, slot, ahead, approach, work):
    """Set the bite of a pair; its penetration, negative where it does not touch."""
    zero, pair = spread(work, 0.0), pair_rows(slot, k)
    grown = ahead * get_row(work, pair + GAP_SLOPE)
    bite = approach - (get_row(work, pair + GAP) + grown)
    set_row(work, BITE + k, where_above(bite, zero, bite, zero))
    return bite


@written
def _add_load(k, slot, stiffness, force, work):
    """Add a pair to the stiffness and the force of all that touch."""
    zero, bite = spread(work, 0.0), get_row(work, BITE + k)
    of_pair = get_row(work, pair_rows(slot, k) + STIFFNESS)
    return stiffness + where_above(bite, zero, of_pair, zero), force + bite * of_pair


@written
def _lift(k, bent, lifted, work):
    """Take the bite of a pair that the shared deflection lifts off; the sum of such bites."""
    bite = get_row(work, BITE + k)
    kept = where_above(bite, bent, bite, spread(work, 0.0))
    set_row(work, BITE + k, kept)
    return lifted + (bite - kept)


@written
def _total_load(numbers, rounds, first, last, slot, work):
    """Load of all pairs, and the sum of their stiffnesses.

    Pairs that the shared deflection lifts off get a bite of 0. Each of them raises the total, so
    the loop ends after at most as many rounds as there are pairs.
    """
    zero, shared = spread(work, 0.0), get_row(numbers, SHARED)

    def add(k, stiffness, force):
        return _add_load(k, slot, stiffness, force, work)

    def once(total, stiffness):
        stiffness, force = fold(first, last, add, (zero, zero))
        total = force / (1.0 + shared * stiffness)

        def lift(k, lifted):
            return (_lift(k, shared * total, lifted, work),)

        (lifted,) = fold(first, last, lift, (zero,))
        return any_above(lifted, zero), total, stiffness

    return tuple(repeat(rounds, once, (zero, zero)))


@written
def _followed_damping(damping, elastic, work):
    """Damping over the elastic force of a pair, at most what ``MOST_DAMPER`` allows."""
    most = get_row(work, layout.MOST_DAMPER)

    def limit():
        return (where_above(damping * elastic, most, most / elastic, damping),)

    return either(any_above(damping * elastic, most), limit, (damping,))[0]


@written
def _set_alone(numbers, k, slot, total, stiffness, work):
    """Set a pair's margin to its penetration into what the others deflect."""
    zero, shared = spread(work, 0.0), get_row(numbers, SHARED)
    bite = get_row(work, BITE + k)
    spring = get_row(work, pair_rows(slot, k) + STIFFNESS)
    others = stiffness - where_above(bite, zero, spring, zero)
    deep = get_row(work, MARGIN + k) - shared * total
    alone = deep * ((1.0 + shared * stiffness) / (1.0 + shared * others))
    set_row(work, MARGIN + k, where_above(bite, zero, alone, deep))


@written
def _elastic_force(numbers, k, slot, total, work):
    """Force of a pair's spring, negative where it does not touch."""
    bent = get_row(numbers, SHARED) * total
    spring = get_row(work, pair_rows(slot, k) + STIFFNESS)
    return (get_row(work, BITE + k) - bent) * spring


@written
def _damped_slope(group, k, slot, work):
    """Slope of the gap that the damping of a pair follows."""
    if is_helical(group):
        return get_row(work, chord_rows(slot, k) + layout.TOUCH_SLOPE)
    return get_row(work, pair_rows(slot, k) + GAP_SLOPE)


@written
def _touching_force(numbers, k, slot, total, work):
    """Force of a pair's spring, 0 where it does not touch."""
    zero, elastic = spread(work, 0.0), _elastic_force(numbers, k, slot, total, work)
    return where_above(get_row(work, BITE + k), zero, elastic, zero)


@written
def _with_pair(group, law, k, slot, elastic, damped, rate, ahead, work):
    """The law with what a pair adds, and the force of the pair."""
    zero, one = spread(work, 0.0), spread(work, 1.0)
    pair, bite, numbers = pair_rows(slot, k), get_row(work, BITE + k), group.numbers
    force = elastic * damped
    force = where_above(force, zero, force, zero)
    compliance = get_row(work, pair + COMPLIANCE)
    softening = 0.5 * elastic * elastic * get_row(work, pair + COMPLIANCE_SLOPE)
    slope, middle = get_row(work, pair + GAP_SLOPE), ahead
    if is_helical(group):
        middle = ahead - get_row(numbers, layout.HALF_LAG)
    position = get_row(work, pair + POSITION) + middle
    sliding, moment, reaction = rubbed(numbers, position, force)
    sums = Law(
        law.normal + force,
        law.friction + sliding,
        law.moment_p + moment,
        law.moment_w + reaction,
        law.along + force * slope + softening,
        law.stored + elastic * (bite - 0.5 * compliance * elastic),
        law.lost + (force - elastic) * rate,
        law.loaded + where_above(force, zero, one, zero),
    )
    return sums, force


@written
def _with_chord(group, law, k, slot, elastic, followed, rate, ahead, work):
    """The law with what the spring of a pair's chord leaves out."""
    zero, bite = spread(work, 0.0), get_row(work, BITE + k)
    pair, chord = pair_rows(slot, k), chord_rows(slot, k)
    slope = get_row(work, chord + layout.LEFT_OUT_SLOPE)
    left_out = get_row(work, chord + layout.LEFT_OUT) + ahead * slope
    force = elastic * (1.0 + followed * rate)
    damped = where_above(force, zero, force, zero) - elastic
    beyond = _damped_slope(group, k, slot, work) - get_row(work, pair + GAP_SLOPE)
    turned = damped * beyond - slope
    return law._replace(
        stored=law.stored + where_above(bite, zero, left_out, zero),
        along=law.along + where_above(bite, zero, turned, zero),
    )


@written
def _of_shared(numbers, total, work):
    """The law without pairs: the energy that the shared deflection takes from theirs."""
    zero = spread(work, 0.0)
    stored = 0.0 - 0.5 * get_row(numbers, SHARED) * total * total
    return Law(zero, zero, zero, zero, zero, stored, zero, zero)


@written
def _consistent(group, law, work):
    """The law, without a force on the roll where the roll's torque leaves it out."""
    along = chosen(group.consistent, law.along, spread(work, 0.0))
    return law._replace(along=along)


@written
def one_sided_law(
    group, first, last, slot, ahead, approach, approach_rate, roll_rate, work
):
    """One-sided contact of the gathered pairs, ``ahead`` m of roll after their reading.

    Rows ``MARGIN`` take the penetration of every pair into the body that the others deflect,
    negative without contact, and ``PAIR_FORCE`` its normal force.
    The damping of helical teeth follows the gap of their first touch, because the gaps of chords
    jump from one to the next. The energy that the springs of chords leave out is stored too.
    """
    numbers = group.numbers
    damping = get_row(numbers, layout.DAMPING)

    def touch(k):
        bite = _touch(k, slot, ahead, approach, work)
        set_row(work, MARGIN + k, bite)
        return ()

    fold(first, last, touch, ())
    rounds = MOST_PAIRS if is_helical(group) else N_PAIRS
    total, stiffness = _total_load(numbers, rounds, first, last, slot, work)

    def rate_of(k):
        return approach_rate - _damped_slope(group, k, slot, work) * roll_rate

    def press(k, *law):
        _set_alone(numbers, k, slot, total, stiffness, work)
        elastic = _touching_force(numbers, k, slot, total, work)
        rate = rate_of(k)
        damped = 1.0 + _followed_damping(damping, elastic, work) * rate
        pressed = elastic, damped, rate, ahead
        law, force = _with_pair(group, Law(*law), k, slot, *pressed, work)
        set_row(work, PAIR_FORCE + k, force)
        set_row(work, layout.PAIR_DAMPED + k, damped)
        return law

    def leave_out(k, *law):
        elastic, rate = _elastic_force(numbers, k, slot, total, work), rate_of(k)
        followed = _followed_damping(damping, elastic, work)
        pressed = elastic, followed, rate, ahead
        return _with_chord(group, Law(*law), k, slot, *pressed, work)

    law = fold(first, last, press, _of_shared(numbers, total, work))
    if is_helical(group):
        set_row(work, layout.TOTAL, total)
        law = fold(first, last, leave_out, law)
    return _consistent(group, Law(*law), work)


@written
def _share(numbers, k, slot, ahead, work):
    """Share of a pair in contact under the paper's law; below 0 and above 1 far from its ends."""
    half_lag = get_row(numbers, layout.HALF_LAG)
    path = get_row(numbers, layout.PATH) + 2.0 * half_lag
    pair = pair_rows(slot, k)
    position = get_row(work, pair + POSITION) + ahead
    inside = where_above(position, path - position, path - position, position)
    share = 0.5 * (1.0 + inside * get_row(numbers, layout.PER_SWITCH_WIDTH))
    spring = get_row(work, pair + STIFFNESS)
    return where_above(spring, spread(work, 1e-20), share, spread(work, -1.0))


@written
def _add_share(k, slot, share, stiffness, loaded, work):
    """Set a pair's part of the stiffness, and add it and the number of loaded pairs."""
    zero, one = spread(work, 0.0), spread(work, 1.0)
    share = _clip(share, zero, one)
    entered = where_above(share, zero, one, zero)
    of_pair = share * get_row(work, pair_rows(slot, k) + STIFFNESS)
    set_row(work, BITE + k, of_pair)
    loaded = loaded + entered + where_above(one, share, zero, one)
    return stiffness + of_pair, loaded


@written
def papers_law(numbers, first, last, slot, ahead, approach, approach_rate, work):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs switched over one integration step.

    Rows ``MARGIN`` take the share of every pair in contact, from 0 to 1 and beyond, ``PAIR_FORCE``
    its force.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    shared, damping = get_row(numbers, SHARED), get_row(numbers, layout.DAMPING)
    half_lag = get_row(numbers, layout.HALF_LAG)

    def share_out(k, stiffness, loaded):
        share = _share(numbers, k, slot, ahead, work)
        set_row(work, MARGIN + k, share)
        return _add_share(k, slot, share, stiffness, loaded, work)

    stiffness, loaded = fold(first, last, share_out, (zero, zero))
    together = stiffness / (1.0 + shared * stiffness)
    normal = together * approach + damping * approach_rate
    divisor = where_above(stiffness, zero, stiffness, one)
    per_stiffness = where_above(stiffness, zero, 1.0 / divisor, zero)

    def press(k, friction, moment_p, moment_w):
        position = get_row(work, pair_rows(slot, k) + POSITION) + (ahead - half_lag)
        part = normal * get_row(work, BITE + k) * per_stiffness
        set_row(work, PAIR_FORCE + k, part)
        sliding, moment, reaction = rubbed(numbers, position, part)
        return friction + sliding, moment_p + moment, moment_w + reaction

    rubbing = fold(first, last, press, (zero, zero, zero))
    stored = 0.5 * together * approach * approach
    lost = damping * approach_rate * approach_rate
    return Law._make([normal, *rubbing, zero, stored, lost, loaded])


@compiled
def coast_law(group, lane, work, wide):
    """Contact on the back flanks of one lane, added to its drive law.

    Healthy teeth without errors, no friction. Teeth count backwards along the mirrored roll. The
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


@written
def mesh_law(group, first, last, slot, turned, approach, rate, roll_rate, work, wide):
    """The law of the chosen kind in every lane, on either flank, ``turned`` m after ``BASE``."""
    ahead = turned - get_row(work, layout.AHEAD + slot)
    read = first, last, slot, ahead, approach, rate

    def one_sided():
        law = one_sided_law(group, *read, roll_rate, work)
        return with_coast(group, law, turned, approach, rate, roll_rate, work, wide)

    def papers():
        return papers_law(group.numbers, *read, work)

    return Law(*choose(group.one_sided, one_sided, papers))


@written
def with_coast(group, law, turned, approach, rate, roll_rate, work, wide):
    """The law of the drive flanks with that of the back flanks, in the lanes that touch there."""

    def touch():
        _set_contact(law, turned, approach, rate, roll_rate, work)
        call(_coast, group, work, wide)
        return _set_law(work)

    beyond = any_above(0.0 - get_row(group.numbers, BACKLASH), approach)
    return Law(*either(beyond, touch, law))


@compiled
def _coast(group, work, wide):
    """Add the law of the back flanks in the lanes that touch there."""
    n = width(work)
    for lane in range(n):
        coast = work[at(layout.MOTION_APPROACH, lane, n)]
        if coast < -group.numbers[at(BACKLASH, lane, n)]:
            coast_law(group, lane, work, wide)


@written
def _set_contact(law, turned, approach, rate, roll_rate, work):
    """Set the rows that ``coast_law`` reads and adds to."""
    for row, value in enumerate(law):
        set_row(work, LAW + row, value)
    set_row(work, layout.MOTION_ROLL, turned)
    set_row(work, layout.MOTION_APPROACH, approach)
    set_row(work, layout.MOTION_RATE, rate)
    set_row(work, layout.MOTION_ROLL_RATE, roll_rate)


@written
def _set_law(work):
    return Law._make(get_row(work, LAW + row) for row in range(N_LAW))
