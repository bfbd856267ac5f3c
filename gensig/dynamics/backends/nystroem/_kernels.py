"""Two-evaluation core: fixed steps of a method of Nystroem, several records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or
reorders sums: a record's bits depend on nothing but its own numbers. Arrays are flat; a row holds
one number for every record of the group. The machine is here, in loops over meshes and degrees of
freedom. What a mesh reads, how it pushes and what its kinks miss are functions that
``integrator`` takes: of ``_spur_meshes`` and of ``_any_law_meshes``.
"""

from __future__ import annotations

from typing import Any

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import EVEN, ODD
from gensig.dynamics._vector import (
    EIGHT,
    at,
    compiled,
    get_row,
    inlined,
    load_wide,
    set_row,
    spread,
    store,
    where_above,
    width,
)
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._course import (
    drive,
    profile_rows,
    set_forces,
    set_rolls,
)
from gensig.dynamics.backends.nystroem._flat import number_at
from gensig.dynamics.backends.nystroem._group import (
    machine_rows,
    mesh_of,
    mesh_rows,
    meshes_of,
    of,
)
from gensig.dynamics.backends.nystroem._meshes import (
    acceleration,
    choose,
    couple,
    damp,
    govern,
    mesh_mobility,
    own_pull,
)
from gensig.dynamics.backends.nystroem._motion import (
    DAMPER_SHARE,
    conclude,
    predict,
    to_middle,
)

RECENTER = 256  # steps between two removals of the drift of the rotations, to keep numbers small


def integrator(
    *,
    begin_mesh: Any,
    start_mesh: Any,
    write_mesh: Any,
    read_mesh: Any,
    push_middle: Any,
    push_end: Any,
    end_mesh: Any,
    keep_mesh: Any,
) -> Any:
    """The core of machines whose meshes have one law.

    Each function is one of compiled code, for one mesh: at the begin of a call, at the start of
    its fresh lanes, for the output, at the begin of a step, in its middle, at its end, after it,
    and at the end of a call.
    """

    @compiled
    def start(group, slot, fresh, by_tooth, time, work, wide, near):
        """Set what the step remembers in the lanes that are fresh, from one evaluation there."""
        n = width(work)
        machine = machine_rows(work, meshes_of(group), n)
        pull_at_begin(group, time, machine, wide)
        for m in range(meshes_of(group)):
            start_mesh(group, m, slot, fresh, by_tooth, machine, work, wide, near)
        for lane in range(n):
            machine[at(rows.FRESH, lane, n)] = fresh[lane]
        accelerate_fresh(group, get_row(machine, rows.FRESH), machine)

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
        """Advance every lane by ``n_steps``; parameters are those of ``_record_kernels.integrate``.

        ``lost`` has one row for every mesh. ``angle`` takes as many rows a sample as the group has
        angles, ``seen`` the rows of every mesh.
        """
        n = width(work)
        n_dof, n_meshes = len(group.force) // n, meshes_of(group)
        n_channels = len(channels) if out_row >= 0 else 0
        machine = machine_rows(work, n_meshes, n)
        begin(group, step, state, work)
        starting, by_tooth = is_any_fresh(fresh, n), has_teeth_apart(group, n)
        slot, next_slot = EVEN, ODD
        for number in range(first_step, first_step + n_steps):
            begin_step(group, number, number == first_step, step, machine, wide)
            if number == first_step:
                for m in range(n_meshes):
                    begin_mesh(group, m, slot, fresh, step, machine, work, wide, near)
                if starting:
                    time = number * step
                    start(group, slot, fresh, by_tooth, time, work, wide, near)
            if angle_row >= 0 and number % per_angle == 0:
                write_angles(group, angle, angle_row, machine, wide)
                if len(seen) > 0:
                    for m in range(n_meshes):
                        seen_row = angle_row * n_meshes + m
                        write_mesh(group, m, seen, seen_row, work, wide, near)
                angle_row += 1
            for m in range(n_meshes):
                count_lost(lost, m, mesh_rows(work, m, n))
                read_mesh(
                    group, m, slot, next_slot, step, by_tooth, machine, work, wide, near
                )
            for d in range(n_dof):
                moved, rate = to_middle(d, step, machine)
                own_pull(group, d, moved, rate, machine)
            couple(group, rows.MIDDLE_Q, rows.MIDDLE_V, machine)
            if len(group.damper_other) > 0:
                damp(group, rows.MIDDLE_V, machine)
            govern(group, rows.MIDDLE_Q, rows.MIDDLE_V, machine)
            if len(group.sources) > 0:
                drive(group, number * step, 0.5 * step, rows.MIDDLE_Q, machine, wide)
            for m in range(n_meshes):
                push_middle(group, m, step, machine, work, wide, near)
            for d in range(n_dof):
                a = acceleration(group, d, machine)
                moved, rate = predict(d, a, step, machine)
                own_pull(group, d, moved, rate, machine)
            couple(group, rows.END_Q, rows.END_V, machine)
            if len(group.damper_other) > 0:
                damp(group, rows.END_V, machine)
            govern(group, rows.END_Q, rows.END_V, machine)
            if len(group.sources) > 0:
                drive(group, number * step, step, rows.END_Q, machine, wide)
            for m in range(n_meshes):
                push_end(group, m, next_slot, step, machine, work, wide, near)
            for d in range(n_dof):
                a = acceleration(group, d, machine)
                conclude(d, a, step, machine)
            for m in range(n_meshes):
                end_mesh(group, m, next_slot, step, machine, work, near)
            out_first = (out_row + number - first_step) * n_channels
            write_means(group, channels, n_channels, out, out_first, machine)
            slot, next_slot = next_slot, slot
        if slot == ODD:
            for m in range(n_meshes):
                keep_mesh(m, work, wide, near)
        end(group, state, machine)
        return angle_row

    return integrate


@inlined
def has_teeth_apart(group, n):
    """True if a mesh of any lane stores its teeth one by one."""
    by_tooth = False
    for lane in range(n):
        for m in range(meshes_of(group)):
            wheel_rows = at(m * layout.N_INDICES + layout.WHEEL_ROWS, lane, n)
            by_tooth = by_tooth or group.indices[wheel_rows] > 0
    return by_tooth


@inlined
def count_lost(lost, m, own):
    """Count a step in which a mesh has no contact."""
    zero, one = spread(own, 0.0), spread(own, 1.0)
    normal = get_row(own, rows.NORMAL)
    apart = where_above(normal * normal, zero, zero, one)
    set_row(lost, m, get_row(lost, m) + apart)


@inlined
def begin(group, step, state, work):
    """Set the rows that stay as they are, and those of the state."""
    n = width(work)
    n_dof, n_meshes = len(group.force) // n, meshes_of(group)
    machine = machine_rows(work, n_meshes, n)
    for d in range(n_dof):
        set_row(machine, of(rows.Q, d), get_row(state, d))
        set_row(machine, of(rows.V, d), get_row(state, n_dof + d))
    for m in range(n_meshes):
        mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
        turn = 1.0 / get_row(mesh.numbers, layout.PER_FRICTION_WIDTH)
        set_row(own, rows.FRICTION_WIDTH, turn)
        most = DAMPER_SHARE / (step * mesh_mobility(group, m, work))
        set_row(own, layout.MOST_DAMPER, most)
        for lane in range(n):
            own[at(rows.BEND, lane, n)] = mesh.bend[lane * layout.COLUMNS]


@inlined
def is_any_fresh(fresh, n):
    """True if any lane starts anew."""
    starting = False
    for lane in range(n):
        starting = starting or fresh[lane] > 0.0
    return starting


@inlined
def begin_step(group, number, is_first, step, machine, wide):
    """Set rolls and forces at the begin of a step, ``is_first`` of its call."""
    n = width(machine)
    is_recentred = number % RECENTER == 0
    if is_recentred:
        recenter(group, machine, wide)
    set_rolls(group, number * step, rows.Q, machine, wide)
    is_changing = len(group.profile) > profile_rows(group, n) * n
    if is_changing or is_recentred or is_first:
        set_forces(group, number * step, machine, wide)


@inlined
def write_means(group, channels, n_channels, out, first, machine):
    """Write the mean accelerations of a step to rows from ``first`` on."""
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    for c in range(n_channels):
        d = number_at(channels, c)
        carried = gain * get_row(group.rotation, d)
        set_row(out, first + c, get_row(machine, of(rows.MEAN, d)) + carried)


@inlined
def end(group, state, machine):
    """Keep the state behind the last step of a call."""
    n_dof = len(group.force) // width(machine)
    for d in range(n_dof):
        set_row(state, d, get_row(machine, of(rows.Q, d)))
        set_row(state, n_dof + d, get_row(machine, of(rows.V, d)))


@inlined
def recenter(group, machine, wide):
    """Move the turn of the reference from all rotations of the state into ``CENTER``.

    Only the governor's spring depends on a common rotation.
    """
    n = width(machine)
    n_dof = len(group.force) // n
    reference = of(rows.Q, group.reference)
    turn = get_row(machine, reference)
    for first in range(0, n, EIGHT):
        turned = load_wide(machine, at(reference, first, n))
        center = load_wide(wide, at(layout.CENTER, first, n))
        store(wide, at(layout.CENTER, first, n), center + turned)
    for d in range(n_dof):
        moved = turn * get_row(group.rotation, d)
        place = of(rows.Q, d)
        set_row(machine, place, get_row(machine, place) - moved)


@inlined
def pull_at_begin(group, time, machine, wide):
    """Set all forces but those of meshes from the state at the begin of a step."""
    q, v = rows.Q, rows.V
    for d in range(len(group.force) // width(machine)):
        moved, rate = get_row(machine, of(q, d)), get_row(machine, of(v, d))
        own_pull(group, d, moved, rate, machine)
    couple(group, q, v, machine)
    if len(group.damper_other) > 0:
        damp(group, v, machine)
    govern(group, q, v, machine)
    if len(group.sources) > 0:
        drive(group, time, 0.0, q, machine, wide)


@inlined
def accelerate_fresh(group, flags, machine):
    """Set what a step remembers to the accelerations at its begin, where flags are above 0."""
    for d in range(len(group.force) // width(machine)):
        a = acceleration(group, d, machine)
        choose(flags, of(rows.NOW, d), a, machine)
        choose(flags, of(rows.HALFWAY, d), a, machine)
        choose(flags, of(rows.BEFORE, d), a, machine)


@inlined
def write_angles(group, angle, row, machine, wide):
    """Write the angles of a group at the begin of a step."""
    n = width(machine)
    n_angles = len(group.angles)
    for k in range(n_angles):
        d = number_at(group.angles, k)
        own = of(rows.Q, d)
        for first in range(0, n, EIGHT):
            turned = load_wide(wide, at(layout.NOMINAL, first, n))
            turned = turned * load_wide(group.exact_rotation, at(d, first, n))
            turned = turned + load_wide(machine, at(own, first, n))
            store(angle, at(row * n_angles + k, first, n), turned)
