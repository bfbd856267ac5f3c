"""Two-evaluation core: fixed steps of a method of Nystroem, several records side by side.

Every number of a record lies in its own lane of a vector, and no instruction mixes lanes or
reorders sums: a record's bits depend on nothing but its own numbers. Arrays are flat; a row holds
one number for every record of the group. The step is written once for a law, in loops over meshes
and degrees of freedom whose bodies are run once: it is compiled for a law and a precision, not for
a machine.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from gensig.dynamics import _layout as layout
from gensig.dynamics._layout import EVEN, ODD
from gensig.dynamics._vector import (
    EIGHT,
    at,
    get_row,
    inlined,
    load_wide,
    set_row,
    spread,
    store,
    where_above,
    width,
)
from gensig.dynamics._written import call, loop, traced, when
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._course import (
    cell_at,
    drive,
    in_row,
    profile_rows,
    set_forces,
    set_rolls,
)
from gensig.dynamics.backends.nystroem._flat import is_filled, number_at, rows_of
from gensig.dynamics.backends.nystroem._group import (
    Station,
    is_gear_pair,
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
from gensig.dynamics.backends.nystroem.force_law import ForceLaw

RECENTER = 256  # steps between two removals of the drift of the rotations, to keep numbers small


class Law(ABC):
    """Forces of meshes, as code that is written into the step for a mesh in its ``Station``."""

    @abstractmethod
    def begin(self, s, slot, fresh, step):
        """Write what a mesh reads at the begin of a call."""

    @abstractmethod
    def start(self, s, slot, fresh):
        """Push by a mesh at the begin of a step, and set what it remembers where it is fresh."""

    @abstractmethod
    def write(self, s, seen, row):
        """Write the state of the pairs of a mesh at the begin of a step."""

    @abstractmethod
    def read(self, s, slot, next_slot, step):
        """Read what a mesh has where the step will end."""

    @abstractmethod
    def push_middle(self, s, step):
        """Add the forces of a mesh in the middle of the step."""

    @abstractmethod
    def push_end(self, s, slot, step):
        """Add the forces of a mesh at the end of the step."""

    @abstractmethod
    def end(self, s, slot, step):
        """Correct the end of the step for what the rule misses, and shift what a mesh remembers."""

    @abstractmethod
    def keep(self, s):
        """Keep what the next call begins with."""


def pull(forces, group, time, since, q, v, machine, wide):
    """Add all forces but those of meshes, ``since`` s after a step's begin.

    Those of each degree of freedom alone are there. ``forces`` are the laws of elements.
    """
    couple(group, q, v, machine)
    govern(group, q, v, machine)
    if not is_gear_pair(group):
        is_damped, is_driven = is_filled(group.damper_other), is_filled(group.sources)
        when(is_damped, lambda: call(damp, group, v, machine))
        when(is_driven, lambda: call(drive, group, time, since, q, machine, wide))
    for elements in group.elements:
        kind = elements.kind.instance_class
        law = next(each for each in forces.values() if each.rows is kind)
        law.push(group, elements, q, v, machine)


def integrator(law: Law, forces: Mapping[str, ForceLaw]) -> Any:
    """The core of machines whose meshes have one law, and whose elements have some of others."""

    @traced
    def start(group, slot, fresh, time, work, wide, near):
        """Set what the step remembers in the lanes that are fresh, from one evaluation there."""
        n = width(work)
        machine = machine_rows(work, meshes_of(group), n)

        def alone(d):
            moved, rate = (get_row(machine, of(name, d)) for name in (rows.Q, rows.V))
            own_pull(group, d, moved, rate, machine)

        def push(m):
            law.start(Station.of(group, m, work, wide, near), slot, fresh)

        loop(rows_of(group.force, n), alone)
        pull(
            forces,
            group,
            time,
            0.0,
            rows.Q,
            rows.V,
            machine,
            wide,
        )
        loop(meshes_of(group), push)
        flags = get_row(fresh, 0)

        def remember(d):
            a = acceleration(group, d, machine)
            for name in (rows.NOW, rows.HALFWAY, rows.BEFORE):
                choose(flags, of(name, d), a, machine)

        loop(rows_of(group.force, n), remember)

    @traced
    def begin_meshes(group, slot, fresh, step, work, wide, near):
        def begin_mesh(m):
            law.begin(Station.of(group, m, work, wide, near), slot, fresh, step)

        loop(meshes_of(group), begin_mesh)

    @traced
    def write_meshes(group, seen, row, work, wide, near):
        n_meshes = meshes_of(group)

        def write_mesh(m):
            mesh = Station.of(group, m, work, wide, near)
            law.write(mesh, seen, row * n_meshes + m)

        loop(n_meshes, write_mesh)

    @traced
    def keep_meshes(group, work, wide, near):
        def keep_mesh(m):
            law.keep(Station.of(group, m, work, wide, near))

        loop(meshes_of(group), keep_mesh)

    @traced
    def advance(
        group,
        time,
        step,
        slot,
        next_slot,
        lost,
        channels,
        n_channels,
        out,
        out_first,
        work,
        wide,
        near,
    ):
        """A step behind the rolls and forces at its begin."""
        n, n_meshes = width(work), meshes_of(group)
        n_dof, machine = rows_of(group.force, n), machine_rows(work, n_meshes, n)

        def station(m):
            return Station.of(group, m, work, wide, near)

        def read(m):
            count_lost(lost, m, mesh_rows(work, m, n))
            law.read(station(m), slot, next_slot, step)

        def go_to_middle(d):
            own_pull(group, d, *to_middle(d, step, machine), machine)

        def push_middle(m):
            law.push_middle(station(m), step)

        def go_to_end(d):
            a = acceleration(group, d, machine)
            own_pull(group, d, *predict(d, a, step, machine), machine)

        def push_end(m):
            law.push_end(station(m), next_slot, step)

        def finish(d):
            conclude(d, acceleration(group, d, machine), step, machine)

        def pull_from(q, v, since):
            pull(
                forces,
                group,
                time,
                since,
                q,
                v,
                machine,
                wide,
            )

        loop(n_meshes, read)
        loop(n_dof, go_to_middle)
        pull_from(rows.MIDDLE_Q, rows.MIDDLE_V, 0.5 * step)
        loop(n_meshes, push_middle)
        loop(n_dof, go_to_end)
        pull_from(rows.END_Q, rows.END_V, step)
        loop(n_meshes, push_end)
        loop(n_dof, finish)
        loop(n_meshes, lambda m: law.end(station(m), next_slot, step))
        write_means(group, channels, n_channels, out, out_first, machine)

    @inlined
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
        """Advance every lane by ``n_steps``; parameters are those of ``_record_kernels.recorder``.

        ``lost`` has one row for every mesh. ``angle`` takes as many rows a sample as the group has
        angles, ``seen`` the rows of every mesh.
        """
        n = width(work)
        machine = machine_rows(work, meshes_of(group), n)
        begin(group, step, state, work)
        n_channels = len(channels) if out_row >= 0 else 0
        is_changing = len(group.profile) > profile_rows(group, n) * n
        slot, next_slot = EVEN, ODD
        if n_steps > 0:
            time = first_step * step
            if first_step % RECENTER == 0:
                recenter(group, machine, wide)
            cell, since = cell_at(group, time, n)
            set_rolls(group, cell, since, rows.Q, machine, wide)
            set_forces(group, cell, since, machine, wide)
            begin_meshes(group, slot, fresh, step, work, wide, near)
            if is_any_fresh(fresh, n):
                start(
                    group,
                    slot,
                    fresh,
                    time,
                    work,
                    wide,
                    near,
                )
        for number in range(first_step, first_step + n_steps):
            time, is_recentred = number * step, number % RECENTER == 0
            if is_recentred:
                recenter(group, machine, wide)
            cell, since = cell_at(group, time, n)
            set_rolls(group, cell, since, rows.Q, machine, wide)
            if is_changing or is_recentred:
                set_forces(group, cell, since, machine, wide)
            if angle_row >= 0 and number % per_angle == 0:
                write_angles(group, angle, angle_row, machine, wide)
                if len(seen) > 0:
                    write_meshes(group, seen, angle_row, work, wide, near)
                angle_row += 1
            advance(
                group,
                time,
                step,
                slot,
                next_slot,
                lost,
                channels,
                n_channels,
                out,
                (out_row + number - first_step) * n_channels,
                work,
                wide,
                near,
            )
            slot, next_slot = next_slot, slot
        if slot == ODD:
            keep_meshes(group, work, wide, near)
        end(group, state, machine)
        return angle_row

    return integrate


def count_lost(lost, m, own):
    """Count a step in which a mesh has no contact."""
    zero, one = spread(own, 0.0), spread(own, 1.0)
    normal = get_row(own, rows.NORMAL)
    apart = where_above(normal * normal, zero, zero, one)
    set_row(lost, m, get_row(lost, m) + apart)


@traced
def begin(group, step, state, work):
    """Set the rows that stay as they are, and those of the state."""
    n, n_meshes = width(work), meshes_of(group)
    n_dof, machine = rows_of(group.force, n), machine_rows(work, n_meshes, n)

    def take(d):
        set_row(machine, of(rows.Q, d), get_row(state, d))
        set_row(machine, of(rows.V, d), get_row(state, n_dof + d))

    def keep(m):
        mesh, own = mesh_of(group, m, n), mesh_rows(work, m, n)
        turn = 1.0 / get_row(mesh.numbers, layout.PER_FRICTION_WIDTH)
        set_row(own, rows.FRICTION_WIDTH, turn)
        most = DAMPER_SHARE / (step * mesh_mobility(group, m, work))
        set_row(own, layout.MOST_DAMPER, most)
        nodes = in_row(mesh.exact, layout.NODES_PER_METER, work)
        set_row(own, rows.BEND, 0.5 / nodes)

    loop(n_dof, take)
    loop(n_meshes, keep)


@inlined
def is_any_fresh(fresh, n):
    """True if any lane starts anew."""
    starting = False
    for lane in range(n):
        starting = starting or fresh[lane] > 0.0
    return starting


def write_means(group, channels, n_channels, out, first, machine):
    """Write the mean accelerations of a step to rows from ``first`` on."""
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)

    def mean(c):
        d = number_at(channels, c)
        carried = gain * get_row(group.rotation, d)
        set_row(out, first + c, get_row(machine, of(rows.MEAN, d)) + carried)

    loop(n_channels, mean)


@traced
def end(group, state, machine):
    """Keep the state behind the last step of a call."""
    n_dof = rows_of(group.force, width(machine))

    def keep(d):
        set_row(state, d, get_row(machine, of(rows.Q, d)))
        set_row(state, n_dof + d, get_row(machine, of(rows.V, d)))

    loop(n_dof, keep)


@traced
def recenter(group, machine, wide):
    """Move the turn of the reference from all rotations of the state into ``CENTER``.

    Only the governor's spring depends on a common rotation.
    """
    n, reference = width(machine), of(rows.Q, group.reference)
    turn = get_row(machine, reference)
    for first in range(0, n, EIGHT):
        turned = load_wide(machine, at(reference, first, n))
        center = load_wide(wide, at(layout.CENTER, first, n))
        store(wide, at(layout.CENTER, first, n), center + turned)

    def move(d):
        place = of(rows.Q, d)
        moved = turn * get_row(group.rotation, d)
        set_row(machine, place, get_row(machine, place) - moved)

    loop(rows_of(group.force, n), move)


@traced
def write_angles(group, angle, row, machine, wide):
    """Write the angles of a group at the begin of a step."""
    n, n_angles = width(machine), rows_of(group.angles, 1)

    def write(k):
        d = number_at(group.angles, k)
        for first in range(0, n, EIGHT):
            turned = load_wide(wide, at(layout.NOMINAL, first, n))
            turned = turned * load_wide(group.exact_rotation, at(d, first, n))
            turned = turned + load_wide(machine, at(of(rows.Q, d), first, n))
            store(angle, at(row * n_angles + k, first, n), turned)

    loop(n_angles, write)
