"""Distributions and designs that plans draw from: a point of the unit interval in, a value out, whatever the design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError

Array = NDArray[np.float64]

GRID = "grid"
DESIGNS = ("latin_hypercube", "sobol", GRID)
KEYS: dict[str, tuple[str, ...]] = {
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "normal": ("mean", "std", "low", "high"),
    "integers": ("low", "high"),
    "choice": ("values",),
}
LEVELS = "levels"  # any distribution may have it; only a grid reads it


def check_distribution(key: str, spec: Any) -> None:
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
        raise ConfigError(f"{key}: {spec['distribution']} needs exactly {', '.join(needed)} (and levels, for a grid)")
    if spec["distribution"] == "choice":
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
        raise ConfigError(f"{key}: low = {low:g} and high = {high:g} are no range for {kind}; low must be below{also}")
    if kind == "integers" and not all(float(spec[name]).is_integer() for name in needed):
        raise ConfigError(f"{key}: low = {low:g} and high = {high:g} must be whole numbers")
    if kind == "normal" and spec["std"] <= 0.0:
        raise ConfigError(f"{key}: std = {spec['std']:g} must be positive")


def _check_levels(key: str, spec: Mapping[str, Any]) -> None:
    levels, kind = spec.get(LEVELS), spec["distribution"]
    if levels is None:
        return
    if kind == "choice":
        raise ConfigError(f"{key}: the levels of a choice are its values; leave levels out, or null to draw them")
    if isinstance(levels, bool) or not isinstance(levels, int) or levels < 2:
        raise ConfigError(
            f"{key}: levels = {levels!r} must be a whole number of at least 2, or null to draw the values"
        )
    if kind == "integers" and levels > spec["high"] - spec["low"] + 1:
        raise ConfigError(f"{key}: levels = {levels}, but there are {spec['high'] - spec['low'] + 1:g} whole numbers")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def values_at(key: str, spec: Mapping[str, Any], unit: Array) -> list[Any]:
    """Values at points of the unit interval, (point,); plain Python numbers."""
    check_distribution(key, spec)
    kind = spec["distribution"]
    if kind == "choice":
        options = spec["values"]
        return [options[min(int(u * len(options)), len(options) - 1)] for u in unit]
    low, high = spec["low"], spec["high"]
    if kind == "uniform":
        return [float(value) for value in low + (high - low) * unit]
    if kind == "log_uniform":
        return [float(value) for value in low * (high / low) ** unit]
    if kind == "integers":
        return [min(int(low + np.floor(u * (high - low + 1))), int(high)) for u in unit]
    from scipy.stats import truncnorm

    a, b = (low - spec["mean"]) / spec["std"], (high - spec["mean"]) / spec["std"]
    return [float(value) for value in truncnorm.ppf(unit, a, b, loc=spec["mean"], scale=spec["std"])]


def n_levels(key: str, spec: Mapping[str, Any]) -> int | None:
    """Number of values that a key has in a grid; None for one that is drawn because it has none or null."""
    check_distribution(key, spec)
    if spec["distribution"] == "choice":
        return None if LEVELS in spec else len(spec["values"])
    levels: int | None = spec.get(LEVELS)
    return levels


def level_values(key: str, spec: Mapping[str, Any]) -> list[Any]:
    """Values of a key that has levels, in order.

    A choice has its values. Uniform and log-uniform ones have equal steps (ratios) from ``low`` to ``high``, both
    included, whole numbers the nearest ones. A normal one has the medians of as many parts of equal probability.
    """
    n, kind = n_levels(key, spec), spec["distribution"]
    if n is None:
        raise ConfigError(f"{key}: a grid needs its levels, for instance levels: 4, or distribution: choice")
    if kind == "choice":
        return list(spec["values"])
    if kind == "normal":
        return values_at(key, spec, (np.arange(n) + 0.5) / n)
    steps = np.geomspace if kind == "log_uniform" else np.linspace
    values = steps(spec["low"], spec["high"], n)
    return [round(float(value)) if kind == "integers" else float(value) for value in values]


def design_points(design: str, n_points: int, n_dimensions: int, rng: np.random.Generator) -> Array:
    """Space-filling points of the unit cube, (point, dimension), in random order.

    The order of a Sobol sequence is structure: point by point two of them are alike in their first digits, and so is
    each with the number of the point. What belongs to a grid but has no levels is drawn as a Latin hypercube.
    """
    if design not in DESIGNS:
        raise ConfigError(f"plan.design = {design!r}; allowed: {', '.join(DESIGNS)}")
    if n_dimensions == 0:
        return np.empty((n_points, 0))
    from scipy.stats import qmc

    if design == "sobol":
        points = qmc.Sobol(n_dimensions, rng=rng).random_base2(max(1, math.ceil(math.log2(n_points))))[:n_points]
        return rng.permutation(points)
    return qmc.LatinHypercube(n_dimensions, rng=rng).random(n_points)
