"""Temperature of a gear: a hollow disc heated at its teeth, cooled at teeth, faces and bore.

Steady, or while it warms up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.thermal.heat import Heat

N_RADII = 201
N_TOOTH_HEIGHTS = 65


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyHeat:
    """Temperature of one gear.

    Parameters
    ----------
    radius : (point,) m            from the bore to the root circle
    temperature : (point,) degC    the teeth have that of the root circle
    input : W                      friction heat into the gear
    to_oil, to_bore : W            heat out of the gear
    """

    radius: Array
    temperature: Array
    input: float
    to_oil: float
    to_bore: float

    @property
    def tooth(self) -> float:
        """Temperature of the teeth, degC."""
        return float(self.temperature[-1])

    @property
    def mean(self) -> float:
        """Temperature of the body, degC, mean over its volume."""
        weight = self.temperature * self.radius
        return float(
            np.trapezoid(weight, self.radius) / np.trapezoid(self.radius, self.radius)
        )


def tooth_surface(gear: Gear) -> float:
    """Surface of all teeth: flanks, lands, spaces between, and the ends; m2.

    Flanks are the involute down to its base circle and go straight to the root circle from there;
    the surface is as long as the helix.
    """
    start = max(gear.base_radius, gear.root_radius)
    inner, outer = (
        math.sqrt(radius**2 - gear.base_radius**2)
        for radius in (start, gear.tip_radius)
    )
    involute = (outer**2 - inner**2) / (2.0 * gear.base_radius)
    flank = involute + start - gear.root_radius
    tip_land = 2.0 * gear.half_tooth_angle_at(gear.tip_radius) * gear.tip_radius
    half_space = math.pi / gear.n_teeth - gear.half_tooth_angle_at(start)
    root_land = 2.0 * half_space * gear.root_radius
    outline = 2.0 * flank + tip_land + max(root_land, 0.0)
    radius = np.linspace(gear.root_radius, gear.tip_radius, N_TOOTH_HEIGHTS)
    thickness = [2.0 * gear.half_tooth_angle_at(max(r, start)) * r for r in radius]
    ends = 2.0 * float(np.trapezoid(thickness, radius))
    helix_length = gear.face_width / math.cos(gear.helix_angle)
    return gear.n_teeth * (outline * helix_length + ends)


def face_surface(gear: Gear) -> float:
    """Both faces of the body, from the bore to the root circle, m2."""
    return 2.0 * math.pi * (gear.root_radius**2 - gear.bore_radius**2)


def uniform_body(gear: Gear, temperature: float) -> BodyHeat:
    """A gear of known uniform temperature."""
    radius = np.linspace(gear.bore_radius, gear.root_radius, N_RADII)
    return BodyHeat(
        radius=radius,
        temperature=np.full_like(radius, temperature),
        input=0.0,
        to_oil=0.0,
        to_bore=0.0,
    )


def solved_body(
    gear: Gear, input_heat: float, heat: Heat, *, bore_temperature: float | None
) -> BodyHeat:
    """Temperature of a gear that takes ``input_heat`` (W) at its teeth.

    Source: (1/r) d/dr(r dT/dr) = 2 h (T - T_oil) / (g b), the annular fin of textbooks (Incropera
    & DeWitt, section 3.6), in modified Bessel functions. Without convection at the faces it is
    eq. (4) of the thermal paper, where the temperatures of bore and rim are known.

    Raises
    ------
    ConfigError    where nothing cools the gear
    """
    is_insulated = heat.face_convection == heat.tooth_convection == 0.0
    if is_insulated and bore_temperature is None:
        raise ConfigError(
            f"{gear.name}: nothing cools it; give heat.face_convection_w_per_m2k, "
            f"heat.tooth_convection_w_per_m2k, heat.{gear.name}_bore_temperature_degc or "
            f"heat.{gear.name}_temperature_degc"
        )
    radius = np.linspace(gear.bore_radius, gear.root_radius, N_RADII)
    per_width = heat.conductivity * gear.face_width
    fin = math.sqrt(2.0 * heat.face_convection / per_width)
    values, slopes = _solutions(radius, fin)
    # W for 1 K/m through the cylinder
    per_slope = 2.0 * math.pi * radius * gear.face_width * heat.conductivity
    from_teeth = heat.tooth_convection * tooth_surface(gear)
    at_bore, bore_rise = slopes[:, 0], 0.0
    if bore_temperature is not None:
        at_bore, bore_rise = values[:, 0], bore_temperature - heat.oil_temperature
    at_rim = per_slope[-1] * slopes[:, -1] + from_teeth * values[:, -1]
    conditions = np.array([at_bore, at_rim])
    weights = np.linalg.solve(conditions, np.array([bore_rise, input_heat]))
    to_bore = float(per_slope[0] * (weights @ slopes[:, 0]))
    return BodyHeat(
        radius=radius,
        temperature=heat.oil_temperature + weights @ values,
        input=input_heat,
        to_oil=input_heat - to_bore,
        to_bore=to_bore,
    )


def heat_capacity(gear: Gear, material: Material, heat: Heat) -> float:
    """Heat capacity of a disc from the bore to the pitch circle, J/K."""
    section = math.pi * (gear.pitch_radius**2 - gear.bore_radius**2)
    volume = section * gear.face_width
    return material.density_kg_per_m3 * volume * heat.specific_heat


def time_constant(gear: Gear, material: Material, heat: Heat) -> float:
    """Time constant of one lumped mass, s: heat capacity over convection to the oil.

    Infinite without convection. Source: Incropera & DeWitt, section 5.1.
    """
    cooling = heat.face_convection * face_surface(gear)
    cooling += heat.tooth_convection * tooth_surface(gear)
    if cooling == 0.0:
        return math.inf
    return heat_capacity(gear, material, heat) / cooling


def warming_body(
    steady: BodyHeat, gear: Gear, material: Material, heat: Heat, running_time: float
) -> BodyHeat:
    """A gear some seconds after it began to run at the reference temperature.

    Its whole field goes to the steady one with one time constant; oil and housing have their
    temperatures from the begin.

    Raises
    ------
    ConfigError    for a gear that no convection cools
    """
    constant = time_constant(gear, material, heat)
    if constant == math.inf:
        raise ConfigError(
            f"{gear.name}: heat.running_time_s needs convection, which gives the time that "
            "warming takes; give heat.face_convection_w_per_m2k or "
            "heat.tooth_convection_w_per_m2k, or heat.running_time_s=null"
        )
    left, start = math.exp(-running_time / constant), heat.reference_temperature
    rate = (steady.mean - start) / constant * left
    return replace(
        steady,
        temperature=start + (steady.temperature - start) * (1.0 - left),
        to_oil=steady.to_oil - rate * heat_capacity(gear, material, heat),
    )


def _solutions(radius: Array, fin: float) -> tuple[Array, Array]:
    """Two solutions of the disc's equation and their slopes, (2, point) each.

    ``fin`` 1/m is 0 without convection. The solutions are scaled to about 1 at either end, so that
    they neither overflow nor become alike.
    """
    if fin == 0.0:
        values = np.array([np.ones_like(radius), np.log(radius / radius[-1])])
        return values, np.array([np.zeros_like(radius), 1.0 / radius])
    from scipy.special import i0e, i1e, k0e, k1e

    argument = fin * radius
    inward, outward = np.exp(argument - argument[-1]), np.exp(argument[0] - argument)
    values = np.array([i0e(argument) * inward, k0e(argument) * outward])
    return values, fin * np.array([i1e(argument) * inward, -k1e(argument) * outward])
