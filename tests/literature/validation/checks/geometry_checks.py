"""Geometry of the teeth and of the line of action, by the names that the rows use."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter

import numpy as np

from gensig.geometry.contact import corner_gap
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import (
    involute_point,
    root_curve,
    root_curve_middle,
    root_curve_point,
    tooth_profile,
)
from validation.case import Case, running

Check = Callable[[Case, str], float]

GEAR_PROPERTIES = (
    "pitch_radius",
    "base_radius",
    "tip_radius",
    "root_radius",
    "half_tooth_angle_base",
    "root_half_angle",
    "rounding_center_depth",
    "rounding_center_offset",
    "junction_curvature_radius",
)
PAIR_PROPERTIES = ("tangent_length", "base_pitch", "transverse_contact_ratio")


def _of_gear(value: Callable[[Gear], float]) -> Check:
    """A quantity of one gear; the row's ``at`` names it."""

    return lambda case, at: value(case.gear(at))


def _of_pair(name: str) -> Check:
    """A property of the pair."""
    return lambda case, at: float(getattr(case.pair, name))


def _junction(gear: Gear, axis: int) -> float:
    return float(
        involute_point(gear, np.array([gear.junction_curvature_radius]))[axis][0]
    )


def _junction_gap(gear: Gear) -> float:
    """Distance from the end of the root curve to the beginning of the involute."""
    x, y = root_curve(gear, np.array([gear.pressure_angle]))
    return float(np.hypot(x[0] - _junction(gear, 0), y[0] - _junction(gear, 1)))


def _junction_slope_step(gear: Gear) -> float:
    """Angle between root curve and involute where they join, by central differences of their
    points.
    """
    shift = 1e-5
    root = root_curve(gear, gear.pressure_angle + shift * np.array([1.0, -1.0]))
    flank = involute_point(
        gear, gear.junction_curvature_radius * (1.0 + shift * np.array([-1.0, 1.0]))
    )
    slopes = [np.arctan2(np.diff(y)[0], np.diff(x)[0]) for x, y in (root, flank)]
    return float(abs(slopes[0] - slopes[1]))


def _zone_share(case: Case, at: str) -> float:
    """Share of the mesh cycle with one (``single``) or two (``double``) pairs in contact."""
    double = case.pair.transverse_contact_ratio - 1.0
    return {"double": double, "single": 1.0 - double}[at]


def _corner_gap(case: Case, at: str) -> float:
    """Gap at a distance in mm beyond an end of the path: negative before A, positive after E."""
    position = float(at) * 1e-3
    if position >= 0.0:
        position += case.pair.path_of_contact
    return float(corner_gap(case.pair, np.array([position]))[0])


def _smaller_corner_gap(case: Case, at: str) -> float:
    """Peak of the smaller gap of a missing tooth's neighbours, or where it lies after E."""
    pair = case.pair
    after = np.linspace(0.0, 2.0 * pair.base_pitch - pair.path_of_contact, 20001)
    leaving = corner_gap(pair, pair.path_of_contact + after)
    entering = corner_gap(pair, pair.path_of_contact + after - 2.0 * pair.base_pitch)
    smaller = np.minimum(leaving, entering)
    peak = int(np.argmax(smaller))
    if at == "gap":
        return float(smaller[peak])
    return float(after[peak])


GEOMETRY: dict[str, Check] = {
    **{name: _of_gear(attrgetter(name)) for name in GEAR_PROPERTIES},
    **{name: _of_pair(name) for name in PAIR_PROPERTIES},
    "half_pitch_angle": _of_gear(lambda gear: float(np.pi / gear.n_teeth)),
    "root_chord_abscissa": _of_gear(
        lambda gear: float(tooth_profile(gear).abscissa[0])
    ),
    "junction_radius": _of_gear(
        lambda gear: float(np.hypot(gear.base_radius, gear.junction_curvature_radius))
    ),
    "junction_abscissa": _of_gear(lambda gear: _junction(gear, 0)),
    "junction_half_thickness": _of_gear(lambda gear: _junction(gear, 1)),
    "junction_gap": _of_gear(_junction_gap),
    "junction_slope_step": _of_gear(_junction_slope_step),
    "gamma_mid_angle": _of_gear(lambda gear: root_curve_middle(gear, "gamma_mid")),
    "arc_mid_angle": _of_gear(lambda gear: root_curve_middle(gear, "arc_mid")),
    "gamma_mid_abscissa": _of_gear(lambda gear: root_curve_point(gear, "gamma_mid")[0]),
    "gamma_mid_half_thickness": _of_gear(
        lambda gear: root_curve_point(gear, "gamma_mid")[1]
    ),
    "arc_mid_abscissa": _of_gear(lambda gear: root_curve_point(gear, "arc_mid")[0]),
    "arc_mid_half_thickness": _of_gear(
        lambda gear: root_curve_point(gear, "arc_mid")[1]
    ),
    "single_zone_length": lambda case, at: (
        2.0 * case.pair.base_pitch - case.pair.path_of_contact
    ),
    "zone_share": _zone_share,
    "pinion_curvature": lambda case, at: float(case.curvature("pinion", at)[0]),
    "corner_gap": _corner_gap,
    "smaller_corner_gap": _smaller_corner_gap,
    "mesh_frequency": lambda case, at: running(case).mesh_frequency,
    "wheel_speed": lambda case, at: case.system.operating.speed / case.pair.ratio,
}
