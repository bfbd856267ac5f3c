"""Flank modifications: tip and root relief, crowning, end relief, helix slope, misalignment.

Depths are along the transverse line of action, into the flank. Heights are radial, from
the tip or from the lowest working point. Source of the shapes and names: ISO 21771-1:2024,
section on flank modifications.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.mesh.thermal.thermal_growth import PairGrowth
from gensig.units import from_si, unit

SHAPES = {"linear": 1, "parabolic": 2}  # exponent of the share of the height
N_SLICES = 40  # across the face of a spur tooth with a modified lead


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankModification:
    """Modification of one gear's flanks, equal on every tooth; all 0 is the involute helicoid.

    Parameters
    ----------
    tip_relief, root_relief : m      depth at the tip and at the lowest working point
    tip_relief_height, root_relief_height : m    radial, over which they run out
    profile_shape : ``linear`` or ``parabolic``    of both reliefs over the height
    crowning : m                     depth at both ends of the face, parabolic
    end_relief : m                   depth at both ends of the face, linear over `end_relief_width`
    end_relief_width : m
    helix_slope : m                  depth at the end that enters last, linear from 0 at the other
        end; may be negative
    """

    tip_relief: float = unit("um", default=0.0)
    tip_relief_height: float = unit("mm", default=0.0)
    root_relief: float = unit("um", default=0.0)
    root_relief_height: float = unit("mm", default=0.0)
    profile_shape: str = "linear"
    crowning: float = unit("um", default=0.0)
    end_relief: float = unit("um", default=0.0)
    end_relief_width: float = unit("mm", default=0.0)
    helix_slope: float = unit("um", default=0.0)

    def __post_init__(self) -> None:
        if self.profile_shape not in SHAPES:
            raise ConfigError(
                f"profile_shape = {self.profile_shape!r}; allowed: {', '.join(SHAPES)}"
            )
        for field in fields(self):
            value: Any = getattr(self, field.name)
            if field.name not in ("profile_shape", "helix_slope") and not value >= 0.0:
                key = f"{field.name}_{field.metadata['unit']}"
                raise ConfigError(
                    f"{key} = {from_si(key, value):g} must not be negative"
                )
        for depth, length, key in (
            (self.tip_relief, self.tip_relief_height, "tip_relief_height_mm"),
            (self.root_relief, self.root_relief_height, "root_relief_height_mm"),
            (self.end_relief, self.end_relief_width, "end_relief_width_mm"),
        ):
            if depth > 0.0 and length == 0.0:
                raise ConfigError(
                    f"{key} = 0: a relief of {depth * 1e6:g} um needs a length to run out over"
                )

    def profile(self, gear: Gear, curvature_radius: Array, lowest: float) -> Array:
        """Depth over the profile, (point,) m.

        Parameters
        ----------
        curvature_radius : (point,) m    of the flank
        lowest : m                       curvature radius of the lowest working point

        Raises
        ------
        ConfigError    for reliefs that overlap
        """
        radius = np.hypot(gear.base_radius, curvature_radius)
        start = float(np.hypot(gear.base_radius, lowest))
        working = gear.tip_radius - start
        tip = self.tip_relief_height * (self.tip_relief > 0.0)
        root = self.root_relief_height * (self.root_relief > 0.0)
        if tip + root > working:
            raise ConfigError(
                f"{gear.name}: tip_relief_height_mm = {tip * 1e3:g} and root_relief_height_mm = "
                f"{root * 1e3:g} overlap: the working flank is {working * 1e3:.4g} mm high; "
                "reduce one"
            )
        power = SHAPES[self.profile_shape]
        depth = np.zeros_like(radius)
        if tip:
            share = np.maximum((radius - gear.tip_radius + tip) / tip, 0.0)
            depth += self.tip_relief * share**power
        if root:
            share = np.maximum((start + root - radius) / root, 0.0)
            depth += self.root_relief * share**power
        return depth

    def lead(self, face_position: Array, face_width: float) -> Array:
        """Depth across the face, (slice,) m; ``face_position`` (slice,) m counts from the
        end that enters first.

        Raises
        ------
        ConfigError    for end reliefs that overlap
        """
        if self.end_relief and 2.0 * self.end_relief_width > face_width:
            raise ConfigError(
                f"end_relief_width_mm = {self.end_relief_width * 1e3:g} at both ends overlaps on "
                f"a face of {face_width * 1e3:g} mm; reduce it to at most half"
            )
        from_middle = 2.0 * face_position / face_width - 1.0
        depth = (
            self.crowning * from_middle**2
            + self.helix_slope * face_position / face_width
        )
        if self.end_relief:
            from_end = np.minimum(face_position, face_width - face_position)
            share = np.maximum(1.0 - from_end / self.end_relief_width, 0.0)
            depth = depth + self.end_relief * share
        return depth


# all that is 0 for the involute helicoid
SIZES = tuple(
    field.name for field in fields(FlankModification) if field.name != "profile_shape"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairModification:
    """Both gears' modifications, and misalignment of the shafts, m over the face.

    The misalignment is along the line of action. ``growth`` is that of hot gears, beyond the
    growth of the pair as a whole; None for gears as they are drawn.
    """

    pinion: FlankModification
    wheel: FlankModification
    misalignment: float = unit("um", default=0.0)
    growth: PairGrowth | None = None

    @property
    def sides(self) -> dict[str, FlankModification]:
        """The modification of each gear, by its side of the pair."""
        return {"pinion": self.pinion, "wheel": self.wheel}

    @property
    def is_any(self) -> bool:
        """True unless both flanks are aligned involute helicoids."""
        is_cut = any(
            getattr(side, name) != 0.0
            for side in (self.pinion, self.wheel)
            for name in SIZES
        )
        return is_cut or self.misalignment != 0.0 or self.growth is not None

    def deviation(self, pair: GearPair, position: Array, face_position: Array) -> Array:
        """Deviation of both flanks together where they meet, (slice, node) m.

        At least 0 without growth, which can make flanks stand proud.

        Parameters
        ----------
        position : (node,) m    on the path of contact, from A; beyond it the nearest end counts
        face_position : (slice,) m    from the end that enters first
        """
        on_path = np.clip(position, 0.0, pair.path_of_contact)
        profiles = [
            self.profile(pair, side, pair.curvature(side, on_path)) for side in SIDES
        ]
        return sum(profiles) + self.lead(pair, face_position)[:, None]

    def profile(self, pair: GearPair, name: str, curvature_radius: Array) -> Array:
        """Depth over the profile of the gear of that name, (point,) m, of cut and of growth.

        See ``FlankModification.profile`` and ``PairGrowth.profile``.
        """
        lowest = {"pinion": 0.0, "wheel": pair.path_of_contact}
        start = pair.curvature(name, lowest[name])
        cut = self.sides[name].profile(pair.gears[name], curvature_radius, start)
        if self.growth is None:
            return cut
        return cut + self.growth.profile(pair, name, curvature_radius)

    def lead(self, pair: GearPair, face_position: Array) -> Array:
        """Depth of both gears together across the face, (slice,) m, at least 0."""
        width = pair.face_width
        gears = self.pinion.lead(face_position, width) + self.wheel.lead(
            face_position, width
        )
        lead = gears + self.misalignment * face_position / width
        return np.asarray(lead - min(float(lead.min()), 0.0))


PLAIN = PairModification(pinion=FlankModification(), wheel=FlankModification())


def sound_teeth(
    pair: GearPair, modification: PairModification = PLAIN
) -> Mapping[str, Tooth]:
    """The tooth of each spur gear before faults and errors, as cut or modified, by gear."""
    if modification.is_any:
        return _modified_teeth(pair, modification)
    return {side: healthy_tooth(gear) for side, gear in pair.gears.items()}


@lru_cache(maxsize=16)
def _modified_teeth(
    pair: GearPair, modification: PairModification
) -> Mapping[str, Tooth]:
    """Modified teeth by gear.

    Only the sum of both leads matters: all of it is put on the gear with the narrower face.
    """
    gears = pair.gears
    teeth = {name: healthy_tooth(gear) for name, gear in gears.items()}
    narrow = min(gears, key=lambda name: gears[name].face_width)
    edges = np.linspace(0.0, pair.face_width, N_SLICES + 1)
    lead = modification.lead(pair, 0.5 * (edges[1:] + edges[:-1]))
    for name, tooth in teeth.items():
        depth = modification.profile(pair, name, tooth.profile.curvature_radius)
        if name == narrow and lead.any():
            tooth, depth = tooth.split(edges), depth + lead[:, None]
        teeth[name] = tooth.with_deviation(depth)
    return teeth
