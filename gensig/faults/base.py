"""Interface of a fault: parameters, severity, growth, and a pure function from tooth to tooth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar

from gensig.errors import FaultError
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.units import from_si, split_unit

ALL = "all"


class Growth(Enum):
    """Laws by which faults grow over a life; ``gensig.plan.growth_table`` builds them."""

    NONE = "none"  # the fault stays as it is
    PARIS = "paris"  # a root crack deepens with the range of its stress intensity
    PITS = (
        "pits"  # contact stress damages a flank until pits come, more and larger ones
    )
    ARCHARD = "archard"  # sliding under pressure takes material off a flank


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault(ABC):
    """A fault of one gear's teeth.

    ``gear`` is ``"pinion"`` or ``"wheel"``; ``tooth`` counts from 0: one number, several, or
    ``"all"``.
    """

    # name in configurations
    kind: ClassVar[str]
    # law by which the fault grows over a life
    growth: ClassVar[Growth]
    # the fault does the same to every tooth that it is on
    alike: ClassVar[bool] = True
    # the fault comes from how two gears are mounted: other meshes of its gear are free of it
    of_mounting: ClassVar[bool] = False
    gear: str = field()
    tooth: int | str | tuple[int, ...] = field()

    def __post_init__(self) -> None:
        if self.gear not in SIDES:
            raise FaultError(f"fault.gear = {self.gear!r}; allowed: {', '.join(SIDES)}")
        if isinstance(self.tooth, str) and self.tooth != ALL:
            raise FaultError(
                f"fault.tooth = {self.tooth!r}; give a number, a list of numbers, or {ALL}"
            )
        if isinstance(self.tooth, tuple) and not 0 < len(set(self.tooth)) == len(
            self.tooth
        ):
            raise FaultError(
                f"fault.tooth = {list(self.tooth)} must name one tooth or more, each once"
            )
        if self.first_tooth < 0 and self.tooth != ALL:
            raise FaultError(
                f"fault.tooth = {self.first_tooth} must be at least 0 (teeth are counted from 0)"
            )

    @property
    def first_tooth(self) -> int:
        """The lowest tooth that carries the fault, -1 for all of them."""
        if isinstance(self.tooth, str):
            return -1
        return self.tooth if isinstance(self.tooth, int) else min(self.tooth)

    def teeth(self, gear: Gear) -> tuple[int, ...]:
        """The teeth of ``gear`` that carry the fault; FaultError for one that is not on it."""
        if isinstance(self.tooth, str):
            return tuple(range(gear.n_teeth))
        teeth = (self.tooth,) if isinstance(self.tooth, int) else self.tooth
        if max(teeth) >= gear.n_teeth:
            raise FaultError(
                f"fault.tooth = {max(teeth)} is not on the {self.gear}, whose teeth are 0..{gear.n_teeth - 1}"
            )
        return teeth

    @abstractmethod
    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Tooth ``number`` with the fault; raises FaultError where it does not fit."""

    @abstractmethod
    def severity(self, gear: Gear) -> float:
        """Severity from 0 (healthy) to 1."""

    @abstractmethod
    def on_other_flank(self) -> Fault | None:
        """The fault for loads on the teeth's other flank, None where those loads do not feel it.

        An idler is driven on one flank and drives with the other.
        """


def require(fault: Fault, key: str, holds: bool, rule: str) -> None:
    """Raise a FaultError with the value of ``key`` and the rule that it breaks, unless it holds."""
    if not holds:
        raise FaultError(f"fault.{key} = {_shown(fault, key)} {rule}")


def require_not_negative(fault: Fault, *keys: str) -> None:
    """Check lengths and depths."""
    for key in keys:
        require(
            fault,
            key,
            getattr(fault, split_unit(key)[0]) >= 0.0,
            "must not be negative",
        )


def _shown(fault: Fault, key: str) -> str:
    value = getattr(fault, split_unit(key)[0])
    return f"{from_si(key, value):g}" if isinstance(value, float) else repr(value)


def faulty_teeth(
    pair: GearPair,
    faults: Iterable[Fault],
    sound_teeth: Mapping[str, Tooth] | None = None,
) -> dict[tuple[str, int], Tooth]:
    """The teeth that differ from the sound one, by (gear, tooth); several faults of a tooth
    compose in order.

    Teeth to which the same has happened are one object: the mesh computes them once.
    ``sound_teeth`` are those that faults happen to, by gear; None: as cut.

    Raises
    ------
    FaultError    for a tooth number that is not on the gear, or a fault that does not fit its tooth
    """
    gears = pair.gears
    teeth: dict[tuple[str, int], Tooth] = {}
    for fault in faults:
        gear = gears[fault.gear]
        sound = healthy_tooth(gear) if sound_teeth is None else sound_teeth[fault.gear]
        made: dict[int, Tooth] = {}
        for number in fault.teeth(gear):
            before = teeth.get((fault.gear, number), sound)
            known = made.get(id(before)) if fault.alike else None
            after = fault.apply(before, number) if known is None else known
            made[id(before)] = teeth[fault.gear, number] = after
    return teeth
