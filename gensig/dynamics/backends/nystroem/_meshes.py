"""Two-evaluation core: meshes, springs and governor of a machine, their motion and their forces."""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import (
    chosen,
    compiled,
    fused,
    get_row,
    inlined,
    set_row,
    spread,
    where_above,
)
from gensig.dynamics._written import written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import number_at
from gensig.dynamics.backends.nystroem._group import (
    has_any_law,
    is_gear_pair,
    motions_of,
    of,
)
from gensig.dynamics.backends.nystroem._kinks import add_force
from gensig.dynamics.equations import (
    A_TURN,
    A_X,
    A_Y,
    B_TURN,
    B_X,
    B_Y,
    N_IN_PLANE,
)

# in a gear pair, whose y is the line of action: gradient of the approach along y
REACH_OF_PAIR = {A_Y: -1.0, B_Y: 1.0}


@written
def choose(flags, row, value, work):
    """Set a row in the lanes whose flag is above 0."""
    zero = spread(work, 0.0)
    set_row(work, row, where_above(flags, zero, value, get_row(work, row)))


@inlined
def motion(group, m, q, v, machine):
    """Approach of a mesh and its rate, from the rows of a state."""
    approach, rate = _motion_in_plane(group, m, q, v, machine)
    for k in range(N_IN_PLANE, motions_of(group)):
        reach = reach_along(group, m, k)
        approach, rate = _moved(group, m, k, reach, approach, rate, q, v, machine)
    return approach, rate


@written
def _motion_in_plane(group, m, q, v, machine):
    row = m * layout.N_NUMBERS + layout.REST_APPROACH
    approach, rate = get_row(group.numbers, row), spread(machine, 0.0)
    for k in range(N_IN_PLANE):
        if not _is_across(group, k):
            reach = _reach_in_plane(group, m, k)
            approach, rate = _moved(group, m, k, reach, approach, rate, q, v, machine)
    return approach, rate


@written
def _moved(group, m, k, reach, approach, rate, q, v, machine):
    """Approach and rate with a motion that the mesh acts on."""
    d = touched(group, m, k)
    approach = fused(reach, get_row(machine, of(q, d)), approach)
    return approach, fused(reach, get_row(machine, of(v, d)), rate)


@written
def _is_across(group, k):
    """True where a motion in the plane is known to be across the line of action."""
    return is_gear_pair(group) and k in (A_X, B_X)


@written
def _reach_in_plane(group, m, k):
    """Gradient of the approach along a motion in the plane; a number where it is known."""
    if is_gear_pair(group) and k in REACH_OF_PAIR:
        return REACH_OF_PAIR[k]
    return reach_along(group, m, k)


@written
def reach_along(group, m, k):
    """Gradient of the approach of a mesh along one of the motions that it acts on."""
    return get_row(group.reach, m * motions_of(group) + k)


@written
def touched(group, m, k):
    """One of the degrees of freedom that a mesh acts on."""
    if is_gear_pair(group):
        return k
    return number_at(group.touched, m * motions_of(group) + k)


@inlined
def mesh_mobility(group, m, machine):
    """Acceleration of the approach of a mesh by its own force, 1/kg."""
    moved = spread(machine, 0.0)
    for k in range(motions_of(group)):
        reach = reach_along(group, m, k)
        mass = get_row(group.inverse_mass, touched(group, m, k))
        moved = fused(reach * reach, mass, moved)
    return moved


@written
def turning_speed(group, m, v, since, machine):
    """Speed of gear a of a mesh, ``since`` s after the begin of the step, rad/s."""
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    speed = speed + since * get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    return with_reference(group, m, speed, own_turn(group, m, v, machine))


@written
def own_turn(group, m, name, machine):
    """Rotation or speed of gear a beside the nominal one, as far as the mesh follows it."""
    own = get_row(machine, of(name, touched(group, m, A_TURN)))
    if has_any_law(group):
        return chosen(group.prescribed, spread(machine, 0.0), own)
    return own


@written
def mean_speed(group, m, step, machine):
    """Speed of gear a in the middle of the step, with every force at its begin, rad/s."""
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    gain = with_reference(group, m, gain, own_turn(group, m, rows.NOW, machine))
    speed = turning_speed(group, m, rows.V, spread(machine, 0.0), machine)
    return speed + (0.5 * step) * gain


@written
def set_begun(group, m, machine, own):
    """Keep the rotation of gear a at the begin of the step."""
    set_row(own, layout.BEGUN, own_turn(group, m, rows.Q, machine))


@written
def with_reference(group, m, turned, own):
    """Rotation of gear a of a mesh: that with the reference, and its own."""
    if is_gear_pair(group):
        return turned + own
    return fused(get_row(group.rotation, touched(group, m, A_TURN)), turned, own)


@written
def rolled(group, m, since, q, machine, own):
    """Roll of a mesh since the begin of the step, ``since`` s after it, m."""
    speed = get_row(machine, rows.DRIVE + layout.DRIVE_SPEED)
    gain = get_row(machine, rows.DRIVE + layout.DRIVE_GAIN)
    turned = since * (speed + (0.5 * since) * gain)
    moved = own_turn(group, m, q, machine) - get_row(own, layout.BEGUN)
    row = m * layout.N_NUMBERS + layout.PINION_RADIUS
    return get_row(group.numbers, row) * with_reference(group, m, turned, moved)


@inlined
def push(group, m, law, machine):
    """Add the forces of a mesh to the sums of all forces."""
    normal = _above_mean(group, m, law.normal)
    _push_in_plane(group, m, normal, law, machine)
    for k in range(N_IN_PLANE, motions_of(group)):
        _push(group, m, k, _on_axis(group, m, k, normal), machine)


@written
def _above_mean(group, m, normal):
    return normal - get_row(group.numbers, m * layout.N_NUMBERS + layout.MEAN_FORCE)


@written
def _push_in_plane(group, m, normal, law, machine):
    for k in range(N_IN_PLANE):
        _push(group, m, k, _in_plane(group, m, k, normal, law), machine)


@written
def _push(group, m, k, force, machine):
    pushed = of(rows.ON, touched(group, m, k))
    set_row(machine, pushed, get_row(machine, pushed) + force)


@written
def _on_axis(group, m, k, normal):
    """Force of a mesh along a motion out of the plane."""
    return 0.0 - reach_along(group, m, k) * normal


@written
def _in_plane(group, m, k, normal, law):
    """Force of a mesh law along a motion in the plane."""
    if _is_across(group, k):
        return law.friction if k == A_X else 0.0 - law.friction
    force = 0.0 - _reach_in_plane(group, m, k) * normal
    if not is_gear_pair(group):
        slide = get_row(group.slide, m * motions_of(group) + k)
        force = fused(slide, law.friction, force)
    if k == A_TURN:
        arm = get_row(group.numbers, m * layout.N_NUMBERS + layout.PINION_RADIUS)
        force = force + (arm * law.along + law.moment_p)
    if k == B_TURN:
        force = force + law.moment_w
    return force


@inlined
def correct_by(group, m, short, early, step, changed, machine):
    """Add to the end of the step what a mesh misses of the mean of its law, and early in it."""
    _correct_in_plane(group, m, short, early, step, changed, machine)
    for k in range(N_IN_PLANE, motions_of(group)):
        forces = (
            _on_axis(group, m, k, short.normal),
            _on_axis(group, m, k, early.normal),
        )
        _correct(group, m, k, forces, step, changed, machine)


@written
def _correct_in_plane(group, m, short, early, step, changed, machine):
    for k in range(N_IN_PLANE):
        forces = tuple(
            _in_plane(group, m, k, law.normal, law) for law in (short, early)
        )
        _correct(group, m, k, forces, step, changed, machine)


@written
def _correct(group, m, k, forces, step, changed, machine):
    """Add what is missed of the force along a motion, of its mean and early in the step."""
    d, (short, early) = touched(group, m, k), forces
    add_force(group, d, short, 1.0, changed, of(rows.MEAN, d), machine)
    add_force(group, d, short, step, changed, of(rows.V, d), machine)
    add_force(group, d, early, step * step, changed, of(rows.Q, d), machine)


@inlined
def govern(group, q, v, machine):
    """Add the pull of the governor, which feels the rigid motion alone, from a state.

    ``CENTER`` is the rigid motion that the state does not hold.
    """
    center = get_row(machine, rows.DRIVE + layout.DRIVE_CENTER)
    moved, slowed = spread(machine, 0.0), spread(machine, 0.0)
    for k in range(len(group.held_dofs)):
        d = number_at(group.held_dofs, k)
        held = get_row(group.held, d)
        turned = fused(center, get_row(group.rotation, d), get_row(machine, of(q, d)))
        moved = fused(held, turned, moved)
        slowed = fused(held, get_row(machine, of(v, d)), slowed)
    pull = fused(get_row(group.held_damping, 0), slowed, moved)
    for k in range(len(group.held_dofs)):
        d = number_at(group.held_dofs, k)
        pulled = of(rows.ON, d)
        held = get_row(group.held, d) * pull
        set_row(machine, pulled, get_row(machine, pulled) - held)


@written
def own_pull(group, d, moved, rate, machine):
    """Set the sum of forces on a degree of freedom to those of time and its own spring."""
    spring = get_row(group.stiffness, d) * moved
    spring = fused(get_row(group.damping, d), rate, spring)
    force = get_row(machine, of(rows.FORCES, d)) - spring
    set_row(machine, of(rows.ON, d), force)


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
        pulled = of(rows.ON, one)
        set_row(machine, pulled, get_row(machine, pulled) - spring)


@compiled
def damp(group, rates, machine):
    """Add the forces of dampers between degrees of freedom that no spring joins.

    Losses by mode join all of them: the sum on one of them stays in a register.
    """
    for d in range(len(group.damper_first) - 1):
        begin = number_at(group.damper_first, d)
        end = number_at(group.damper_first, d + 1)
        if begin < end:
            rate = get_row(machine, of(rates, d))
            force = get_row(machine, of(rows.ON, d))
            for k in range(begin, end):
                force = _damp(group, k, rate, force, rates, machine)
            set_row(machine, of(rows.ON, d), force)


@written
def _damp(group, k, rate, force, rates, machine):
    """Force on a degree of freedom less that of a damper, whose other end gets its own."""
    other, damper = number_at(group.damper_other, k), get_row(group.damper, k)
    pulled = of(rows.ON, other)
    set_row(machine, pulled, get_row(machine, pulled) - damper * rate)
    return force - damper * get_row(machine, of(rates, other))


@written
def acceleration(group, d, machine):
    """Acceleration of a degree of freedom under all forces."""
    return get_row(machine, of(rows.ON, d)) * get_row(group.inverse_mass, d)
