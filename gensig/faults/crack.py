"""Root crack through the face width, as the spur paper has it (eqs. 11 and 12)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gensig.errors import FaultError
from gensig.faults.base import Fault
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.geometry.tooth_profile import root_curve_point
from gensig.units import unit

CRACK_STARTS = ("arc_mid", "gamma_mid")


@dataclass(frozen=True, slots=True, kw_only=True)
class Crack(Fault):
    """Crack from the middle of the root transition curve, at ``crack_angle`` to the tooth centreline, inward.

    Source: spur paper eqs. (11) and (12): h_q = h_c - q sin(angle), and every section thicker than h_q keeps
    h_x + h_q of its height. The body stays whole, which makes the crack weaker than finite elements find it. Below
    its mouth every section is thicker than h_c, so (11) and (12) cut the tooth even at depth 0: a crack of no depth is
    therefore left out, and the first micrometre costs up to 34e-12 m/N.
    """

    kind: ClassVar[str] = "crack"
    crack_depth: float = unit("mm")
    crack_angle: float = unit("deg")
    crack_start: str

    def __post_init__(self) -> None:
        # slots make a new class, so the zero-argument super() would look at the old one
        Fault.__post_init__(self)
        if self.crack_depth < 0.0:
            raise FaultError(f"fault.crack_depth_mm = {self.crack_depth * 1e3:g} must not be negative")
        if not 0.0 < self.crack_angle <= 0.5 * math.pi:
            raise FaultError(f"fault.crack_angle_deg = {math.degrees(self.crack_angle):g} must lie in 0..90")
        if self.crack_start not in CRACK_STARTS:
            raise FaultError(f"fault.crack_start = {self.crack_start!r}; allowed: {', '.join(CRACK_STARTS)}")

    def root_chord(self, gear: Gear) -> float:
        """Thickness of the sound tooth where the crack starts, m."""
        return 2.0 * root_curve_point(gear, self.crack_start)[1]

    def severity(self, gear: Gear) -> float:
        """Crack depth over root chord."""
        return self.crack_depth / self.root_chord(gear)

    def apply(self, tooth: Tooth) -> Tooth:
        """Reduce the sections that the crack cuts."""
        if self.crack_depth == 0.0:
            return tooth
        chord = self.root_chord(tooth.gear)
        if self.crack_depth >= chord:
            raise FaultError(
                f"crack_depth {self.crack_depth * 1e3:.4g} mm reaches through the root chord {chord * 1e3:.4g} mm of "
                f"the {self.gear} tooth (m = {tooth.gear.normal_module * 1e3:g} mm, z = {tooth.gear.n_teeth}); reduce "
                f"fault.crack_depth_mm"
            )
        half = tooth.cell_half_thickness
        kept = half + np.minimum(half, 0.5 * chord - self.crack_depth * math.sin(self.crack_angle))
        if np.any(kept <= 0.0):
            limit = (0.5 * chord + float(half.min())) / math.sin(self.crack_angle)
            raise FaultError(
                f"crack_depth {self.crack_depth * 1e3:.4g} mm leaves no section near the tip of the {self.gear} tooth "
                f"(spur paper eqs. 11-12 hold below {limit * 1e3:.4g} mm); reduce fault.crack_depth_mm"
            )
        share = kept / (2.0 * half)
        return replace(tooth, area=tooth.area * share, second_moment=tooth.second_moment * share**3)
