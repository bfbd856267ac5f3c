"""The peer of the compiled core: the same law of the gear mesh and classical RK4 as one would
write them in Numba.

One record, one number at a time, every table read at every stage, no step taken twice. The
symbols are those of ``docs/theory/motion.md``. Constant speed, drive flanks, and the six
degrees of freedom of a pair only.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks._mesh_numbers import MeshNumbers, mesh_numbers
from gensig.dynamics.pair import RunningPair
from gensig.mesh.pair_table import FIRST_PITCH, N_PAIRS
from gensig.mesh.tooth_table import GearTeeth

Array = NDArray[np.float64]

N_DOF = 6
BITE, STIFFNESS, OWN_SLOPE, GAP_SLOPE, POSITION, N_KEPT = range(6)  # of one pair
_compiled: Any = functools.partial(njit, cache=True, error_model="numpy")()


class Machine(NamedTuple):
    """One record's machine.

    ``table`` is (pinion kind, wheel kind, node, [c, c', g, g']), kinds are -1 for no tooth.
    """

    mesh: MeshNumbers
    pinion_kind: NDArray[np.int64]
    wheel_kind: NDArray[np.int64]
    pinion_error: Array
    wheel_error: Array
    pinion_tilt: Array
    wheel_tilt: Array
    table: Array
    inverse_mass: Array
    stiffness: Array
    damper: Array
    force: Array


def machine(running: RunningPair) -> Machine:
    """The numbers of one machine of six degrees of freedom."""
    table, system = running.table, running.equations
    if len(system.mass) != N_DOF:
        raise ValueError(
            f"{len(system.mass)} degrees of freedom; {N_DOF} are written out here"
        )
    return Machine(
        mesh=mesh_numbers(running),
        pinion_kind=_kinds(table.pinion),
        wheel_kind=_kinds(table.wheel),
        pinion_error=running.teeth.errors[0],
        wheel_error=running.teeth.errors[1],
        pinion_tilt=running.teeth.tilts[0],
        wheel_tilt=running.teeth.tilts[1],
        table=np.stack(table.pairs, axis=-1)[:, :, 0],
        inverse_mass=1.0 / system.mass,
        stiffness=np.diag(system.governed_stiffness).copy(),
        damper=np.diag(system.governed_damping).copy(),
        force=running.dynamics.forces(np.zeros(1))[0],
    )


def _kinds(teeth: GearTeeth) -> NDArray[np.int64]:
    return np.where(teeth.present[teeth.kind], teeth.kind, -1)


@_compiled
def accelerations(m, time, q, v, work, a):
    """Fill ``a`` (dof,) with q'' at one instant; ``work`` is (pair, 5). Returns the approach."""
    mesh = m.mesh
    roll = mesh.start_roll + mesh.pinion_radius * (mesh.speed * time + q[2])
    roll_rate = mesh.pinion_radius * (mesh.speed + v[2])
    approach = mesh.pinion_radius * q[2] - mesh.wheel_radius * q[5] - q[1] + q[4]
    rate = mesh.pinion_radius * v[2] - mesh.wheel_radius * v[5] - v[1] + v[4]
    newest = int(np.floor(roll / mesh.pitch)) + 1
    newest_p = (newest + mesh.start_pinion) % len(m.pinion_kind)
    newest_w = (newest + mesh.start_wheel) % len(m.wheel_kind)
    first, last = N_PAIRS, 0
    for k in range(N_PAIRS):
        work[k, BITE] = 0.0
        tooth_p = newest_p - k if newest_p >= k else newest_p - k + len(m.pinion_kind)
        tooth_w = newest_w - k if newest_w >= k else newest_w - k + len(m.wheel_kind)
        kind_p, kind_w = m.pinion_kind[tooth_p], m.wheel_kind[tooth_w]
        if kind_p < 0 or kind_w < 0 or approach < -0.5 * mesh.backlash:
            continue
        position = roll - (newest - k) * mesh.pitch
        x = (position - FIRST_PITCH * mesh.pitch) * mesh.nodes_per_meter
        cell = min(max(int(x), 0), m.table.shape[2] - 2)
        part = x - cell
        # slopes go straight between the nodes, values follow their integral
        bend = 0.5 * part * (1.0 - part) / mesh.nodes_per_meter
        low, step = (
            m.table[kind_p, kind_w, cell, 3],
            m.table[kind_p, kind_w, cell + 1, 3],
        )
        step -= low
        tilt = m.pinion_tilt[tooth_p] + m.wheel_tilt[tooth_w]
        gap_slope = low + part * step + tilt
        gap = m.table[kind_p, kind_w, cell, 2]
        gap += (
            part * (m.table[kind_p, kind_w, cell + 1, 2] - gap)
            - bend * step
            + tilt * (position - mesh.pitch_point)
        )
        bite = approach - gap - m.pinion_error[tooth_p] - m.wheel_error[tooth_w]
        if bite > 0.0:
            first, last = min(first, k), k + 1
            low, step = (
                m.table[kind_p, kind_w, cell, 1],
                m.table[kind_p, kind_w, cell + 1, 1],
            )
            step -= low
            work[k, OWN_SLOPE], work[k, GAP_SLOPE] = low + part * step, gap_slope
            own = m.table[kind_p, kind_w, cell, 0]
            own += (
                part * (m.table[kind_p, kind_w, cell + 1, 0] - own)
                - bend * step
                - mesh.shared
            )
            work[k, BITE], work[k, POSITION], work[k, STIFFNESS] = (
                bite,
                position,
                1.0 / own,
            )
    total, lifted = 0.0, True
    while lifted:  # pairs that the deflection of the bodies lifts off
        stiffness, force, lifted = 0.0, 0.0, False
        for k in range(first, last):
            if work[k, BITE] > 0.0:
                stiffness += work[k, STIFFNESS]
                force += work[k, BITE] * work[k, STIFFNESS]
        total = force / (1.0 + mesh.shared * stiffness)
        for k in range(first, last):
            if 0.0 < work[k, BITE] <= mesh.shared * total:
                work[k, BITE], lifted = 0.0, True
    normal, friction, moment_p, moment_w, along = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(first, last):
        if work[k, BITE] <= 0.0:
            continue
        slope, position = work[k, GAP_SLOPE], work[k, POSITION]
        elastic = (work[k, BITE] - mesh.shared * total) * work[k, STIFFNESS]
        load = max(0.0, elastic * (1.0 + mesh.damping * (rate - slope * roll_rate)))
        normal += load
        along += load * slope + 0.5 * elastic * elastic * work[k, OWN_SLOPE]
        side = min(
            max((position - mesh.pitch_point) / mesh.friction_half_width, -1.0), 1.0
        )
        sliding = mesh.friction * load * side * (1.5 - 0.5 * side * side)
        arm = mesh.start_curvature + min(max(position, 0.0), mesh.path)
        friction += sliding
        moment_p -= sliding * arm
        moment_w += sliding * (mesh.tangent_length - arm)
    a[0], a[1], a[2] = (
        friction,
        normal,
        moment_p - mesh.pinion_radius * (normal - mesh.consistent * along),
    )
    a[3], a[4], a[5] = -friction, -normal, moment_w + mesh.wheel_radius * normal
    for i in range(N_DOF):
        a[i] = (
            a[i] + m.force[i] - m.stiffness[i] * q[i] - m.damper[i] * v[i]
        ) * m.inverse_mass[i]
    return approach


@_compiled
def integrate(m, state, step, first_step, n_steps, channels, means):
    """Advance ``state`` (2, dof) by classical RK4; ``means`` (step, channel) takes the mean
    acceleration of each step.

    Returns the lowest approach.
    """
    work, a = np.zeros((N_PAIRS, N_KEPT)), np.empty(N_DOF)
    q, v = state[0], state[1]
    q_now, v_now, q_sum, v_sum = (
        np.empty(N_DOF),
        np.empty(N_DOF),
        np.empty(N_DOF),
        np.empty(N_DOF),
    )
    lowest = np.inf
    for n in range(n_steps):
        time = (first_step + n) * step
        q_now[:], v_now[:], q_sum[:], v_sum[:] = q, v, 0.0, 0.0
        for stage in range(4):
            ahead = 0.0 if stage == 0 else step if stage == 3 else 0.5 * step
            lowest = min(lowest, accelerations(m, time + ahead, q_now, v_now, work, a))
            weight, reach = (
                1.0 if stage == 0 or stage == 3 else 2.0,
                step if stage == 2 else 0.5 * step,
            )
            for i in range(N_DOF):
                q_sum[i] += weight * v_now[i]
                v_sum[i] += weight * a[i]
                q_now[i], v_now[i] = q[i] + reach * v_now[i], v[i] + reach * a[i]
        for i in range(N_DOF):
            q[i] += step / 6.0 * q_sum[i]
            v[i] += step / 6.0 * v_sum[i]
        for c in range(len(channels)):
            means[n, c] = v_sum[channels[c]] / 6.0
    return lowest


def right_hand_side(m: Machine) -> Callable[[float, Array], Array]:
    """Derivative of (q, v), (12,), compiled with the machine in it.

    Nothing but the state is passed at a call.
    """

    @njit(error_model="numpy")
    def slope(time, state):
        rates = np.empty(2 * N_DOF)
        rates[:N_DOF] = state[N_DOF:]
        accelerations(
            m,
            time,
            state[:N_DOF],
            state[N_DOF:],
            np.empty((N_PAIRS, N_KEPT)),
            rates[N_DOF:],
        )
        return rates

    return slope
