"""Two-evaluation core: fixed steps of a method of Nystroem, several records side by side.

As in ``gensig.dynamics._kernels`` every number of a record lies in its own lane of a vector, and
no instruction mixes lanes or reorders sums.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    P_TURN,
    accelerate,
    motion,
    recenter,
    set_out,
)
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._vector import (
    EIGHT,
    any_above,
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
from gensig.dynamics.backends.nystroem._kinks import correct, kinked
from gensig.dynamics.backends.nystroem._law import mesh_law
from gensig.dynamics.backends.nystroem._layout import (
    FOLLOWED,
    MOST_DOFS,
    NystroemGroup,
    block,
)
from gensig.dynamics.backends.nystroem._motion import (
    DAMPER_SHARE,
    finish,
    go_to_end,
    go_to_middle,
    mobility,
)
from gensig.dynamics.backends.nystroem._pairs import (
    first_pairs,
    locate,
    read_begin,
    read_step,
    take_pairs,
)

RECENTER = 256  # steps between two removals of the drift of the rotations


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

    The law is evaluated in the middle and at the end of a step. The state in the middle follows
    from the accelerations that the step before has left; its own acceleration predicts the end.
    """
    n = width(work)
    n_dof = len(group.force) // n
    n_channels = len(channels) if out_row >= 0 else 0
    zero, one = spread(work, 0.0), spread(work, 1.0)
    q, v = block(rows.Q, MOST_DOFS), block(rows.V, MOST_DOFS)
    middle_q, middle_v = (
        block(rows.MIDDLE_Q, MOST_DOFS),
        block(rows.MIDDLE_V, MOST_DOFS),
    )
    end_q, end_v = block(rows.END_Q, MOST_DOFS), block(rows.END_V, MOST_DOFS)
    now, forces, mean = (
        block(rows.NOW, MOST_DOFS),
        block(rows.FORCES, MOST_DOFS),
        block(rows.MEAN, MOST_DOFS),
    )
    radius = get_row(group.numbers, layout.PINION_RADIUS)
    changing = len(group.profile) > layout.N_PROFILE * n
    by_tooth, starting = False, False
    for lane in range(n):
        by_tooth = by_tooth or group.indices[at(layout.WHEEL_ROWS, lane, n)] > 0
        starting = starting or fresh[lane] > 0.0
        bend = group.bend[lane * layout.COLUMNS]
        work[at(rows.BEND, lane, n)] = bend
    turn = 1.0 / get_row(group.numbers, layout.PER_FRICTION_WIDTH)
    set_row(work, rows.FRICTION_WIDTH, turn)
    set_row(work, layout.MOST_DAMPER, DAMPER_SHARE / (step * mobility(group)))
    for d in range(n_dof):
        set_row(work, q + d, get_row(state, d))
        set_row(work, v + d, get_row(state, n_dof + d))
    for number in range(first_step, first_step + n_steps):
        is_recentred = number % RECENTER == 0
        if is_recentred:
            recenter(group, q, n_dof, work, wide)
        if changing or is_recentred or number == first_step:
            set_out(group, number * step, q, rows.DRIVE, forces, work, wide)
        else:
            set_roll(group, number * step, q, work, wide)
        if starting and number == first_step:
            start(group, fresh, by_tooth, work, wide)
        if angle_row >= 0 and number % per_angle == 0:
            for lane in range(n):
                turned = wide[at(layout.NOMINAL, lane, n)]
                turned += work[at(q + P_TURN, lane, n)]
                angle[at(angle_row, lane, n)] = turned
            if len(seen) > 0:
                write_mesh(group, seen, angle_row, work, wide)
            angle_row += 1
        normal = get_row(work, rows.NORMAL)
        apart = where_above(normal * normal, zero, zero, one)
        set_row(lost, 0, get_row(lost, 0) + apart)
        if locate(group, work, wide):
            take_pairs(group, by_tooth, work, wide)
        # the roll at the end of the step, with every force in it, and the tables there
        speed = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
        gain = get_row(work, rows.DRIVE + layout.DRIVE_GAIN)
        torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
        turning = gain + get_row(work, now + P_TURN)
        turning = speed + get_row(work, v + P_TURN) + (0.5 * step) * turning
        ahead, behind = step * radius * turning, get_row(work, rows.BEHIND)
        span = ahead - behind
        per_span = 1.0 / span
        for j in range(FOLLOWED):
            read_step(group, by_tooth, j, ahead, span, per_span, work, wide)
        # the middle of the step
        q_0 = get_row(work, q + P_TURN)
        go_to_middle(step, n_dof, MOST_DOFS, work)
        approach, rate = motion(group, middle_q, middle_v, work)
        turned = (0.5 * step) * (speed + (0.25 * step) * gain)
        turned = radius * (turned + (get_row(work, middle_q + P_TURN) - q_0))
        off = turned - 0.5 * (ahead + behind)
        roll_rate = speed + (0.5 * step) * gain + get_row(work, middle_v + P_TURN)
        law = mesh_law(
            group,
            rows.MIDDLE,
            rows.MIDDLE_AT,
            off,
            turned,
            approach,
            rate,
            radius * roll_rate,
            work,
            wide,
        )
        go_to_end(group, law, torque, step, n_dof, work)
        # the end of the step
        approach, rate = motion(group, end_q, end_v, work)
        turned = step * (speed + (0.5 * step) * gain)
        turned = radius * (turned + (get_row(work, end_q + P_TURN) - q_0))
        roll_rate = speed + step * gain + get_row(work, end_v + P_TURN)
        law = mesh_law(
            group,
            rows.NODES,
            rows.END_AT,
            turned - ahead,
            turned,
            approach,
            rate,
            radius * roll_rate,
            work,
            wide,
        )
        finish(group, law, torque, step, n_dof, work)
        changed = kinked(0, work), kinked(1, work), kinked(2, work)
        if any_above(changed[0] + changed[1] + changed[2], zero):
            correct(group, step, changed, mean, v, q, work)
        set_row(work, rows.NORMAL, law.normal)
        turned = step * (speed + (0.5 * step) * gain)
        turned = radius * (turned + (get_row(work, q + P_TURN) - q_0))
        set_row(work, rows.BEHIND, ahead - turned)
        for j in range(FOLLOWED):
            margin = get_row(work, rows.MARGIN + rows.END_AT * FOLLOWED + j)
            set_row(work, rows.MARGIN + j, margin)
        out_first = (out_row + number - first_step) * n_channels
        for c in range(n_channels):
            carried = gain * get_row(group.rotation, channels[c])
            value = get_row(work, mean + channels[c]) + carried
            set_row(out, out_first + c, value)
    for d in range(n_dof):
        set_row(state, d, get_row(work, q + d))
        set_row(state, n_dof + d, get_row(work, v + d))
    return angle_row


integrates(integrate, NystroemGroup)


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


@compiled
def start(group, fresh, by_tooth, work, wide):
    """Set what the step remembers in the lanes that are fresh, from one evaluation there."""
    n = width(work)
    n_dof = len(group.force) // n
    q, v = block(rows.Q, MOST_DOFS), block(rows.V, MOST_DOFS)
    mean, forces = block(rows.MEAN, MOST_DOFS), block(rows.FORCES, MOST_DOFS)
    zero, radius = spread(work, 0.0), get_row(group.numbers, layout.PINION_RADIUS)
    first_pairs(group, fresh, work, wide)
    for j in range(FOLLOWED):
        read_begin(group, by_tooth, j, work, wide)
    approach, rate = motion(group, q, v, work)
    roll_rate = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
    roll_rate = radius * (roll_rate + get_row(work, v + P_TURN))
    kept = (
        get_row(work, rows.PAIR_FORCE),
        get_row(work, rows.PAIR_FORCE + 1),
        get_row(work, rows.PAIR_FORCE + 2),
    )
    law = mesh_law(
        group,
        rows.NODES,
        rows.END_AT,
        0.0 - get_row(work, rows.BEHIND),
        zero,
        approach,
        rate,
        roll_rate,
        work,
        wide,
    )
    torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
    accelerate(group, law, q, v, torque, forces, mean, work)
    flags = get_row(work, rows.FRESH)
    for d in range(n_dof):
        a = get_row(work, mean + d)
        choose(flags, block(rows.NOW, MOST_DOFS) + d, a, work)
        choose(flags, block(rows.HALFWAY, MOST_DOFS) + d, a, work)
        choose(flags, block(rows.BEFORE, MOST_DOFS) + d, a, work)
    choose(flags, rows.NORMAL, law.normal, work)
    for j in range(FOLLOWED):
        margin = get_row(work, rows.MARGIN + rows.END_AT * FOLLOWED + j)
        choose(flags, rows.MARGIN + j, margin, work)
    for j in range(FOLLOWED):
        force = get_row(work, rows.PAIR_FORCE + j)
        force = where_above(flags, zero, force, kept[j])
        set_row(work, rows.PAIR_FORCE + j, force)


@written
def choose(flags, row, value, work):
    """Set a row in the lanes whose flag is above 0."""
    zero = spread(work, 0.0)
    set_row(work, row, where_above(flags, zero, value, get_row(work, row)))


@inlined
def write_mesh(group, seen, row, work, wide):
    """Write the state of the pairs at the begin of a step, the newest pair first."""
    n, first = width(work), row * layout.N_SEEN
    for lane in range(n):
        pitch = group.exact[at(layout.PITCH, lane, n)]
        newest = int((wide[at(layout.BASE, lane, n)] / pitch) // 1.0)
        newest = newest - group.indices[at(layout.FIRST_PITCH, lane, n)]
        seen[at(first + layout.SEEN_NEWEST, lane, n)] = newest
        normal = work[at(rows.NORMAL, lane, n)]
        seen[at(first + layout.SEEN_FORCE, lane, n)] = normal
        for k in range(layout.MOST_PAIRS):
            seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = 0.0
        for j in range(FOLLOWED):
            k = newest - int(wide[at(rows.NUMBER + j, lane, n)])
            if 0 <= k < layout.MOST_PAIRS:
                force = work[at(rows.PAIR_FORCE + j, lane, n)]
                seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = force
