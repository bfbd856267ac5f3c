"""What every fault is: parameters, and a pure function from tooth to tooth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar

from gensig.errors import FaultError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault(ABC):
    """A fault of one tooth; ``gear`` is ``"pinion"`` or ``"wheel"``, ``tooth`` counts from 0."""

    kind: ClassVar[str]
    gear: str = field()
    tooth: int = field()

    def __post_init__(self) -> None:
        if self.gear not in ("pinion", "wheel"):
            raise FaultError(f"fault.gear = {self.gear!r}; allowed: pinion, wheel")
        if self.tooth < 0:
            raise FaultError(f"fault.tooth = {self.tooth} must be at least 0 (teeth are counted from 0)")

    @abstractmethod
    def apply(self, tooth: Tooth) -> Tooth:
        """The faulty tooth; raises FaultError where the fault does not fit it."""

    @abstractmethod
    def severity(self, gear: Gear) -> float:
        """Severity from 0 (healthy) to 1."""


def faulty_teeth(pair: GearPair, faults: Iterable[Fault]) -> dict[tuple[str, int], Tooth]:
    """The teeth that differ from the sound one, by (gear, tooth); several faults of a tooth compose in order.

    Raises
    ------
    FaultError    for a tooth number that is not on the gear, or a fault that does not fit its tooth
    """
    gears = {"pinion": pair.pinion, "wheel": pair.wheel}
    teeth: dict[tuple[str, int], Tooth] = {}
    for fault in faults:
        gear = gears[fault.gear]
        if fault.tooth >= gear.n_teeth:
            raise FaultError(
                f"fault.tooth = {fault.tooth} is not on the {fault.gear}, whose teeth are 0..{gear.n_teeth - 1}"
            )
        place = (fault.gear, fault.tooth)
        teeth[place] = fault.apply(teeth[place] if place in teeth else healthy_tooth(gear))
    return teeth
