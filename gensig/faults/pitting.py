"""Pits and spalls on the flank.

One of the paper's, one of any size and shape, or many small ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gensig.errors import FaultError
from gensig.faults.base import Fault, Growth, require, require_not_negative
from gensig.faults.flank_loss import (
    SHAPES,
    Patch,
    flank_area,
    flank_ends,
    patch_loss,
    pitch_abscissa,
    remove_patch,
    root_chord_abscissa,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pitting(Fault):
    """Rectangular pit: ``pit_length`` along the tooth height, ``pit_width`` along the face,
    ``pit_depth`` inward.

    ``pit_position`` is the distance from the root chord to the middle of the pit on the tooth
    centreline; None puts it on the pitch circle, as in the paper. ``pit_face_position`` from one
    end of the face; None puts it in the middle.

    Source: spur paper section 3.2, eqs. (13) to (18); h in (14) and (15) is the pit depth.
    """

    kind: ClassVar[str] = "pitting"
    growth: ClassVar[Growth] = Growth.NONE
    pit_length: float = unit("mm")
    pit_width: float = unit("mm")
    pit_depth: float = unit("mm")
    pit_position: float | None = unit("mm", default=None)
    pit_face_position: float | None = unit("mm", default=None)

    def __post_init__(self) -> None:
        # slots make a new class, so the zero-argument super() would look at the old one
        Fault.__post_init__(self)
        require_not_negative(self, "pit_length_mm", "pit_width_mm", "pit_depth_mm")

    def severity(self, gear: Gear) -> float:
        """Pitted share of the flank (involute height on the tooth axis times face width)."""
        return (
            0.0
            if self.pit_depth == 0.0
            else self.pit_length * self.pit_width / flank_area(gear)
        )

    def on_other_flank(self) -> None:
        """None: a pit is in one flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Remove the pit."""
        patch = _patch(
            tooth.gear,
            "rectangular",
            (self.pit_length, self.pit_width, self.pit_depth),
            self.pit_position,
            self.pit_face_position,
        )
        return remove_patch(tooth, patch, "pit")


@dataclass(frozen=True, slots=True, kw_only=True)
class Spalling(Fault):
    """A spall: a larger hole, ``spall_shape`` rectangular or elliptic; places as in ``Pitting``."""

    kind: ClassVar[str] = "spalling"
    growth: ClassVar[Growth] = Growth.NONE
    spall_length: float = unit("mm")
    spall_width: float = unit("mm")
    spall_depth: float = unit("mm")
    spall_shape: str = "elliptic"
    spall_position: float | None = unit("mm", default=None)
    spall_face_position: float | None = unit("mm", default=None)

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require_not_negative(
            self, "spall_length_mm", "spall_width_mm", "spall_depth_mm"
        )
        require(
            self,
            "spall_shape",
            self.spall_shape in SHAPES,
            f"is none of {', '.join(SHAPES)}",
        )

    def severity(self, gear: Gear) -> float:
        """Spalled share of the flank."""
        share = 0.25 * math.pi if self.spall_shape == "elliptic" else 1.0
        return (
            0.0
            if self.spall_depth == 0.0
            else share * self.spall_length * self.spall_width / flank_area(gear)
        )

    def on_other_flank(self) -> None:
        """None: a spall is in one flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Remove the spall."""
        patch = _patch(
            tooth.gear,
            self.spall_shape,
            (self.spall_length, self.spall_width, self.spall_depth),
            self.spall_position,
            self.spall_face_position,
        )
        return remove_patch(tooth, patch, "spall")


def _patch(
    gear: Gear,
    shape: str,
    size: tuple[float, float, float],
    position: float | None,
    face_position: float | None,
) -> Patch:
    return Patch(
        shape=shape,
        length=size[0],
        width=size[1],
        depth=size[2],
        abscissa=pitch_abscissa(gear)
        if position is None
        else root_chord_abscissa(gear) + position,
        face_position=0.5 * gear.face_width if face_position is None else face_position,
    )


N_SLICES = 40  # across the face, on which many pits are drawn
MOST_PITS = 20000


@dataclass(frozen=True, slots=True, kw_only=True)
class DistributedPitting(Fault):
    """Many round pits, drawn until ``pitted_share`` of the flank is gone.

    Their diameters are log-normal about ``pit_diameter`` with the standard deviation
    ``diameter_scatter`` of the logarithm, their depths ``depth_ratio`` diameters, their places
    uniform over the face and over the flank's height from ``region_low`` to ``region_high`` (0 at
    the lower end of the involute, 1 at the tip). ``pit_seed`` and the tooth's number decide the
    pits: a larger share has all pits of a smaller one.
    """

    kind: ClassVar[str] = "distributed_pitting"
    growth: ClassVar[Growth] = Growth.PITS
    alike: ClassVar[bool] = False
    pitted_share: float
    pit_diameter: float = unit("mm")
    diameter_scatter: float
    depth_ratio: float
    region_low: float
    region_high: float
    pit_seed: int

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require(self, "region_low", self.region_low >= 0.0, "must not be negative")
        require(
            self, "region_high", self.region_high <= 1.0, "must not be above 1, the tip"
        )
        rule = f"must lie below region_high = {self.region_high:g}"
        require(self, "region_low", self.region_low < self.region_high, rule)
        require(self, "pit_diameter_mm", self.pit_diameter > 0.0, "must be positive")
        require(
            self, "depth_ratio", 0.0 < self.depth_ratio <= 0.5, "must lie in 0..0.5"
        )
        require(
            self,
            "diameter_scatter",
            0.0 <= self.diameter_scatter <= 1.0,
            "must lie in 0..1",
        )
        require(self, "pit_seed", self.pit_seed >= 0, "must not be negative")
        most = 0.7 * (self.region_high - self.region_low)
        rule = f"must lie in 0..{most:.3g}, 0.7 of the region: pits overlap"
        require(self, "pitted_share", 0.0 <= self.pitted_share <= most, rule)

    def severity(self, gear: Gear) -> float:
        """Pitted share of the flank."""
        return self.pitted_share

    def on_other_flank(self) -> None:
        """None: pits come in the loaded flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Draw pits until the share is reached."""
        if self.pitted_share == 0.0:
            return tooth
        gear = tooth.gear
        sliced = tooth.split(np.linspace(0.0, gear.face_width, N_SLICES + 1))
        rng = np.random.Generator(
            np.random.Philox(np.random.SeedSequence(self.pit_seed, spawn_key=(number,)))
        )
        low, high = flank_ends(gear)
        flank = sliced.profile.abscissa[sliced.profile.n_root_cells :]
        cell_area = np.outer(sliced.slice_width, np.gradient(flank)) / flank_area(gear)
        loss = np.zeros_like(cell_area)
        for _ in range(MOST_PITS):
            loss = np.maximum(
                loss, patch_loss(sliced, self._draw(rng, gear, low, high))
            )
            if float(cell_area[loss > 0.0].sum()) >= self.pitted_share:
                return sliced.with_loss(loss)
        raise FaultError(
            f"{MOST_PITS} pits of {self.pit_diameter * 1e3:g} mm do not make fault.pitted_share = "
            f"{self.pitted_share:g}; increase fault.pit_diameter_mm"
        )

    def _draw(
        self, rng: np.random.Generator, gear: Gear, low: float, high: float
    ) -> Patch:
        diameter = self.pit_diameter * math.exp(
            self.diameter_scatter * rng.standard_normal()
        )
        share = self.region_low + (self.region_high - self.region_low) * rng.random()
        return Patch(
            shape="elliptic",
            length=diameter,
            width=diameter,
            depth=self.depth_ratio * diameter,
            abscissa=low + share * (high - low),
            face_position=gear.face_width * rng.random(),
        )
