"""Compiled core: the mesh law and a fixed-step fourth-order Runge-Kutta integrator.

Scalar code without reassociation, one record a call, so that a record's bits depend on nothing but its own numbers.
The symbols are those of ``docs/theory/spur_dynamics.md``.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from gensig.mesh.pair_table import FIRST_PITCH, N_PAIRS

SUBSTEPS = 8
LOADED = 6  # row of a mesh law's scratch whose first entry counts the pairs that bear load

# Without Numba's reference counting (arrays are borrowed, none is made here) a step costs a third less; inlined,
# because the numbers of a mesh would otherwise be copied at every call.
_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
_compiled: Any = functools.partial(njit, nogil=True, **_OPTIONS)()
_inlined: Any = functools.partial(njit, inline="always", **_OPTIONS)()


class MeshNumbers(NamedTuple):
    """One gear mesh as plain numbers; no arrays, whose reference counts would cost more than the law itself."""

    pinion_x: int  # degrees of freedom, -1 where a machine has none
    pinion_y: int
    pinion_rotation: int
    wheel_x: int
    wheel_y: int
    wheel_rotation: int
    pinion_radius: float
    wheel_radius: float
    pitch: float
    nodes_per_meter: float
    path: float
    pitch_point: float
    start_curvature: float
    tangent_length: float
    shared: float
    one_sided: bool
    consistent: bool
    damping: float  # one_sided: factor d in s/m; paper: c_m in N s/m
    friction: float
    friction_half_width: float
    switch_half_width: float
    backlash: float
    start_pinion: int
    start_wheel: int
    start_roll: float
    speed: float  # nominal pinion speed, rad/s


class MeshArrays(NamedTuple):
    """One gear mesh as the integrator takes it.

    ``table`` (row, node, [c, c', g, g']) holds the distinct teeth of both gears, the sound pinion tooth first and the
    sound wheel tooth at ``wheel_row``; ``pinion_row`` and ``wheel_row`` (tooth,) say which row a tooth has, -1 for a
    missing one; the errors (tooth,) are gap offsets in m.
    """

    numbers: MeshNumbers
    table: Any
    pinion_row: Any
    wheel_row: Any
    pinion_error: Any
    wheel_error: Any
    sound_wheel_row: int


class SystemArrays(NamedTuple):
    """M q'' + C q' + K q = f + mesh forces, K and C as triplets; q is the deviation from nominal rotation."""

    inverse_mass: Any
    stiffness_row: Any
    stiffness_column: Any
    stiffness_value: Any
    damping_row: Any
    damping_column: Any
    damping_value: Any
    force: Any


@_inlined
def _friction_sign(m, position):
    """Direction of sliding, smooth through the pitch point, -1 before it and 1 after it."""
    x = (position - m.pitch_point) / m.friction_half_width
    if x <= -1.0:
        return -1.0
    if x >= 1.0:
        return 1.0
    return x * (1.5 - 0.5 * x * x)


@_inlined
def mesh_law(
    m, table, pinion_row, wheel_row, pinion_error, wheel_error, sound_wheel, roll, approach, rate, roll_rate, work
):
    """Forces of all pairs at one instant.

    Returns normal force, friction force, friction moments about pinion and wheel, force on the roll coordinate
    (energy balance), stored energy, and the power lost in mesh damping. ``work`` is (7, N_PAIRS) scratch; its
    last row begins with the number of loaded pairs, negative on the coast flank.
    """
    if not m.one_sided:
        return _paper_law(m, table, pinion_row, wheel_row, roll, approach, rate, work)
    if approach > -0.5 * m.backlash:
        n = _gather(m, table, pinion_row, wheel_row, pinion_error, wheel_error, roll, approach, work)
        return _flank_law(m, n, rate, roll_rate, work)
    if -approach <= m.backlash:
        work[LOADED, 0] = 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    mirrored = 2.0 * m.pitch_point + 0.5 * m.pitch - roll
    n = _gather_coast(m, table, pinion_row, wheel_row, sound_wheel, mirrored, -approach - m.backlash, work)
    back = _flank_law(m, n, -rate, -roll_rate, work)
    work[LOADED, 0] = -work[LOADED, 0]
    return -back[0], 0.0, 0.0, 0.0, -back[4], back[5], back[6]


@_inlined
def _gather(m, table, pinion_row, wheel_row, pinion_error, wheel_error, roll, approach, work):
    """Pairs that could touch: bite, 1 / own compliance, own, gap slope, compliance slope, position; and how many."""
    newest = int(np.floor(roll / m.pitch)) + 1
    tooth_p = (newest + m.start_pinion) % len(pinion_row)
    tooth_w = (newest + m.start_wheel) % len(wheel_row)
    position = roll - newest * m.pitch
    last_cell = table.shape[1] - 2
    x = (position - FIRST_PITCH * m.pitch) * m.nodes_per_meter
    nodes_per_pitch = m.pitch * m.nodes_per_meter
    n_active = 0
    for _ in range(N_PAIRS):
        row_p, row_w = pinion_row[tooth_p], wheel_row[tooth_w]
        if row_p >= 0 and row_w >= 0:
            cell = min(max(int(x), 0), last_cell)
            gap = _interpolate(table, row_p, row_w, cell, x - cell, 2) + pinion_error[tooth_p] + wheel_error[tooth_w]
            if approach > gap:
                own = _interpolate(table, row_p, row_w, cell, x - cell, 0) - m.shared
                work[0, n_active] = approach - gap
                work[1, n_active] = 1.0 / own
                work[2, n_active] = own
                work[3, n_active] = _interpolate(table, row_p, row_w, cell, x - cell, 3)
                work[4, n_active] = _interpolate(table, row_p, row_w, cell, x - cell, 1)
                work[5, n_active] = position
                n_active += 1
        position += m.pitch
        x += nodes_per_pitch
        tooth_p = tooth_p - 1 if tooth_p > 0 else len(pinion_row) - 1
        tooth_w = tooth_w - 1 if tooth_w > 0 else len(wheel_row) - 1
    return n_active


@_inlined
def _gather_coast(m, table, pinion_row, wheel_row, sound_wheel, mirrored, approach, work):
    """The same for the back flanks: teeth count backwards along the mirrored roll, are sound and have no errors."""
    newest = int(np.floor(mirrored / m.pitch)) + 1
    n_active = 0
    for k in range(N_PAIRS):
        pair = newest - k
        position = mirrored - pair * m.pitch
        if pinion_row[(m.start_pinion - pair) % len(pinion_row)] < 0:
            continue
        if wheel_row[(m.start_wheel - pair) % len(wheel_row)] < 0:
            continue
        x = (position - FIRST_PITCH * m.pitch) * m.nodes_per_meter
        cell = min(max(int(x), 0), table.shape[1] - 2)
        gap = _interpolate(table, 0, sound_wheel, cell, x - cell, 2)
        if approach > gap:
            own = _interpolate(table, 0, sound_wheel, cell, x - cell, 0) - m.shared
            work[0, n_active] = approach - gap
            work[1, n_active] = 1.0 / own
            work[2, n_active] = own
            work[3, n_active] = _interpolate(table, 0, sound_wheel, cell, x - cell, 3)
            work[4, n_active] = _interpolate(table, 0, sound_wheel, cell, x - cell, 1)
            work[5, n_active] = position
            n_active += 1
    return n_active


@_inlined
def _interpolate(table, row_p, row_w, cell, f, column):
    """Linear between nodes, sum of both gears' sides."""
    a = table[row_p, cell, column] + table[row_w, cell, column]
    b = table[row_p, cell + 1, column] + table[row_w, cell + 1, column]
    return a + f * (b - a)


@_inlined
def _total_load(shared, n_active, work):
    """Load of all pairs; those that the shared deflection lifts off get a bite of 0.

    Each that leaves raises the total, so the loop ends after at most ``n_active`` rounds.
    """
    while True:
        stiffness, force = 0.0, 0.0
        for k in range(n_active):
            if work[0, k] > 0.0:
                stiffness += work[1, k]
                force += work[0, k] * work[1, k]
        total = force / (1.0 + shared * stiffness)
        lifted = False
        for k in range(n_active):
            if 0.0 < work[0, k] <= shared * total:
                work[0, k] = 0.0
                lifted = True
        if not lifted:
            return total


@_inlined
def _flank_law(m, n_active, approach_rate, roll_rate, work):
    """One-sided contact of the gathered pairs."""
    total = _total_load(m.shared, n_active, work)
    normal, friction, moment_p, moment_w, along, lost = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    stored = -0.5 * m.shared * total * total
    work[LOADED, 0] = 0.0
    for k in range(n_active):
        if work[0, k] <= 0.0:
            continue
        elastic = (work[0, k] - m.shared * total) * work[1, k]
        rate = approach_rate - work[3, k] * roll_rate
        load = max(0.0, elastic * (1.0 + m.damping * rate))
        normal += load
        work[LOADED, 0] += load > 0.0
        stored += elastic * (work[0, k] - 0.5 * work[2, k] * elastic)
        lost += (load - elastic) * rate
        along += load * work[3, k] + 0.5 * elastic * elastic * work[4, k]
        sliding = m.friction * load * _friction_sign(m, work[5, k])
        arm = m.start_curvature + min(max(work[5, k], 0.0), m.path)
        friction += sliding
        moment_p -= sliding * arm
        moment_w += sliding * (m.tangent_length - arm)
    if not m.consistent:
        along = 0.0
    return normal, friction, moment_p, moment_w, along, stored, lost


@_inlined
def _paper_law(m, table, pinion_row, wheel_row, roll, approach, rate, work):
    """F = k(t) delta + c_m delta': two-sided, no gap, pairs in and out over one integration step."""
    newest = int(np.floor(roll / m.pitch)) + 1
    stiffness = 0.0
    work[LOADED, 0] = 0.0
    for k in range(N_PAIRS):
        pair = newest - k
        position = roll - pair * m.pitch
        row_p = pinion_row[(pair + m.start_pinion) % len(pinion_row)]
        row_w = wheel_row[(pair + m.start_wheel) % len(wheel_row)]
        inside = min(position, m.path - position) / m.switch_half_width
        share = min(max(0.5 * (1.0 + inside), 0.0), 1.0)
        work[0, k] = 0.0
        work[4, k] = position
        work[LOADED, 0] += (share > 0.0) + (share == 1.0)
        if share > 0.0 and row_p >= 0 and row_w >= 0:
            x = (position - FIRST_PITCH * m.pitch) * m.nodes_per_meter
            cell = min(max(int(x), 0), table.shape[1] - 2)
            work[0, k] = share / (_interpolate(table, row_p, row_w, cell, x - cell, 0) - m.shared)
        stiffness += work[0, k]
    together = stiffness / (1.0 + m.shared * stiffness)
    normal = together * approach + m.damping * rate
    friction, moment_p, moment_w = 0.0, 0.0, 0.0
    if stiffness > 0.0:
        for k in range(N_PAIRS):
            sliding = m.friction * normal * work[0, k] / stiffness * _friction_sign(m, work[4, k])
            arm = m.start_curvature + min(max(work[4, k], 0.0), m.path)
            friction += sliding
            moment_p -= sliding * arm
            moment_w += sliding * (m.tangent_length - arm)
    return normal, friction, moment_p, moment_w, 0.0, 0.5 * together * approach**2, m.damping * rate**2


@_inlined
def acceleration(
    inverse_mass, k_row, k_column, k_value, c_row, c_column, c_value, force,
    m, table, pinion_row, wheel_row, pinion_error, wheel_error, sound_wheel, time, q, v, a, work,
):  # fmt: skip
    """Fill ``a`` with q'' at one instant; returns the normal mesh force."""
    for i in range(len(q)):
        a[i] = force[i]
    for k in range(len(k_value)):
        a[k_row[k]] -= k_value[k] * q[k_column[k]]
    for k in range(len(c_value)):
        a[c_row[k]] -= c_value[k] * v[c_column[k]]
    pt, gt = m.pinion_rotation, m.wheel_rotation
    approach = m.pinion_radius * q[pt] - m.wheel_radius * q[gt]
    rate = m.pinion_radius * v[pt] - m.wheel_radius * v[gt]
    if m.pinion_y >= 0:
        approach -= q[m.pinion_y]
        rate -= v[m.pinion_y]
    if m.wheel_y >= 0:
        approach += q[m.wheel_y]
        rate += v[m.wheel_y]
    roll = m.start_roll + m.pinion_radius * (m.speed * time + q[pt])
    roll_rate = m.pinion_radius * (m.speed + v[pt])
    normal, friction, moment_p, moment_w, along, _, _ = mesh_law(
        m, table, pinion_row, wheel_row, pinion_error, wheel_error, sound_wheel, roll, approach, rate, roll_rate, work
    )
    a[pt] += m.pinion_radius * (along - normal) + moment_p
    a[gt] += m.wheel_radius * normal + moment_w
    if m.pinion_y >= 0:
        a[m.pinion_y] += normal
    if m.wheel_y >= 0:
        a[m.wheel_y] -= normal
    if m.pinion_x >= 0:
        a[m.pinion_x] += friction
    if m.wheel_x >= 0:
        a[m.wheel_x] -= friction
    for i in range(len(q)):
        a[i] *= inverse_mass[i]
    return normal


@_compiled
def integrate(system, mesh, q, v, step, first_step, n_steps, channels, out, scratch, work):
    """Advance q and v in place by ``n_steps`` of classical RK4.

    A step in which a pair takes up or lets go of its load is taken again in ``SUBSTEPS`` parts: the force has a kink
    there, which would otherwise set the accuracy of everything. ``out`` (channel, n_steps) takes the mean acceleration
    of the chosen degrees of freedom over each step (what the equations add to the velocity, over the step: kinks then
    alias far less than point values would); with no rows nothing is stored. Returns the number of steps without
    contact, and the step at which a value stopped being finite (-1 if none).
    """
    inverse_mass, k_row, k_column, k_value, c_row, c_column, c_value, force = system
    m, table, pinion_row, wheel_row, pinion_error, wheel_error, sound_wheel = mesh
    n_dof = len(q)
    a, trial_q, trial_v, sum_q, sum_v = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    store = out.shape[1] > 0
    n_lost = 0
    for n in range(n_steps):
        n_parts, part = 1, 0
        while part < n_parts:
            h = step / n_parts
            time = (first_step + n) * step + part * h
            for i in range(n_dof):
                trial_q[i], trial_v[i] = q[i], v[i]
                sum_q[i], sum_v[i] = 0.0, 0.0
            loaded, changed = 0.0, False
            for stage in range(4):
                ahead = h * (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5)
                normal = acceleration(
                    inverse_mass, k_row, k_column, k_value, c_row, c_column, c_value, force,
                    m, table, pinion_row, wheel_row, pinion_error, wheel_error, sound_wheel,
                    time + ahead, trial_q, trial_v, a, work,
                )  # fmt: skip
                if stage == 0:
                    loaded = work[LOADED, 0]
                    if n_parts == 1:
                        n_lost += normal == 0.0
                changed = changed or work[LOADED, 0] != loaded
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                reach = h * (1.0 if stage == 2 else 0.5)
                for i in range(n_dof):
                    sum_q[i] += weight * trial_v[i]
                    sum_v[i] += weight * a[i]
                    trial_q[i] = q[i] + reach * trial_v[i]
                    trial_v[i] = v[i] + reach * a[i]
            if changed and n_parts == 1:
                n_parts = SUBSTEPS
                continue
            if store:
                for c in range(len(channels)):
                    mean = sum_v[channels[c]] / (6.0 * n_parts)
                    out[c, n] = mean if part == 0 else out[c, n] + mean
            for i in range(n_dof):
                q[i] += h / 6.0 * sum_q[i]
                v[i] += h / 6.0 * sum_v[i]
            part += 1
        if not np.isfinite(v[n_dof - 1]):
            return n_lost, n
    return n_lost, -1


def work_arrays(n_dof):
    """Scratch of ``integrate``: (5, dof) and (7, pair)."""
    return np.empty((5, n_dof)), np.empty((LOADED + 1, N_PAIRS))
