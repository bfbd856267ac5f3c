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
from gensig.faults.surface_damage import SurfaceDamage
from gensig.units import read

FAULTS: dict[str, type[Fault]] = {
    fault.kind: fault
    for fault in (
        Crack,
        Pitting,
        Spalling,
        DistributedPitting,
        SurfaceDamage,
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
# Keys that came after 0.9.0, by kind; 0, their default, is the fault as it was before. There they
# are no part of a configuration, so that plans and data sets are as they were.
LATER_KEYS = {
    "pitting": ("pit_edge_height_um", "pit_edge_width_mm"),
    "spalling": ("spall_edge_height_um", "spall_edge_width_mm"),
    "distributed_pitting": ("pit_edge_height_um", "pit_edge_width_mm"),
    "chipped": ("chip_edge_height_um", "chip_edge_width_mm"),
    "broken": ("broken_edge_height_um", "broken_edge_width_mm"),
}


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


def without_later_keys(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fault values, with parts, without keys of ``LATER_KEYS`` that are 0 and not drawn."""
    later = LATER_KEYS.get(str(values.get("kind")), ())
    drawn = values.get("vary") or {}
    kept = {
        key: value
        for key, value in values.items()
        if key not in later or value != 0 or key in drawn
    }
    if values.get("kind") == COMPOUND:
        kept["parts"] = [without_later_keys(part) for part in fault_parts(values)]
    return kept


def with_later_keys(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fault values with every key of ``LATER_KEYS``, 0 where they have none."""
    later = LATER_KEYS.get(str(values.get("kind")), ())
    return {**dict.fromkeys(later, 0), **values}


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
