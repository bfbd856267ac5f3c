"""Tooth compliance by the potential-energy method: a tapered cantilever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.geometry.tooth import Tooth
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.material import Material
from gensig.mesh.tooth_sections import sections

# parabolic shear of a long prismatic beam, spur paper eq. (4), or even shear: see tooth_compliance
SHEAR_FACTORS = {"to_contact": 1.2, "to_centreline": 1.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothCompliance:
    """Compliances of one tooth along the line of action, each (phase,) m/N."""

    bending: Array
    shear: Array
    axial: Array

    @property
    def total(self) -> Array:
        """Their sum, (phase,) m/N."""
        return self.bending + self.shear + self.axial


def tooth_compliance(
    tooth: Tooth,
    curvature_radius: Array,
    material: Material,
    *,
    reach: str = "to_contact",
    papers_crack: bool = True,
) -> ToothCompliance:
    """Bending, shear and axial compliance of a tooth loaded at the given contact points.

    Parameters
    ----------
    curvature_radius : (phase,) m    of the tooth's own flank at the contact
    reach : ``"to_contact"`` integrates up to the contact abscissa with the shear factor 1.2, as
        the paper does. ``"to_centreline"`` integrates up to the load's crossing of the centreline
        with the factor 1. The part beyond belongs to the local contact, and a short tapered tooth
        has no room for the parabolic shear of a long beam (finite elements of teeth held at their
        root chord, ``tests/reference``)
    papers_crack : a crack reduces the sections that it cuts, by eqs. (11) and (12)

    Returns
    -------
    ToothCompliance, (phase,) m/N, along the line of action

    Source: spur paper eqs. (3) to (5), integrated from the root chord to the contact abscissa.
    The squared moment arm of (3) is expanded, so one running sum of section moments serves every
    contact point. Plane stress.
    """
    profile, gear = tooth.profile, tooth.gear
    root = profile.abscissa[0]
    x, step = tooth.cell_abscissa - root, np.diff(profile.abscissa)
    area, second_moment = sections(tooth, papers_crack=papers_crack)
    bend = step / (material.youngs_modulus * second_moment)
    angle = load_angle(gear, curvature_radius)
    cos, sin = np.cos(angle), np.sin(angle)
    x_load, h_load = involute_point(gear, curvature_radius)
    if reach == "to_centreline":
        # the force moved along its line to the centreline, where arm and integral end
        x_load = np.maximum(x_load - h_load * np.tan(angle), root)
        h_load = np.zeros_like(h_load)
    arm = x_load - root

    def up_to_load(cells: Array) -> Array:
        running = np.concatenate([[0.0], np.cumsum(cells)])
        return np.interp(x_load, profile.abscissa, running)

    zeroth, first, second = (up_to_load(bend * x**power) for power in range(3))
    return ToothCompliance(
        bending=(
            cos**2 * (arm**2 * zeroth - 2.0 * arm * first + second)
            - 2.0 * cos * sin * h_load * (arm * zeroth - first)
            + sin**2 * h_load**2 * zeroth
        ),
        shear=cos**2
        * up_to_load(SHEAR_FACTORS[reach] * step / (material.shear_modulus * area)),
        axial=sin**2 * up_to_load(step / (material.youngs_modulus * area)),
    )
