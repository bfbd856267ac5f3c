"""A shaft line with its gear meshes as arrays of the implicit method's compiled core."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Integers
from gensig.driveline.time import _layout as layout
from gensig.driveline.time import _newmark_kernels as kernels
from gensig.driveline.time._layout import (
    Factor,
    Knots,
    Line,
    Meshes,
    Padded,
    Rows,
    Torques,
)
from gensig.dynamics.equations import A_TURN, B_TURN, Equations, Mesh
from gensig.dynamics.helical import pitches
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import SimulationError
from gensig.mesh.tooth_table import ToothTable, left_out_energy

# of a matrix that is filled, or of a triangle of its factor: from there on, all of it costs less
FULL = 0.5


def pack_line(
    line: Dynamics, order: Integers, mass_share: float, damping_share: float, step: str
) -> Line:
    """The line with its degrees of freedom in ``order``, and the factor of mass_share M +
    damping_share C + K.
    """
    system, n = line.system, len(order)
    mass, damping, stiffness = (
        np.ascontiguousarray(part[np.ix_(order, order)])
        for part in (
            np.diag(system.mass),
            system.governed_damping,
            system.governed_stiffness,
        )
    )
    direction = np.array([mesh.push(n)[order] for mesh in system.meshes])
    direction = direction.reshape(-1, n)
    answer = np.empty(direction.shape)
    compliance = np.empty((len(direction), len(direction)))
    rows = _rows(direction)
    dynamic = mass_share * mass + damping_share * damping + stiffness
    factor = _factor(dynamic, [line.dofs[i] for i in order], step)
    kernels.respond(factor, rows, answer, compliance)
    rotation = system.rotation[order]
    return Line(
        mass=_padded(mass),
        damping=_padded(damping),
        stiffness=_padded(stiffness),
        direction=rows,
        rubbing=_rows(_rubbing(system, order)),
        factor=factor,
        answer=answer,
        compliance=compliance,
        rotation=rotation,
        carried=system.mass[order] * rotation,
    )


def elimination_order(system: Equations) -> Integers:
    """Order of the degrees of freedom that keeps the factor's rows short, (dof,).

    Reverse Cuthill-McKee.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    joined = (system.governed_damping != 0.0) | (system.governed_stiffness != 0.0)
    joined |= np.eye(len(system.mass), dtype=np.bool_)
    return np.asarray(
        reverse_cuthill_mckee(csr_array(joined), symmetric_mode=True), dtype=np.int64
    )


def pack_meshes(system: Equations, order: Integers) -> Meshes:
    """All meshes of a line, its degrees of freedom in ``order``.

    The law is that of the pair dynamics. The back flanks are healthy teeth without errors, mirrored
    as the pair dynamics mirrors them, whose slices enter from the other end. A missing tooth is
    missing there too.
    """
    number = np.zeros((len(system.meshes), layout.N_NUMBERS))
    integers = np.zeros((len(system.meshes), layout.N_INTEGERS), dtype=np.int64)
    numbers, indices = np.empty(0), np.empty(0, dtype=np.int64)
    parts: dict[str, list[NDArray]] = {
        "table": [numbers],
        "depth": [numbers],
        "rows": [indices],
        "kind": [indices],
        "error": [numbers],
        "tilt": [numbers],
    }
    at_of = np.argsort(order)

    def put(name: str, values: NDArray) -> int:
        start = sum(len(part) for part in parts[name])
        parts[name].append(values.ravel())
        return start

    for m, mesh in enumerate(system.meshes):
        teeth, table = mesh.teeth, mesh.teeth.table
        first_pitch, _ = pitches(table)
        n_a, n_b = (gear.n_teeth for gear in teeth.pair.gears.values())
        rows = np.arange(table.present.size).reshape(table.present.shape)
        number[m] = (
            *_numbers(mesh, float(system.rotation[mesh.turn])),
            *_friction(table),
        )
        integers[m] = (
            at_of[mesh.turn],
            table.n_pairs,
            first_pitch,
            table.nodes_per_pitch,
            put("table", _columns(table)),
            put("rows", np.where(table.present, rows, -1)),
            put("rows", np.where(table.present, 0, -1)),
            n_a,
            n_b,
            put("kind", table.pinion.kind),
            put("kind", table.wheel.kind),
            put("error", teeth.errors[0]),
            put("error", teeth.errors[1]),
            *teeth.start_teeth,
            len(table.wheel.present),
            len(table.depth),
            put("depth", table.depth),
        )
        for tilt in teeth.tilts:
            put("tilt", tilt * teeth.pair.base_pitch)
    flat = {name: np.concatenate(values) for name, values in parts.items()}
    return Meshes(number=number, integers=integers, **flat)


def _numbers(mesh: Mesh, turning: float) -> tuple[float, ...]:
    """Numbers of a mesh before those of its friction, in the order of ``_layout``.

    ``turning`` is how far gear a turns with the reference.
    """
    teeth, pair, table = mesh.teeth, mesh.teeth.pair, mesh.teeth.table
    pitches_per_rad = pair.pinion.n_teeth / (2.0 * np.pi)
    upright = (pair.pitch_point + table.half_lag) / pair.base_pitch
    bends = _cell(table) * np.diff(table.pairs.gap_slope[:, :, 0], axis=-1)
    below = 0.125 * float(bends.max(initial=0.0))  # the nodes, a gap between them
    return (
        pair.backlash,
        mesh.damping,
        table.shared_compliance,
        teeth.start_phase,
        abs(turning) * pitches_per_rad,
        float(np.sign(turning)) * pitches_per_rad,
        2.0 * upright + 0.5,
        upright,
        float(teeth.nearest_gaps.min()) - below,
        float(table.pairs.gap[:, :, 0].min()) - below,
    )


def _friction(table: ToothTable) -> tuple[float, ...]:
    """Numbers of the friction of the drive flanks, in the order of ``_layout``."""
    options, pair, lag = table.options, table.pair, table.half_lag
    return (
        options.friction_coefficient,
        pair.base_pitch,
        lag,
        pair.pitch_point,
        2.0 / (options.friction_transition * pair.base_pitch + 2.0 * lag),
        pair.path_of_contact,
        pair.start_curvature_radius,
        pair.tangent_length,
    )


def _columns(table: ToothTable) -> Array:
    """Gap, own compliance and energy left out of every chord, each with its slope per cell.

    (pair of kinds, node, column). The force of a pair is the largest of its chords.
    """
    pairs, distance = table.pairs, _cell(table)
    left_out, left_out_slope = left_out_energy(table)
    columns = [
        pairs.gap,
        distance * pairs.gap_slope,
        pairs.compliance - table.shared_compliance,
        distance * pairs.compliance_slope,
        left_out,
        distance * left_out_slope,
    ]
    by_node = np.moveaxis(np.stack(columns, axis=-1), 2, 3)
    n_nodes, n_chords = by_node.shape[2:4]
    return by_node.reshape(-1, n_nodes, n_chords * layout.PER_CHORD)


def _cell(table: ToothTable) -> float:
    """Distance of the nodes of a table, m."""
    return float(table.position[1] - table.position[0])


def pack_course(line: Dynamics) -> Knots:
    """The nominal rotation of a line."""
    course = line.nominal.with_knots()
    return Knots(
        time=course.time, speed=course.speed, angle=course.angle, gain=course.gain
    )


def pack_torques(line: Dynamics, order: Integers) -> Torques:
    """All torques at the knots of the nominal rotation, degrees of freedom in ``order``."""
    sources, at_of = line.equations.sources, np.argsort(order)
    times = line.nominal.with_knots().time
    tables = [source.nodes for source in sources]
    return Torques(
        steady=np.ascontiguousarray(line.forces(times)[:, order]),
        dof=np.array([at_of[source.dof] for source in sources], dtype=np.int64),
        turned_by=np.array(
            [at_of[source.turned_by] for source in sources], dtype=np.int64
        ),
        first=np.cumsum([0, *map(len, tables)], dtype=np.int64),
        table=np.concatenate([*tables, np.empty(0)]),
        per_rad=np.array([source.per_rad for source in sources]),
        shift=np.array([source.shift for source in sources]),
        factor=np.ascontiguousarray(line.factors(times).T),
    )


def _rubbing(system: Equations, order: Integers) -> Array:
    """Directions of the friction of every mesh and of its moments, (3 mesh, dof).

    An angle that counts against its rotation feels moments the other way.
    """
    n = len(order)
    rows = np.zeros((len(system.meshes), layout.N_RUBBING, n))
    for (force, moment_a, moment_b), mesh in zip(rows, system.meshes, strict=True):
        force[:] = mesh.rub(n)
        for moment, turn in ((moment_a, A_TURN), (moment_b, B_TURN)):
            dof = mesh.touched[turn]
            moment[dof] = np.sign(system.rotation[dof])
    return rows.reshape(-1, n)[:, order]


def _rows(matrix: Array) -> Rows:
    """Entries of a matrix other than 0, row by row."""
    filled = matrix != 0.0
    return Rows(
        first=np.concatenate([[0], np.cumsum(filled.sum(axis=1))]).astype(np.int64),
        column=np.nonzero(filled)[1].astype(np.int64),
        value=matrix[filled],
    )


def _padded(matrix: Array) -> Padded:
    filled = matrix != 0.0
    width = max(1, int(filled.sum(axis=1).max()))
    if width > FULL * len(matrix):
        return Padded(column=np.empty((0, len(matrix)), dtype=np.int64), value=matrix)
    column = np.ascontiguousarray(
        np.argsort(~filled, axis=1, kind="stable")[:, :width].T
    ).astype(np.int64)
    return Padded(column=column, value=np.take_along_axis(matrix.T, column, axis=0))


def _factor(matrix: Array, names: Sequence[str], step: str) -> Factor:
    n = len(matrix)
    reach = np.arange(n) - np.argmax(matrix != 0.0, axis=1)
    first = np.concatenate([[0], np.cumsum(reach)[:-1]]).astype(np.int64)
    lower, inverse_pivot = np.zeros(int(reach.sum())), np.zeros(n)
    waits = np.zeros(
        n, dtype=np.int64
    )  # how many rows must be solved one after the other before a row
    for i in range(n):
        waits[i] = 1 + waits[i - reach[i] : i].max(initial=-1)
    failed = kernels.factorize(
        matrix, first, reach.astype(np.int64), lower, inverse_pivot
    )
    if failed >= 0:
        raise SimulationError(
            f"line: no positive pivot at '{names[failed]}' {step}; check its inertia and springs"
        )
    factor = Factor(
        first=first,
        reach=reach.astype(np.int64),
        turn=np.argsort(waits, kind="stable"),
        lower=lower,
        inverse_pivot=inverse_pivot,
        inverse=np.empty((0, n)),
        spare=np.zeros(n),
    )
    if len(lower) <= FULL * n * (n - 1) / 2:
        return factor
    inverse = np.eye(n)
    for row in inverse:
        kernels.solve(factor, row)
    return factor._replace(inverse=np.ascontiguousarray(0.5 * (inverse + inverse.T)))
