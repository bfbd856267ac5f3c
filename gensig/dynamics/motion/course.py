"""Nominal rotation of a machine over time, and torques over the angle of its shafts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, final

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.operation.setpoint import Operating
from gensig.units import from_si


class Turning(NamedTuple):
    """Nominal rotation of the reference at one instant: rad since time 0, rad/s, rad/s2."""

    angle: float
    speed: float
    acceleration: float


class Course(ABC):
    """Nominal rotation of the reference over time, and shares of the set torques.

    Time 0 is the first sample of a record.
    """

    @property
    @abstractmethod
    def is_steady(self) -> bool:
        """True where neither speed nor torques change."""

    @property
    @abstractmethod
    def n_knots(self) -> int:
        """Number of values of the factor that a torque may have."""

    @abstractmethod
    def at(self, time: float) -> Turning:
        """Rotation at a time in s, without ripple in its acceleration."""

    @abstractmethod
    def over(self, times: Array) -> tuple[Array, Array]:
        """Angle in rad since time 0 and speed in rad/s at times in s, (time,) each.

        ``times`` increase and hold 0; the speed may be taken to go straight between them.
        """

    @abstractmethod
    def share(self, factor: Array | None, times: Array) -> Array:
        """Share of its set size that a torque has at times in s, (time,).

        ``factor`` (knot,) is its own; None for a torque without one.
        """

    @abstractmethod
    def with_knots(self) -> LineCourse:
        """The course as one that is straight between knots; ConfigError where it is not."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SetCourse(Course):
    """The course of a set-point, whose profiles and ripples all torques follow."""

    operating: Operating

    @property
    def is_steady(self) -> bool:
        """As ``Course.is_steady``."""
        return self.operating.is_steady

    @property
    def n_knots(self) -> int:
        """0: no torque has a factor of its own."""
        return 0

    def at(self, time: float) -> Turning:
        """As ``Course.at``."""
        operating, times = self.operating, np.array([time])
        nominal = smooth = operating.nominal(times)
        if operating.has_ripple:
            smooth = operating.without_ripple.nominal(times)
        return Turning(
            angle=float(nominal.angle[0]),
            speed=float(nominal.speed[0]),
            acceleration=float(smooth.acceleration[0]),
        )

    def over(self, times: Array) -> tuple[Array, Array]:
        """As ``Course.over``; the speed is straight between the times."""
        speed = self.operating.nominal(times).speed
        turned = 0.5 * (speed[1:] + speed[:-1]) * np.diff(times)
        now = int(np.searchsorted(times, 0.0))
        # from time 0 outwards, so that an instant has the same bits in any span
        before = -np.cumsum(turned[:now][::-1])[::-1]
        return np.concatenate([before, [0.0], np.cumsum(turned[now:])]), speed

    def share(self, factor: Array | None, times: Array) -> Array:
        """The factor of the set torque, (time,)."""
        return self.operating.nominal(times).torque_factor

    def with_knots(self) -> LineCourse:
        """As ``Course.with_knots``: of one speed and torque."""
        if not self.is_steady:
            raise ConfigError(
                "solver.backend = newmark needs knots of the course of a machine, but this one's "
                "speed or torque changes all the time; take solver.backend=nystroem"
            )
        return constant_speed(self.operating.speed)


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class LineCourse(Course):
    """Nominal speed of the reference, straight between knots and constant outside.

    ``time`` (knot,) s, increasing, ``speed`` (knot,) rad/s. No slots: the angles are kept once
    they are made.
    """

    time: Array
    speed: Array

    def __post_init__(self) -> None:
        if (
            self.time.ndim != 1
            or self.time.shape != self.speed.shape
            or len(self.time) < 1
        ):
            raise ConfigError(
                f"course: time {self.time.shape} and speed {self.speed.shape} must be "
                "alike, (knot,)"
            )
        if not np.isfinite(self.time).all() or np.any(np.diff(self.time) <= 0.0):
            raise ConfigError("course: the times of its knots must increase")
        if not np.isfinite(self.speed).all() or self.speed.min() < 0.0:
            raise ConfigError(
                f"course: speed {from_si('speed_rpm', float(self.speed.min())):g} "
                "r/min must not be negative"
            )

    @property
    def is_steady(self) -> bool:
        """As ``Course.is_steady``."""
        return len(self.time) == 1

    @property
    def n_knots(self) -> int:
        """As ``Course.n_knots``."""
        return len(self.time)

    @cached_property
    def gain(self) -> Array:
        """Acceleration after every knot, (knot,) rad/s2."""
        gain = np.zeros_like(self.speed)
        gain[:-1] = np.diff(self.speed) / np.diff(self.time)
        return gain

    @cached_property
    def angle(self) -> Array:
        """Angle of the reference at every knot, 0 at time 0, (knot,) rad."""
        angle = np.zeros_like(self.speed)
        angle[1:] = np.cumsum(
            0.5 * (self.speed[1:] + self.speed[:-1]) * np.diff(self.time)
        )
        return np.asarray(angle - self._turned(angle, np.zeros(1))[0][0])

    def over(self, times: Array) -> tuple[Array, Array]:
        """As ``Course.over``."""
        return self._turned(self.angle, times)

    def at(self, time: float) -> Turning:
        """As ``Course.at``; the acceleration at a knot is that after it."""
        angle, speed = self.over(np.array([time]))
        knot = int(np.searchsorted(self.time, time, side="right")) - 1
        acceleration = float(self.gain[knot]) if knot >= 0 else 0.0
        return Turning(float(angle[0]), float(speed[0]), acceleration)

    def share(self, factor: Array | None, times: Array) -> Array:
        """As ``Course.share``; 1 without a factor."""
        if factor is None:
            return np.ones(len(times))
        return np.interp(times, self.time, factor)

    def with_knots(self) -> LineCourse:
        """The course itself."""
        return self

    def _turned(self, angle: Array, times: Array) -> tuple[Array, Array]:
        """Angle and speed at times, (time,) each, for angles (knot,)."""
        knot = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, None)
        since = times - self.time[knot]
        gain = np.where(since < 0.0, 0.0, self.gain[knot])
        speed = self.speed[knot]
        turned = (speed + 0.5 * gain * since) * since
        return angle[knot] + turned, speed + gain * since


def constant_speed(speed: float) -> LineCourse:
    """The course of a reference that turns at one speed in rad/s."""
    return LineCourse(time=np.zeros(1), speed=np.array([speed]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShaftTorque:
    """A torque on one degree of freedom over the angle that a shaft has turned; both count as
    they nominally rotate. On a translation it is a force along it.

    ``table`` (node,) N m stands at equal distances over ``period`` rad of that angle and is
    periodic, straight between nodes; one number alone is constant. At time 0 the line stands
    ``phase`` rad into it. ``factor`` (knot,) multiplies it over the knots of the course; None is
    1. A torque over time alone is a constant 1 with a factor in N m. ``turned_by`` is the degree of
    freedom whose angle it follows, None its own: an unbalance acts on x and y over the angle of
    its shaft.
    """

    dof: int
    table: Array
    period: float = 2.0 * np.pi
    phase: float = 0.0
    factor: Array | None = None
    turned_by: int | None = None

    @property
    def turning(self) -> int:
        """Degree of freedom whose angle the torque follows."""
        if self.turned_by is None:
            return self.dof
        return self.turned_by

    def __post_init__(self) -> None:
        if (
            self.table.ndim != 1
            or len(self.table) < 1
            or not np.isfinite(self.table).all()
        ):
            raise ConfigError(
                f"torque on degree of freedom {self.dof}: its table must be finite numbers, (node,)"
            )
        if not 0.0 < self.period < np.inf:
            raise ConfigError(
                f"torque on degree of freedom {self.dof}: period {self.period:g} rad "
                "must be positive"
            )
        if self.factor is not None and not np.isfinite(self.factor).all():
            raise ConfigError(
                f"torque on degree of freedom {self.dof}: its factors must be finite numbers"
            )
