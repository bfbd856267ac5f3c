"""Interface of a fault: parameters, severity, growth, and a pure function from tooth to tooth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar

import numpy as np

from gensig.errors import FaultError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.units import from_si, split_unit

ALL = "all"


class Growth(Enum):
    """Laws by which faults grow over a life; ``gensig.plan.growth_table`` builds them."""

    NONE = "none"  # the fault does not grow
    PARIS = "paris"  # a root crack deepens with the range of its stress intensity
    PITS = "pits"  # contact stress makes pits, more and larger ones with time
    ARCHARD = "archard"  # sliding under pressure wears a flank


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault(ABC):
    """A fault of one gear's teeth.

    ``gear`` is one of ``Machine.gears``: ``"pinion"`` or ``"wheel"`` of a gear pair, any gear of
    a drive line. Machines check it, see ``require_gears``. ``tooth`` counts from 0: one number,
    several, or ``"all"``.
    """

    # name in configurations
    kind: ClassVar[str]
    # law by which the fault grows over a life
    growth: ClassVar[Growth]
    # groups of keys in files; a fault with 0 in all keys of a group leaves every tooth healthy
    sizes: ClassVar[tuple[tuple[str, ...], ...]] = ()
    # True if the fault does the same to each of its teeth
    alike: ClassVar[bool] = True
    # True for a fault of the mounting of two gears: other meshes of its gear are free of it
    of_mounting: ClassVar[bool] = False
    gear: str = field()
    tooth: int | str | tuple[int, ...] = field()

    def __post_init__(self) -> None:
        if not isinstance(self.gear, str) or not self.gear:
            raise FaultError(f"fault.gear = {self.gear!r} must be the name of a gear")
        if isinstance(self.tooth, str) and self.tooth != ALL:
            raise FaultError(
                f"fault.tooth = {self.tooth!r}; give a number, a list of numbers, or {ALL}"
            )
        teeth: tuple[int, ...] = (0,)
        if isinstance(self.tooth, tuple):
            teeth = self.tooth
        if not 0 < len(set(teeth)) == len(teeth):
            raise FaultError(
                f"fault.tooth = {list(teeth)} must name one tooth or more, each once"
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
        return int(np.min(self.tooth))

    def teeth(self, gear: Gear) -> tuple[int, ...]:
        """The teeth of ``gear`` that carry the fault; FaultError for a number beyond them."""
        teeth = self.tooth
        if isinstance(teeth, str):
            return tuple(range(gear.n_teeth))
        if isinstance(teeth, int):
            teeth = (teeth,)
        if max(teeth) >= gear.n_teeth:
            raise FaultError(
                f"fault.tooth = {max(teeth)} is not on the {self.gear}, whose teeth are "
                f"0..{gear.n_teeth - 1}"
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
        """The fault for loads on the teeth's other flank; None for a fault of one flank.

        An idler is driven on one flank and drives with the other.
        """


def require(fault: Fault, key: str, holds: bool, rule: str) -> None:
    """Raise a FaultError that names ``key``, its value and the rule, unless the rule holds."""
    if holds:
        return
    value = getattr(fault, split_unit(key)[0])
    shown = f"{from_si(key, value):g}" if isinstance(value, float) else repr(value)
    raise FaultError(f"fault.{key} = {shown} {rule}")


def zero_size(fault: Fault) -> tuple[str, ...]:
    """The first group of ``Fault.sizes`` that is 0 in all its keys; empty for a real fault."""
    for group in fault.sizes:
        if all(getattr(fault, split_unit(key)[0]) == 0.0 for key in group):
            return group
    return ()


def require_size(faults: Iterable[Fault]) -> None:
    """Raise a FaultError for a fault that leaves every tooth healthy, as its label would be wrong.

    Raises
    ------
    FaultError    names the keys that are 0
    """
    for fault in faults:
        if keys := zero_size(fault):
            given = " and ".join(f"fault.{key} = 0" for key in keys)
            raise FaultError(
                f"{given}: a tooth of that size is healthy, and the record would be labelled "
                f"{fault.kind}; give a size other than 0, or fault=healthy"
            )


def require_not_negative(fault: Fault, *keys: str) -> None:
    """Raise a FaultError for a negative value."""
    for key in keys:
        value = getattr(fault, split_unit(key)[0])
        require(fault, key, value >= 0.0, "must not be negative")


def require_choice(fault: Fault, key: str, allowed: Collection[str]) -> None:
    """Raise a FaultError for a value that is not one of those allowed."""
    value = getattr(fault, key)
    if value not in allowed:
        raise FaultError(f"fault.{key} = {value!r}; allowed: {', '.join(allowed)}")


def require_gears(faults: Iterable[Fault], gears: Collection[str]) -> None:
    """Raise a FaultError for a fault on a gear that is not among ``gears``."""
    for fault in faults:
        require_choice(fault, "gear", gears)


def faulty_teeth(
    pair: GearPair,
    faults: Iterable[Fault],
    sound_teeth: Mapping[str, Tooth] | None = None,
) -> dict[tuple[str, int], Tooth]:
    """The teeth that differ from the healthy tooth, by (gear, tooth).

    Several faults of a tooth compose in order. Teeth with equal faults are one object, so that
    the mesh computes them once. ``sound_teeth`` are the teeth without faults, by gear; None: as
    cut.

    Raises
    ------
    FaultError    for a gear that is not of the pair, a tooth number that is not on the gear, or a
        fault that does not fit its tooth
    """
    gears, faults = pair.gears, tuple(faults)
    require_gears(faults, gears)
    teeth: dict[tuple[str, int], Tooth] = {}
    for fault in faults:
        gear = gears[fault.gear]
        sound = healthy_tooth(gear) if sound_teeth is None else sound_teeth[fault.gear]
        made: dict[int, Tooth] = {}
        for number in fault.teeth(gear):
            before = teeth.get((fault.gear, number), sound)
            if not fault.alike or id(before) not in made:
                made[id(before)] = fault.apply(before, number)
            teeth[fault.gear, number] = made[id(before)]
    return teeth
