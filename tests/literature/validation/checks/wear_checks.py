"""Quantities of wear lives, by the names that the rows use."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.life.life_laws import (
    FittedLaw,
    LifeMap,
    fitted_laws,
    life_map,
    torque_exponent,
)
from gensig.life.wear.archard import band_half_width, flank_radii
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import WearLife, hours, wear_life
from gensig.operation.options import read_operating
from gensig.options.compose import compose
from gensig.systems.wear import read_wear_case

Array = NDArray[np.float64]
WearCheck = Callable[["WearPoint", str], float]

# the paper's fits as printed; it does not print the ranges they were fitted on
EQ_25 = FittedLaw(
    form="logarithm",
    a=709.3,
    b=127.3,
    c=0.0,
    torque=(10.0, 100.0),
    speed=(12.57, 12.57),
    largest_error=0,
)
EQ_26 = FittedLaw(
    form="exponential",
    a=675.68,
    b=0.1753,
    c=0.0,
    torque=(200, 200),
    speed=(1.57, 12.57),
    largest_error=0,
)
# even grids on which fits of the paper's own law come out with its printed figures: found, not
# printed
TORQUES = tuple(np.arange(10.0, 101.0, 10.0))
SPEEDS = tuple(0.5 * math.pi * np.arange(1, 9))


@dataclass(frozen=True, eq=False)
class WearPoint:
    """One wearing pair at its speed; the same overrides always give the same object."""

    case: WearCase
    speed: float

    @cached_property
    def life(self) -> WearLife:
        """Its life."""
        return wear_life(self.case)

    @cached_property
    def lives(self) -> LifeMap:
        """Lives on the grids of torque and speed."""
        return life_map(self.case, TORQUES, SPEEDS)

    @property
    def load(self) -> Array:
        """Line load of new flanks, (slice, node) N/m."""
        return self.case.line_load(self.case.new_flanks())

    def at(self, values: Array, point: str) -> float:
        """A row of nodes at A, C or E."""
        pitch = int(
            np.argmin(np.abs(self.case.path.position - self.case.pair.pitch_point))
        )
        return float(values[{"A": 0, "C": pitch, "E": -1}[point]])


@lru_cache(maxsize=64)
def read_wear_point(overrides: tuple[str, ...]) -> WearPoint:
    """Compose the pair of a row."""
    config = compose("generate", overrides)
    return WearPoint(
        case=read_wear_case(config), speed=read_operating(config["operating"]).speed
    )


def _pressure(point: WearPoint, at: str) -> float:
    return point.at(point.case.pressure(point.load, point.case.new_flanks())[0], at)


def _per_mesh(*sides: int) -> WearCheck:
    """Depth that a mesh wears off some of the flanks, m."""

    def check(point: WearPoint, at: str) -> float:
        depth = point.case.wear_per_mesh(point.case.new_flanks())[:, 0]
        return point.at(depth[list(sides)].sum(axis=0), at)

    return check


def _sliding(point: WearPoint, at: str) -> float:
    return point.at(point.case.path.sliding, at) * point.speed


def _equation_15(point: WearPoint, at: str) -> float:
    """The paper's relative radius, eq. (15), over that of eqs. (13) and (14)."""
    pair, angle = point.case.pair, point.at(point.case.path.pressure_angle[0], at)
    radius, z1, z2 = pair.pinion.base_radius, pair.pinion.n_teeth, pair.wheel.n_teeth
    tangent = math.tan(angle)
    own = (
        radius * tangent
        - radius * z1 / ((z2 + z1) * math.tan(pair.working_pressure_angle)) * tangent**2
    )
    return own * point.at(point.case.path.relative_curvature, at)


def _band_time(point: WearPoint, at: str) -> float:
    """Time the band needs to pass a point of the faster flank, s."""
    width = 2.0 * band_half_width(point.case.path, point.load[0], point.case.material)
    return point.at(width / (point.case.path.rolling.max(axis=0) * point.speed), at)


def _rate(point: WearPoint, at: str) -> float:
    """Depth of both flanks together worn in an hour, m."""
    rate = point.case.rate(point.case.new_flanks())[:, 0].sum(axis=0)
    return point.at(rate, at) / hours(1.0, point.speed)


def _life(point: WearPoint, at: str) -> float:
    return 3600.0 * hours(point.life.life, point.speed)


def _intervals_effect(point: WearPoint, at: str) -> float:
    """Life with twice the intervals of a mesh, so steps of half the time, over the life."""
    finer = replace(point.case.options, n_intervals=2 * point.case.options.n_intervals)
    return wear_life(replace(point.case, options=finer)).life / point.life.life


def _step_effect(point: WearPoint, at: str) -> float:
    """Change of the life by half the step of the solver, relative, to four decimals."""
    finer = replace(point.case.options, step=0.05 * point.case.options.threshold)
    return round(
        abs(wear_life(replace(point.case, options=finer)).life / point.life.life - 1.0),
        4,
    )


def _degenerate(point: WearPoint, at: str) -> float:
    """Life with half the threshold and twice the intervals over the life."""
    options = point.case.options
    other = replace(
        options, threshold=0.5 * options.threshold, n_intervals=2 * options.n_intervals
    )
    return wear_life(replace(point.case, options=other)).life / point.life.life


def _radius_ratio(kind: str) -> WearCheck:
    """Curvature radius of the pinion's flank at the end of the life over the new one."""

    def check(point: WearPoint, at: str) -> float:
        depth = point.life.depth[-1][:, 0]
        radii = flank_radii(point.case.path, depth, point.load[0], point.case.material)
        nodes = {"A": 10, "C": 0, "E": -11}[
            at
        ]  # away from the ends, beyond which nothing wears
        if at == "C":
            return point.at(radii[kind][0] / radii["new"][0], at)
        return float(radii[kind][0, nodes] / radii["new"][0, nodes])

    return check


def _fit(point: WearPoint, at: str) -> float:
    """Of the fits to our lives on the grids.

    Level over slope of the logarithm, or decay of the exponential.
    """
    _, logarithm, exponential = fitted_laws(point.lives, TORQUES[-1], SPEEDS[-1])
    if at == "logarithm":
        return logarithm.a / logarithm.b
    return exponential.b


def _printed_exponent(point: WearPoint, at: str) -> float:
    """Local exponent of the printed fits.

    B / L at a torque of eq. (25), b w at a speed of eq. (26).
    """
    equation, value = at.split()
    if equation == "(25)":
        return EQ_25.b / float(EQ_25.formula(float(value), 0.0))
    return EQ_26.b * float(value)


def _printed_ratio(point: WearPoint, at: str) -> float:
    """Eq. (26) over eq. (25) at the case's torque and speed, which both are said to hold for."""
    return float(EQ_26.formula(point.case.torque, point.speed)) / float(
        EQ_25.formula(point.case.torque, point.speed)
    )


WEAR: dict[str, WearCheck] = {
    "wear.contact_ratio": lambda point, at: point.case.pair.transverse_contact_ratio,
    "wear.pressure_angle": lambda point, at: point.at(
        point.case.path.pressure_angle[0], at
    ),
    "wear.factor": lambda point, at: point.case.options.wear_factor("pinion"),
    "wear.sliding": _sliding,
    "wear.sliding_root_over_tip": lambda point, at: abs(
        _sliding(point, "A") / _sliding(point, "E")
    ),
    "wear.sliding_root_times_tip": lambda point, at: (
        _sliding(point, "A") * _sliding(point, "E")
    ),
    "wear.sliding_at_pitch": lambda point, at: abs(
        _sliding(point, "C") / _sliding(point, "A")
    ),
    "wear.pressure": _pressure,
    "wear.pressure_root_over_tip": lambda point, at: (
        _pressure(point, "A") / _pressure(point, "E")
    ),
    "wear.equation_15": _equation_15,
    "wear.pinion_per_mesh": _per_mesh(0),
    "wear.wheel_per_mesh": _per_mesh(1),
    "wear.both_per_mesh": _per_mesh(0, 1),
    "wear.pitch_over": lambda point, at: (
        _per_mesh(0)(point, "C") / _per_mesh(0)(point, at)
    ),
    "wear.pinion_root_over_wheel_tip": lambda point, at: (
        _per_mesh(0)(point, "A") / _per_mesh(1)(point, "A")
    ),
    "wear.band_time": _band_time,
    "wear.rate": _rate,
    "wear.life": _life,
    "wear.torque_exponent": lambda point, at: torque_exponent(point.case),
    "wear.half_the_time_step": _intervals_effect,
    "wear.half_the_step": _step_effect,
    "wear.threshold_for_intervals": _degenerate,
    "wear.radius_of_profile": _radius_ratio("worn"),
    "wear.radius_by_eq_22": _radius_ratio("by_eq_22"),
    "wear.fit": _fit,
    "wear.printed_exponent": _printed_exponent,
    "wear.printed_fits_apart": _printed_ratio,
}
