"""Missing, broken and chipped teeth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import FaultError
from gensig.faults.base import Fault, Growth, require_choice, require_not_negative
from gensig.faults.flank_loss import (
    edge_height,
    require_edge,
    root_chord_abscissa,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

CHIP_SHAPES = {"triangular": 0.5, "rectangular": 1.0}  # share of height x width
N_STRIPS = 32  # across a triangular chip


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingTooth(Fault):
    """A missing tooth: its tooth pair never touches."""

    kind = "missing_tooth"
    growth = Growth.NONE

    def severity(self, gear: Gear) -> float:
        """Always 1."""
        return 1.0

    def on_other_flank(self) -> MissingTooth:
        """The same: the tooth is gone from both flanks."""
        return self

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth, not present."""
        return replace(tooth, present=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class BrokenTooth(Fault):
    """A tooth broken off ``broken_height`` below its tip, over the whole face.

    At full height it is missing. Below the break the flanks stand ``broken_edge_height`` proud, a
    burr that falls to nothing ``broken_edge_width`` below it.
    """

    kind = "broken"
    growth = Growth.NONE
    sizes = (("broken_height_mm",),)
    broken_height: float = unit("mm")
    broken_edge_height: float = unit("um", default=0.0)
    broken_edge_width: float = unit("mm", default=0.0)

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        keys = "broken_height_mm", "broken_edge_height_um", "broken_edge_width_mm"
        require_not_negative(self, *keys)

    def severity(self, gear: Gear) -> float:
        """Broken share of the tooth's height above the root chord."""
        return self.broken_height / tooth_height(gear)

    def on_other_flank(self) -> BrokenTooth:
        """The same: the tip is gone from both flanks."""
        return self

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth without its tip; not present if no involute is left."""
        _require_height(self, "broken_height", self.broken_height, tooth.gear)
        burr = self.broken_edge_height, self.broken_edge_width
        return _without_tip(tooth, np.array([self.broken_height]), burr, "broken")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChippedTooth(Fault):
    """A chip off the tip: ``chip_height`` below it, over ``chip_width`` from one end of the face.

    ``chip_shape`` is ``"triangular"`` (the whole height at the end, none at ``chip_width``) or
    ``"rectangular"``. Its burr, of ``chip_edge_height`` and ``chip_edge_width``, is like that of a
    broken tooth.
    """

    kind = "chipped"
    growth = Growth.NONE
    sizes = (
        ("chip_height_mm",),
        ("chip_width_mm",),
    )
    chip_height: float = unit("mm")
    chip_width: float = unit("mm")
    chip_shape: str = "triangular"
    chip_edge_height: float = unit("um", default=0.0)
    chip_edge_width: float = unit("mm", default=0.0)

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require_not_negative(self, "chip_height_mm", "chip_width_mm")
        require_not_negative(self, "chip_edge_height_um", "chip_edge_width_mm")
        require_choice(self, "chip_shape", CHIP_SHAPES)

    def severity(self, gear: Gear) -> float:
        """Broken share of height times width."""
        chip = CHIP_SHAPES[self.chip_shape] * self.chip_height * self.chip_width
        return chip / (tooth_height(gear) * gear.face_width)

    def on_other_flank(self) -> ChippedTooth:
        """The same: the chip is gone from both flanks."""
        return self

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth without the chip."""
        if self.chip_height * self.chip_width == 0.0:
            return tooth
        gear = tooth.gear
        _require_height(self, "chip_height", self.chip_height, gear)
        if self.chip_width > gear.face_width:
            raise FaultError(
                f"chip_width {self.chip_width * 1e3:.4g} mm is above the face width "
                f"{gear.face_width * 1e3:.4g} mm of the {self.gear}; reduce fault.chip_width_mm"
            )
        burr = self.chip_edge_height, self.chip_edge_width
        if self.chip_shape == "rectangular":
            sliced = tooth.split(np.array([self.chip_width]))
            is_chipped = sliced.slice_middle < self.chip_width
            height = np.where(is_chipped, self.chip_height, 0.0)
            return _without_tip(sliced, height, burr, "chip")
        sliced = tooth.split(np.linspace(0.0, self.chip_width, N_STRIPS + 1))
        height = self.chip_height * (1.0 - sliced.slice_middle / self.chip_width)
        return _without_tip(sliced, np.maximum(height, 0.0), burr, "chip")


def tooth_height(gear: Gear) -> float:
    """Height of the tooth on its centreline, from the root chord to the tip, m."""
    return gear.tip_radius - root_chord_abscissa(gear)


def _require_height(fault: Fault, key: str, height: float, gear: Gear) -> None:
    limit = tooth_height(gear)
    if height > limit * (1.0 + 1e-9):
        raise FaultError(
            f"{key} {height * 1e3:.4g} mm is above the height {limit * 1e3:.4g} mm of the "
            f"{fault.gear} tooth over its root chord (m = {gear.normal_module * 1e3:g} mm, z = "
            f"{gear.n_teeth}); reduce fault.{key}_mm"
        )


def _without_tip(
    tooth: Tooth, height: Array, burr: tuple[float, float], name: str
) -> Tooth:
    """The tooth less ``height`` (slice,) m from its tip, measured on the centreline.

    ``burr`` is height and width of the raised edge below the break, in m; ``name`` is the prefix
    of its keys.
    """
    below = tooth.gear.tip_radius - height[:, None] - tooth.profile.flank_abscissa
    broken = tooth.with_loss(np.where(below < 0.0, np.inf, 0.0))
    if not np.isfinite(broken.material_loss).any():
        return replace(broken, present=False)
    if burr[0] == 0.0:
        return broken
    require_edge(tooth, burr[1], f"{name}_")
    is_edge = (below >= 0.0) & (height[:, None] > 0.0)
    return broken.with_deviation(-np.where(is_edge, edge_height(below, *burr), 0.0))
