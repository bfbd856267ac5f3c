"""At what speed and load a machine runs over time, and what drives it."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.units import from_si, unit

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Array = NDArray[np.float64]

MOST_POINTS = 10_000
LATEST = 1e6  # s
SHORTEST_PIECE = 1e-3  # s; the integration takes the course as straight through every millisecond


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """A factor over time, piecewise linear; it holds its first value before its first time and its last value after.

    ``times`` in s from the first recorded sample, ``factors`` as many shares of the set-point.
    """

    times: tuple[float, ...]
    factors: tuple[float, ...]

    def __post_init__(self) -> None:
        n = len(self.times)
        if n != len(self.factors):
            raise ConfigError(f"{n} times and {len(self.factors)} factors; give one factor a time")
        if not 2 <= n <= MOST_POINTS:
            raise ConfigError(f"{n} points; give 2 to {MOST_POINTS}")
        for place, (time, factor) in enumerate(zip(self.times, self.factors, strict=True)):
            if not (abs(time) <= LATEST and math.isfinite(factor)):
                raise ConfigError(
                    f"point {place} = [{time:g}, {factor:g}]; give a time within {LATEST:g} s and a finite factor"
                )
        for earlier, later in pairwise(self.times):
            if not later - earlier >= SHORTEST_PIECE * (1.0 - 1e-9):
                raise ConfigError(
                    f"the time {later:g} s follows {earlier:g} s; times must increase, by {SHORTEST_PIECE:g} s or more"
                )

    def curve(self) -> PPoly:
        """The factor as a function of time in s; its derivative at a point is that of the piece that begins there."""
        from scipy.interpolate import PPoly

        times = np.array([self.times[0] - 1.0, *self.times, self.times[-1] + 1.0])
        factors = np.array([self.factors[0], *self.factors, self.factors[-1]])
        return PPoly([np.diff(factors) / np.diff(times), factors[:-1]], times)


@dataclass(frozen=True, slots=True, kw_only=True)
class Nominal:
    """Nominal motion of the pinion and share of the set torque at some times, (time,) each.

    ``angle`` rad since time 0, ``speed`` rad/s, ``acceleration`` rad/s2, ``torque_factor``, ``torque_slope`` 1/s; what
    jumps at a point of a profile has the value of the piece that begins there.
    """

    angle: Array
    speed: Array
    acceleration: Array
    torque_factor: Array
    torque_slope: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Operating:
    """Set-point of the pinion, its course over time, and the soft speed source that holds it.

    The driver is T = T_set + k (integral of the set speed - angle) + c (set speed - speed), with k and c giving
    ``drive_frequency`` and ``drive_damping_ratio`` on the inertia reduced to the pinion. The profiles are shares of
    ``speed`` and ``torque``; None is constant.
    """

    speed: float = unit("rpm")
    torque: float = unit("nm")
    duration: float = unit("s")
    drive_frequency: float = unit("hz")
    drive_damping_ratio: float
    speed_profile: Profile | None = None
    torque_profile: Profile | None = None

    def __post_init__(self) -> None:
        for key, suffix in (("speed", "rpm"), ("torque", "nm"), ("duration", "s"), ("drive_frequency", "hz")):
            value = getattr(self, key)
            if not value > 0.0:
                name = f"{key}_{suffix}"
                raise ConfigError(f"operating.{name} = {from_si(name, value):g} must be positive")
        if not 0.0 < self.drive_damping_ratio <= 10.0:
            raise ConfigError(f"operating.drive_damping_ratio = {self.drive_damping_ratio:g} must lie in 0..10")
        if self.speed_profile is not None and not min(self.speed_profile.factors) > 0.0:
            raise ConfigError(f"operating.speed_profile: factor {min(self.speed_profile.factors):g} must be positive")
        if self.torque_profile is not None and min(self.torque_profile.factors) < 0.0:
            raise ConfigError(
                f"operating.torque_profile: factor {min(self.torque_profile.factors):g} must not be negative"
            )

    def time_at_set_speed(self, times: Array) -> Array:
        """Time in which the set speed would turn as far as the nominal motion turns from time 0, (time,) s."""
        if self.speed_profile is None:
            return times
        turned = self.speed_profile.curve().antiderivative()
        return np.asarray(turned(times) - turned(0.0))

    def nominal(self, times: Array) -> Nominal:
        """Nominal motion and torque at times in s from the first recorded sample, (time,)."""
        speed, speed_slope = _factor_and_slope(self.speed_profile, times)
        torque, torque_slope = _factor_and_slope(self.torque_profile, times)
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


def read_profile(key: str, value: Any) -> Profile | None:
    """Profile of a list of [time_s, factor] pairs, as a configuration has it; None for null.

    Raises
    ------
    ConfigError    for anything else, naming ``key``
    """
    if value is None:
        return None
    if not isinstance(value, list | tuple):
        raise ConfigError(f"{key} = {value!r} is no list; give [time_s, factor] pairs, or null for a constant")
    for place, point in enumerate(value):
        if not (isinstance(point, list | tuple) and len(point) == 2 and all(_is_number(one) for one in point)):
            raise ConfigError(f"{key}: point {place} = {point!r}; give two finite numbers, [time_s, factor]")
    try:
        return Profile(
            times=tuple(float(time) for time, _ in value), factors=tuple(float(factor) for _, factor in value)
        )
    except ConfigError as error:
        raise ConfigError(f"{key}: {error}") from None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
