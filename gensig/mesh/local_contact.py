"""Local compliance of the contact: the paper's constant, or Weber and Banaschek's by load."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.material import Material
from gensig.mesh.options import MeshOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactLaw:
    """Compliance of both flanks: factor (constant - log_weight ln(load / width)) / width.

    ``factor`` m2/N, ``constant`` (phase,), ``log_weight`` 0 where the load does not matter.
    """

    factor: float
    constant: Array
    log_weight: float

    def compliance(self, width: Array | float, load: Array | float) -> Array:
        """Secant compliance along the line of action for a width in contact in m under a load in
        N, (phase,) m/N.
        """
        logarithm = np.log(np.asarray(load) / width)
        return self.factor * (self.constant - self.log_weight * logarithm) / width


def linear_contact(position: Array, material: Material) -> ContactLaw:
    """Load-independent contact compliance 4 (1 - nu^2) / (pi E W) of both flanks together.

    Source: spur paper eq. (8). About a quarter of the local compliance that finite elements find.
    """
    relative = 4.0 * (1.0 - material.poisson_ratio**2)
    factor = relative / (math.pi * material.youngs_modulus)
    return ContactLaw(factor=factor, constant=np.ones_like(position), log_weight=0.0)


def weber_contact(pair: GearPair, position: Array, material: Material) -> ContactLaw:
    """Load-dependent secant compliance of both teeth, from the flank to the tooth centreline.

    Parameters
    ----------
    position : (phase,) m    on the path of contact, from A

    Source: Weber & Banaschek (1955), per tooth 2 (1 - nu^2) / (pi E W) [ln(2 h / b) - nu / (2 (1
    - nu))] with the Hertzian half width b and the depth h along the load from the flank to the
    centreline. Plane strain, whatever ``mesh.elasticity`` says of the other terms: the contact is
    far narrower than the face. 91 to 94 % of what finite elements give.
    """
    nu = material.poisson_ratio
    reduced = (1.0 - nu**2) / (math.pi * material.youngs_modulus)
    radius = relative_radius(pair, position)
    constant = -nu / (1.0 - nu) - np.log(8.0 * reduced * radius)
    for side, gear in pair.gears.items():
        curvature = pair.curvature(side, position)
        half_thickness = involute_point(gear, curvature)[1]
        cosine = np.cos(load_angle(gear, curvature))
        constant += np.log(2.0 * half_thickness / cosine)
    return ContactLaw(factor=2.0 * reduced, constant=constant, log_weight=1.0)


def relative_radius(pair: GearPair, position: Array) -> Array:
    """Relative radius of curvature of the flanks at positions on the path, (phase,) m."""
    pinion = pair.pinion_curvature(position)
    wheel = pair.wheel_curvature(position)
    return pinion * wheel / (pinion + wheel)


def contact_law(
    pair: GearPair, position: Array, material: Material, options: MeshOptions
) -> ContactLaw:
    """Contact law that ``options.contact`` names."""
    if options.contact == "linear":
        return linear_contact(position, material)
    return weber_contact(pair, position, material)
