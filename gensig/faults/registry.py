"""All faults by their name in configurations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.errors import FaultError
from gensig.faults.base import Fault
from gensig.faults.broken import BrokenTooth, ChippedTooth, MissingTooth
from gensig.faults.crack import Crack
from gensig.faults.flank_form import (
    Misalignment,
    PitchError,
    ProfileError,
    Runout,
    TipRelief,
    Wear,
)
from gensig.faults.pitting import DistributedPitting, Pitting, Spalling
from gensig.units import read

FAULTS: dict[str, type[Fault]] = {
    fault.kind: fault
    for fault in (
        Crack,
        Pitting,
        Spalling,
        DistributedPitting,
        ChippedTooth,
        BrokenTooth,
        MissingTooth,
        Wear,
        PitchError,
        ProfileError,
        Runout,
        Misalignment,
        TipRelief,
    )
}
COMPOUND = "compound"


def fault_parts(
    values: Mapping[str, Any], where: str = "fault"
) -> list[Mapping[str, Any]]:
    """The single faults of a configured fault: none for healthy, the parts of a compound."""
    kind = values.get("kind")
    if kind == "healthy":
        return []
    if kind != COMPOUND:
        return [values]
    parts: Any = values.get("parts")
    is_list = isinstance(parts, list | tuple)
    if not (is_list and parts and all(isinstance(part, Mapping) for part in parts)):
        raise FaultError(
            f"{where}.parts = {parts!r} must be a list of faults, each with its kind"
        )
    unknown = sorted(set(values) - {"kind", "parts", "vary"})
    if unknown:
        raise FaultError(
            f"{where}: unknown key '{unknown[0]}'; a compound fault has parts, each with its own "
            "keys"
        )
    return list(parts)


def read_faults(values: Mapping[str, Any], where: str = "fault") -> tuple[Fault, ...]:
    """Faults from boundary keys with their ``kind``; ``vary``, which only plans use, is ignored."""
    faults = []
    for index, part in enumerate(fault_parts(values, where)):
        is_part = values.get("kind") == COMPOUND
        key = f"{where}.parts.{index}" if is_part else where
        faults.append(_read_fault(part, key))
    return tuple(faults)


def without_vary(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fault values with an empty ``vary``."""
    fixed = {**values, "vary": {}}
    if values.get("kind") == COMPOUND:
        fixed["parts"] = [{**part, "vary": {}} for part in fault_parts(values)]
    return fixed


def _read_fault(values: Mapping[str, Any], where: str) -> Fault:
    keys = dict(values)
    keys.pop("vary", None)
    kind = keys.pop("kind", None)
    if kind not in FAULTS:
        allowed = list(FAULTS)
        if ".parts." not in where:
            allowed = ["healthy", COMPOUND, *allowed]
        raise FaultError(f"{where}.kind = {kind!r}; allowed: {', '.join(allowed)}")
    return read(FAULTS[kind], keys, where)
