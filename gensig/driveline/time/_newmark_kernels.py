"""Compiled core: Newmark's average acceleration for a geared shaft line.

The symbols are those of ``docs/theory/motion.md``. Scalar code without
reassociation, own loops instead of library calls: bits depend on nothing but the numbers given.
"""

from __future__ import annotations

import math

from gensig.driveline.time import _layout as layout
from gensig.driveline.time._line_mesh_kernels import (
    gather,
    mesh_law,
    rub,
    solve_contact,
    write_pairs,
)
from gensig.driveline.time._scheme import NEWMARK
from gensig.dynamics._vector import compiled

ANGLE, SPEED, ACCELERATION, MESH_FORCE = range(4)  # kinds of channels


@compiled
def factorize(matrix, first, reach, lower, inverse_pivot):
    """L and 1 / D of A = L D L^T (dof, dof) into a ``Factor``'s arrays.

    The first pivot that is not positive, or -1.
    """
    for i in range(len(reach)):
        start = i - reach[i]
        pivot = matrix[i, i]
        for j in range(start, i):
            value = matrix[i, j]
            for k in range(max(start, j - reach[j]), j):
                value -= (
                    lower[first[i] + k - start] * lower[first[j] + k - j + reach[j]]
                )
            lower[first[i] + j - start] = (
                value  # times the pivot of j, until the row is done
            )
        for j in range(start, i):
            scaled = lower[first[i] + j - start]
            lower[first[i] + j - start] = scaled * inverse_pivot[j]
            pivot -= scaled * lower[first[i] + j - start]
        if not pivot > 0.0:
            return i
        inverse_pivot[i] = 1.0 / pivot
    return -1


@compiled
def add_full(matrix, share, x, out):
    """Add ``share`` times a symmetric matrix (dof, dof) times x to ``out``."""
    n = len(x)
    for j in range(
        0, n - n % 4, 4
    ):  # four rows at once share what they read and write of ``out``
        p, q, r, s = share * x[j], share * x[j + 1], share * x[j + 2], share * x[j + 3]
        for i in range(n):
            out[i] += (p * matrix[j, i] + q * matrix[j + 1, i]) + (
                r * matrix[j + 2, i] + s * matrix[j + 3, i]
            )
    for j in range(n - n % 4, n):
        for i in range(n):
            out[i] += share * x[j] * matrix[j, i]


@compiled
def solve(factor, x):
    """Solve A y = x in place."""
    n = len(x)
    if len(factor.inverse) > 0:
        for i in range(n):
            factor.spare[i] = x[i]
            x[i] = 0.0
        add_full(factor.inverse, 1.0, factor.spare, x)
        return
    for k in range(n):
        i = factor.turn[k]
        at, start, value = factor.first[i], i - factor.reach[i], x[i]
        for j in range(factor.reach[i]):
            value -= factor.lower[at + j] * x[start + j]
        x[i] = value
    for i in range(n):
        x[i] *= factor.inverse_pivot[i]
    for k in range(n - 1, -1, -1):
        i = factor.turn[k]
        at, start, value = factor.first[i], i - factor.reach[i], x[i]
        for j in range(factor.reach[i]):
            x[start + j] -= factor.lower[at + j] * value


@compiled
def add_product(matrix, share, x, out):
    """Add ``share`` times a ``Padded`` matrix times x to ``out``."""
    if len(matrix.column) == 0:
        add_full(matrix.value, share, x, out)
        return
    for j in range(len(matrix.value)):
        for i in range(len(x)):
            out[i] += share * (matrix.value[j, i] * x[matrix.column[j, i]])


@compiled
def respond(factor, direction, answer, compliance):
    """Fill ``answer`` = A^-1 D^T (mesh, dof) and ``compliance`` = D A^-1 D^T (mesh, mesh)."""
    for m in range(len(answer)):
        answer[m] = 0.0
        for p in range(direction.first[m], direction.first[m + 1]):
            answer[m, direction.column[p]] = direction.value[p]
        solve(factor, answer[m])
        for k in range(m + 1):
            compliance[m, k] = row_product(direction, k, answer[m])
            compliance[k, m] = compliance[m, k]


@compiled
def row_product(rows, i, x):
    """Row i times x."""
    total = 0.0
    for p in range(rows.first[i], rows.first[i + 1]):
        total += rows.value[p] * x[rows.column[p]]
    return total


@compiled
def energy(line, q, v, law, work):
    """Kinetic energy of the deviation and all that springs and meshes hold, J."""
    work.moved[:] = 0.0
    work.force[:] = 0.0
    add_product(line.stiffness, 1.0, q, work.moved)
    add_product(line.mass, 1.0, v, work.force)
    total = 0.0
    for i in range(len(q)):
        total += 0.5 * (v[i] * work.force[i] + q[i] * work.moved[i])
    for m in range(len(law)):
        total += law[m, layout.STORED]
    return total


@compiled
def nominal(course, time, knot):
    """Nominal angle, speed and acceleration, the knot before ``time``, from ``knot`` on, and the
    share of the way to the next; constant speed outside the knots."""
    while knot + 1 < len(course.time) and course.time[knot + 1] <= time:
        knot += 1
    since = time - course.time[knot]
    gain, share = course.gain[knot], 0.0
    if since < 0.0:
        gain = 0.0
    elif knot + 1 < len(course.time):
        share = since / (course.time[knot + 1] - course.time[knot])
    speed = course.speed[knot]
    return (
        course.angle[knot] + (speed + 0.5 * gain * since) * since,
        speed + gain * since,
        gain,
        knot,
        share,
    )


@compiled
def push(line, torques, angle, gain, knot, share, q, force):
    """Torques at an instant, and the inertia force of the nominal acceleration, into ``force``
    (dof,).
    """
    steady, factor = torques.steady, torques.factor
    for i in range(len(force)):
        force[i] = steady[knot, i] - gain * line.carried[i]
        if share > 0.0:
            force[i] += share * (steady[knot + 1, i] - steady[knot, i])
    for j in range(len(torques.dof)):
        turning, first = torques.turned_by[j], torques.first[j]
        n_nodes = torques.first[j + 1] - first
        turned = line.rotation[turning] * angle + q[turning]
        x = turned * torques.per_rad[j] + torques.shift[j]
        x -= math.floor(x / n_nodes) * n_nodes
        node = min(int(x), n_nodes - 1)
        low = torques.table[first + node]
        rise = torques.table[first + (node + 1) % n_nodes] - low
        share_of_source = factor[j, knot]
        if share > 0.0:
            share_of_source += share * (factor[j, knot + 1] - share_of_source)
        force[torques.dof[j]] += share_of_source * (low + (x - node) * rise)


@compiled
def roll(meshes, angle, speed, q, v, turned, roll_rate):
    """Roll of the meshes in pitches, and its rate, (mesh,) each."""
    for m in range(len(turned)):
        number, dof = meshes.number[m], meshes.integers[m, layout.ROLL_DOF]
        per_angle, per_rad = (
            number[layout.NOMINAL_PITCHES],
            number[layout.PITCHES_PER_RAD],
        )
        turned[m] = number[layout.START] + per_angle * angle + per_rad * q[dof]
        roll_rate[m] = per_angle * speed + per_rad * v[dof]


@compiled
def add_friction(line, law, force):
    """Add the friction of all meshes, ``law`` (mesh, N_LAW), to ``force`` (dof,)."""
    rows = line.rubbing
    for m in range(len(law)):
        for k in range(layout.N_RUBBING):
            part, i = law[m, layout.RUBBING + k], layout.N_RUBBING * m + k
            for p in range(rows.first[i], rows.first[i + 1]):
                force[rows.column[p]] += part * rows.value[p]


@compiled
def look(line, meshes, torques, course, time, state, work):
    """Torques, approaches and what the meshes do in a given state, so that ``advance`` can go on
    from there.
    """
    q, v, _, force, approach, rate, law = state
    turned, roll_rate = work.turned, work.roll_rate
    angle, speed, gain, knot, share = nominal(course, time, 0)
    push(line, torques, angle, gain, knot, share, q, force)
    roll(meshes, angle, speed, q, v, turned, roll_rate)
    work.reach[:] = -math.inf
    for m in range(len(law)):
        approach[m], rate[m] = (
            row_product(line.direction, m, q),
            row_product(line.direction, m, v),
        )
        mesh_law(meshes, m, turned[m], roll_rate[m], approach[m], rate[m], law, work)
        rub(meshes, m, law, work)
    add_friction(line, law, force)


@compiled
def advance(
    line,
    meshes,
    torques,
    course,
    state,
    step,
    first_step,
    n_steps,
    channels,
    out,
    seen,
    per_seen,
    tally,
    sums,
    work,
):
    """Advance a line by ``n_steps`` from time ``first_step`` * ``step`` on.

    Parameters
    ----------
    state : q, v, mean acceleration over the last step, torques (dof,), approach, its rate
        (mesh,), law (mesh, N_LAW) as ``look`` makes them; all advanced in place
    channels : (channel, 2)    kind and index
    out : (step, column)    takes the channels' means over every step in its first columns
    seen : (sample, mesh, N_SEEN)    takes the pairs every ``per_seen`` steps from time 0 on
    tally, sums : (mesh, N_TALLY), (N_SUMS,)    are added to
    work : ``Work``

    Returns
    -------
    the step in which the contact did not converge, or -1
    """
    q, v, mean, force, approach, rate, law = state
    n, n_meshes = len(q), len(law)
    ahead_q, ahead_v, moved, force_1 = (
        work.ahead_q,
        work.ahead_v,
        work.moved,
        work.force,
    )
    turned, roll_rate, free, approach_1, law_1 = (
        work.turned,
        work.roll_rate,
        work.free,
        work.approach,
        work.law,
    )
    per_step, half = NEWMARK.damping / step, 0.5 * step
    angle, speed, gain, knot, share = nominal(course, first_step * step, 0)
    for step_index in range(first_step, first_step + n_steps):
        speed_0 = speed
        angle, speed, gain, knot, share = nominal(course, (step_index + 1) * step, knot)
        for i in range(n):
            ahead_v[i] = v[i] + step * mean[i]
            ahead_q[i] = q[i] + step * (v[i] + half * mean[i])
        push(line, torques, angle, gain, knot, share, ahead_q, force_1)
        roll(meshes, angle, speed, ahead_q, ahead_v, turned, roll_rate)
        work.reach[:] = -math.inf
        for m in range(n_meshes):
            approach_1[m] = row_product(line.direction, m, ahead_q)
            rate_1 = per_step * (approach_1[m] - approach[m]) - rate[m]
            mesh_law(
                meshes, m, turned[m], roll_rate[m], approach_1[m], rate_1, law_1, work
            )
            rub(meshes, m, law_1, work)
        add_friction(line, law_1, force_1)
        for i in range(n):
            moved[i] = force[i] + force_1[i]
        add_product(line.stiffness, -2.0, q, moved)
        add_product(line.mass, 2.0 * per_step, v, moved)
        for m in range(n_meshes):
            along = law[m, layout.ALONG] + law_1[m, layout.ALONG]
            moved[meshes.integers[m, layout.ROLL_DOF]] += (
                along * meshes.number[m, layout.PITCHES_PER_RAD]
            )
            for p in range(line.direction.first[m], line.direction.first[m + 1]):
                moved[line.direction.column[p]] -= (
                    2.0 * law[m, layout.FORCE] * line.direction.value[p]
                )
        solve(line.factor, moved)
        for m in range(n_meshes):
            free[m] = approach[m] + row_product(line.direction, m, moved)
        rounds = solve_contact(
            meshes,
            line.compliance,
            free,
            law,
            turned,
            roll_rate,
            approach,
            rate,
            per_step,
            approach_1,
            law_1,
            work,
        )
        if rounds < 0:
            return step_index
        sums[layout.ROUNDS] += rounds
        for m in range(n_meshes):
            grown = law_1[m, layout.FORCE] - law[m, layout.FORCE]
            for i in range(n):
                moved[i] -= grown * line.answer[m, i]
        for c in range(len(channels)):
            kind, i = channels[c]
            if kind == ANGLE:
                # of the cubic through the angles and speeds at both ends
                out[step_index - first_step, c] = (
                    q[i] + moved[i] / 3.0 + step * v[i] / 6.0
                )
            elif kind == SPEED:
                out[step_index - first_step, c] = moved[i] / step
            elif kind == ACCELERATION:
                out[step_index - first_step, c] = per_step * (moved[i] / step - v[i])
            else:
                out[step_index - first_step, c] = 0.5 * (
                    law[i, layout.FORCE] + law_1[i, layout.FORCE]
                )
        sample = (step_index + 1) // per_seen
        if (step_index + 1) % per_seen == 0 and 0 <= sample < len(seen):
            write_pairs(meshes, turned, law_1, work, seen[sample])
        put_in, lost = 0.0, 0.0
        drag = ahead_v
        drag[:] = 0.0
        add_product(line.damping, 1.0 / step, moved, drag)
        for i in range(n):
            put_in += 0.5 * (force[i] + force_1[i]) * moved[i]
            lost += moved[i] * drag[i]
            speed_1 = per_step * moved[i] - v[i]
            mean[i] = (speed_1 - v[i]) / step
            q[i] += moved[i]
            v[i] = speed_1
            force[i] = force_1[i]
        passing = 0.0
        for m in range(n_meshes):
            approach[m], rate[m] = (
                row_product(line.direction, m, q),
                row_product(line.direction, m, v),
            )
            lost += half * (law[m, layout.LOST] + law_1[m, layout.LOST])
            carried = speed_0 * law[m, layout.ALONG] + speed * law_1[m, layout.ALONG]
            passing -= half * meshes.number[m, layout.NOMINAL_PITCHES] * carried
            for k in range(layout.N_LAW):
                law[m, k] = law_1[m, k]
            now = law[m, layout.FORCE]
            tally[m, layout.APART] += now == 0.0
            tally[m, layout.BEHIND] += now < 0.0
            tally[m, layout.LARGEST] = max(tally[m, layout.LARGEST], now)
            tally[m, layout.LEAST] = min(tally[m, layout.LEAST], now)
        sums[layout.INPUT] += put_in
        sums[layout.PASSING] += passing
        sums[layout.DISSIPATED] += lost
        sums[layout.THROUGHPUT] += abs(put_in) + abs(passing)
    return -1


__all__ = [
    "advance",
    "energy",
    "factorize",
    "gather",
    "look",
    "nominal",
    "respond",
]
