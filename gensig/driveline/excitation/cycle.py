"""One cylinder of a four-stroke engine: crank drive, gas torque and torque of the reciprocating
mass.

The crank angle is 0 at firing top dead center and runs over 4 pi; torques are positive in the
sense of rotation. C. F. Taylor, The Internal-Combustion Engine in Theory and Practice, vol. 2,
ch. 8; E. J. Nestorides, A Handbook on Torsional Vibration (1958).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.units import unit

CYCLE = 4.0 * math.pi  # rad, two turns


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """Crank drive of one cylinder.

    ``crank_to_rod_ratio`` is the crank's radius over the length of the rod.
    """

    bore: float = unit("mm")
    stroke: float = unit("mm")
    crank_to_rod_ratio: float
    compression_ratio: float
    reciprocating_mass: float = unit("kg")

    def __post_init__(self) -> None:
        for key, value, scale in (
            ("bore_mm", self.bore, 1e3),
            ("stroke_mm", self.stroke, 1e3),
        ):
            if not value > 0.0:
                raise ConfigError(
                    f"excitation.cylinder.{key} = {value * scale:g} must be positive"
                )
        if not 0.0 < self.crank_to_rod_ratio < 1.0:
            raise ConfigError(
                "excitation.cylinder.crank_to_rod_ratio = "
                f"{self.crank_to_rod_ratio:g} must lie between 0 and 1; "
                "it is the crank's radius over the length of the connecting rod"
            )
        if not self.compression_ratio > 1.0:
            raise ConfigError(
                f"excitation.cylinder.compression_ratio = {self.compression_ratio:g} "
                "must be above 1"
            )
        if not self.reciprocating_mass >= 0.0:
            raise ConfigError(
                "excitation.cylinder.reciprocating_mass_kg = "
                f"{self.reciprocating_mass:g} must not be negative"
            )

    @property
    def crank_radius(self) -> float:
        """Half the stroke, m."""
        return 0.5 * self.stroke

    @property
    def piston_area(self) -> float:
        """Area of the bore, m2."""
        return 0.25 * math.pi * self.bore**2

    @property
    def swept_volume(self) -> float:
        """Area times stroke, m3."""
        return self.piston_area * self.stroke

    def volume(self, angle: Array) -> Array:
        """Volume of the gas, m3, at crank angles in rad."""
        clearance = self.swept_volume / (self.compression_ratio - 1.0)
        return clearance + self.piston_area * self.piston_travel(angle)

    def piston_travel(self, angle: Array) -> Array:
        """Way of the piston from top dead center, m.

        X = R (1 - cos a + (1 - sqrt(1 - (l sin a)^2)) / l).
        """
        ratio = self.crank_to_rod_ratio
        rod = np.sqrt(1.0 - np.square(ratio * np.sin(angle)))
        return self.crank_radius * (1.0 - np.cos(angle) + (1.0 - rod) / ratio)

    def piston_rate(self, angle: Array) -> Array:
        """Slope dx/da, m/rad."""
        ratio, sine, cosine = self.crank_to_rod_ratio, np.sin(angle), np.cos(angle)
        rod = np.sqrt(1.0 - np.square(ratio * sine))
        return self.crank_radius * (sine + ratio * sine * cosine / rod)

    def piston_curvature(self, angle: Array) -> Array:
        """Second slope d2x/da2, m/rad2."""
        ratio, sine, cosine = self.crank_to_rod_ratio, np.sin(angle), np.cos(angle)
        rod = np.sqrt(1.0 - np.square(ratio * sine))
        bend = (np.square(cosine) - np.square(sine)) / rod + np.square(
            ratio * sine * cosine
        ) / rod**3
        return self.crank_radius * (cosine + ratio * bend)


def gas_torque(
    cylinder: Cylinder, angle: Array, pressure: Array, crankcase_pressure: float
) -> Array:
    """Torque of the gas on the crank, (point,) N m: T = (p - p_0) A dx/da.

    Parameters
    ----------
    angle : (point,) rad        crank angle after firing top dead center
    pressure : (point,) Pa      in the cylinder, absolute
    crankcase_pressure : Pa     below the piston, absolute

    Notes
    -----
    By virtual work, so that its mean over the cycle is the work over 4 pi. Same as eq. (18) of
    the engine paper, pi/4 D^2 R times the tangential pressure. Assumes a piston pin on the
    cylinder's axis.
    """
    return (
        (pressure - crankcase_pressure)
        * cylinder.piston_area
        * cylinder.piston_rate(angle)
    )


def inertia_torque(cylinder: Cylinder, angle: Array, speed: float) -> Array:
    """Torque of the reciprocating mass on the crank at a constant speed, (point,) N m: T = -m w^2
    x' x''.

    Parameters
    ----------
    angle : (point,) rad
    speed : rad/s

    Notes
    -----
    Its series to l^2 is m R^2 w^2 (l/4 sin a - 1/2 sin 2a - 3l/4 sin 3a - l^2/4 sin 4a): eq.
    (19) of the engine paper without the minus printed before it, which makes it the torque that
    the mass opposes to the rotation. It is the derivative of a periodic energy and does no work
    over a turn. The mean of the mass's varying inertia is taken to be in the inertia of the
    throw; that it varies with the vibration is left out.
    """
    rate, curvature = cylinder.piston_rate(angle), cylinder.piston_curvature(angle)
    return -cylinder.reciprocating_mass * speed**2 * rate * curvature


def cycle_angles(n_points: int) -> Array:
    """Crank angles of one cycle, (point,) rad from 0, the end left out."""
    return np.asarray(np.arange(n_points) * (CYCLE / n_points))


def delayed(torque: Array, delay: float) -> Array:
    """A torque over the cycle, (point,), of a cylinder or cam that is ``delay`` rad of crank
    angle later, (point,).
    """
    angle = cycle_angles(len(torque))
    return np.interp(angle - delay, angle, torque, period=CYCLE)
