"""Geometry of a gear pair as a data set states it, by the names of its columns or attributes."""

from __future__ import annotations

from gensig.geometry.contact import GearPair
from gensig.units import from_si


def gear_columns(pair: GearPair) -> dict[str, int | float]:
    """Teeth and geometry of a pair: columns where units differ, else root attributes."""
    pinion, wheel = pair.pinion, pair.wheel
    return {
        "n_teeth_pinion": pinion.n_teeth,
        "n_teeth_wheel": wheel.n_teeth,
        "normal_module_mm": from_si("normal_module_mm", pinion.normal_module),
        "pressure_angle_deg": from_si("pressure_angle_deg", pinion.pressure_angle),
        "helix_angle_deg": from_si("helix_angle_deg", pinion.helix_angle),
        "face_width_pinion_mm": from_si("face_width_mm", pinion.face_width),
        "face_width_wheel_mm": from_si("face_width_mm", wheel.face_width),
        "center_distance_mm": from_si("center_distance_mm", pair.center_distance),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
    }
