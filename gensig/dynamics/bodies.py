"""Gears on their supports, and motors and loads on their couplings: masses, springs, dampers."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from gensig.errors import ConfigError
from gensig.units import split_unit, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """Bearings and shaft under one gear: x across the line of action, y along it.

    For helical gears also z along the axis and tilts about x and y.
    """

    stiffness_x: float = unit("n_per_m")
    stiffness_y: float = unit("n_per_m")
    damping_x: float = unit("ns_per_m")
    damping_y: float = unit("ns_per_m")
    stiffness_z: float = unit("n_per_m", default=0.0)
    damping_z: float = unit("ns_per_m", default=0.0)
    stiffness_tilt: float = unit("nm_per_rad", default=0.0)
    damping_tilt: float = unit("nms_per_rad", default=0.0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value < 0.0:
                key = f"{field.name}_{field.metadata['unit']}"
                raise ConfigError(f"support.{key} = {value:g} must not be negative")

    def damped(self, body: Body, ratio_x: float, ratio_y: float) -> Support:
        """The support with c = 2 zeta sqrt(k m) for a gear on it alone.

        Axial and tilt damping take the mean of the two ratios.
        """
        mean = 0.5 * (ratio_x + ratio_y)
        tilt = math.sqrt(self.stiffness_tilt * body.tilt_inertia)
        return replace(
            self,
            damping_x=2.0 * ratio_x * math.sqrt(self.stiffness_x * body.mass),
            damping_y=2.0 * ratio_y * math.sqrt(self.stiffness_y * body.mass),
            damping_z=2.0 * mean * math.sqrt(self.stiffness_z * body.mass),
            damping_tilt=2.0 * mean * tilt,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Mass in kg, moment of inertia in kg m2 and support of a gear.

    ``tilt_inertia`` about a diameter in kg m2 is needed for helical gears.
    """

    mass: float
    inertia: float
    support: Support
    tilt_inertia: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotor:
    """A motor or a load: a disc coupled to the shaft of its gear.

    The coupling is a torsional spring and damper.
    """

    inertia: float = unit("kg_m2")
    coupling_stiffness: float = unit("nm_per_rad")
    coupling_damping_ratio: float

    def __post_init__(self) -> None:
        for key in (
            "inertia_kg_m2",
            "coupling_stiffness_nm_per_rad",
            "coupling_damping_ratio",
        ):
            value = getattr(self, split_unit(key)[0])
            if not value > 0.0:
                raise ConfigError(f"rotor.{key} = {value:g} must be positive")

    def coupling_damping(self, gear_inertia: float) -> float:
        """Damping of the coupling for its ratio on the two inertias it joins, N m s/rad."""
        joined = self.inertia * gear_inertia / (self.inertia + gear_inertia)
        root = math.sqrt(self.coupling_stiffness * joined)
        return 2.0 * self.coupling_damping_ratio * root


def solid_disc(
    radius: float, bore_radius: float, width: float, density: float
) -> tuple[float, float]:
    """Mass in kg and moment of inertia in kg m2 of a disc with a bore.

    For gears whose source prints none.
    """
    mass = density * math.pi * (radius**2 - bore_radius**2) * width
    return mass, 0.5 * mass * (radius**2 + bore_radius**2)
