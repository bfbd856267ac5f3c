"""Two-evaluation core: the one-sided law of three pairs of teeth.

The symbols are those of ``docs/theory/motion.md``.
"""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._mesh_kernels import with_coast
from gensig.dynamics._vector import (
    chosen,
    fused,
    get_row,
    set_row,
    spread,
    where_above,
)
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._layout import N_NODE, PER_COMPLIANCE


@written
def _greater(a, b):
    return where_above(a, b, a, b)


@written
def _bite(nodes, j, ahead, approach, work):
    """Penetration of a pair into the body that no other pair deflects; negative without."""
    pair = nodes + j * N_NODE
    gap, rise = get_row(work, pair + rows.GAP), get_row(work, pair + rows.GAP_SLOPE)
    return approach - fused(ahead, rise, gap)


@written
def shared_load(c_0, c_1, c_2, b_0, b_1, b_2, shared, zero):
    """Load of three pairs that share a compliance, and their own stiffnesses.

    The load is the largest of all sets of pairs: a pair that does not carry makes every set
    smaller that it belongs to. Compliances are in ``1 / PER_COMPLIANCE`` m/N, so that products of
    fifteen of them are float32 numbers; load and stiffnesses are in ``PER_COMPLIANCE`` N and N/m.
    """
    c_01, c_02, c_12 = c_0 * c_1, c_0 * c_2, c_1 * c_2
    c_012 = c_01 * c_2
    alone_0, alone_1, alone_2 = c_0 + shared, c_1 + shared, c_2 + shared
    pair_01 = fused(shared, c_0 + c_1, c_01)
    pair_02 = fused(shared, c_0 + c_2, c_02)
    pair_12 = fused(shared, c_1 + c_2, c_12)
    all_three = fused(shared, c_01 + (c_02 + c_12), c_012)
    n_01 = fused(b_0, c_1, b_1 * c_0)
    n_02 = fused(b_0, c_2, b_2 * c_0)
    n_12 = fused(b_1, c_2, b_2 * c_1)
    n_012 = fused(b_0, c_12, fused(b_1, c_02, b_2 * c_01))
    # reciprocals of five products by one division
    x_0, x_1, x_2 = alone_0 * pair_12, alone_1 * pair_02, alone_2 * pair_01
    both, x_01 = c_012 * all_three, x_0 * x_1
    x_012 = x_01 * x_2
    per = 1.0 / (both * x_012)
    per_both, per_x = per * x_012, per * both
    per_x_01 = per_x * x_2
    load = _greater(b_0 * pair_12, n_12 * alone_0) * (per_x_01 * x_1)
    other = _greater(b_1 * pair_02, n_02 * alone_1) * (per_x_01 * x_0)
    load = _greater(load, other)
    other = _greater(b_2 * pair_01, n_01 * alone_2) * (per_x * x_01)
    load = _greater(load, other)
    load = _greater(load, n_012 * (per_both * c_012))
    per_all = per_both * all_three
    springs = c_12 * per_all, c_02 * per_all, c_01 * per_all
    return _greater(load, zero), springs


@written
def arm(numbers, place):
    """Radius of curvature of the pinion's flank at a place on the path."""
    path, zero = get_row(numbers, layout.PATH), spread(numbers, 0.0)
    on_path = where_above(place, zero, place, zero)
    on_path = where_above(on_path, path, path, on_path)
    return get_row(numbers, layout.START_CURVATURE) + on_path


@written
def _pair(numbers, nodes, instant, j, bite, spring, bent, rate, roll_rate, work):
    """Force, friction over its coefficient, its moment about the pinion, force along the roll."""
    zero, one = spread(numbers, 0.0), spread(numbers, 1.0)
    pair = nodes + j * N_NODE
    slope, spring = get_row(work, pair + rows.GAP_SLOPE), PER_COMPLIANCE * spring
    deep = spring * (bite - bent)
    elastic = where_above(deep, zero, deep, zero)
    growth, damping = rate - slope * roll_rate, get_row(numbers, layout.DAMPING)
    damped = fused(damping, growth, one)
    damped = where_above(damped, zero, damped, zero)
    damper, most = damping * elastic, get_row(work, layout.MOST_DAMPER)
    damper = where_above(damper, most, most, damper)
    force = fused(damper, growth, elastic)
    force = where_above(force, zero, force, zero)
    row = instant * rows.FOLLOWED + j
    lacking = where_above(deep, zero, force, deep * damped)
    set_row(work, rows.MARGIN + row, lacking)
    set_row(work, rows.SPRING + row, spring)
    set_row(work, rows.DAMPED + row, damped)
    set_row(work, rows.PAIR_FORCE + j, force)
    rubbed = force * get_row(work, pair + rows.SLIDING)
    turned = rubbed * arm(numbers, get_row(work, pair + rows.PLACE))
    soft = (0.5 / PER_COMPLIANCE) * get_row(work, pair + rows.SOFTENING)
    along = fused(force, slope, soft * (elastic * elastic))
    return force, rubbed, turned, along


@written
def mesh_law(
    group, nodes, instant, ahead, turned, approach, rate, roll_rate, work, wide
):
    """The law of the pairs that are followed, without its energies.

    ``ahead`` m after the nodes and ``turned`` m after the begin of the step. Rows of the
    instant take margin, stiffness and damping of every pair.
    """
    law = drive_law(group, nodes, instant, ahead, approach, rate, roll_rate, work)
    return with_coast(group, law, turned, approach, rate, roll_rate, work, wide)


@written
def drive_law(group, nodes, instant, ahead, approach, rate, roll_rate, work):
    """The law of the drive flanks; see ``mesh_law``."""
    numbers = group.numbers
    zero = spread(work, 0.0)
    scaled = PER_COMPLIANCE * get_row(numbers, layout.SHARED)
    b_0 = _bite(nodes, 0, ahead, approach, work)
    b_1 = _bite(nodes, 1, ahead, approach, work)
    b_2 = _bite(nodes, 2, ahead, approach, work)
    load, springs = shared_load(
        get_row(work, nodes),
        get_row(work, nodes + N_NODE),
        get_row(work, nodes + 2 * N_NODE),
        b_0,
        b_1,
        b_2,
        scaled,
        zero,
    )
    bent = scaled * load
    f_0, s_0, m_0, a_0 = _pair(
        numbers, nodes, instant, 0, b_0, springs[0], bent, rate, roll_rate, work
    )
    f_1, s_1, m_1, a_1 = _pair(
        numbers, nodes, instant, 1, b_1, springs[1], bent, rate, roll_rate, work
    )
    f_2, s_2, m_2, a_2 = _pair(
        numbers, nodes, instant, 2, b_2, springs[2], bent, rate, roll_rate, work
    )
    coefficient = get_row(numbers, layout.FRICTION)
    normal, friction = (f_0 + f_1) + f_2, coefficient * ((s_0 + s_1) + s_2)
    moment_p = 0.0 - coefficient * ((m_0 + m_1) + m_2)
    moment_w = get_row(numbers, layout.TANGENT_LENGTH) * friction + moment_p
    along = chosen(group.consistent, (a_0 + a_1) + a_2, zero)
    return layout.Law(normal, friction, moment_p, moment_w, along, zero, zero, zero)
