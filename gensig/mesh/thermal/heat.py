"""Inputs of the group ``heat``, friction heat, and flash temperature.

Theory, ranges and choices: ``docs/theory/heat.md``. Temperatures are in degrees Celsius, rises in
K.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, ExtrapolationError
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.local_contact import relative_radius
from gensig.units import from_si, split_unit, unit

# Blok's constant with the semi-width of the contact; with its full width the same formula has 1.11
BLOK_SEMI_WIDTH = 0.785


@dataclass(frozen=True, slots=True, kw_only=True)
class Heat:
    """Effects of heat, cooling of the gears, and thermal properties of steel.

    Parameters
    ----------
    growth, center_distance, softening : the effects, see ``gensig.systems.hot_pair``
    reference_temperature, oil_temperature, housing_temperature : degrees Celsius
    pinion_temperature, wheel_temperature : of the whole gear; None: from friction heat and cooling
    pinion_bore_temperature, wheel_bore_temperature : None: no heat through the bore
    running_time : s    since gears at the reference temperature began to run; None: steady
    face_convection, tooth_convection : W/(m2 K)    from body faces and teeth to the oil
    convection_speed : rad/s    pinion speed of both values, which go with the root of the speed
        (thermal paper, eq. 34); None: they hold at any speed
    pinion_heat_share : of the friction heat
    conductivity W/(m K), specific_heat J/(kg K), expansion 1/K
    modulus_temperature, modulus : Young's modulus over temperature; only its shape counts
    """

    growth: bool
    center_distance: bool
    softening: bool
    reference_temperature: float = unit("degc")
    oil_temperature: float = unit("degc")
    housing_temperature: float = unit("degc")
    pinion_temperature: float | None = unit("degc")
    wheel_temperature: float | None = unit("degc")
    pinion_bore_temperature: float | None = unit("degc")
    wheel_bore_temperature: float | None = unit("degc")
    running_time: float | None = unit("s")
    face_convection: float = unit("w_per_m2k")
    tooth_convection: float = unit("w_per_m2k")
    convection_speed: float | None = unit("rpm")
    pinion_heat_share: float
    conductivity: float = unit("w_per_mk")
    specific_heat: float = unit("j_per_kgk")
    expansion: float = unit("per_k")
    modulus_temperature: tuple[float, ...] = unit("degc")
    modulus: tuple[float, ...] = unit("gpa")

    def __post_init__(self) -> None:
        for key, low, high in (
            ("face_convection_w_per_m2k", 0.0, 1e5),
            ("tooth_convection_w_per_m2k", 0.0, 1e5),
            ("pinion_heat_share", 0.0, 1.0),
            ("conductivity_w_per_mk", 1.0, 500.0),
            ("specific_heat_j_per_kgk", 50.0, 5000.0),
            ("expansion_per_k", 0.0, 1e-4),
        ):
            value = getattr(self, split_unit(key)[0])
            if not low <= value <= high:
                raise ConfigError(
                    f"heat.{key} = {from_si(key, value):g} must lie in {low:g}..{high:g}"
                )
        if self.running_time is not None and not self.running_time >= 0.0:
            raise ConfigError(
                f"heat.running_time_s = {self.running_time:g} must not be negative, or null for "
                "gears that are as warm as they get"
            )
        if self.convection_speed is not None and not self.convection_speed > 0.0:
            raise ConfigError(
                "heat.convection_speed_rpm = "
                f"{from_si('convection_speed_rpm', self.convection_speed):g} must be positive, or "
                "null for convection that does not depend on speed"
            )
        temperatures = self.modulus_temperature
        is_rising = bool(np.all(np.diff(temperatures) > 0.0))
        is_table = 2 <= len(temperatures) == len(self.modulus)
        if not (is_table and is_rising):
            raise ConfigError(
                f"heat.modulus_temperature_degc has {len(temperatures)} and heat.modulus_gpa "
                f"{len(self.modulus)} values; give equally many, two or more, at temperatures "
                "that rise"
            )
        if not min(self.modulus) > 0.0:
            raise ConfigError(
                f"heat.modulus_gpa = {min(self.modulus) / 1e9:g} must be positive"
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_temperature") and isinstance(value, float):
                self.require_known(value, f"heat.{field.name}_degc = {value:g}")

    @property
    def is_any(self) -> bool:
        """True if any effect of heat is on."""
        return self.growth or self.center_distance or self.softening

    def at_speed(self, speed: float) -> Heat:
        """These inputs with the convection at a pinion speed in rad/s."""
        if self.convection_speed is None:
            return self
        factor = math.sqrt(speed / self.convection_speed)
        return replace(
            self,
            convection_speed=None,
            face_convection=self.face_convection * factor,
            tooth_convection=self.tooth_convection * factor,
        )

    def require_known(self, temperature: float, what: str) -> None:
        """Raise an ExtrapolationError that begins with ``what`` beyond the material's data."""
        low, high = self.modulus_temperature[0], self.modulus_temperature[-1]
        if not low <= temperature <= high:
            raise ExtrapolationError(
                f"{what} lies beyond the material's data, {low:g} to {high:g} degrees Celsius; "
                "cool more, load less, or give heat.modulus_temperature_degc and "
                "heat.modulus_gpa that reach further"
            )

    def modulus_ratio(self, temperature: float) -> float:
        """Young's modulus at a temperature over that at the reference temperature."""
        temperatures = [temperature, self.reference_temperature]
        at, reference = np.interp(temperatures, self.modulus_temperature, self.modulus)
        return float(at / reference)


def rolling_speeds(
    pair: GearPair, position: Array, speed: float
) -> tuple[Array, Array]:
    """Rolling speeds of both flanks at the contact, m/s, of the shape of ``position``.

    Parameters
    ----------
    position : m     from A; beyond the path the nearest end counts
    speed : rad/s    of the pinion
    """
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    pinion = speed * pair.pinion_curvature(on_path)
    return pinion, speed / pair.ratio * pair.wheel_curvature(on_path)


def friction_heat(
    pair: GearPair,
    position: Array,
    line_load: Array,
    *,
    force: float,
    friction: float,
    speed: float,
) -> float:
    """Mean friction loss of the flanks, W: friction x normal load x sliding speed of every slice.

    Parameters
    ----------
    position : (phase, pair, slice) m
    line_load : (phase, pair, slice) N/m    along the transverse line of action; only its
        distribution counts
    force : N                               sum of all loads along the transverse line of action
    friction : coefficient
    speed : rad/s                           of the pinion
    """
    pinion, wheel = rolling_speeds(pair, position, speed)
    power = np.sum(line_load * np.abs(pinion - wheel), axis=(1, 2))
    sliding = power / np.sum(line_load, axis=(1, 2))
    return friction * force / math.cos(pair.base_helix_angle) * float(sliding.mean())


def flash_temperature(
    pair: GearPair,
    position: Array,
    line_load: Array | float,
    material: Material,
    heat: Heat,
    *,
    friction: float,
    speed: float,
) -> Array:
    """Rise of the flanks' surface in contact above the teeth, K, of the shape of ``position``.

    Parameters
    ----------
    line_load : N/m    along the transverse line of action per width, equal to the normal load per
        length of line

    Source: Blok (1937) for a Hertzian distribution of the heat, 0.785 f w |v1 - v2| / ((sqrt(g
    rho c v1) + sqrt(g rho c v2)) sqrt(B)) with the semi-width B of the contact. 1.11 belongs to
    its full width; the thermal paper's eq. (13) leaves the constant open.
    """
    pinion, wheel = rolling_speeds(pair, position, speed)
    half_width = contact_half_width(pair, position, line_load, material)
    effusivity = math.sqrt(
        heat.conductivity * material.density_kg_per_m3 * heat.specific_heat
    )
    # sqrt(v1) - sqrt(v2) is |v1 - v2| over their sum; w / sqrt(B) goes to 0 with the load
    loaded, touches = np.zeros_like(half_width), half_width > 0.0
    np.divide(line_load, np.sqrt(half_width), out=loaded, where=touches)
    sliding = np.abs(np.sqrt(pinion) - np.sqrt(wheel))
    return BLOK_SEMI_WIDTH * friction * loaded * sliding / effusivity


def contact_half_width(
    pair: GearPair, position: Array, line_load: Array | float, material: Material
) -> Array:
    """Half width of the Hertzian contact, m, of the shape of ``position``.

    Loads and radii as for the pressure.
    """
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    radius = relative_radius(pair, on_path) / math.cos(pair.base_helix_angle)
    reduced = material.youngs_modulus / (1.0 - material.poisson_ratio**2)
    return np.sqrt(8.0 * np.asarray(line_load) * radius / (math.pi * reduced))
