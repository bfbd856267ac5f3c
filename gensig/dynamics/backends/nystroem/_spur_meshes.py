"""Spur meshes of the one-sided law, in each of which three pairs of teeth are followed."""

from __future__ import annotations

from typing import final

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import AHEAD
from gensig.dynamics._vector import (
    any_above,
    at,
    compiled,
    get_row,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics._written import call, loop, when
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._group import (
    mesh_of,
    mesh_rows,
    wide_rows,
)
from gensig.dynamics.backends.nystroem._kernels import Law
from gensig.dynamics.backends.nystroem._kinks import kinked, miss, missed_law
from gensig.dynamics.backends.nystroem._law import mesh_law
from gensig.dynamics.backends.nystroem._layout import FOLLOWED
from gensig.dynamics.backends.nystroem._meshes import (
    choose,
    correct_by,
    mean_speed,
    motion,
    push,
    rolled,
    set_begun,
    turning_speed,
)
from gensig.dynamics.backends.nystroem._pairs import (
    first_pairs,
    locate,
    read_begin,
    read_step,
    take_pairs,
)


def _law_at(group, m, nodes, instant, off, turned, since, q, v, machine, work, wide):
    """Law of a mesh at a state, ``off`` m after its nodes and ``turned`` m after the begin."""
    n = width(work)
    mesh = mesh_of(group, m, n)
    approach, rate = motion(group, m, q, v, machine)
    speed = turning_speed(group, m, v, since, machine)
    roll_rate = get_row(mesh.numbers, layout.PINION_RADIUS) * speed
    return mesh_law(
        mesh,
        nodes,
        instant,
        off,
        turned,
        approach,
        rate,
        roll_rate,
        mesh_rows(work, m, n),
        wide_rows(wide, m, n),
    )


@compiled
def _write(group, m, seen, row, work, wide):
    """Write the state of the pairs of a mesh at the begin of a step, the newest pair first."""
    n, first = width(work), row * layout.N_SEEN
    mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
    own_wide = wide_rows(wide, m, n)
    for lane in range(n):
        pitch = mesh.exact[at(layout.PITCH, lane, n)]
        newest = int((own_wide[at(layout.BASE, lane, n)] / pitch) // 1.0)
        newest = newest - mesh.indices[at(layout.FIRST_PITCH, lane, n)]
        seen[at(first + layout.SEEN_NEWEST, lane, n)] = newest
        normal = own[at(rows.NORMAL, lane, n)]
        seen[at(first + layout.SEEN_FORCE, lane, n)] = normal
        for k in range(layout.MOST_PAIRS):
            seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = 0.0
        for j in range(FOLLOWED):
            k = newest - int(own_wide[at(rows.NUMBER + j, lane, n)])
            if 0 <= k < layout.MOST_PAIRS:
                force = own[at(rows.PAIR_FORCE + j, lane, n)]
                seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = force


def _correct(group, m, step, changed, machine, work):
    """Add to the end of the step what the kinks of a mesh change, in the lanes with any.

    ``changed`` holds for every pair 1 where it has a kink.
    """
    mesh, own = mesh_of(group, m, width(work)), mesh_rows(work, m, width(work))
    miss(mesh.numbers, changed, own)
    any_changed = changed[0] + changed[1] + changed[2]
    short, early = missed_law(mesh, rows.SHORT, own), missed_law(mesh, rows.EARLY, own)
    correct_by(group, m, short, early, step, any_changed, machine)


@final
class SpurMeshes(Law):
    """Spur meshes of the one-sided law, in each of which three pairs of teeth are followed."""

    def begin(self, group, m, slot, fresh, step, machine, work, wide, near):
        """Nothing: the nodes of the last call are kept."""

    def start(self, group, m, slot, fresh, machine, work, wide, near):
        """Push by a mesh at the begin of a step, and set what it remembers where it is fresh."""
        n, zero = width(work), spread(work, 0.0)
        mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
        own_wide = wide_rows(wide, m, n)
        call(first_pairs, mesh, fresh, own, own_wide)
        loop(FOLLOWED, lambda j: read_begin(mesh, group.by_tooth, j, own, own_wide))
        kept = [get_row(own, rows.PAIR_FORCE + j) for j in range(FOLLOWED)]
        off = 0.0 - get_row(own, rows.BEHIND)
        law = _law_at(
            group,
            m,
            rows.NODES,
            rows.END_AT,
            off,
            zero,
            zero,
            rows.Q,
            rows.V,
            machine,
            work,
            wide,
        )
        push(group, m, law, machine)
        flags = get_row(own, rows.FRESH)
        choose(flags, rows.NORMAL, law.normal, own)
        for j in range(FOLLOWED):
            margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
            choose(flags, rows.MARGIN + j, margin, own)
            force = get_row(own, rows.PAIR_FORCE + j)
            force = where_above(flags, zero, force, kept[j])
            set_row(own, rows.PAIR_FORCE + j, force)

    def write(self, group, m, seen, row, work, wide, near):
        """Write the state of the pairs of a mesh at the begin of a step, the newest pair first."""
        call(_write, group, m, seen, row, work, wide)

    def read(self, group, m, slot, next_slot, step, machine, work, wide, near):
        """Read the tables of a mesh at the end of the step and set its nodes."""
        n = width(work)
        mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
        own_wide = wide_rows(wide, m, n)
        has_left = locate(mesh, own, own_wide)
        when(has_left, lambda: call(take_pairs, mesh, group.by_tooth, own, own_wide))
        # the roll at the end of the step, with every force in it
        ahead = step * get_row(mesh.numbers, layout.PINION_RADIUS)
        ahead = ahead * mean_speed(group, m, step, machine)
        span = ahead - get_row(own, rows.BEHIND)
        per_span = 1.0 / span

        def read(j):
            read_step(mesh, group.by_tooth, j, ahead, span, per_span, own, own_wide)

        loop(FOLLOWED, read)
        set_row(own, AHEAD, ahead)
        set_begun(group, m, machine, own)

    def push_middle(self, group, m, step, machine, work, wide, near):
        """Evaluate the law of a mesh in the middle of the step and add its forces."""
        own, since = mesh_rows(work, m, width(work)), 0.5 * step
        q, v = rows.MIDDLE_Q, rows.MIDDLE_V
        turned = rolled(group, m, since, q, machine, own)
        off = get_row(own, AHEAD) + get_row(own, rows.BEHIND)
        law = _law_at(
            group,
            m,
            rows.MIDDLE,
            rows.MIDDLE_AT,
            turned - 0.5 * off,
            turned,
            spread(work, since),
            q,
            v,
            machine,
            work,
            wide,
        )
        push(group, m, law, machine)

    def push_end(self, group, m, slot, step, machine, work, wide, near):
        """Evaluate the law of a mesh at the end of the step and add its forces."""
        own = mesh_rows(work, m, width(work))
        q, v = rows.END_Q, rows.END_V
        turned = rolled(group, m, step, q, machine, own)
        law = _law_at(
            group,
            m,
            rows.NODES,
            rows.END_AT,
            turned - get_row(own, AHEAD),
            turned,
            spread(work, step),
            q,
            v,
            machine,
            work,
            wide,
        )
        push(group, m, law, machine)
        set_row(own, rows.NORMAL, law.normal)

    def end(self, group, m, slot, step, machine, work, near):
        """Correct the end of the step for the kinks of a mesh, and shift what it remembers."""
        own, zero = mesh_rows(work, m, width(work)), spread(work, 0.0)
        changed = tuple(kinked(j, own) for j in range(FOLLOWED))
        is_kinked = any_above(changed[0] + changed[1] + changed[2], zero)
        when(is_kinked, lambda: _correct(group, m, step, changed, machine, work))
        turned = rolled(group, m, step, rows.Q, machine, own)
        set_row(own, rows.BEHIND, get_row(own, AHEAD) - turned)
        for j in range(FOLLOWED):
            margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
            set_row(own, rows.MARGIN + j, margin)

    def keep(self, m, work, wide, near):
        """Nothing: a mesh has no slots."""
