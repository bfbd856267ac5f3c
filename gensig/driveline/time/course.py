"""Nominal rotation of a shaft line over time, and torques over the angle of their shafts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time._layout import Course
from gensig.errors import ConfigError
from gensig.units import from_si

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LineCourse:
    """Nominal speed of the reference, straight between knots and constant outside; time 0 is the
    first sample.

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

    @cached_property
    def knots(self) -> Course:
        """The course as the compiled core takes it; the nominal angle is 0 at time 0."""
        gain = np.zeros_like(self.speed)
        gain[:-1] = np.diff(self.speed) / np.diff(self.time)
        angle = np.zeros_like(self.speed)
        angle[1:] = np.cumsum(
            0.5 * (self.speed[1:] + self.speed[:-1]) * np.diff(self.time)
        )
        course = Course(time=self.time, speed=self.speed, angle=angle, gain=gain)
        return course._replace(angle=angle - _at(course, np.zeros(1))[0][0])

    def nominal(self, times: Array) -> tuple[Array, Array]:
        """Angle in rad and speed in rad/s of the reference at times in s, (time,) each."""
        return _at(self.knots, times)

    def acceleration(self, time: float) -> float:
        """Acceleration of the reference at a time in s, rad/s2; that after a knot at the knot."""
        knot = int(np.searchsorted(self.time, time, side="right")) - 1
        return float(self.knots.gain[knot]) if knot >= 0 else 0.0


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


def _at(course: Course, times: Array) -> tuple[Array, Array]:
    knot = np.clip(np.searchsorted(course.time, times, side="right") - 1, 0, None)
    since = times - course.time[knot]
    gain = np.where(since < 0.0, 0.0, course.gain[knot])
    speed = course.speed[knot]
    return course.angle[knot] + (
        speed + 0.5 * gain * since
    ) * since, speed + gain * since
