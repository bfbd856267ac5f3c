"""How much lives of the same kind differ."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.errors import ConfigError

WIDEST = 3.0  # standard deviations: nothing is drawn beyond


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Standard deviations of the logarithm of a unit's rate of growth and of its first size,
    about their medians.
    """

    rate_scatter: float
    start_scatter: float

    def __post_init__(self) -> None:
        for key in ("rate_scatter", "start_scatter"):
            if not 0.0 <= getattr(self, key) <= 2.0:
                raise ConfigError(
                    f"life: {key} = {getattr(self, key):g} must lie in 0..2"
                )

    @property
    def largest_start(self) -> float:
        """Greatest factor on the first size."""
        return math.exp(WIDEST * self.start_scatter)

    def draw(self, rng: np.random.Generator) -> tuple[float, float]:
        """Factors on the rate and the first size of one unit.

        Two draws, whatever the scatters are.
        """
        rate, start = np.clip(rng.standard_normal(2), -WIDEST, WIDEST).tolist()
        return math.exp(rate * self.rate_scatter), math.exp(start * self.start_scatter)
