"""Sizes of a gear pair that follow from its teeth and module, where they are not given.

Laws and assumptions of a usual design: ``gensig new gearbox`` writes them into an option, and
values of a gear option that are null follow from them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from gensig.errors import ConfigError
from gensig.geometry.bearing_sizes import bearing_for
from gensig.geometry.contact import SIDES
from gensig.options.configuration import Section

WIDTH_IN_MODULES = 10.0
BORE_SHARE = 0.4  # of the smaller gear's pitch diameter
LARGEST_ROUNDING = 0.38  # of the rack's tip, ISO 53-A
ADDENDUM, CLEARANCE = 1.0, 0.25
ROUNDING = "cutter_tip_radius_coefficient"
CONFORMITY = 0.52  # of both grooves of a bearing


def completed(gear: Section) -> Section:
    """The group ``gear`` with values for the sizes that are null.

    Face widths, bores, bearings, span of the shafts and rounding of the rack's tip are filled. A
    null backlash follows from the geometry, see ``least_backlash``; mass, inertia and the diameter
    of a shaft follow where they are read. A bearing or a shaft that is null as a whole is not
    known, and stays so.

    Raises
    ------
    ConfigError    for teeth, module or sizes that are no numbers where others follow from them
    """
    sides = {name: gear.section(name) for name in SIDES}
    if not _has_nulls(gear, sides.values()):
        return gear
    module = _positive("gear.normal_module_mm", gear.get("normal_module_mm"))
    teeth = [
        _positive(f"{side.name}.n_teeth", side.get("n_teeth"))
        for side in sides.values()
    ]
    for name, bore in zip(SIDES, bores(teeth, module), strict=True):
        derived = {
            "face_width_mm": WIDTH_IN_MODULES * module,
            "bore_radius_mm": round(0.5 * bore, 4),
        }
        sides[name] = _filled(sides[name], derived)
    width = max(_size(side, "face_width_mm") for side in sides.values())
    radius = max(_size(side, "bore_radius_mm") for side in sides.values())
    span = round(2.0 * (width + radius), 1)
    for name, side in sides.items():
        bearing, shaft = side.get("bearing"), side.get("shaft")
        if isinstance(bearing, Mapping) and None in bearing.values():
            derived = bearing_values(2.0 * _size(side, "bore_radius_mm"))
            sides[name] |= {"bearing": dict(_filled(side.section("bearing"), derived))}
        if isinstance(shaft, Mapping):
            filled = _filled(side.section("shaft"), {"span_mm": span})
            sides[name] |= {"shaft": dict(filled)}
    whole = gear | {name: dict(side) for name, side in sides.items()}
    if gear.get(ROUNDING, 0.0) is not None:
        return whole
    angle = _size(gear, "pressure_angle_deg")
    return whole | {ROUNDING: tip_rounding(angle, _size(gear, "addendum_coefficient"))}


def _has_nulls(gear: Section, sides: Iterable[Section]) -> bool:
    """True where a size that is filled is null."""
    if gear.get(ROUNDING, 0.0) is None:
        return True
    for side in sides:
        if None in (side.get(key, 0.0) for key in ("face_width_mm", "bore_radius_mm")):
            return True
        bearing, shaft = side.get("bearing"), side.get("shaft")
        if isinstance(bearing, Mapping) and None in bearing.values():
            return True
        if isinstance(shaft, Mapping) and shaft.get("span_mm", 0.0) is None:
            return True
    return False


def _size(group: Section, key: str) -> float:
    return _positive(f"{group.name}.{key}", group.get(key))


def _positive(key: str, value: Any) -> float:
    """A number from which sizes follow."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not value > 0.0:
        raise ConfigError(
            f"{key} = {value!r} must be a positive number: sizes follow from it"
        )
    return value


def _filled(given: Section, derived: Mapping[str, Any]) -> Section:
    """The given values with derived ones where they are null."""
    return given | {
        key: value for key, value in derived.items() if given.get(key, value) is None
    }


def bores(teeth: Sequence[float], module_mm: float) -> list[float]:
    """Diameters of two shafts that are twisted to the same stress, mm, rounded.

    The shaft of the smaller gear has ``BORE_SHARE`` of its pitch diameter.
    """
    smaller = BORE_SHARE * module_mm * min(teeth)
    return [
        round(smaller * (n_teeth / min(teeth)) ** (1.0 / 3.0), 1) for n_teeth in teeth
    ]


def bearing_values(shaft_mm: float) -> dict[str, Any]:
    """Keys of the bearing of a usual size for a shaft."""
    size = bearing_for(shaft_mm)
    return {
        "n_balls": size.n_balls,
        "ball_diameter_mm": size.ball_diameter,
        "pitch_diameter_mm": size.pitch_diameter,
        "inner_groove_conformity": CONFORMITY,
        "outer_groove_conformity": CONFORMITY,
        "radial_clearance_um": size.clearance_um,
    }


def least_backlash(center_distance_mm: float, module_mm: float) -> float:
    """Recommended least normal backlash of industrial gears, micrometres, rounded.

    Source: ISO/TR 10064-2:1996, j_bn = 2/3 (0.06 + 0.0005 a + 0.03 m_n) mm, for steel gears in
    ferrous housings. That it holds below 15 m/s and for modules of 1.5 to 18 mm is from memory of
    the report, not checked against its text; for others it is an assumption.
    """
    return round(2e3 / 3.0 * (0.06 + 0.0005 * center_distance_mm + 0.03 * module_mm), 1)


def tip_rounding(pressure_angle_deg: float, addendum: float = ADDENDUM) -> float:
    """Rounding of the rack's tip over the module: that of ISO 53-A, or what its tip has room for.

    The circle may reach neither the working flank, c / (1 - sin(alpha)), nor over the middle of
    the rack's tip, (pi / 4 - (h_a + c) tan(alpha)) cos(alpha) / (1 - sin(alpha)).
    """
    alpha = math.radians(pressure_angle_deg)
    if not 10.0 <= pressure_angle_deg <= 35.0:  # the geometry refuses it
        return LARGEST_ROUNDING
    room = 1.0 - math.sin(alpha)
    half_tip = math.pi / 4.0 - (addendum + CLEARANCE) * math.tan(alpha)
    middle = half_tip * math.cos(alpha) / room
    largest = math.floor(100.1 * min(CLEARANCE / room, middle)) / 100.0
    return max(0.01, min(LARGEST_ROUNDING, largest))
