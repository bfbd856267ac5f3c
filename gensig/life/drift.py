"""A slow change of the machine that stands for its lubrication, its temperature or its seats."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.units import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """One number of the configuration that moves with the running time t as 1 + change (1 -
    exp(-t / time)).

    ``change`` is its last relative change, log-normal among units with ``scatter``. Assumed: the
    form, one time constant, and that the drift does not feed back on how damage grows.
    """

    change: float
    time: float = unit("h")
    scatter: float

    def __post_init__(self) -> None:
        if not -1.0 < self.change <= 100.0:
            raise ConfigError(
                f"life.drift: change = {self.change:g} must lie in -1..100, -1 excluded"
            )
        if not self.time > 0.0:
            raise ConfigError(
                f"life.drift: time_h = {self.time / 3600.0:g} must be positive"
            )
        if not 0.0 <= self.scatter <= 2.0:
            raise ConfigError(
                f"life.drift: scatter = {self.scatter:g} must lie in 0..2"
            )

    def factor(self, running: float, unit_factor: float) -> float:
        """On the number, after so many s of running.

        ``unit_factor`` is the unit's own on the change.
        """
        return max(
            1.0 + self.change * unit_factor * (1.0 - math.exp(-running / self.time)),
            0.01,
        )
