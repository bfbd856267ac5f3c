"""Compiled core: the machine around the gear mesh, several records side by side.

``q`` and ``v`` are the first rows of a state: deviations and their rates, one row a degree of
freedom.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import (
    BASE,
    CENTER,
    DRIVE_CENTER,
    DRIVE_GAIN,
    DRIVE_SPEED,
    DRIVE_TORQUE,
    MARGIN,
    MOST_PAIRS,
    NOMINAL,
    is_helical,
)
from gensig.dynamics._vector import (
    at,
    get_row,
    inlined,
    set_row,
    spread,
    where_above,
    width,
)

# degrees of freedom of the two gears that every machine begins with; helical gears have more
# behind them
P_X, P_Y, P_TURN, W_X, W_Y, W_TURN, N_IN_PLANE = range(7)
N_GEARS = 12
EARLIEST, LATEST = 0.02, 0.98  # share of a step at which it may be cut in two


@inlined
def _n_gears(group):
    return N_GEARS if is_helical(group) else N_IN_PLANE


@inlined
def motion(group, q, v, work):
    """Approach and its rate, from the rows of a state."""
    numbers = group.numbers
    pinion_radius = get_row(numbers, layout.PINION_RADIUS)
    wheel_radius = get_row(numbers, layout.WHEEL_RADIUS)
    approach = pinion_radius * get_row(work, q + P_TURN) - wheel_radius * get_row(
        work, q + W_TURN
    )
    rate = pinion_radius * get_row(work, v + P_TURN) - wheel_radius * get_row(
        work, v + W_TURN
    )
    deviation = approach - get_row(work, q + P_Y) + get_row(work, q + W_Y)
    approach = get_row(numbers, layout.REST_APPROACH) + deviation
    rate = rate - get_row(work, v + P_Y) + get_row(work, v + W_Y)
    for d in range(N_IN_PLANE, _n_gears(group)):
        reach = get_row(group.reach, d)
        approach = approach + reach * get_row(work, q + d)
        rate = rate + reach * get_row(work, v + d)
    return approach, rate


@inlined
def set_out(group, time, q, drive, forces, work, wide):
    """Write what stays the same over a step: nominal motion, the roll at its begin, and every
    force but the mesh's.

    Rows ``drive`` take the nominal speed, its change, the share of the set torque and the
    pinion's turn; rows ``forces`` the forces.
    """
    n = width(work)
    n_dof = len(group.force) // n
    exact, profile = group.exact, group.profile
    n_cells = len(profile) // (layout.N_PROFILE * n)
    cell = int(np.floor(time * group.cells_per_second)) - group.profile_first
    cell = min(max(cell, 0), n_cells - 1)
    since = time - (group.profile_first + cell) / group.cells_per_second
    first = cell * layout.N_PROFILE
    for lane in range(n):
        speed = profile[at(first + layout.NOMINAL_SPEED, lane, n)]
        gain = profile[at(first + layout.NOMINAL_ACCELERATION, lane, n)]
        turned = profile[at(first + layout.NOMINAL_ANGLE, lane, n)] + since * (
            speed + 0.5 * gain * since
        )
        torque, slope = (
            profile[at(first + layout.TORQUE, lane, n)],
            profile[at(first + layout.TORQUE_SLOPE, lane, n)],
        )
        work[at(drive + DRIVE_SPEED, lane, n)] = speed + gain * since
        work[at(drive + DRIVE_GAIN, lane, n)] = gain
        work[at(drive + DRIVE_TORQUE, lane, n)] = torque + since * slope
        work[at(drive + DRIVE_CENTER, lane, n)] = wide[at(CENTER, lane, n)]
        turned += wide[at(CENTER, lane, n)]
        wide[at(NOMINAL, lane, n)] = turned
        start_roll, radius = (
            exact[at(layout.START_ROLL, lane, n)],
            exact[at(layout.EXACT_RADIUS, lane, n)],
        )
        wide[at(BASE, lane, n)] = start_roll + radius * (
            turned + work[at(q + P_TURN, lane, n)]
        )
    gain, torque = (
        get_row(work, drive + DRIVE_GAIN),
        get_row(work, drive + DRIVE_TORQUE),
    )
    center = get_row(work, drive + DRIVE_CENTER)
    for d in range(n_dof):
        held = center * get_row(group.held, d) + gain * get_row(group.carried, d)
        set_row(
            work,
            forces + d,
            get_row(group.force, d)
            + get_row(group.set_force, d) * (torque - 1.0)
            - held,
        )


@inlined
def accelerate(group, law, q, v, torque, forces, a, work):
    """Fill the rows ``a`` with q'' under the forces of a mesh law."""
    n_dof, numbers = len(group.force) // width(work), group.numbers
    normal = law.normal - get_row(numbers, layout.MEAN_FORCE) * torque
    set_row(work, a + P_X, law.friction)
    set_row(work, a + P_Y, normal)
    set_row(
        work,
        a + P_TURN,
        get_row(numbers, layout.PINION_RADIUS) * (law.along - normal) + law.moment_p,
    )
    set_row(work, a + W_X, 0.0 - law.friction)
    set_row(work, a + W_Y, 0.0 - normal)
    set_row(
        work, a + W_TURN, get_row(numbers, layout.WHEEL_RADIUS) * normal + law.moment_w
    )
    n_gears = _n_gears(group)
    for d in range(N_IN_PLANE, n_gears):
        set_row(work, a + d, 0.0 - get_row(group.reach, d) * normal)
    for d in range(n_dof):
        pull = get_row(work, forces + d)
        spring, damper = get_row(group.stiffness, d), get_row(group.damping, d)
        pull = pull - spring * get_row(work, q + d) - damper * get_row(work, v + d)
        for k in range(group.other_first[d], group.other_first[d + 1]):
            other = group.other_column[k]
            pull = pull - get_row(group.other_stiffness, k) * get_row(work, q + other)
            pull = pull - get_row(group.other_damping, k) * get_row(work, v + other)
        if d < n_gears:
            pull = pull + get_row(work, a + d)
        set_row(work, a + d, pull * get_row(group.inverse_mass, d))


@inlined
def recenter(group, q, n_dof, work, wide):
    """Take the pinion's turn out of all rotations together, into ``CENTER``.

    No spring but the drive's sees it.
    """
    n = width(work)
    turn = get_row(work, q + P_TURN)
    for lane in range(n):
        wide[at(CENTER, lane, n)] += work[at(q + P_TURN, lane, n)]
    for d in range(n_dof):
        set_row(work, q + d, get_row(work, q + d) - turn * get_row(group.rotation, d))


@inlined
def _crossing(before, after, zero, one):
    """Share of the step at which a number changes its sign, 1 where it does not."""
    share = before / (before - after)
    return where_above(zero, before * after, share, one)


@inlined
def event(group, first, last, work):
    """Share of the step at which the first pair takes up or lets go of its load, from the margins
    at both ends.
    """
    zero, one = spread(work, 0.0), spread(work, 1.0)
    earliest = one
    for k in range(first, last):
        before, after = (
            get_row(work, MARGIN + k),
            get_row(work, MARGIN + MOST_PAIRS + k),
        )
        share = _crossing(before, after, zero, one)
        earliest = where_above(earliest, share, share, earliest)
        if not group.one_sided:  # and where the pair is wholly in
            share = (before - 1.0) / (before - after)
            share = where_above(zero, (before - 1.0) * (after - 1.0), share, one)
            earliest = where_above(earliest, share, share, earliest)
    play = get_row(group.numbers, layout.BACKLASH)
    before, after = (
        get_row(work, layout.WITHIN) + play,
        get_row(work, layout.STEP_APPROACH) + play,
    )
    share = _crossing(before, after, zero, one)
    earliest = where_above(earliest, share, share, earliest)
    earliest = where_above(one, earliest, earliest, spread(work, 0.5))
    low, high = spread(work, EARLIEST), spread(work, LATEST)
    earliest = where_above(low, earliest, low, earliest)
    return where_above(earliest, high, high, earliest)
