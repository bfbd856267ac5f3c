"""Local compliance of the contact: the paper's constant term, or the load-dependent one of Weber and Banaschek."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.material import Material
from gensig.mesh.options import MeshOptions

Array = NDArray[np.float64]


def linear_contact_compliance(contact_width: Array, material: Material) -> Array:
    """Load-independent contact compliance 4 (1 - nu^2) / (pi E W) of both flanks together, (phase,) m/N.

    Source: spur paper eq. (8). About a quarter of the local compliance that finite elements find.
    """
    return 4.0 * (1.0 - material.poisson_ratio**2) / (np.pi * material.youngs_modulus * contact_width)


def weber_contact_compliance(
    pair: GearPair, position: Array, contact_width: Array, load: Array, material: Material
) -> Array:
    """Load-dependent local compliance of both teeth, from the flank to the tooth centreline, as a secant.

    Parameters
    ----------
    position : (phase,) m    on the path of contact, from A
    contact_width : (phase,) m
    load : (phase,) N        normal load of the pair

    Returns
    -------
    (phase,) m/N, along the line of action

    Source: Weber & Banaschek (1955), per tooth 2 (1 - nu^2) / (pi E W) [ln(2 h / b) - nu / (2 (1 - nu))] with the
    Hertzian half width b and the depth h along the load from the flank to the centreline. Plane strain, whatever
    ``mesh.elasticity`` says of the other terms: the contact is far narrower than the face. 91 to 94 % of what finite
    elements give.
    """
    reduced = (1.0 - material.poisson_ratio**2) / (math.pi * material.youngs_modulus)
    curvatures = [np.asarray(pair.pinion_curvature(position)), np.asarray(pair.wheel_curvature(position))]
    relative = curvatures[0] * curvatures[1] / (curvatures[0] + curvatures[1])
    half_width = np.sqrt(8.0 * reduced * relative * load / contact_width)
    total = np.zeros_like(position)
    for gear, curvature in zip((pair.pinion, pair.wheel), curvatures, strict=True):
        depth = involute_point(gear, curvature)[1] / np.cos(load_angle(gear, curvature))
        logarithm = np.log(2.0 * depth / half_width) - 0.5 * material.poisson_ratio / (1.0 - material.poisson_ratio)
        total += 2.0 * reduced / contact_width * logarithm
    return total


def contact_compliance(
    pair: GearPair, position: Array, contact_width: Array, load: Array, material: Material, options: MeshOptions
) -> Array:
    """Local compliance of a pair by the chosen term, (phase,) m/N; see the two above."""
    if options.contact == "linear":
        return linear_contact_compliance(contact_width, material)
    return weber_contact_compliance(pair, position, contact_width, load, material)
