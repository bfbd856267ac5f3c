"""Compiled core: the law of the gear mesh, four records side by side.

The symbols are those of ``docs/theory/spur_dynamics.md``. Arrays are flat;
a row is ``LANES`` numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gensig.dynamics._vector import (
    LANES,
    any_above,
    compiled,
    inlined,
    load,
    spread,
    store,
    transpose,
    where_above,
)
from gensig.mesh.pair_table import FIRST_PITCH, N_PAIRS

# pairs this much further apart than the approach are followed through a step, m: none comes closer as fast
NEAR = 2e-5
FAR = 1.0  # gap of a pair that is not there, m
FAR_NEAR = 1e-4  # approaches below are asked of the pairs between FIRST_NEAR and LAST_NEAR only, m

# rows of Group.numbers
(
    PINION_RADIUS, WHEEL_RADIUS, PITCH, PER_PITCH, NODES_PER_METER, PATH, PITCH_POINT, START_CURVATURE, TANGENT_LENGTH,
    SHARED, DAMPING, FRICTION, PER_FRICTION_WIDTH, PER_SWITCH_WIDTH, BACKLASH, START_ROLL, SPEED, FIRST_NEAR, LAST_NEAR,
    N_NUMBERS,
) = range(20)  # fmt: skip
# rows of Group.places
(
    PINION_TEETH, WHEEL_TEETH, START_PINION, START_WHEEL, PINION_TOOTH, WHEEL_TOOTH, TABLE, STRIDE, LAST_CELL,
    SOUND_WHEEL, N_PLACES,
) = range(11)  # fmt: skip
# rows of one pair in a slot of the scratch
OWN, OWN_SLOPE, GAP, GAP_SLOPE, STIFFNESS, POSITION, N_KEPT = range(7)
N_SLOTS = 7  # 0: back flanks; 1, 2: begin and end of a step; 3: its middle; 4: middle of a part; 5, 6: its ends
COLUMNS = 4  # of a table: compliance, its slope, gap, its slope
# rows of the scratch behind the slots
BITE, ROLL = 0, N_PAIRS
WITHIN, CHANGED, LAW = ROLL + N_SLOTS, ROLL + N_SLOTS + 1, ROLL + N_SLOTS + 2
N_LAW = 8
SLOT_ROWS = N_PAIRS * N_KEPT
# rows of the pair counts behind those of the slots
WANTED, NEWEST, NEWEST_PINION, NEWEST_WHEEL, N_COUNTS = range(N_SLOTS, N_SLOTS + 5)


class Group(NamedTuple):
    """``LANES`` gear meshes of the same kind, with the machines around them.

    ``numbers`` and ``places`` hold rows as named above; ``table`` holds, lane after lane, the distinct teeth of both
    gears (row, node, [c, c', g, g']); ``tooth_row`` and ``tooth_error`` the row of every tooth (-1 for a missing
    one) and its gap offset in m. The machine is M q'' + C q' + K q = f + mesh forces, K and C as triplets, q the
    deviation from nominal rotation. ``dofs`` are the degrees of freedom of pinion x, y, rotation, wheel x, y, rotation,
    -1 where a machine has none.
    """

    numbers: Any
    places: Any
    table: Any
    tooth_row: Any
    tooth_error: Any
    one_sided: bool
    consistent: bool
    dofs: Any
    inverse_mass: Any
    stiffness_row: Any
    stiffness_column: Any
    stiffness_value: Any
    damping_row: Any
    damping_column: Any
    damping_value: Any
    force: Any


@inlined
def at_row(numbers, row):
    return load(numbers, row * LANES)


@inlined
def _clip(x, low, high):
    x = where_above(low, x, low, x)
    return where_above(x, high, high, x)


@compiled
def gather(numbers, places, table, tooth_row, tooth_error, roll_row, within_row, slot, work, near):
    """Read the tables: the pairs that touch within an approach, in every wanted lane; returns the most of any lane.

    What is kept goes to ``slot``: gap, own compliance and its inverse, their slopes, position. ``near`` (slot, lane)
    counts the pairs; of its last rows one says which lanes are wanted, the others remember the newest pair's teeth.
    """
    most = 0
    base = slot * SLOT_ROWS
    for lane in range(LANES):
        if near[WANTED * LANES + lane] == 0:
            most = max(most, near[slot * LANES + lane])
            continue
        roll, within = work[roll_row * LANES + lane], work[within_row * LANES + lane]
        pitch = numbers[PITCH * LANES + lane]
        n_pinion, n_wheel = places[PINION_TEETH * LANES + lane], places[WHEEL_TEETH * LANES + lane]
        newest = int(np.floor(roll * numbers[PER_PITCH * LANES + lane])) + 1
        if newest != near[NEWEST * LANES + lane]:
            near[NEWEST * LANES + lane] = newest
            near[NEWEST_PINION * LANES + lane] = (newest + places[START_PINION * LANES + lane]) % n_pinion
            near[NEWEST_WHEEL * LANES + lane] = (newest + places[START_WHEEL * LANES + lane]) % n_wheel
        tooth_p, tooth_w = near[NEWEST_PINION * LANES + lane], near[NEWEST_WHEEL * LANES + lane]
        first_p, first_w = places[PINION_TOOTH * LANES + lane], places[WHEEL_TOOTH * LANES + lane]
        start, stride = places[TABLE * LANES + lane], places[STRIDE * LANES + lane]
        last, nodes = places[LAST_CELL * LANES + lane], numbers[NODES_PER_METER * LANES + lane]
        lowest, highest = numbers[FIRST_NEAR * LANES + lane], numbers[LAST_NEAR * LANES + lane]
        position = roll - newest * pitch
        count = 0
        for _ in range(N_PAIRS):
            if not (lowest <= position <= highest or within >= FAR_NEAR):
                row_p, row_w = -1, -1
            else:
                row_p, row_w = tooth_row[first_p + tooth_p], tooth_row[first_w + tooth_w]
            if row_p >= 0 and row_w >= 0:
                x = (position - FIRST_PITCH * pitch) * nodes
                cell = min(max(int(x), 0), last)
                p, w = start + row_p * stride + cell * COLUMNS, start + row_w * stride + cell * COLUMNS
                low, high = load(table, p) + load(table, w), load(table, p + COLUMNS) + load(table, w + COLUMNS)
                here = (base + count * N_KEPT) * LANES
                store(work, here + lane * COLUMNS, low + spread(x - cell) * (high - low))
                gap = work[here + lane * COLUMNS + 2] + tooth_error[first_p + tooth_p] + tooth_error[first_w + tooth_w]
                if gap < within:
                    work[here + lane * COLUMNS + 2] = gap
                    work[here + POSITION * LANES + lane] = position
                    count += 1
            position += pitch
            tooth_p = tooth_p - 1 if tooth_p > 0 else n_pinion - 1
            tooth_w = tooth_w - 1 if tooth_w > 0 else n_wheel - 1
        near[slot * LANES + lane] = count
        most = max(most, count)
    nobody = transpose(spread(1.0), spread(0.0), spread(FAR), spread(0.0))[0]
    for lane in range(LANES):
        for k in range(near[slot * LANES + lane], most):
            here = (base + k * N_KEPT) * LANES
            store(work, here + lane * COLUMNS, nobody)
            work[here + POSITION * LANES + lane] = -FAR
    for k in range(most):
        here = (base + k * N_KEPT) * LANES
        own, own_slope, gap, gap_slope = transpose(
            load(work, here), load(work, here + LANES), load(work, here + 2 * LANES), load(work, here + 3 * LANES)
        )
        own = own - at_row(numbers, SHARED)
        store(work, here + OWN * LANES, own)
        store(work, here + OWN_SLOPE * LANES, own_slope)
        store(work, here + GAP * LANES, gap)
        store(work, here + GAP_SLOPE * LANES, gap_slope)
        store(work, here + STIFFNESS * LANES, spread(1.0) / own)
    return most


@inlined
def _sliding(numbers, position):
    """Direction of sliding, smooth through the pitch point, -1 before it and 1 after it."""
    one = spread(1.0)
    x = (position - at_row(numbers, PITCH_POINT)) * at_row(numbers, PER_FRICTION_WIDTH)
    x = _clip(x, spread(0.0) - one, one)
    return x * (spread(1.5) - spread(0.5) * x * x)


@inlined
def _rubbed(numbers, position, load_of_pair):
    """Friction force, and its moments about pinion and wheel."""
    force = at_row(numbers, FRICTION) * load_of_pair * _sliding(numbers, position)
    arm = at_row(numbers, START_CURVATURE) + _clip(position, spread(0.0), at_row(numbers, PATH))
    return force, spread(0.0) - force * arm, force * (at_row(numbers, TANGENT_LENGTH) - arm)


@inlined
def _total_load(numbers, most, slot, extra, work):
    """Load of all pairs; those that the shared deflection lifts off get a bite of 0.

    Each that leaves raises the total, so the loop ends after at most ``most`` rounds.
    """
    zero, shared = spread(0.0), at_row(numbers, SHARED)
    total = zero
    for _ in range(N_PAIRS):
        stiffness, force = zero, zero
        for k in range(most):
            bite = load(work, (extra + BITE + k) * LANES)
            own = load(work, (slot * SLOT_ROWS + k * N_KEPT + STIFFNESS) * LANES)
            stiffness = stiffness + where_above(bite, zero, own, zero)
            force = force + bite * own
        total = force / (spread(1.0) + shared * stiffness)
        lifted = zero
        for k in range(most):
            bite = load(work, (extra + BITE + k) * LANES)
            kept = where_above(bite, shared * total, bite, zero)
            lifted = lifted + (bite - kept)
            store(work, (extra + BITE + k) * LANES, kept)
        if not any_above(lifted, zero):
            break
    return total


@inlined
def one_sided_law(numbers, consistent, most, slot, extra, ahead, approach, approach_rate, roll_rate, work):
    """One-sided contact of the gathered pairs, ``ahead`` m of roll after the instant they were gathered at.

    Normal force, friction force, friction moments about pinion and wheel, force on the roll coordinate (energy
    balance), stored energy, power lost in mesh damping, number of loaded pairs; a vector each.
    """
    zero, one, half = spread(0.0), spread(1.0), spread(0.5)
    shared, damping = at_row(numbers, SHARED), at_row(numbers, DAMPING)
    # beyond half the backlash the teeth touch on their back flanks, if at all
    driven = approach + half * at_row(numbers, BACKLASH)
    for k in range(most):
        pair = slot * SLOT_ROWS + k * N_KEPT
        gap = load(work, (pair + GAP) * LANES) + ahead * load(work, (pair + GAP_SLOPE) * LANES)
        bite = where_above(approach, gap, approach - gap, zero)
        store(work, (extra + BITE + k) * LANES, where_above(driven, zero, bite, zero))
    total = _total_load(numbers, most, slot, extra, work)
    normal, friction, moment_p, moment_w, along, lost, loaded = zero, zero, zero, zero, zero, zero, zero
    stored = zero - half * shared * total * total
    for k in range(most):
        pair = slot * SLOT_ROWS + k * N_KEPT
        bite = load(work, (extra + BITE + k) * LANES)
        slope = load(work, (pair + GAP_SLOPE) * LANES)
        elastic = (bite - shared * total) * load(work, (pair + STIFFNESS) * LANES)
        elastic = where_above(bite, zero, elastic, zero)
        rate = approach_rate - slope * roll_rate
        force = elastic * (one + damping * rate)
        force = where_above(force, zero, force, zero)
        normal = normal + force
        loaded = loaded + where_above(force, zero, one, zero)
        stored = stored + elastic * (bite - half * load(work, (pair + OWN) * LANES) * elastic)
        lost = lost + (force - elastic) * rate
        along = along + force * slope + half * elastic * elastic * load(work, (pair + OWN_SLOPE) * LANES)
        position = load(work, (pair + POSITION) * LANES) + ahead
        sliding, moment, reaction = _rubbed(numbers, position, force)
        friction, moment_p, moment_w = friction + sliding, moment_p + moment, moment_w + reaction
    if not consistent:
        along = zero
    return normal, friction, moment_p, moment_w, along, stored, lost, loaded


@inlined
def papers_law(numbers, most, slot, extra, ahead, approach, approach_rate, work):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs in and out over one integration step."""
    zero, one, half = spread(0.0), spread(1.0), spread(0.5)
    shared, damping, path = at_row(numbers, SHARED), at_row(numbers, DAMPING), at_row(numbers, PATH)
    stiffness, loaded = zero, zero
    for k in range(most):
        pair = slot * SLOT_ROWS + k * N_KEPT
        position = load(work, (pair + POSITION) * LANES) + ahead
        inside = where_above(position, path - position, path - position, position)
        share = _clip(half * (one + inside * at_row(numbers, PER_SWITCH_WIDTH)), zero, one)
        loaded = loaded + where_above(share, zero, one, zero) + where_above(one, share, zero, one)
        own = share * load(work, (pair + STIFFNESS) * LANES)
        store(work, (extra + BITE + k) * LANES, own)
        stiffness = stiffness + own
    together = stiffness / (one + shared * stiffness)
    normal = together * approach + damping * approach_rate
    per_stiffness = where_above(stiffness, zero, one / where_above(stiffness, zero, stiffness, one), zero)
    friction, moment_p, moment_w = zero, zero, zero
    for k in range(most):
        position = load(work, (slot * SLOT_ROWS + k * N_KEPT + POSITION) * LANES) + ahead
        part = normal * load(work, (extra + BITE + k) * LANES) * per_stiffness
        sliding, moment, reaction = _rubbed(numbers, position, part)
        friction, moment_p, moment_w = friction + sliding, moment_p + moment, moment_w + reaction
    stored, lost = half * together * approach * approach, damping * approach_rate * approach_rate
    return normal, friction, moment_p, moment_w, zero, stored, lost, loaded


@compiled
def coast_law(numbers, places, table, tooth_row, consistent, lane, roll, approach, rate, roll_rate, work, law):
    """Contact on the back flanks of one lane, written over its drive law; sound teeth without errors, no friction.

    Teeth count backwards along the mirrored roll. What is kept of the pairs goes to slot 0 and the lane's bites.
    """
    pitch, shared = numbers[PITCH * LANES + lane], numbers[SHARED * LANES + lane]
    mirrored = 2.0 * numbers[PITCH_POINT * LANES + lane] + 0.5 * pitch - roll
    within = -approach - numbers[BACKLASH * LANES + lane]
    newest = int(np.floor(mirrored / pitch)) + 1
    start, stride = places[TABLE * LANES + lane], places[STRIDE * LANES + lane]
    wheel = places[SOUND_WHEEL * LANES + lane] * stride
    bites = (N_SLOTS * SLOT_ROWS + BITE) * LANES + lane
    for k in range(N_PAIRS):
        tooth_p = (places[START_PINION * LANES + lane] - newest + k) % places[PINION_TEETH * LANES + lane]
        tooth_w = (places[START_WHEEL * LANES + lane] - newest + k) % places[WHEEL_TEETH * LANES + lane]
        there = (
            tooth_row[places[PINION_TOOTH * LANES + lane] + tooth_p] >= 0
            and tooth_row[places[WHEEL_TOOTH * LANES + lane] + tooth_w] >= 0
        )
        x = (mirrored - (newest - k) * pitch - FIRST_PITCH * pitch) * numbers[NODES_PER_METER * LANES + lane]
        cell = min(max(int(x), 0), places[LAST_CELL * LANES + lane])
        p = start + cell * COLUMNS
        here = k * N_KEPT * LANES + lane
        for column, row in ((0, OWN), (1, OWN_SLOPE), (2, GAP), (3, GAP_SLOPE)):
            low, high = (
                table[p + column] + table[p + wheel + column],
                table[p + 4 + column] + table[p + wheel + 4 + column],
            )
            work[here + row * LANES] = low + (x - cell) * (high - low)
        work[here + OWN * LANES] -= shared
        bite = within - work[here + GAP * LANES]
        work[bites + k * LANES] = bite if there and bite > 0.0 else 0.0
    total = 0.0
    for _ in range(N_PAIRS):
        stiffness, force, lifted = 0.0, 0.0, False
        for k in range(N_PAIRS):
            if work[bites + k * LANES] > 0.0:
                stiffness += 1.0 / work[(k * N_KEPT + OWN) * LANES + lane]
                force += work[bites + k * LANES] / work[(k * N_KEPT + OWN) * LANES + lane]
        total = force / (1.0 + shared * stiffness)
        for k in range(N_PAIRS):
            if 0.0 < work[bites + k * LANES] <= shared * total:
                work[bites + k * LANES] = 0.0
                lifted = True
        if not lifted:
            break
    normal, along, stored, lost, loaded = 0.0, 0.0, -0.5 * shared * total * total, 0.0, 0.0
    for k in range(N_PAIRS):
        bite, here = work[bites + k * LANES], k * N_KEPT * LANES + lane
        if bite > 0.0:
            own, slope = work[here + OWN * LANES], work[here + GAP_SLOPE * LANES]
            elastic = (bite - shared * total) / own
            pair_rate = slope * roll_rate - rate
            part = max(0.0, elastic * (1.0 + numbers[DAMPING * LANES + lane] * pair_rate))
            normal += part
            loaded += part > 0.0
            stored += elastic * (bite - 0.5 * own * elastic)
            lost += (part - elastic) * pair_rate
            along += part * slope + 0.5 * elastic * elastic * work[here + OWN_SLOPE * LANES]
    values = (-normal, 0.0, 0.0, 0.0, -along if consistent else 0.0, stored, lost, -loaded)
    for row in range(N_LAW):
        work[(law + row) * LANES + lane] = values[row]


@inlined
def mesh_law(
    numbers, places, table, tooth_row, one_sided, consistent, most, slot, ahead, roll, approach, rate, roll_rate, work
):
    """The law of the chosen kind in every lane, on whichever flank it touches."""
    extra = N_SLOTS * SLOT_ROWS
    if one_sided:
        law = one_sided_law(numbers, consistent, most, slot, extra, ahead, approach, rate, roll_rate, work)
        play = spread(0.0) - at_row(numbers, BACKLASH)
        if any_above(play, approach):
            rows = extra + LAW
            for row in range(N_LAW):
                store(work, (rows + row) * LANES, law[row])
            motion = rows + N_LAW
            store(work, motion * LANES, roll)
            store(work, (motion + 1) * LANES, approach)
            store(work, (motion + 2) * LANES, rate)
            store(work, (motion + 3) * LANES, roll_rate)
            for lane in range(LANES):
                if work[(motion + 1) * LANES + lane] < -numbers[BACKLASH * LANES + lane]:
                    coast_law(
                        numbers, places, table, tooth_row, consistent, lane, work[motion * LANES + lane],
                        work[(motion + 1) * LANES + lane], work[(motion + 2) * LANES + lane],
                        work[(motion + 3) * LANES + lane], work, rows,
                    )  # fmt: skip
            law = (
                load(work, rows * LANES), load(work, (rows + 1) * LANES), load(work, (rows + 2) * LANES),
                load(work, (rows + 3) * LANES), load(work, (rows + 4) * LANES), load(work, (rows + 5) * LANES),
                load(work, (rows + 6) * LANES), load(work, (rows + 7) * LANES),
            )  # fmt: skip
    else:
        law = papers_law(numbers, most, slot, extra, ahead, approach, rate, work)
    return law
