"""A pair of gears from its data sheet: given values, and derived or assumed ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.errors import ConfigError, GensigError
from gensig.geometry.bearing_sizes import BearingSize, bearing_for
from gensig.geometry.contact import GearPair
from gensig.life.root.root_stress import root_factors
from gensig.options.configuration import Section
from gensig.plan.request import read_request
from gensig.systems.derived_sizes import (
    ADDENDUM,
    BORE_SHARE,
    CLEARANCE,
    WIDTH_IN_MODULES,
    completed,
    least_backlash,
)
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.registry import SIDES, read_pair, read_system
from gensig.systems.supports import DAMPING_RATIO
from gensig.text.option_writing import option_lines
from gensig.units import to_si

PRESSURE_ANGLE = 20.0
MODULES = (0.1, 50.0)  # mm
GIVEN = "given"
# keys of a bearing and of a support before they are derived
BEARING = (
    "n_balls",
    "ball_diameter_mm",
    "pitch_diameter_mm",
    "inner_groove_conformity",
    "outer_groove_conformity",
    "radial_clearance_um",
)
PLANE_SUPPORT = (
    "stiffness_x_n_per_m",
    "stiffness_y_n_per_m",
    "damping_x_ns_per_m",
    "damping_y_ns_per_m",
)
AXIAL_SUPPORT = (
    "stiffness_z_n_per_m",
    "damping_z_ns_per_m",
    "stiffness_tilt_nm_per_rad",
    "damping_tilt_nms_per_rad",
)


def check_positive(flag: str, *values: float | None) -> None:
    """Raise ConfigError for a value of a flag that is not positive and finite."""
    for value in values:
        if value is not None and not (value > 0.0 and math.isfinite(value)):
            raise ConfigError(f"{flag} {value:g} must be positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class DataSheet:
    """Known values of one stage of gears, in the units of data sheets; pairs are of both gears.

    ``bores`` are diameters in mm, ``supports`` radial stiffness in N/m, speed and torque those of
    the pinion.
    """

    name: str
    teeth: tuple[int, int]
    module: float
    speed: float
    torque: float
    widths: tuple[float, float] | None = None
    bores: tuple[float, float] | None = None
    helix_angle: float = 0.0
    pressure_angle: float | None = None
    profile_shifts: tuple[float, float] | None = None
    addendum: float | None = None
    supports: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        low, high = MODULES
        if not low <= self.module <= high:
            raise ConfigError(
                f"--module {self.module:g} must lie in {low:g} to {high:g}: it is in mm"
            )

    @property
    def is_helical(self) -> bool:
        """True when its teeth have a helix."""
        return self.helix_angle != 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GearOption:
    """The gears of one stage: their group ``gear``, a remark for each value, and the machine."""

    sheet: DataSheet
    gear: dict[str, Any]
    remarks: dict[str, str]
    machine: GearPairMachine

    @property
    def pair(self) -> GearPair:
        """Its two gears."""
        return self.machine.pair

    def text(self) -> str:
        """The option as a file."""
        lines = [
            "# Written by gensig new gearbox. What is not given is derived or assumed, "
            "as each line says; put in what you know."
        ]
        if self.sheet.is_helical:
            name = self.gear["name"]
            lines.append(f"# Helical: take it with system=helical_pair gear={name}")
        lines += option_lines(self.gear, self.remarks)
        return "\n".join(lines) + "\n"

    def bearings(self) -> dict[str, str]:
        """Descriptions of the bearings beside each gear."""
        return {
            side: bearing_for(2.0 * self.gear[side]["bore_radius_mm"]).describes
            for side in SIDES
        }

    def derived(self) -> dict[str, float | None]:
        """Values that follow from the sheet, by key with unit; None where there is none.

        The root stress is sigma_F0 of ISO 6336-3 of the more stressed gear, without load factors.
        """
        pair, machine = self.pair, self.machine
        pinion, wheel = pair.pinion, pair.wheel
        speed, torque = self.gear["rated_speed_rpm"], self.gear["rated_torque_nm"]
        ratio = wheel.n_teeth / pinion.n_teeth
        force = torque / pinion.pitch_radius
        width = min(pinion.face_width, wheel.face_width)
        content = {
            "wheel_speed_rpm": speed / ratio,
            "wheel_torque_nm": torque * ratio,
            "power_kw": 1e-3 * to_si("speed_rpm", speed) * torque,
            "pitch_line_speed_m_per_s": to_si("speed_rpm", speed) * pinion.pitch_radius,
            "tooth_force_per_width_n_per_mm": 1e-3 * force / width,
            "nominal_root_stress_mpa": self._root_stress(force),
            "center_distance_mm": pair.center_distance * 1e3,
            "transverse_contact_ratio": pair.transverse_contact_ratio,
        }
        if self.sheet.is_helical:
            content["overlap_ratio"] = pair.overlap_ratio
        return {
            **content,
            "mesh_frequency_hz": pinion.n_teeth * speed / 60.0,
            "pinion_mass_kg": machine.pinion.mass,
            "wheel_mass_kg": machine.wheel.mass,
            "pinion_inertia_kg_m2": machine.pinion.inertia,
            "wheel_inertia_kg_m2": machine.wheel.inertia,
            "backlash_um": self.gear["backlash_um"],
            "pinion_bore_mm": 2.0 * self.gear["pinion"]["bore_radius_mm"],
            "wheel_bore_mm": 2.0 * self.gear["wheel"]["bore_radius_mm"],
        }

    def _root_stress(self, force: float) -> float | None:
        """Nominal root stress, MPa; None as for a contact ratio below 1, or a thin rim."""
        try:
            factors = root_factors(self.pair, allow_extrapolation=True).values()
        except GensigError:
            return None
        return 1e-6 * force * max(factor.stress_per_force for factor in factors)


def gear_option(sheet: DataSheet) -> GearOption:
    """The gears of a data sheet, with what it leaves out derived or assumed, and checked.

    Raises
    ------
    ConfigError, GeometryError    for gears that cannot be made or cannot mesh
    """
    pressure_angle, addendum = sheet.pressure_angle, sheet.addendum
    if pressure_angle is None:
        pressure_angle = PRESSURE_ANGLE
    if addendum is None:
        addendum = ADDENDUM
    gear: dict[str, Any] = {
        "name": sheet.name,
        "rated_speed_rpm": sheet.speed,
        "rated_torque_nm": sheet.torque,
        "normal_module_mm": sheet.module,
        "pressure_angle_deg": pressure_angle,
        "helix_angle_deg": sheet.helix_angle,
        "addendum_coefficient": addendum,
        "clearance_coefficient": CLEARANCE,
        "cutter_tip_radius_coefficient": None,
        "backlash_um": 0.0,
    }
    widths = sheet.widths or (None, None)
    radii: list[float | None] = [None, None]
    if sheet.bores is not None:
        radii = [round(0.5 * bore, 4) for bore in sheet.bores]
    shifts = sheet.profile_shifts or (0.0, 0.0)
    for index, side in enumerate(SIDES):
        gear[side] = {
            "n_teeth": sheet.teeth[index],
            "profile_shift": shifts[index],
            "face_width_mm": widths[index],
            "bore_radius_mm": radii[index],
            "mass_kg": None,
            "inertia_kg_m2": None,
            "support": dict.fromkeys(PLANE_SUPPORT, 1.0),
            "bearing": dict.fromkeys(BEARING),
            "shaft": {"diameter_mm": None, "span_mm": None},
        }
        if sheet.is_helical:
            gear[side]["support"] |= dict.fromkeys(AXIAL_SUPPORT)
    gear = completed(Section("gear", gear)).plain()
    center_distance = read_pair(Section("gear", gear)).center_distance * 1e3
    gear["backlash_um"] = least_backlash(center_distance, sheet.module)
    for side, support in zip(SIDES, _supports(sheet, gear), strict=True):
        gear[side]["support"] |= support
    machine = _machine(sheet, gear, supports="as_given")
    bearings = [bearing_for(2.0 * gear[side]["bore_radius_mm"]) for side in SIDES]
    remarks = _remarks(sheet, machine, bearings)
    return GearOption(sheet=sheet, gear=gear, remarks=remarks, machine=machine)


def _supports(sheet: DataSheet, gear: Mapping[str, Any]) -> list[dict[str, float]]:
    """Radial stiffness and damping of both supports, as given or of bearings and shafts."""
    origin = "bearings"
    if sheet.supports is not None:
        origin = "as_given"
    held = _machine(sheet, gear, supports=origin)
    supports = []
    for index, body in enumerate((held.pinion, held.wheel)):
        values = {"x": body.support.stiffness_x, "y": body.support.stiffness_y}
        if sheet.supports is not None:
            values = dict.fromkeys("xy", sheet.supports[index])
        support = {}
        for axis, stiffness in values.items():
            damping = 2.0 * DAMPING_RATIO * math.sqrt(stiffness * body.mass)
            support[f"stiffness_{axis}_n_per_m"] = _short(stiffness)
            support[f"damping_{axis}_ns_per_m"] = _short(damping)
        supports.append(support)
    return supports


def _machine(
    sheet: DataSheet, gear: Mapping[str, Any], *, supports: str
) -> GearPairMachine:
    words = []
    if sheet.is_helical:
        words.append("system=helical_pair")
    config = read_request(words).config.with_entries(gear=gear)
    config = config.with_keys("system", supports=supports)
    config = config.with_keys(
        "operating", speed_rpm=sheet.speed, torque_nm=sheet.torque
    )
    config = config.with_keys(
        "quality",
        support_damping_ratio_low=DAMPING_RATIO,
        support_damping_ratio_high=DAMPING_RATIO,
    )
    return read_system(config)


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _origin(given: object, otherwise: str) -> str:
    """The remark on a value of the sheet."""
    if given is None:
        return otherwise
    return GIVEN


def _remarks(
    sheet: DataSheet, machine: GearPairMachine, bearings: Sequence[BearingSize]
) -> dict[str, str]:
    """Dotted key -> origin of its value."""
    rack = "assumed, basic rack of ISO 53-A"
    helix = "spur"
    if sheet.is_helical:
        helix = "given; of the pinion, right-handed; the wheel's is the opposite"
    remarks = {
        "rated_speed_rpm": "given; of the pinion",
        "rated_torque_nm": "given; of the pinion",
        "normal_module_mm": GIVEN,
        "pressure_angle_deg": _origin(
            sheet.pressure_angle, "assumed, basic rack of ISO 53"
        ),
        "helix_angle_deg": helix,
        "addendum_coefficient": _origin(sheet.addendum, rack),
        "clearance_coefficient": rack,
        "cutter_tip_radius_coefficient": f"{rack}, or what its tip has room for",
        "backlash_um": "assumed, along the line of action: ISO/TR 10064-2, "
        "2/3 (0.06 + 0.0005 a + 0.03 m) mm",
    }
    support = _origin(
        sheet.supports, "derived from bearing and shaft at the rated torque"
    )
    width = _origin(sheet.widths, f"assumed: {WIDTH_IN_MODULES:g} modules")
    shaft = (
        f"assumed: the smaller gear's shaft has {BORE_SHARE:g} pitch diameters; both are "
        "twisted to the same stress"
    )
    bodies = (machine.pinion, machine.wheel)
    for side, body, bearing in zip(SIDES, bodies, bearings, strict=True):
        of_side = {
            "n_teeth": GIVEN,
            "profile_shift": _origin(sheet.profile_shifts, "assumed"),
            "face_width_mm": width,
            "bore_radius_mm": _origin(sheet.bores, shaft),
            "mass_kg": "null: of a steel disc, "
            f"rho pi (r^2 - r_bore^2) b = {body.mass:.4g} kg",
            "inertia_kg_m2": f"null: m (r^2 + r_bore^2) / 2 = {body.inertia:.4g} kg m2",
            "support.stiffness_x_n_per_m": f"across the line of action; {support}",
            "support.stiffness_y_n_per_m": f"along it; {support}",
            "support.damping_x_ns_per_m": f"assumed: a ratio of {DAMPING_RATIO:g} "
            "of the gear on its support alone",
            "support.damping_y_ns_per_m": "assumed, as above",
            "support.stiffness_z_n_per_m": "null: derived, docs/theory/supports.md; "
            "so are the next three",
            "bearing.n_balls": f"assumed; {bearing.describes}, the largest for this bore",
            "bearing.ball_diameter_mm": "assumed: 0.3 of outside diameter less bore",
            "bearing.pitch_diameter_mm": "assumed: in the middle between both",
            "bearing.inner_groove_conformity": "assumed",
            "bearing.outer_groove_conformity": "assumed",
            "bearing.radial_clearance_um": "assumed: least of ISO 5753-1 group N, "
            "mounted and warm",
            "shaft.diameter_mm": "null: fills the bore",
            "shaft.span_mm": "assumed: two face widths and a shaft diameter, "
            "the gear in the middle",
        }
        remarks |= {f"{side}.{key}": text for key, text in of_side.items()}
    return remarks
