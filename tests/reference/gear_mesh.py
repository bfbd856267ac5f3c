"""Triangle meshes of whole gears and of single teeth, with or without a crack, from the gear's
exact outline.

All lengths of a mesh are in modules (length / normal module): plane elasticity has no size of its
own. Axes are those
of ``gensig.geometry.tooth_profile``: x along the centreline of tooth 0, y towards its loaded flank,
tooth k at the
polar angle 2 pi k / z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from skfem import MeshTri

from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import involute_point, root_curve, root_curve_point

Array = NDArray[np.float64]
Curve = Callable[[Array], tuple[Array, Array]]

MODELLED_TEETH = (
    23  # beyond these, nearest to tooth 0, the outline follows the root circle
)


BORE_EDGES = 96  # at least: a polygon inside the bore makes it smaller
INSIDE_DISTANCE = (
    10.0  # modules from the outline, where edges reach their largest length
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolution:
    """Edge lengths in modules; those of a crack (largest along its faces and at its tip) as shares
    of its depth.
    """

    flank: float = 0.1
    root: float = 0.06
    neighbour: float = 0.2
    far: float = 0.4
    bore: float = 0.5
    crack_face: float = 0.12
    crack_tip: float = 0.005
    inside: float = 1.5

    def scaled(self, factor: float) -> Resolution:
        """All sizes times ``factor``."""
        return Resolution(
            **{field.name: factor * getattr(self, field.name) for field in fields(self)}
        )

    def near(self, crack: Crack | None, module: float) -> Resolution:
        """Sizes with which the root curve is fine enough for a crack."""
        if crack is None:
            return self
        return replace(
            self, root=min(self.root, self.crack_face * crack.depth / module)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Crack:
    """Straight slit from the root curve of tooth 0, inward and towards the gear centre.

    ``start`` is "gamma_mid" or "arc_mid", ``angle`` (rad) is measured from the tooth centreline,
    ``depth`` in m,
    ``side`` is "tension" (the loaded flank, y > 0) or "compression".
    """

    start: str
    angle: float
    depth: float
    side: str = "tension"


def gear_mesh(
    gear: Gear,
    contacts: Mapping[int, Array],
    *,
    crack: Crack | None = None,
    opened: bool = True,
    resolution: Resolution | None = None,
    modelled_teeth: int = MODELLED_TEETH,
) -> MeshTri:
    """Whole gear with the bore as a hole; lengths in modules.

    Parameters
    ----------
    contacts : tooth -> (contact,) m    curvature radii at which the flanks of that tooth get nodes
    crack : slit in tooth 0
    opened : whether the faces of the slit have nodes of their own, all but the tip; if not, the
        mesh is that of the
        sound gear with edges along the slit
    modelled_teeth : number of teeth with their outline, the nearest to tooth 0
    """
    sizes = (resolution or Resolution()).near(crack, gear.normal_module)
    outline = Polyline.closed(
        gear_outline(gear, contacts, crack, sizes, modelled_teeth)
    )
    bore_radius = gear.bore_radius / gear.normal_module
    bore = circle(
        bore_radius, min(sizes.bore, 2.0 * math.pi * bore_radius / BORE_EDGES)
    )
    slits = [] if crack is None else [crack_line(gear, crack, sizes)]
    mesh = triangulate([outline, Polyline.closed(bore)], slits, sizes.inside)
    return open_slit(mesh, slits[0]) if slits and opened else mesh


def tooth_mesh(
    gear: Gear, contacts: Array, *, resolution: Resolution | None = None
) -> MeshTri:
    """Tooth 0 alone, cut off at its root chord (the line through the gamma = pi/2 points); lengths
    in modules.
    """
    sizes = resolution or Resolution()
    tooth = tooth_outline(gear, contacts, sizes.root, sizes.flank)
    n_chord = math.ceil((tooth[1, -1] - tooth[1, 0]) / sizes.root)
    chord = np.linspace(tooth[:, -1], tooth[:, 0], n_chord + 1, axis=1)
    return triangulate(
        [Polyline.closed(np.hstack([tooth, chord[:, 1:-1]]))], [], sizes.inside
    )


def tooth_outline(
    gear: Gear,
    contacts: Array,
    root_size: float,
    flank_size: float,
    root_knots: Sequence[float] = (),
) -> Array:
    """Outline of tooth 0 from its -y root point over the tip to its +y root point, (2, node) in
    modules.

    ``contacts`` (curvature radii, m) and ``root_knots`` (gamma, rad) become nodes on both flanks.
    """
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    gammas = [0.5 * math.pi, *sorted(root_knots, reverse=True), gear.pressure_angle]
    radii = _distinct(
        [gear.junction_curvature_radius, *np.sort(contacts), tip],
        1e-6 * gear.normal_module,
    )
    root = _sample(
        lambda gamma: root_curve(gear, gamma), gammas, root_size * gear.normal_module
    )
    flank = _sample(
        lambda radius: involute_point(gear, radius),
        radii,
        flank_size * gear.normal_module,
    )
    half = np.hstack([root[:, :-1], flank]) / gear.normal_module
    half_tip = gear.half_tooth_angle_at(gear.tip_radius)
    top = _arc(gear.tip_radius / gear.normal_module, -half_tip, half_tip, flank_size)
    mirrored = half * np.array([[1.0], [-1.0]])
    return np.hstack([mirrored[:, :-1], top, half[:, -2::-1]])


def crack_start_gamma(gear: Gear, start: str) -> float:
    """Parameter gamma of the root curve at the crack's start."""
    radius = math.hypot(*root_curve_point(gear, start))
    return brentq(
        lambda gamma: (
            math.hypot(
                *(float(value[0]) for value in root_curve(gear, np.array([gamma])))
            )
            - radius
        ),
        gear.pressure_angle,
        0.5 * math.pi,
        xtol=1e-14,
    )


def crack_line(gear: Gear, crack: Crack, sizes: Resolution) -> Array:
    """Nodes of the slit from mouth to tip, refined towards the tip, (2, node) in modules."""
    x, y = (np.array(root_curve_point(gear, crack.start))) / gear.normal_module
    side = {"tension": 1.0, "compression": -1.0}[crack.side]
    depth = crack.depth / gear.normal_module
    along = depth - growing_steps(depth, sizes.crack_tip * depth, sizes.root)[::-1]
    return np.stack(
        [x - along * math.cos(crack.angle), side * (y - along * math.sin(crack.angle))]
    )


def growing_steps(length: float, first: float, largest: float) -> Array:
    """Distances from 0 to ``length`` in steps that grow by a quarter each, from about ``first`` to
    ``largest``.
    """
    distances, step = [0.0], first
    while distances[-1] < length:
        distances.append(distances[-1] + step)
        step = min(1.25 * step, largest)
    return np.array(distances) * (length / distances[-1])


def polar_rotation(points: Array, angle: float) -> Array:
    """Points turned about the gear centre by ``angle``."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]]) @ points


def signed_tooth(tooth: int, n_teeth: int) -> int:
    """Tooth number counted the short way round from tooth 0."""
    return (tooth + n_teeth // 2) % n_teeth - n_teeth // 2


def gear_outline(
    gear: Gear,
    contacts: Mapping[int, Array],
    crack: Crack | None,
    sizes: Resolution,
    modelled_teeth: int,
) -> Array:
    """Outline of the whole gear counter-clockwise, (2, node) in modules; arguments as in
    ``gear_mesh``.
    """
    z, module = gear.n_teeth, gear.normal_module
    knots = () if crack is None else (crack_start_gamma(gear, crack.start),)
    pieces = []
    for tooth in range(z):
        distance = abs(signed_tooth(tooth, z))
        root_size, size = _tooth_sizes(distance, sizes)
        flank_contacts = contacts.get(signed_tooth(tooth, z), np.empty(0))
        here = gear.root_half_angle
        if 2 * distance < modelled_teeth or z <= modelled_teeth:
            outline = tooth_outline(
                gear, flank_contacts, root_size, size, knots if tooth == 0 else ()
            )
        else:
            outline = _arc(gear.root_radius / module, -here, here, size)
        gap = _arc(gear.root_radius / module, here, 2.0 * math.pi / z - here, root_size)
        pieces.append(
            polar_rotation(
                np.hstack([outline, gap[:, 1:-1]]), 2.0 * math.pi * tooth / z
            )
        )
    return np.hstack(pieces)


def _tooth_sizes(distance: int, sizes: Resolution) -> tuple[float, float]:
    """Edge lengths on the root and on the flank of a tooth ``distance`` teeth away from tooth 0."""
    if distance == 0:
        return sizes.root, sizes.flank
    size = sizes.neighbour if distance == 1 else sizes.far
    return size, size


def _sample(curve: Curve, knots: Sequence[float], size: float) -> Array:
    """Points of a curve, (2, node): at all knots, and between them at equal arc lengths up to
    ``size``.
    """
    points = [np.stack(curve(np.array([knots[0]])))]
    for start, end in pairwise(knots):
        fine = np.linspace(start, end, 201)
        x, y = curve(fine)
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        n_pieces = max(1, math.ceil(arc[-1] / size - 1e-9))
        expected = np.interp(np.linspace(0.0, arc[-1], n_pieces + 1)[1:-1], arc, fine)
        points.append(np.stack(curve(np.append(expected, end))))
    return np.hstack(points)


def _arc(radius: float, start: float, end: float, size: float) -> Array:
    return _sample(
        lambda polar: (radius * np.cos(polar), radius * np.sin(polar)),
        [start, end],
        size,
    )


def circle(radius: float, size: float) -> Array:
    """Nodes around the gear centre, (2, node)."""
    return _arc(radius, 0.0, 2.0 * math.pi, size)[:, :-1]


def _distinct(values: Sequence[float], tolerance: float) -> list[float]:
    """Ascending values without repetitions; the ends stay."""
    first, *middle, last = [float(value) for value in values]
    kept = [first]
    for value in middle:
        if kept[-1] + tolerance < value < last - tolerance:
            kept.append(value)
    return [*kept, last]


@dataclass(frozen=True, slots=True)
class Polyline:
    """Nodes (2, node) of a boundary or an inner line, and the edge length (node,) wanted around
    each.
    """

    points: Array
    sizes: Array

    @classmethod
    def closed(cls, points: Array) -> Polyline:
        """Closed line; sizes from the edges that meet in each node."""
        edges = np.hypot(*np.diff(points, axis=1, append=points[:, :1]))
        return cls(points, np.maximum(edges, np.roll(edges, 1)))

    @classmethod
    def open(cls, points: Array, size: float) -> Polyline:
        """Open line; a single point gets ``size``."""
        edges = (
            np.hypot(*np.diff(points, axis=1))
            if points.shape[1] > 1
            else np.array([size])
        )
        return cls(
            points,
            np.maximum(np.append(edges, edges[-1]), np.append(edges[0], edges))[
                : points.shape[1]
            ],
        )


def triangulate(
    loops: Sequence[Polyline], inner: Sequence[Array], inside_size: float
) -> MeshTri:
    """Triangles inside the first closed loop and outside the others, with nodes and edges along the
    inner lines.

    Every edge of the lines is one edge of a triangle; elsewhere edges grow with the distance from
    the nearest line.

    Parameters
    ----------
    inner : lines (2, node) without branches, or single points; nodes on a loop must be nodes of
        that loop
    inside_size : edge length at ``INSIDE_DISTANCE`` from the lines, modules
    """
    _start_gmsh()
    try:
        _describe(loops, inner, inside_size)
        gmsh.model.mesh.generate(2)
        return _read_triangles()
    finally:
        gmsh.finalize()


def _describe(
    loops: Sequence[Polyline], inner: Sequence[Array], inside_size: float
) -> None:
    """Geometry and wanted edge lengths as gmsh takes them."""
    geo = gmsh.model.geo
    tags: dict[tuple[float, float], int] = {}

    def place(line: Polyline) -> list[int]:
        nodes = []
        for (x, y), size in zip(line.points.T, line.sizes, strict=True):
            key = (round(x, 7), round(y, 7))
            if key not in tags:
                tags[key] = geo.addPoint(x, y, 0.0, size)
            nodes.append(tags[key])
        return nodes

    def connect(nodes: Sequence[int]) -> list[int]:
        edges = [geo.addLine(a, b) for a, b in pairwise(nodes)]
        for edge in edges:
            geo.mesh.setTransfiniteCurve(edge, 2)
        return edges

    loop_tags = []
    for loop in loops:
        nodes = place(loop)
        loop_tags.append(geo.addCurveLoop(connect([*nodes, nodes[0]])))
    surface = geo.addPlaneSurface(loop_tags)
    embedded = [place(Polyline.open(line, inside_size)) for line in inner]
    edges = [edge for nodes in embedded for edge in connect(nodes)]
    geo.synchronize()
    gmsh.model.mesh.embed(1, edges, 2, surface)
    gmsh.model.mesh.embed(
        0, [nodes[0] for nodes in embedded if len(nodes) == 1], 2, surface
    )
    _grow_inwards(inside_size)


def _start_gmsh() -> None:
    """A fresh gmsh for every mesh: otherwise a mesh would depend on those made before it."""
    gmsh.initialize(interruptible=False)
    for key, value in (
        ("General.Terminal", 0),
        ("General.NumThreads", 1),
        ("Mesh.Algorithm", 6),
        ("Mesh.RandomSeed", 1),
        ("Mesh.MeshSizeExtendFromBoundary", 0),
    ):
        gmsh.option.setNumber(key, value)
    gmsh.model.add("gear")


def _grow_inwards(inside_size: float) -> None:
    """Let the edge length grow from that of the nearest line to ``inside_size`` at
    ``INSIDE_DISTANCE``.
    """
    field = gmsh.model.mesh.field.add("Extend")
    gmsh.model.mesh.field.setNumbers(
        field, "CurvesList", [tag for _, tag in gmsh.model.getEntities(1)]
    )
    gmsh.model.mesh.field.setNumber(field, "DistMax", INSIDE_DISTANCE)
    gmsh.model.mesh.field.setNumber(field, "SizeMax", inside_size)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)


def _read_triangles() -> MeshTri:
    node_tags, coordinates, _ = gmsh.model.mesh.getNodes()
    triangles = gmsh.model.mesh.getElementsByType(2)[1].reshape(-1, 3)
    order = np.argsort(node_tags)
    cells = order[np.searchsorted(node_tags, triangles, sorter=order)]
    used, cells = np.unique(cells, return_inverse=True)
    return MeshTri(
        coordinates.reshape(-1, 3)[used, :2].T.copy(), cells.reshape(-1, 3).T.copy()
    )


def open_slit(mesh: MeshTri, slit: Array) -> MeshTri:
    """Give the two faces of a straight slit (mouth to tip) nodes of their own; the tip stays
    shared.
    """
    nodes = [nearest_node(mesh, point) for point in slit.T[:-1]]
    copies = np.arange(mesh.nvertices)
    copies[nodes] = mesh.nvertices + np.arange(len(nodes))
    return MeshTri(
        np.hstack([mesh.p, mesh.p[:, nodes]]),
        np.where(left_of(mesh, slit), copies[mesh.t], mesh.t),
    )


def left_of(mesh: MeshTri, slit: Array) -> NDArray[np.bool_]:
    """Mask of the triangles on the left of the straight line from mouth to tip."""
    direction = slit[:, -1] - slit[:, 0]
    centres = mesh.p[:, mesh.t].mean(axis=1) - slit[:, :1]
    return direction[0] * centres[1] - direction[1] * centres[0] > 0.0


def nearest_node(mesh: MeshTri, point: Array) -> int:
    """Number of the mesh node at ``point``; raises where there is none."""
    distance = np.hypot(*(mesh.p[:2] - np.asarray(point)[:2, None]))
    node = int(np.argmin(distance))
    if distance[node] > 1e-6:
        raise ValueError(
            f"no mesh node at {np.asarray(point)}; the nearest is {distance[node]:.2g} modules away"
        )
    return node
