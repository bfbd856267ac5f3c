"""Two-evaluation core for meshes of any law: chords of helical teeth, the paper's law, and spur
pairs of which more than three touch.

The motions are those of ``_motion``; tables and law are in ``_tables`` and ``_mesh_kernels``.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    P_TURN,
    accelerate,
    motion,
    own_turn,
    recenter,
    set_out,
)
from gensig.dynamics._layout import AHEAD, BASE, EVEN, MIDDLE, ODD, ROLL, is_helical
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._slots import (
    keep_begin,
    near_pairs,
    roll_ahead,
    write_mesh,
)
from gensig.dynamics._tables import between, chords_between, cover, gather
from gensig.dynamics._vector import (
    any_above,
    at,
    compiled,
    get_row,
    inlined,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._any_law_kinks import (
    begin_again,
    correct,
    count_anew,
    keep_margins,
    kinked,
    margin_row,
    push_missed,
)
from gensig.dynamics.backends.nystroem._chord_kinks import miss_chords, read_again
from gensig.dynamics.backends.nystroem._kernels import RECENTER, choose
from gensig.dynamics.backends.nystroem._layout import (
    BEGIN_AT,
    END_AT,
    MIDDLE_AT,
    AnyLawGroup,
    HelicalNystroemGroup,
    block,
    most_dofs,
)
from gensig.dynamics.backends.nystroem._motion import (
    DAMPER_SHARE,
    finish,
    go_to_end,
    go_to_middle,
    mobility,
)


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

    The scheme is that of ``nystroem._kernels``.
    """
    n = width(work)
    n_dof, n_rows = len(group.force) // n, most_dofs(group)
    n_channels = len(channels) if out_row >= 0 else 0
    zero, one = spread(work, 0.0), spread(work, 1.0)
    q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
    middle_q, middle_v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
    end_q, end_v = block(rows.END_Q, n_rows), block(rows.END_V, n_rows)
    now, forces = block(rows.NOW, n_rows), block(rows.FORCES, n_rows)
    mean = block(rows.MEAN, n_rows)
    radius = get_row(group.numbers, layout.PINION_RADIUS)
    set_row(work, layout.MOST_DAMPER, DAMPER_SHARE / (step * mobility(group)))
    begin, end, starting = EVEN, ODD, False
    for lane in range(n):
        starting = starting or fresh[lane] > 0.0
        if fresh[lane] > 0.0:
            near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
    for d in range(n_dof):
        set_row(work, q + d, get_row(state, d))
        set_row(work, v + d, get_row(state, n_dof + d))
    for number in range(first_step, first_step + n_steps):
        if number % RECENTER == 0:
            recenter(group, q, n_dof, work, wide)
        set_out(group, number * step, q, rows.DRIVE, forces, work, wide)
        speed = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
        gain = get_row(work, rows.DRIVE + layout.DRIVE_GAIN)
        torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
        approach, rate = motion(group, q, v, work)
        look_ahead(group, step, approach, rate, work)
        if number == first_step:
            read_begin(group, begin, fresh, step, approach, rate, work, wide, near)
            if starting:
                start(group, begin, fresh, approach, rate, work, wide, near)
        if angle_row >= 0 and number % per_angle == 0:
            for lane in range(n):
                turned = wide[at(layout.NOMINAL, lane, n)]
                turned += work[at(q + P_TURN, lane, n)]
                angle[at(angle_row, lane, n)] = turned
            if len(seen) > 0:
                normal = get_row(work, rows.NORMAL)
                write_mesh(seen, angle_row, normal, work, near)
            angle_row += 1
        normal = get_row(work, rows.NORMAL)
        apart = where_above(normal * normal, zero, zero, one)
        set_row(lost, 0, get_row(lost, 0) + apart)
        # the roll at the end of the step, with every force in it, and the tables there
        turning = gain + own_turn(group, now, work)
        turning = speed + own_turn(group, v, work) + (0.5 * step) * turning
        set_row(work, AHEAD + end, step * radius * turning)
        roll_ahead(end, work, wide)
        set_row(work, layout.FLAGS, one)
        rechosen = gather(group, end, True, work, wide, near)
        if rechosen:
            read_again(group, begin, approach, work, wide, near)
        first, last = near_pairs(begin, n, near)
        first_end, last_end = near_pairs(end, n, near)
        first, last = min(first, first_end), max(last, last_end)
        cover(begin, first, last, work, near)
        cover(end, first, last, work, near)
        for lane in range(n):
            ahead = wide[at(ROLL + begin, lane, n)] - wide[at(BASE, lane, n)]
            work[at(AHEAD + begin, lane, n)] = ahead
        between(begin, end, MIDDLE, first, last, work)
        if is_helical(group):
            chords_between(begin, end, MIDDLE, first, last, work)
        # the middle of the step
        q_0 = own_turn(group, q, work)
        go_to_middle(step, n_dof, n_rows, work)
        halfway, rate = motion(group, middle_q, middle_v, work)
        turned = (0.5 * step) * (speed + (0.25 * step) * gain)
        turned = radius * (turned + (own_turn(group, middle_q, work) - q_0))
        roll_rate = speed + (0.5 * step) * gain + own_turn(group, middle_v, work)
        law = mesh_law(
            group,
            first,
            last,
            MIDDLE,
            layout.MARGIN,
            turned,
            halfway,
            rate,
            radius * roll_rate,
            work,
            wide,
        )
        keep_margins(group, MIDDLE_AT, first, last, MIDDLE, work)
        go_to_end(group, law, torque, step, n_dof, work)
        # the end of the step
        for k in range(layout.MOST_PAIRS):
            set_row(work, layout.PAIR_FORCE + k, zero)
        approach, rate = motion(group, end_q, end_v, work)
        turned = step * (speed + (0.5 * step) * gain)
        turned = radius * (turned + (own_turn(group, end_q, work) - q_0))
        roll_rate = speed + step * gain + own_turn(group, end_v, work)
        law = mesh_law(
            group,
            first,
            last,
            end,
            layout.MARGIN,
            turned,
            approach,
            rate,
            radius * roll_rate,
            work,
            wide,
        )
        keep_margins(group, END_AT, first, last, end, work)
        finish(group, law, torque, step, n_dof, work)
        changed = zero
        for k in range(first, last):
            changed = changed + kinked(group, k, work)
        if any_above(changed, zero):
            correct(group, step, halfway, first, last, mean, v, q, work)
        if is_helical(group) and rechosen:
            miss_chords(group, end, approach, first, last, work)
            push_missed(group, step, first, last, mean, v, q, work)
        set_row(work, rows.NORMAL, law.normal)
        if is_helical(group):
            set_row(work, layout.LAST_TOTAL, get_row(work, layout.TOTAL))
        begin_again(group, first, last, work)
        out_first = (out_row + number - first_step) * n_channels
        for c in range(n_channels):
            carried = gain * get_row(group.rotation, channels[c])
            value = get_row(work, mean + channels[c]) + carried
            set_row(out, out_first + c, value)
        begin, end = end, begin
    if begin == ODD:
        keep_begin(work, wide, near)
    for d in range(n_dof):
        set_row(state, d, get_row(work, q + d))
        set_row(state, n_dof + d, get_row(work, v + d))
    return angle_row


integrates(integrate, AnyLawGroup, HelicalNystroemGroup)


@inlined
def look_ahead(group, step, approach, rate, work):
    """Set how near pairs are that may touch in the step, and what chords are chosen by."""
    margin = spread(work, layout.NEAR if group.one_sided else 2.0 * layout.FAR)
    set_row(work, layout.WITHIN, approach + margin)
    if is_helical(group):
        bent = get_row(group.numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
        set_row(work, layout.LOCAL, approach + (0.5 * step) * rate - bent)


@compiled
def read_begin(group, begin, fresh, step, approach, rate, work, wide, near):
    """Read the tables at the begin of the first step of a call; lanes that go on keep chords."""
    n = width(work)
    for lane in range(n):
        work[at(layout.FLAGS, lane, n)] = fresh[lane]
        if fresh[lane] > 0.0:
            wide[at(ROLL + begin, lane, n)] = wide[at(BASE, lane, n)]
            mean_force = group.numbers[at(layout.MEAN_FORCE, lane, n)]
            work[at(layout.LAST_TOTAL, lane, n)] = mean_force
    look_ahead(group, step, approach, rate, work)
    set_row(work, AHEAD + begin, spread(work, 0.0))
    gather(group, begin, True, work, wide, near)


@compiled
def start(group, begin, fresh, approach, rate, work, wide, near):
    """Set what the step remembers in the lanes that are fresh, from one evaluation there."""
    n, n_rows = width(work), most_dofs(group)
    n_dof = len(group.force) // n
    zero, radius = spread(work, 0.0), get_row(group.numbers, layout.PINION_RADIUS)
    q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
    mean, forces = block(rows.MEAN, n_rows), block(rows.FORCES, n_rows)
    for lane in range(n):
        work[at(rows.FRESH, lane, n)] = fresh[lane]
        ahead = wide[at(ROLL + begin, lane, n)] - wide[at(BASE, lane, n)]
        work[at(AHEAD + begin, lane, n)] = ahead
    for k in range(layout.MOST_PAIRS):  # those of the other lanes wait in other rows
        set_row(work, rows.ANY_SHORT + k, get_row(work, layout.PAIR_FORCE + k))
        set_row(work, layout.PAIR_FORCE + k, zero)
    first, last = near_pairs(begin, n, near)
    roll_rate = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
    law = mesh_law(
        group,
        first,
        last,
        begin,
        layout.MARGIN,
        zero,
        approach,
        rate,
        radius * (roll_rate + own_turn(group, v, work)),
        work,
        wide,
    )
    keep_margins(group, END_AT, first, last, begin, work)
    torque = get_row(work, rows.DRIVE + layout.DRIVE_TORQUE)
    accelerate(group, law, q, v, torque, forces, mean, work)
    flags = get_row(work, rows.FRESH)
    for d in range(n_dof):
        a = get_row(work, mean + d)
        choose(flags, block(rows.NOW, n_rows) + d, a, work)
        choose(flags, block(rows.HALFWAY, n_rows) + d, a, work)
        choose(flags, block(rows.BEFORE, n_rows) + d, a, work)
    choose(flags, rows.NORMAL, law.normal, work)
    count_anew(group, work, near)
    for k in range(layout.MOST_PAIRS):
        force = get_row(work, layout.PAIR_FORCE + k)
        kept = get_row(work, rows.ANY_SHORT + k)
        set_row(work, layout.PAIR_FORCE + k, where_above(flags, zero, force, kept))
        if first <= k < last:
            margin = get_row(work, margin_row(END_AT, k))
            choose(flags, margin_row(BEGIN_AT, k), margin, work)
