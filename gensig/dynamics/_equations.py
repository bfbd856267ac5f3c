"""Compiled core: the machine around the gear mesh, several records side by side.

``q`` and ``v`` are the first rows of a state: deviations and their rates, one row a degree of
freedom.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import CENTER, is_helical
from gensig.dynamics._vector import (
    at,
    chosen,
    get_row,
    inlined,
    set_row,
    spread,
    width,
)
from gensig.dynamics._written import written

# degrees of freedom of the two gears, first in every machine; helical gears have more after them
P_X, P_Y, P_TURN, W_X, W_Y, W_TURN, N_IN_PLANE = range(7)
N_GEARS = 12


@written
def dofs_of_gears(group):
    """Degrees of freedom of the two gears, first in every machine."""
    return N_GEARS if is_helical(group) else N_IN_PLANE


@written
def motion(group, q, v, work):
    """Approach and its rate, from the rows of a state."""
    numbers = group.numbers
    radius_p = get_row(numbers, layout.PINION_RADIUS)
    radius_w = get_row(numbers, layout.WHEEL_RADIUS)
    turned_p, turned_w = get_row(work, q + P_TURN), get_row(work, q + W_TURN)
    approach = radius_p * turned_p - radius_w * turned_w
    speed_p, speed_w = get_row(work, v + P_TURN), get_row(work, v + W_TURN)
    rate = radius_p * speed_p - radius_w * speed_w
    deviation = approach - get_row(work, q + P_Y) + get_row(work, q + W_Y)
    approach = get_row(numbers, layout.REST_APPROACH) + deviation
    rate = rate - get_row(work, v + P_Y) + get_row(work, v + W_Y)
    for d in range(N_IN_PLANE, dofs_of_gears(group)):
        reach = get_row(group.reach, d)
        approach = approach + reach * get_row(work, q + d)
        rate = rate + reach * get_row(work, v + d)
    return approach, rate


@written
def own_turn(group, row, work):
    """Rotation or speed of the pinion beside the nominal one, as far as the mesh follows it."""
    return chosen(group.prescribed, spread(work, 0.0), get_row(work, row + P_TURN))


@inlined
def set_out(group, time, q, drive, forces, work, wide):
    """Write what stays constant over a step.

    Rows ``drive`` take the nominal speed, its change, the share of the set torque and the
    pinion's rotation; rows ``forces`` every force but the mesh's. ``wide`` takes the nominal
    angle and the roll at the begin of the step.
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
        turned = since * (speed + 0.5 * gain * since)
        turned = profile[at(first + layout.NOMINAL_ANGLE, lane, n)] + turned
        slope = profile[at(first + layout.TORQUE_SLOPE, lane, n)]
        torque = profile[at(first + layout.TORQUE, lane, n)] + since * slope
        center = wide[at(layout.CENTER, lane, n)]
        work[at(drive + layout.DRIVE_SPEED, lane, n)] = speed + gain * since
        work[at(drive + layout.DRIVE_GAIN, lane, n)] = gain
        work[at(drive + layout.DRIVE_TORQUE, lane, n)] = torque
        work[at(drive + layout.DRIVE_CENTER, lane, n)] = center
        roll = turned
        turned += center
        wide[at(layout.NOMINAL, lane, n)] = turned
        if not group.prescribed:
            roll = turned + work[at(q + P_TURN, lane, n)]
        roll = exact[at(layout.EXACT_RADIUS, lane, n)] * roll
        roll = exact[at(layout.START_ROLL, lane, n)] + roll
        wide[at(layout.BASE, lane, n)] = roll
    gain = get_row(work, drive + layout.DRIVE_GAIN)
    torque = get_row(work, drive + layout.DRIVE_TORQUE)
    center = get_row(work, drive + layout.DRIVE_CENTER)
    for d in range(n_dof):
        held = center * get_row(group.held, d) + gain * get_row(group.carried, d)
        added = get_row(group.set_force, d) * (torque - 1.0)
        set_row(work, forces + d, get_row(group.force, d) + added - held)


@inlined
def accelerate(group, law, q, v, torque, forces, a, work):
    """Fill the rows ``a`` with q'' under the forces of a mesh law."""
    n_dof, numbers = len(group.force) // width(work), group.numbers
    normal = law.normal - get_row(numbers, layout.MEAN_FORCE) * torque
    arm_p = get_row(numbers, layout.PINION_RADIUS)
    arm_w = get_row(numbers, layout.WHEEL_RADIUS)
    set_row(work, a + P_X, law.friction)
    set_row(work, a + P_Y, normal)
    set_row(work, a + P_TURN, arm_p * (law.along - normal) + law.moment_p)
    set_row(work, a + W_X, 0.0 - law.friction)
    set_row(work, a + W_Y, 0.0 - normal)
    set_row(work, a + W_TURN, arm_w * normal + law.moment_w)
    n_gears = dofs_of_gears(group)
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
    """Move the pinion's rotation from all rotations of the state into ``CENTER``.

    Only the drive's spring depends on a common rotation.
    """
    n = width(work)
    turn = get_row(work, q + P_TURN)
    for lane in range(n):
        wide[at(CENTER, lane, n)] += work[at(q + P_TURN, lane, n)]
    for d in range(n_dof):
        set_row(work, q + d, get_row(work, q + d) - turn * get_row(group.rotation, d))
