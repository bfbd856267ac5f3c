"""Two-evaluation core: steps in which a pair of helical teeth goes from one chord to another.

A step has one chord, that of its middle; the force at its begin is still that of the chord
before. Chords meet where their forces are equal, s of the step after its begin, -1/2 < s < 1/2.
Their forces differ by f (t - s) around it, t the share of the step. Simpson's rule over this step
and the last one misses f (s^2/2 - s/6) of the mean of the force, and f (s^2/2 - s/6 - s^3/6) of
the mean that is weighted by what is left of the step.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import (
    MIDDLE,
    PART,
    chord_rows,
    pair_rows,
    span_index,
)
from gensig.dynamics._tables import gather
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
from gensig.dynamics._written import either, fold, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._any_law_kinks import (
    count_anew,
    give,
    miss_nothing,
    others_carrying,
)

MOST_APART = 0.75  # of s; beyond it the step has not gone from one chord to the next


@compiled
def read_again(group, slot, approach, work, wide, near):
    """Read the begin of a step by the pairs and chords of its end, and keep what chords change.

    ``approach`` is that at the begin.
    """
    n, span = width(work), span_index(slot, width(work))
    first, last = near[span + layout.FIRST_READ], near[span + layout.LAST_READ]
    for k in range(first, last):
        _keep_chord(slot, k, work)
    gather(group, slot, False, work, wide, near)
    for k in range(layout.MOST_PAIRS):
        if first <= k < last:
            _compare_chords(group.numbers, slot, k, approach, work)
        else:
            set_row(work, pair_rows(PART, k) + rows.MORE_STIFFNESS, spread(work, 0.0))
    # where pairs have other places now, what was read before is that of other pairs
    for lane in range(n):
        newest, before = at(layout.NEWEST, lane, n), at(rows.MARGINS_OF, lane, n)
        if near[newest] != near[before]:
            work[at(layout.FLAGS, lane, n)] = 0.0
    count_anew(group, work, near)


@written
def _keep_chord(slot, k, work):
    """Keep stiffness and gap of a pair before they are read again."""
    pair, kept = pair_rows(slot, k), pair_rows(PART, k)
    for row in (layout.STIFFNESS, layout.GAP):
        set_row(work, kept + row, get_row(work, pair + row))


@written
def _compare_chords(numbers, slot, k, approach, work):
    """Set what the chord that was read adds to the one that was kept."""
    pair, kept = pair_rows(slot, k), pair_rows(PART, k)
    bent = get_row(numbers, layout.SHARED) * get_row(work, layout.LAST_TOTAL)
    local = approach - bent
    stiffness, before = (get_row(work, p + layout.STIFFNESS) for p in (pair, kept))
    force = stiffness * (local - get_row(work, pair + layout.GAP))
    force_before = before * (local - get_row(work, kept + layout.GAP))
    touch = get_row(work, chord_rows(slot, k) + layout.TOUCH)
    set_row(work, kept + rows.MORE_FORCE, force - force_before)
    set_row(work, kept + rows.MORE_STIFFNESS, stiffness - before)
    set_row(work, kept + rows.BITTEN, local - touch)


@written
def miss_chords(group, slot, approach, first, last, work):
    """Set what Simpson's rule misses of the force of every pair that changes its chord.

    ``approach`` is that at the end of the step, whose slot is given.
    """
    zero = spread(work, 0.0)
    miss_nothing(first, last, work)

    def look(k, any_changed):
        changed = _changes(group.numbers, slot, k, approach, work)

        def correct():
            others = others_carrying(k, first, last, work)
            missed = _missed(group.numbers, slot, k, approach, others, work)
            give(group, k, *missed, changed, first, last, work)
            return (any_changed + changed,)

        return either(any_above(changed, zero), correct, (any_changed,))

    (any_changed,) = fold(first, last, look, (zero,))
    set_row(work, rows.ANY_MISSED, any_changed)


@written
def _growth(numbers, slot, k, approach, work):
    """Growth over the step of what the chord adds to the force."""
    kept = pair_rows(PART, k)
    bent = get_row(numbers, layout.SHARED) * get_row(work, layout.TOTAL)
    touch = get_row(work, chord_rows(slot, k) + layout.TOUCH)
    bite = approach - bent - touch
    bitten = bite - get_row(work, kept + rows.BITTEN)
    return get_row(work, kept + rows.MORE_STIFFNESS) * bitten


@written
def _changes(numbers, slot, k, approach, work):
    """1 where a pair goes from one chord to another near the begin of the step, else 0."""
    zero, one = spread(work, 0.0), spread(work, 1.0)
    growth = _growth(numbers, slot, k, approach, work)
    force = get_row(work, pair_rows(PART, k) + rows.MORE_FORCE)
    far = MOST_APART * growth
    is_near = where_above(far * far, force * force, one, zero)
    return is_near * get_row(work, layout.FLAGS)


@written
def _missed(numbers, slot, k, approach, others, work):
    """Missed part of the mean force of a pair, and of the mean weighted by what is left."""
    growth = _growth(numbers, slot, k, approach, work)
    force = get_row(work, pair_rows(PART, k) + rows.MORE_FORCE)
    s = (0.0 - force) / growth
    short = s * (0.5 * s - 1.0 / 6.0)
    early = short - (1.0 / 6.0) * (s * s * s)
    shared = get_row(numbers, layout.SHARED)
    lone = 1.0 + shared * others
    spring = get_row(work, pair_rows(MIDDLE, k) + layout.STIFFNESS)
    carried = growth * (lone / (lone + shared * spring))
    carried = carried * get_row(work, rows.ANY_DAMPED + k)
    return carried * short, carried * early
