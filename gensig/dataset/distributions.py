"""Distributions and designs that plans draw from: a point of the unit interval in, a value out."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError

Array = NDArray[np.float64]

GRID = "grid"
DESIGNS = ("latin_hypercube", "sobol", GRID)
LEVELS = "levels"  # any distribution may have it; only a grid reads it
CHOICE = "choice"


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution(ABC):
    """Distribution of one key of a plan or of a fault.

    Attributes
    ----------
    key : dotted name of the key, for messages
    levels : number of values in a grid; None draws them
    names_levels : whether the file gives ``levels``, null included
    """

    key: str
    levels: int | None
    names_levels: bool

    @property
    @abstractmethod
    def least(self) -> float:
        """Smallest value."""

    @property
    @abstractmethod
    def n_levels(self) -> int | None:
        """Number of values that the key has in a grid; None for one that is drawn."""

    @abstractmethod
    def values_at(self, unit: Array) -> list[Any]:
        """Values at points of the unit interval, (point,); plain Python numbers."""

    @abstractmethod
    def level_values(self) -> list[Any]:
        """Values in a grid, in order.

        Raises
        ------
        ConfigError    for a distribution without levels
        """

    def require_levels(self) -> int:
        """The number of levels; ConfigError where there is none."""
        if self.n_levels is None:
            raise ConfigError(
                f"{self.key}: a grid needs its levels, for instance levels: 4, or distribution: "
                f"{CHOICE}"
            )
        return self.n_levels


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
    def n_levels(self) -> int | None:
        """Levels as given."""
        return self.levels


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Uniform(Range):
    """Equal probability; levels in equal steps."""

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        return [float(value) for value in self.low + (self.high - self.low) * unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return [
            float(value)
            for value in np.linspace(self.low, self.high, self.require_levels())
        ]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LogUniform(Range):
    """Equal probability of the logarithm; levels in equal ratios."""

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        return [float(value) for value in self.low * (self.high / self.low) ** unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return [
            float(value)
            for value in np.geomspace(self.low, self.high, self.require_levels())
        ]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Normal(Range):
    """Normal distribution cut off at both ends.

    Levels are medians of parts of equal probability.
    """

    mean: float
    std: float

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        from scipy.stats import truncnorm

        a, b = (self.low - self.mean) / self.std, (self.high - self.mean) / self.std
        return [
            float(value)
            for value in truncnorm.ppf(unit, a, b, loc=self.mean, scale=self.std)
        ]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        n = self.require_levels()
        return self.values_at((np.arange(n) + 0.5) / n)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Integers(Range):
    """Whole numbers of equal probability; levels are those nearest to equal steps."""

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        width = self.high - self.low + 1
        return [min(int(self.low + np.floor(u * width)), int(self.high)) for u in unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        return [
            round(float(value))
            for value in np.linspace(self.low, self.high, self.require_levels())
        ]


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
    def n_levels(self) -> int | None:
        """Number of listed values."""
        return None if self.names_levels else len(self.values)

    def values_at(self, unit: Array) -> list[Any]:
        """See ``Distribution``."""
        n = len(self.values)
        return [self.values[min(int(u * n), n - 1)] for u in unit]

    def level_values(self) -> list[Any]:
        """See ``Distribution``."""
        self.require_levels()
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
    _check_distribution(key, spec)
    kind = spec["distribution"]
    numbers = {
        name: tuple(spec[name]) if kind == CHOICE else spec[name] for name in KEYS[kind]
    }
    return DISTRIBUTIONS[kind](
        key=key, levels=spec.get(LEVELS), names_levels=LEVELS in spec, **numbers
    )


def _check_distribution(key: str, spec: Any) -> None:
    """Raise ConfigError unless ``spec`` is a complete distribution for ``key``."""
    if not isinstance(spec, Mapping) or spec.get("distribution") not in KEYS:
        raise ConfigError(
            f"{key}: give a distribution, one of {', '.join(KEYS)}, for instance "
            f"{{distribution: uniform, low: 1, high: 2}}"
        )
    needed = KEYS[spec["distribution"]]
    extra = sorted(set(spec) - {"distribution", LEVELS, *needed})
    missing = [name for name in needed if name not in spec]
    if extra or missing:
        raise ConfigError(
            f"{key}: {spec['distribution']} needs exactly {', '.join(needed)} (and levels, for a "
            "grid)"
        )
    if spec["distribution"] == CHOICE:
        if not isinstance(spec["values"], list) or not spec["values"]:
            raise ConfigError(f"{key}: values must be a list with at least one entry")
        if not all(_is_number(value) for value in spec["values"]):
            raise ConfigError(f"{key}: values must be finite numbers")
    else:
        _check_range(key, spec, needed)
    _check_levels(key, spec)


def _check_range(key: str, spec: Mapping[str, Any], needed: tuple[str, ...]) -> None:
    for name in needed:
        if not _is_number(spec[name]):
            raise ConfigError(f"{key}: {name} = {spec[name]!r} is not a finite number")
    kind, low, high = spec["distribution"], spec["low"], spec["high"]
    if not low < high or (kind == "log_uniform" and low <= 0.0):
        also = " and above 0" if kind == "log_uniform" else ""
        raise ConfigError(
            f"{key}: low = {low:g} and high = {high:g} are no range for {kind}; low must be "
            f"below{also}"
        )
    if kind == "integers" and not all(
        float(spec[name]).is_integer() for name in needed
    ):
        raise ConfigError(
            f"{key}: low = {low:g} and high = {high:g} must be whole numbers"
        )
    if kind == "normal" and spec["std"] <= 0.0:
        raise ConfigError(f"{key}: std = {spec['std']:g} must be positive")


def _check_levels(key: str, spec: Mapping[str, Any]) -> None:
    levels, kind = spec.get(LEVELS), spec["distribution"]
    if levels is None:
        return
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
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and math.isfinite(value)
    )


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
        points = qmc.Sobol(n_dimensions, rng=rng).random_base2(
            max(1, math.ceil(math.log2(n_points)))
        )[:n_points]
        return rng.permutation(points)
    return qmc.LatinHypercube(n_dimensions, rng=rng).random(n_points)
