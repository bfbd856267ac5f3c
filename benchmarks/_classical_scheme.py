"""The classical Runge-Kutta scheme on the mesh law of the compiled core: a plain reference.

The mesh law is evaluated four times a step, each time from tables read at that instant. A step
over a kink of the force is not repeated in parts, so that steps must be short.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import AHEAD, BASE, EVEN, ROLL, is_helical
from gensig.dynamics._mesh_kernels import mesh_law
from gensig.dynamics._record_kernels import recorder
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
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._course import cell_at, set_forces, set_rolls
from gensig.dynamics.backends.nystroem._flat import number_at
from gensig.dynamics.backends.nystroem._group import (
    integer_rows,
    machine_rows,
    mesh_of,
    mesh_rows,
    of,
    scratch,
    wide_rows,
)
from gensig.dynamics.backends.nystroem._kernels import write_angles
from gensig.dynamics.backends.nystroem._meshes import (
    acceleration,
    couple,
    damp,
    govern,
    motion,
    own_pull,
    push,
    turning_speed,
)
from gensig.dynamics.backends.nystroem._slots import near_pairs, write_mesh
from gensig.dynamics.backends.nystroem.machine_lanes import pack
from gensig.dynamics.motion.dynamics import Dynamics

UNLIMITED = 1e30  # N s/m: no damper of a pair is limited
ROUNDS = 20  # in which chords and the deflection they share converge
# Kutta (1901): node of every stage, and six times its weight
NODES = 0.0, 0.5, 0.5, 1.0
WEIGHTS = 1.0, 2.0, 2.0, 1.0
N_STAGES = 4
SETTLING = 16  # steps a sample of the settling

# rows of a degree of freedom: state at the begin of the step, at a stage, and sums of its changes
BEGIN, STAGE = (rows.Q, rows.V), (rows.MIDDLE_Q, rows.MIDDLE_V)
SUMS = (rows.END_Q, rows.END_V)


@inlined
def evaluate(mesh, approach, rate, roll_rate, work, wide, near):
    """Law of a mesh at the roll ``wide[BASE]``, which the rows ``LAW`` take."""
    n = width(work)
    zero = spread(work, 0.0)
    far = spread(work, 2.0 * layout.FAR)
    for lane in range(n):
        near[at(layout.NEWEST, lane, n)] = layout.NO_PAIR
        wide[at(ROLL + EVEN, lane, n)] = wide[at(BASE, lane, n)]
    for k in range(layout.MOST_PAIRS):
        set_row(work, layout.PAIR_FORCE + k, zero)
    set_row(work, layout.WITHIN, approach if mesh.one_sided else far)
    set_row(work, AHEAD + EVEN, zero)
    set_row(work, layout.TOTAL, zero)
    set_row(work, layout.MOST_DAMPER, spread(work, UNLIMITED))
    set_row(work, layout.FLAGS, spread(work, 1.0))
    for _ in range(ROUNDS):
        bent = get_row(mesh.numbers, layout.SHARED) * get_row(work, layout.TOTAL)
        set_row(work, layout.LOCAL, approach - bent)
        if not gather(mesh, EVEN, True, work, wide, near) and is_helical(mesh):
            break
        first, last = near_pairs(EVEN, n, near)
        law = mesh_law(
            mesh,
            first,
            last,
            EVEN,
            zero,
            approach,
            rate,
            roll_rate,
            work,
            wide,
        )
        for row in range(layout.N_LAW):
            set_row(work, layout.LAW + row, law[row])
        if not is_helical(mesh):
            break
    return layout.Law(
        get_row(work, layout.LAW),
        get_row(work, layout.LAW + 1),
        get_row(work, layout.LAW + 2),
        get_row(work, layout.LAW + 3),
        get_row(work, layout.LAW + 4),
        get_row(work, layout.LAW + 5),
        get_row(work, layout.LAW + 6),
        get_row(work, layout.LAW + 7),
    )


@compiled
def law_at(group, motion, work, wide, near, law_rows):
    """Every lane's law of the first mesh at one instant, to ``law_rows``.

    Rows of ``motion`` are roll, approach, its rate, the rate of the roll.
    """
    n = width(work)
    for lane in range(n):
        wide[at(BASE, lane, n)] = motion[at(0, lane, n)]
    approach, rate, roll_rate = (
        get_row(motion, 1),
        get_row(motion, 2),
        get_row(motion, 3),
    )
    law = evaluate(mesh_of(group, 0, n), approach, rate, roll_rate, work, wide, near)
    for row in range(layout.N_LAW):
        set_row(law_rows, row, law[row])


@compiled
def pull(group, time, machine, work, wide, near):
    """Set the forces on the state of a stage at a time."""
    n, (q, v) = width(work), STAGE
    cell, since = cell_at(group, time, n)
    set_rolls(group, cell, since, q, machine, wide)
    set_forces(group, cell, since, machine, wide)
    for d in range(len(group.force) // n):
        own_pull(
            group,
            d,
            get_row(machine, of(q, d)),
            get_row(machine, of(v, d)),
            machine,
        )
    couple(group, q, v, machine)
    damp(group, v, machine)
    govern(group, q, v, machine)
    for m in range(group.n_meshes):
        mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
        approach, rate = motion(group, m, q, v, machine)
        speed = turning_speed(group, m, v, spread(work, 0.0), machine)
        roll_rate = get_row(mesh.numbers, layout.PINION_RADIUS) * speed
        own_wide, counts = wide_rows(wide, m, n), integer_rows(near, m, n)
        law = evaluate(mesh, approach, rate, roll_rate, own, own_wide, counts)
        set_row(own, rows.NORMAL, law.normal)
        push(group, m, law, machine)


@inlined
def observe(group, row, seen, angle, machine, work, wide, near):
    """Write the angles of a group and the state of its meshes at the begin of a step."""
    n = width(work)
    write_angles(group, angle, row, machine, wide)
    if len(seen) > 0:
        for m in range(group.n_meshes):
            own, counts = mesh_rows(work, m, n), integer_rows(near, m, n)
            normal = get_row(own, rows.NORMAL)
            write_mesh(seen, row * group.n_meshes + m, normal, own, counts)


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
    machine = machine_rows(work, group.n_meshes, n)
    zero, one = spread(work, 0.0), spread(work, 1.0)
    (begin_q, begin_v), (q, v), (sum_q, sum_v) = BEGIN, STAGE, SUMS
    for d in range(n_dof):
        set_row(machine, of(begin_q, d), get_row(state, d))
        set_row(machine, of(begin_v, d), get_row(state, n_dof + d))
    for number in range(first_step, first_step + n_steps):
        for d in range(n_dof):
            set_row(machine, of(q, d), get_row(machine, of(begin_q, d)))
            set_row(machine, of(v, d), get_row(machine, of(begin_v, d)))
            set_row(machine, of(sum_q, d), zero)
            set_row(machine, of(sum_v, d), zero)
        gain = zero
        for stage in range(N_STAGES):
            time = (number + NODES[stage]) * step
            pull(group, time, machine, work, wide, near)
            if stage == 0:
                gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
                for m in range(group.n_meshes):
                    normal = get_row(mesh_rows(work, m, n), rows.NORMAL)
                    apart = where_above(normal * normal, zero, zero, one)
                    set_row(lost, m, get_row(lost, m) + apart)
                if angle_row >= 0 and number % per_angle == 0:
                    observe(group, angle_row, seen, angle, machine, work, wide, near)
                    angle_row += 1
            weight = WEIGHTS[stage] / 6.0
            reach = step * NODES[min(stage + 1, N_STAGES - 1)]
            for d in range(n_dof):
                moved = get_row(machine, of(v, d))
                gained = acceleration(group, d, machine)
                total = get_row(machine, of(sum_q, d)) + weight * moved
                set_row(machine, of(sum_q, d), total)
                total = get_row(machine, of(sum_v, d)) + weight * gained
                set_row(machine, of(sum_v, d), total)
                place = get_row(machine, of(begin_q, d)) + reach * moved
                set_row(machine, of(q, d), place)
                rate = get_row(machine, of(begin_v, d)) + reach * gained
                set_row(machine, of(v, d), rate)
        for d in range(n_dof):
            moved = step * get_row(machine, of(sum_q, d))
            moved = get_row(machine, of(begin_q, d)) + moved
            set_row(machine, of(begin_q, d), moved)
            gained = step * get_row(machine, of(sum_v, d))
            gained = get_row(machine, of(begin_v, d)) + gained
            set_row(machine, of(begin_v, d), gained)
        if out_row >= 0:
            row = (out_row + number - first_step) * len(channels)
            for c in range(len(channels)):
                d = number_at(channels, c)
                carried = gain * get_row(group.rotation, d)
                set_row(out, row + c, get_row(machine, of(sum_v, d)) + carried)
    for d in range(n_dof):
        set_row(state, d, get_row(machine, of(begin_q, d)))
        set_row(state, n_dof + d, get_row(machine, of(begin_v, d)))
    return angle_row


CORE = Core(
    pack=pack,
    scratch=scratch,
    integrate=integrate,
    record=recorder(integrate),
    coarsest_oversampling=lambda machine, oversampling, rate: min(
        oversampling, SETTLING
    ),
)


@final
class Classical(Backend):
    """The scheme as a backend, which takes any step."""

    def check_step(
        self,
        machine: Dynamics,
        sampling_rate: float,
        oversampling: int,
    ) -> None:
        """Refuse nothing."""

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[Dynamics], integration: Integration
    ) -> Motions:
        """Motions of machines that have settled."""
        return integrate_machines(machines, integration, CORE)
