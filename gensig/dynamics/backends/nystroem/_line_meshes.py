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
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem import _line_layout as lines
from gensig.dynamics.backends.nystroem._flat import number_at
from gensig.dynamics.backends.nystroem._kinks import add_force, miss, missed_law
from gensig.dynamics.backends.nystroem._law import mesh_law
from gensig.dynamics.backends.nystroem._line_layout import (
    mesh_of,
    mesh_rows,
    of,
    wide_rows,
)


@written
def motion(group, m, q, v, machine):
    """Approach of a mesh and its rate, from the rows of a state."""
    row = m * layout.N_NUMBERS + layout.REST_APPROACH
    approach, rate = get_row(group.numbers, row), spread(machine, 0.0)
    for k in range(lines.N_TOUCHED):
        d, reach = touched(group, m, k), get_row(group.reach, m * lines.N_TOUCHED + k)
        approach = fused(reach, get_row(machine, of(q, d)), approach)
        rate = fused(reach, get_row(machine, of(v, d)), rate)
    return approach, rate


@written
def touched(group, m, k):
    """One of the degrees of freedom that a mesh acts on."""
    return number_at(group.touched, m * lines.N_TOUCHED + k)


@written
def mesh_mobility(group, m, machine):
    """Acceleration of the approach of a mesh by its own force, 1/kg."""
    moved = spread(machine, 0.0)
    for k in range(lines.N_TOUCHED):
        reach = get_row(group.reach, m * lines.N_TOUCHED + k)
        mass = get_row(group.inverse_mass, touched(group, m, k))
        moved = fused(reach * reach, mass, moved)
    return moved


@written
def turning_speed(group, m, v, since, machine):
    """Speed of gear a of a mesh, ``since`` s after the begin of the step, rad/s."""
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    speed = speed + since * get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    d = touched(group, m, lines.A_TURN)
    return fused(ratio(group, m, machine), speed, get_row(machine, of(v, d)))


@written
def ratio(group, m, machine):
    """Rotation of gear a of a mesh with the reference."""
    return get_row(group.rotation, touched(group, m, lines.A_TURN))


@written
def push(group, m, law, machine):
    """Add the forces of a mesh to the rows ``ON``."""
    row = m * layout.N_NUMBERS + layout.MEAN_FORCE
    normal = law.normal - get_row(group.numbers, row)
    for k in range(lines.N_TOUCHED):
        d = touched(group, m, k)
        force = _on_body(group, m, k, normal, law)
        pushed = of(lines.ON, d)
        set_row(machine, pushed, get_row(machine, pushed) + force)


@written
def rolled(group, m, since, q, machine, own):
    """Roll of a mesh since the begin of the step, ``since`` s after it, m."""
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    turned = since * (speed + (0.5 * since) * gain) * ratio(group, m, machine)
    moved = get_row(machine, of(q, touched(group, m, lines.A_TURN)))
    moved = moved - get_row(own, lines.BEGUN)
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
    miss(mesh.numbers, changed, own)
    any_changed = changed[0] + changed[1] + changed[2]
    short, early = missed_law(mesh, rows.SHORT, own), missed_law(mesh, rows.EARLY, own)
    correct_by(group, m, short, early, step, any_changed, machine)


@written
def correct_by(group, m, short, early, step, changed, machine):
    """Add to the end of the step what a mesh misses of the mean of its law, and early in it."""
    _correct(group, m, short, 1.0, changed, rows.MEAN, machine)
    _correct(group, m, short, step, changed, rows.V, machine)
    _correct(group, m, early, step * step, changed, rows.Q, machine)


@written
def _correct(group, m, law, by, changed, target, machine):
    """Add accelerations by a law, times a number, to rows of what the mesh touches."""
    for k in range(lines.N_TOUCHED):
        force = _on_body(group, m, k, law.normal, law)
        d = touched(group, m, k)
        add_force(group, d, force, by, changed, of(target, d) - d, machine)


@written
def _on_body(group, m, k, normal, law):
    """Force of a mesh law on one of the degrees of freedom that the mesh touches."""
    place = m * lines.N_TOUCHED + k
    force = get_row(group.slide, place) * law.friction
    force = force - get_row(group.reach, place) * normal
    if k == lines.A_TURN:
        arm = get_row(group.numbers, m * layout.N_NUMBERS + layout.PINION_RADIUS)
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
    moved, slowed = spread(machine, 0.0), spread(machine, 0.0)
    for k in range(len(group.turning_dofs)):
        d = number_at(group.turning_dofs, k)
        held = get_row(group.held, d)
        turned = fused(center, get_row(group.rotation, d), get_row(machine, of(q, d)))
        moved = fused(held, turned, moved)
        slowed = fused(held, get_row(machine, of(v, d)), slowed)
    pull = fused(get_row(group.held_damping, 0), slowed, moved)
    set_row(machine, lines.PULL, pull)


@written
def own_pull(group, d, moved, rate, machine):
    """Set the force on a degree of freedom but those of neighbours, governor and meshes."""
    spring = get_row(group.stiffness, d) * moved
    spring = fused(get_row(group.damping, d), rate, spring)
    force = get_row(machine, of(rows.FORCES, d)) - spring
    set_row(machine, of(lines.ON, d), force)


@inlined
def couple(group, states, rates, machine):
    """Add the forces of springs and dampers between two degrees of freedom."""
    for k in range(len(group.coupled) // 2):
        a, b = number_at(group.coupled, 2 * k), number_at(group.coupled, 2 * k + 1)
        _couple(group, k, a, b, states, rates, machine)


@written
def _couple(group, k, a, b, q, v, machine):
    sprung, damped = get_row(group.sprung, k), get_row(group.damped, k)
    for one, other in ((a, b), (b, a)):
        spring = sprung * get_row(machine, of(q, other))
        spring = fused(damped, get_row(machine, of(v, other)), spring)
        pulled = of(lines.ON, one)
        set_row(machine, pulled, get_row(machine, pulled) - spring)


@compiled
def damp(group, rates, machine):
    """Add the forces of dampers between degrees of freedom that no spring joins.

    Losses by mode join all of them: the sum on one of them stays in a register.
    """
    for d in range(len(group.damper_first) - 1):
        begin, end = (
            number_at(group.damper_first, d),
            number_at(group.damper_first, d + 1),
        )
        if begin < end:
            rate, force = (
                get_row(machine, of(rates, d)),
                get_row(machine, of(lines.ON, d)),
            )
            for k in range(begin, end):
                force = _damp(group, k, rate, force, rates, machine)
            set_row(machine, of(lines.ON, d), force)


@written
def _damp(group, k, rate, force, rates, machine):
    """Force on a degree of freedom less that of a damper, whose other end gets its own."""
    other, damper = number_at(group.damper_other, k), get_row(group.damper, k)
    pulled = of(lines.ON, other)
    set_row(machine, pulled, get_row(machine, pulled) - damper * rate)
    return force - damper * get_row(machine, of(rates, other))


@written
def acceleration(group, d, machine):
    """Acceleration of a degree of freedom under all forces."""
    pull = get_row(group.held, d) * get_row(machine, lines.PULL)
    return (get_row(machine, of(lines.ON, d)) - pull) * get_row(group.inverse_mass, d)
