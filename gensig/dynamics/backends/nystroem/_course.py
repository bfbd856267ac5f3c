"""Nominal motion of a machine's reference over time, and the forces that come with it."""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import (
    EIGHT,
    any_above,
    at,
    cells,
    chosen,
    compiled,
    get_row,
    inlined,
    joined,
    load_wide,
    set_row,
    spread,
    store,
    truncated,
    width,
)
from gensig.dynamics._written import loop, traced, written
from gensig.dynamics.backends.nystroem import _group as groups
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import number_at, rows_of
from gensig.dynamics.backends.nystroem._group import has_any_law, meshes_of, of
from gensig.dynamics.backends.nystroem._meshes import touched
from gensig.dynamics.equations import A_TURN


@inlined
def profile_rows(group, n):
    """Rows of a cell of the profile of a group of ``n`` lanes."""
    return groups.N_PROFILE + 2 * (len(group.force) // n + len(group.sources))


@inlined
def cell_at(group, time, n):
    """First row of the profile's cell at a time, and the time since its begin."""
    n_rows = profile_rows(group, n)
    if len(group.profile) == n_rows * n:
        return 0, time
    n_cells = len(group.profile) // (n_rows * n)
    cell = int(np.floor(time * group.cells_per_second)) - group.profile_first
    cell = min(max(cell, 0), n_cells - 1)
    since = time - (group.profile_first + cell) / group.cells_per_second
    return cell * n_rows, since


@traced
def set_rolls(group, cell, since, q, machine, wide):
    """Set the nominal angle and the roll of every mesh, ``since`` s into a cell of the profile.

    ``q`` is the block of a state.
    """
    n = width(machine)
    profile = group.profile
    for first in range(0, n, EIGHT):
        speed = load_wide(profile, at(cell + groups.SPEED, first, n))
        gain = load_wide(profile, at(cell + groups.GAIN, first, n))
        turned = since * (speed + (0.5 * since) * gain)
        set_angle = load_wide(profile, at(cell + groups.ANGLE, first, n)) + turned
        turned = set_angle + load_wide(wide, at(layout.CENTER, first, n))
        store(wide, at(layout.NOMINAL, first, n), turned)

        def roll(m, first=first, set_angle=set_angle, turned=turned):
            _set_roll(group, m, first, set_angle, turned, q, machine, wide)

        loop(meshes_of(group), roll)


def _set_roll(group, m, first, set_angle, turned, q, machine, wide):
    """Set the roll of a mesh, of eight lanes from one on."""
    n, exact = width(machine), m * layout.N_EXACT
    own = load_wide(machine, at(of(q, touched(group, m, A_TURN)), first, n))
    if has_any_law(group):
        turned = chosen(group.prescribed, set_angle, turned)
        own = chosen(group.prescribed, 0.0 * own, own)
    roll = turned * load_wide(group.turning, at(m, first, n)) + own
    roll = load_wide(group.exact, at(exact + layout.EXACT_RADIUS, first, n)) * roll
    begun = load_wide(group.exact, at(exact + layout.START_ROLL, first, n))
    base = m * rows.N_WIDE + layout.BASE
    store(wide, at(base, first, n), begun + roll)


@traced
def set_forces(group, cell, since, machine, wide):
    """Set nominal speed and all forces that follow neither meshes, state nor angles."""
    profile = group.profile
    speed = in_row(profile, cell + groups.SPEED, machine)
    gain = in_row(profile, cell + groups.GAIN, machine)
    center = in_row(wide, layout.CENTER, machine)
    set_row(machine, rows.DRIVE + layout.DRIVE_CENTER, center)
    set_row(machine, rows.DRIVE + layout.DRIVE_SPEED, speed + since * gain)
    set_row(machine, rows.DRIVE + layout.DRIVE_GAIN, gain)

    def give(d):
        given = get_row(group.force, d) - gain * get_row(group.carried, d)
        row = cell + groups.N_PROFILE + 2 * d
        given = given + in_row(profile, row, machine)
        given = given + since * in_row(profile, row + 1, machine)
        set_row(machine, of(rows.FORCES, d), given)

    loop(rows_of(group.force, width(machine)), give)


@written
def in_row(exact, row, work):
    """A float64 row as one of the precision of the scratch."""
    n = width(work)
    low = load_wide(exact, at(row, 0, n))
    high = load_wide(exact, at(row, n - EIGHT, n))
    return joined(work, low, high)


@compiled
def drive(group, begin, since, q, machine, wide):
    """Add the torques and forces that follow an angle to the rows ``ON``.

    ``begin`` is the time at the begin of the step, ``since`` the time since then, and ``q`` the
    block of the state.
    """
    n, n_sources = width(machine), len(group.sources)
    cell, in_cell = cell_at(group, begin + since, n)
    row = cell + profile_rows(group, n) - 2 * n_sources
    zero = spread(machine, 0.0)
    for s in range(n_sources):
        factor = in_row(group.profile, row + 2 * s, machine)
        factor = factor + in_cell * in_row(group.profile, row + 2 * s + 1, machine)
        if any_above(factor * factor, zero):
            turned = number_at(group.turned_by, s)
            torque = factor * _over_angle(group, s, turned, since, q, machine, wide)
            pushed = of(rows.ON, number_at(group.sources, s))
            set_row(machine, pushed, get_row(machine, pushed) + torque)


@written
def _over_angle(group, s, d, since, q, machine, wide):
    """Number of a source's table at the angle of its degree of freedom, straight between nodes."""
    last = width(machine) - EIGHT
    low, low_share = _place(group, s, d, since, q, 0, machine, wide)
    high, high_share = _place(group, s, d, since, q, last, machine, wide)
    node = cells(group.source_table, low, high)
    return node[0] + joined(machine, low_share, high_share) * node[1]


@written
def _place(group, s, d, since, q, first, machine, wide):
    """Index of the node before the angle, for eight lanes from one on, and the share of the way
    to the next one.
    """
    n = width(machine)
    speed = load_wide(machine, at(rows.DRIVE + layout.DRIVE_SPEED, first, n))
    gain = load_wide(machine, at(rows.DRIVE + layout.DRIVE_GAIN, first, n))
    angle = load_wide(wide, at(layout.NOMINAL, first, n))
    angle = angle + since * (speed + (0.5 * since) * gain)
    angle = angle * load_wide(group.exact_rotation, at(d, first, n))
    angle = angle + load_wide(machine, at(of(q, d), first, n))
    per_rad, shift, nodes, per_nodes, first_node = (
        load_wide(group.source_numbers, at(s * groups.N_SOURCE + name, first, n))
        for name in range(groups.N_SOURCE)
    )
    place = angle * per_rad + shift
    place = place - nodes * truncated(place * per_nodes)
    node = truncated(place)
    return first_node + float(groups.PER_NODE) * node, place - node
