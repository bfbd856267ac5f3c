"""Distributions and designs that plans draw from: a point of the unit interval in, a value out."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError

LATIN_HYPERCUBE, GRID = "latin_hypercube", "grid"
DESIGNS = (LATIN_HYPERCUBE, "sobol", GRID)
LEVELS = "levels"  # any distribution may have it; only a grid reads it
CHOICE = "choice"


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution(ABC):
    """Distribution of one key of a plan or of a fault.

    Attributes
    ----------
    levels : number of values in a grid; 0 where the values are drawn
    names_levels : whether the file gives ``levels``, null included
    """

    levels: int
    names_levels: bool

    @property
    @abstractmethod
    def least(self) -> float:
        """Smallest value."""

    @property
    @abstractmethod
    def text(self) -> str:
        """The range in words, such as '1200 to 2400'."""

    @abstractmethod
    def values_at(self, unit: Array) -> list[Any]:
        """Values at points of the unit interval, (point,); plain Python numbers."""

    @abstractmethod
    def level_values(self) -> list[Any]:
        """Values in a grid, in order; none for a distribution without levels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range(Distribution):
    """Distribution between two values, both included."""

    low: float
    high: float

    @property
    def least(self) -> float:
        """The lower end."""
        return self.low

    @property
    def text(self) -> str:
        """Both ends."""
        return f"{self.low:g} to {self.high:g}"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Uniform(Range):
    """Equal probability; levels in equal steps."""

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        return (self.low + (self.high - self.low) * unit).tolist()

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return np.linspace(self.low, self.high, self.levels).tolist()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LogUniform(Range):
    """Equal probability of the logarithm; levels in equal ratios."""

    @property
    def text(self) -> str:
        """Both ends."""
        return f"{self.low:g} to {self.high:g}, logarithmic"

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        return (self.low * (self.high / self.low) ** unit).tolist()

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return np.geomspace(self.low, self.high, self.levels).tolist()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Normal(Range):
    """Normal distribution cut off at both ends.

    Levels are medians of parts of equal probability.
    """

    mean: float
    std: float

    @property
    def text(self) -> str:
        """Both ends, mean and standard deviation."""
        ends = f"{self.low:g} to {self.high:g}"
        return f"{ends}, normal around {self.mean:g} by {self.std:g}"

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        from scipy.stats import truncnorm

        a, b = (self.low - self.mean) / self.std, (self.high - self.mean) / self.std
        return truncnorm.ppf(unit, a, b, loc=self.mean, scale=self.std).tolist()

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return self.values_at((np.arange(self.levels) + 0.5) / self.levels)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Integers(Range):
    """Whole numbers of equal probability; levels are those nearest to equal steps."""

    @property
    def text(self) -> str:
        """Both ends."""
        return f"{self.low:g} to {self.high:g}, whole numbers"

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        width = self.high - self.low + 1
        return [min(int(self.low + np.floor(u * width)), int(self.high)) for u in unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return (
            np.rint(np.linspace(self.low, self.high, self.levels)).astype(int).tolist()
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Distribution):
    """Listed values of equal probability.

    They are its levels unless the file says ``levels: null``.
    """

    values: tuple[Any, ...]

    @property
    def least(self) -> float:
        """The smallest listed value."""
        return min(self.values)

    @property
    def text(self) -> str:
        """The listed values."""
        return ", ".join(f"{value:g}" for value in self.values)

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        n = len(self.values)
        return [self.values[min(int(u * n), n - 1)] for u in unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return list(self.values)


DISTRIBUTIONS: dict[str, type[Distribution]] = {
    "uniform": Uniform,
    "log_uniform": LogUniform,
    "normal": Normal,
    "integers": Integers,
    CHOICE: Choice,
}
KEYS: dict[str, tuple[str, ...]] = {
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "normal": ("mean", "std", "low", "high"),
    "integers": ("low", "high"),
    CHOICE: ("values",),
}


def read_distribution(key: str, spec: Any) -> Distribution:
    """Distribution of a key from its boundary keys.

    Raises
    ------
    ConfigError    unless ``spec`` is a complete distribution
    """
    if not isinstance(spec, Mapping) or spec.get("distribution") not in KEYS:
        raise ConfigError(
            f"{key}: give a distribution, one of {', '.join(KEYS)}, for instance "
            f"{{distribution: uniform, low: 1, high: 2}}"
        )
    kind = spec["distribution"]
    needed = KEYS[kind]
    if set(spec) - {"distribution", LEVELS} != set(needed):
        raise ConfigError(
            f"{key}: {kind} needs exactly {', '.join(needed)} (and levels, for a grid)"
        )
    numbers = {name: spec[name] for name in needed}
    levels = spec.get(LEVELS) or 0
    if kind == CHOICE:
        _check_values(key, spec["values"])
        numbers["values"] = tuple(spec["values"])
        if LEVELS not in spec:
            levels = len(spec["values"])
    else:
        _check_range(key, kind, numbers)
    if spec.get(LEVELS) is not None:
        _check_levels(key, spec)
    return DISTRIBUTIONS[kind](levels=levels, names_levels=LEVELS in spec, **numbers)


def _check_values(key: str, values: Any) -> None:
    if not isinstance(values, list) or not values:
        raise ConfigError(f"{key}: values must be a list with at least one entry")
    if not all(map(_is_number, values)):
        raise ConfigError(f"{key}: values must be finite numbers")


def _check_range(key: str, kind: str, numbers: Mapping[str, Any]) -> None:
    for name, value in numbers.items():
        if not _is_number(value):
            raise ConfigError(f"{key}: {name} = {value!r} is not a finite number")
    low, high = numbers["low"], numbers["high"]
    ends = f"{key}: low = {low:g} and high = {high:g}"
    is_log = kind == "log_uniform"
    if not low < high or (is_log and low <= 0.0):
        also = " and above 0" * is_log
        raise ConfigError(f"{ends} are no range for {kind}; low must be below{also}")
    if kind == "integers" and not (low == int(low) and high == int(high)):
        raise ConfigError(f"{ends} must be whole numbers")
    if kind == "normal" and numbers["std"] <= 0.0:
        raise ConfigError(f"{key}: std = {numbers['std']:g} must be positive")


def _check_levels(key: str, spec: Mapping[str, Any]) -> None:
    levels, kind = spec[LEVELS], spec["distribution"]
    if kind == CHOICE:
        raise ConfigError(
            f"{key}: the levels of a choice are its values; leave levels out, or null to draw them"
        )
    if isinstance(levels, bool) or not isinstance(levels, int) or levels < 2:
        raise ConfigError(
            f"{key}: levels = {levels!r} must be a whole number of at least 2, or null to draw "
            "the values"
        )
    if kind == "integers" and levels > spec["high"] - spec["low"] + 1:
        raise ConfigError(
            f"{key}: levels = {levels}, but there are {spec['high'] - spec['low'] + 1:g} whole "
            "numbers"
        )


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)


def design_points(
    design: str, n_points: int, n_dimensions: int, rng: np.random.Generator
) -> Array:
    """Space-filling points of the unit cube, (point, dimension), in random order.

    The order of a Sobol sequence is structure: point by point two of them are alike in their
    first digits, and so is each with the number of the point. What belongs to a grid but has no
    levels is drawn as a Latin hypercube.
    """
    if design not in DESIGNS:
        raise ConfigError(f"plan.design = {design!r}; allowed: {', '.join(DESIGNS)}")
    if n_dimensions == 0:
        return np.empty((n_points, 0))
    from scipy.stats import qmc

    if design == "sobol":
        power = max(1, math.ceil(math.log2(n_points)))
        points = qmc.Sobol(n_dimensions, rng=rng).random_base2(power)
        return rng.permutation(points[:n_points])
    return qmc.LatinHypercube(n_dimensions, rng=rng).random(n_points)
