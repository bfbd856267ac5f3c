"""Two-evaluation core: meshes, springs and governor of a machine, their motion and their forces."""

from __future__ import annotations

from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import (
    chosen,
    compiled,
    fused,
    get_row,
    set_row,
    spread,
    where_above,
)
from gensig.dynamics._written import loop, traced, written
from gensig.dynamics.backends.nystroem import _layout as rows
from gensig.dynamics.backends.nystroem._flat import number_at, rows_of
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
)

# in a gear pair, whose y is the line of action: gradient of the approach along y
REACH_OF_PAIR = {A_Y: -1.0, B_Y: 1.0}


@written
def choose(flags, row, value, work):
    """Set a row in the lanes whose flag is above 0."""
    zero = spread(work, 0.0)
    set_row(work, row, where_above(flags, zero, value, get_row(work, row)))


@written
def motion(group, m, q, v, machine):
    """Approach of a mesh and its rate, from the rows of a state."""
    row = m * layout.N_NUMBERS + layout.REST_APPROACH
    approach, rate = get_row(group.numbers, row), spread(machine, 0.0)
    for k in range(motions_of(group)):
        if not _is_across(group, k):
            d, reach = touched(group, m, k), _reach(group, m, k)
            approach = fused(reach, get_row(machine, of(q, d)), approach)
            rate = fused(reach, get_row(machine, of(v, d)), rate)
    return approach, rate


def _is_across(group, k):
    """True where a motion is known to be across the line of action."""
    return is_gear_pair(group) and k in (A_X, B_X)


def _reach(group, m, k):
    """Gradient of the approach of a mesh along one motion; a number where it is known."""
    if is_gear_pair(group) and k in REACH_OF_PAIR:
        return REACH_OF_PAIR[k]
    return get_row(group.reach, m * motions_of(group) + k)


@written
def touched(group, m, k):
    """One of the degrees of freedom that a mesh acts on."""
    if is_gear_pair(group):
        return k
    return number_at(group.touched, m * motions_of(group) + k)


@written
def mesh_mobility(group, m, machine):
    """Acceleration of the approach of a mesh by its own force, 1/kg."""
    moved = spread(machine, 0.0)
    for k in range(motions_of(group)):
        reach = get_row(group.reach, m * motions_of(group) + k)
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


@traced
def push(group, m, law, machine):
    """Add the forces of a mesh to the sums of all forces."""
    mean = get_row(group.numbers, m * layout.N_NUMBERS + layout.MEAN_FORCE)
    normal = law.normal - mean
    for k in range(motions_of(group)):
        pushed = of(rows.ON, touched(group, m, k))
        force = _along(group, m, k, normal, law)
        set_row(machine, pushed, get_row(machine, pushed) + force)


def _along(group, m, k, normal, law):
    """Force of a mesh law along one of the motions that the mesh acts on."""
    if _is_across(group, k):
        return law.friction if k == A_X else 0.0 - law.friction
    force = 0.0 - _reach(group, m, k) * normal
    if not is_gear_pair(group):
        slide = get_row(group.slide, m * motions_of(group) + k)
        force = fused(slide, law.friction, force)
    if k == A_TURN:
        arm = get_row(group.numbers, m * layout.N_NUMBERS + layout.PINION_RADIUS)
        force = force + (arm * law.along + law.moment_p)
    if k == B_TURN:
        force = force + law.moment_w
    return force


@traced
def correct_by(group, m, short, early, step, changed, machine):
    """Add to the end of the step what a mesh misses of the mean of its law, and early in it."""
    for k in range(motions_of(group)):
        d, force = touched(group, m, k), _along(group, m, k, short.normal, short)
        add_force(group, d, force, 1.0, changed, of(rows.MEAN, d), machine)
        add_force(group, d, force, step, changed, of(rows.V, d), machine)
        force = _along(group, m, k, early.normal, early)
        add_force(group, d, force, step * step, changed, of(rows.Q, d), machine)


@traced
def govern(group, q, v, machine):
    """Add the pull of the governor, which feels the rigid motion alone, from a state.

    ``CENTER`` is the rigid motion that the state does not hold.
    """
    n_held = rows_of(group.held_dofs, 1)
    center = get_row(machine, rows.DRIVE + layout.DRIVE_CENTER)
    set_row(machine, rows.PULL, spread(machine, 0.0))

    def feel(k):
        d = number_at(group.held_dofs, k)
        held, slowed = get_row(group.held, d), get_row(group.held_damping, 0)
        turned = fused(center, get_row(group.rotation, d), get_row(machine, of(q, d)))
        turned = fused(slowed, get_row(machine, of(v, d)), turned)
        set_row(machine, rows.PULL, fused(held, turned, get_row(machine, rows.PULL)))

    def hold(k):
        d = number_at(group.held_dofs, k)
        pulled = of(rows.ON, d)
        held = get_row(group.held, d) * get_row(machine, rows.PULL)
        set_row(machine, pulled, get_row(machine, pulled) - held)

    loop(n_held, feel)
    loop(n_held, hold)


@written
def own_pull(group, d, moved, rate, machine):
    """Set the sum of forces on a degree of freedom to those of time and its own spring."""
    spring = get_row(group.stiffness, d) * moved
    spring = fused(get_row(group.damping, d), rate, spring)
    force = get_row(machine, of(rows.FORCES, d)) - spring
    set_row(machine, of(rows.ON, d), force)


@traced
def couple(group, q, v, machine):
    """Add the forces of springs and dampers between two degrees of freedom."""

    def join(k):
        a, b = number_at(group.coupled, 2 * k), number_at(group.coupled, 2 * k + 1)
        sprung, damped = get_row(group.sprung, k), get_row(group.damped, k)
        for one, other in ((a, b), (b, a)):
            spring = sprung * get_row(machine, of(q, other))
            spring = fused(damped, get_row(machine, of(v, other)), spring)
            pulled = of(rows.ON, one)
            set_row(machine, pulled, get_row(machine, pulled) - spring)

    loop(rows_of(group.coupled, 2), join)


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
