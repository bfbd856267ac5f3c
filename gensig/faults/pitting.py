"""Pits and spalls on the flank: single holes, or many small pits."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gensig.errors import FaultError
from gensig.faults.base import (
    Fault,
    Growth,
    require,
    require_choice,
    require_not_negative,
)
from gensig.faults.flank_loss import (
    SHAPES,
    Patch,
    deepen,
    flank_area,
    flank_ends,
    patch_edge,
    pitch_abscissa,
    remove_patch,
    require_edge,
    root_chord_abscissa,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

N_SLICES = 40  # across the face, on which many pits are drawn
MOST_PITS = 20000


@dataclass(frozen=True, slots=True, kw_only=True)
class Hole(Fault):
    """One hole in a flank."""

    # prefix of the configuration keys
    prefix: ClassVar[str]

    @abstractmethod
    def patch(self, gear: Gear) -> Patch:
        """The hole on a tooth of the gear."""

    def severity(self, gear: Gear) -> float:
        """Lost share of the flank (involute height on the tooth axis times face width)."""
        return self.patch(gear).area / flank_area(gear)

    def on_other_flank(self) -> None:
        """None: a hole is in one flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with the hole."""
        return remove_patch(tooth, self.patch(tooth.gear), self.prefix)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pitting(Hole):
    """Rectangular pit, ``pit_length`` along the tooth height, ``pit_width`` along the face.

    ``pit_depth`` is inward. ``pit_position`` is the distance from the root chord to the middle of
    the pit on the tooth centreline; None puts it on the pitch circle, as in the paper.
    ``pit_face_position`` is from one end of the face; None puts it in the middle. The flank
    around the pit stands ``pit_edge_height`` proud, falling to nothing ``pit_edge_width`` away.

    Source: spur paper section 3.2, eqs. (13) to (18); h in (14) and (15) is the pit depth.
    """

    kind = "pitting"
    growth = Growth.NONE
    sizes = (
        ("pit_length_mm",),
        ("pit_width_mm",),
        ("pit_depth_mm", "pit_edge_height_um"),
    )
    prefix = "pit"
    pit_length: float = unit("mm")
    pit_width: float = unit("mm")
    pit_depth: float = unit("mm")
    pit_position: float | None = unit("mm", default=None)
    pit_face_position: float | None = unit("mm", default=None)
    pit_edge_height: float = unit("um", default=0.0)
    pit_edge_width: float = unit("mm", default=0.0)

    def __post_init__(self) -> None:
        # super() without arguments fails: slots make a new class
        Fault.__post_init__(self)
        require_not_negative(self, "pit_length_mm", "pit_width_mm", "pit_depth_mm")
        require_not_negative(self, "pit_edge_height_um", "pit_edge_width_mm")

    def patch(self, gear: Gear) -> Patch:
        """The pit on a tooth of the gear."""
        size = self.pit_length, self.pit_width, self.pit_depth
        position = self.pit_position, self.pit_face_position
        edge = self.pit_edge_height, self.pit_edge_width
        return _patch(gear, "rectangular", size, *position, edge)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spalling(Hole):
    """A larger hole, ``spall_shape`` rectangular or elliptic.

    Positions and raised edge as in ``Pitting``.
    """

    kind = "spalling"
    growth = Growth.NONE
    sizes = (
        ("spall_length_mm",),
        ("spall_width_mm",),
        ("spall_depth_mm", "spall_edge_height_um"),
    )
    prefix = "spall"
    spall_length: float = unit("mm")
    spall_width: float = unit("mm")
    spall_depth: float = unit("mm")
    spall_shape: str = "elliptic"
    spall_position: float | None = unit("mm", default=None)
    spall_face_position: float | None = unit("mm", default=None)
    spall_edge_height: float = unit("um", default=0.0)
    spall_edge_width: float = unit("mm", default=0.0)

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        lengths = "spall_length_mm", "spall_width_mm", "spall_depth_mm"
        require_not_negative(self, *lengths)
        require_not_negative(self, "spall_edge_height_um", "spall_edge_width_mm")
        require_choice(self, "spall_shape", SHAPES)

    def patch(self, gear: Gear) -> Patch:
        """The spall on a tooth of the gear."""
        size = self.spall_length, self.spall_width, self.spall_depth
        position = self.spall_position, self.spall_face_position
        edge = self.spall_edge_height, self.spall_edge_width
        return _patch(gear, self.spall_shape, size, *position, edge)


def _patch(
    gear: Gear,
    shape: str,
    size: tuple[float, float, float],
    position: float | None,
    face_position: float | None,
    edge: tuple[float, float],
) -> Patch:
    abscissa = pitch_abscissa(gear)
    if position is not None:
        abscissa = root_chord_abscissa(gear) + position
    if face_position is None:
        face_position = 0.5 * gear.face_width
    return Patch(
        shape=shape,
        length=size[0],
        width=size[1],
        depth=size[2],
        abscissa=abscissa,
        face_position=face_position,
        edge_height=edge[0],
        edge_width=edge[1],
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class DistributedPitting(Fault):
    """Many round pits, drawn until ``pitted_share`` of the flank is gone.

    Diameters are log-normal about ``pit_diameter`` with the standard deviation
    ``diameter_scatter`` of the logarithm. Depths are ``depth_ratio`` diameters. Positions are
    uniform over the face and over the flank's height from ``region_low`` to ``region_high`` (0 at
    the lower end of the involute, 1 at the tip). ``pit_seed`` and the tooth's number determine the
    pits; a larger share includes all pits of a smaller one. Raised edges as in ``Pitting``.
    """

    kind = "distributed_pitting"
    growth = Growth.PITS
    sizes = (("pitted_share",),)
    alike = False
    pitted_share: float
    pit_diameter: float = unit("mm")
    diameter_scatter: float
    depth_ratio: float
    region_low: float
    region_high: float
    pit_seed: int
    pit_edge_height: float = unit("um", default=0.0)
    pit_edge_width: float = unit("mm", default=0.0)

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        low, high, share = self.region_low, self.region_high, self.pitted_share
        ratio, scatter = self.depth_ratio, self.diameter_scatter
        most = 0.7 * (high - low)
        share_rule = f"must lie in 0..{most:.3g}, 0.7 of the region: pits overlap"
        for key, holds, rule in (
            ("region_low", low >= 0.0, "must not be negative"),
            ("region_high", high <= 1.0, "must not be above 1, the tip"),
            ("region_low", low < high, f"must lie below region_high = {high:g}"),
            ("pit_diameter_mm", self.pit_diameter > 0.0, "must be positive"),
            ("depth_ratio", 0.0 < ratio <= 0.5, "must lie in 0..0.5"),
            ("diameter_scatter", 0.0 <= scatter <= 1.0, "must lie in 0..1"),
            ("pit_seed", self.pit_seed >= 0, "must not be negative"),
            ("pitted_share", 0.0 <= share <= most, share_rule),
        ):
            require(self, key, holds, rule)
        require_not_negative(self, "pit_edge_height_um", "pit_edge_width_mm")

    def severity(self, gear: Gear) -> float:
        """Pitted share of the flank."""
        return self.pitted_share

    def on_other_flank(self) -> None:
        """None: pits come in the loaded flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with pits drawn until the share is reached."""
        if self.pitted_share == 0.0:
            return tooth
        gear = tooth.gear
        sliced = tooth.split(np.linspace(0.0, gear.face_width, N_SLICES + 1))
        seed = np.random.SeedSequence(self.pit_seed, spawn_key=(number,))
        rng = np.random.Generator(np.random.Philox(seed))
        heights = np.gradient(sliced.profile.flank_abscissa)
        cell_area = np.outer(sliced.slice_width, heights) / flank_area(gear)
        loss, edge = np.zeros_like(cell_area), np.zeros_like(cell_area)
        is_raised = self.pit_edge_height > 0.0
        if is_raised:
            require_edge(tooth, self.pit_edge_width, "pit_")
        ends = flank_ends(gear)
        for _ in range(MOST_PITS):
            pit = self._draw(rng, ends, gear.face_width)
            deepen(loss, sliced, pit)
            if is_raised:
                edge = np.maximum(edge, patch_edge(sliced, pit))
            if float(cell_area[loss > 0.0].sum()) >= self.pitted_share:
                raised = np.where(loss > 0.0, 0.0, edge)
                return sliced.with_loss(loss).with_deviation(-raised)
        raise FaultError(
            f"{MOST_PITS} pits of {self.pit_diameter * 1e3:g} mm do not make fault.pitted_share = "
            f"{self.pitted_share:g}; increase fault.pit_diameter_mm"
        )

    def _draw(
        self, rng: np.random.Generator, ends: tuple[float, float], face_width: float
    ) -> Patch:
        low, high = ends
        scatter = math.exp(self.diameter_scatter * rng.standard_normal())
        diameter = self.pit_diameter * scatter
        share = self.region_low + (self.region_high - self.region_low) * rng.random()
        return Patch(
            shape="elliptic",
            length=diameter,
            width=diameter,
            depth=self.depth_ratio * diameter,
            abscissa=low + share * (high - low),
            face_position=face_width * rng.random(),
            edge_height=self.pit_edge_height,
            edge_width=self.pit_edge_width,
        )
