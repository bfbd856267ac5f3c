"""Extended surface damage: spalls with raised edges on rough flanks, and dents by their debris."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import Fault, Growth, require, require_not_negative
from gensig.faults.flank_loss import (
    Patch,
    flank_ends,
    patch_edge,
    patch_loss,
    require_depth,
    require_edge,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

N_SLICES = 40  # across the face
LEAST_SPALL = 0.5  # of the largest spall: sizes are uniform from here to 1
DENT_SIZES = (0.5, 1.5)  # of dent_diameter, uniform
SHARES = (
    "damage",
    "spalled_share",
    "dented_share",
    "spall_length_share",
    "spall_width_share",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceDamage(Fault):
    """Damage of the flanks of several teeth: spalls, rough flanks around them, and dents.

    Of the teeth of the fault, ``spalled_share`` have an elliptic spall each (one tooth at least),
    and ``dented_share`` are dented by debris. At ``damage`` 1 the largest spall covers
    ``spall_length_share`` of the involute's height and ``spall_width_share`` of the face, is
    ``spall_depth`` deep and has a rim ``edge_height`` proud of the flank. Every tooth has its own
    part of that, from ``LEAST_SPALL`` to 1. The flank of a spalled tooth is rough: independent
    normal heights of the standard deviation ``roughness``, ``roughness_length`` apart, straight
    between. A dented tooth has ``n_dents`` dents at ``damage`` 1, ``dent_depth`` deep, with
    shoulders of ``dent_shoulder``; a dent is one slice wide at least. Rims and shoulders fall to
    nothing ``edge_width`` away.

    ``damage`` scales sizes of spalls, their rims, the roughness and the number of dents, and
    neither depths nor which teeth. ``damage_seed`` and the tooth's number decide the rest: holes
    of a larger damage include those of a smaller one.

    Source: the kinds of damage are those of ISO 10825-1:2022 (spalling, indentation, burrs). Sizes
    are assumed, see ``docs/theory/surface_damage.md``.
    """

    kind = "surface_damage"
    growth = Growth.NONE
    sizes = (("damage",),)
    alike = False
    damage: float
    spalled_share: float
    spall_length_share: float
    spall_width_share: float
    spall_depth: float = unit("mm")
    edge_height: float = unit("um")
    edge_width: float = unit("mm")
    roughness: float = unit("um")
    roughness_length: float = unit("mm")
    dented_share: float
    n_dents: int
    dent_diameter: float = unit("mm")
    dent_depth: float = unit("um")
    dent_shoulder: float = unit("um")
    damage_seed: int

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        for share in SHARES:
            value = getattr(self, share)
            require(self, share, 0.0 <= value <= 1.0, "must lie in 0..1")
        both = self.spalled_share + self.dented_share
        rule = (
            f"must be at most {1.0 - self.spalled_share:.3g}: other teeth are spalled"
        )
        require(self, "dented_share", both <= 1.0 + 1e-9, rule)
        sizes = "spall_depth_mm", "edge_height_um", "edge_width_mm", "roughness_um"
        dents = "n_dents", "dent_depth_um", "dent_shoulder_um", "damage_seed"
        require_not_negative(self, *sizes, *dents)
        positive = "roughness_length_mm", "dent_diameter_mm"
        for key, value in zip(
            positive, (self.roughness_length, self.dent_diameter), strict=True
        ):
            require(self, key, value > 0.0, "must be positive")
        most = 0.5 * DENT_SIZES[0] * self.dent_diameter
        rule = f"must be at most {most * 1e6:.4g}, half of the smallest dent's diameter"
        require(self, "dent_depth_um", self.dent_depth <= most, rule)

    def severity(self, gear: Gear) -> float:
        """The damage."""
        return self.damage

    def on_other_flank(self) -> None:
        """None: spalls and dents are in the loaded flank."""
        return None

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with its spall or its dents; the tooth itself where it has neither."""
        spalled, dented = self.damaged_teeth(tooth.gear)
        if self.damage == 0.0 or number not in (*spalled, *dented):
            return tooth
        if max(self.edge_height, self.dent_shoulder) > 0.0:
            require_edge(tooth, self.edge_width, "")
        sliced = tooth.split(np.linspace(0.0, tooth.gear.face_width, N_SLICES + 1))
        rng = np.random.Generator(
            np.random.Philox(
                np.random.SeedSequence(self.damage_seed, spawn_key=(number,))
            )
        )
        if number in dented:
            return _with_patches(sliced, self._dents(sliced, rng))
        rough = sliced.with_deviation(self._rough(sliced, rng))
        return _with_patches(rough, [self._spall(sliced, rng)])

    def damaged_teeth(self, gear: Gear) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Numbers of the spalled and of the dented teeth; a larger share has those of a smaller."""
        teeth = self.teeth(gear)
        seed = np.random.SeedSequence(self.damage_seed)
        order = np.random.Generator(np.random.Philox(seed)).permutation(len(teeth))
        n_spalled = round(self.spalled_share * len(teeth))
        if self.spalled_share > 0.0:
            n_spalled = max(n_spalled, 1)
        # dents from the other end of the order: a larger share of one leaves the other's teeth
        n_dented = min(round(self.dented_share * len(teeth)), len(teeth) - n_spalled)
        ranked = [teeth[index] for index in order.tolist()]
        return tuple(ranked[:n_spalled]), tuple(ranked[len(teeth) - n_dented :])

    def _rough(self, tooth: Tooth, rng: np.random.Generator) -> Array:
        """Heights of a rough flank, (slice, profile) m behind the nominal one."""
        arc = tooth.profile.curvature_radius**2 / (2.0 * tooth.gear.base_radius)
        along = (arc - arc[0]) / self.roughness_length
        knots = np.arange(int(along[-1]) + 2)
        heights = rng.standard_normal((N_SLICES, len(knots)))
        source = np.clip(
            (tooth.slice_middle / tooth.gear.face_width * N_SLICES).astype(int),
            0,
            N_SLICES - 1,
        )
        rows = [np.interp(along, knots, heights[row]) for row in source.tolist()]
        return self.damage * self.roughness * np.array(rows)

    def _spall(self, tooth: Tooth, rng: np.random.Generator) -> Patch:
        """The spall of a tooth; its middle does not depend on the damage."""
        gear, (low, high) = tooth.gear, flank_ends(tooth.gear)
        part = LEAST_SPALL + (1.0 - LEAST_SPALL) * rng.random()
        length = part * self.spall_length_share * (high - low)
        width = part * self.spall_width_share * gear.face_width
        middle = low + 0.5 * length + (high - low - length) * rng.random()
        face = 0.5 * width + (gear.face_width - width) * rng.random()
        length, width = self.damage * length, self.damage * width
        ends = middle - 0.5 * length, middle + 0.5 * length
        require_depth(tooth, *ends, self.spall_depth, "spall")
        return Patch(
            shape="elliptic",
            length=length,
            width=width,
            depth=self.spall_depth,
            abscissa=middle,
            face_position=face,
            edge_height=part * self.damage * self.edge_height,
            edge_width=self.edge_width,
        )

    def _dents(self, tooth: Tooth, rng: np.random.Generator) -> list[Patch]:
        """The dents of a tooth, the first ones of a list that does not depend on the damage."""
        low, high = flank_ends(tooth.gear)
        largest = DENT_SIZES[1] * self.dent_diameter
        rule = f"makes dents up to {largest * 1e3:.4g} mm, above the flank's height "
        rule += f"{(high - low) * 1e3:.4g} mm of the {tooth.gear.name}"
        require(self, "dent_diameter_mm", largest <= high - low, rule)
        dents = []
        for _ in range(round(self.damage * self.n_dents)):
            diameter = self.dent_diameter * rng.uniform(*DENT_SIZES)
            middle = low + 0.5 * diameter + (high - low - diameter) * rng.random()
            face = (
                (int(rng.integers(N_SLICES)) + 0.5) / N_SLICES * tooth.gear.face_width
            )
            dents.append(
                Patch(
                    shape="elliptic",
                    length=diameter,
                    width=diameter,
                    depth=self.dent_depth,
                    abscissa=middle,
                    face_position=face,
                    edge_height=self.dent_shoulder,
                    edge_width=self.edge_width,
                )
            )
        return dents


def _with_patches(tooth: Tooth, patches: list[Patch]) -> Tooth:
    """The tooth with holes and their raised edges; no edge stands in a hole."""
    shape = (len(tooth.slice_middle), len(tooth.profile.curvature_radius))
    loss, edge = np.zeros(shape), np.zeros(shape)
    for patch in patches:
        if patch.area > 0.0:
            loss = np.maximum(loss, patch_loss(tooth, patch))
            edge = np.maximum(edge, patch_edge(tooth, patch))
    return tooth.with_loss(loss).with_deviation(-np.where(loss > 0.0, 0.0, edge))
