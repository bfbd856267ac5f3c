"""The mesh of a pair of gears under any law: chords of helical teeth, the paper's law, and spur
teeth of which more than three pairs touch.

Tables and law are in ``_tables`` and ``_mesh_kernels``.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics import _slots
from gensig.dynamics._equations import motion, own_turn
from gensig.dynamics._layout import (
    AHEAD,
    BASE,
    MIDDLE,
    PART,
    ROLL,
    is_helical,
    span_index,
)
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._slots import keep_begin, near_pairs, roll_ahead
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
from gensig.dynamics.backends.nystroem._layout import (
    BEGIN_AT,
    END_AT,
    MIDDLE_AT,
    AnyLawGroup,
    HelicalNystroemGroup,
    block,
    most_dofs,
)
from gensig.dynamics.backends.nystroem._pair_kernels import choose, pair_integrator


@inlined
def look_ahead(group, step, approach, rate, work):
    """Set how near pairs are that may touch in the step, and what chords are chosen by."""
    margin = spread(work, layout.NEAR if group.one_sided else 2.0 * layout.FAR)
    set_row(work, layout.WITHIN, approach + margin)
    if is_helical(group):
        bent = get_row(group.numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
        set_row(work, layout.LOCAL, approach + (0.5 * step) * rate - bent)


@compiled
def begin_mesh(group, slot, fresh, step, work, wide, near):
    """Read the tables at the begin of the first step of a call; lanes that go on keep chords."""
    n, n_rows = width(work), most_dofs(group)
    for lane in range(n):
        if fresh[lane] > 0.0:
            near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
    q, v = block(rows.Q, n_rows), block(rows.V, n_rows)
    approach, rate = motion(group, q, v, work)
    read_begin(group, slot, fresh, step, approach, rate, work, wide, near)


@inlined
def read_begin(group, slot, fresh, step, approach, rate, work, wide, near):
    """Read the tables at the begin of the first step of a call; lanes that go on keep chords."""
    n = width(work)
    for lane in range(n):
        work[at(layout.FLAGS, lane, n)] = fresh[lane]
        if fresh[lane] > 0.0:
            wide[at(ROLL + slot, lane, n)] = wide[at(BASE, lane, n)]
            mean_force = group.numbers[at(layout.MEAN_FORCE, lane, n)]
            work[at(layout.LAST_TOTAL, lane, n)] = mean_force
    look_ahead(group, step, approach, rate, work)
    set_row(work, AHEAD + slot, spread(work, 0.0))
    gather(group, slot, True, work, wide, near)


@inlined
def law_at_start(
    group, slot, fresh, by_tooth, approach, rate, roll_rate, work, wide, near
):
    """Law at the begin of a step, of which fresh lanes keep margins and forces."""
    n, zero = width(work), spread(work, 0.0)
    for lane in range(n):
        work[at(rows.FRESH, lane, n)] = fresh[lane]
    set_ahead(slot, work, wide)
    for k in range(layout.MOST_PAIRS):  # those of the other lanes wait in other rows
        set_row(work, rows.ANY_SHORT + k, get_row(work, layout.PAIR_FORCE + k))
        set_row(work, layout.PAIR_FORCE + k, zero)
    first, last = near_pairs(slot, n, near)
    keep_near(first, last, n, near)
    law = law_in(group, slot, zero, approach, rate, roll_rate, work, wide, near)
    keep_margins(group, END_AT, first, last, slot, work)
    count_anew(group, work, near)
    flags = get_row(work, rows.FRESH)
    for k in range(layout.MOST_PAIRS):
        force = get_row(work, layout.PAIR_FORCE + k)
        kept = get_row(work, rows.ANY_SHORT + k)
        set_row(work, layout.PAIR_FORCE + k, where_above(flags, zero, force, kept))
        if first <= k < last:
            margin = get_row(work, margin_row(END_AT, k))
            choose(flags, margin_row(BEGIN_AT, k), margin, work)
    return law


@inlined
def write_mesh(group, seen, row, work, wide, near):
    """Write the state of the pairs at the begin of a step."""
    _slots.write_mesh(seen, row, get_row(work, rows.NORMAL), work, near)


@inlined
def read_mesh(group, slot, next_slot, step, by_tooth, work, wide, near):
    """Read the tables at the end of the step; how far the mesh rolls until there, m."""
    n_rows = most_dofs(group)
    q, v, now = block(rows.Q, n_rows), block(rows.V, n_rows), block(rows.NOW, n_rows)
    approach, rate = motion(group, q, v, work)
    look_ahead(group, step, approach, rate, work)
    # the roll at the end of the step, with every force in it
    speed = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
    turning = get_row(work, rows.DRIVE + layout.DRIVE_GAIN) + own_turn(group, now, work)
    turning = speed + own_turn(group, v, work) + (0.5 * step) * turning
    ahead = step * get_row(group.numbers, layout.PINION_RADIUS) * turning
    set_row(work, AHEAD + next_slot, ahead)
    read_slots(group, slot, next_slot, approach, work, wide, near)
    return ahead


@inlined
def set_ahead(slot, work, wide):
    """Set the roll of a slot since the begin of the step, in the precision of the scratch."""
    n = width(work)
    for lane in range(n):
        ahead = wide[at(ROLL + slot, lane, n)] - wide[at(BASE, lane, n)]
        work[at(AHEAD + slot, lane, n)] = ahead


@inlined
def keep_near(first, last, n, near):
    """Keep which pairs come near in the step; no step of this core has parts."""
    span = span_index(PART, n)
    near[span + layout.FIRST_NEAR_PAIR] = first
    near[span + layout.LAST_NEAR_PAIR] = last


@compiled
def read_slots(group, slot, next_slot, approach, work, wide, near):
    """Read the tables where ``AHEAD`` of the next slot says, and keep which pairs come near."""
    n = width(work)
    roll_ahead(next_slot, work, wide)
    set_row(work, layout.FLAGS, spread(work, 1.0))
    rechosen = gather(group, next_slot, True, work, wide, near)
    near[rows.RECHOSEN * n] = rechosen
    if rechosen:
        read_again(group, slot, approach, work, wide, near)
    first, last = near_pairs(slot, n, near)
    first_end, last_end = near_pairs(next_slot, n, near)
    first, last = min(first, first_end), max(last, last_end)
    cover(slot, first, last, work, near)
    cover(next_slot, first, last, work, near)
    set_ahead(slot, work, wide)
    between(slot, next_slot, MIDDLE, first, last, work)
    if is_helical(group):
        chords_between(slot, next_slot, MIDDLE, first, last, work)
    keep_near(first, last, n, near)


@inlined
def law_in_middle(group, turned, approach, rate, roll_rate, ahead, work, wide, near):
    """Law in the middle of the step."""
    law = law_in(group, MIDDLE, turned, approach, rate, roll_rate, work, wide, near)
    first, last = near_pairs(PART, width(work), near)
    keep_margins(group, MIDDLE_AT, first, last, MIDDLE, work)
    return law


@inlined
def law_at_end(group, slot, turned, approach, rate, roll_rate, ahead, work, wide, near):
    """Law at the end of the step."""
    for k in range(layout.MOST_PAIRS):
        set_row(work, layout.PAIR_FORCE + k, spread(work, 0.0))
    law = law_in(group, slot, turned, approach, rate, roll_rate, work, wide, near)
    first, last = near_pairs(PART, width(work), near)
    keep_margins(group, END_AT, first, last, slot, work)
    return law


@compiled
def law_in(group, slot, turned, approach, rate, roll_rate, work, wide, near):
    """Law by the tables of a slot, of the pairs that come near in the step."""
    first, last = near_pairs(PART, width(work), near)
    return mesh_law(
        group,
        first,
        last,
        slot,
        layout.MARGIN,
        turned,
        approach,
        rate,
        roll_rate,
        work,
        wide,
    )


@inlined
def end_mesh(group, slot, law, step, nominal, q_0, ahead, work, near):
    """Correct the end of the step for kinks, and shift what the mesh remembers."""
    n, n_rows = width(work), most_dofs(group)
    q, v, mean = block(rows.Q, n_rows), block(rows.V, n_rows), block(rows.MEAN, n_rows)
    first, last = near_pairs(PART, n, near)
    changed = spread(work, 0.0)
    for k in range(first, last):
        changed = changed + kinked(group, k, work)
    if any_above(changed, spread(work, 0.0)):
        middle_q, middle_v = block(rows.MIDDLE_Q, n_rows), block(rows.MIDDLE_V, n_rows)
        halfway, _ = motion(group, middle_q, middle_v, work)
        correct(group, step, halfway, first, last, mean, v, q, work)
    if is_helical(group) and near[rows.RECHOSEN * n]:
        end_q, end_v = block(rows.END_Q, n_rows), block(rows.END_V, n_rows)
        approach, _ = motion(group, end_q, end_v, work)
        miss_chords(group, slot, approach, first, last, work)
        push_missed(group, step, first, last, mean, v, q, work)
    set_row(work, rows.NORMAL, law.normal)
    if is_helical(group):
        set_row(work, layout.LAST_TOTAL, get_row(work, layout.TOTAL))
    begin_again(group, first, last, work)


@inlined
def keep_mesh(work, wide, near):
    """Keep the slot of the next step's begin where a call begins."""
    keep_begin(work, wide, near)


integrate = pair_integrator(
    turn=own_turn,
    begin_mesh=begin_mesh,
    law_at_start=law_at_start,
    write_mesh=write_mesh,
    read_mesh=read_mesh,
    law_in_middle=law_in_middle,
    law_at_end=law_at_end,
    end_mesh=end_mesh,
    keep_mesh=keep_mesh,
)
integrates(integrate, AnyLawGroup, HelicalNystroemGroup)
