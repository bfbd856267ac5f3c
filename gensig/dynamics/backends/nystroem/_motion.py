"""Two-evaluation core: the motions of the machine over a step.

With a of the begin, m of the middle and b of the end of a step h, and the values of the last step
in brackets,

    q_m = q + h v / 2 + h^2 (19 a - 10 [m] + 3 [a]) / 96,  v_m = v + h (23 a - 16 [m] + 5 [a]) / 24
    q_b = q + h v + h^2 (a + 2 m) / 6,                     v_b = v + h (a + 4 m + b) / 6

The end is evaluated with b = [m] - 3 a + 3 m.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    N_IN_PLANE,
    P_TURN,
    P_Y,
    W_TURN,
    W_Y,
    dofs_of_gears,
)
from gensig.dynamics._vector import fused, get_row, inlined, set_row, spread
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._layout import block, most_dofs

# of the largest damper, mass over step, that the scheme can follow: 0.56
DAMPER_SHARE = 0.5
SIXTH = 1.0 / 6.0
Q_NOW, Q_HALFWAY, Q_BEFORE = 19.0 / 96.0, -10.0 / 96.0, 3.0 / 96.0
V_NOW, V_HALFWAY, V_BEFORE = 23.0 / 24.0, -16.0 / 24.0, 5.0 / 24.0


@written
def mobility(group):
    """Acceleration of the approach by a force of the mesh, 1/kg."""
    numbers, mass = group.numbers, group.inverse_mass
    radius_p = get_row(numbers, layout.PINION_RADIUS)
    radius_w = get_row(numbers, layout.WHEEL_RADIUS)
    turning = radius_p * radius_p * get_row(mass, P_TURN)
    turning = turning + radius_w * radius_w * get_row(mass, W_TURN)
    moved = turning + get_row(mass, P_Y) + get_row(mass, W_Y)
    for d in range(N_IN_PLANE, dofs_of_gears(group)):
        reach = get_row(group.reach, d)
        moved = moved + reach * reach * get_row(mass, d)
    return moved


@inlined
def go_to_middle(step, n_dof, n_rows, work):
    """Set the state in the middle of the step from the accelerations that are known.

    Blocks have ``n_rows`` rows each.
    """
    for d in range(n_dof):
        to_middle(d, step, n_rows, work)


@written
def to_middle(d, step, n_rows, work):
    """Set the state of one degree of freedom in the middle of the step; its place and speed."""
    q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
    middle_q, middle_v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
    now, before = block(rows.NOW, n_rows), block(rows.BEFORE, n_rows)
    halfway = block(rows.HALFWAY, n_rows)
    a, last_m = get_row(work, now + d), get_row(work, halfway + d)
    last_a, rate = get_row(work, before + d), get_row(work, v + d)
    moved = fused(Q_BEFORE, last_a, fused(Q_HALFWAY, last_m, Q_NOW * a))
    moved = fused(step, moved, 0.5 * rate)
    moved = fused(step, moved, get_row(work, q + d))
    set_row(work, middle_q + d, moved)
    gained = fused(V_BEFORE, last_a, fused(V_HALFWAY, last_m, V_NOW * a))
    rate = fused(step, gained, rate)
    set_row(work, middle_v + d, rate)
    return moved, rate


@inlined
def go_to_end(group, law, torque, step, n_dof, work):
    """Set the accelerations in the middle and the predicted state at the end of the step."""
    if len(group.other_column) > 0:
        set_loads(group, law, torque, n_dof, work)
        for d in range(n_dof):
            m = _loaded_acceleration(group, d, rows.MIDDLE_Q, rows.MIDDLE_V, work)
            predict(d, m, step, most_dofs(group), work)
    else:
        _predict_gears(group, law, torque, step, work)
        for d in range(dofs_of_gears(group), n_dof):
            _predict(group, d, spread(work, 0.0), step, work)


@inlined
def finish(group, law, torque, step, n_dof, work):
    """Set accelerations and state at the end of the step, and the mean accelerations."""
    if len(group.other_column) > 0:
        set_loads(group, law, torque, n_dof, work)
        for d in range(n_dof):
            b = _loaded_acceleration(group, d, rows.END_Q, rows.END_V, work)
            conclude(d, b, step, most_dofs(group), work)
    else:
        _conclude_gears(group, law, torque, step, work)
        for d in range(dofs_of_gears(group), n_dof):
            _conclude(group, d, spread(work, 0.0), step, work)


@written
def _predict_gears(group, law, torque, step, work):
    for d, load in enumerate(_loads(group, law, torque)):
        _predict(group, d, load, step, work)


@written
def _conclude_gears(group, law, torque, step, work):
    for d, load in enumerate(_loads(group, law, torque)):
        _conclude(group, d, load, step, work)


@written
def _loads(group, law, torque):
    """Forces of the mesh on the motions of both gears."""
    on_x, on_y, on_p, on_w = _on_gears(group, law, torque)
    axes = range(N_IN_PLANE, dofs_of_gears(group))
    along = [_along_axes(group, d, on_y) for d in axes]
    return on_x, on_y, on_p, 0.0 - on_x, 0.0 - on_y, on_w, *along


@inlined
def set_loads(group, law, torque, n_dof, work):
    """Set the rows of the mean accelerations, which follow later, to the forces of the mesh."""
    first = block(rows.MEAN, most_dofs(group))
    _set_loads(group, law, torque, first, work)
    for d in range(dofs_of_gears(group), n_dof):
        set_row(work, first + d, spread(work, 0.0))


@written
def _set_loads(group, law, torque, first, work):
    for d, load in enumerate(_loads(group, law, torque)):
        set_row(work, first + d, load)


@written
def _along_axes(group, d, normal):
    """Force of the mesh on a motion of helical gears out of their plane."""
    return 0.0 - get_row(group.reach, d) * normal


@written
def _on_gears(group, law, torque):
    """Forces of the mesh on the pinion's x, y and rotation, and on the wheel's rotation."""
    numbers = group.numbers
    normal = law.normal - get_row(numbers, layout.MEAN_FORCE) * torque
    arm_p = get_row(numbers, layout.PINION_RADIUS)
    arm_w = get_row(numbers, layout.WHEEL_RADIUS)
    on_p = arm_p * (law.along - normal) + law.moment_p
    return law.friction, normal, on_p, arm_w * normal + law.moment_w


@written
def _pull(group, d, on_it, q, v, forces, work):
    """Force on a degree of freedom without those of its neighbours, with states in rows."""
    spring = get_row(group.stiffness, d) * get_row(work, q + d)
    spring = fused(get_row(group.damping, d), get_row(work, v + d), spring)
    return get_row(work, forces + d) + (on_it - spring)


@inlined
def _loaded_acceleration(group, d, states, rates, work):
    """Acceleration of a degree of freedom under what ``set_loads`` has set and its neighbours."""
    n_rows = most_dofs(group)
    q, v = block(states, n_rows), block(rates, n_rows)
    load = get_row(work, block(rows.MEAN, n_rows) + d)
    pull = _pull(group, d, load, q, v, block(rows.FORCES, n_rows), work)
    for k in range(group.other_first[d], group.other_first[d + 1]):
        pull = _with_neighbour(group, k, group.other_column[k], pull, q, v, work)
    return pull * get_row(group.inverse_mass, d)


@written
def _with_neighbour(group, k, other, pull, q, v, work):
    moved, rate = get_row(work, q + other), get_row(work, v + other)
    pull = pull - get_row(group.other_stiffness, k) * moved
    return pull - get_row(group.other_damping, k) * rate


@written
def _predict(group, d, on_it, step, work):
    n_rows = most_dofs(group)
    q, v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
    pull = _pull(group, d, on_it, q, v, block(rows.FORCES, n_rows), work)
    predict(d, pull * get_row(group.inverse_mass, d), step, n_rows, work)


@written
def _conclude(group, d, on_it, step, work):
    n_rows = most_dofs(group)
    q, v = block(rows.END_Q, n_rows), block(rows.END_V, n_rows)
    pull = _pull(group, d, on_it, q, v, block(rows.FORCES, n_rows), work)
    conclude(d, pull * get_row(group.inverse_mass, d), step, n_rows, work)


@written
def predict(d, m, step, n_rows, work):
    """Keep the acceleration in the middle, and predict the end, of one degree of freedom.

    Returns its place and speed there.
    """
    halfway = block(rows.HALFWAY, n_rows) + d
    a, last_m = get_row(work, block(rows.NOW, n_rows) + d), get_row(work, halfway)
    set_row(work, halfway, m)
    rate = get_row(work, block(rows.V, n_rows) + d)
    moved = fused(step * SIXTH, fused(2.0, m, a), rate)
    moved = fused(step, moved, get_row(work, block(rows.Q, n_rows) + d))
    set_row(work, block(rows.END_Q, n_rows) + d, moved)
    # a + 4 m + b with b = [m] - 3 a + 3 m
    gained = fused(7.0, m, fused(-2.0, a, last_m))
    rate = fused(step * SIXTH, gained, rate)
    set_row(work, block(rows.END_V, n_rows) + d, rate)
    return moved, rate


@written
def conclude(d, b, step, n_rows, work):
    """Keep the acceleration at the end, and set state and mean acceleration, of one degree."""
    end_q = block(rows.END_Q, n_rows)
    now, v = block(rows.NOW, n_rows) + d, block(rows.V, n_rows) + d
    a, m = get_row(work, now), get_row(work, block(rows.HALFWAY, n_rows) + d)
    mean = SIXTH * fused(4.0, m, a + b)
    set_row(work, now, b)
    set_row(work, block(rows.BEFORE, n_rows) + d, a)
    set_row(work, block(rows.MEAN, n_rows) + d, mean)
    set_row(work, v, fused(step, mean, get_row(work, v)))
    set_row(work, block(rows.Q, n_rows) + d, get_row(work, end_q + d))
