"""Compiled core: fixed-step fourth-order Runge-Kutta integrator, several records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or
reorders sums: a record's bits depend on nothing but its own numbers. Arrays are flat; a row holds
one number for every record of the group.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    P_TURN,
    accelerate,
    event,
    motion,
    own_turn,
    recenter,
    set_out,
)
from gensig.dynamics._layout import (
    AHEAD,
    BASE,
    EVEN,
    MIDDLE,
    NOMINAL,
    ODD,
    PART,
    ROLL,
    Group,
    HelicalGroup,
    chord_rows,
    is_helical,
    machine_rows,
    pair_rows,
    span_index,
)
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._tableau import RK4
from gensig.dynamics._tables import between, chords_between, cover, gather
from gensig.dynamics._vector import (
    any_above,
    at,
    compiled,
    get_row,
    inlined,
    n_lanes,
    set_row,
    spread,
    where_above,
    width,
)

RECENTER = 256  # steps between two removals of the drift of the rotations, to keep numbers small
ROUNDS = 20  # of ``law_at``, in which chords and the deflection they share converge
N_STAGES = len(RK4.node)
LAST_STAGE = N_STAGES - 1


@compiled
def integrate(
    group,
    state,
    lost,
    fresh,
    step,
    first_step,
    n_steps,
    channels,
    out,
    out_row,
    angle,
    angle_row,
    per_angle,
    seen,
    work,
    wide,
    near,
):
    """Advance every lane by ``n_steps`` of classical RK4.

    The tables are read once a step, at the roll where it will end. The middle follows from both
    ends, and the small differences between stages from the slope of the gap. A step in which a
    pair takes up or releases its load is repeated in two parts that meet there, in the lanes
    where that happens: the force has a kink there, which would otherwise limit the accuracy.

    Parameters
    ----------
    state : (2, dof, lane)    q and v, advanced in place; the pinion has also turned by
        ``wide[CENTER]``
    lost : (lane,)            the number of steps without contact is added
    fresh : (lane,)           1 where the state is new: its tables are read first. 0 continues as
        if the last call of this group, step and scratch had not ended, so the ends of calls leave
        no trace
    out : (step, channel, lane)    takes, from row ``out_row`` on, the mean acceleration over each
        step: velocity gained by the equations, over the step. Kinks then alias far less than with
        point values. A negative row stores nothing
    angle : (sample, lane)    takes, from row ``angle_row`` on, the pinion's angle in rad since
        time 0 at the begin of every step whose number ``per_angle`` divides; a negative row
        stores nothing
    seen : (sample, N_SEEN, lane)    takes the state of the pairs at the same steps; may be empty
    work, wide, near : ``scratch`` of the group

    Returns
    -------
    the next row of ``angle``
    """
    n = width(work)
    numbers = group.numbers
    n_dof = len(group.force) // n
    n_channels = len(channels) if out_row >= 0 else 0
    zero, one = spread(work, 0.0), spread(work, 1.0)
    # rows of states, each q and then v; see _layout
    now = machine_rows(layout.NOW, n_dof)
    single = machine_rows(layout.SINGLE, n_dof)
    parted = machine_rows(layout.PARTED, n_dof)
    trial_a = machine_rows(layout.TRIAL_A, n_dof)
    trial_b = machine_rows(layout.TRIAL_B, n_dof)
    a = machine_rows(layout.ACCELERATIONS, n_dof)
    sum_q = machine_rows(layout.SUM_Q, n_dof)
    sum_v = machine_rows(layout.SUM_V, n_dof)
    drive = machine_rows(layout.BEHIND, n_dof)
    forces = drive + layout.N_DRIVE
    mean = forces + n_dof
    part_mean = mean + n_channels
    margin = spread(work, layout.NEAR if group.one_sided else 2.0 * layout.FAR)
    radius = get_row(numbers, layout.PINION_RADIUS)
    set_row(work, layout.MOST_DAMPER, spread(work, layout.UNLIMITED))
    begin, end = EVEN, ODD
    for i in range(2 * n_dof):
        set_row(work, now + i, get_row(state, i))
    for lane in range(n):
        if fresh[lane] > 0.0:
            near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
    for number in range(first_step, first_step + n_steps):
        if number % RECENTER == 0:
            recenter(group, now, n_dof, work, wide)
        set_out(group, number * step, now, drive, forces, work, wide)
        seen_row = -1
        if angle_row >= 0 and number % per_angle == 0:
            for lane in range(n):
                turned = wide[at(NOMINAL, lane, n)] + work[at(now + P_TURN, lane, n)]
                angle[at(angle_row, lane, n)] = turned
            if len(seen) > 0:
                seen_row = angle_row
                for k in range(layout.MOST_PAIRS):
                    set_row(work, layout.PAIR_FORCE + k, zero)
            angle_row += 1
        speed = get_row(work, drive + layout.DRIVE_SPEED)
        gain = get_row(work, drive + layout.DRIVE_GAIN)
        approach, rate = motion(group, now, now + n_dof, work)
        set_row(work, layout.WITHIN, approach + margin)
        turning = radius * (speed + own_turn(group, now + n_dof, work))
        set_row(work, AHEAD + end, step * turning)
        if number == first_step:
            for lane in range(n):
                if fresh[lane] > 0.0:
                    wide[at(ROLL + begin, lane, n)] = wide[at(BASE, lane, n)]
                    mean_force = numbers[at(layout.MEAN_FORCE, lane, n)]
                    work[at(layout.LAST_TOTAL, lane, n)] = mean_force
        if is_helical(group):
            bent = get_row(numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
            set_row(work, layout.LOCAL, approach + 0.5 * step * rate - bent)
        set_row(work, layout.FLAGS, one)
        if number == first_step:
            set_row(work, AHEAD + begin, zero)
            gather(group, begin, True, work, wide, near)
        roll_ahead(end, work, wide)
        if gather(group, end, True, work, wide, near):
            gather(group, begin, False, work, wide, near)
        for lane in range(n):
            ahead = wide[at(ROLL + begin, lane, n)] - wide[at(BASE, lane, n)]
            work[at(AHEAD + begin, lane, n)] = ahead
        first, last = near_pairs(begin, n, near)
        first_end, last_end = near_pairs(end, n, near)
        first, last = min(first, first_end), max(last, last_end)
        cover(begin, first, last, work, near)
        cover(end, first, last, work, near)
        q_0 = own_turn(group, now, work)
        changed, share = zero, zero
        n_parts, part = 1, 0
        while part < n_parts:
            source, target, slot_0, slot_1 = now, single, begin, end
            h, offset = spread(work, step), zero
            if part == 1:
                target, slot_1, h = parted, PART, share * step
            elif part == 2:
                source, target, slot_0 = parted, parted, PART
                h, offset = (1.0 - share) * step, share * step
            between(slot_0, slot_1, MIDDLE, first, last, work)
            if is_helical(group):
                chords_between(slot_0, slot_1, MIDDLE, first, last, work)
            half = RK4.node[1] * h
            at_stage, next_stage, spare = source, trial_a, trial_b
            loaded = zero
            for stage in range(N_STAGES):
                # the stages in the middle are alike
                since, slot, rows = half, MIDDLE, -1
                if stage == 0:
                    since, slot, rows = zero, slot_0, layout.MARGIN
                elif stage == LAST_STAGE:
                    since, slot, rows = h, slot_1, layout.MARGIN + layout.MOST_PAIRS
                since = offset + since
                q, v = at_stage, at_stage + n_dof
                approach, rate = motion(group, q, v, work)
                deviation = own_turn(group, q, work) - q_0
                turned = radius * ((speed + 0.5 * gain * since) * since + deviation)
                roll_rate = radius * (speed + gain * since + own_turn(group, v, work))
                law = mesh_law(
                    group,
                    first,
                    last,
                    slot,
                    rows,
                    turned,
                    approach,
                    rate,
                    roll_rate,
                    work,
                    wide,
                )
                torque = get_row(work, drive + layout.DRIVE_TORQUE)
                accelerate(group, law, q, v, torque, forces, a, work)
                if part == 0 and stage == 0:
                    loaded = law.loaded
                    if seen_row >= 0:
                        write_mesh(seen, seen_row, law.normal, work, near)
                    apart = where_above(law.normal * law.normal, zero, zero, one)
                    set_row(lost, 0, get_row(lost, 0) + apart)
                elif part == 0:
                    differs = law.loaded - loaded
                    changed = where_above(differs * differs, zero, one, changed)
                    set_row(work, layout.STEP_APPROACH, approach)
                    if stage == LAST_STAGE and is_helical(group):
                        total = get_row(work, layout.TOTAL)
                        set_row(work, layout.LAST_TOTAL, total)
                if stage == LAST_STAGE:
                    break
                reach = half
                if stage == LAST_STAGE - 1:
                    reach = h
                for d in range(n_dof):
                    gained = get_row(work, a + d)
                    moved = get_row(work, source + d) + reach * get_row(work, v + d)
                    set_row(work, next_stage + d, moved)
                    speed_0 = get_row(work, source + n_dof + d)
                    set_row(work, next_stage + n_dof + d, speed_0 + reach * gained)
                    if stage == 0:
                        set_row(work, sum_q + d, RK4.position[0] * gained)
                        set_row(work, sum_v + d, RK4.weight[0] * gained)
                    else:
                        more_q = get_row(work, sum_q + d) + RK4.position[1] * gained
                        more_v = get_row(work, sum_v + d) + RK4.weight[1] * gained
                        set_row(work, sum_q + d, more_q)
                        set_row(work, sum_v + d, more_v)
                at_stage, next_stage, spare = next_stage, spare, next_stage
            per_sum = h * RK4.share
            for d in range(n_dof):
                last_gained = RK4.weight[LAST_STAGE] * get_row(work, a + d)
                gained = get_row(work, sum_v + d) + last_gained
                set_row(work, sum_v + d, gained)
                speed_0 = get_row(work, source + n_dof + d)
                moved = h * (speed_0 + per_sum * get_row(work, sum_q + d))
                set_row(work, target + d, get_row(work, source + d) + moved)
                set_row(work, target + n_dof + d, speed_0 + per_sum * gained)
            for c in range(n_channels):
                value = get_row(work, sum_v + channels[c]) * RK4.share
                carried = gain * get_row(group.rotation, channels[c])
                if part == 0:
                    set_row(work, mean + c, value + carried)
                elif part == 1:
                    set_row(work, part_mean + c, share * value)
                else:
                    value = get_row(work, part_mean + c) + (1.0 - share) * value
                    set_row(work, part_mean + c, value + carried)
            part += 1
            if n_parts == 1 and any_above(changed, zero):
                n_parts = 3
                set_row(work, layout.WITHIN, get_row(work, layout.WITHIN) - margin)
                share = event(group, first, last, work)
                set_row(work, layout.WITHIN, get_row(work, layout.WITHIN) + margin)
                set_row(work, layout.FLAGS, changed)
                set_row(work, AHEAD + PART, share * get_row(work, AHEAD + end))
                roll_ahead(PART, work, wide)
                gather(group, PART, False, work, wide, near)
                first_part, last_part = near_pairs(PART, n, near)
                first, last = min(first, first_part), max(last, last_part)
                cover(begin, first, last, work, near)
                cover(PART, first, last, work, near)
                cover(end, first, last, work, near)
        if n_parts > 1:
            choose_rows(changed, parted, single, 2 * n_dof, work)
            choose_rows(changed, part_mean, mean, n_channels, work)
        out_first = (out_row + number - first_step) * n_channels
        for c in range(n_channels):
            set_row(out, out_first + c, get_row(work, mean + c))
        now, single = single, now
        begin, end = end, begin
    if begin == ODD:
        keep_begin(work, wide, near)
    for i in range(2 * n_dof):
        set_row(state, i, get_row(work, now + i))
    return angle_row


integrates(integrate, Group, HelicalGroup)


@inlined
def roll_ahead(slot, work, wide):
    """Set the roll of a slot to that at the begin of the step plus ``AHEAD``."""
    n = width(work)
    for lane in range(n):
        roll = wide[at(BASE, lane, n)] + work[at(AHEAD + slot, lane, n)]
        wide[at(ROLL + slot, lane, n)] = roll


@inlined
def near_pairs(slot, n, near):
    """First pair near its mate in a slot, and the number behind the last one."""
    span = span_index(slot, n)
    return near[span + layout.FIRST_NEAR_PAIR], near[span + layout.LAST_NEAR_PAIR]


@inlined
def choose_rows(flags, source, target, n_rows, work):
    """Copy rows from ``source`` to ``target`` in the lanes whose flag is above 0."""
    zero = spread(work, 0.0)
    for i in range(n_rows):
        taken, kept = get_row(work, source + i), get_row(work, target + i)
        set_row(work, target + i, where_above(flags, zero, taken, kept))


@inlined
def keep_begin(work, wide, near):
    """Copy the slot of the next step's begin from ``ODD`` to ``EVEN``, where a call begins."""
    n = width(work)
    for i in range(layout.SLOT_ROWS):
        set_row(work, pair_rows(EVEN, 0) + i, get_row(work, pair_rows(ODD, 0) + i))
    for i in range(layout.CHORD_SLOT_ROWS):
        set_row(work, chord_rows(EVEN, 0) + i, get_row(work, chord_rows(ODD, 0) + i))
    for lane in range(n):
        wide[at(ROLL + EVEN, lane, n)] = wide[at(ROLL + ODD, lane, n)]
    for k in range(layout.N_SPAN):
        near[span_index(EVEN, n) + k] = near[span_index(ODD, n) + k]


@inlined
def write_mesh(seen, row, normal, work, near):
    """Write the state of the pairs at an instant."""
    n, first = width(work), row * layout.N_SEEN
    set_row(work, layout.LAW, normal)
    for lane in range(n):
        seen[at(first + layout.SEEN_NEWEST, lane, n)] = near[at(layout.NEWEST, lane, n)]
        seen[at(first + layout.SEEN_FORCE, lane, n)] = work[at(layout.LAW, lane, n)]
        for k in range(layout.MOST_PAIRS):
            force = work[at(layout.PAIR_FORCE + k, lane, n)]
            seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = force


@compiled
def law_at(group, motion, work, wide, near, law_rows):
    """Every lane's law at one instant, to ``law_rows``.

    Rows of ``motion`` are roll, approach, its rate, the rate of the roll. The integrator reads
    the tables, and chooses chords, less often.
    """
    n = width(work)
    approach, rate = get_row(motion, 1), get_row(motion, 2)
    roll_rate = get_row(motion, 3)
    for lane in range(n):
        near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
        wide[at(BASE, lane, n)] = motion[at(0, lane, n)]
        wide[at(ROLL + EVEN, lane, n)] = motion[at(0, lane, n)]
        within = motion[at(1, lane, n)] if group.one_sided else 2.0 * layout.FAR
        work[at(layout.WITHIN, lane, n)] = within
    zero = spread(work, 0.0)
    set_row(work, AHEAD + EVEN, zero)
    set_row(work, layout.TOTAL, zero)
    set_row(work, layout.MOST_DAMPER, spread(work, layout.UNLIMITED))
    set_row(work, layout.FLAGS, spread(work, 1.0))
    helical = is_helical(group)
    for _ in range(ROUNDS):
        bent = get_row(group.numbers, layout.SHARED) * get_row(work, layout.TOTAL)
        set_row(work, layout.LOCAL, approach - bent)
        if not gather(group, EVEN, True, work, wide, near) and helical:
            break
        first, last = near_pairs(EVEN, n, near)
        law = mesh_law(
            group,
            first,
            last,
            EVEN,
            layout.MARGIN,
            zero,
            approach,
            rate,
            roll_rate,
            work,
            wide,
        )
        for row in range(layout.N_LAW):
            set_row(law_rows, row, law[row])
        if not helical:
            break


def scratch(n_dof, n_channels, precision="float64"):
    """Work rows, float64 rows and integer rows of ``integrate`` and ``law_at``."""
    n = n_lanes(precision)
    n_machine = layout.BEHIND * n_dof + layout.N_DRIVE + n_dof + 2 * n_channels
    near = np.zeros((layout.N_COUNTS, n), dtype=np.int64)
    near[layout.NEWEST] = (
        layout.NO_PAIR
    )  # the first reading of the tables finds the teeth
    work = np.zeros((layout.N_MESH + n_machine) * n, dtype=precision)
    return work, np.zeros(layout.N_WIDE * n), near.ravel()
