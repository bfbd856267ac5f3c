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
    P_X,
    P_Y,
    W_TURN,
    W_X,
    W_Y,
    dofs_of_gears,
)
from gensig.dynamics._vector import fused, get_row, inlined, set_row, spread
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._layout import block, most_dofs

# of the largest damper, mass over step, that the scheme can follow: 0.56
DAMPER_SHARE = 0.5
SIXTH = 1.0 / 6.0
Q_NOW, Q_HALFWAY, Q_BEFORE = 19.0 / 96.0, -10.0 / 96.0, 3.0 / 96.0
V_NOW, V_HALFWAY, V_BEFORE = 23.0 / 24.0, -16.0 / 24.0, 5.0 / 24.0


@inlined
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
    q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
    middle_q, middle_v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
    now, before = block(rows.NOW, n_rows), block(rows.BEFORE, n_rows)
    halfway = block(rows.HALFWAY, n_rows)
    for d in range(n_dof):
        a, last_m = get_row(work, now + d), get_row(work, halfway + d)
        last_a, rate = get_row(work, before + d), get_row(work, v + d)
        moved = fused(Q_BEFORE, last_a, fused(Q_HALFWAY, last_m, Q_NOW * a))
        moved = fused(step, moved, 0.5 * rate)
        set_row(work, middle_q + d, fused(step, moved, get_row(work, q + d)))
        gained = fused(V_BEFORE, last_a, fused(V_HALFWAY, last_m, V_NOW * a))
        set_row(work, middle_v + d, fused(step, gained, rate))


@inlined
def go_to_end(group, law, torque, step, n_dof, work):
    """Set the accelerations in the middle and the predicted state at the end of the step."""
    on_x, on_y, on_p, on_w = _on_gears(group, law, torque)
    _predict(group, P_X, on_x, step, work)
    _predict(group, P_Y, on_y, step, work)
    _predict(group, P_TURN, on_p, step, work)
    _predict(group, W_X, 0.0 - on_x, step, work)
    _predict(group, W_Y, 0.0 - on_y, step, work)
    _predict(group, W_TURN, on_w, step, work)
    n_gears = dofs_of_gears(group)
    for d in range(N_IN_PLANE, n_gears):
        _predict(group, d, _along_axes(group, d, on_y), step, work)
    for d in range(n_gears, n_dof):
        _predict(group, d, spread(work, 0.0), step, work)


@inlined
def finish(group, law, torque, step, n_dof, work):
    """Set accelerations and state at the end of the step, and the mean accelerations."""
    on_x, on_y, on_p, on_w = _on_gears(group, law, torque)
    _conclude(group, P_X, on_x, step, work)
    _conclude(group, P_Y, on_y, step, work)
    _conclude(group, P_TURN, on_p, step, work)
    _conclude(group, W_X, 0.0 - on_x, step, work)
    _conclude(group, W_Y, 0.0 - on_y, step, work)
    _conclude(group, W_TURN, on_w, step, work)
    n_gears = dofs_of_gears(group)
    for d in range(N_IN_PLANE, n_gears):
        _conclude(group, d, _along_axes(group, d, on_y), step, work)
    for d in range(n_gears, n_dof):
        _conclude(group, d, spread(work, 0.0), step, work)


@inlined
def _along_axes(group, d, normal):
    """Force of the mesh on a motion of helical gears out of their plane."""
    return 0.0 - get_row(group.reach, d) * normal


@inlined
def _on_gears(group, law, torque):
    """Forces of the mesh on the pinion's x, y and rotation, and on the wheel's rotation."""
    numbers = group.numbers
    normal = law.normal - get_row(numbers, layout.MEAN_FORCE) * torque
    arm_p = get_row(numbers, layout.PINION_RADIUS)
    arm_w = get_row(numbers, layout.WHEEL_RADIUS)
    on_p = arm_p * (law.along - normal) + law.moment_p
    return law.friction, normal, on_p, arm_w * normal + law.moment_w


@inlined
def acceleration(group, d, on_it, q, v, forces, work):
    """Acceleration of a degree of freedom under a force of the mesh, with states in rows."""
    spring = get_row(group.stiffness, d) * get_row(work, q + d)
    spring = fused(get_row(group.damping, d), get_row(work, v + d), spring)
    pull = get_row(work, forces + d) + (on_it - spring)
    if len(group.other_column) > 0:
        for k in range(group.other_first[d], group.other_first[d + 1]):
            other = group.other_column[k]
            moved, rate = get_row(work, q + other), get_row(work, v + other)
            pull = pull - get_row(group.other_stiffness, k) * moved
            pull = pull - get_row(group.other_damping, k) * rate
    return pull * get_row(group.inverse_mass, d)


@inlined
def _predict(group, d, on_it, step, work):
    n_rows = most_dofs(group)
    q, v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
    forces = block(rows.FORCES, n_rows)
    m = acceleration(group, d, on_it, q, v, forces, work)
    predict(d, m, step, n_rows, work)


@inlined
def _conclude(group, d, on_it, step, work):
    n_rows = most_dofs(group)
    q, v = block(rows.END_Q, n_rows), block(rows.END_V, n_rows)
    forces = block(rows.FORCES, n_rows)
    b = acceleration(group, d, on_it, q, v, forces, work)
    conclude(d, b, step, n_rows, work)


@inlined
def predict(d, m, step, n_rows, work):
    """Keep the acceleration in the middle, and predict the end, of one degree of freedom."""
    halfway = block(rows.HALFWAY, n_rows) + d
    a, last_m = get_row(work, block(rows.NOW, n_rows) + d), get_row(work, halfway)
    set_row(work, halfway, m)
    rate = get_row(work, block(rows.V, n_rows) + d)
    moved = fused(step * SIXTH, fused(2.0, m, a), rate)
    moved = fused(step, moved, get_row(work, block(rows.Q, n_rows) + d))
    set_row(work, block(rows.END_Q, n_rows) + d, moved)
    # a + 4 m + b with b = [m] - 3 a + 3 m
    gained = fused(7.0, m, fused(-2.0, a, last_m))
    set_row(work, block(rows.END_V, n_rows) + d, fused(step * SIXTH, gained, rate))


@inlined
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
