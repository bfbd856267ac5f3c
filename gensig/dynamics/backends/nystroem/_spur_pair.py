"""The mesh of a spur pair in which three pairs of teeth are followed."""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import P_TURN
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._vector import (
    any_above,
    at,
    get_row,
    inlined,
    set_row,
    spread,
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
from gensig.dynamics.backends.nystroem._pair_kernels import choose, pair_integrator
from gensig.dynamics.backends.nystroem._pairs import (
    first_pairs,
    locate,
    read_begin,
    read_step,
    take_pairs,
)


@written
def turn(group, row, work):
    """Rotation or speed of the pinion beside the nominal one."""
    return get_row(work, row + P_TURN)


@inlined
def begin_mesh(group, slot, fresh, step, work, wide, near):
    """Set what the law reads in every step."""
    n = width(work)
    for lane in range(n):
        work[at(rows.BEND, lane, n)] = group.bend[lane * layout.COLUMNS]
    width_of_turn = 1.0 / get_row(group.numbers, layout.PER_FRICTION_WIDTH)
    set_row(work, rows.FRICTION_WIDTH, width_of_turn)


@inlined
def law_at_start(
    group, slot, fresh, by_tooth, approach, rate, roll_rate, work, wide, near
):
    """Law at the begin of a step, of which fresh lanes keep margins and forces."""
    first_pairs(group, fresh, work, wide)
    for j in range(FOLLOWED):
        read_begin(group, by_tooth, j, work, wide)
    zero = spread(work, 0.0)
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
    flags = get_row(work, rows.FRESH)
    for j in range(FOLLOWED):
        margin = get_row(work, rows.MARGIN + rows.END_AT * FOLLOWED + j)
        choose(flags, rows.MARGIN + j, margin, work)
    for j in range(FOLLOWED):
        force = get_row(work, rows.PAIR_FORCE + j)
        force = where_above(flags, zero, force, kept[j])
        set_row(work, rows.PAIR_FORCE + j, force)
    return law


@inlined
def write_mesh(group, seen, row, work, wide, near):
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


@inlined
def read_mesh(group, slot, next_slot, step, by_tooth, work, wide, near):
    """Read the tables at the end of the step; how far the mesh rolls until there, m."""
    if locate(group, work, wide):
        take_pairs(group, by_tooth, work, wide)
    # the roll at the end of the step, with every force in it
    v, now = block(rows.V, MOST_DOFS), block(rows.NOW, MOST_DOFS)
    speed = get_row(work, rows.DRIVE + layout.DRIVE_SPEED)
    turning = get_row(work, rows.DRIVE + layout.DRIVE_GAIN)
    turning = turning + get_row(work, now + P_TURN)
    turning = speed + get_row(work, v + P_TURN) + (0.5 * step) * turning
    ahead = step * get_row(group.numbers, layout.PINION_RADIUS) * turning
    span = ahead - get_row(work, rows.BEHIND)
    per_span = 1.0 / span
    for j in range(FOLLOWED):
        read_step(group, by_tooth, j, ahead, span, per_span, work, wide)
    return ahead


@inlined
def law_in_middle(group, turned, approach, rate, roll_rate, ahead, work, wide, near):
    """Law in the middle of the step."""
    off = turned - 0.5 * (ahead + get_row(work, rows.BEHIND))
    return mesh_law(
        group,
        rows.MIDDLE,
        rows.MIDDLE_AT,
        off,
        turned,
        approach,
        rate,
        roll_rate,
        work,
        wide,
    )


@inlined
def law_at_end(group, slot, turned, approach, rate, roll_rate, ahead, work, wide, near):
    """Law at the end of the step."""
    return mesh_law(
        group,
        rows.NODES,
        rows.END_AT,
        turned - ahead,
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
    q, v = block(rows.Q, MOST_DOFS), block(rows.V, MOST_DOFS)
    changed = kinked(0, work), kinked(1, work), kinked(2, work)
    if any_above(changed[0] + changed[1] + changed[2], spread(work, 0.0)):
        correct(group, step, changed, block(rows.MEAN, MOST_DOFS), v, q, work)
    set_row(work, rows.NORMAL, law.normal)
    radius = get_row(group.numbers, layout.PINION_RADIUS)
    turned = radius * (nominal + (get_row(work, q + P_TURN) - q_0))
    set_row(work, rows.BEHIND, ahead - turned)
    for j in range(FOLLOWED):
        margin = get_row(work, rows.MARGIN + rows.END_AT * FOLLOWED + j)
        set_row(work, rows.MARGIN + j, margin)


@inlined
def keep_mesh(work, wide, near):
    """Do nothing: the mesh has no slots."""


integrate = pair_integrator(
    turn=turn,
    begin_mesh=begin_mesh,
    law_at_start=law_at_start,
    write_mesh=write_mesh,
    read_mesh=read_mesh,
    law_in_middle=law_in_middle,
    law_at_end=law_at_end,
    end_mesh=end_mesh,
    keep_mesh=keep_mesh,
)
integrates(integrate, NystroemGroup)
