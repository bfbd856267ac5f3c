"""Two-evaluation core: steps in which a pair takes up or releases its load.

The margin of a pair, the force it has or would need to have, is a parabola through begin, middle
and end of the step. The force is its positive part, whose moments Simpson's rule misses.
"""

from __future__ import annotations

from functools import partial

from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import (
    any_above,
    chosen,
    get_row,
    set_row,
    spread,
    where_above,
)
from gensig.dynamics._written import traced, when, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._law import arm
from gensig.dynamics.backends.nystroem._layout import (
    BEGIN_AT,
    DAMPED,
    END_AT,
    FOLLOWED,
    MARGIN,
    MIDDLE_AT,
    N_NODE,
    SPRING,
)

LEAST_DAMPED = 0.1


@written
def margin(instant, j, work):
    """Margin of a pair at an instant of the step."""
    return get_row(work, MARGIN + instant * FOLLOWED + j)


@written
def kinked(j, work):
    """1 where a pair takes up or releases its load in the step, else 0."""
    return crosses_zero(
        margin(BEGIN_AT, j, work),
        margin(MIDDLE_AT, j, work),
        margin(END_AT, j, work),
        work,
    )


@written
def crosses_zero(begin, middle, end, work):
    """1 where the sign of a number changes in the step, else 0."""
    zero, one = spread(work, 0.0), spread(work, 1.0)
    first, second = middle * begin, middle * end
    lowest = where_above(first, second, second, first)
    return where_above(zero, lowest, one, zero)


@written
def _spring(j, work):
    """Stiffness of a pair in the middle of the step."""
    return get_row(work, SPRING + MIDDLE_AT * FOLLOWED + j)


@written
def _others(instant, j, work):
    """Stiffness of the loaded pairs but one."""
    zero, total = spread(work, 0.0), spread(work, 0.0)
    for i in range(FOLLOWED):
        if i != j:
            loaded = margin(instant, i, work)
            total = total + where_above(loaded, zero, _spring(i, work), zero)
    return total


@written
def _lone_margin(instant, j, shared, work):
    """Margin of a pair; the force it would have if it carried where it does not."""
    zero, force = spread(work, 0.0), margin(instant, j, work)
    others = _others(instant, j, work)
    spring = _spring(j, work)
    with_it = 1.0 + shared * (others + spring)
    would = force * ((1.0 + shared * others) / with_it)
    return where_above(force, zero, force, would)


@written
def _half(a, b, c, low, value_low, value_high, work):
    """Integrals of the positive part of the parabola and of its share of time, over a half."""
    zero = spread(work, 0.0)
    slope, bend = 4.0 * b - 3.0 * a - c, 2.0 * (a - 2.0 * b + c)
    start, end = spread(work, low), spread(work, low + 0.5)
    root = low + 0.5 * (value_low / (value_low - value_high))
    for _ in range(2):
        off = a + root * (slope + root * bend)
        root = root - off / (slope + 2.0 * root * bend)
        root = where_above(root, start, root, start)  # also what is no number
        root = where_above(end, root, root, end)
    entry = where_above(value_low, zero, start, root)
    leave = where_above(value_high, zero, end, root)
    mean = _moment_0(leave, a, slope, bend) - _moment_0(entry, a, slope, bend)
    late = _moment_1(leave, a, slope, bend) - _moment_1(entry, a, slope, bend)
    return mean, late


@written
def _moment_0(t, a, slope, bend):
    return t * (a + t * (0.5 * slope + t * (bend * (1.0 / 3.0))))


@written
def _moment_1(t, a, slope, bend):
    return t * t * (0.5 * a + t * (slope * (1.0 / 3.0) + t * (0.25 * bend)))


@written
def _positive(x, zero):
    return where_above(x, zero, x, zero)


@written
def _missed(j, changed, shared, work):
    """Set what Simpson's rule misses of the force of a pair; 0 where it has no kink."""
    zero = spread(work, 0.0)
    a = _lone_margin(BEGIN_AT, j, shared, work)
    b = _lone_margin(MIDDLE_AT, j, shared, work)
    c = _lone_margin(END_AT, j, shared, work)
    short, early = missed_moments(a, b, c, work)
    return (
        where_above(changed, zero, short, zero),
        where_above(changed, zero, early, zero),
    )


@written
def missed_moments(a, b, c, work):
    """Moments that Simpson's rule misses of the positive part of a parabola through three values.

    Of its mean over the step, and of its mean weighted by what is left of the step.
    """
    zero = spread(work, 0.0)
    mean_1, late_1 = _half(a, b, c, 0.0, a, b, work)
    mean_2, late_2 = _half(a, b, c, 0.5, b, c, work)
    mean, late = mean_1 + mean_2, late_1 + late_2
    a, b, c = _positive(a, zero), _positive(b, zero), _positive(c, zero)
    short = mean - (a + 4.0 * b + c) * (1.0 / 6.0)
    early = mean - late - (a + 2.0 * b) * (1.0 / 6.0)
    return short, early


@written
def _give(j, changed, shared, work):
    """Add what Simpson's rule misses of a pair's force; the other loaded pairs give way."""
    zero = spread(work, 0.0)
    short, early = _missed(j, changed, shared, work)
    least = spread(work, LEAST_DAMPED)
    damped = get_row(work, DAMPED + MIDDLE_AT * FOLLOWED + j)
    damped = where_above(damped, least, damped, least)
    stiff = 1.0 + shared * _others(MIDDLE_AT, j, work)
    given = shared / (stiff * damped)
    for i in range(FOLLOWED):
        part = spread(work, 1.0)
        if i != j:
            loaded = margin(MIDDLE_AT, i, work)
            part = given * _spring(i, work)
            part = part * get_row(work, DAMPED + MIDDLE_AT * FOLLOWED + i)
            part = where_above(loaded, zero, 0.0 - part, zero)
        more = where_above(changed, zero, part * short, zero)
        set_row(work, rows.SHORT + i, get_row(work, rows.SHORT + i) + more)
        more = where_above(changed, zero, part * early, zero)
        set_row(work, rows.EARLY + i, get_row(work, rows.EARLY + i) + more)


@traced
def miss(numbers, changed, work):
    """Set what Simpson's rule misses of the force of every pair; other loaded pairs give way.

    ``changed`` holds for every pair 1 where it has a kink.
    """
    zero, shared = spread(work, 0.0), get_row(numbers, layout.SHARED)
    for j in range(FOLLOWED):
        set_row(work, rows.SHORT + j, zero)
        set_row(work, rows.EARLY + j, zero)
    for j, mark in enumerate(changed):
        when(any_above(mark, zero), partial(_give, j, mark, shared, work))


@written
def missed_law(mesh, forces, work):
    """The law of pair forces in the middle of the step, of which nothing is damped or stored."""
    numbers = mesh.numbers
    zero = spread(work, 0.0)
    normal, rubbed, turned, along = zero, zero, zero, zero
    for j in range(FOLLOWED):
        force, pair = get_row(work, forces + j), rows.MIDDLE + j * N_NODE
        slid = force * get_row(work, pair + rows.SLIDING)
        normal, rubbed = normal + force, rubbed + slid
        turned = turned + slid * arm(numbers, get_row(work, pair + rows.PLACE))
        along = along + force * get_row(work, pair + rows.GAP_SLOPE)
    along = chosen(mesh.consistent, along, zero)
    coefficient = get_row(numbers, layout.FRICTION)
    friction, moment = coefficient * rubbed, coefficient * turned
    moment_w = get_row(numbers, layout.TANGENT_LENGTH) * friction - moment
    return layout.Law(normal, friction, 0.0 - moment, moment_w, along, zero, zero, zero)


@written
def add_force(group, d, force, by, changed, row, machine):
    """Add the acceleration of a degree of freedom by a force, times a number, to a row."""
    zero, old = spread(machine, 0.0), get_row(machine, row)
    new = old + by * (force * get_row(group.inverse_mass, d))
    set_row(machine, row, where_above(changed, zero, new, old))
