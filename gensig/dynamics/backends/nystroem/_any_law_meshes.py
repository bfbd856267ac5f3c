"""Meshes of any law: chords of helical teeth, up to eight pairs in contact, the paper's law.

The tables are read where a step will end, by its accelerations. The middle of a step takes the mean
of the tables at its begin and end; a slot that the roll misses by some 1e-10 m is moved by the
slopes. Spur teeth among helical ones have one chord.
"""

from __future__ import annotations

from typing import final

from gensig.dynamics import _layout as layout
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
from gensig.dynamics._written import call, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem import _slots
from gensig.dynamics.backends.nystroem._any_law_kinks import (
    any_kinked,
    begin_again,
    count_anew,
    keep_margins,
    margin_row,
    miss,
    missed_law,
)
from gensig.dynamics.backends.nystroem._chord_kinks import miss_chords, read_again
from gensig.dynamics.backends.nystroem._kernels import Law
from gensig.dynamics.backends.nystroem._layout import END_AT, MIDDLE_AT
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
from gensig.dynamics.backends.nystroem._slots import keep_begin, near_pairs, roll_ahead


@inlined
def _look_ahead(mesh, step, approach, rate, work):
    """Set how near pairs are that may touch in the step, and what chords are chosen by."""
    margin = spread(work, layout.NEAR if mesh.one_sided else 2.0 * layout.FAR)
    set_row(work, layout.WITHIN, approach + margin)
    if is_helical(mesh):
        bent = get_row(mesh.numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
        set_row(work, layout.LOCAL, approach + (0.5 * step) * rate - bent)


@compiled
def _before_reading(mesh, slot, fresh, step, approach, rate, work, wide, near):
    """Set where the tables are read at the begin of a call; lanes that go on keep chords."""
    n = width(work)
    for lane in range(n):
        work[at(layout.FLAGS, lane, n)] = fresh[lane]
        if fresh[lane] > 0.0:
            near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
            wide[at(ROLL + slot, lane, n)] = wide[at(BASE, lane, n)]
            mean_force = mesh.numbers[at(layout.MEAN_FORCE, lane, n)]
            work[at(layout.LAST_TOTAL, lane, n)] = mean_force
    _look_ahead(mesh, step, approach, rate, work)
    set_row(work, AHEAD + slot, spread(work, 0.0))


@inlined
def _set_ahead(slot, work, wide):
    """Set the roll of a slot since the begin of the step, in the precision of the scratch."""
    n = width(work)
    for lane in range(n):
        ahead = wide[at(ROLL + slot, lane, n)] - wide[at(BASE, lane, n)]
        work[at(AHEAD + slot, lane, n)] = ahead


@inlined
def _keep_near(first, last, n, near):
    """Keep which pairs come near in the step; no step of this core has parts."""
    span = span_index(PART, n)
    near[span + layout.FIRST_NEAR_PAIR] = first
    near[span + layout.LAST_NEAR_PAIR] = last


@compiled
def _read_slots(mesh, slot, next_slot, step, approach, rate, work, wide, near):
    """Read the tables where ``AHEAD`` of the next slot says, and keep which pairs come near."""
    n = width(work)
    _look_ahead(mesh, step, approach, rate, work)
    roll_ahead(next_slot, work, wide)
    set_row(work, layout.FLAGS, spread(work, 1.0))
    rechosen = gather(mesh, next_slot, True, work, wide, near)
    near[rows.RECHOSEN * n] = rechosen
    if rechosen:
        read_again(mesh, slot, approach, work, wide, near)
    first, last = near_pairs(slot, n, near)
    first_end, last_end = near_pairs(next_slot, n, near)
    first, last = min(first, first_end), max(last, last_end)
    cover(slot, first, last, work, near)
    cover(next_slot, first, last, work, near)
    _set_ahead(slot, work, wide)
    between(slot, next_slot, MIDDLE, first, last, work)
    if is_helical(mesh):
        chords_between(slot, next_slot, MIDDLE, first, last, work)
    _keep_near(first, last, n, near)


@compiled
def _put_aside(slot, fresh, own, own_wide, counts):
    """Keep what the lanes that are not fresh remember of a mesh, in other rows."""
    n = width(own)
    for lane in range(n):
        own[at(rows.FRESH, lane, n)] = fresh[lane]
    _set_ahead(slot, own, own_wide)
    set_row(own, rows.ANY_EARLY, get_row(own, rows.NORMAL))
    for k in range(layout.MOST_PAIRS):
        set_row(own, rows.ANY_SHORT + k, get_row(own, layout.PAIR_FORCE + k))
    first, last = near_pairs(slot, n, counts)
    _keep_near(first, last, n, counts)


@compiled
def _take_back(mesh, slot, own, counts):
    """Set what a mesh remembers in the lanes that are fresh, and take back that of the others."""
    first, last = near_pairs(slot, width(own), counts)
    count_anew(mesh, own, counts)
    _keep_others(rows.NORMAL, rows.ANY_EARLY, own)
    for k in range(layout.MOST_PAIRS):
        _keep_others(layout.PAIR_FORCE + k, rows.ANY_SHORT + k, own)
        if first <= k < last:
            margin = get_row(own, margin_row(END_AT, k))
            choose(get_row(own, rows.FRESH), margin_row(rows.BEGIN_AT, k), margin, own)


@compiled
def _write_mesh(own, counts, seen, row):
    """Write the state of the pairs of a mesh at the begin of a step."""
    _slots.write_mesh(seen, row, get_row(own, rows.NORMAL), own, counts)


@written
def _keep_others(row, kept, own):
    """Take a row back from where it was kept in the lanes that are not fresh."""
    flags, zero = get_row(own, rows.FRESH), spread(own, 0.0)
    set_row(own, row, where_above(flags, zero, get_row(own, row), get_row(own, kept)))


@compiled
def _push_mesh(
    group, m, mesh, machine, own, own_wide, counts, slot, instant, since, q, v
):
    """Evaluate the law of a mesh ``since`` s after the begin of the step and add its forces.

    The state is in the blocks ``q`` and ``v``. Forces and margins at the instant are kept.
    """
    first, last = near_pairs(PART, width(own), counts)
    for k in range(layout.MOST_PAIRS):
        set_row(own, layout.PAIR_FORCE + k, spread(own, 0.0))
    approach, rate = motion(group, m, q, v, machine)
    speed = turning_speed(group, m, v, spread(own, since), machine)
    law = mesh_law(
        mesh,
        first,
        last,
        slot,
        rolled(group, m, since, q, machine, own),
        approach,
        rate,
        get_row(mesh.numbers, layout.PINION_RADIUS) * speed,
        own,
        own_wide,
    )
    if instant == MIDDLE_AT:
        keep_margins(mesh, MIDDLE_AT, first, last, slot, own)
    else:
        keep_margins(mesh, END_AT, first, last, slot, own)
    push(group, m, law, machine)
    set_row(own, rows.NORMAL, law.normal)


@compiled
def _end_mesh(group, m, mesh, machine, own, own_wide, counts, slot, step):
    """Correct the end of the step for the kinks of a mesh, and shift what it remembers."""
    n = width(own)
    first, last = near_pairs(PART, n, counts)
    if any_above(any_kinked(mesh, first, last, own), spread(own, 0.0)):
        halfway, _ = motion(group, m, rows.MIDDLE_Q, rows.MIDDLE_V, machine)
        miss(mesh, halfway, first, last, own)
        _correct(group, mesh, m, step, first, last, machine, own)
    if is_helical(group) and counts[rows.RECHOSEN * n]:
        approach, _ = motion(group, m, rows.END_Q, rows.END_V, machine)
        miss_chords(mesh, slot, approach, first, last, own)
        _correct(group, mesh, m, step, first, last, machine, own)
    if is_helical(group):
        set_row(own, layout.LAST_TOTAL, get_row(own, layout.TOTAL))
    begin_again(mesh, first, last, own)


@compiled
def _correct(group, mesh, m, step, first, last, machine, own):
    """Add to the end of the step what a mesh misses, in the lanes that are marked."""
    changed = get_row(own, rows.ANY_MISSED)
    short = missed_law(mesh, rows.ANY_SHORT, first, last, own)
    early = missed_law(mesh, rows.ANY_EARLY, first, last, own)
    correct_by(group, m, short, early, step, changed, machine)


@final
class AnyLawMeshes(Law):
    """Meshes with chords, with up to eight pairs of teeth in contact, or of the paper's law."""

    def begin(self, s, slot, fresh, step):
        """Read the tables of a mesh at the begin of the first step of a call."""
        state = motion(s.group, s.m, rows.Q, rows.V, s.machine)
        own = s.own, s.wide, s.near
        call(_before_reading, s.mesh, slot, fresh, step, *state, *own)
        call(gather, s.mesh, slot, True, *own)

    def start(self, s, slot, fresh):
        """Push by a mesh at the begin of a step, and set what it remembers where it is fresh."""
        call(_put_aside, slot, fresh, s.own, s.wide, s.near)
        set_begun(s.group, s.m, s.machine, s.own)
        s.call(_push_mesh, slot, END_AT, 0.0, rows.Q, rows.V)
        call(_take_back, s.mesh, slot, s.own, s.near)

    def write(self, s, seen, row):
        """Write the state of the pairs of a mesh at the begin of a step."""
        call(_write_mesh, s.own, s.near, seen, row)

    def read(self, s, slot, next_slot, step):
        """Read the tables of a mesh at the end of the step, and set those in its middle."""
        state = motion(s.group, s.m, rows.Q, rows.V, s.machine)
        ahead = step * get_row(s.mesh.numbers, layout.PINION_RADIUS)
        ahead = ahead * mean_speed(s.group, s.m, step, s.machine)
        set_row(s.own, AHEAD + next_slot, ahead)
        own = s.own, s.wide, s.near
        call(_read_slots, s.mesh, slot, next_slot, step, *state, *own)
        set_begun(s.group, s.m, s.machine, s.own)

    def push_middle(self, s, step):
        """Evaluate the law of a mesh in the middle of the step and add its forces."""
        state = rows.MIDDLE_Q, rows.MIDDLE_V
        s.call(_push_mesh, MIDDLE, MIDDLE_AT, 0.5 * step, *state)

    def push_end(self, s, slot, step):
        """Evaluate the law of a mesh at the end of the step and add its forces."""
        s.call(_push_mesh, slot, END_AT, step, rows.END_Q, rows.END_V)

    def end(self, s, slot, step):
        """Correct the end of the step for the kinks of a mesh, and shift what it remembers."""
        s.call(_end_mesh, slot, step)

    def keep(self, s):
        """Keep the slot of the next step's begin where a call begins."""
        call(keep_begin, s.own, s.wide, s.near)
