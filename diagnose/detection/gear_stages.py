"""Gear stages in a row: shafts with their ratios, meshes with their orders, gears with names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gensig.errors import ConfigError

FEWEST_TEETH, MOST_TEETH = 4, 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Gear:
    """A gear of a stage.

    Attributes
    ----------
    name : in words, as "driven gear of stage 1"
    n_teeth : of it
    shaft : number of its shaft, 0 is the input
    stage : number of its stage, from 0
    """

    name: str
    n_teeth: int
    shaft: int
    stage: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GearStages:
    """Gear pairs in a row, from the input on; each driven gear shares a shaft with the next
    driving one.

    Attributes
    ----------
    pairs : teeth of the driving and the driven gear of every stage
    """

    pairs: tuple[tuple[int, int], ...]

    def __post_init__(self) -> None:
        if not self.pairs:
            raise ConfigError("--teeth needs DRIVING DRIVEN of one stage at least")
        for teeth in self.pairs:
            if min(teeth) < FEWEST_TEETH or max(teeth) > MOST_TEETH:
                raise ConfigError(
                    f"--teeth {teeth[0]} {teeth[1]}: a gear has {FEWEST_TEETH} to {MOST_TEETH} "
                    "teeth"
                )

    @property
    def n_stages(self) -> int:
        """Number of stages."""
        return len(self.pairs)

    @property
    def shaft_orders(self) -> tuple[float, ...]:
        """Turns of every shaft in one turn of the input."""
        orders = [1.0]
        for driving, driven in self.pairs:
            orders.append(orders[-1] * driving / driven)
        return tuple(orders)

    @property
    def mesh_orders(self) -> tuple[float, ...]:
        """Mesh cycles of every stage in one turn of the input."""
        shafts = zip(self.shaft_orders, self.pairs, strict=False)
        return tuple(order * driving for order, (driving, _) in shafts)

    @property
    def slowest(self) -> float:
        """Turns of the slowest shaft in one turn of the input."""
        return min(self.shaft_orders)

    @property
    def shafts(self) -> tuple[str, ...]:
        """Names of the shafts, input first."""
        between = [f"intermediate shaft {number}" for number in range(1, self.n_stages)]
        if len(between) == 1:
            between = ["intermediate shaft"]
        return ("input shaft", *between, "output shaft")

    def gears(self, shaft: int) -> tuple[Gear, ...]:
        """Gears on a shaft: one at the ends, two between."""
        found = []
        for stage, (driving, driven) in enumerate(self.pairs):
            sides = ((stage, "driving", driving), (stage + 1, "driven", driven))
            for on_shaft, role, n_teeth in sides:
                if on_shaft == shaft:
                    name = self._gear_name(role, stage)
                    found.append(
                        Gear(name=name, n_teeth=n_teeth, shaft=shaft, stage=stage)
                    )
        return tuple(found)

    @property
    def said(self) -> str:
        """The teeth as they are typed."""
        return " ".join(f"{driving} {driven}" for driving, driven in self.pairs)

    def _gear_name(self, role: str, stage: int) -> str:
        if self.n_stages == 1:
            return f"{role} gear"
        return f"{role} gear of stage {stage + 1}"


def stages_of(teeth: Sequence[int]) -> GearStages:
    """Stages of teeth as they are typed, driving and driven gear of one stage after the other.

    Raises
    ------
    ConfigError    for an odd number of teeth, or gears that cannot be
    """
    if len(teeth) < 2 or len(teeth) % 2:
        said = " ".join(map(str, teeth))
        raise ConfigError(
            f"--teeth {said}: {len(teeth)} number(s); give DRIVING DRIVEN of every stage, from "
            "the input on"
        )
    return GearStages(pairs=tuple(zip(teeth[::2], teeth[1::2], strict=True)))
