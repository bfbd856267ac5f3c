"""Speed and load of a machine over time, and its drive."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.operation.courses import FASTEST_RIPPLE, SHORTEST_PIECE, Profile, Ripple
from gensig.units import check_positive, unit

COURSES = ("speed_profile", "torque_profile", "speed_ripple", "torque_ripple")


@dataclass(frozen=True, slots=True, kw_only=True)
class Nominal:
    """Nominal motion of the pinion and share of the set torque at some times, (time,) each.

    ``angle`` rad since time 0, ``speed`` rad/s, ``acceleration`` rad/s2, ``torque_factor``,
    ``torque_slope`` 1/s; what jumps at a point of a profile has the value of the piece that
    begins there.
    """

    angle: Array
    speed: Array
    acceleration: Array
    torque_factor: Array
    torque_slope: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Operating:
    """Set-point of the pinion, its course over time, and the soft speed source that holds it.

    The driver is T = T_set + k (integral of the set speed - angle) + c (set speed - speed), with
    k and c giving ``drive_frequency`` and ``drive_damping_ratio`` on the inertia reduced to the
    pinion. The profiles are shares of ``speed`` and ``torque``, None is constant; the ripples are
    on top of them. ``speed_tolerance`` is the largest relative error of the mean speed of a record.
    """

    speed: float = unit("rpm")
    torque: float = unit("nm")
    duration: float = unit("s")
    drive_frequency: float = unit("hz")
    drive_damping_ratio: float
    speed_tolerance: float = 0.02
    speed_profile: Profile | None = None
    torque_profile: Profile | None = None
    speed_ripple: Ripple | None = None
    torque_ripple: Ripple | None = None

    def __post_init__(self) -> None:
        check_positive(
            self, "operating.", "speed", "torque", "duration", "drive_frequency"
        )
        if not 0.0 < self.drive_damping_ratio <= 10.0:
            raise ConfigError(
                f"operating.drive_damping_ratio = {self.drive_damping_ratio:g} must lie in 0..10"
            )
        if not 0.0 < self.speed_tolerance <= 1.0:
            raise ConfigError(
                f"operating.speed_tolerance = {self.speed_tolerance:g} must lie in 0..1"
            )
        if self.speed_profile is not None and not self.speed_profile.least > 0.0:
            raise ConfigError(
                f"operating.speed_profile: factor {self.speed_profile.least:g} must be positive"
            )
        if self.torque_profile is not None and self.torque_profile.least < 0.0:
            raise ConfigError(
                f"operating.torque_profile: factor {self.torque_profile.least:g} "
                "must not be negative"
            )
        for key in ("speed_ripple", "torque_ripple"):
            if getattr(self, key) is not None:
                self._check_ripple(f"operating.{key}", getattr(self, key))

    def _check_ripple(self, key: str, ripple: Ripple) -> None:
        most = 1.0
        if self.speed_profile is not None:
            most = max(self.speed_profile.factors)
        fastest = float(ripple.rate(np.array([most * self.speed]))[0]) / (2.0 * math.pi)
        if fastest <= FASTEST_RIPPLE:
            return
        shown = "frequency_hz = "
        if ripple.order is not None:
            shown = f"order {ripple.order:g} makes up to "
        raise ConfigError(
            f"{key}: {shown}{fastest:g} Hz, above {FASTEST_RIPPLE:g} Hz; the course runs straight "
            f"through every {SHORTEST_PIECE * 1e3:g} ms, which is too coarse for it"
        )

    @property
    def is_steady(self) -> bool:
        """True where neither speed nor torque changes."""
        return all(getattr(self, key) is None for key in COURSES)

    @property
    def has_ripple(self) -> bool:
        """True where speed or torque has a ripple."""
        return self.speed_ripple is not None or self.torque_ripple is not None

    @property
    def mean_speed(self) -> float:
        """Mean of the set speed over a record, rad/s."""
        end = self.time_at_set_speed(np.array([self.duration]))
        return self.speed * float(end[0]) / self.duration

    @property
    def without_ripple(self) -> Operating:
        """Same courses without their ripple."""
        return replace(self, speed_ripple=None, torque_ripple=None)

    def earlier(self, lead: float, duration: float) -> Operating:
        """Same courses as a record of ``duration`` s has them that begins ``lead`` s before."""
        turned = -float(self._set_angle(np.array([-lead]))[0])
        moved: dict[str, Any] = {}
        for key in COURSES:
            course = getattr(self, key)
            if isinstance(course, Profile):
                moved[key] = course.later(lead)
            elif isinstance(course, Ripple):
                moved[key] = course.later(lead, turned)
        return replace(self, duration=duration, **moved)

    def _profile_time(self, times: Array) -> Array:
        """``time_at_set_speed`` of the profile alone, (time,) s."""
        if self.speed_profile is None:
            return times
        turned = self.speed_profile.curve().antiderivative()
        return np.asarray(turned(times) - turned(0.0))

    def _set_angle(self, times: Array) -> Array:
        """Angle of the pinion at the set speed without its ripple, (time,) rad since time 0."""
        return self.speed * self._profile_time(times)

    def time_at_set_speed(self, times: Array) -> Array:
        """Time in which the set speed would turn as far as the nominal motion, (time,) s.

        Both turn from time 0.
        """
        smooth = self._profile_time(times)
        if self.speed_ripple is None:
            return smooth
        return smooth + self.speed_ripple.gained(
            times, self.speed * smooth, self.speed, self.speed_profile
        )

    def nominal(self, times: Array) -> Nominal:
        """Nominal motion and torque at times in s from the first recorded sample, (time,)."""
        speed, speed_slope = _factor_and_slope(self.speed_profile, times)
        torque, torque_slope = _factor_and_slope(self.torque_profile, times)
        if self.has_ripple:
            angle, set_speed = self._set_angle(times), self.speed * speed
            speed, speed_slope = _rippled(
                self.speed_ripple, speed, speed_slope, times, angle, set_speed
            )
            torque, torque_slope = _rippled(
                self.torque_ripple, torque, torque_slope, times, angle, set_speed
            )
        return Nominal(
            angle=self.speed * self.time_at_set_speed(times),
            speed=self.speed * speed,
            acceleration=self.speed * speed_slope,
            torque_factor=torque,
            torque_slope=torque_slope,
        )


def _factor_and_slope(profile: Profile | None, times: Array) -> tuple[Array, Array]:
    if profile is None:
        return np.ones(np.shape(times)), np.zeros(np.shape(times))
    curve = profile.curve()
    return curve(times), curve.derivative()(times)


def _rippled(
    ripple: Ripple | None,
    factor: Array,
    slope: Array,
    times: Array,
    set_angle: Array,
    set_speed: Array,
) -> tuple[Array, Array]:
    """A factor and its slope with the ripple on them, (time,) each."""
    if ripple is None:
        return factor, slope
    psi = ripple.psi(times, set_angle)
    whole = 1.0 + ripple.share * np.sin(psi)
    wave_slope = factor * ripple.share * np.cos(psi) * ripple.rate(set_speed)
    return factor * whole, slope * whole + wave_slope
