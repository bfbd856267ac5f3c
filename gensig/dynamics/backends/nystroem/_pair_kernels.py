"""Two-evaluation core for a pair of gears: fixed steps of a method of Nystroem, several records.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or
reorders sums: a record's bits depend on nothing but its own numbers. Arrays are flat; a row holds
one number for every record of the group. The machine is here. What the mesh reads, its law and what
its kinks miss are functions that ``pair_integrator`` takes: of ``_spur_pair`` and of
``_any_law_pair``.
"""

from __future__ import annotations

from typing import Any

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    P_TURN,
    accelerate,
    motion,
    recenter,
    set_out,
)
from gensig.dynamics._layout import EVEN, ODD
from gensig.dynamics._vector import (
    EIGHT,
    at,
    compiled,
    get_row,
    inlined,
    load_wide,
    set_row,
    spread,
    store,
    where_above,
    width,
)
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._layout import block, most_dofs
from gensig.dynamics.backends.nystroem._motion import (
    DAMPER_SHARE,
    finish,
    go_to_end,
    go_to_middle,
    mobility,
)

RECENTER = 256  # steps between two removals of the drift of the rotations, to keep numbers small


def pair_integrator(
    *,
    turn: Any,
    begin_mesh: Any,
    law_at_start: Any,
    write_mesh: Any,
    read_mesh: Any,
    law_in_middle: Any,
    law_at_end: Any,
    end_mesh: Any,
    keep_mesh: Any,
) -> Any:
    """The core of pairs of gears whose mesh has one law.

    ``turn`` is the rotation of the pinion that the mesh follows. The other functions are compiled
    code for the mesh: at the begin of a call, at the start of its fresh lanes, for the output, at
    the begin of a step, in its middle, at its end, after it, and at the end of a call.
    """

    @compiled
    def start(group, slot, fresh, by_tooth, work, wide, near):
        """Set what the step remembers in the lanes that are fresh, from one evaluation there."""
        n_dof, n_rows = len(group.force) // width(work), most_dofs(group)
        q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
        mean, forces = block(rows.MEAN, n_rows), block(rows.FORCES, n_rows)
        approach, rate = motion(group, q, v, work)
        roll_rate = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
        roll_rate = roll_rate + turn(group, v, work)
        roll_rate = get_row(group.numbers, layout.PINION_RADIUS) * roll_rate
        law = law_at_start(
            group, slot, fresh, by_tooth, approach, rate, roll_rate, work, wide, near
        )
        torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
        accelerate(group, law, q, v, torque, forces, mean, work)
        flags = get_row(work, rows.FRESH)
        for d in range(n_dof):
            a = get_row(work, mean + d)
            choose(flags, block(rows.NOW, n_rows) + d, a, work)
            choose(flags, block(rows.HALFWAY, n_rows) + d, a, work)
            choose(flags, block(rows.BEFORE, n_rows) + d, a, work)
        choose(flags, rows.NORMAL, law.normal, work)

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
        """Advance every lane by ``n_steps``; parameters are those of ``_record_kernels.integrate``.

        The law is evaluated in the middle and at the end of a step. The state in the middle
        follows from the accelerations that the step before has left; its own acceleration predicts
        the end.
        """
        n = width(work)
        n_dof, n_rows = len(group.force) // n, most_dofs(group)
        n_channels = len(channels) if out_row >= 0 else 0
        q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
        middle_q, middle_v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
        end_q, end_v = block(rows.END_Q, n_rows), block(rows.END_V, n_rows)
        forces, mean = block(rows.FORCES, n_rows), block(rows.MEAN, n_rows)
        radius = get_row(group.numbers, layout.PINION_RADIUS)
        changing = group.prescribed or len(group.profile) > layout.N_PROFILE * n
        by_tooth, starting = False, False
        for lane in range(n):
            by_tooth = by_tooth or group.indices[at(layout.WHEEL_ROWS, lane, n)] > 0
            starting = starting or fresh[lane] > 0.0
        set_row(work, layout.MOST_DAMPER, DAMPER_SHARE / (step * mobility(group)))
        for d in range(n_dof):
            set_row(work, q + d, get_row(state, d))
            set_row(work, v + d, get_row(state, n_dof + d))
        slot, next_slot = EVEN, ODD
        for number in range(first_step, first_step + n_steps):
            is_recentred = number % RECENTER == 0
            if is_recentred:
                recenter(group, q, n_dof, work, wide)
            if changing or is_recentred or number == first_step:
                set_out(group, number * step, q, rows.DRIVE, forces, work, wide)
            else:
                set_roll(group, number * step, q, work, wide)
            if number == first_step:
                begin_mesh(group, slot, fresh, step, work, wide, near)
                if starting:
                    start(group, slot, fresh, by_tooth, work, wide, near)
            if angle_row >= 0 and number % per_angle == 0:
                for lane in range(n):
                    turned = wide[at(layout.NOMINAL, lane, n)]
                    turned += work[at(q + P_TURN, lane, n)]
                    angle[at(angle_row, lane, n)] = turned
                if len(seen) > 0:
                    write_mesh(group, seen, angle_row, work, wide, near)
                angle_row += 1
            zero, one = spread(work, 0.0), spread(work, 1.0)
            normal = get_row(work, rows.NORMAL)
            apart = where_above(normal * normal, zero, zero, one)
            set_row(lost, 0, get_row(lost, 0) + apart)
            ahead = read_mesh(group, slot, next_slot, step, by_tooth, work, wide, near)
            # the middle of the step
            speed = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
            gain = get_row(work, rows.DRIVE + layout.DRIVE_GAIN)
            torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
            q_0 = turn(group, q, work)
            go_to_middle(step, n_dof, n_rows, work)
            approach, rate = motion(group, middle_q, middle_v, work)
            turned = (0.5 * step) * (speed + (0.25 * step) * gain)
            turned = radius * (turned + (turn(group, middle_q, work) - q_0))
            roll_rate = speed + (0.5 * step) * gain + turn(group, middle_v, work)
            law = law_in_middle(
                group,
                turned,
                approach,
                rate,
                radius * roll_rate,
                ahead,
                work,
                wide,
                near,
            )
            go_to_end(group, law, torque, step, n_dof, work)
            # the end of the step
            approach, rate = motion(group, end_q, end_v, work)
            nominal = step * (speed + (0.5 * step) * gain)
            turned = radius * (nominal + (turn(group, end_q, work) - q_0))
            roll_rate = speed + step * gain + turn(group, end_v, work)
            law = law_at_end(
                group,
                next_slot,
                turned,
                approach,
                rate,
                radius * roll_rate,
                ahead,
                work,
                wide,
                near,
            )
            finish(group, law, torque, step, n_dof, work)
            end_mesh(group, next_slot, law, step, nominal, q_0, ahead, work, near)
            out_first = (out_row + number - first_step) * n_channels
            for c in range(n_channels):
                carried = gain * get_row(group.rotation, channels[c])
                value = get_row(work, mean + channels[c]) + carried
                set_row(out, out_first + c, value)
            slot, next_slot = next_slot, slot
        if slot == ODD:
            keep_mesh(work, wide, near)
        for d in range(n_dof):
            set_row(state, d, get_row(work, q + d))
            set_row(state, n_dof + d, get_row(work, v + d))
        return angle_row

    return integrate


@inlined
def set_roll(group, time, q, work, wide):
    """Set nominal angle and roll at the begin of a step, at a constant speed."""
    n, exact = width(work), group.exact
    for first in range(0, n, EIGHT):
        speed = load_wide(group.profile, at(layout.NOMINAL_SPEED, first, n))
        turned = time * speed + load_wide(wide, at(layout.CENTER, first, n))
        store(wide, at(layout.NOMINAL, first, n), turned)
        turned = turned + load_wide(work, at(q + P_TURN, first, n))
        roll = load_wide(exact, at(layout.EXACT_RADIUS, first, n)) * turned
        roll = load_wide(exact, at(layout.START_ROLL, first, n)) + roll
        store(wide, at(layout.BASE, first, n), roll)


@written
def choose(flags, row, value, work):
    """Set a row in the lanes whose flag is above 0."""
    zero = spread(work, 0.0)
    set_row(work, row, where_above(flags, zero, value, get_row(work, row)))
