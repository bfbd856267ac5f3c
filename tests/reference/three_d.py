"""Three-dimensional elements: the 23-tooth pinion with faults over a part of its face width.

A plane mesh of the whole pinion is extruded in layers of quadratic tetrahedra. The bore is clamped
over the whole
width, the end faces are free. Sound gear and faults share one mesh, so that only the fault makes
the difference.
Axes and lengths (modules) are those of ``gear_mesh``; z runs from one end face to the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.sparse import csr_matrix
from skfem import Basis, ElementTetP2, ElementVector, MeshTet, MeshTri
from skfem.models.elasticity import lame_parameters

from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import involute_point, load_angle
from tests.reference.finite_elements import solve_definite
from tests.reference.gear_mesh import (
    Crack,
    Polyline,
    Resolution,
    circle,
    crack_line,
    gear_outline,
    growing_steps,
    left_of,
    nearest_node,
    triangulate,
)

Array = NDArray[np.float64]
Row = dict[str, Any]

N_STRIPS = 8  # of equal width, each under a uniform line load
CRACK_DEPTHS = (0.5, 1.0)  # modules
CRACK_EXTENTS = (0.25, 0.5, 1.0)  # of the face width, from the end face z = 0
CRACK_START, CRACK_ANGLE = "arc_mid", math.radians(45.0)
PIT_HEIGHT, PIT_DEPTH = (
    0.5,
    0.25,
)  # modules: along the tooth centreline, and in the thickness direction
PIT_STRIPS = range(2, 6)  # its extent: the middle half of the width
SECTION = Resolution(
    flank=0.25,
    root=0.2,
    neighbour=0.8,
    far=2.0,
    bore=1.5,
    crack_face=0.25,
    crack_tip=0.06,
    inside=2.2,
)
CELLS_AT_ONCE = 30_000  # bounds the memory of the assembly
LAYERS = (
    2,
    4,
    4,
    4,
    4,
    2,
    2,
    2,
)  # in each eighth of the width; the cracks end after the second and the fourth


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Crack over a share of the width from z = 0, or pit, or (both empty) the sound gear."""

    name: str
    crack_depth: float = 0.0
    crack_extent: float = 0.0
    pitted: bool = False


FAULTS = (
    Fault(name="sound"),
    *(
        Fault(name="crack", crack_depth=depth, crack_extent=part)
        for depth in CRACK_DEPTHS
        for part in CRACK_EXTENTS
    ),
    Fault(name="pit", pitted=True),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Extrusion:
    """Plane mesh with edges along the deepest crack and the pit's walls, and the heights (plane,)
    of the layers.
    """

    section: MeshTri
    slit: Array
    pit: NDArray[np.bool_]
    heights: Array

    def tetrahedra(self, fault: Fault) -> MeshTet:
        """Mesh with the fault: three tetrahedra to a prism, alike on both sides of every face."""
        n_plane, n_layers = self.section.nvertices, len(self.heights) - 1
        low = np.sort(self.section.t, axis=0)
        high = low + n_plane
        prism = np.stack(
            [[*low, high[2]], [*low[:2], *high[1:]], [low[0], *high]], axis=1
        )
        cells = prism[:, None] + n_plane * np.arange(n_layers)[None, :, None, None]
        middle = 0.5 * (self.heights[1:] + self.heights[:-1]) / self.heights[-1]
        points = np.vstack(
            [np.tile(self.section.p, n_layers + 1), np.repeat(self.heights, n_plane)]
        )
        if fault.crack_depth > 0.0:
            points, cells = self._cracked(fault, points, cells, middle)
        strip = np.floor(middle * N_STRIPS)
        kept = ~(np.isin(strip, PIT_STRIPS)[:, None, None] & self.pit & fault.pitted)
        cells = cells[:, np.broadcast_to(kept, cells.shape[1:])]
        used, cells = np.unique(cells, return_inverse=True)
        return MeshTet(
            np.ascontiguousarray(points[:, used]),
            np.ascontiguousarray(cells.reshape(4, -1)),
        )

    def _cracked(
        self, fault: Fault, points: Array, cells: NDArray[np.int64], middle: Array
    ) -> tuple[Array, NDArray[np.int64]]:
        """Own nodes for the face left of the slit; nodes along the crack front stay shared."""
        reach = np.hypot(*(self.slit - self.slit[:, :1]))
        opened = [
            nearest_node(self.section, point)
            for point in self.slit.T[reach < fault.crack_depth - 1e-6]
        ]
        extent = fault.crack_extent * self.heights[-1]
        planes = np.flatnonzero(
            (self.heights < extent - 1e-6) | (fault.crack_extent >= 1.0)
        )
        nodes = (planes[:, None] * self.section.nvertices + np.array(opened)).ravel()
        copies = np.arange(points.shape[1])
        copies[nodes] = points.shape[1] + np.arange(len(nodes))
        left = (
            left_of(self.section, self.slit)
            & (middle < fault.crack_extent)[:, None, None]
        )
        return np.hstack([points, points[:, nodes]]), np.where(
            left, copies[cells], cells
        )


def extrude(
    gear: Gear,
    radii: Array,
    *,
    sizes: Resolution = SECTION,
    layers: Sequence[int] = LAYERS,
) -> Extrusion:
    """The gear's section with nodes at contacts and on the centreline, and layers over its face
    width.
    """
    module = gear.normal_module
    crack = Crack(
        start=CRACK_START, angle=CRACK_ANGLE, depth=max(CRACK_DEPTHS) * module
    )
    slit = _slit(gear, sizes)
    ends = _pit_ends(gear, radii[0])
    outline = gear_outline(
        gear, {0: np.append(radii, ends)}, crack, sizes, modelled_teeth=3
    )
    floor = np.stack(involute_point(gear, ends)) / module - np.array(
        [[0.0], [PIT_DEPTH]]
    )
    wall = np.stack(involute_point(gear, ends)) / module
    pit_line = np.hstack(
        [wall[:, :1], np.linspace(floor[:, 0], floor[:, 1], 4, axis=1), wall[:, 1:]]
    )
    crossings = [_crossing(gear, radius)[:, None] for radius in radii]
    bore = circle(gear.bore_radius / module, sizes.bore)
    section = triangulate(
        [Polyline.closed(outline), Polyline.closed(bore)],
        [slit, pit_line, *crossings],
        sizes.inside,
    )
    centre = section.p[:, section.t].mean(axis=1)
    between = (wall[0, 0] < centre[0]) & (centre[0] < wall[0, 1])
    on_tooth = np.arctan2(centre[1], centre[0]) < math.pi / gear.n_teeth
    pit = on_tooth & between & (centre[1] > np.interp(centre[0], floor[0], floor[1]))
    width = gear.face_width / module
    edges = np.linspace(0.0, width, N_STRIPS + 1)
    heights = np.concatenate(
        [_graded(edges, index, count) for index, count in enumerate(layers)] + [[width]]
    )
    return Extrusion(section=section, slit=slit, pit=pit, heights=heights)


def _slit(gear: Gear, sizes: Resolution) -> Array:
    """Nodes of the deepest crack, refined at the tip of every depth."""
    line = crack_line(
        gear,
        Crack(start=CRACK_START, angle=CRACK_ANGLE, depth=gear.normal_module),
        sizes,
    )
    mouth, direction = line[:, :1], line[:, -1:] - line[:, :1]
    first, *deeper = CRACK_DEPTHS
    along = [
        first
        - growing_steps(first, sizes.crack_tip * first, sizes.crack_face * first)[::-1]
    ]
    for start, end in zip(CRACK_DEPTHS, deeper, strict=False):
        half = growing_steps(
            0.5 * (end - start), sizes.crack_tip * start, sizes.crack_face * start
        )
        along += [start + half[1:], end - half[-2::-1]]
    return mouth + direction * np.concatenate(along)


def _pit_ends(gear: Gear, pitch: float) -> Array:
    """Curvature radii at both ends of the pit, centred on the pitch point, (2,) m."""
    centre = involute_point(gear, np.array([pitch]))[0][0]
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)

    def beyond(radius: float, half: float) -> float:
        return float(
            involute_point(gear, np.array([radius]))[0][0]
            - centre
            - half * gear.normal_module
        )

    lower = brentq(
        beyond, gear.junction_curvature_radius, pitch, args=(-0.5 * PIT_HEIGHT,)
    )
    return np.array([lower, brentq(beyond, pitch, tip, args=(0.5 * PIT_HEIGHT,))])


def _graded(edges: Array, index: int, count: int) -> Array:
    """Lower faces of the layers of one strip, thinner towards the ends of cracks."""
    fronts = [round(extent * N_STRIPS) for extent in CRACK_EXTENTS[:-1]]
    share = np.linspace(0.0, 1.0, count + 1)[:-1]
    if index + 1 in fronts:
        share = 1.0 - (1.0 - share) ** 1.6
    elif index in fronts:
        share = share**1.6
    return edges[index] + share * (edges[index + 1] - edges[index])


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """Compliances over the tooth's width, each times E and face width.

    ``strips`` (contact, strip measured, strip loaded): mean displacement of a strip of the
    centreline crossing in the
    force direction, per force on a strip of the contact line. ``profile`` (contact, strip end):
    displacement under
    a uniform line load over the whole width.
    """

    strips: Array
    profile: Array


def solve(gear: Gear, radii: Array, mesh: MeshTet, poisson_ratio: float) -> Response:
    """Strip responses at every contact, one factorisation."""
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=1)
    stiffness = _stiffness(
        mesh, basis.element_dofs, *lame_parameters(1.0, poisson_ratio)
    )
    bore = np.hypot(*mesh.p[:2]) < gear.bore_radius / gear.normal_module + 1e-6
    free = basis.complement_dofs(
        basis.get_dofs(facets=np.flatnonzero(bore[mesh.facets].all(axis=0)))
    )
    forces = [_force(gear, radius) for radius in radii]
    flank = [
        np.stack(involute_point(gear, np.array([radius])))[:, 0] / gear.normal_module
        for radius in radii
    ]
    loads = np.hstack(
        [_strip_means(basis, mesh, p, f) for p, f in zip(flank, forces, strict=True)]
    )
    displacement = np.zeros_like(loads)
    displacement[free] = solve_definite(stiffness[free][:, free], loads[free])
    width = gear.face_width / gear.normal_module
    strips, profile = [], []
    for index, (radius, force) in enumerate(zip(radii, forces, strict=True)):
        moved = displacement[:, index * N_STRIPS : (index + 1) * N_STRIPS]
        crossing = _crossing(gear, radius)
        strips.append(_strip_means(basis, mesh, crossing, force).T @ moved)
        line = _line_nodes(mesh, crossing)
        ends = [
            line[np.argmin(np.abs(mesh.p[2, line] - z))]
            for z in np.linspace(0.0, width, N_STRIPS + 1)
        ]
        profile.append(
            np.tensordot(force, moved.mean(axis=1)[basis.nodal_dofs[:2, ends]], axes=1)
        )
    return Response(strips=np.stack(strips) * width, profile=np.stack(profile) * width)


def _stiffness(
    mesh: MeshTet, dofs: NDArray[np.int64], lame_lambda: float, lame_mu: float
) -> csr_matrix:
    """Stiffness of isotropic elasticity; ``dofs`` (3 x basis function, cell), components running
    fastest.

    With D[ia, jb] the integral of d_a phi_i d_b phi_j: lambda D[ia, jb] + mu D[ib, ja] + mu
    delta_ab D[ic, jc].
    """
    n_dofs, n_local = int(dofs.max()) + 1, len(dofs)
    total = csr_matrix((n_dofs, n_dofs))
    for cells in np.array_split(
        np.arange(mesh.nelements), math.ceil(mesh.nelements / CELLS_AT_ONCE)
    ):
        scalar = Basis(mesh, ElementTetP2(), elements=cells, intorder=2)
        gradient = np.stack([shape[0].grad for shape in scalar.basis]) * np.sqrt(
            scalar.dx
        )
        gradient = gradient.transpose(2, 0, 1, 3).reshape(len(cells), n_local, -1)
        products = (gradient @ gradient.transpose(0, 2, 1)).reshape(
            len(cells), n_local // 3, 3, n_local // 3, 3
        )
        local = lame_lambda * products + lame_mu * products.swapaxes(2, 4)
        trace = lame_mu * np.einsum("eicjc->eij", products)
        for axis in range(3):
            local[:, :, axis, :, axis] += trace
        rows = np.broadcast_to(dofs.T[cells, :, None], (len(cells), n_local, n_local))
        columns = np.broadcast_to(
            dofs.T[cells, None, :], (len(cells), n_local, n_local)
        )
        total = total + csr_matrix(
            (local.ravel(), (rows.ravel(), columns.ravel())), shape=total.shape
        )
    return total


def _strip_means(basis: Basis, mesh: MeshTet, place: Array, force: Array) -> Array:
    """Vectors (dof, strip) whose product with a displacement is its mean over a strip of the line
    at ``place``.

    As loads they are uniform line loads of unit resultant. Strips where the line is interrupted get
    nothing.
    """
    line = _line_nodes(mesh, place)
    z = mesh.p[2, line]
    strip_width = mesh.p[2].max() / N_STRIPS
    low, high = np.minimum(line[:-1], line[1:]), np.maximum(line[:-1], line[1:])
    keys = mesh.edges[0].astype(np.int64) * mesh.nvertices + mesh.edges[1]
    order = np.argsort(keys)
    expected = low * mesh.nvertices + high
    result = order[
        np.minimum(np.searchsorted(keys, expected, sorter=order), len(keys) - 1)
    ]
    vectors = np.zeros((basis.N, N_STRIPS))
    for layer in np.flatnonzero(keys[result] == expected):
        strip = int(0.5 * (z[layer] + z[layer + 1]) / strip_width)
        share = (z[layer + 1] - z[layer]) / strip_width
        for weight, dofs in (
            (1.0 / 6.0, basis.nodal_dofs[:2, line[layer]]),
            (1.0 / 6.0, basis.nodal_dofs[:2, line[layer + 1]]),
            (4.0 / 6.0, basis.edge_dofs[:2, result[layer]]),
        ):
            vectors[dofs, strip] += share * weight * force
    return vectors


def _line_nodes(mesh: MeshTet, place: Array) -> NDArray[np.int64]:
    """Nodes over a point of the section, by z."""
    nodes = np.flatnonzero(np.hypot(*(mesh.p[:2] - place[:, None])) < 1e-6)
    return nodes[np.argsort(mesh.p[2, nodes])]


def _force(gear: Gear, radius: float) -> Array:
    angle = float(load_angle(gear, np.array([radius]))[0])
    return -np.array([math.sin(angle), math.cos(angle)])


def _crossing(gear: Gear, radius: float) -> Array:
    """Points at which the line of action crosses the tooth centreline, (2,) modules."""
    angle = float(load_angle(gear, np.array([radius]))[0])
    return np.array([gear.base_radius / math.cos(angle) / gear.normal_module, 0.0])


def three_d(
    gear: Gear, points: dict[str, float], poisson_ratio: float
) -> dict[str, list[Row]]:
    """Tables of all faults; ``points`` names curvature radii (m), the pitch point "C" first."""
    radii = np.array(list(points.values()))
    extrusion = extrude(gear, radii)
    summary: list[Row] = []
    flexibility: list[Row] = []
    for fault in FAULTS:
        response = solve(gear, radii, extrusion.tetrahedra(fault), poisson_ratio)
        summary += summary_rows(fault, response, points, gear.normal_module)
        flexibility += flexibility_rows(fault, response)
    return {"three_d": summary, "three_d_flexibility": flexibility}


def rigid_compliance(strips: Array) -> float:
    """Compliance when all strips (measured, loaded) must move alike."""
    return 1.0 / float(np.linalg.solve(strips, np.ones(len(strips))).sum())


def summary_rows(
    fault: Fault, response: Response, points: dict[str, float], module: float
) -> Iterator[Row]:
    """Means and profiles over the width; compliance of a rigid contact at the pitch point C."""
    outside = [strip for strip in range(N_STRIPS) if strip not in PIT_STRIPS]
    for index, (point, radius) in enumerate(points.items()):
        head = _fault_columns(fault) | {
            "point": point,
            "curvature_radius_over_module": radius / module,
        }
        whole, partial = (
            response.strips[index],
            response.strips[index][np.ix_(outside, outside)],
        )
        if not fault.pitted:
            yield head | _value("mean", 1.0, whole.mean())
            for place, value in enumerate(response.profile[index]):
                yield head | _value("profile", 1.0, value, place / N_STRIPS)
        if point == "C" and not fault.pitted:
            yield head | _value("rigid", 1.0, rigid_compliance(whole))
        if point == "C" and fault.crack_depth == 0.0:
            yield head | _value("mean", len(outside) / N_STRIPS, partial.mean())
            yield head | _value(
                "rigid", len(outside) / N_STRIPS, rigid_compliance(partial)
            )


def flexibility_rows(fault: Fault, response: Response) -> Iterator[Row]:
    """Matrix between strips at the pitch point C, without the unloaded strips in the pit."""
    for measured in range(N_STRIPS):
        for loaded in range(N_STRIPS):
            if not (fault.pitted and (measured in PIT_STRIPS or loaded in PIT_STRIPS)):
                value = float(response.strips[0, measured, loaded])
                yield _fault_columns(fault) | {
                    "strip_measured": measured,
                    "strip_loaded": loaded,
                    "compliance": value,
                }


def _fault_columns(fault: Fault) -> Row:
    return {
        "fault": fault.name,
        "crack_depth_over_module": fault.crack_depth,
        "crack_extent_over_width": fault.crack_extent,
    }


def _value(
    quantity: str, loaded: float, compliance: float, place: float | None = None
) -> Row:
    where = "" if place is None else place
    return {
        "quantity": quantity,
        "loaded_over_width": loaded,
        "z_over_width": where,
        "compliance": float(compliance),
    }
