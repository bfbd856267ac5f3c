"""Lives over torque and speed, and fitted laws with the range of their fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, ExtrapolationError, SimulationError
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import hours, wear_life

EXPONENT_STEP = 0.05  # of the torque, on either side


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LifeMap:
    """Lives over torques (torque,) N m and speeds (speed,) rad/s of the pinion.

    ``turns`` (torque,) of the pinion do not depend on the speed: flanks slide as far in a turn,
    however fast.
    """

    torque: Array
    speed: Array
    turns: Array

    @property
    def hours(self) -> Array:
        """(torque, speed)."""
        rows = [[hours(turns, speed) for speed in self.speed] for turns in self.turns]
        return np.array(rows)


def life_map(
    case: WearCase, torques: Sequence[float], speeds: Sequence[float]
) -> LifeMap:
    """Lives of a pair under other torques in N m and at speeds in rad/s.

    Raises
    ------
    ConfigError    for torques or speeds that are not positive, or less than two of either
    """
    for name, values in (("torques", torques), ("speeds", speeds)):
        if len(set(values)) < 2 or not min(values) > 0.0:
            raise ConfigError(
                f"a map needs two {name} or more, all positive; {len(set(values))} different given"
            )
    torque = np.unique(np.asarray(torques, dtype=np.float64))
    speed = np.unique(np.asarray(speeds, dtype=np.float64))
    turns = np.array([_life_at(case, float(value)) for value in torque])
    return LifeMap(torque=torque, speed=speed, turns=turns)


def _life_at(case: WearCase, torque: float) -> float:
    try:
        return wear_life(case.with_torque(torque)).life
    except (ConfigError, SimulationError) as error:
        raise type(error)(f"at {torque:g} N m of the map: {error}") from None


def torque_exponent(case: WearCase) -> float:
    """Local exponent n of life ~ T^-n at the case's torque."""
    steps = (1.0 - EXPONENT_STEP, 1.0 + EXPONENT_STEP)
    low, high = (wear_life(case.with_torque(case.torque * step)).life for step in steps)
    return -math.log(high / low) / math.log(steps[1] / steps[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedLaw:
    """Hours of life as a formula, with the range of its fit.

    Torque T in N m and speed w in rad/s are those of the pinion. ``power``: a T^-b w^-c.
    ``logarithm``: a - b ln(T), at one speed. ``exponential``: a exp(-b w), at one torque. The
    last two are the forms of the wear-life paper, eqs. (25) and (26). ``largest_error`` is the
    greatest relative deviation from the fitted lives.
    """

    form: str
    a: float
    b: float
    c: float
    torque: tuple[float, float]
    speed: tuple[float, float]
    largest_error: float

    def formula(self, torque: Array | float, speed: Array | float) -> Array | float:
        """Value of the formula anywhere; it may be negative, which no life is."""
        if self.form == "power":
            return self.a * np.asarray(torque) ** -self.b * np.asarray(speed) ** -self.c
        if self.form == "logarithm":
            return self.a - self.b * np.log(torque)
        return self.a * np.exp(-self.b * np.asarray(speed))

    def life(
        self, torque: float, speed: float, *, allow_extrapolation: bool = False
    ) -> float:
        """Hours of life.

        Raises
        ------
        ExtrapolationError    beyond the fitted range, unless allowed
        SimulationError       where the formula gives no life at all, which it may even inside its
        range
        """
        for name, unit, value, (low, high) in (
            ("torque", "N m", torque, self.torque),
            ("speed", "rad/s", speed, self.speed),
        ):
            is_inside = low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9)
            if not is_inside and not allow_extrapolation:
                raise ExtrapolationError(
                    f"the {self.form} law was fitted for a {name} of {low:g} to {high:g} {unit}, "
                    f"not {value:g}; take gensig wear-life itself there"
                )
        life = float(self.formula(torque, speed))
        if not life > 0.0:
            raise SimulationError(
                f"the {self.form} law gives a life of {life:.4g} hours at {torque:g} N m: "
                "it is a fit, not physics"
            )
        return life

    @property
    def no_life_from(self) -> float | None:
        """Torque in N m from which the formula gives no life but a negative one.

        None where it always gives one.
        """
        if self.form != "logarithm":
            return None
        return math.exp(self.a / self.b)

    @property
    def text(self) -> str:
        """The formula in figures."""
        if self.form == "power":
            return f"{self.a:.5g} T^-{self.b:.4f} w^-{self.c:.4f}"
        if self.form == "logarithm":
            return f"{self.a:.5g} - {self.b:.5g} ln(T)"
        return f"{self.a:.5g} exp(-{self.b:.5g} w)"


def fitted_laws(lives: LifeMap, torque: float, speed: float) -> tuple[FittedLaw, ...]:
    """All three forms fitted to a map.

    Those of one variable at the nearest torque and speed of the map.
    """
    at_speed = int(np.argmin(np.abs(lives.speed - speed)))
    at_torque = int(np.argmin(np.abs(lives.torque - torque)))
    values = lives.hours
    log_torque, log_speed = np.meshgrid(
        np.log(lives.torque), np.log(lives.speed), indexing="ij"
    )
    columns = np.stack(
        [np.ones(values.size), -log_torque.ravel(), -log_speed.ravel()], axis=1
    )
    fit = np.linalg.lstsq(columns, np.log(values).ravel(), rcond=None)[0]
    constant, by_torque, by_speed = fit
    slope, level = np.polyfit(np.log(lives.torque), values[:, at_speed], 1)
    decay, start = np.polyfit(lives.speed, np.log(values[at_torque]), 1)
    at_single_torque = replace(lives, torque=lives.torque[[at_torque]])
    at_single_speed = replace(lives, speed=lives.speed[[at_speed]])
    power = (math.exp(constant), by_torque, by_speed)
    return (
        _law("power", power, lives, values),
        _law("logarithm", (level, -slope, 0.0), at_single_speed, values[:, [at_speed]]),
        _law(
            "exponential",
            (math.exp(start), -decay, 0.0),
            at_single_torque,
            values[[at_torque]],
        ),
    )


def _law(
    form: str, numbers: tuple[float, float, float], lives: LifeMap, values: Array
) -> FittedLaw:
    """Law with the span of the map that it was fitted to; ``values`` (torque, speed) in hours."""
    a, b, c = map(float, numbers)
    torque, speed = (
        (float(axis.min()), float(axis.max())) for axis in (lives.torque, lives.speed)
    )
    law = FittedLaw(
        form=form, a=a, b=b, c=c, torque=torque, speed=speed, largest_error=0.0
    )
    fitted = law.formula(lives.torque[:, None], lives.speed)
    error = float(np.max(np.abs(fitted / values - 1.0)))
    return replace(law, largest_error=error)
