"""Two-evaluation core: the motions of the machine over a step.

With a of the begin, m of the middle and b of the end of a step h, and the values of the last step
in brackets,

    q_m = q + h v / 2 + h^2 (19 a - 10 [m] + 3 [a]) / 96,  v_m = v + h (23 a - 16 [m] + 5 [a]) / 24
    q_b = q + h v + h^2 (a + 2 m) / 6,                     v_b = v + h (a + 4 m + b) / 6

The end is evaluated with b = [m] - 3 a + 3 m.
"""

from __future__ import annotations

from gensig.dynamics._vector import fused, get_row, set_row
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._group import of

# of the largest damper, mass over step, that the scheme can follow: 0.56
DAMPER_SHARE = 0.5
SIXTH = 1.0 / 6.0
Q_NOW, Q_HALFWAY, Q_BEFORE = 19.0 / 96.0, -10.0 / 96.0, 3.0 / 96.0
V_NOW, V_HALFWAY, V_BEFORE = 23.0 / 24.0, -16.0 / 24.0, 5.0 / 24.0


@written
def to_middle(d, step, machine):
    """Set the state of one degree of freedom in the middle of the step; its place and speed."""
    a, last_m = (get_row(machine, of(name, d)) for name in (rows.NOW, rows.HALFWAY))
    last_a, rate = (get_row(machine, of(name, d)) for name in (rows.BEFORE, rows.V))
    moved = fused(Q_BEFORE, last_a, fused(Q_HALFWAY, last_m, Q_NOW * a))
    moved = fused(step, moved, 0.5 * rate)
    moved = fused(step, moved, get_row(machine, of(rows.Q, d)))
    set_row(machine, of(rows.MIDDLE_Q, d), moved)
    gained = fused(V_BEFORE, last_a, fused(V_HALFWAY, last_m, V_NOW * a))
    rate = fused(step, gained, rate)
    set_row(machine, of(rows.MIDDLE_V, d), rate)
    return moved, rate


@written
def predict(d, m, step, machine):
    """Keep the acceleration in the middle, and predict the end, of one degree of freedom.

    Returns its place and speed there.
    """
    a, last_m = (get_row(machine, of(name, d)) for name in (rows.NOW, rows.HALFWAY))
    set_row(machine, of(rows.HALFWAY, d), m)
    rate = get_row(machine, of(rows.V, d))
    moved = fused(step * SIXTH, fused(2.0, m, a), rate)
    moved = fused(step, moved, get_row(machine, of(rows.Q, d)))
    set_row(machine, of(rows.END_Q, d), moved)
    # a + 4 m + b with b = [m] - 3 a + 3 m
    gained = fused(7.0, m, fused(-2.0, a, last_m))
    rate = fused(step * SIXTH, gained, rate)
    set_row(machine, of(rows.END_V, d), rate)
    return moved, rate


@written
def conclude(d, b, step, machine):
    """Keep the acceleration at the end, and set state and mean acceleration, of one degree."""
    a, m = (get_row(machine, of(name, d)) for name in (rows.NOW, rows.HALFWAY))
    mean = SIXTH * fused(4.0, m, a + b)
    set_row(machine, of(rows.NOW, d), b)
    set_row(machine, of(rows.BEFORE, d), a)
    set_row(machine, of(rows.MEAN, d), mean)
    set_row(machine, of(rows.V, d), fused(step, mean, get_row(machine, of(rows.V, d))))
    set_row(machine, of(rows.Q, d), get_row(machine, of(rows.END_Q, d)))
