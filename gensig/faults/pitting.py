"""One pit on the flank, over part of the face width, as the spur paper has it (eqs. 13 to 18)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gensig.errors import FaultError
from gensig.faults.base import Fault
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Pitting(Fault):
    """Rectangular pit: ``pit_length`` along the tooth height, ``pit_width`` along the face, ``pit_depth`` inward.

    ``pit_position`` is the distance from the root chord to the middle of the pit on the tooth centreline; None puts
    it on the pitch circle, as in the paper.

    Source: spur paper eqs. (13) to (18); h in (14) and (15) is the pit depth, and (15) is the parallel-axis result.
    """

    kind: ClassVar[str] = "pitting"
    pit_length: float = unit("mm")
    pit_width: float = unit("mm")
    pit_depth: float = unit("mm")
    pit_position: float | None = unit("mm")

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        for key in ("pit_length", "pit_width", "pit_depth"):
            if getattr(self, key) < 0.0:
                raise FaultError(f"fault.{key}_mm = {getattr(self, key) * 1e3:g} must not be negative")

    def severity(self, gear: Gear) -> float:
        """Pitted share of the flank (involute height on the tooth axis times face width)."""
        if self.pit_depth == 0.0:
            return 0.0
        tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
        ends = np.hypot(gear.base_radius, np.array([gear.junction_curvature_radius, tip]))
        return self.pit_length * self.pit_width / (float(ends[1] - ends[0]) * gear.face_width)

    def apply(self, tooth: Tooth) -> Tooth:
        """Remove the pit from the sections and from the width in contact; a pit without extent is none."""
        if self.pit_length * self.pit_width * self.pit_depth == 0.0:
            return tooth
        gear, profile = tooth.gear, tooth.profile
        flank = profile.abscissa[profile.n_root_cells :]
        low, high = self._edges(tooth)
        if low < flank[0] - 1e-9 or high > flank[-1] + 1e-9:
            raise FaultError(
                f"the pit from {(low - profile.abscissa[0]) * 1e3:.4g} to {(high - profile.abscissa[0]) * 1e3:.4g} mm "
                f"above the root chord leaves the flank of the {self.gear} tooth, which reaches from "
                f"{(flank[0] - profile.abscissa[0]) * 1e3:.4g} to {(flank[-1] - profile.abscissa[0]) * 1e3:.4g} mm; "
                f"change fault.pit_position_mm or fault.pit_length_mm"
            )
        if self.pit_width >= gear.face_width:
            raise FaultError(
                f"pit_width {self.pit_width * 1e3:.4g} mm must be below the face width {gear.face_width * 1e3:.4g} mm "
                f"of the {self.gear}: something of the flank must carry; reduce fault.pit_width_mm"
            )
        edges = profile.abscissa
        overlap = np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None) / np.diff(edges)
        half = tooth.cell_half_thickness
        if np.any(self.pit_depth >= half[overlap > 0.0]):
            raise FaultError(
                f"pit_depth {self.pit_depth * 1e3:.4g} mm reaches the centreline of the {self.gear} tooth (half "
                f"thickness {float(half[overlap > 0.0].min()) * 1e3:.4g} mm there); reduce fault.pit_depth_mm"
            )
        # shares of the sound section, so that a pit and a crack compose in any order
        lost_width = self.pit_width * overlap
        lost_area = lost_width * self.pit_depth
        area = 2.0 * half * gear.face_width
        second_moment = area * half**2 / 3.0
        parallel_axis = area * lost_area * (half - 0.5 * self.pit_depth) ** 2 / (area - lost_area)
        lost_moment = lost_width * self.pit_depth**3 / 12.0 + parallel_axis
        inside = (flank >= low) & (flank <= high)
        return replace(
            tooth,
            area=tooth.area * (1.0 - lost_area / area),
            second_moment=tooth.second_moment * (1.0 - lost_moment / second_moment),
            contact_width=np.where(inside, tooth.contact_width - self.pit_width, tooth.contact_width),
        )

    def _edges(self, tooth: Tooth) -> tuple[float, float]:
        """Abscissae of the pit's lower and upper edge, m."""
        gear, root = tooth.gear, float(tooth.profile.abscissa[0])
        if self.pit_position is None:
            middle = gear.pitch_radius * math.cos(gear.half_tooth_angle_at(gear.pitch_radius))
        else:
            middle = root + self.pit_position
        return middle - 0.5 * self.pit_length, middle + 0.5 * self.pit_length
