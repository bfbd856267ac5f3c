"""The classical Runge-Kutta scheme on the mesh law of the compiled core: a plain reference.

The mesh law is evaluated four times a step, each time from tables read at that instant. A step
over a kink of the force is not repeated in parts, so that steps must be short.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from gensig.dynamics import _layout as layout
from gensig.dynamics._equations import (
    P_TURN,
    accelerate,
    motion,
    own_turn,
    set_out,
)
from gensig.dynamics._layout import AHEAD, BASE, EVEN, ROLL, Group, HelicalGroup
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._record_kernels import integrates
from gensig.dynamics._slots import near_pairs, write_mesh
from gensig.dynamics._tables import gather
from gensig.dynamics._vector import (
    at,
    compiled,
    get_row,
    inlined,
    n_lanes,
    set_row,
    spread,
    where_above,
    width,
)
from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.group_motions import integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.step_limits import settling_time
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import PairDynamics

UNLIMITED = 1e30  # N s/m: no damper of a pair is limited
ROUNDS = 20  # in which chords and the deflection they share converge
# Kutta (1901): node of every stage, and six times its weight
NODES = 0.0, 0.5, 0.5, 1.0
WEIGHTS = 1.0, 2.0, 2.0, 1.0
N_STAGES = 4
SETTLING = 16  # steps a sample of the settling

# rows behind those of the mesh: the law at a stage, the drive, and a row a degree of freedom each:
# state at the begin of the step and at a stage, q and then v, accelerations, sums, other forces
LAW = layout.N_MESH
DRIVE = LAW + layout.N_LAW
MACHINE = DRIVE + layout.N_DRIVE
BEGIN, STAGE, ACCELERATION, SUM_Q, SUM_V, FORCES, N_BLOCKS = 0, 2, 4, 5, 6, 7, 8


@inlined
def evaluate(group, approach, rate, roll_rate, rows, work, wide, near):
    """Write the mesh law at the roll ``wide[BASE]`` to ``rows`` of the scratch."""
    n = width(work)
    zero = spread(work, 0.0)
    far = spread(work, 2.0 * layout.FAR)
    for lane in range(n):
        near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
        wide[at(ROLL + EVEN, lane, n)] = wide[at(BASE, lane, n)]
    set_row(work, layout.WITHIN, approach if group.one_sided else far)
    set_row(work, AHEAD + EVEN, zero)
    set_row(work, layout.TOTAL, zero)
    set_row(work, layout.MOST_DAMPER, spread(work, UNLIMITED))
    set_row(work, layout.FLAGS, spread(work, 1.0))
    helical = layout.is_helical(group)
    for _ in range(ROUNDS):
        bent = get_row(group.numbers, layout.SHARED) * get_row(work, layout.TOTAL)
        set_row(work, layout.LOCAL, approach - bent)
        if not gather(group, EVEN, True, work, wide, near) and helical:
            break
        first, last = near_pairs(EVEN, n, near)
        law = mesh_law(
            group,
            first,
            last,
            EVEN,
            layout.MARGIN,
            zero,
            approach,
            rate,
            roll_rate,
            work,
            wide,
        )
        for row in range(layout.N_LAW):
            set_row(work, rows + row, law[row])
        if not helical:
            break


@compiled
def law_at(group, motion, work, wide, near, law_rows):
    """Every lane's law at one instant, to ``law_rows``.

    Rows of ``motion`` are roll, approach, its rate, the rate of the roll.
    """
    n = width(work)
    for lane in range(n):
        wide[at(BASE, lane, n)] = motion[at(0, lane, n)]
    approach, rate = get_row(motion, 1), get_row(motion, 2)
    evaluate(group, approach, rate, get_row(motion, 3), LAW, work, wide, near)
    for row in range(layout.N_LAW):
        set_row(law_rows, row, get_row(work, LAW + row))


@inlined
def rates(group, time, state, n_dof, work, wide, near):
    """Write the law and the accelerations of a state at a time."""
    q, v = state, state + n_dof
    forces = MACHINE + FORCES * n_dof
    set_out(group, time, q, DRIVE, forces, work, wide)
    approach, rate = motion(group, q, v, work)
    speed = get_row(work, DRIVE + layout.DRIVE_SPEED) + own_turn(group, v, work)
    roll_rate = get_row(group.numbers, layout.PINION_RADIUS) * speed
    evaluate(group, approach, rate, roll_rate, LAW, work, wide, near)
    law = layout.Law(
        get_row(work, LAW),
        get_row(work, LAW + 1),
        get_row(work, LAW + 2),
        get_row(work, LAW + 3),
        get_row(work, LAW + 4),
        get_row(work, LAW + 5),
        get_row(work, LAW + 6),
        get_row(work, LAW + 7),
    )
    torque = get_row(work, DRIVE + layout.DRIVE_TORQUE)
    a = MACHINE + ACCELERATION * n_dof
    accelerate(group, law, q, v, torque, forces, a, work)


@inlined
def observe(group, begin, row, seen, angle, work, wide, near):
    """Write the pinion's angle and the state of the mesh at the begin of a step."""
    n = width(work)
    for lane in range(n):
        turned = wide[at(layout.NOMINAL, lane, n)]
        angle[at(row, lane, n)] = turned + work[at(begin + P_TURN, lane, n)]
    if len(seen) > 0:
        write_mesh(seen, row, get_row(work, LAW), work, near)


@compiled
def integrate(
    group,
    state,
    lost,
    fresh,
    step,
    first_step,
    n_steps,
    channels,
    out,
    out_row,
    angle,
    angle_row,
    per_angle,
    seen,
    work,
    wide,
    near,
):
    """Advance every lane by some steps; arguments are those of all cores."""
    n = width(work)
    n_dof = len(group.force) // n
    zero, one = spread(work, 0.0), spread(work, 1.0)
    begin, stage_rows = MACHINE + BEGIN * n_dof, MACHINE + STAGE * n_dof
    a = MACHINE + ACCELERATION * n_dof
    sum_q, sum_v = MACHINE + SUM_Q * n_dof, MACHINE + SUM_V * n_dof
    for i in range(2 * n_dof):
        set_row(work, begin + i, get_row(state, i))
    for number in range(first_step, first_step + n_steps):
        for i in range(2 * n_dof):
            set_row(work, stage_rows + i, get_row(work, begin + i))
            set_row(work, sum_q + i, zero)
        gain = zero
        for stage in range(N_STAGES):
            time = (number + NODES[stage]) * step
            for k in range(layout.MOST_PAIRS):
                set_row(work, layout.PAIR_FORCE + k, zero)
            rates(group, time, stage_rows, n_dof, work, wide, near)
            if stage == 0:
                gain = get_row(work, DRIVE + layout.DRIVE_GAIN)
                normal = get_row(work, LAW)
                apart = where_above(normal * normal, zero, zero, one)
                set_row(lost, 0, get_row(lost, 0) + apart)
                if angle_row >= 0 and number % per_angle == 0:
                    observe(group, begin, angle_row, seen, angle, work, wide, near)
                    angle_row += 1
            weight = WEIGHTS[stage] / 6.0
            reach = step * NODES[min(stage + 1, N_STAGES - 1)]
            for d in range(n_dof):
                moved = get_row(work, stage_rows + n_dof + d)
                gained = get_row(work, a + d)
                set_row(work, sum_q + d, get_row(work, sum_q + d) + weight * moved)
                set_row(work, sum_v + d, get_row(work, sum_v + d) + weight * gained)
                at_q, at_v = get_row(work, begin + d), get_row(work, begin + n_dof + d)
                set_row(work, stage_rows + d, at_q + reach * moved)
                set_row(work, stage_rows + n_dof + d, at_v + reach * gained)
        for d in range(2 * n_dof):
            moved = step * get_row(work, sum_q + d)
            set_row(work, begin + d, get_row(work, begin + d) + moved)
        if out_row >= 0:
            row = (out_row + number - first_step) * len(channels)
            for c in range(len(channels)):
                carried = gain * get_row(group.rotation, channels[c])
                set_row(out, row + c, get_row(work, sum_v + channels[c]) + carried)
    for i in range(2 * n_dof):
        set_row(state, i, get_row(work, begin + i))
    return angle_row


integrates(integrate, Group, HelicalGroup)


def scratch(n_dof, n_channels, precision="float64"):
    """Work rows, float64 rows and integer rows of ``integrate`` and ``law_at``."""
    n = n_lanes(precision)
    near = np.zeros((layout.N_COUNTS, n), dtype=np.int64)
    work = np.zeros((MACHINE + N_BLOCKS * n_dof) * n, dtype=precision)
    return work, np.zeros(layout.N_WIDE * n), near.ravel()


CORE = Core(
    pack=pack,
    scratch=scratch,
    integrate=integrate,
    coarsest_oversampling=lambda machine, oversampling, rate: min(
        oversampling, SETTLING
    ),
    settling_time=settling_time,
)


@final
class Classical(Backend):
    """The scheme as a backend, which takes any step."""

    def check_step(
        self,
        machine: PairDynamics,
        sampling_rate: float,
        oversampling: int,
        max_error: float | None,
    ) -> None:
        """Refuse nothing."""

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[PairDynamics], integration: Integration
    ) -> Motions:
        """Motions of machines that have settled."""
        return integrate_machines(machines, integration, CORE)
