"""The faults there are, by the name that configurations use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.errors import FaultError
from gensig.faults.base import Fault
from gensig.faults.crack import Crack
from gensig.faults.missing_tooth import MissingTooth
from gensig.faults.pitting import Pitting
from gensig.units import read

FAULTS: dict[str, type[Fault]] = {kind.kind: kind for kind in (Crack, Pitting, MissingTooth)}


def read_fault(values: Mapping[str, Any], where: str = "fault") -> Fault | None:
    """Fault from boundary keys with its ``kind``; None for ``kind: healthy``."""
    keys = dict(values)
    kind = keys.pop("kind", None)
    if kind == "healthy":
        return None
    if kind not in FAULTS:
        raise FaultError(f"{where}.kind = {kind!r}; allowed: healthy, {', '.join(FAULTS)}")
    return read(FAULTS[kind], keys, where)
