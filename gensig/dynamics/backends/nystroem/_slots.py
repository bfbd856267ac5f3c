"""Compiled core: slots of the scratch, instants at which the tables were read."""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import (
    AHEAD,
    BASE,
    EVEN,
    ODD,
    ROLL,
    chord_rows,
    pair_rows,
    span_index,
)
from gensig.dynamics._vector import at, compiled, get_row, inlined, set_row, width


@inlined
def roll_ahead(slot, work, wide):
    """Set the roll of a slot to that at the begin of the step plus ``AHEAD``."""
    n = width(work)
    for lane in range(n):
        roll = wide[at(BASE, lane, n)] + work[at(AHEAD + slot, lane, n)]
        wide[at(ROLL + slot, lane, n)] = roll


@inlined
def near_pairs(slot, n, near):
    """First pair near its mate in a slot, and the number behind the last one."""
    span = span_index(slot, n)
    return near[span + layout.FIRST_NEAR_PAIR], near[span + layout.LAST_NEAR_PAIR]


@compiled
def keep_begin(work, wide, near):
    """Copy the slot of the next step's begin from ``ODD`` to ``EVEN``, where a call begins."""
    n = width(work)
    for i in range(layout.SLOT_ROWS):
        set_row(work, pair_rows(EVEN, 0) + i, get_row(work, pair_rows(ODD, 0) + i))
    for i in range(layout.CHORD_SLOT_ROWS):
        set_row(work, chord_rows(EVEN, 0) + i, get_row(work, chord_rows(ODD, 0) + i))
    for lane in range(n):
        wide[at(ROLL + EVEN, lane, n)] = wide[at(ROLL + ODD, lane, n)]
    for k in range(layout.N_SPAN):
        near[span_index(EVEN, n) + k] = near[span_index(ODD, n) + k]


@inlined
def write_mesh(seen, row, normal, work, near):
    """Write the state of the pairs at an instant."""
    n, first = width(work), row * layout.N_SEEN
    set_row(work, layout.LAW, normal)
    for lane in range(n):
        seen[at(first + layout.SEEN_NEWEST, lane, n)] = near[at(layout.NEWEST, lane, n)]
        seen[at(first + layout.SEEN_FORCE, lane, n)] = work[at(layout.LAW, lane, n)]
        for k in range(layout.MOST_PAIRS):
            force = work[at(layout.PAIR_FORCE + k, lane, n)]
            seen[at(first + layout.SEEN_PAIRS + k, lane, n)] = force
