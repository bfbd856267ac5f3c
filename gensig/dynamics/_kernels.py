"""Compiled core: a fixed-step fourth-order Runge-Kutta integrator and its low-pass, several records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or reorders sums: a record's
bits depend on nothing but its own numbers. Arrays are flat; a row is one number for every record of the group.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import P_TURN, accelerate, event, motion, recenter, set_out
from gensig.dynamics._layout import AHEAD, BASE, NOMINAL, PART, ROLL, at_row, is_helical
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._tables import beside_between, between, cover, gather
from gensig.dynamics._vector import (
    any_above,
    compiled,
    inlined,
    load,
    n_lanes,
    plus_product,
    spread,
    store,
    where_above,
    width,
)

RECENTER = 256  # steps after which the drift of the rotations is taken out of them, so that small numbers stay small
BLOCK = 64  # output samples between two passes of the low-pass: what it reads is still in the cache
ROUNDS = 20  # in which chords and the deflection they share find each other
TOGETHER = 4  # samples of the low-pass that are summed side by side; divides BLOCK


@compiled
def integrate(
    group, state, lost, fresh, step, first_step, n_steps, channels, out, out_row, angle, angle_row, per_angle, seen,
    work, wide, near,
):  # fmt: skip
    """Advance every lane by ``n_steps`` of classical RK4.

    The tables are read once a step, at the roll where it will end; the middle follows from both ends, and what little
    the stages differ from there by the slope of the gap. A step in which a pair takes up or lets go of its load is
    taken again in two parts that meet there, in the lanes where it does: the force has a kink there, which would
    otherwise set the accuracy of everything.

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
    size = n_dof * n
    n_channels = len(channels) if out_row >= 0 else 0
    zero, one = spread(work, 0.0), spread(work, 1.0)
    now = layout.N_MESH * n
    single, parted = now + 2 * size, now + 4 * size
    trial_a, trial_b = now + 6 * size, now + 8 * size
    a, total_q, total_v = now + 10 * size, now + 11 * size, now + 12 * size
    drive = now + 13 * size
    forces = drive + 4 * n
    mean = forces + size
    part_mean = mean + n_channels * n
    margin = spread(work, layout.NEAR if group.one_sided else 2.0 * layout.FAR)
    radius = at_row(numbers, layout.PINION_RADIUS)
    begin, end = 1, 2
    for i in range(0, 2 * size, n):
        store(work, now + i, load(state, i))
    for lane in range(n):
        if fresh[lane] > 0.0:
            near[layout.NEWEST * n + lane] = layout.NOBODY
    for place in range(first_step, first_step + n_steps):
        if place % RECENTER == 0:
            recenter(group, now, n_dof, work, wide)
        set_out(group, place * step, now, drive, work, wide)
        seen_row = -1
        if angle_row >= 0 and place % per_angle == 0:
            for lane in range(n):
                angle[angle_row * n + lane] = wide[NOMINAL * n + lane] + work[now + P_TURN * n + lane]
            if len(seen) > 0:
                seen_row = angle_row
                for k in range(layout.MOST_PAIRS):
                    store(work, (layout.PAIR_FORCE + k) * n, zero)
            angle_row += 1
        speed, gain = load(work, drive), load(work, drive + n)
        approach, rate = motion(group, now, now + size, work)
        store(work, layout.WITHIN * n, approach + margin)
        turning = radius * (speed + load(work, now + size + P_TURN * n))
        store(work, (AHEAD + end) * n, step * turning)
        if place == first_step:
            for lane in range(n):
                if fresh[lane] > 0.0:
                    wide[(ROLL + begin) * n + lane] = wide[BASE * n + lane]
                    work[layout.LAST_TOTAL * n + lane] = numbers[layout.MEAN_FORCE * n + lane]
        if is_helical(group):
            bent = at_row(numbers, layout.SHARED) * load(work, layout.LAST_TOTAL * n)
            store(work, layout.LOCAL * n, approach + 0.5 * step * rate - bent)
        if place == first_step:
            gather(group, begin, True, work, wide, near)
        for lane in range(n):
            wide[(ROLL + end) * n + lane] = wide[BASE * n + lane] + work[(AHEAD + end) * n + lane]
        if gather(group, end, True, work, wide, near):
            store(work, layout.FLAGS * n, one)
            gather(group, begin, False, work, wide, near)
        for lane in range(n):
            work[(AHEAD + begin) * n + lane] = wide[(ROLL + begin) * n + lane] - wide[BASE * n + lane]
        spans = layout.SPAN * n
        first = min(near[spans + 4 * begin + 2], near[spans + 4 * end + 2])
        last = max(near[spans + 4 * begin + 3], near[spans + 4 * end + 3])
        cover(begin, first, last, work, near)
        cover(end, first, last, work, near)
        q_0 = load(work, now + P_TURN * n)
        changed, share = zero, zero
        n_parts, part = 1, 0
        while part < n_parts:
            source, target, slot_0, slot_1 = now, single, begin, end
            h, offset = spread(work, step), zero
            if part == 1:
                target, slot_1, h = parted, PART, share * step
            elif part == 2:
                source, target, slot_0, h, offset = parted, parted, PART, (1.0 - share) * step, share * step
            between(slot_0, slot_1, layout.MIDDLE, first, last, work)
            if is_helical(group):
                beside_between(slot_0, slot_1, layout.MIDDLE, first, last, work)
            half = 0.5 * h
            at, ahead = source, trial_a
            loaded = zero
            for stage in range(4):
                since = offset + (zero if stage == 0 else h if stage == 3 else half)
                slot = slot_0 if stage == 0 else slot_1 if stage == 3 else layout.MIDDLE
                approach, rate = motion(group, at, at + size, work)
                turned = radius * ((speed + 0.5 * gain * since) * since + (load(work, at + P_TURN * n) - q_0))
                roll_rate = radius * (speed + gain * since + load(work, at + size + P_TURN * n))
                rows = layout.MARGIN if stage == 0 else layout.MARGIN + layout.MOST_PAIRS if stage == 3 else -1
                law = mesh_law(group, first, last, slot, rows, turned, approach, rate, roll_rate, work, wide)
                accelerate(group, law, at, at + size, forces, a, work)
                if part == 0:
                    if stage == 0:
                        loaded = law[7]
                        if seen_row >= 0:
                            tell(seen, seen_row, law[0], work, near)
                        store(lost, 0, load(lost, 0) + where_above(law[0] * law[0], zero, zero, one))
                    else:
                        differs = law[7] - loaded
                        changed = where_above(differs * differs, zero, one, changed)
                        store(work, layout.MOTION * n, approach)
                        if stage == 3 and is_helical(group):
                            store(work, layout.LAST_TOTAL * n, load(work, layout.TOTAL * n))
                if stage == 3:
                    break
                reach = h if stage == 2 else half
                for i in range(0, size, n):
                    gained = load(work, a + i)
                    store(work, ahead + i, load(work, source + i) + reach * load(work, at + size + i))
                    store(work, ahead + size + i, load(work, source + size + i) + reach * gained)
                    if stage == 0:
                        store(work, total_q + i, gained)
                        store(work, total_v + i, gained)
                    else:
                        store(work, total_q + i, load(work, total_q + i) + gained)
                        store(work, total_v + i, load(work, total_v + i) + 2.0 * gained)
                at, ahead = ahead, trial_b if ahead == trial_a else trial_a
            sixth = h * (1.0 / 6.0)
            for i in range(0, size, n):
                gained = load(work, total_v + i) + load(work, a + i)
                store(work, total_v + i, gained)
                speed_0 = load(work, source + size + i)
                store(work, target + i, load(work, source + i) + h * (speed_0 + sixth * load(work, total_q + i)))
                store(work, target + size + i, speed_0 + sixth * gained)
            for c in range(n_channels):
                value = load(work, total_v + channels[c] * n) * (1.0 / 6.0)
                if part == 0:
                    store(work, mean + c * n, value + gain * load(group.rotation, channels[c] * n))
                elif part == 1:
                    store(work, part_mean + c * n, share * value)
                else:
                    value = load(work, part_mean + c * n) + (1.0 - share) * value
                    store(work, part_mean + c * n, value + gain * load(group.rotation, channels[c] * n))
            part += 1
            if n_parts == 1 and any_above(changed, zero):
                n_parts = 3
                store(work, layout.WITHIN * n, load(work, layout.WITHIN * n) - margin)
                share = event(group, first, last, work)
                store(work, layout.WITHIN * n, load(work, layout.WITHIN * n) + margin)
                store(work, layout.FLAGS * n, changed)
                store(work, (AHEAD + PART) * n, share * load(work, (AHEAD + end) * n))
                for lane in range(n):
                    wide[(ROLL + PART) * n + lane] = wide[BASE * n + lane] + work[(AHEAD + PART) * n + lane]
                gather(group, PART, False, work, wide, near)
                first = min(first, near[spans + 4 * PART + 2])
                last = max(last, near[spans + 4 * PART + 3])
                cover(begin, first, last, work, near)
                cover(PART, first, last, work, near)
                cover(end, first, last, work, near)
        if n_parts > 1:
            for i in range(0, 2 * size, n):
                store(work, single + i, where_above(changed, zero, load(work, parted + i), load(work, single + i)))
            for c in range(0, n_channels * n, n):
                taken = where_above(changed, zero, load(work, part_mean + c), load(work, mean + c))
                store(work, mean + c, taken)
        for c in range(n_channels):
            store(out, ((out_row + place - first_step) * n_channels + c) * n, load(work, mean + c * n))
        now, single = single, now
        begin, end = end, begin
    if begin == 2:
        for i in range(0, layout.SLOT_ROWS * n, n):
            store(work, layout.SLOT_ROWS * n + i, load(work, 2 * layout.SLOT_ROWS * n + i))
        for i in range(0, layout.BESIDE_ROWS * n, n):
            kept = load(work, (layout.BESIDE + 2 * layout.BESIDE_ROWS) * n + i)
            store(work, (layout.BESIDE + layout.BESIDE_ROWS) * n + i, kept)
        for lane in range(n):
            wide[(ROLL + 1) * n + lane] = wide[(ROLL + 2) * n + lane]
        for k in range(4):
            near[layout.SPAN * n + 4 + k] = near[layout.SPAN * n + 8 + k]
    for i in range(0, 2 * size, n):
        store(state, i, load(work, now + i))
    return angle_row


@inlined
def tell(seen, row, normal, work, near):
    """Write what the pairs do at an instant."""
    n = width(work)
    store(work, layout.LAW * n, normal)
    for lane in range(n):
        at = row * layout.N_SEEN * n + lane
        seen[at + layout.SEEN_NEWEST * n] = near[layout.NEWEST * n + lane]
        seen[at + layout.SEEN_FORCE * n] = work[layout.LAW * n + lane]
        for k in range(layout.MOST_PAIRS):
            seen[at + (layout.SEEN_PAIRS + k) * n] = work[(layout.PAIR_FORCE + k) * n + lane]


@compiled
def low_pass(means, first, taps, factor, n_channels, n_samples, out, out_row):
    """Every ``factor``-th value of the filtered series of every channel.

    ``means`` (step, channel, lane) and, from row ``out_row`` on, ``out`` (sample, channel, lane), flat; ``first`` is
    the step under the first tap of the first sample. ``TOGETHER`` samples at a time share what they read: before and
    behind ``taps`` stand as many zeros as the first and the last of them lie apart.
    """
    n = width(means)
    row, apart = n_channels * n, (TOGETHER - 1) * factor
    n_taps = len(taps) - 2 * apart
    for s in range(0, n_samples, TOGETHER):
        n_read = n_taps + (min(TOGETHER, n_samples - s) - 1) * factor
        for c in range(n_channels):
            base = (first + s * factor) * row + c * n
            zero = spread(means, 0.0)
            p, q, r, t = zero, zero, zero, zero
            for k in range(n_read):
                value, tap = load(means, base + k * row), apart + k
                p, q = plus_product(p, taps, tap, value), plus_product(q, taps, tap - factor, value)
                r = plus_product(r, taps, tap - 2 * factor, value)
                t = plus_product(t, taps, tap - 3 * factor, value)
            here = (out_row + s) * row + c * n
            store(out, here, p)
            if s + 1 < n_samples:
                store(out, here + row, q)
            if s + 2 < n_samples:
                store(out, here + 2 * row, r)
            if s + 3 < n_samples:
                store(out, here + 3 * row, t)


@compiled
def record(
    group, state, lost, fresh, step, first_step, n_samples, factor, taps, channels, out, angle, seen, means, work, wide,
    near,
):  # fmt: skip
    """Integrate and decimate block by block, so that nothing at the internal rate leaves the cache.

    ``out`` (lane, channel, sample) float64 takes ``n_samples``; the first tap of the first stands on the step after
    ``first_step``. ``means`` is a scratch of ``mean_rows`` rows of channels, of which the last ``BLOCK`` take samples.
    """
    n, n_channels, n_kept = width(work), len(channels), len(taps) - (2 * TOGETHER - 1) * factor
    angle_row, now, done, row = 0, first_step, 0, len(channels) * width(work)
    samples = n_kept + BLOCK * factor
    n_steps, out_row = 1, -1  # then what the first sample needs before its last steps, then block by block
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
                    for s in range(n_block):
                        out[(lane * n_channels + c) * n_samples + done + s] = means[(samples + s) * row + c * n + lane]
            for i in range(0, n_kept * row, n):
                store(means, i, load(means, n_steps * row + i))
            done += n_block
        if done == n_samples:
            break
        n_steps, out_row = (n_kept, 0) if out_row < 0 else (min(BLOCK, n_samples - done) * factor, n_kept)


@compiled
def law_at(group, motion, work, wide, near, found):
    """Every lane's law at one instant; rows of ``motion`` are roll, approach, its rate, the roll's rate.

    ``found`` takes the rows of the law. For tests: the integrator reads the tables, and chooses chords, less often.
    """
    n = width(work)
    for lane in range(n):
        near[layout.NEWEST * n + lane] = layout.NOBODY
        wide[BASE * n + lane] = motion[lane]
        wide[(ROLL + 1) * n + lane] = motion[lane]
        work[layout.WITHIN * n + lane] = motion[n + lane] if group.one_sided else 2.0 * layout.FAR
    store(work, (AHEAD + 1) * n, spread(work, 0.0))
    spans = layout.SPAN * n
    store(work, layout.TOTAL * n, spread(work, 0.0))
    for _ in range(ROUNDS):
        bent = at_row(group.numbers, layout.SHARED) * load(work, layout.TOTAL * n)
        store(work, layout.LOCAL * n, load(motion, n) - bent)
        if not gather(group, 1, True, work, wide, near) and is_helical(group):
            break
        law = mesh_law(
            group, near[spans + 6], near[spans + 7], 1, layout.MARGIN, spread(work, 0.0), load(motion, n),
            load(motion, 2 * n), load(motion, 3 * n), work, wide,
        )  # fmt: skip
        for row in range(layout.N_LAW):
            store(found, row * n, law[row])
        if not is_helical(group):
            break


def mean_rows(n_taps, factor):
    """Rows of channels that ``record`` needs for its steps, for taps with their zeros."""
    return n_taps - (2 * TOGETHER - 1) * factor + BLOCK * factor + BLOCK


def scratch(n_dof, n_channels, precision="float64"):
    """Work rows, float64 rows and whole numbers of ``integrate`` and ``law_at``."""
    n = n_lanes(precision)
    n_rows = layout.N_MESH + 14 * n_dof + 4 + 2 * n_channels
    near = np.zeros((layout.N_COUNTS, n), dtype=np.int64)
    near[layout.NEWEST] = layout.NOBODY  # no pair: the first look at the tables finds the teeth
    return np.zeros(n_rows * n, dtype=precision), np.zeros(layout.N_WIDE * n), near.ravel()
