"""Spur meshes of a line, in each of which three pairs of teeth are followed.

Law, tables and kinks are those of the core for one pair.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._vector import (
    any_above,
    get_row,
    inlined,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem import _line_layout as lines
from gensig.dynamics.backends.nystroem import _spur_pair
from gensig.dynamics.backends.nystroem._kinks import kinked
from gensig.dynamics.backends.nystroem._law import mesh_law
from gensig.dynamics.backends.nystroem._layout import FOLLOWED
from gensig.dynamics.backends.nystroem._line_kernels import line_integrator
from gensig.dynamics.backends.nystroem._line_layout import (
    LineGroup,
    mesh_of,
    mesh_rows,
    of,
    wide_rows,
)
from gensig.dynamics.backends.nystroem._line_meshes import (
    correct,
    law_at,
    motion,
    push,
    ratio,
    rolled,
    touched,
    turning_speed,
)
from gensig.dynamics.backends.nystroem._pair_kernels import choose
from gensig.dynamics.backends.nystroem._pairs import (
    first_pairs,
    locate,
    read_begin,
    read_step,
    take_pairs,
)


@inlined
def begin_mesh(group, m, slot, fresh, step, machine, work, wide, near):
    """Do nothing: the nodes of the last call are kept."""


@inlined
def start_mesh(group, m, slot, fresh, by_tooth, machine, work, wide, near):
    """Push by a mesh at the begin of a step, and set what it remembers where it is fresh."""
    n, zero = width(work), spread(work, 0.0)
    mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
    own_wide = wide_rows(wide, m, n)
    first_pairs(mesh, fresh, own, own_wide)
    for j in range(FOLLOWED):
        read_begin(mesh, by_tooth, j, own, own_wide)
    approach, rate = motion(group, m, rows.Q, rows.V, machine)
    speed = turning_speed(group, m, rows.V, zero, machine)
    kept = (
        get_row(own, rows.PAIR_FORCE),
        get_row(own, rows.PAIR_FORCE + 1),
        get_row(own, rows.PAIR_FORCE + 2),
    )
    law = mesh_law(
        mesh,
        rows.NODES,
        rows.END_AT,
        0.0 - get_row(own, rows.BEHIND),
        zero,
        approach,
        rate,
        get_row(mesh.numbers, layout.PINION_RADIUS) * speed,
        own,
        own_wide,
    )
    push(group, m, law, machine)
    flags = get_row(own, rows.FRESH)
    choose(flags, rows.NORMAL, law.normal, own)
    for j in range(FOLLOWED):
        margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
        choose(flags, rows.MARGIN + j, margin, own)
    for j in range(FOLLOWED):
        force = get_row(own, rows.PAIR_FORCE + j)
        force = where_above(flags, zero, force, kept[j])
        set_row(own, rows.PAIR_FORCE + j, force)


@inlined
def write_mesh(group, m, seen, row, work, wide, near):
    """Write the state of the pairs of a mesh at the begin of a step."""
    n = width(work)
    own, own_wide = mesh_rows(work, m, n), wide_rows(wide, m, n)
    _spur_pair.write_mesh(mesh_of(group, m, n), seen, row, own, own_wide, near)


@inlined
def read_mesh(group, m, slot, next_slot, step, by_tooth, machine, work, wide, near):
    """Read the tables of a mesh at the end of the step and set its nodes."""
    n = width(work)
    mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
    own_wide = wide_rows(wide, m, n)
    zero = spread(work, 0.0)
    if locate(mesh, own, own_wide):
        take_pairs(mesh, by_tooth, own, own_wide)
    # the roll at the end of the step, with every force in it
    now, v = rows.NOW, rows.V
    d = touched(group, m, lines.A_TURN)
    gain = ratio(group, m, machine) * get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    gain = gain + get_row(machine, of(now, d))
    speed = turning_speed(group, m, v, zero, machine) + (0.5 * step) * gain
    radius = get_row(mesh.numbers, layout.PINION_RADIUS)
    ahead, behind = step * radius * speed, get_row(own, rows.BEHIND)
    span = ahead - behind
    per_span = 1.0 / span
    for j in range(FOLLOWED):
        read_step(mesh, by_tooth, j, ahead, span, per_span, own, own_wide)
    set_row(own, lines.AHEAD, ahead)
    set_row(own, lines.BEGUN, get_row(machine, of(rows.Q, d)))


@inlined
def push_middle(group, m, step, machine, work, wide, near):
    """Evaluate the law of a mesh in the middle of the step and add its forces."""
    n = width(work)
    q, v = rows.MIDDLE_Q, rows.MIDDLE_V
    own = mesh_rows(work, m, n)
    turned = rolled(group, m, 0.5 * step, q, machine, own)
    ahead = get_row(own, lines.AHEAD)
    off = turned - 0.5 * (ahead + get_row(own, rows.BEHIND))
    since = spread(work, 0.5 * step)
    law = law_at(
        group,
        m,
        rows.MIDDLE,
        rows.MIDDLE_AT,
        off,
        turned,
        since,
        q,
        v,
        machine,
        work,
        wide,
    )
    push(group, m, law, machine)


@inlined
def push_end(group, m, slot, step, machine, work, wide, near):
    """Evaluate the law of a mesh at the end of the step and add its forces."""
    n = width(work)
    q, v = rows.END_Q, rows.END_V
    own = mesh_rows(work, m, n)
    turned = rolled(group, m, step, q, machine, own)
    off = turned - get_row(own, lines.AHEAD)
    since = spread(work, step)
    law = law_at(
        group, m, rows.NODES, rows.END_AT, off, turned, since, q, v, machine, work, wide
    )
    push(group, m, law, machine)
    set_row(own, rows.NORMAL, law.normal)


@inlined
def end_mesh(group, m, slot, step, machine, work, near):
    """Correct the end of the step for the kinks of a mesh, and shift what it remembers."""
    n = width(work)
    mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
    changed = kinked(0, own), kinked(1, own), kinked(2, own)
    if any_above(changed[0] + changed[1] + changed[2], spread(work, 0.0)):
        correct(group, mesh, m, step, changed, machine, own)
    turned = rolled(group, m, step, rows.Q, machine, own)
    set_row(own, rows.BEHIND, get_row(own, lines.AHEAD) - turned)
    for j in range(FOLLOWED):
        margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
        set_row(own, rows.MARGIN + j, margin)


@inlined
def keep_mesh(m, work, wide, near):
    """Do nothing: a mesh has no slots."""


integrate = line_integrator(
    begin_mesh=begin_mesh,
    start_mesh=start_mesh,
    write_mesh=write_mesh,
    read_mesh=read_mesh,
    push_middle=push_middle,
    push_end=push_end,
    end_mesh=end_mesh,
    keep_mesh=keep_mesh,
)
integrates(integrate, LineGroup)
