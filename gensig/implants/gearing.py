"""Gears of a machine by the teeth of its stages, and how its shafts turn."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.signals.mesh_motion import Teeth

FEWEST_TEETH, MOST_TEETH, MOST_STAGES = 4, 1000, 4
DRIVING, DRIVEN = "pinion", "wheel"


@dataclass(frozen=True, slots=True, kw_only=True)
class Gearing:
    """Gears of the stages of a machine in turn, each a driving and a driven one.

    Gear 0 is on the driving shaft. Gears 2 k - 1 and 2 k share a shaft.

    Attributes
    ----------
    teeth : (gear,) teeth, two a stage

    Raises
    ------
    ConfigError    with one line, for teeth that are no stages
    """

    teeth: tuple[int, ...]

    def __post_init__(self) -> None:
        words = " ".join(map(str, self.teeth))
        n_gears = len(self.teeth)
        if n_gears < 2 or n_gears % 2 or n_gears > 2 * MOST_STAGES:
            raise ConfigError(
                f"--teeth {words}: give driving and driven gear of each stage in turn, "
                f"for 1 to {MOST_STAGES} stages"
            )
        if min(self.teeth) < FEWEST_TEETH or max(self.teeth) > MOST_TEETH:
            raise ConfigError(
                f"--teeth {words}: a gear has {FEWEST_TEETH} to {MOST_TEETH} teeth"
            )

    @property
    def n_stages(self) -> int:
        """Number of meshes."""
        return len(self.teeth) // 2

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the gears: pinion and wheel, of several stages with the stage before them."""
        if self.n_stages == 1:
            return (DRIVING, DRIVEN)
        stages = range(1, self.n_stages + 1)
        return tuple(
            f"stage_{stage}_{role}" for stage in stages for role in (DRIVING, DRIVEN)
        )

    def stage(self, index: int) -> Teeth:
        """Teeth of the stage of that number, from 0."""
        return Teeth(driving=self.teeth[2 * index], driven=self.teeth[2 * index + 1])

    def turns(self, gear: int) -> float:
        """Turns of a gear during one turn of the driving shaft."""
        shaft = (gear + 1) // 2
        ratios = (
            self.teeth[2 * stage] / self.teeth[2 * stage + 1] for stage in range(shaft)
        )
        return math.prod(ratios)

    def mesh_order(self, gear: int) -> float:
        """Teeth of a gear that mesh during one turn of the driving shaft."""
        return self.turns(gear) * self.teeth[gear]

    @property
    def slowest(self) -> float:
        """Turns of the slowest shaft during one turn of the driving shaft."""
        return min(self.turns(gear) for gear in range(len(self.teeth)))

    def of_role(self, role: str) -> tuple[int, ...]:
        """Numbers of the gears that drive or are driven in their mesh; all for another word."""
        if role == DRIVING:
            return tuple(range(0, len(self.teeth), 2))
        if role == DRIVEN:
            return tuple(range(1, len(self.teeth), 2))
        return tuple(range(len(self.teeth)))
