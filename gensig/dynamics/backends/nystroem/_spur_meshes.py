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


def _law_at(s, nodes, instant, off, turned, since, q, v):
    """Law of a mesh at a state, ``off`` m after its nodes and ``turned`` m after the begin."""
    approach, rate = motion(s.group, s.m, q, v, s.machine)
    speed = turning_speed(s.group, s.m, v, since, s.machine)
    roll_rate = get_row(s.mesh.numbers, layout.PINION_RADIUS) * speed
    state = approach, rate, roll_rate
    return mesh_law(s.mesh, nodes, instant, off, turned, *state, s.own, s.wide)


@compiled
def _write(mesh, own, own_wide, seen, row):
    """Write the state of the pairs of a mesh at the begin of a step, the newest pair first."""
    n, first = width(own), row * layout.N_SEEN
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


def _correct(s, step, changed):
    """Add to the end of the step what the kinks of a mesh change, in the lanes with any.

    ``changed`` holds for every pair 1 where it has a kink.
    """
    miss(s.mesh.numbers, changed, s.own)
    any_changed = changed[0] + changed[1] + changed[2]
    short, early = (
        missed_law(s.mesh, name, s.own) for name in (rows.SHORT, rows.EARLY)
    )
    correct_by(s.group, s.m, short, early, step, any_changed, s.machine)


@final
class SpurMeshes(Law):
    """Spur meshes of the one-sided law, in each of which three pairs of teeth are followed."""

    def begin(self, s, slot, fresh, step):
        """Nothing: the nodes of the last call are kept."""

    def start(self, s, slot, fresh):
        """Push by a mesh at the begin of a step, and set what it remembers where it is fresh."""
        mesh, own, zero = s.mesh, s.own, spread(s.own, 0.0)
        call(first_pairs, mesh, fresh, own, s.wide)
        loop(FOLLOWED, lambda j: read_begin(mesh, s.group.by_tooth, j, own, s.wide))
        kept = [get_row(own, rows.PAIR_FORCE + j) for j in range(FOLLOWED)]
        off, state = 0.0 - get_row(own, rows.BEHIND), (rows.Q, rows.V)
        law = _law_at(s, rows.NODES, rows.END_AT, off, zero, zero, *state)
        push(s.group, s.m, law, s.machine)
        flags = get_row(own, rows.FRESH)
        choose(flags, rows.NORMAL, law.normal, own)
        for j in range(FOLLOWED):
            margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
            choose(flags, rows.MARGIN + j, margin, own)
            force = get_row(own, rows.PAIR_FORCE + j)
            force = where_above(flags, zero, force, kept[j])
            set_row(own, rows.PAIR_FORCE + j, force)

    def write(self, s, seen, row):
        """Write the state of the pairs of a mesh at the begin of a step, the newest pair first."""
        call(_write, s.mesh, s.own, s.wide, seen, row)

    def read(self, s, slot, next_slot, step):
        """Read the tables of a mesh at the end of the step and set its nodes."""
        mesh, own, by_tooth = s.mesh, s.own, s.group.by_tooth
        has_left = locate(mesh, own, s.wide)
        when(has_left, lambda: call(take_pairs, mesh, by_tooth, own, s.wide))
        # the roll at the end of the step, with every force in it
        ahead = step * get_row(mesh.numbers, layout.PINION_RADIUS)
        ahead = ahead * mean_speed(s.group, s.m, step, s.machine)
        span = ahead - get_row(own, rows.BEHIND)
        per_span = 1.0 / span

        def read(j):
            read_step(mesh, by_tooth, j, ahead, span, per_span, own, s.wide)

        loop(FOLLOWED, read)
        set_row(own, AHEAD, ahead)
        set_begun(s.group, s.m, s.machine, own)

    def push_middle(self, s, step):
        """Evaluate the law of a mesh in the middle of the step and add its forces."""
        since, (q, v) = 0.5 * step, (rows.MIDDLE_Q, rows.MIDDLE_V)
        turned = rolled(s.group, s.m, since, q, s.machine, s.own)
        off = get_row(s.own, AHEAD) + get_row(s.own, rows.BEHIND)
        instant = rows.MIDDLE, rows.MIDDLE_AT, turned - 0.5 * off, turned
        law = _law_at(s, *instant, spread(s.own, since), q, v)
        push(s.group, s.m, law, s.machine)

    def push_end(self, s, slot, step):
        """Evaluate the law of a mesh at the end of the step and add its forces."""
        q, v = rows.END_Q, rows.END_V
        turned = rolled(s.group, s.m, step, q, s.machine, s.own)
        off = turned - get_row(s.own, AHEAD)
        instant = rows.NODES, rows.END_AT, off, turned
        law = _law_at(s, *instant, spread(s.own, step), q, v)
        push(s.group, s.m, law, s.machine)
        set_row(s.own, rows.NORMAL, law.normal)

    def end(self, s, slot, step):
        """Correct the end of the step for the kinks of a mesh, and shift what it remembers."""
        own, zero = s.own, spread(s.own, 0.0)
        changed = tuple(kinked(j, own) for j in range(FOLLOWED))
        is_kinked = any_above(changed[0] + changed[1] + changed[2], zero)
        when(is_kinked, lambda: _correct(s, step, changed))
        turned = rolled(s.group, s.m, step, rows.Q, s.machine, own)
        set_row(own, rows.BEHIND, get_row(own, AHEAD) - turned)
        for j in range(FOLLOWED):
            margin = get_row(own, rows.MARGIN + rows.END_AT * FOLLOWED + j)
            set_row(own, rows.MARGIN + j, margin)

    def keep(self, s):
        """Nothing: a mesh has no slots."""
