"""One tooth: its outline, lost material, flank deviation and root cracks.

Faults change only these.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import ToothProfile, tooth_profile


@dataclass(frozen=True, slots=True, kw_only=True)
class RootCrack:
    """A crack into the root, straight in every strip across the face.

    ``depth`` (strip,) m holds the depth in strips of equal width, 0 where there is no crack. The
    mouth lies at ``mouth_abscissa`` and ``mouth_half_thickness`` of the outline; the outline's
    angle to the tooth centreline there is ``mouth_slope``. The crack runs inward and towards the
    root at ``angle`` to the centreline. ``side`` is ``"tension"`` (under the loaded flank) or
    ``"compression"``. The faces of a ``breathing`` crack bear on each other under compression;
    those of an open crack never touch.
    """

    depth: Array
    mouth_abscissa: float
    mouth_half_thickness: float
    mouth_slope: float
    angle: float
    side: str
    breathing: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Tooth:
    """A tooth on its outline, in slices across the face.

    ``slice_edges`` (slice + 1,) m from 0 to the face width. On the nodes of the involute, (slice,
    profile) m: ``material_loss`` is the removed depth, inf where the tooth is broken off;
    ``flank_deviation`` is the distance of the flank behind its nominal position, negative in front
    of it. ``present`` is False for a missing tooth.
    """

    profile: ToothProfile
    slice_edges: Array
    material_loss: Array
    flank_deviation: Array
    cracks: tuple[RootCrack, ...]
    present: bool

    @property
    def gear(self) -> Gear:
        """The gear this tooth belongs to."""
        return self.profile.gear

    @property
    def slice_width(self) -> Array:
        """Width of the slices, (slice,) m."""
        return np.diff(self.slice_edges)

    @property
    def slice_middle(self) -> Array:
        """Middle of the slices, (slice,) m from one end of the face."""
        return 0.5 * (self.slice_edges[1:] + self.slice_edges[:-1])

    @property
    def cell_abscissa(self) -> Array:
        """X of the cell centres, (cell,) m."""
        return 0.5 * (self.profile.abscissa[1:] + self.profile.abscissa[:-1])

    @property
    def cell_half_thickness(self) -> Array:
        """Half thickness of the sound outline at the cell centres, (cell,) m."""
        return 0.5 * (
            self.profile.half_thickness[1:] + self.profile.half_thickness[:-1]
        )

    @property
    def tip_curvature_radius(self) -> float:
        """Curvature radius up to which some of the flank is left, m."""
        left = np.isfinite(self.material_loss).any(axis=0)
        remaining = self.profile.curvature_radius[left]
        return float(max(remaining, default=self.profile.curvature_radius[0]))

    def split(self, edges: Array) -> Tooth:
        """This tooth with slices that also end at ``edges``, m."""
        inside = edges[(edges > 0.0) & (edges < self.slice_edges[-1])]
        merged = np.unique(np.concatenate([self.slice_edges, inside]))
        far = np.concatenate([[True], np.diff(merged) > 1e-9 * self.slice_edges[-1]])
        middle = 0.5 * (merged[far][1:] + merged[far][:-1])
        source = np.searchsorted(self.slice_edges, middle) - 1
        return replace(
            self,
            slice_edges=merged[far],
            material_loss=self.material_loss[source],
            flank_deviation=self.flank_deviation[source],
        )

    def with_loss(self, loss: Array) -> Tooth:
        """The tooth with at least ``loss`` removed, m, broadcast to (slice, profile)."""
        if not (loss > self.material_loss).any():
            return self
        return replace(self, material_loss=np.maximum(self.material_loss, loss))

    def with_deviation(self, deviation: Array) -> Tooth:
        """The tooth with a further flank ``deviation``, m, broadcast to (slice, profile)."""
        if not deviation.any():
            return self
        return replace(self, flank_deviation=self.flank_deviation + deviation)


@lru_cache(maxsize=16)
def healthy_tooth(gear: Gear, profile: ToothProfile | None = None) -> Tooth:
    """The tooth that the cutter makes: one slice over the full width, no loss, no deviation.

    Cached: equal calls return one object with read-only arrays.

    Parameters
    ----------
    profile : outline; None samples that of the gear
    """
    profile = profile or tooth_profile(gear)
    nothing = np.zeros((1, len(profile.curvature_radius)))
    edges = np.array([0.0, gear.face_width])
    outline = (profile.abscissa, profile.half_thickness, profile.curvature_radius)
    for array in (nothing, edges, *outline):
        array.flags.writeable = False
    return Tooth(
        profile=profile,
        slice_edges=edges,
        material_loss=nothing,
        flank_deviation=nothing,
        cracks=(),
        present=True,
    )
