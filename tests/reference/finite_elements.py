"""Plane finite elements of spur gears: structural, tooth, cross and crack compliances.

The checker for gear body, tooth and crack models. It shares nothing with them but the geometry
(``gensig.geometry``) and the material: quadratic triangles on the whole gear, bore clamped.

A contact at curvature radius rc presses with a unit force on the +y flank of tooth 0, along the
inward normal of its
involute. The *structural* compliance is the displacement, in the direction of the force, of the
point where the line
of action crosses the tooth centreline: it leaves out the local indentation at the contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, triu
from skfem import Basis, ElementTriP2, ElementVector, MeshTri
from skfem.models.elasticity import linear_elasticity

from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.material import Material
from tests.reference.gear_mesh import (
    MODELLED_TEETH,
    Crack,
    Resolution,
    gear_mesh,
    nearest_node,
    polar_rotation,
    tooth_mesh,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """Factors from the dimensionless solution to a compliance: plane state, elastic constants, face
    width.
    """

    elasticity: str
    material: Material
    face_width: float

    def __post_init__(self) -> None:
        if self.elasticity not in ("plane_stress", "plane_strain"):
            raise ValueError(
                f"elasticity = {self.elasticity!r} must be 'plane_stress' or 'plane_strain'"
            )

    @property
    def unit_compliance(self) -> float:
        """Compliance 1 / (E W), m/N, of which all results are multiples."""
        return 1.0 / (self.material.youngs_modulus * self.face_width)

    @property
    def lame(self) -> tuple[float, float]:
        """Lame constants of the plane state over E."""
        nu = self.material.poisson_ratio
        mu = 0.5 / (1.0 + nu)
        if self.elasticity == "plane_stress":
            return nu / (1.0 - nu**2), mu
        return nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), mu


def structural_compliance(
    gear: Gear,
    curvature_radius: Array,
    plane: Plane,
    *,
    crack: Crack | None = None,
    resolution: Resolution | None = None,
    modelled_teeth: int = MODELLED_TEETH,
) -> Array:
    """Compliance of tooth and body at the crossing of the line of action with the tooth centreline.

    Parameters
    ----------
    curvature_radius : (contact,) m    of the involute at the contact; must lie between junction and
        tip
    crack : slit in tooth 0, or None
    modelled_teeth : teeth with their outline, the others are left out down to the root circle

    Returns
    -------
    (contact,) m/N    positive along the force
    """
    mesh = gear_mesh(
        gear,
        {0: curvature_radius},
        crack=crack,
        resolution=resolution,
        modelled_teeth=modelled_teeth,
    )
    solution = _solve(mesh, _on_bore(gear, mesh), gear, curvature_radius, plane)
    return _along_force(solution, gear, curvature_radius) * plane.unit_compliance


def tooth_compliance(
    gear: Gear,
    curvature_radius: Array,
    plane: Plane,
    *,
    resolution: Resolution | None = None,
) -> Array:
    """Compliance of tooth 0 clamped at its root chord, the line through the ends of its root
    curves.

    Parameters and result as in ``structural_compliance``; zero where the line of action crosses the
    centreline below
    the chord.
    """
    mesh = tooth_mesh(gear, curvature_radius, resolution=resolution)
    chord = gear.root_radius * math.cos(gear.root_half_angle) / gear.normal_module
    solution = _solve(
        mesh, np.flatnonzero(mesh.p[0] < chord + 1e-9), gear, curvature_radius, plane
    )
    inside = _crossing(gear, curvature_radius)[0] > chord
    compliance = np.zeros(len(curvature_radius))
    compliance[inside] = _along_force(
        solution.of(inside), gear, curvature_radius[inside]
    )
    return compliance * plane.unit_compliance


def crack_increment(
    gear: Gear,
    curvature_radius: Array,
    plane: Plane,
    crack: Crack,
    *,
    resolution: Resolution | None = None,
) -> Array:
    """Structural compliance of the cracked less that of the sound gear, (contact,) m/N.

    Both on the same triangles, with the slit open and closed, so that only the crack makes the
    difference. The faces
    of the open slit are free: on the compression side they would in truth close.
    """
    compliance = []
    for opened in (True, False):
        mesh = gear_mesh(
            gear,
            {0: curvature_radius},
            crack=crack,
            opened=opened,
            resolution=resolution,
        )
        solution = _solve(mesh, _on_bore(gear, mesh), gear, curvature_radius, plane)
        compliance.append(_along_force(solution, gear, curvature_radius))
    return (compliance[0] - compliance[1]) * plane.unit_compliance


def cross_compliance(
    gear: Gear,
    curvature_radius: Array,
    plane: Plane,
    *,
    tooth: int,
    resolution: Resolution | None = None,
    modelled_teeth: int = MODELLED_TEETH,
) -> Array:
    """Displacement of the neighbour's contact, along its line of action, per force on tooth 0.

    Parameters
    ----------
    curvature_radius : (contact,) m    at tooth 0; tooth k touches at rc + k p_b, which must lie on
        its involute
    tooth : number k of the neighbour, counted towards the loaded flank (+1: a base pitch further
        along the involute)

    Returns
    -------
    (contact,) m/N    positive where the neighbour moves away from its mate like the loaded tooth
    """
    probed = curvature_radius + tooth * gear.base_pitch
    mesh = gear_mesh(
        gear,
        {0: curvature_radius, tooth: probed},
        resolution=resolution,
        modelled_teeth=modelled_teeth,
    )
    solution = _solve(mesh, _on_bore(gear, mesh), gear, curvature_radius, plane)
    turn = 2.0 * math.pi * tooth / gear.n_teeth
    points = polar_rotation(_flank_point(gear, probed), turn)
    forces = polar_rotation(_force(gear, probed), turn)
    dofs = solution.basis.nodal_dofs[
        :, [nearest_node(mesh, point) for point in points.T]
    ]
    moved = solution.displacement[dofs, np.arange(len(probed))]
    return np.sum(forces * moved, axis=0) * plane.unit_compliance


@dataclass(frozen=True, slots=True)
class Solution:
    """Displacements (dof, load), dimensionless, of unit forces over E and face width."""

    basis: Basis
    displacement: Array

    def of(self, loads: NDArray[np.bool_]) -> Solution:
        """The chosen loads only."""
        return Solution(self.basis, self.displacement[:, loads])


def _solve(
    mesh: MeshTri, clamped: NDArray[np.int64], gear: Gear, radii: Array, plane: Plane
) -> Solution:
    """Displacements under a unit force at each of the curvature radii on tooth 0, one factorisation
    for all.
    """
    basis = Basis(mesh, ElementVector(ElementTriP2()))
    stiffness = linear_elasticity(*plane.lame).assemble(basis).tocsr()
    nodes = [nearest_node(mesh, point) for point in _flank_point(gear, radii).T]
    loads = np.zeros((basis.N, len(radii)))
    loads[basis.nodal_dofs[:, nodes], np.arange(len(radii))] = _force(gear, radii)
    fixed = np.isin(mesh.facets, clamped).all(axis=0)
    free = basis.complement_dofs(basis.get_dofs(facets=np.flatnonzero(fixed)))
    displacement = np.zeros_like(loads)
    displacement[free] = solve_definite(stiffness[free][:, free], loads[free])
    return Solution(basis, displacement)


def solve_definite(matrix: csr_matrix, loads: Array) -> Array:
    """Solve a symmetric positive definite system for (dof, load) right-hand sides; MKL's Pardiso
    where installed.
    """
    try:
        from pypardiso import PyPardisoSolver
    except ImportError:
        from scipy.sparse.linalg import splu

        return splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        ).solve(loads)
    solver = PyPardisoSolver(mtype=2)
    result = solver.solve(triu(matrix, format="csr"), np.asfortranarray(loads))
    solver.free_memory(everything=True)
    return result


def _on_bore(gear: Gear, mesh: MeshTri) -> NDArray[np.int64]:
    return np.flatnonzero(
        np.hypot(*mesh.p) < gear.bore_radius / gear.normal_module + 1e-9
    )


def _flank_point(gear: Gear, radii: Array) -> Array:
    return np.stack(involute_point(gear, radii)) / gear.normal_module


def _force(gear: Gear, radii: Array) -> Array:
    """Unit force on the +y flank of tooth 0, (2, contact)."""
    angle = load_angle(gear, radii)
    return -np.stack([np.sin(angle), np.cos(angle)])


def _crossing(gear: Gear, radii: Array) -> Array:
    """Points at which the line of action crosses the tooth centreline, (2, contact) in modules."""
    x = gear.base_radius / np.cos(load_angle(gear, radii)) / gear.normal_module
    return np.stack([x, np.zeros_like(x)])


def _along_force(solution: Solution, gear: Gear, radii: Array) -> Array:
    values = (
        point_values(solution.basis, _crossing(gear, radii)) @ solution.displacement
    )
    moved = np.diagonal(values.reshape(2, len(radii), len(radii)), axis1=1, axis2=2)
    return np.sum(_force(gear, radii) * moved, axis=0)


def point_values(basis: Basis, points: Array) -> csr_matrix:
    """Matrix from a solution to its values at (dimension, point) points, rows ordered component by
    component.
    """
    return basis.probes(points).tocsr()


def contact_radii(
    gear: Gear, n_contacts: int, *, root_margin: float = 0.05, tip_margin: float
) -> Array:
    """Curvature radii spread evenly over the usable involute, (contact,) m.

    ``root_margin`` is left free at the junction as a share of the involute, ``tip_margin`` at the
    tip in m.
    """
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    start = gear.junction_curvature_radius
    return np.linspace(
        start + root_margin * (tip - start), tip - tip_margin, n_contacts
    )


def root_stress_factor(
    gear: Gear,
    curvature_radius: Array,
    plane: Plane,
    *,
    resolution: Resolution | None = None,
    modelled_teeth: int = MODELLED_TEETH,
) -> tuple[Array, Array]:
    """Largest tension along the loaded side's root curve, over F / (W m) for a force F along the
    line of action.

    Parameters
    ----------
    curvature_radius : (contact,) m    of the involute at the contact

    Returns
    -------
    (contact,)        stress along the free edge: E (plane strain: E / (1 - nu^2)) times its stretch
    (contact,) rad    slope of the edge to the tooth centreline where it is largest; ISO 6336-3
    takes 30 degrees
    """
    mesh = gear_mesh(
        gear,
        {0: curvature_radius},
        resolution=resolution,
        modelled_teeth=modelled_teeth,
    )
    solution = _solve(mesh, _on_bore(gear, mesh), gear, curvature_radius, plane)
    edges = mesh.facets[:, mesh.boundary_facets()]
    middle = mesh.p[:, edges].mean(axis=1)
    junction = (
        math.hypot(gear.base_radius, gear.junction_curvature_radius)
        / gear.normal_module
    )
    bore = 0.5 * (gear.bore_radius + gear.root_radius) / gear.normal_module
    radius, angle = np.hypot(*middle), np.arctan2(middle[1], middle[0])
    on_root = (
        (radius > bore)
        & (radius < junction)
        & (angle > 0.0)
        & (angle < math.pi / gear.n_teeth)
    )
    first, second = edges[:, on_root]
    along = mesh.p[:, second] - mesh.p[:, first]
    along *= np.sign(along[0])  # outward
    length = np.hypot(*along)
    sign = np.sign(mesh.p[0, second] - mesh.p[0, first])
    dofs = solution.basis.nodal_dofs
    moved = (
        solution.displacement[dofs[:, second]] - solution.displacement[dofs[:, first]]
    ) * sign[None, :, None]
    stretch = np.einsum("ce,cel->el", along, moved) / length[:, None] ** 2
    nu = plane.material.poisson_ratio
    stress = stretch / (1.0 if plane.elasticity == "plane_stress" else 1.0 - nu**2)
    at = stress.argmax(axis=0)
    return stress.max(axis=0), np.arctan2(-along[1, at], along[0, at])
