"""Slow changes of a machine: its lubrication, its temperature or its seats."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.units import check_limits, check_positive, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """Drift of one number of the configuration: 1 + change (1 - exp(-t / time)).

    t is the running time. ``change`` is the last relative change, log-normal among units with
    ``scatter``. Assumed: the form, one time constant, and that the drift does not feed back on
    the growth of damage.
    """

    change: float
    time: float = unit("h")
    scatter: float

    def __post_init__(self) -> None:
        if not -1.0 < self.change <= 100.0:
            raise ConfigError(
                f"life.drift: change = {self.change:g} must lie in -1..100, -1 excluded"
            )
        check_positive(self, "life.drift: ", "time")
        check_limits(self, "life.drift: ", scatter=(0.0, 2.0))

    def factor(self, running: float, unit_factor: float) -> float:
        """Factor on the number after so many s of running.

        ``unit_factor`` is that of the unit on the change.
        """
        settled = 1.0 - math.exp(-running / self.time)
        return max(1.0 + self.change * unit_factor * settled, 0.01)
