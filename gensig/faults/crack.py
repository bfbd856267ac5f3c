"""Root crack from the middle of the root transition curve, over all or part of the face width."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import FaultError
from gensig.faults.base import (
    Fault,
    Growth,
    require,
    require_choice,
    require_not_negative,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import RootCrack, Tooth
from gensig.geometry.tooth_profile import root_curve_point, root_curve_slope
from gensig.units import unit

CRACK_STARTS = ("arc_mid", "gamma_mid")
CRACK_FRONTS = ("straight", "parabolic", "linear")
OTHER_SIDE = {"tension": "compression", "compression": "tension"}
CRACK_FACES = ("open", "breathing")
N_STRIPS = 64  # across the face; a front ends within one of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Crack(Fault):
    """Crack at ``crack_angle`` to the tooth centreline, inward and towards the root.

    It is ``crack_depth`` deep at one end of the face and reaches over ``crack_width`` of it
    (None: all). Its front is ``straight``, or falls off to 0 at ``crack_width`` in a
    ``parabolic`` or ``linear`` way. ``crack_side`` and ``crack_faces`` are as in ``RootCrack``.
    ``mesh.crack`` selects the compliance model.
    """

    kind = "crack"
    growth = Growth.PARIS
    sizes = (
        ("crack_depth_mm",),
        ("crack_width_mm",),
    )
    crack_depth: float = unit("mm")
    crack_angle: float = unit("deg")
    crack_start: str
    crack_width: float | None = unit("mm", default=None)
    crack_front: str = "straight"
    crack_side: str = "tension"
    crack_faces: str = "open"

    def __post_init__(self) -> None:
        # super() without arguments fails: slots make a new class
        Fault.__post_init__(self)
        require_not_negative(self, "crack_depth_mm")
        is_inward = 0.0 < self.crack_angle <= 0.5 * math.pi
        require(self, "crack_angle_deg", is_inward, "must lie in 0..90")
        require_choice(self, "crack_start", CRACK_STARTS)
        require_choice(self, "crack_front", CRACK_FRONTS)
        require_choice(self, "crack_side", OTHER_SIDE)
        require_choice(self, "crack_faces", CRACK_FACES)

    def root_chord(self, gear: Gear) -> float:
        """Thickness of the healthy tooth where the crack starts, m."""
        return 2.0 * root_curve_point(gear, self.crack_start)[1]

    def seed(self) -> Crack:
        """The crack without depth, width and tooth: its growth law does not depend on them."""
        return Crack(
            gear=self.gear,
            tooth=0,
            crack_depth=0.0,
            crack_angle=self.crack_angle,
            crack_start=self.crack_start,
            crack_side=self.crack_side,
        )

    def severity(self, gear: Gear) -> float:
        """Crack depth over root chord, averaged over the face."""
        return float(self._depth(gear).mean()) / self.root_chord(gear)

    def on_other_flank(self) -> Crack:
        """The crack with its side swapped: loads on the other flank close an open crack."""
        return replace(self, crack_side=OTHER_SIDE[self.crack_side])

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with the crack in its root."""
        gear = tooth.gear
        depth = self._depth(gear)
        if not depth.any():
            return tooth
        abscissa, half = root_curve_point(gear, self.crack_start)
        if self.crack_depth >= 2.0 * half:
            raise FaultError(
                f"crack_depth {self.crack_depth * 1e3:.4g} mm reaches through the root chord "
                f"{2e3 * half:.4g} mm of the {self.gear} tooth (m = {gear.normal_module * 1e3:g} "
                f"mm, z = {gear.n_teeth}); reduce fault.crack_depth_mm"
            )
        crack = RootCrack(
            depth=depth,
            mouth_abscissa=abscissa,
            mouth_half_thickness=half,
            mouth_slope=root_curve_slope(gear, self.crack_start),
            angle=self.crack_angle,
            side=self.crack_side,
            breathing=self.crack_faces == "breathing",
        )
        return replace(tooth, cracks=(*tooth.cracks, crack))

    def _depth(self, gear: Gear) -> Array:
        """Mean depth in every strip across the face, (strip,) m; one strip for an even crack."""
        width = gear.face_width if self.crack_width is None else self.crack_width
        if not 0.0 <= width <= gear.face_width:
            raise FaultError(
                f"fault.crack_width_mm = {width * 1e3:g} must lie in "
                f"0..{gear.face_width * 1e3:g}, the face width of the {self.gear}"
            )
        if self.crack_front == "straight" and width == gear.face_width:
            return np.array([self.crack_depth])
        if width == 0.0:
            return np.zeros(N_STRIPS)
        edges = np.minimum(np.linspace(0.0, gear.face_width, N_STRIPS + 1), width)
        along = edges / width
        if self.crack_front == "straight":
            area = along
        elif self.crack_front == "linear":
            area = along - 0.5 * along**2
        else:  # q sqrt(1 - z / width), whose integral is in closed form
            area = 2.0 / 3.0 * (1.0 - (1.0 - along) ** 1.5)
        return self.crack_depth * np.diff(area) * width * N_STRIPS / gear.face_width
