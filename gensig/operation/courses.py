"""Courses over time: piecewise linear factors, ramps, random walks, and the ripple on them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.units import check_limits, check_positive, unit

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


MOST_POINTS = 100_000
LATEST = 1e6  # s
# s; the integration takes the course as straight through every millisecond
SHORTEST_PIECE = 1e-3
# Hz; straight pieces of 1 ms take sinc^2(0.15) of it, 7.2 % too little; points are exact
FASTEST_RIPPLE = 150.0
EARLIEST = -2.0  # s; a walk begins here, before any machine begins to settle
# straight lines between points take 1.6 % of the variance
POINTS_PER_CORRELATION_TIME = 20
# standard deviations at which a walk is cut, so that its slowest is known; 6e-5 of the time
WALK_LIMIT = 4.0
MOST_SCATTER = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Piecewise linear factor over time.

    It holds its first value before its first time and its last value after its last time.
    ``times`` in s from the first recorded sample, ``factors`` as many shares of the set-point.
    """

    times: tuple[float, ...]
    factors: tuple[float, ...]

    def __post_init__(self) -> None:
        n = len(self.times)
        if n != len(self.factors):
            raise ConfigError(
                f"{n} times and {len(self.factors)} factors; give one factor a time"
            )
        if not 2 <= n <= MOST_POINTS:
            raise ConfigError(f"{n} points; give 2 to {MOST_POINTS}")
        points = zip(self.times, self.factors, strict=True)
        for index, (time, factor) in enumerate(points):
            if not (abs(time) <= LATEST and math.isfinite(factor)):
                raise ConfigError(
                    f"point {index} = [{time:g}, {factor:g}]; give a time within {LATEST:g} s "
                    "and a finite factor"
                )
        for earlier, later in itertools.pairwise(self.times):
            if not later - earlier >= SHORTEST_PIECE * (1.0 - 1e-9):
                raise ConfigError(
                    f"the time {later:g} s follows {earlier:g} s; times must increase, by "
                    f"{SHORTEST_PIECE:g} s or more"
                )

    @property
    def least(self) -> float:
        """The smallest factor."""
        return min(self.factors)

    def curve(self) -> PPoly:
        """Factor as a function of time in s.

        Its derivative at a point is that of the piece that begins there.
        """
        from scipy.interpolate import PPoly

        times = np.array([self.times[0] - 1.0, *self.times, self.times[-1] + 1.0])
        factors = np.array([self.factors[0], *self.factors, self.factors[-1]])
        return PPoly([np.diff(factors) / np.diff(times), factors[:-1]], times)

    def later(self, delay: float) -> Profile:
        """Same course, ``delay`` s later."""
        return replace(self, times=tuple(time + delay for time in self.times))


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """Straight course from one factor to another, in s from the first recorded sample.

    An ``end`` of None is that of the record.
    """

    first_factor: float
    last_factor: float
    begin: float = unit("s", default=0.0)
    end: float | None = unit("s", default=None)

    @property
    def least(self) -> float:
        """The smallest factor."""
        return min(self.first_factor, self.last_factor)

    def profile(self, duration: float) -> Profile:
        """Course of a record of ``duration`` s."""
        end = self.end
        if end is None:
            end = duration
        factors = (self.first_factor, self.last_factor)
        return Profile(times=(self.begin, end), factors=factors)


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomWalk:
    """Factor that wanders about 1 and comes back: an Ornstein-Uhlenbeck process.

    ``scatter`` is its standard deviation, ``correlation_time`` in s the time after which its
    autocorrelation exp(-|t| / correlation_time) has fallen to 1/e.

    Source: Uhlenbeck & Ornstein (1930). Sampled exactly at even points (Gillespie 1996, eq. 1.9),
    x_k+1 = rho x_k + sqrt(1 - rho^2) n_k with rho = exp(-step / correlation_time) and n_k
    standard normal; linear between them.
    """

    scatter: float
    correlation_time: float = unit("s")

    def __post_init__(self) -> None:
        least = POINTS_PER_CORRELATION_TIME * SHORTEST_PIECE
        limits = {"scatter": (0.0, MOST_SCATTER), "correlation_time": (least, LATEST)}
        check_limits(self, "", **limits)

    @property
    def least(self) -> float:
        """The smallest factor that can be drawn."""
        return 1.0 - WALK_LIMIT * self.scatter

    def profile(self, duration: float, rng: np.random.Generator) -> Profile:
        """Course of a record of ``duration`` s; that of a longer record goes on from it.

        It is a function of the absolute time: where the simulation of a record begins does not
        change it.
        """
        step = self.correlation_time / POINTS_PER_CORRELATION_TIME
        n_points = math.ceil((duration - EARLIEST) / step) + 2
        if n_points > MOST_POINTS:
            longest = POINTS_PER_CORRELATION_TIME * (duration - EARLIEST)
            least = 1.01 * longest / (MOST_POINTS - 2)
            raise ConfigError(
                f"correlation_time_s = {self.correlation_time:g} needs {n_points} points for "
                f"{duration:g} s, more than "
                f"{MOST_POINTS}; give {least:.3g} or more"
            )
        rho = math.exp(-step / self.correlation_time)
        fresh = math.sqrt(1.0 - rho * rho)
        normal = rng.standard_normal(n_points).tolist()
        walk = itertools.accumulate(
            normal, lambda value, draw: rho * value + fresh * draw
        )
        scatter, most = self.scatter, WALK_LIMIT
        return Profile(
            times=tuple(EARLIEST + step * index for index in range(n_points)),
            factors=tuple(
                1.0 + scatter * min(max(value, -most), most) for value in walk
            ),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ripple:
    """Course times 1 + ``share`` sin(psi).

    psi is ``order`` times the pinion's set angle, or of a fixed ``frequency`` in Hz. The set
    angle is that of the speed without its ripple, 0 at the first recorded sample. ``phase`` in
    rad is psi at the first recorded sample.
    """

    share: float
    order: float | None = None
    frequency: float | None = unit("hz", default=None)
    phase: float = unit("deg", default=0.0)

    def __post_init__(self) -> None:
        if not 0.0 <= self.share < 1.0:
            raise ConfigError(
                f"share = {self.share:g} must lie in 0..1, 1 not included"
            )
        if (self.order is None) == (self.frequency is None):
            raise ConfigError(
                "give order (of the pinion's turn) or frequency_hz, one of the two"
            )
        check_positive(self, "", "order", "frequency")

    @property
    def _fixed_rate(self) -> float:
        """Circular frequency of a ripple that has one, else 0, rad/s."""
        return 2.0 * math.pi * (self.frequency or 0.0)

    def rate(self, speed: Array) -> Array:
        """Growth of psi at set speeds of the pinion in rad/s, (time,) rad/s."""
        return (self.order or 0.0) * speed + self._fixed_rate

    def psi(self, times: Array, set_angle: Array) -> Array:
        """Angle of the sine at times in s with their set angles in rad, (time,) rad."""
        return (self.order or 0.0) * set_angle + self._fixed_rate * times + self.phase

    def gained(
        self, times: Array, set_angle: Array, set_speed: float, profile: Profile | None
    ) -> Array:
        """Integral of profile x share x sin(psi) from time 0, (time,) s.

        With an order it is share / (order set_speed) [-cos psi], since the set angle grows by
        profile x set_speed. With a frequency, [-profile cos psi] / w and the integral by parts:
        on each piece the slope is constant.
        """
        if self.order is not None:
            turned = math.cos(self.phase) - np.cos(self.psi(times, set_angle))
            return self.share / (self.order * set_speed) * turned
        rate = self._fixed_rate
        course = profile or Profile(times=(0.0, 1.0), factors=(1.0, 1.0))
        knots, factors = course.times, course.factors

        sine = np.sin(rate * np.array(knots) + self.phase) / rate
        slope = np.diff(factors) / np.diff(knots)
        before = np.concatenate([[0.0], np.cumsum(slope * np.diff(sine))])

        def primitive(time: Array) -> Array:
            held = np.clip(time, knots[0], knots[-1])
            piece = np.searchsorted(knots, held, side="right") - 1
            piece = np.clip(piece, 0, len(knots) - 2)
            rest = np.sin(rate * held + self.phase) / rate - sine[piece]
            partly = before[piece] + slope[piece] * rest
            cosine = np.interp(time, knots, factors) * np.cos(rate * time + self.phase)
            return np.asarray((partly - cosine) / rate)

        at_times = primitive(np.asarray(times, dtype=np.float64))
        return self.share * (at_times - primitive(np.zeros(1)))

    def later(self, delay: float, set_angle: float) -> Ripple:
        """Same ripple, ``delay`` s and ``set_angle`` rad later."""
        turned = (self.order or 0.0) * set_angle
        return replace(self, phase=self.phase - turned - self._fixed_rate * delay)
