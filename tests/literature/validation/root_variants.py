"""Other readings of the tooth root, to measure what the true transition curve and theta_f = b1/r
buy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import brentq

from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import (
    N_FLANK_CELLS,
    N_ROOT_CELLS,
    ToothProfile,
    involute_point,
    root_curve,
)


def straight_root_profile(gear: Gear) -> ToothProfile:
    """Outline whose involute runs down to the base circle and goes on straight, with constant
    thickness, to the root.

    Where the root circle is the larger one the involute runs down to it, and nothing straight is
    left.
    """
    lowest = math.sqrt(max(gear.root_radius**2 - gear.base_radius**2, 0.0))
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    curvature = np.linspace(lowest, tip, N_FLANK_CELLS + 1)
    x, y = involute_point(gear, curvature)
    n_root = N_ROOT_CELLS * (gear.root_radius < gear.base_radius)
    root = math.sqrt(gear.root_radius**2 - float(y[0]) ** 2)
    return ToothProfile(
        gear=gear,
        abscissa=np.concatenate(
            [np.linspace(root, float(x[0]), n_root + 1)[:n_root], x]
        ),
        half_thickness=np.concatenate([np.full(n_root, y[0]), y]),
        n_root_cells=n_root,
        curvature_radius=curvature,
    )


def straight_root_tooth(gear: Gear) -> Tooth:
    """A sound tooth on that outline."""
    return healthy_tooth(gear, straight_root_profile(gear))


@dataclass(frozen=True, slots=True, kw_only=True)
class _GearOnRootAngle(Gear):
    """A gear whose body takes another theta_f than b1/r.

    Overrides a property so that the tested formula runs.
    """

    body_half_angle: float

    @property
    def root_half_angle(self) -> float:
        return self.body_half_angle


def other_root_angle(gear: Gear, where: str) -> Gear:
    """The gear with theta_f of the body term taken elsewhere.

    Parameters
    ----------
    where : ``"tangent_30deg"``, the chord where the root curve has 30 degrees to the tooth
        centreline; ``"junction"``, where the involute begins; ``"base_circle"``, the half tooth
        angle there
    """
    if where == "tangent_30deg":

        def excess(gamma: float) -> float:
            turned = (
                gear.rounding_center_depth / math.tan(gamma)
                + gear.rounding_center_offset
            ) / gear.pitch_radius
            return gamma - turned - math.radians(30.0)

        gamma = brentq(excess, gear.pressure_angle, 0.5 * math.pi)
        angle = math.asin(
            float(root_curve(gear, np.array([gamma]))[1][0]) / gear.root_radius
        )
    elif where == "junction":
        x, y = involute_point(gear, np.array([gear.junction_curvature_radius]))
        angle = math.atan2(float(y[0]), float(x[0]))
    else:
        angle = gear.half_tooth_angle_base
    return _GearOnRootAngle(
        **{item.name: getattr(gear, item.name) for item in fields(Gear)},
        body_half_angle=angle,
    )
