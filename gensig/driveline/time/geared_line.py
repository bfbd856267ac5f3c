"""A shaft line with gear meshes on plain arrays, as its compiled core takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time import _layout as layout
from gensig.driveline.time import _newmark_kernels as kernels
from gensig.driveline.time._layout import Factor, Line, Meshes, Padded, Rows, Torques
from gensig.driveline.time.course import LineCourse, ShaftTorque
from gensig.driveline.time.line_mesh import LineMesh
from gensig.errors import ConfigError, SimulationError
from gensig.mesh.pair_table import SMOOTHED_GAP, SMOOTHED_SHARE

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# of its terms, by which nominal rotation may close a mesh: radii come rounded
CLOSING = 1e-6
SYMMETRIC = 1e-9
# of a matrix that is filled, or of a triangle of its factor: from there on, all of it costs less
FULL = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GearedLine:
    """M q'' + C q' + K q + sum over meshes of direction x force = torques; q is the deviation
    from nominal rotation.

    ``mass``, ``damping``, ``stiffness`` (dof, dof) without the meshes, SI; springs and dampers
    act on the deviation. ``rotation`` (dof,) is how far each turns with the reference, signed as
    its angle counts, 0 for a translation. ``names`` name the degrees of freedom.

    A governor is part of both: its stiffness is ``held`` times ``held`` (dof,), its damping
    ``held_damping`` s times as much. None without one.

    ``friction_torque`` (dof,) N m is what the drive gives to make up for the mean friction of the
    meshes; statics know neither. None without any.
    """

    names: tuple[str, ...]
    mass: Array
    damping: Array
    stiffness: Array
    rotation: Array
    meshes: tuple[LineMesh, ...]
    held: Array | None = None
    held_damping: float = 0.0
    friction_torque: Array | None = None

    def __post_init__(self) -> None:
        n = len(self.names)
        for what in ("mass", "damping", "stiffness"):
            matrix = getattr(self, what)
            if matrix.shape != (n, n) or not np.isfinite(matrix).all():
                raise ConfigError(
                    f"line: the {what} matrix {matrix.shape} must be ({n}, {n}), all finite"
                )
            if not np.allclose(matrix, matrix.T, rtol=SYMMETRIC, atol=0.0):
                raise SimulationError(f"line: the {what} matrix is not symmetric")
            least = float(np.linalg.eigvalsh(matrix).min())
            if least < -SYMMETRIC * float(np.abs(matrix).max()):
                raise SimulationError(
                    f"line: the {what} matrix would feed energy in; check the signs of its entries"
                )
        lightest = int(np.argmin(np.diag(self.mass)))
        if not np.linalg.eigvalsh(self.mass).min() > 0.0:
            raise SimulationError(
                f"line: the mass or inertia of '{self.names[lightest]}' must be positive"
            )
        if self.rotation.shape != (n,) or not np.isfinite(self.rotation).all():
            raise ConfigError(
                f"line: rotation {self.rotation.shape} must be ({n},), one a degree of freedom"
            )
        for mesh in self.meshes:
            self._check_mesh(mesh)

    def _check_mesh(self, mesh: LineMesh) -> None:
        n = len(self.names)
        if mesh.direction.shape != (n,) or not np.isfinite(mesh.direction).all():
            raise ConfigError(
                f"mesh '{mesh.name}': direction {mesh.direction.shape} must be "
                f"({n},), one a freedom"
            )
        if (
            not 0 <= mesh.roll_dof < n
            or self.rotation[mesh.roll_dof] == 0.0
            or mesh.direction[mesh.roll_dof] == 0.0
        ):
            raise ConfigError(
                f"mesh '{mesh.name}': roll_dof {mesh.roll_dof} must be the rotation "
                f"of its gear a, in 0..{n - 1}"
            )
        closing = mesh.direction * self.rotation
        if abs(closing.sum()) > CLOSING * np.abs(closing).sum():
            raise ConfigError(
                f"mesh '{mesh.name}': nominal rotation closes it by {closing.sum():g} "
                "m/rad; its base radii "
                f"contradict the speed ratios"
            )


def pack_line(
    line: GearedLine, order: Index, mass_share: float, damping_share: float, step: str
) -> Line:
    """The line with its degrees of freedom in ``order``, and the factor of mass_share M +
    damping_share C + K.
    """
    mass, damping, stiffness = (
        np.ascontiguousarray(part[np.ix_(order, order)])
        for part in (line.mass, line.damping, line.stiffness)
    )
    direction = _direction(line, order)
    answer = np.empty(direction.shape)
    compliance = np.empty((len(direction), len(direction)))
    rows = _rows(direction)
    dynamic = mass_share * mass + damping_share * damping + stiffness
    factor = _factor(dynamic, [line.names[i] for i in order], step)
    kernels.respond(factor, rows, answer, compliance)
    rotation = line.rotation[order]
    given = np.zeros(len(order))
    if line.friction_torque is not None:
        given = line.friction_torque[order]
    sparse_mass, carried = _padded(mass), np.zeros(len(order))
    kernels.add_product(sparse_mass, 1.0, rotation, carried)
    return Line(
        mass=sparse_mass,
        damping=_padded(damping),
        stiffness=_padded(stiffness),
        direction=rows,
        rubbing=_rows(_rubbing(line, order)),
        given=given,
        factor=factor,
        answer=answer,
        compliance=compliance,
        rotation=rotation,
        carried=carried,
    )


def elimination_order(line: GearedLine) -> Index:
    """Order of the degrees of freedom that keeps the factor's rows short, (dof,).

    Reverse Cuthill-McKee.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    joined = (line.mass != 0.0) | (line.damping != 0.0) | (line.stiffness != 0.0)
    return np.asarray(
        reverse_cuthill_mckee(csr_array(joined), symmetric_mode=True), dtype=np.int64
    )


def pack_meshes(line: GearedLine, order: Index) -> Meshes:
    """All meshes of the line, its degrees of freedom in ``order``."""
    number = np.zeros((len(line.meshes), layout.N_NUMBERS))
    integers = np.zeros((len(line.meshes), layout.N_INTEGERS), dtype=np.int64)
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
        parts[name].append(values)
        return start

    for m, mesh in enumerate(line.meshes):
        turning, (n_a, n_b) = float(line.rotation[mesh.roll_dof]), mesh.n_teeth
        per_rad, smoothed = n_a / (2.0 * np.pi), 0.25 * SMOOTHED_GAP
        number[m] = (
            mesh.backlash, mesh.damping, mesh.shared_compliance, mesh.start_phase,
            abs(turning) * per_rad, np.sign(turning) * per_rad, mesh.mirror,
            mesh.upright, mesh.least_gap - smoothed, mesh.gap.min() - smoothed,
            *_friction(mesh),
        )  # fmt: skip
        integers[m] = (
            at_of[mesh.roll_dof], mesh.n_pairs, mesh.first_pitch,
            (mesh.stiffness.shape[1] - 1) // mesh.n_pairs, put("table", _columns(mesh).ravel()),
            put("rows", mesh.rows.ravel()), put("rows", mesh.coast_rows.ravel()), n_a, n_b,
            put("kind", mesh.kinds[0]), put("kind", mesh.kinds[1]),
            put("error", mesh.errors[0]), put("error", mesh.errors[1]), *mesh.start_teeth,
            mesh.rows.shape[1], len(mesh.depth), put("depth", mesh.depth),
        )  # fmt: skip
        for tilt in mesh.tilts:
            put("tilt", tilt)
        if mesh.rows.shape != mesh.coast_rows.shape:
            raise ConfigError(f"mesh '{mesh.name}': rows and coast_rows must be alike")
    flat = {name: np.concatenate(values) for name, values in parts.items()}
    return Meshes(number=number, integers=integers, **flat)


def _columns(mesh: LineMesh) -> Array:
    """Gap and stiffness of every spring, each with its slope per cell, (row, node, column)."""
    n_rows, n_nodes = mesh.gap.shape
    gap = np.stack([mesh.gap, _slopes(mesh.gap, SMOOTHED_GAP)], axis=2)
    slope = _slopes(mesh.stiffness, SMOOTHED_SHARE * float(mesh.stiffness.max()))
    springs = np.stack([mesh.stiffness, slope], axis=2).reshape(n_rows, -1, n_nodes, 2)
    return np.concatenate(
        [gap, np.moveaxis(springs, 1, 2).reshape(n_rows, n_nodes, -1)], axis=2
    )


def _slopes(values: Array, limit: float) -> Array:
    """Slopes per cell at the nodes, (row, node): central differences, with which cubics between
    the nodes are smooth.

    Where the second difference exceeds ``limit``, or what is 0 begins to grow, the harmonic mean
    of both chords (0 at a turn) stands instead: its cubics never leave the values at their ends,
    so that an edge stays one. At the ends the chord itself. Source: Fritsch & Butland, SIAM J.
    Sci. Stat. Comput. 5 (1984).
    """
    chord = np.diff(values, axis=1)
    before, after = chord[:, :-1], chord[:, 1:]
    mean, product = 0.5 * (before + after), before * after
    limited = np.divide(product, mean, out=np.zeros_like(mean), where=product > 0.0)
    is_smooth = (
        (np.abs(after - before) <= limit)
        & (values[:, :-2] != 0.0)
        & (values[:, 2:] != 0.0)
    )
    return np.concatenate(
        [chord[:, :1], np.where(is_smooth, mean, limited), chord[:, -1:]], axis=1
    )


def pack_torques(
    line: GearedLine, order: Index, torques: Sequence[ShaftTorque], course: LineCourse
) -> Torques:
    """All torques, the degrees of freedom of the line in ``order``."""
    at_of, n_knots, n = np.argsort(order), len(course.time), len(line.names)
    factor = np.ones((len(torques), n_knots))
    per_rad, shift = np.zeros((2, len(torques)))
    for j, torque in enumerate(torques):
        if not 0 <= torque.dof < n:
            raise ConfigError(
                f"torque {j}: degree of freedom {torque.dof} must lie in 0..{n - 1}"
            )
        name = f"torque on '{line.names[torque.dof]}'"
        turning = float(line.rotation[torque.dof])
        if len(torque.table) > 1 and turning == 0.0:
            raise ConfigError(
                f"{name}: a table over its angle needs a degree of freedom that "
                "turns; give one number"
            )
        if torque.factor is not None:
            if torque.factor.shape != (n_knots,):
                raise ConfigError(
                    f"{name}: factor {torque.factor.shape} must be ({n_knots},), the course's knots"
                )
            factor[j] = torque.factor
        sense = 1.0
        if turning < 0.0:
            sense = -1.0
        factor[j] *= sense
        per_rad[j] = sense * len(torque.table) / torque.period
        shift[j] = torque.phase * len(torque.table) / torque.period
    return Torques(
        dof=np.array([at_of[torque.dof] for torque in torques], dtype=np.int64),
        first=np.cumsum(
            [0, *[len(torque.table) for torque in torques]], dtype=np.int64
        ),
        table=np.concatenate(
            [*[torque.table for torque in torques], np.empty(0)]
        ).astype(np.float64),
        per_rad=per_rad,
        shift=shift,
        factor=factor,
    )


def _direction(line: GearedLine, order: Index) -> Array:
    return np.array([mesh.direction[order] for mesh in line.meshes]).reshape(
        -1, len(order)
    )


def _rubbing(line: GearedLine, order: Index) -> Array:
    """Directions of the friction of every mesh and of its moments, (3 mesh, dof)."""
    rows = np.zeros((layout.N_RUBBING * len(line.meshes), len(order)))
    for m, mesh in enumerate(line.meshes):
        if mesh.friction is not None:
            first = layout.N_RUBBING * m
            rows[first : first + layout.N_RUBBING] = mesh.friction.directions[:, order]
    return rows


def _friction(mesh: LineMesh) -> Array:
    """Numbers of the friction of a mesh, (N_FRICTION,); 0 without any."""
    if mesh.friction is None:
        return np.zeros(layout.N_FRICTION)
    return mesh.friction.numbers


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
