"""Two-evaluation core for any mesh law: steps in which a pair takes up or releases its load.

The margin of a pair under the one-sided law is the force that it has or would have; under the
paper's law it is the share of the pair in contact, whose part between 0 and 1 counts. What
Simpson's rule misses of either is that of ``_kinks``.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import MIDDLE, MOST_PAIRS, followed, pair_rows
from gensig.dynamics._mesh_kernels import rubbed
from gensig.dynamics._vector import (
    any_above,
    at,
    chosen,
    compiled,
    get_row,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics._written import choose, either, fold, loop, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._kinks import (
    LEAST_DAMPED,
    crosses_zero,
    missed_moments,
)
from gensig.dynamics.backends.nystroem._layout import (
    ANY_DAMPED,
    ANY_EARLY,
    ANY_MARGIN,
    ANY_SHORT,
    BEGIN_AT,
    END_AT,
    MIDDLE_AT,
)
from gensig.dynamics.backends.nystroem._pairs import OUT_OF_MESH


@written
def margin_row(instant, k):
    """Row of the margin of a pair at an instant of the step."""
    return ANY_MARGIN + instant * MOST_PAIRS + k


@written
def _margin(instant, k, work):
    return get_row(work, margin_row(instant, k))


@written
def _spring(slot, k, work):
    """Own stiffness of a pair at the instant of a slot."""
    return get_row(work, pair_rows(slot, k) + layout.STIFFNESS)


@written
def keep_margins(group, instant, first, last, slot, work):
    """Turn the margins that the law has left into those of an instant.

    The one-sided law leaves penetrations into what the other pairs deflect.
    """

    def add(k, carrying):
        return (carrying + _carrying(slot, k, work),)

    def one_sided():
        (carrying,) = fold(first, last, add, (spread(work, 0.0),))

        def keep(k):
            _keep_margin(group.numbers, instant, k, slot, carrying, work)
            return ()

        return fold(first, last, keep, ())

    def papers():
        def keep(k):
            margin = get_row(work, layout.MARGIN + k)
            set_row(work, margin_row(instant, k), margin)
            return ()

        return fold(first, last, keep, ())

    choose(group.one_sided, one_sided, papers)


@written
def _carrying(slot, k, work):
    """Stiffness of a pair, 0 where it does not touch."""
    zero, deep = spread(work, 0.0), get_row(work, layout.MARGIN + k)
    return where_above(deep, zero, _spring(slot, k, work), zero)


@written
def _keep_margin(numbers, instant, k, slot, carrying, work):
    zero, shared = spread(work, 0.0), get_row(numbers, layout.SHARED)
    deep, spring = get_row(work, layout.MARGIN + k), _spring(slot, k, work)
    lone = 1.0 + shared * (carrying - _carrying(slot, k, work))
    damped = get_row(work, layout.PAIR_DAMPED + k)
    damped = where_above(damped, zero, damped, zero)
    force = deep * spring * (lone / (lone + shared * spring))
    set_row(work, margin_row(instant, k), force * damped)
    if instant == MIDDLE_AT:
        least = spread(work, LEAST_DAMPED)
        damped = where_above(damped, least, damped, least)
        set_row(work, ANY_DAMPED + k, damped)


@written
def begin_again(group, first, last, work):
    """Let the margins at the end of a step be those at the begin of the next one."""
    outside = spread(work, OUT_OF_MESH)

    def clear(k):
        set_row(work, margin_row(BEGIN_AT, k), outside)

    def keep(k):
        set_row(work, margin_row(BEGIN_AT, k), _margin(END_AT, k, work))
        return ()

    loop(followed(group), clear)
    fold(first, last, keep, ())


@compiled
def count_anew(group, work, near):
    """Move the margins of lanes whose newest pair has changed to the pairs' new places."""
    n, n_pairs = width(work), followed(group)
    for lane in range(n):
        newest = near[at(layout.NEWEST, lane, n)]
        before = near[at(rows.MARGINS_OF, lane, n)]
        if newest == before:
            continue
        near[at(rows.MARGINS_OF, lane, n)] = newest
        by = newest - before
        for place in range(n_pairs):
            k = place
            if by > 0:  # from the last place on, so that none is overwritten
                k = n_pairs - 1 - place
            margin = OUT_OF_MESH
            if 0 <= k - by < n_pairs:
                margin = work[at(margin_row(BEGIN_AT, k - by), lane, n)]
            work[at(margin_row(BEGIN_AT, k), lane, n)] = margin


@written
def kinked(group, k, work):
    """1 where a pair takes up or releases its load in the step, else 0."""
    changed = _crosses(0.0, k, work)

    def papers():
        return (changed + _crosses(1.0, k, work),)

    return choose(group.one_sided, lambda: (changed,), papers)[0]


@written
def any_kinked(group, first, last, work):
    """More than 0 in lanes in which any pair takes up or releases its load in the step."""

    def add(k, changed):
        return (changed + kinked(group, k, work),)

    return fold(first, last, add, (spread(work, 0.0),))[0]


@written
def _crosses(bound, k, work):
    """1 where the margin of a pair passes a bound in the step, else 0."""
    return crosses_zero(*_margins_above(bound, k, work), work)


@written
def _margins_above(bound, k, work):
    """Margins of a pair at begin, middle and end of the step, less a bound."""
    instants = BEGIN_AT, MIDDLE_AT, END_AT
    return tuple(_margin(instant, k, work) - bound for instant in instants)


@written
def _missed_above(bound, k, work):
    return missed_moments(*_margins_above(bound, k, work), work)


@written
def _missed(group, k, work):
    """The moments of the margin's part that counts which Simpson's rule misses."""
    short, early = _missed_above(0.0, k, work)

    def papers():
        over, over_early = _missed_above(1.0, k, work)
        return short - over, early - over_early

    return tuple(choose(group.one_sided, lambda: (short, early), papers))


@written
def _add(k, part, short, early, changed, work):
    """Add a part of what is missed to the corrections of a pair."""
    zero = spread(work, 0.0)
    more = where_above(changed, zero, part * short, zero)
    set_row(work, ANY_SHORT + k, get_row(work, ANY_SHORT + k) + more)
    more = where_above(changed, zero, part * early, zero)
    set_row(work, ANY_EARLY + k, get_row(work, ANY_EARLY + k) + more)


@written
def _give(group, j, changed, first, last, work):
    """Correct the force of a pair under the one-sided law."""
    short, early = _missed(group, j, work)
    give(group, j, short, early, changed, first, last, work)


@written
def give(group, j, short, early, changed, first, last, work):
    """Add what is missed of the force of a pair, to which the other loaded pairs give way."""
    one, shared = spread(work, 1.0), get_row(group.numbers, layout.SHARED)
    others = others_carrying(j, first, last, work)
    _add(j, one, short, early, changed, work)
    given = shared / ((1.0 + shared * others) * get_row(work, ANY_DAMPED + j))

    def give_way(i):
        _give_way(i, given, short, early, changed, work)
        return ()

    fold(first, j, give_way, ())
    fold(j + 1, last, give_way, ())


@written
def others_carrying(j, first, last, work):
    """Stiffness of the pairs but one that carry in the middle of the step."""
    zero = spread(work, 0.0)

    def add(i, others):
        loaded, spring = _margin(MIDDLE_AT, i, work), _spring(MIDDLE, i, work)
        return (others + where_above(loaded, zero, spring, zero),)

    return fold(j + 1, last, add, fold(first, j, add, (zero,)))[0]


@written
def _give_way(i, given, short, early, changed, work):
    zero, loaded = spread(work, 0.0), _margin(MIDDLE_AT, i, work)
    part = given * _spring(MIDDLE, i, work) * get_row(work, ANY_DAMPED + i)
    part = where_above(loaded, zero, 0.0 - part, zero)
    _add(i, part, short, early, changed, work)


@written
def _shared_part(numbers, i, work):
    """Shared compliance times the stiffness of a pair in the middle of the step."""
    zero, one = spread(work, 0.0), spread(work, 1.0)
    share = _margin(MIDDLE_AT, i, work)
    share = where_above(share, zero, share, zero)
    share = where_above(share, one, one, share)
    return share * (get_row(numbers, layout.SHARED) * _spring(MIDDLE, i, work))


@written
def _switch(group, j, changed, approach, first, last, work):
    """Correct the force of a pair under the paper's law, whose share of contact is missed."""

    def add(i, together):
        return (together + _shared_part(group.numbers, i, work),)

    (together,) = fold(first, last, add, (spread(work, 1.0),))
    per_share = _spring(MIDDLE, j, work) * approach / (together * together)
    short, early = _missed(group, j, work)
    _add(j, per_share, short, early, changed, work)


@written
def miss(group, approach, first, last, work):
    """Set what Simpson's rule misses of the force of every pair, and mark lanes with any."""
    zero = spread(work, 0.0)
    miss_nothing(first, last, work)

    def look(k, any_changed):
        changed = kinked(group, k, work)

        def one_sided():
            _give(group, k, changed, first, last, work)
            return ()

        def papers():
            _switch(group, k, changed, approach, first, last, work)
            return ()

        def correct():
            choose(group.one_sided, one_sided, papers)
            return (any_changed + changed,)

        return either(any_above(changed, zero), correct, (any_changed,))

    (any_changed,) = fold(first, last, look, (zero,))
    set_row(work, rows.ANY_MISSED, any_changed)


@written
def miss_nothing(first, last, work):
    """Let nothing be missed of the force of any pair."""
    zero = spread(work, 0.0)

    def clear(k):
        set_row(work, ANY_SHORT + k, zero)
        set_row(work, ANY_EARLY + k, zero)
        return ()

    fold(first, last, clear, ())


@written
def missed_law(group, forces, first, last, work):
    """The law of pair forces in the middle of the step, of which nothing is damped or stored."""
    zero = spread(work, 0.0)

    def add(k, *law):
        return _with_missed(group, layout.Law(*law), k, forces, work)

    return layout.Law(*fold(first, last, add, 8 * (zero,)))


@written
def _with_missed(group, law, k, forces, work):
    numbers, pair = group.numbers, pair_rows(MIDDLE, k)
    force, slope = get_row(work, forces + k), get_row(work, pair + layout.GAP_SLOPE)
    position = get_row(work, pair + layout.POSITION)
    position = position - get_row(numbers, layout.HALF_LAG)
    sliding, moment, reaction = rubbed(numbers, position, force)
    along = law.along + force * slope
    for condition in (group.consistent, group.one_sided):
        along = chosen(condition, along, spread(work, 0.0))
    return law._replace(
        normal=law.normal + force,
        friction=law.friction + sliding,
        moment_p=law.moment_p + moment,
        moment_w=law.moment_w + reaction,
        along=along,
    )
