"""Compiled core: a fixed-step fourth-order Runge-Kutta integrator and its low-pass, several
records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or
reorders sums: a record's bits depend on nothing but its own numbers. Arrays are flat; a row is
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
    recenter,
    set_out,
)
from gensig.dynamics._layout import (
    AHEAD,
    BASE,
    EVEN,
    FIRST_NEAR_PAIR,
    LAST_NEAR_PAIR,
    MIDDLE,
    NOMINAL,
    ODD,
    PART,
    ROLL,
    chord_rows,
    is_helical,
    machine_rows,
    pair_rows,
    span_place,
)
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._tableau import RK4
from gensig.dynamics._tables import beside_between, between, cover, gather
from gensig.dynamics._vector import (
    any_above,
    at,
    compiled,
    get_row,
    inlined,
    n_lanes,
    plus_product,
    set_row,
    spread,
    where_above,
    width,
)

RECENTER = 256  # steps after which the drift of the rotations is taken out of them, so that small numbers stay small
BLOCK = 64  # output samples between two passes of the low-pass: what it reads is still in the cache
ROUNDS = 20  # in which chords and the deflection they share find each other
TOGETHER = 4  # samples of the low-pass that are summed side by side; divides BLOCK
N_STAGES = len(RK4.node)
LAST_STAGE = N_STAGES - 1


@compiled
def integrate(
    group, state, lost, fresh, step, first_step, n_steps, channels, out, out_row, angle, angle_row, per_angle, seen,
    work, wide, near,
):  # fmt: skip
    """Advance every lane by ``n_steps`` of classical RK4.

    The tables are read once a step, at the roll where it will end; the middle follows from both
    ends, and what little the stages differ from there by the slope of the gap. A step in which a
    pair takes up or lets go of its load is taken again in two parts that meet there, in the lanes
    where it does: the force has a kink there, which would otherwise set the accuracy of
    everything.

    Parameters
    ----------
    state : (2, dof, lane)    q and v, advanced in place; the pinion has turned by ``wide[CENTER]`` besides
    lost : (lane,)            the number of steps without contact is added
    fresh : (lane,)           1 where the state is new: its tables are read first. 0 goes on as if the last call of this
        group, step and scratch had not ended; so where calls end leaves no trace
    out : (step, channel, lane)    takes, from row ``out_row`` on, the mean acceleration over each step (what the
        equations add to the velocity, over the step: kinks then alias far less than point values would); a negative
        row stores nothing
    angle : (sample, lane)    takes, from row ``angle_row`` on, the pinion's angle in rad since time 0 at the begin of
        every step whose number ``per_angle`` divides; a negative row stores nothing
    seen : (sample, N_SEEN, lane)    takes at the same places what the pairs do; may be empty
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
    now, single = machine_rows(layout.NOW, n_dof), machine_rows(layout.SINGLE, n_dof)
    parted = machine_rows(layout.PARTED, n_dof)
    trial_a, trial_b = (
        machine_rows(layout.TRIAL_A, n_dof),
        machine_rows(layout.TRIAL_B, n_dof),
    )
    a = machine_rows(layout.ACCELERATIONS, n_dof)
    sum_q, sum_v = machine_rows(layout.SUM_Q, n_dof), machine_rows(layout.SUM_V, n_dof)
    drive = machine_rows(layout.BEHIND, n_dof)
    forces = drive + layout.N_DRIVE
    mean = forces + n_dof
    part_mean = mean + n_channels
    margin = spread(work, layout.NEAR if group.one_sided else 2.0 * layout.FAR)
    radius = get_row(numbers, layout.PINION_RADIUS)
    begin, end = EVEN, ODD
    for i in range(2 * n_dof):
        set_row(work, now + i, get_row(state, i))
    for lane in range(n):
        if fresh[lane] > 0.0:
            near[at(layout.NEWEST, lane, n)] = layout.NOBODY
    for number in range(first_step, first_step + n_steps):
        if number % RECENTER == 0:
            recenter(group, now, n_dof, work, wide)
        set_out(group, number * step, now, drive, forces, work, wide)
        seen_row = -1
        if angle_row >= 0 and number % per_angle == 0:
            for lane in range(n):
                angle[at(angle_row, lane, n)] = (
                    wide[at(NOMINAL, lane, n)] + work[at(now + P_TURN, lane, n)]
                )
            if len(seen) > 0:
                seen_row = angle_row
                for k in range(layout.MOST_PAIRS):
                    set_row(work, layout.PAIR_FORCE + k, zero)
            angle_row += 1
        speed, gain = (
            get_row(work, drive + layout.DRIVE_SPEED),
            get_row(work, drive + layout.DRIVE_GAIN),
        )
        approach, rate = motion(group, now, now + n_dof, work)
        set_row(work, layout.WITHIN, approach + margin)
        turning = radius * (speed + get_row(work, now + n_dof + P_TURN))
        set_row(work, AHEAD + end, step * turning)
        if number == first_step:
            for lane in range(n):
                if fresh[lane] > 0.0:
                    wide[at(ROLL + begin, lane, n)] = wide[at(BASE, lane, n)]
                    work[at(layout.LAST_TOTAL, lane, n)] = numbers[
                        at(layout.MEAN_FORCE, lane, n)
                    ]
        if is_helical(group):
            bent = get_row(numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
            set_row(work, layout.LOCAL, approach + 0.5 * step * rate - bent)
        if number == first_step:
            gather(group, begin, True, work, wide, near)
        for lane in range(n):
            wide[at(ROLL + end, lane, n)] = (
                wide[at(BASE, lane, n)] + work[at(AHEAD + end, lane, n)]
            )
        if gather(group, end, True, work, wide, near):
            set_row(work, layout.FLAGS, one)
            gather(group, begin, False, work, wide, near)
        for lane in range(n):
            work[at(AHEAD + begin, lane, n)] = (
                wide[at(ROLL + begin, lane, n)] - wide[at(BASE, lane, n)]
            )
        first = min(
            near[span_place(begin, n) + FIRST_NEAR_PAIR],
            near[span_place(end, n) + FIRST_NEAR_PAIR],
        )
        last = max(
            near[span_place(begin, n) + LAST_NEAR_PAIR],
            near[span_place(end, n) + LAST_NEAR_PAIR],
        )
        cover(begin, first, last, work, near)
        cover(end, first, last, work, near)
        q_0 = get_row(work, now + P_TURN)
        changed, share = zero, zero
        n_parts, part = 1, 0
        while part < n_parts:
            source, target, slot_0, slot_1 = now, single, begin, end
            h, offset = spread(work, step), zero
            if part == 1:
                target, slot_1, h = parted, PART, share * step
            elif part == 2:
                source, target, slot_0, h, offset = (
                    parted,
                    parted,
                    PART,
                    (1.0 - share) * step,
                    share * step,
                )
            between(slot_0, slot_1, MIDDLE, first, last, work)
            if is_helical(group):
                beside_between(slot_0, slot_1, MIDDLE, first, last, work)
            half = RK4.node[1] * h
            at_stage, ahead = source, trial_a
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
                turned = radius * (
                    (speed + 0.5 * gain * since) * since
                    + (get_row(work, q + P_TURN) - q_0)
                )
                roll_rate = radius * (speed + gain * since + get_row(work, v + P_TURN))
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
                accelerate(
                    group,
                    law,
                    q,
                    v,
                    get_row(work, drive + layout.DRIVE_TORQUE),
                    forces,
                    a,
                    work,
                )
                if part == 0:
                    if stage == 0:
                        loaded = law.loaded
                        if seen_row >= 0:
                            tell(seen, seen_row, law.normal, work, near)
                        apart = where_above(law.normal * law.normal, zero, zero, one)
                        set_row(lost, 0, get_row(lost, 0) + apart)
                    else:
                        differs = law.loaded - loaded
                        changed = where_above(differs * differs, zero, one, changed)
                        set_row(work, layout.STEP_APPROACH, approach)
                        if stage == LAST_STAGE and is_helical(group):
                            set_row(
                                work, layout.LAST_TOTAL, get_row(work, layout.TOTAL)
                            )
                if stage == LAST_STAGE:
                    break
                reach = h if stage == LAST_STAGE - 1 else half
                for d in range(n_dof):
                    gained = get_row(work, a + d)
                    set_row(
                        work,
                        ahead + d,
                        get_row(work, source + d) + reach * get_row(work, v + d),
                    )
                    set_row(
                        work,
                        ahead + n_dof + d,
                        get_row(work, source + n_dof + d) + reach * gained,
                    )
                    if stage == 0:
                        set_row(work, sum_q + d, RK4.position[0] * gained)
                        set_row(work, sum_v + d, RK4.weight[0] * gained)
                    else:
                        set_row(
                            work,
                            sum_q + d,
                            get_row(work, sum_q + d) + RK4.position[1] * gained,
                        )
                        set_row(
                            work,
                            sum_v + d,
                            get_row(work, sum_v + d) + RK4.weight[1] * gained,
                        )
                at_stage, ahead = ahead, trial_b if ahead == trial_a else trial_a
            per_sum = h * RK4.share
            for d in range(n_dof):
                gained = get_row(work, sum_v + d) + RK4.weight[LAST_STAGE] * get_row(
                    work, a + d
                )
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
                for lane in range(n):
                    wide[at(ROLL + PART, lane, n)] = (
                        wide[at(BASE, lane, n)] + work[at(AHEAD + PART, lane, n)]
                    )
                gather(group, PART, False, work, wide, near)
                first = min(first, near[span_place(PART, n) + FIRST_NEAR_PAIR])
                last = max(last, near[span_place(PART, n) + LAST_NEAR_PAIR])
                cover(begin, first, last, work, near)
                cover(PART, first, last, work, near)
                cover(end, first, last, work, near)
        if n_parts > 1:
            for i in range(2 * n_dof):
                chosen = where_above(
                    changed, zero, get_row(work, parted + i), get_row(work, single + i)
                )
                set_row(work, single + i, chosen)
            for c in range(n_channels):
                chosen = where_above(
                    changed, zero, get_row(work, part_mean + c), get_row(work, mean + c)
                )
                set_row(work, mean + c, chosen)
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


@inlined
def keep_begin(work, wide, near):
    """Copy what was read at the begin of the next step from the slot ``ODD`` to ``EVEN``, where a
    call begins.
    """
    n = width(work)
    for i in range(layout.SLOT_ROWS):
        set_row(work, pair_rows(EVEN, 0) + i, get_row(work, pair_rows(ODD, 0) + i))
    for i in range(layout.BESIDE_ROWS):
        set_row(work, chord_rows(EVEN, 0) + i, get_row(work, chord_rows(ODD, 0) + i))
    for lane in range(n):
        wide[at(ROLL + EVEN, lane, n)] = wide[at(ROLL + ODD, lane, n)]
    for k in range(layout.N_SPAN):
        near[span_place(EVEN, n) + k] = near[span_place(ODD, n) + k]


@inlined
def tell(seen, row, normal, work, near):
    """Write what the pairs do at an instant."""
    n, first = width(work), row * layout.N_SEEN
    set_row(work, layout.LAW, normal)
    for lane in range(n):
        seen[at(first + layout.SEEN_NEWEST, lane, n)] = near[at(layout.NEWEST, lane, n)]
        seen[at(first + layout.SEEN_FORCE, lane, n)] = work[at(layout.LAW, lane, n)]
        for k in range(layout.MOST_PAIRS):
            seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = work[
                at(layout.PAIR_FORCE + k, lane, n)
            ]


@compiled
def low_pass(means, first, taps, factor, n_channels, n_samples, out, out_row):
    """Every ``factor``-th value of the filtered series of every channel.

    ``means`` (step, channel, lane) and, from row ``out_row`` on, ``out`` (sample, channel, lane),
    flat; ``first`` is the step under the first tap of the first sample. ``TOGETHER`` samples at a
    time share what they read: before and behind ``taps`` stand as many zeros as the first and the
    last of them lie apart.
    """
    apart = (TOGETHER - 1) * factor
    n_taps = len(taps) - 2 * apart
    for s in range(0, n_samples, TOGETHER):
        n_read = n_taps + (min(TOGETHER, n_samples - s) - 1) * factor
        for c in range(n_channels):
            zero = spread(means, 0.0)
            p, q, r, t = zero, zero, zero, zero
            for k in range(n_read):
                value, tap = (
                    get_row(means, (first + s * factor + k) * n_channels + c),
                    apart + k,
                )
                p, q = (
                    plus_product(p, taps, tap, value),
                    plus_product(q, taps, tap - factor, value),
                )
                r = plus_product(r, taps, tap - 2 * factor, value)
                t = plus_product(t, taps, tap - 3 * factor, value)
            sample = (out_row + s) * n_channels + c
            set_row(out, sample, p)
            if s + 1 < n_samples:
                set_row(out, sample + n_channels, q)
            if s + 2 < n_samples:
                set_row(out, sample + 2 * n_channels, r)
            if s + 3 < n_samples:
                set_row(out, sample + 3 * n_channels, t)


@compiled
def record(
    group, state, lost, fresh, step, first_step, n_samples, factor, taps, channels, out, angle, seen, means, work, wide,
    near,
):  # fmt: skip
    """Integrate and decimate block by block, so that nothing at the internal rate leaves the cache.

    ``out`` (lane, channel, sample) float64 takes ``n_samples``; the first tap of the first stands
    on the step after ``first_step``. ``means`` is a scratch of ``mean_rows`` rows of channels, of
    which the last ``BLOCK`` take samples.
    """
    n, n_channels, n_kept = (
        width(work),
        len(channels),
        len(taps) - (2 * TOGETHER - 1) * factor,
    )
    angle_row, now, done = 0, first_step, 0
    samples = n_kept + BLOCK * factor
    n_steps, out_row = (
        1,
        -1,
    )  # then what the first sample needs before its last steps, then block by block
    while True:
        angle_row = integrate(
            group, state, lost, fresh, step, now, n_steps, channels, means, out_row, angle, angle_row, factor, seen,
            work, wide, near,
        )  # fmt: skip
        now += n_steps
        for lane in range(n):
            fresh[lane] = 0.0
        if out_row == n_kept:
            n_block = n_steps // factor
            low_pass(means, 0, taps, factor, n_channels, n_block, means, samples)
            for lane in range(n):
                for c in range(n_channels):
                    series = (lane * n_channels + c) * n_samples
                    for s in range(n_block):
                        out[series + done + s] = means[
                            at((samples + s) * n_channels + c, lane, n)
                        ]
            for i in range(n_kept * n_channels):
                set_row(means, i, get_row(means, n_steps * n_channels + i))
            done += n_block
        if done == n_samples:
            break
        n_steps, out_row = (
            (n_kept, 0)
            if out_row < 0
            else (min(BLOCK, n_samples - done) * factor, n_kept)
        )


@compiled
def law_at(group, motion, work, wide, near, found):
    """Every lane's law at one instant; rows of ``motion`` are roll, approach, its rate, the
    roll's rate.

    ``found`` takes the rows of the law. For tests: the integrator reads the tables, and chooses
    chords, less often.
    """
    n = width(work)
    approach, rate, roll_rate = (
        get_row(motion, 1),
        get_row(motion, 2),
        get_row(motion, 3),
    )
    for lane in range(n):
        near[at(layout.NEWEST, lane, n)] = layout.NOBODY
        wide[at(BASE, lane, n)] = motion[at(0, lane, n)]
        wide[at(ROLL + EVEN, lane, n)] = motion[at(0, lane, n)]
        work[at(layout.WITHIN, lane, n)] = (
            motion[at(1, lane, n)] if group.one_sided else 2.0 * layout.FAR
        )
    set_row(work, AHEAD + EVEN, spread(work, 0.0))
    set_row(work, layout.TOTAL, spread(work, 0.0))
    span = span_place(EVEN, n)
    for _ in range(ROUNDS):
        bent = get_row(group.numbers, layout.SHARED) * get_row(work, layout.TOTAL)
        set_row(work, layout.LOCAL, approach - bent)
        if not gather(group, EVEN, True, work, wide, near) and is_helical(group):
            break
        first, last = near[span + FIRST_NEAR_PAIR], near[span + LAST_NEAR_PAIR]
        turned = spread(work, 0.0)
        law = mesh_law(
            group,
            first,
            last,
            EVEN,
            layout.MARGIN,
            turned,
            approach,
            rate,
            roll_rate,
            work,
            wide,
        )
        for row in range(layout.N_LAW):
            set_row(found, row, law[row])
        if not is_helical(group):
            break


def mean_rows(n_taps, factor):
    """Rows of channels that ``record`` needs for its steps, for taps with their zeros."""
    return n_taps - (2 * TOGETHER - 1) * factor + BLOCK * factor + BLOCK


def scratch(n_dof, n_channels, precision="float64"):
    """Work rows, float64 rows and whole numbers of ``integrate`` and ``law_at``."""
    n = n_lanes(precision)
    n_rows = (
        layout.N_MESH + layout.BEHIND * n_dof + layout.N_DRIVE + n_dof + 2 * n_channels
    )
    near = np.zeros((layout.N_COUNTS, n), dtype=np.int64)
    near[layout.NEWEST] = (
        layout.NOBODY
    )  # no pair: the first look at the tables finds the teeth
    return (
        np.zeros(n_rows * n, dtype=precision),
        np.zeros(layout.N_WIDE * n),
        near.ravel(),
    )
