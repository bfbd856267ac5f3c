"""Tooth compliance by the potential-energy method: bending, shear and axial compression of a tapered cantilever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.tooth import Tooth
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.material import Material

Array = NDArray[np.float64]

SHEAR_FACTOR = 1.2  # rectangular section, spur paper eq. (4)


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


def tooth_compliance(tooth: Tooth, curvature_radius: Array, material: Material) -> ToothCompliance:
    """Bending, shear and axial compliance of a tooth loaded at the given contact points.

    Parameters
    ----------
    curvature_radius : (phase,) m    of the tooth's own flank at the contact

    Returns
    -------
    ToothCompliance, (phase,) m/N, along the line of action

    Source: spur paper eqs. (3) to (5), integrated from the root chord to the contact abscissa. The squared moment arm
    of (3) is expanded, so one running sum of section moments serves every contact point. Plane stress.
    """
    profile, gear = tooth.profile, tooth.gear
    root = profile.abscissa[0]
    x, step = tooth.cell_abscissa - root, np.diff(profile.abscissa)
    bend = step / (material.youngs_modulus * tooth.second_moment)
    flank = slice(profile.n_root_cells, None)

    def up_to_contact(cells: Array) -> Array:
        running = np.concatenate([[0.0], np.cumsum(cells)])
        return np.interp(curvature_radius, profile.curvature_radius, running[flank])

    zeroth, first, second = (up_to_contact(bend * x**power) for power in range(3))
    x_load, h_load = involute_point(gear, curvature_radius)
    arm = x_load - root
    angle = load_angle(gear, curvature_radius)
    cos, sin = np.cos(angle), np.sin(angle)
    return ToothCompliance(
        bending=(
            cos**2 * (arm**2 * zeroth - 2.0 * arm * first + second)
            - 2.0 * cos * sin * h_load * (arm * zeroth - first)
            + sin**2 * h_load**2 * zeroth
        ),
        shear=cos**2 * up_to_contact(SHEAR_FACTOR * step / (material.shear_modulus * tooth.area)),
        axial=sin**2 * up_to_contact(step / (material.youngs_modulus * tooth.area)),
    )
