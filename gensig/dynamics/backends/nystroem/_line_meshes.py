"""Two-evaluation core: the meshes of a machine of several, their motion and their forces."""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import (
    compiled,
    fused,
    get_row,
    inlined,
    set_row,
    spread,
    width,
)
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem import _line_layout as lines
from gensig.dynamics.backends.nystroem._kinks import add_force, miss, missed_law
from gensig.dynamics.backends.nystroem._law import mesh_law
from gensig.dynamics.backends.nystroem._layout import block
from gensig.dynamics.backends.nystroem._line_layout import (
    mesh_of,
    mesh_rows,
    wide_rows,
)


@inlined
def motion(group, m, q, v, machine):
    """Approach of a mesh and its rate, from the rows of a state."""
    approach = _rest_approach(group, m, machine)
    rate = spread(machine, 0.0)
    for k in range(lines.N_TOUCHED):
        place = m * lines.N_TOUCHED + k
        d = group.touched[place]
        if d >= 0:
            reach = get_row(group.reach, place)
            approach = fused(reach, get_row(machine, q + d), approach)
            rate = fused(reach, get_row(machine, v + d), rate)
    return approach, rate


@inlined
def mesh_mobility(group, m, machine):
    """Acceleration of the approach of a mesh by its own force, 1/kg."""
    moved = spread(machine, 0.0)
    for k in range(lines.N_TOUCHED):
        place = m * lines.N_TOUCHED + k
        d = group.touched[place]
        if d >= 0:
            reach = get_row(group.reach, place)
            moved = fused(reach * reach, get_row(group.inverse_mass, d), moved)
    return moved


@inlined
def _rest_approach(group, m, machine):
    row = m * layout.N_NUMBERS + layout.REST_APPROACH
    return get_row(group.numbers, row)


@inlined
def turning_speed(group, m, v, since, machine):
    """Speed of gear a of a mesh, ``since`` s after the begin of the step, rad/s."""
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    speed = speed + since * get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    d = group.touched[m * lines.N_TOUCHED + lines.A_TURN]
    return fused(ratio(group, m, machine), speed, get_row(machine, v + d))


@inlined
def ratio(group, m, machine):
    """Rotation of gear a of a mesh with the reference."""
    return get_row(group.rotation, group.touched[m * lines.N_TOUCHED + lines.A_TURN])


@inlined
def push(group, m, law, machine):
    """Add the forces of a mesh to the rows ``ON``."""
    n_dof = len(group.force) // width(machine)
    on = block(lines.ON, n_dof)
    mesh = mesh_of(group, m, width(machine))
    normal = law.normal - get_row(mesh.numbers, layout.MEAN_FORCE)
    law = layout.Law(
        normal,
        law.friction,
        law.moment_p,
        law.moment_w,
        law.along,
        law.stored,
        law.lost,
        law.loaded,
    )
    for k in range(lines.N_TOUCHED):
        place = m * lines.N_TOUCHED + k
        d = group.touched[place]
        if d >= 0:
            force = _on_body(group, mesh, place, k, law)
            set_row(machine, on + d, get_row(machine, on + d) + force)


@inlined
def rolled(group, m, since, q, machine, own):
    """Roll of a mesh since the begin of the step, ``since`` s after it, m."""
    d = group.touched[m * lines.N_TOUCHED + lines.A_TURN]
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    turned = since * (speed + (0.5 * since) * gain) * ratio(group, m, machine)
    moved = get_row(machine, q + d) - get_row(own, lines.BEGUN)
    row = m * layout.N_NUMBERS + layout.PINION_RADIUS
    return get_row(group.numbers, row) * (turned + moved)


@inlined
def law_at(group, m, nodes, instant, off, turned, since, q, v, machine, work, wide):
    """Law of a mesh at a state, ``off`` m after its nodes and ``turned`` m after the begin."""
    n = width(work)
    mesh = mesh_of(group, m, n)
    approach, rate = motion(group, m, q, v, machine)
    speed = turning_speed(group, m, v, since, machine)
    roll_rate = get_row(mesh.numbers, layout.PINION_RADIUS) * speed
    return mesh_law(
        mesh,
        nodes,
        instant,
        off,
        turned,
        approach,
        rate,
        roll_rate,
        mesh_rows(work, m, n),
        wide_rows(wide, m, n),
    )


@compiled
def correct(group, mesh, m, step, changed, machine, own):
    """Add to the end of the step what the kinks of a mesh change, in the lanes with any."""
    n_dof = len(group.force) // width(machine)
    miss(mesh.numbers, changed, own)
    any_changed = changed[0] + changed[1] + changed[2]
    short, early = missed_law(mesh, rows.SHORT, own), missed_law(mesh, rows.EARLY, own)
    for k in range(lines.N_TOUCHED):
        place = m * lines.N_TOUCHED + k
        d = group.touched[place]
        if d >= 0:
            force = _on_body(group, mesh, place, k, short)
            mean, v = block(rows.MEAN, n_dof), block(rows.V, n_dof)
            add_force(group, d, force, 1.0, any_changed, mean, machine)
            add_force(group, d, force, step, any_changed, v, machine)
            force = _on_body(group, mesh, place, k, early)
            q = block(rows.Q, n_dof)
            add_force(group, d, force, step * step, any_changed, q, machine)


@inlined
def _on_body(group, mesh, place, k, law):
    """Force of a mesh law on one of the degrees of freedom that the mesh touches."""
    force = get_row(group.slide, place) * law.friction
    force = force - get_row(group.reach, place) * law.normal
    if k == lines.A_TURN:
        arm = get_row(mesh.numbers, layout.PINION_RADIUS)
        force = force + (arm * law.along + law.moment_p)
    if k == lines.B_TURN:
        force = force + law.moment_w
    return force


@inlined
def govern(group, q, v, machine):
    """Set the pull of the governor, which feels the rigid motion alone, from a state.

    ``CENTER`` is the rigid motion that the state does not hold.
    """
    center = get_row(machine, rows.DRIVE + layout.DRIVE_CENTER)
    slowed, pull = get_row(group.held_damping, 0), spread(machine, 0.0)
    for k in range(len(group.turning_dofs)):
        d = group.turning_dofs[k]
        moved = fused(center, get_row(group.rotation, d), get_row(machine, q + d))
        moved = fused(slowed, get_row(machine, v + d), moved)
        pull = fused(get_row(group.held, d), moved, pull)
    set_row(machine, lines.PULL, pull)


@inlined
def acceleration(group, d, q, v, machine):
    """Acceleration of a degree of freedom under the forces of all meshes, with states in rows."""
    n_dof = len(group.force) // width(machine)
    spring = get_row(group.stiffness, d) * get_row(machine, q + d)
    spring = fused(get_row(group.damping, d), get_row(machine, v + d), spring)
    spring = fused(get_row(group.held, d), get_row(machine, lines.PULL), spring)
    for k in range(group.sprung_first[d], group.sprung_first[d + 1]):
        moved = get_row(machine, q + group.sprung_column[k])
        spring = fused(get_row(group.sprung, k), moved, spring)
    for k in range(group.damped_first[d], group.damped_first[d + 1]):
        rate = get_row(machine, v + group.damped_column[k])
        spring = fused(get_row(group.damped, k), rate, spring)
    on_it = get_row(machine, block(lines.ON, n_dof) + d)
    pull = get_row(machine, block(rows.FORCES, n_dof) + d) + (on_it - spring)
    return pull * get_row(group.inverse_mass, d)
