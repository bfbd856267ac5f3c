"""Torque that cams take: valve cams with flat followers, injection-pump cams with rollers.

Lift over the cam's angle is the 3-4-5-6 polynomial, h = H 64 u^3 (1 - u)^3, whose velocity and
acceleration are continuous (R. L. Norton, Cam Design and Manufacturing Handbook, 2nd ed. (2009),
ch. 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.units import from_si, unit

FOLLOWERS = ("flat", "roller")


@dataclass(frozen=True, slots=True, kw_only=True)
class Cam:
    """A cam and what it moves, as felt at the cam; ``span`` is the cam's own angle over which it
    lifts.

    The spring pushes with its preload and rate times lift. ``friction_coefficient`` is that of
    follower on cam, with the contact's distance from the axis as arm; rollers have none of it
    worth counting.
    """

    follower: str
    lift: float = unit("mm")
    span: float = unit("deg")
    base_radius: float = unit("mm")
    roller_radius: float = unit("mm")
    moving_mass: float = unit("kg")
    spring_preload: float = unit("n")
    spring_rate: float = unit("n_per_m")
    friction_coefficient: float

    def __post_init__(self) -> None:
        if self.follower not in FOLLOWERS:
            raise ConfigError(
                f"cam.follower = {self.follower!r}; allowed: {', '.join(FOLLOWERS)}"
            )
        for key, value in (
            ("lift_mm", self.lift),
            ("base_radius_mm", self.base_radius),
            ("span_deg", self.span),
        ):
            if not value > 0.0:
                raise ConfigError(
                    f"cam.{key} = {from_si(key, value):g} must be positive"
                )
        if self.span > 2.0 * math.pi:
            raise ConfigError(
                f"cam.span_deg = {math.degrees(self.span):g} must be at most a turn of the cam, 360"
            )
        for key, value in (
            ("roller_radius_mm", self.roller_radius),
            ("moving_mass_kg", self.moving_mass),
            ("spring_preload_n", self.spring_preload),
            ("spring_rate_n_per_m", self.spring_rate),
        ):
            if not value >= 0.0:
                raise ConfigError(
                    f"cam.{key} = {from_si(key, value):g} must not be negative"
                )
        if not 0.0 <= self.friction_coefficient <= 1.0:
            raise ConfigError(
                f"cam.friction_coefficient = {self.friction_coefficient:g} must lie in 0..1"
            )
        if (self.follower == "roller") != (self.roller_radius > 0.0):
            raise ConfigError(
                f"cam.roller_radius_mm = {self.roller_radius * 1e3:g} with follower = "
                f"{self.follower}; a roller has a "
                "radius, a flat follower none (0)"
            )

    def motion(self, angle: Array) -> tuple[Array, Array, Array]:
        """Lift m, slope m/rad and curvature m/rad2 at the cam's angle in rad from where it begins
        to lift.
        """
        share = np.mod(angle, 2.0 * math.pi) / self.span
        on = share < 1.0
        both = np.where(on, share * (1.0 - share), 0.0)
        side = 1.0 - 2.0 * share
        lift = 64.0 * both**3
        slope = 192.0 * np.square(both) * side
        curvature = 384.0 * both * (np.square(side) - both)
        return (
            self.lift * lift,
            self.lift * slope / self.span,
            self.lift * curvature / self.span**2,
        )


def follower_force(
    cam: Cam, angle: Array, speed: float, load: Array | float = 0.0
) -> Array:
    """Force of the follower on the cam while it lifts, along the follower's way, (point,) N; 0 on
    the base circle.

    Parameters
    ----------
    angle : (point,) rad    of the cam from where it begins to lift
    speed : rad/s           of the cam
    load : (point,) N       on the follower besides spring and mass, such as a plunger's

    Raises
    ------
    ConfigError    where the spring cannot hold the follower on the cam
    """
    lift, _, curvature = cam.motion(angle)
    on = np.mod(angle, 2.0 * math.pi) < cam.span
    spring = cam.spring_preload + cam.spring_rate * lift
    force = np.where(on, spring + cam.moving_mass * speed**2 * curvature + load, 0.0)
    if force.min() < 0.0:
        raise ConfigError(
            f"the follower leaves its cam at {speed * 30.0 / math.pi:.4g} r/min of "
            "the camshaft: the spring lacks "
            f"{-force.min():.4g} N; raise spring_preload_n or spring_rate_n_per_m"
        )
    return force


def cam_torque(
    cam: Cam, angle: Array, speed: float, load: Array | float = 0.0
) -> Array:
    """Torque on the camshaft, (point,) N m, negative where the cam takes it: T = -(F dh/da + F_s
    r).

    Parameters
    ----------
    angle, speed, load : see `follower_force`

    Notes
    -----
    Eq. (20) of the engine paper for a flat follower, F_z e + F_s (h + R_1): its contact is e =
    dh/da off the axis. For a roller eq. (21), F (r_0 + r_1 + h) tan a_3, with F the force along
    the plunger (the paper's text says the side force), is F dh/da: tan a_3 = (dh/da) / (r_0 +
    r_1 + h). Friction always opposes the rotation.
    """
    force = follower_force(cam, angle, speed, load)
    lift, slope, _ = cam.motion(angle)
    friction = cam.friction_coefficient * force * (cam.base_radius + lift)
    return -(force * slope + friction)
