"""Compiled core: the machine around the gear mesh, several records side by side."""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import BASE, CENTER, NOMINAL, at_row, is_helical
from gensig.dynamics._vector import inlined, load, spread, store, where_above, width

# degrees of freedom of the two gears that every machine begins with; helical gears have more behind them
P_X, P_Y, P_TURN, W_X, W_Y, W_TURN, N_IN_PLANE = range(7)
N_GEARS = 12


@inlined
def _n_gears(group):
    return N_GEARS if is_helical(group) else N_IN_PLANE


@inlined
def motion(group, q, v, work):
    """Approach and its rate, from the rows of a state."""
    n, numbers = width(work), group.numbers
    pinion_radius, wheel_radius = at_row(numbers, layout.PINION_RADIUS), at_row(numbers, layout.WHEEL_RADIUS)
    approach = pinion_radius * load(work, q + P_TURN * n) - wheel_radius * load(work, q + W_TURN * n)
    rate = pinion_radius * load(work, v + P_TURN * n) - wheel_radius * load(work, v + W_TURN * n)
    approach = at_row(numbers, layout.REST_APPROACH) + (approach - load(work, q + P_Y * n) + load(work, q + W_Y * n))
    rate = rate - load(work, v + P_Y * n) + load(work, v + W_Y * n)
    for d in range(N_IN_PLANE, _n_gears(group)):
        reach = load(group.reach, d * n)
        approach = approach + reach * load(work, q + d * n)
        rate = rate + reach * load(work, v + d * n)
    return approach, rate


@inlined
def set_out(group, time, q, drive, work, wide):
    """What stays the same over a step: nominal motion, the roll it begins at, and every force but the mesh's.

    Rows ``drive`` take the nominal speed, its acceleration, and the forces.
    """
    n, n_dof = width(work), len(group.force) // width(work)
    exact, profile = group.exact, group.profile
    n_cells = len(profile) // (layout.N_PROFILE * n)
    cell = int(np.floor(time * group.cells_per_second)) - group.profile_first
    cell = min(max(cell, 0), n_cells - 1)
    since = time - (group.profile_first + cell) / group.cells_per_second
    for lane in range(n):
        at = cell * layout.N_PROFILE * n + lane
        speed, gain = profile[at + layout.NOMINAL_SPEED * n], profile[at + layout.NOMINAL_ACCELERATION * n]
        turned = profile[at + layout.NOMINAL_ANGLE * n] + since * (speed + 0.5 * gain * since)
        work[drive + lane] = speed + gain * since
        work[drive + n + lane] = gain
        work[drive + 2 * n + lane] = profile[at + layout.TORQUE * n] + since * profile[at + layout.TORQUE_SLOPE * n]
        work[drive + 3 * n + lane] = wide[CENTER * n + lane]
        turned += wide[CENTER * n + lane]
        wide[NOMINAL * n + lane] = turned
        wide[BASE * n + lane] = exact[layout.START_ROLL * n + lane] + exact[layout.EXACT_RADIUS * n + lane] * (
            turned + work[q + P_TURN * n + lane]
        )
    gain, torque, center = load(work, drive + n), load(work, drive + 2 * n), load(work, drive + 3 * n)
    forces = drive + 4 * n
    for i in range(0, n_dof * n, n):
        held = center * load(group.held, i) + gain * load(group.carried, i)
        store(work, forces + i, load(group.force, i) + load(group.set_force, i) * (torque - 1.0) - held)


@inlined
def accelerate(group, law, q, v, forces, a, work):
    """Fill the rows ``a`` with q'' under the forces of a mesh law."""
    n, n_dof = width(work), len(group.force) // width(work)
    numbers = group.numbers
    friction, moment_p, moment_w, along = law[1], law[2], law[3], law[4]
    normal = law[0] - at_row(numbers, layout.MEAN_FORCE) * load(work, forces - 2 * n)
    store(work, a + P_X * n, friction)
    store(work, a + P_Y * n, normal)
    store(work, a + P_TURN * n, at_row(numbers, layout.PINION_RADIUS) * (along - normal) + moment_p)
    store(work, a + W_X * n, 0.0 - friction)
    store(work, a + W_Y * n, 0.0 - normal)
    store(work, a + W_TURN * n, at_row(numbers, layout.WHEEL_RADIUS) * normal + moment_w)
    n_gears = _n_gears(group)
    for d in range(N_IN_PLANE, n_gears):
        store(work, a + d * n, 0.0 - load(group.reach, d * n) * normal)
    for d in range(n_dof):
        i = d * n
        pull = load(work, forces + i)
        pull = pull - load(group.stiffness, i) * load(work, q + i) - load(group.damping, i) * load(work, v + i)
        for k in range(group.other_first[d], group.other_first[d + 1]):
            j = group.other_column[k] * n
            pull = pull - load(group.other_stiffness, k * n) * load(work, q + j)
            pull = pull - load(group.other_damping, k * n) * load(work, v + j)
        if d < n_gears:
            pull = pull + load(work, a + i)
        store(work, a + i, pull * load(group.inverse_mass, i))


@inlined
def recenter(group, q, n_dof, work, wide):
    """Take the pinion's turn out of all rotations together, into ``CENTER``; no spring but the drive's sees it."""
    n = width(work)
    turn = load(work, q + P_TURN * n)
    for lane in range(n):
        wide[CENTER * n + lane] += work[q + P_TURN * n + lane]
    for i in range(0, n_dof * n, n):
        store(work, q + i, load(work, q + i) - turn * load(group.rotation, i))


@inlined
def event(group, first, last, work):
    """Share of the step at which the first pair takes up or lets go of its load, from the margins at both ends."""
    n = width(work)
    zero, one = spread(work, 0.0), spread(work, 1.0)
    found = one
    for k in range(first, last):
        before, after = load(work, (layout.MARGIN + k) * n), load(work, (layout.MARGIN + layout.MOST_PAIRS + k) * n)
        share = before / (before - after)
        share = where_above(zero, before * after, share, one)
        found = where_above(found, share, share, found)
        if not group.one_sided:  # and where the pair is wholly in
            share = (before - 1.0) / (before - after)
            share = where_above(zero, (before - 1.0) * (after - 1.0), share, one)
            found = where_above(found, share, share, found)
    play = at_row(group.numbers, layout.BACKLASH)
    before, after = load(work, layout.WITHIN * n) + play, load(work, layout.MOTION * n) + play
    share = before / (before - after)
    share = where_above(zero, before * after, share, one)
    found = where_above(found, share, share, found)
    found = where_above(one, found, found, spread(work, 0.5))
    low, high = spread(work, 0.02), spread(work, 0.98)
    found = where_above(low, found, low, found)
    return where_above(found, high, high, found)
