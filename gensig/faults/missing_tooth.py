"""A tooth broken off at the root."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from gensig.faults.base import Fault
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingTooth(Fault):
    """The whole tooth is gone: its pair never touches."""

    kind: ClassVar[str] = "missing_tooth"

    def severity(self, gear: Gear) -> float:
        """Always 1."""
        return 1.0

    def apply(self, tooth: Tooth) -> Tooth:
        """Mark the tooth as absent."""
        return replace(tooth, present=False)
