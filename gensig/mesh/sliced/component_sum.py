"""Stiffness of a pair of teeth by the literal eq. (14) of the paper on helical stiffness.

Each component is added up over the slices first, and the sums are in series. A slice's own series
of components, added up over the slices, is never stiffer (Cauchy).
"""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.geometry.tooth import healthy_tooth
from gensig.material import Material
from gensig.mesh.pair_table import structural_terms
from gensig.mesh.sliced.slices import SlicedMesh, cut_by_field, pair_positions
from gensig.mesh.thermal.paper_growth import PaperGrowth
from gensig.mesh.thermal.paper_teeth import paper_terms


def component_compliances(
    mesh: SlicedMesh, material: Material, hot_teeth: PaperGrowth | None
) -> dict[tuple[str, str], Array]:
    """Compliance per width of each component of each gear at the mesh's nodes, (node,) m2/N."""
    pair, options = mesh.pair, mesh.options
    clipped = np.clip(mesh.position, 0.0, pair.path_of_contact)
    on_path, inverse = np.unique(clipped, return_inverse=True)
    in_plane, components = material.in_plane(options.elasticity), {}
    for side, gear in pair.gears.items():
        if hot_teeth is not None:
            hot = pair, side, on_path, in_plane, options, hot_teeth
            terms = paper_terms(*hot)
        else:
            curvature = pair.curvature(side, on_path)
            terms = structural_terms(healthy_tooth(gear), curvature, in_plane, options)
        for name, values in terms.items():
            if values.any():
                components[side, name] = (values * gear.face_width)[inverse]
    return components


def component_pair_stiffness(
    mesh: SlicedMesh,
    components: dict[tuple[str, str], Array],
    position: Array,
    force: float,
) -> Array:
    """Stiffness of one pair of teeth, (phase,) N/m; 0 where no slice is on the path.

    Parameters
    ----------
    components : from ``component_compliances``
    position : (phase,) m    of the first slice, from A
    force : N                its even load per width is that of a load-dependent contact term
    """
    middle, share = cut_by_field(mesh, position[:, None] - mesh.lag)
    width = mesh.slice_width * share
    constant = np.interp(middle, mesh.position, mesh.contact_constant)
    logarithm = math.log(force / mesh.pair.face_width)
    contact = mesh.contact_factor * (constant - mesh.log_weight * logarithm)
    touches = width.sum(axis=1) > 0.0
    softness = np.zeros(len(position))
    for compliance in (
        contact,
        *(np.interp(middle, mesh.position, values) for values in components.values()),
    ):
        stiffness = np.where(touches, np.sum(width / compliance, axis=1), 1.0)
        softness += 1.0 / stiffness
    return np.where(touches, 1.0 / softness, 0.0)


def component_mesh_stiffness(
    mesh: SlicedMesh,
    components: dict[tuple[str, str], Array],
    roll: Array,
    force: float,
) -> Array:
    """Stiffness of all pairs in contact, their sum as the paper has it, (phase,) N/m.

    Parameters
    ----------
    roll : (phase,) m    at 0 the first slice of a pair enters at A
    """
    _, index = pair_positions(mesh, roll)
    total = np.zeros(len(roll))
    for number in index.T:
        position = roll - number * mesh.pair.base_pitch
        total += component_pair_stiffness(mesh, components, position, force)
    return total
