"""Distributions that plans draw from: a point of the unit interval in, a value out, whatever the design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError

Array = NDArray[np.float64]

DESIGNS = ("latin_hypercube", "sobol")
KEYS: dict[str, tuple[str, ...]] = {
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "normal": ("mean", "std", "low", "high"),
    "integers": ("low", "high"),
    "choice": ("values",),
}


def check_distribution(key: str, spec: Any) -> None:
    """Raise ConfigError unless ``spec`` is a complete distribution for ``key``."""
    if not isinstance(spec, Mapping) or spec.get("distribution") not in KEYS:
        raise ConfigError(
            f"{key}: give a distribution, one of {', '.join(KEYS)}, for instance "
            f"{{distribution: uniform, low: 1, high: 2}}"
        )
    needed = KEYS[spec["distribution"]]
    extra = sorted(set(spec) - {"distribution", *needed})
    missing = [name for name in needed if name not in spec]
    if extra or missing:
        raise ConfigError(f"{key}: {spec['distribution']} needs exactly {', '.join(needed)}")
    if spec["distribution"] == "choice":
        if not isinstance(spec["values"], list) or not spec["values"]:
            raise ConfigError(f"{key}: values must be a list with at least one entry")
        if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in spec["values"]):
            raise ConfigError(f"{key}: values must be numbers")
        return
    for name in needed:
        if isinstance(spec[name], bool) or not isinstance(spec[name], int | float) or not math.isfinite(spec[name]):
            raise ConfigError(f"{key}: {name} = {spec[name]!r} is not a finite number")
    if spec["low"] > spec["high"] or (spec["distribution"] == "log_uniform" and spec["low"] <= 0.0):
        raise ConfigError(
            f"{key}: low = {spec['low']:g} and high = {spec['high']:g} are no range for {spec['distribution']}"
        )
    if spec["distribution"] == "integers" and not all(float(spec[name]).is_integer() for name in needed):
        raise ConfigError(f"{key}: low = {spec['low']:g} and high = {spec['high']:g} must be whole numbers")
    if spec["distribution"] == "normal" and spec["std"] <= 0.0:
        raise ConfigError(f"{key}: std = {spec['std']:g} must be positive")


def values_at(key: str, spec: Mapping[str, Any], unit: Array) -> list[Any]:
    """Values at points of the unit interval, (point,); plain Python numbers and texts."""
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


def design_points(design: str, n_points: int, n_dimensions: int, rng: np.random.Generator) -> Array:
    """Space-filling points of the unit cube, (point, dimension)."""
    if design not in DESIGNS:
        raise ConfigError(f"plan.design = {design!r}; allowed: {', '.join(DESIGNS)}")
    if n_dimensions == 0:
        return np.empty((n_points, 0))
    from scipy.stats import qmc

    if design == "latin_hypercube":
        return qmc.LatinHypercube(n_dimensions, rng=rng).random(n_points)
    return qmc.Sobol(n_dimensions, rng=rng).random_base2(max(1, math.ceil(math.log2(n_points))))[:n_points]
