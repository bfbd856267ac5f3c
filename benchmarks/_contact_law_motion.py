"""A reference integrator of the spur pair whose contact compliance follows each pair's own present
load.

The equations and the names are those of ``gensig.dynamics``; only the mesh law differs. It is
told the compliance of a pair at several loads and takes it linear in ln(load) between and
beyond them, which is exact for a sound flank. Given the same compliance at every load it is
gensig's own law.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks._mesh_numbers import MeshNumbers
from gensig.dynamics.pair import RunningPair
from gensig.mesh.pair_table import FIRST_PITCH, N_PAIRS
from gensig.mesh.tooth_table import ToothTable

Array = NDArray[np.float64]

KIND, POSITION, BITE, LOAD, TOTAL = range(5)  # rows of a mesh law's scratch
TOLERANCE, MOST_ROUNDS = 1e-13, 60  # of Newton's method, relative to the load
N_DOF, PINION_Y = 6, 1
SUBSTEPS = 8  # of a step in which a pair takes up or lets go of its load
_compiled: Any = functools.partial(njit, cache=True, error_model="numpy")()


class Mesh(NamedTuple):
    """Law of a pinion tooth with a sound wheel tooth, by the kind of the pinion tooth.

    ``compliance`` and ``slope``, its change over position, are (kind, load, node), without the
    part that all pairs
    share; ``gap`` and ``gap_slope`` are (kind, 1, node); ``kind`` (tooth,) is -1 for a missing
    tooth. The loads lie
    evenly in their logarithm, ``per_log`` of them to one.
    """

    compliance: Array
    slope: Array
    gap: Array
    gap_slope: Array
    kind: NDArray[np.int64]
    first_log: float
    per_log: float


def mesh_at_loads(table: ToothTable, loads: Array) -> Mesh:
    """One table of gensig at loads, (load,) N in geometric progression; the wheel must be sound."""
    pinion, logs, n_loads = table.pinion, np.log(loads), len(loads)
    # the one kind of the wheel; the chord takes the place of the load
    compliance, slope, gap, gap_slope = (column[:, 0] for column in table.pairs)
    return Mesh(
        compliance=np.repeat(compliance - table.shared_compliance, n_loads, axis=1),
        slope=np.repeat(slope, n_loads, axis=1),
        gap=gap,
        gap_slope=gap_slope,
        kind=np.where(pinion.present[pinion.kind], pinion.kind, -1),
        first_log=float(logs[0]),
        per_log=float((n_loads - 1) / (logs[-1] - logs[0])),
    )


@_compiled
def _between(table, kind, j, x):
    """Linear between the nodes of one row of a table (kind, load, node)."""
    cell = min(max(int(x), 0), table.shape[2] - 2)
    return table[kind, j, cell] + (x - cell) * (
        table[kind, j, cell + 1] - table[kind, j, cell]
    )


@_compiled
def _bent(table, slope, kind, j, x, per_meter):
    """A value between the nodes of one row.

    Slopes go straight there, values follow their integral.
    """
    cell = min(max(int(x), 0), table.shape[2] - 2)
    part = x - cell
    bend = (
        0.5
        * part
        * (1.0 - part)
        / per_meter
        * (slope[kind, j, cell + 1] - slope[kind, j, cell])
    )
    return (
        table[kind, j, cell]
        + part * (table[kind, j, cell + 1] - table[kind, j, cell])
        - bend
    )


@_compiled
def _cell_of_load(load, mesh):
    """Row of loads below a load, and how far the load is from there to the next."""
    y = (np.log(load) - mesh.first_log) * mesh.per_log
    j = min(max(int(y), 0), mesh.compliance.shape[1] - 2)
    return j, y - j


@_compiled
def _compliance(mesh, kind, x, load, per_meter):
    """Compliance of a pair under a load, and its derivative by ln(load)."""
    j, part = _cell_of_load(load, mesh)
    low = _bent(mesh.compliance, mesh.slope, kind, j, x, per_meter)
    high = _bent(mesh.compliance, mesh.slope, kind, j + 1, x, per_meter)
    return low + part * (high - low), (high - low) * mesh.per_log


@_compiled
def _slope(mesh, kind, x, load):
    """Change of the compliance over position under a load, and its derivative by ln(load)."""
    j, part = _cell_of_load(load, mesh)
    low, high = _between(mesh.slope, kind, j, x), _between(mesh.slope, kind, j + 1, x)
    return low + part * (high - low), (high - low) * mesh.per_log


@_compiled
def _pair_load(mesh, kind, x, bite, guess, per_meter):
    """Load at which compliance(load) load = bite, and the tangent stiffness there."""
    load = guess if guess > 0.0 else bite / _between(mesh.compliance, kind, 0, x)
    own, growth = 0.0, 0.0
    for _ in range(MOST_ROUNDS):
        own, growth = _compliance(mesh, kind, x, load, per_meter)
        change = (bite - own * load) / (own + growth)
        load = max(load + change, 0.1 * load)
        if abs(change) <= TOLERANCE * load:
            break
    return load, 1.0 / (own + growth)


@_compiled
def share_load(mesh, m, roll, approach, work):
    """Loads of all pairs at an approach: gap + own deflection + what the bodies share = approach,
    load >= 0.

    Fills ``work`` (5, pair), begins with the loads that it finds there, and returns the total
    load and the tangent
    stiffness d(load)/d(approach).
    """
    newest = int(np.floor(roll / m.pitch)) + 1
    for k in range(N_PAIRS):
        kind = mesh.kind[(newest - k + m.start_pinion) % len(mesh.kind)]
        position = roll - (newest - k) * m.pitch
        work[KIND, k], work[POSITION, k], work[BITE, k] = kind, position, -np.inf
        if kind >= 0:
            x = (position - FIRST_PITCH * m.pitch) * m.nodes_per_meter
            work[BITE, k] = approach - _bent(
                mesh.gap, mesh.gap_slope, kind, 0, x, m.nodes_per_meter
            )
    total, stiffness = work[TOTAL, 0], 0.0
    for _ in range(MOST_ROUNDS):
        force, stiffness = 0.0, 0.0
        for k in range(N_PAIRS):
            bite = work[BITE, k] - m.shared * total
            if bite <= 0.0:
                work[LOAD, k] = 0.0
                continue
            x = (work[POSITION, k] - FIRST_PITCH * m.pitch) * m.nodes_per_meter
            work[LOAD, k], tangent = _pair_load(
                mesh, int(work[KIND, k]), x, bite, work[LOAD, k], m.nodes_per_meter
            )
            force += work[LOAD, k]
            stiffness += tangent
        change = (force - total) / (1.0 + m.shared * stiffness)
        total = max(total + change, 0.0)
        if abs(change) <= TOLERANCE * total:
            break
    work[TOTAL, 0] = total
    return total, stiffness / (1.0 + m.shared * stiffness)


@_compiled
def static_approach(mesh, m, roll, force, highest, approach, stiffness):
    """Approach and tangent stiffness, (phase,) m and N/m, under a static force at each roll, from
    above.
    """
    work = np.zeros((5, N_PAIRS))
    for i in range(len(roll)):
        approach[i] = highest
        for _ in range(MOST_ROUNDS):
            total, stiffness[i] = share_load(mesh, m, roll[i], approach[i], work)
            change = (force - total) / stiffness[i]
            approach[i] += change
            if abs(change) <= TOLERANCE * highest:
                break


@_compiled
def _rates(mesh, m, direction, mass, spring, damper, force, time, state, work):
    """Derivative of (q, v), the approach, and the number of pairs that bear load."""
    q, v = state[:N_DOF], state[N_DOF:]
    approach, approach_rate = 0.0, 0.0
    for i in range(N_DOF):
        approach += direction[i] * q[i]
        approach_rate += direction[i] * v[i]
    roll = m.start_roll + m.pinion_radius * (m.speed * time + q[2])
    roll_rate = m.pinion_radius * (m.speed + v[2])
    share_load(mesh, m, roll, approach, work)
    normal, friction, moment_p, moment_w, along, n_loaded = 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for k in range(N_PAIRS):
        elastic, position, kind = work[LOAD, k], work[POSITION, k], int(work[KIND, k])
        if elastic <= 0.0:
            continue
        x = (position - FIRST_PITCH * m.pitch) * m.nodes_per_meter
        gap_slope = _between(mesh.gap_slope, kind, 0, x)
        # the slope of the energy, the integral of compliance(load) load over load, is what work
        # balance asks for
        slope, growth = _slope(mesh, kind, x, elastic)
        load = max(
            0.0, elastic * (1.0 + m.damping * (approach_rate - gap_slope * roll_rate))
        )
        normal += load
        n_loaded += load > 0.0
        along += load * gap_slope + elastic**2 * (0.5 * slope - 0.25 * growth)
        side = min(max((position - m.pitch_point) / m.friction_half_width, -1.0), 1.0)
        sliding = m.friction * load * side * (1.5 - 0.5 * side**2)
        arm = m.start_curvature + min(max(position, 0.0), m.path)
        friction += sliding
        moment_p -= sliding * arm
        moment_w += sliding * (m.tangent_length - arm)
    rates = np.empty(2 * N_DOF)
    for i in range(N_DOF):
        rates[i] = v[i]
        rates[N_DOF + i] = (
            force[i] - spring[i] * q[i] - damper[i] * v[i] - direction[i] * normal
        )
    rates[N_DOF] += friction
    rates[N_DOF + 3] -= friction
    rates[N_DOF + 2] += moment_p + m.consistent * m.pinion_radius * along
    rates[N_DOF + 5] += moment_w
    rates[N_DOF:] /= mass
    return rates, approach, n_loaded


@_compiled
def _integrate(
    mesh, m, direction, mass, spring, damper, force, state, step, first_step, velocity
):
    """Classical RK4; a step in which a tooth pair gains or loses contact is repeated in parts.

    Fills ``velocity`` and returns the lowest approach.
    """
    work = np.zeros((5, N_PAIRS))
    velocity[0] = state[N_DOF + PINION_Y]
    lowest = np.inf
    for n in range(len(velocity) - 1):
        n_parts, part = 1, 0
        while part < n_parts:
            h = step / n_parts
            time = (first_step + n) * step + part * h
            total, trial = np.zeros(2 * N_DOF), state
            loaded, changed = 0, False
            for stage in range(4):
                ahead = h * (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5)
                rates, approach, bearing = _rates(
                    mesh,
                    m,
                    direction,
                    mass,
                    spring,
                    damper,
                    force,
                    time + ahead,
                    trial,
                    work,
                )
                if stage == 0:
                    loaded = bearing
                    lowest = min(lowest, approach)
                changed = changed or bearing != loaded
                total += rates * (1.0 if stage == 0 or stage == 3 else 2.0)
                trial = state + rates * (h * (1.0 if stage == 2 else 0.5))
            if changed and n_parts == 1:
                n_parts = SUBSTEPS
                continue
            state = state + total * (h / 6.0)
            part += 1
        velocity[n + 1] = state[N_DOF + PINION_Y]
    return lowest


def motion(
    mesh: Mesh,
    numbers: MeshNumbers,
    running: RunningPair,
    start: Array,
    *,
    step: float,
    first_step: int,
    n_steps: int,
) -> Array:
    """Velocity of the pinion along the line of action after every step, (step + 1,) m/s.

    Begins with the deflections ``start``, (dof,), at rest against the nominal rotation.

    Raises where a back flank would be reached, which has no law here.
    """
    velocity = np.empty(n_steps + 1)
    state = np.concatenate([start, np.zeros_like(start)])
    system = running.equations
    spring = np.diag(system.governed_stiffness).copy()
    damper = np.diag(system.governed_damping).copy()
    lowest = _integrate(
        mesh,
        numbers,
        running.approach_direction(),
        system.mass,
        spring,
        damper,
        running.dynamics.forces(np.zeros(1))[0],
        state,
        step,
        first_step,
        velocity,
    )
    if not lowest > -numbers.backlash:
        raise ValueError(
            f"the approach fell to {lowest:.3g} m, through the backlash of {numbers.backlash:.3g} m"
        )
    return velocity
