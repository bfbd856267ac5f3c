"""The faults there are, by the name that configurations use."""

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
    kind.kind: kind
    for kind in (
        Crack, Pitting, Spalling, DistributedPitting, ChippedTooth, BrokenTooth, MissingTooth,
        Wear, PitchError, ProfileError, Runout, Misalignment, TipRelief,
    )
}  # fmt: skip
COMPOUND = "compound"


def fault_parts(
    values: Mapping[str, Any], where: str = "fault"
) -> list[Mapping[str, Any]]:
    """The single faults that a configuration's fault is made of.

    None for healthy, the parts of a compound one.
    """
    kind = values.get("kind")
    if kind == "healthy":
        return []
    if kind != COMPOUND:
        return [values]
    parts = values.get("parts")
    if (
        not isinstance(parts, list | tuple)
        or not parts
        or not all(isinstance(part, Mapping) for part in parts)
    ):
        raise FaultError(
            f"{where}.parts = {parts!r} must be a list of faults, each with its kind"
        )
    unknown = sorted(set(values) - {"kind", "parts", "vary"})
    if unknown:
        raise FaultError(
            f"{where}: unknown key '{unknown[0]}'; a compound fault has parts, each with its own keys"
        )
    return list(parts)


def read_faults(values: Mapping[str, Any], where: str = "fault") -> tuple[Fault, ...]:
    """Faults from boundary keys with their ``kind``.

    ``vary``, which only plans use, is passed over.
    """
    parts = fault_parts(values, where)
    if values.get("kind") != COMPOUND:
        return tuple(_read_fault(part, where) for part in parts)
    return tuple(
        _read_fault(part, f"{where}.parts.{place}") for place, part in enumerate(parts)
    )


def without_vary(values: Mapping[str, Any]) -> dict[str, Any]:
    """The same fault with nothing left to draw."""
    fixed = {**values, "vary": {}}
    if values.get("kind") == COMPOUND:
        fixed["parts"] = [{**part, "vary": {}} for part in fault_parts(values)]
    return fixed


def _read_fault(values: Mapping[str, Any], where: str) -> Fault:
    keys = {key: value for key, value in values.items() if key not in ("kind", "vary")}
    kind = values.get("kind")
    if kind not in FAULTS:
        alone = "" if ".parts." in where else f"healthy, {COMPOUND}, "
        raise FaultError(
            f"{where}.kind = {kind!r}; allowed: {alone}{', '.join(FAULTS)}"
        )
    return read(FAULTS[kind], keys, where)
