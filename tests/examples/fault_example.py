"""Worked example of a new fault of teeth: a groove ground across the flank by a hard particle.

A fault of teeth is three files: this module in ``gensig/faults``, the class in the list of
``gensig/faults/registry.py``, and ``notch.yaml`` beside this file in ``configs/fault``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gensig.faults.base import Fault, Growth, require_not_negative
from gensig.faults.flank_loss import Patch, flank_area, pitch_abscissa, remove_patch
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Notch(Fault):
    """A groove at the pitch circle, ``notch_length`` high, over the whole face."""

    kind: ClassVar[str] = "notch"
    growth: ClassVar[Growth] = Growth.NONE
    sizes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("notch_length_mm",),
        ("notch_depth_mm",),
    )
    notch_length: float = unit("mm")
    notch_depth: float = unit("mm")

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require_not_negative(self, "notch_length_mm", "notch_depth_mm")

    def severity(self, gear: Gear) -> float:
        """Notched share of the flank."""
        return self.notch_length * gear.face_width / flank_area(gear)

    def on_other_flank(self) -> None:
        """None: a groove is in one flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Take the groove off the flank."""
        gear = tooth.gear
        groove = Patch(
            shape="rectangular",
            length=self.notch_length,
            width=gear.face_width,
            depth=self.notch_depth,
            abscissa=pitch_abscissa(gear),
            face_position=0.5 * gear.face_width,
        )
        return remove_patch(tooth, groove, "notch")
