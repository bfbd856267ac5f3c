"""Plungers of an injection pump: the fuel that the load needs, pressed out at a stated pressure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Flags
from gensig.driveline.excitation.cams import Cam, cam_torque
from gensig.errors import ConfigError
from gensig.units import from_si, unit

FINE = 20_001  # points of the lift, to find where the delivery ends


@dataclass(frozen=True, slots=True, kw_only=True)
class Plunger:
    """One plunger with its cam; delivery begins at a crank angle before its cylinder fires, at a
    lift of the cam.

    ``delivery_pressure`` is reached at the reference speed and grows with its square (a nozzle's
    orifice), but is never below ``opening_pressure``. It rises and falls over ``ramp_share`` of
    the delivered volume each. The fuel follows from the work of the gas and
    ``indicated_efficiency``.
    """

    cam: Cam
    diameter: float = unit("mm")
    delivery_pressure: float = unit("mpa")
    opening_pressure: float = unit("mpa")
    ramp_share: float
    delivery_begin: float = unit("deg")
    lift_at_delivery: float = unit("mm")
    fuel_density_kg_per_m3: float
    heating_value_j_per_kg: float
    indicated_efficiency: float

    def __post_init__(self) -> None:
        group = "excitation.injection_pump"
        for key, value in (
            ("diameter_mm", self.diameter),
            ("delivery_pressure_mpa", self.delivery_pressure),
            ("opening_pressure_mpa", self.opening_pressure),
            ("fuel_density_kg_per_m3", self.fuel_density_kg_per_m3),
            ("heating_value_j_per_kg", self.heating_value_j_per_kg),
        ):
            if not value > 0.0:
                raise ConfigError(
                    f"{group}.{key} = {from_si(key, value):g} must be positive"
                )
        if not 0.0 < self.ramp_share <= 0.5:
            raise ConfigError(
                f"{group}.ramp_share = {self.ramp_share:g} must be above 0 and at most 0.5"
            )
        if not 0.0 < self.indicated_efficiency < 1.0:
            raise ConfigError(
                f"{group}.indicated_efficiency = {self.indicated_efficiency:g} must "
                "lie between 0 and 1"
            )
        if not 0.0 <= self.lift_at_delivery < self.cam.lift:
            raise ConfigError(
                f"{group}.lift_at_delivery_mm = {self.lift_at_delivery * 1e3:g} must "
                "be at least 0 and below the cam's "
                f"lift of {self.cam.lift * 1e3:g} mm"
            )

    @property
    def area(self) -> float:
        """Of the plunger, m2."""
        return 0.25 * math.pi * self.diameter**2

    def fuel_volume(self, work: float) -> float:
        """Volume of fuel, m3, that a cylinder burns for the work of its gas over a cycle, J."""
        return work / (
            self.indicated_efficiency
            * self.heating_value_j_per_kg
            * self.fuel_density_kg_per_m3
        )

    def pressure(
        self, lift: Array, rising: Flags, volume: float, speed_share: float
    ) -> Array:
        """Pressure over the plunger, (point,) Pa, at lifts of the cam in m.

        Parameters
        ----------
        rising : (point,) bool    on the way up; the plunger delivers only then
        volume : m3               delivered in one stroke
        speed_share : of the reference speed
        """
        stroke = volume / self.area
        if self.lift_at_delivery + stroke > self.cam.lift:
            raise ConfigError(
                f"excitation.injection_pump: {volume * 1e9:.4g} mm3 of fuel need "
                f"{stroke * 1e3:.4g} mm of the plunger "
                f"from lift_at_delivery_mm = {self.lift_at_delivery * 1e3:g} on, and the cam lifts "
                f"{self.cam.lift * 1e3:g} mm; enlarge diameter_mm or the cam's lift_mm"
            )
        if not stroke > 0.0:
            return np.zeros_like(lift)
        delivered = (lift - self.lift_at_delivery) / stroke
        inside = np.clip(
            np.minimum(delivered, 1.0 - delivered) / self.ramp_share, 0.0, 1.0
        )
        peak = max(self.delivery_pressure * speed_share**2, self.opening_pressure)
        return np.where(rising, peak * np.square(np.sin(0.5 * math.pi * inside)), 0.0)

    @property
    def lead(self) -> float:
        """Cam angle from where it begins to lift to where the delivery begins, rad."""
        angle = np.linspace(0.0, 0.5 * self.cam.span, FINE)
        return float(np.interp(self.lift_at_delivery, self.cam.motion(angle)[0], angle))


def plunger_torque(
    plunger: Plunger, angle: Array, speed: float, volume: float, speed_share: float
) -> Array:
    """Torque of one plunger on the pump's shaft, (point,) N m.

    Parameters
    ----------
    angle : (point,) rad    of the pump's shaft, 0 where the delivery begins
    speed : rad/s           of the pump's shaft
    volume : m3             delivered in one stroke
    speed_share : of the reference speed

    Notes
    -----
    Eq. (21) of the engine paper: pressure times plunger area times the cam's slope. So the work
    of a stroke is the integral of p dV, whatever the cam. Fuel is taken to be incompressible,
    and the line's waves are left out.
    """
    turned = angle + plunger.lead
    lift, slope, _ = plunger.cam.motion(turned)
    pressure = plunger.pressure(lift, slope > 0.0, volume, speed_share)
    return cam_torque(plunger.cam, turned, speed, pressure * plunger.area)
