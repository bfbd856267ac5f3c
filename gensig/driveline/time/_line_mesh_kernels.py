"""Compiled core of a shaft line's gear meshes: the law of one, and the forces of all that agree
with each other.

The symbols are those of ``docs/theory/motion.md``. Scalar code without
reassociation, own loops instead of library calls: bits depend on nothing but the numbers given.
"""

from __future__ import annotations

import math

import numpy as np

from gensig.driveline.time import _layout as layout
from gensig.driveline.time._layout import COAST, DRIVE, node_offset
from gensig.dynamics._layout import SEEN_FORCE, SEEN_NEWEST, SEEN_PAIRS
from gensig.dynamics._vector import compiled

MOST_ROUNDS = 60
UNDAMPED = 20  # rounds of Newton's method after which every step is halved
SETTLED, SETTLED_LEAST = (
    1e-9,
    1e-13,
)  # of an approach, and m: what forces and approaches may disagree by
ROUNDED = 1e-14  # of what forces take off an approach


@compiled
def between(table, low, high, share, per_cell, out):
    """Value and slope, ``share`` of the way between two nodes whose values and slopes stand at
    ``low`` and ``high``.

    Slopes are linear, and values are their integral. ``per_cell`` is the slope asked for over
    that per cell.
    """
    rise, slope = table[high] - table[low], table[low + 1]
    bend = table[high + 1] - slope
    out[0] = table[low] + share * (rise - 0.5 * (1.0 - share) * bend)
    out[1] = per_cell * (slope + share * bend)


@compiled
def gather(meshes, mesh, flank, turned, within, pairs):
    """Gap, compliance and energy left out of the chords of a flank's pairs and their slopes, where
    the mesh has rolled ``turned`` pitches.

    ``pairs`` (mesh, flank, pair, what is gathered) takes them; pairs that do not exist stand
    infinitely far back. The back flanks meet along the mirrored roll, so their teeth count
    backwards. Chords are left out that begin beyond ``within`` m and two depths more.

    Returns
    -------
    up to where what was gathered is all that touches, m
    """
    integers = meshes.integers[mesh]
    first, n_nodes, n_pairs = (
        integers[layout.FIRST],
        integers[layout.NODES],
        integers[layout.N_PAIRS],
    )
    sense, at_rows = 1, integers[layout.AT_ROWS]
    if flank == COAST:
        sense, at_rows = -1, integers[layout.AT_COAST_ROWS]
        turned = meshes.number[mesh, layout.MIRROR] - turned
    newest = math.floor(turned) - first
    n_cells = n_pairs * n_nodes
    n_chords, at_depth = integers[layout.N_CHORDS], integers[layout.AT_DEPTH]
    n_columns, reach, last = layout.PER_CHORD * n_chords, np.inf, np.inf
    if n_chords > 1:
        reach = within + meshes.depth[at_depth + 1]
        last = reach + meshes.depth[at_depth + 1]
    for j in range(n_pairs):
        index = newest - j
        tooth_a = (integers[layout.START_A] + sense * index) % integers[layout.TEETH_A]
        tooth_b = (integers[layout.START_B] + sense * index) % integers[layout.TEETH_B]
        kind_a = meshes.kind[integers[layout.AT_KIND_A] + tooth_a]
        kind_b = meshes.kind[integers[layout.AT_KIND_B] + tooth_b]
        row = meshes.rows[at_rows + kind_a * integers[layout.N_KINDS_B] + kind_b]
        here = pairs[mesh, flank, j]
        if row < 0:
            here[layout.GAP] = np.inf
            continue
        here[layout.PLACE] = turned - index
        open_by, tilt = 0.0, 0.0
        if flank == DRIVE:
            at_a = integers[layout.AT_ERROR_A] + tooth_a
            at_b = integers[layout.AT_ERROR_B] + tooth_b
            tilt = meshes.tilt[at_a] + meshes.tilt[at_b]
            beyond = turned - index - meshes.number[mesh, layout.UPRIGHT]
            open_by = meshes.error[at_a] + meshes.error[at_b] + tilt * beyond
        x = (turned - (index + first)) * n_nodes
        cell = min(max(int(x), 0), n_cells - 1)
        low = node_offset(integers, row, n_cells, cell)
        for chord in range(n_chords):
            if chord > 0 and here[layout.GAP] + meshes.depth[at_depth + chord] > last:
                break
            start = chord * layout.PER_CHORD
            for part in range(start, start + layout.PER_CHORD, 2):
                at_low, at_high = low + part, low + n_columns + part
                per_cell = sense * n_nodes
                between(meshes.table, at_low, at_high, x - cell, per_cell, here[part:])
            here[start + layout.GAP] += open_by
            here[start + layout.GAP_SLOPE] += tilt
    return reach


@compiled
def bearing_chord(pair, depth, local):
    """First column of the chord that bears most where the body stands at ``local`` m, and its
    force, negative where the pair does not touch.

    Chords begin at ``depth`` (chord,) m beyond the gap, between nodes a little off. Those are left
    out that begin more than a depth deeper.
    """
    start, touch = 0, local - pair[layout.GAP]
    if not touch > 0.0:
        return start, touch
    most = touch / pair[layout.COMPLIANCE]
    for chord in range(1, len(depth)):
        if depth[chord] > touch + depth[1]:
            break
        column = chord * layout.PER_CHORD
        bite = local - pair[column + layout.GAP]
        force = bite / pair[column + layout.COMPLIANCE]
        if force > most:
            start, most = column, force
    return start, most


@compiled
def shared_load(pairs, depth, shared, within):
    """Load of all pairs of a flank that deflect a ``shared`` body, and the sum of their
    stiffnesses.

    Newton's method from no load. A pair's force is convex in its approach, so that every round
    raises the load, and the last one is exact.
    """
    total, stiffness = 0.0, 0.0
    for _ in range(len(pairs) * len(depth) + 1):
        stiffness, force = 0.0, 0.0
        for j in range(len(pairs)):
            start, elastic = bearing_chord(pairs[j], depth, within - shared * total)
            if elastic > 0.0:
                stiff = 1.0 / pairs[j, start + layout.COMPLIANCE]
                stiffness += stiff
                force += stiff * (within - pairs[j, start + layout.GAP])
        grown = force / (1.0 + shared * stiffness)
        if not grown > total:
            break
        total = grown
        if shared == 0.0:
            break
    return total, stiffness


@compiled
def flank_law(pairs, depth, damping, shared, within, rate, roll_rate):
    """Law of the gathered pairs of a flank, ``within`` m beyond where healthy teeth touch; their
    chords begin at ``depth`` (chord,) m beyond the gap.

    Sets the normal force of every pair, where there is any force. Damping follows the gap of the
    first touch.

    Returns
    -------
    what ``_layout.N_LAW`` names: force, its slopes over approach and rate, stored energy, power
    lost, force along the roll
    """
    total, stiffness = shared_load(pairs, depth, shared, within)
    if not total > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    softer = 1.0 / (1.0 + shared * stiffness)
    normal, tangent, rate_tangent, lost, along = 0.0, 0.0, 0.0, 0.0, 0.0
    stored = 0.5 * shared * total * total
    for j in range(len(pairs)):
        pair = pairs[j]
        start, elastic = bearing_chord(pair, depth, within - shared * total)
        pressed = 0.0
        if elastic > 0.0:
            chord = pair[start:]
            slope = pair[layout.GAP_SLOPE]
            speed = rate - slope * roll_rate
            grown = 1.0 + damping * speed
            if grown > 0.0:
                pressed = elastic * grown
                tangent += softer * grown / chord[layout.COMPLIANCE]
                rate_tangent += elastic * damping
            square = 0.5 * elastic * elastic
            stored += chord[layout.COMPLIANCE] * square + chord[layout.LEFT_OUT]
            lost += (pressed - elastic) * speed
            along += elastic * chord[layout.GAP_SLOPE] + (pressed - elastic) * slope
            along += (
                square * chord[layout.COMPLIANCE_SLOPE] - chord[layout.LEFT_OUT_SLOPE]
            )
        normal += pressed
        pair[layout.PRESSED] = pressed
    return normal, tangent, rate_tangent, stored, lost, along


@compiled
def rub(meshes, mesh, law, work):
    """Add friction and its moments of the drive flank of a mesh to ``law`` (mesh, N_LAW).

    The law of the mesh has just been evaluated. Pairs slide one way before the pitch point and the
    other behind it.
    """
    number, first, law = meshes.number[mesh], layout.AT_FRICTION, law[mesh]
    if not (number[first + layout.COEFFICIENT] > 0.0 and law[layout.FORCE] > 0.0):
        return
    pairs = work.pairs[mesh, DRIVE]
    for j in range(meshes.integers[mesh, layout.N_PAIRS]):
        pressed = pairs[j, layout.PRESSED]
        if not pressed > 0.0:
            continue
        place = number[first + layout.BASE_PITCH] * pairs[j, layout.PLACE]
        place -= number[first + layout.LAG]
        x = place - number[first + layout.PITCH_POINT]
        x = min(max(x * number[first + layout.PER_WIDTH], -1.0), 1.0)
        force = number[first + layout.COEFFICIENT] * pressed * x * (1.5 - 0.5 * x * x)
        arm = min(max(place, 0.0), number[first + layout.PATH])
        arm += number[first + layout.START_CURVATURE]
        law[layout.RUBBING] += force
        law[layout.MOMENT_A] -= force * arm
        law[layout.MOMENT_B] += force * (number[first + layout.TANGENT_LENGTH] - arm)


@compiled
def write_pairs(meshes, turned, law, work, seen):
    """Write the state of the pairs of all meshes, the newest first, to ``seen`` (mesh, N_SEEN).

    The law of every mesh has just been evaluated where it has rolled ``turned`` (mesh,) pitches.
    Pairs on the back flanks are not told apart.
    """
    for m in range(len(law)):
        first = meshes.integers[m, layout.FIRST]
        seen[m, SEEN_NEWEST] = math.floor(turned[m]) - first
        seen[m, SEEN_FORCE] = law[m, layout.FORCE]
        for j in range(meshes.integers[m, layout.N_PAIRS]):
            force = 0.0
            if law[m, layout.FORCE] > 0.0:
                force = work.pairs[m, DRIVE, j, layout.PRESSED]
            seen[m, SEEN_PAIRS + j] = force


@compiled
def mesh_law(meshes, mesh, turned, roll_rate, approach, rate, law, work):
    """Law of one mesh on whichever flank it touches, into ``law`` (mesh, N_LAW).

    ``work.reach`` (mesh, flank) says up to where ``work.pairs`` holds all that touches for this
    roll, -inf where it holds nothing yet; what is missing is gathered when it may touch.
    """
    number, integers, total = meshes.number[mesh], meshes.integers[mesh], law[mesh]
    n_pairs, at_depth = integers[layout.N_PAIRS], integers[layout.AT_DEPTH]
    depth = meshes.depth[at_depth : at_depth + integers[layout.N_CHORDS]]
    total[:] = 0.0
    for flank in range(layout.N_FLANKS):
        within, least, sense = approach, number[layout.LEAST_GAP], 1.0
        if flank == COAST:
            within, least, sense = (
                -approach - number[layout.BACKLASH],
                number[layout.LEAST_COAST_GAP],
                -1.0,
            )
        if not within > least:
            continue
        if not within <= work.reach[mesh, flank]:
            work.reach[mesh, flank] = gather(
                meshes, mesh, flank, turned, within, work.pairs
            )
        normal, tangent, rate_tangent, stored, lost, along = flank_law(
            work.pairs[mesh, flank, :n_pairs],
            depth,
            number[layout.DAMPING],
            number[layout.SHARED],
            within,
            sense * rate,
            roll_rate,
        )
        total[layout.FORCE] += sense * normal
        total[layout.TANGENT] += tangent
        total[layout.RATE_TANGENT] += rate_tangent
        total[layout.STORED] += stored
        total[layout.LOST] += lost
        total[layout.ALONG] += along


@compiled
def eliminate(matrix, right):
    """Solve ``matrix`` x = ``right`` in place without pivoting.

    I + W J needs none, see ``solve_contact``.
    """
    n = len(right)
    for i in range(n):
        for j in range(i + 1, n):
            if matrix[j, i] != 0.0:
                share = matrix[j, i] / matrix[i, i]
                for k in range(i + 1, n):
                    matrix[j, k] -= share * matrix[i, k]
                right[j] -= share * right[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]


@compiled
def solve_contact(
    meshes,
    compliance,
    free,
    carried,
    turned,
    roll_rate,
    before,
    rate_before,
    per_step,
    approach,
    law,
    work,
):
    """Approaches and forces of all meshes with delta = free - W (F(delta) - carried), by a
    semi-smooth Newton method.

    Parameters
    ----------
    compliance : (mesh, mesh) m/N   W, symmetric and positive: what forces take off the approaches
    free : (mesh,) m                approaches if the meshes went on with the forces ``carried``
        (mesh, N_LAW)
    before, rate_before : (mesh,)   approaches and their rates where the step began
    per_step : 1/s                  2 / h: the rate is per_step (delta - before) - rate_before
    approach : (mesh,) m            first guess, takes the solution
    law : (mesh, N_LAW)             what the meshes do there, at the guess and then at the solution
    work : ``Work``

    Forces grow with the approaches, J >= 0 their slopes, so the equation has one solution, and I
    + W J is similar to a symmetric positive matrix once J is shared out; its elimination needs no
    pivots.

    Returns
    -------
    rounds of Newton's method, or -1 where it found no solution
    """
    n = len(free)
    matrix, right, near = work.matrix, work.right, work.near
    for round_ in range(MOST_ROUNDS):
        largest, longest = 0.0, 0.0
        for m in range(n):
            off, most = free[m] - approach[m], 0.0
            for k in range(n):
                off -= compliance[m, k] * (
                    law[k, layout.FORCE] - carried[k, layout.FORCE]
                )
                most += abs(compliance[m, k]) * (
                    abs(law[k, layout.FORCE]) + abs(carried[k, layout.FORCE])
                )
            right[m] = off
            if not abs(off) < np.inf:
                return -1
            near[m] = SETTLED * abs(approach[m]) + SETTLED_LEAST + ROUNDED * most
            largest = max(largest, abs(off) / near[m])
        if largest <= 1.0:
            return round_
        for k in range(n):
            slope = law[k, layout.TANGENT] + per_step * law[k, layout.RATE_TANGENT]
            for m in range(n):
                matrix[m, k] = compliance[m, k] * slope
            matrix[k, k] += 1.0
        eliminate(matrix, right)
        share = 1.0 if round_ < UNDAMPED else 0.5
        for m in range(n):
            approach[m] += share * right[m]
            longest = max(longest, abs(right[m]) / near[m])
            rate = per_step * (approach[m] - before[m]) - rate_before[m]
            mesh_law(meshes, m, turned[m], roll_rate[m], approach[m], rate, law, work)
        if longest <= 1.0:
            return round_ + 1
    return -1
