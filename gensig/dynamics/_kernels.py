"""Compiled core: a fixed-step fourth-order Runge-Kutta integrator, four records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or reorders sums: a record's
bits depend on nothing but its own numbers. Arrays are flat; a row is ``LANES`` numbers.

Numba's cache knows the time of this file alone: touch it after a change of ``_mesh_kernels`` or ``_vector``.
"""

from __future__ import annotations

import numpy as np

from gensig.dynamics import _mesh_kernels as mesh
from gensig.dynamics._mesh_kernels import N_SLOTS, ROLL, SLOT_ROWS, WANTED, at_row, gather, mesh_law
from gensig.dynamics._vector import LANES, any_above, compiled, inlined, load, spread, store, where_above
from gensig.mesh.pair_table import N_PAIRS

SUBSTEPS = 8


@inlined
def _motion(numbers, dofs, time, q, v, work):
    """Approach, its rate, roll and its rate at one instant, from the rows of a state."""
    pinion_radius, wheel_radius = at_row(numbers, mesh.PINION_RADIUS), at_row(numbers, mesh.WHEEL_RADIUS)
    pinion, wheel = dofs[2] * LANES, dofs[5] * LANES
    turned, spun = load(work, q + pinion), load(work, v + pinion)
    approach = pinion_radius * turned - wheel_radius * load(work, q + wheel)
    rate = pinion_radius * spun - wheel_radius * load(work, v + wheel)
    if dofs[1] >= 0:
        approach = approach - load(work, q + dofs[1] * LANES)
        rate = rate - load(work, v + dofs[1] * LANES)
    if dofs[4] >= 0:
        approach = approach + load(work, q + dofs[4] * LANES)
        rate = rate + load(work, v + dofs[4] * LANES)
    speed = at_row(numbers, mesh.SPEED)
    roll = at_row(numbers, mesh.START_ROLL) + pinion_radius * (speed * spread(time) + turned)
    return approach, rate, roll, pinion_radius * (speed + spun)


@inlined
def _accelerate(machine, numbers, dofs, law, q, v, a, work):
    """Fill the rows ``a`` with q'' under the forces of a mesh law."""
    inverse_mass, k_row, k_column, k_value, c_row, c_column, c_value, force = machine
    normal, friction, moment_p, moment_w, along = law[0], law[1], law[2], law[3], law[4]
    for i in range(0, len(force), LANES):
        store(work, a + i, load(force, i))
    for k in range(len(k_row)):
        place = a + k_row[k] * LANES
        store(work, place, load(work, place) - load(k_value, k * LANES) * load(work, q + k_column[k] * LANES))
    for k in range(len(c_row)):
        place = a + c_row[k] * LANES
        store(work, place, load(work, place) - load(c_value, k * LANES) * load(work, v + c_column[k] * LANES))
    place = a + dofs[2] * LANES
    store(work, place, load(work, place) + at_row(numbers, mesh.PINION_RADIUS) * (along - normal) + moment_p)
    place = a + dofs[5] * LANES
    store(work, place, load(work, place) + at_row(numbers, mesh.WHEEL_RADIUS) * normal + moment_w)
    if dofs[1] >= 0:
        store(work, a + dofs[1] * LANES, load(work, a + dofs[1] * LANES) + normal)
    if dofs[4] >= 0:
        store(work, a + dofs[4] * LANES, load(work, a + dofs[4] * LANES) - normal)
    if dofs[0] >= 0:
        store(work, a + dofs[0] * LANES, load(work, a + dofs[0] * LANES) + friction)
    if dofs[3] >= 0:
        store(work, a + dofs[3] * LANES, load(work, a + dofs[3] * LANES) - friction)
    for i in range(0, len(force), LANES):
        store(work, a + i, load(work, a + i) * load(inverse_mass, i))


@compiled
def integrate(group, state, lost, fresh, step, first_step, n_steps, channels, out, work, near):
    """Advance every lane by ``n_steps`` of classical RK4.

    The tables are read once at the middle and once at the end of a step, where the next one begins; the stages differ
    from there by a roll so small that the slope of the gap makes up for it. A step in which a pair takes up or lets go
    of its load is taken again in ``SUBSTEPS`` parts, in the lanes where it does: the force has a kink there, which
    would otherwise set the accuracy of everything.

    Parameters
    ----------
    state : (2, dof, lane)    q and v, advanced in place
    lost : (lane,)            the number of steps without contact is added
    fresh : (lane,)           1 where the state is new: its tables are read first. 0 goes on as if the last call of this
        group, step and scratch had not ended; so where calls end leaves no trace
    out : (channel, n_steps, lane)    takes the mean acceleration over each step (what the equations add to the
        velocity, over the step: kinks then alias far less than point values would); empty stores nothing
    work, near : ``scratch`` of the group
    """
    numbers, places, table, tooth_row, tooth_error = (
        group.numbers, group.places, group.table, group.tooth_row, group.tooth_error,
    )  # fmt: skip
    one_sided, consistent, dofs = group.one_sided, group.consistent, group.dofs
    machine = (
        group.inverse_mass, group.stiffness_row, group.stiffness_column, group.stiffness_value, group.damping_row,
        group.damping_column, group.damping_value, group.force,
    )  # fmt: skip
    zero, one = spread(0.0), spread(1.0)
    size = len(group.force)
    extra = N_SLOTS * SLOT_ROWS
    rolls, within_row, flags = extra + ROLL, extra + mesh.WITHIN, (extra + mesh.CHANGED) * LANES
    rows = (extra + mesh.LAW + mesh.N_LAW + 4) * LANES
    now, single, parted = rows, rows + 2 * size, rows + 4 * size
    trial, total, a = rows + 6 * size, rows + 8 * size, rows + 10 * size
    mean, part_mean = rows + 11 * size, rows + 12 * size
    n_channels = len(channels) if len(out) > 0 else 0
    margin = spread(mesh.NEAR) if one_sided else spread(2.0 * mesh.FAR)
    for i in range(0, 2 * size, LANES):
        store(work, now + i, load(state, i))
    for lane in range(LANES):
        near[WANTED * LANES + lane] = 1 if fresh[lane] > 0.0 else 0
    store(work, flags, load(fresh, 0))
    approach, rate, roll, roll_rate = _motion(numbers, dofs, first_step * step, now, now + size, work)
    store(work, (rolls + 4) * LANES, roll)
    store(work, within_row * LANES, approach + margin)
    gather(numbers, places, table, tooth_row, tooth_error, rolls + 4, within_row, 4, work, near)
    _take_parted(work, near, flags, 4, 1, rolls, single, parted, 0)
    start_slot, end_slot = 1, 2
    for n in range(n_steps):
        n_parts, part = 1, 0
        source, target, begin, end = now, single, start_slot, end_slot
        changed = zero
        while part < n_parts:
            h = step / n_parts
            time = (first_step + n) * step + part * h
            for i in range(0, 2 * size, LANES):
                store(work, trial + i, load(work, source + i))
                store(work, total + i, zero)
            middle = 3 if n_parts == 1 else 4
            loaded = zero
            for stage in range(4):
                ahead = h * (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5)
                approach, rate, roll, roll_rate = _motion(numbers, dofs, time + ahead, trial, trial + size, work)
                slot = begin if stage == 0 else end if stage == 3 else middle
                if stage == 1 or stage == 3:
                    store(work, (rolls + slot) * LANES, roll)
                    store(work, within_row * LANES, approach + margin)
                    gather(numbers, places, table, tooth_row, tooth_error, rolls + slot, within_row, slot, work, near)
                most = 0
                for lane in range(LANES):
                    most = max(most, near[slot * LANES + lane])
                law = mesh_law(
                    numbers, places, table, tooth_row, one_sided, consistent, most, slot,
                    roll - load(work, (rolls + slot) * LANES), roll, approach, rate, roll_rate, work,
                )  # fmt: skip
                _accelerate(machine, numbers, dofs, law, trial, trial + size, a, work)
                if stage == 0:
                    loaded = law[7]
                    if n_parts == 1:
                        store(
                            lost,
                            0,
                            load(lost, 0) + where_above(law[0], zero, zero, where_above(zero, law[0], zero, one)),
                        )
                else:
                    differs = law[7] - loaded
                    changed = where_above(differs * differs, zero, one, changed)
                weight = spread(1.0 if stage == 0 or stage == 3 else 2.0)
                reach = spread(h * (1.0 if stage == 2 else 0.5))
                for i in range(0, size, LANES):
                    speed, gained = load(work, trial + size + i), load(work, a + i)
                    store(work, total + i, load(work, total + i) + weight * speed)
                    store(work, total + size + i, load(work, total + size + i) + weight * gained)
                    store(work, trial + i, load(work, source + i) + reach * speed)
                    store(work, trial + size + i, load(work, source + size + i) + reach * gained)
            share = spread(h / 6.0)
            for i in range(0, 2 * size, LANES):
                store(work, target + i, load(work, source + i) + share * load(work, total + i))
            for c in range(n_channels):
                place = (mean if n_parts == 1 else part_mean) + c * LANES
                value = load(work, total + size + channels[c] * LANES) * spread(1.0 / (6.0 * n_parts))
                store(work, place, value if part == 0 else load(work, place) + value)
            part += 1
            if n_parts == 1 and any_above(changed, zero):
                n_parts, part = SUBSTEPS, 0
                store(work, flags, changed)
                for lane in range(LANES):
                    near[WANTED * LANES + lane] = 1 if work[flags + lane] > 0.0 else 0
                source, target, begin, end = now, parted, start_slot, 5
            elif n_parts > 1:
                source, begin = parted, end
                end = 6 if end == 5 else 5
        if n_parts > 1:
            _take_parted(work, near, flags, begin, end_slot, rolls, single, parted, 2 * size)
            for c in range(n_channels):
                place = mean + c * LANES
                taken = where_above(load(work, flags), zero, load(work, part_mean + c * LANES), load(work, place))
                store(work, place, taken)
        for c in range(n_channels):
            store(out, (c * n_steps + n) * LANES, load(work, mean + c * LANES))
        now, single = single, now
        start_slot, end_slot = end_slot, start_slot
    if start_slot == 2:
        store(work, flags, one)
        _take_parted(work, near, flags, 2, 1, rolls, single, parted, 0)
    for i in range(0, 2 * size, LANES):
        store(state, i, load(work, now + i))


@compiled
def _take_parted(work, near, flags, parted_slot, slot, rolls, single, parted, size):
    """Put the state and the pairs of the lanes that were taken in parts in place of those taken at once."""
    for lane in range(LANES):
        near[WANTED * LANES + lane] = 1
        if work[flags + lane] == 0.0:
            continue
        for i in range(0, size, LANES):
            work[single + i + lane] = work[parted + i + lane]
        for row in range(SLOT_ROWS):
            work[(slot * SLOT_ROWS + row) * LANES + lane] = work[(parted_slot * SLOT_ROWS + row) * LANES + lane]
        work[(rolls + slot) * LANES + lane] = work[(rolls + parted_slot) * LANES + lane]
        near[slot * LANES + lane] = near[parted_slot * LANES + lane]
    # a lane may have brought more pairs than any had here: what lies behind the others' must be nobody
    for lane in range(LANES):
        for k in range(near[slot * LANES + lane], N_PAIRS):
            here = (slot * SLOT_ROWS + k * mesh.N_KEPT) * LANES + lane
            work[here + mesh.OWN * LANES] = 1.0
            work[here + mesh.STIFFNESS * LANES] = 1.0
            work[here + mesh.OWN_SLOPE * LANES] = 0.0
            work[here + mesh.GAP * LANES] = mesh.FAR
            work[here + mesh.GAP_SLOPE * LANES] = 0.0
            work[here + mesh.POSITION * LANES] = -mesh.FAR


@compiled
def law_at(group, motion, work, near, found):
    """Every lane's law at one instant; rows of ``motion`` are roll, approach, its rate, the roll's rate.

    ``found`` takes the rows of the law. For tests: the integrator reads the tables less often.
    """
    numbers, places, table, tooth_row, tooth_error = (
        group.numbers,
        group.places,
        group.table,
        group.tooth_row,
        group.tooth_error,
    )
    one_sided, consistent = group.one_sided, group.consistent
    extra = N_SLOTS * SLOT_ROWS
    store(work, (extra + ROLL) * LANES, load(motion, 0))
    within = load(motion, LANES) if one_sided else spread(2.0 * mesh.FAR)
    store(work, (extra + mesh.WITHIN) * LANES, within)
    for lane in range(LANES):
        near[WANTED * LANES + lane] = 1
    most = gather(numbers, places, table, tooth_row, tooth_error, extra + ROLL, extra + mesh.WITHIN, 1, work, near)
    law = mesh_law(
        numbers, places, table, tooth_row, one_sided, consistent, most, 1, spread(0.0), load(motion, 0),
        load(motion, LANES), load(motion, 2 * LANES), load(motion, 3 * LANES), work,
    )  # fmt: skip
    for row in range(mesh.N_LAW):
        store(found, row * LANES, law[row])


def scratch(n_dof, n_channels):
    """Work rows and pair counts of ``integrate`` and ``law_at``."""
    n_rows = N_SLOTS * SLOT_ROWS + mesh.LAW + mesh.N_LAW + 4 + 11 * n_dof + 2 * max(n_dof, n_channels) + n_dof
    near = np.zeros((mesh.N_COUNTS, LANES), dtype=np.int64)
    near[mesh.NEWEST] = -(2**62)  # no pair: the first look at the tables finds the teeth
    return np.zeros(n_rows * LANES), near.ravel()
