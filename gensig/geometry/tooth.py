"""One tooth as the mesh sees it.

What of it is left, where its flank stands. Faults change these and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import ToothProfile, tooth_profile

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RootCrack:
    """A crack into the root, straight in every strip across the face.

    ``depth`` (strip,) m in strips of equal width, 0 where there is none; the mouth lies at
    ``mouth_abscissa`` and ``mouth_half_thickness`` of the outline, which makes ``mouth_slope``
    with the tooth centreline there; the crack goes at ``angle`` to the centreline, inward and
    towards the root. ``side`` is ``"tension"`` (under the loaded flank) or ``"compression"``; the
    faces of a ``breathing`` crack bear on each other when pressed together, those of an open one
    never touch.
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
    profile) m: ``material_loss`` has been removed (inf where the tooth is broken off: nothing is
    left up to its centreline and beyond), ``flank_deviation`` is how far the flank stands back
    from its nominal place (negative: proud of it). ``present`` is False for a missing tooth.
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
        left = np.flatnonzero(np.isfinite(self.material_loss).any(axis=0))
        return float(self.profile.curvature_radius[left[-1] if len(left) else 0])

    def split(self, edges: Array) -> Tooth:
        """The same tooth with slices that also end at ``edges``, m."""
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
        """The tooth with at least ``loss`` removed, (slice, profile) or what broadcasts to it, m."""
        return replace(self, material_loss=np.maximum(self.material_loss, loss))

    def with_deviation(self, deviation: Array) -> Tooth:
        """The tooth with ``deviation`` added to that of its flank, (slice, profile) or what
        broadcasts to it, m.
        """
        return replace(self, flank_deviation=self.flank_deviation + deviation)


def healthy_tooth(gear: Gear, profile: ToothProfile | None = None) -> Tooth:
    """The tooth that the cutter makes: one slice over the full width, nothing lost, no deviation.

    Without an outline of its own, the one sound tooth of the gear, shared by all who ask: its
    arrays are read-only.
    """
    return _sound_tooth(gear) if profile is None else _tooth_on(profile)


@lru_cache(maxsize=16)
def _sound_tooth(gear: Gear) -> Tooth:
    return _tooth_on(tooth_profile(gear))


def _tooth_on(profile: ToothProfile) -> Tooth:
    nothing = np.zeros((1, len(profile.curvature_radius)))
    edges = np.array([0.0, profile.gear.face_width])
    for array in (
        nothing,
        edges,
        profile.abscissa,
        profile.half_thickness,
        profile.curvature_radius,
    ):
        array.flags.writeable = False
    return Tooth(
        profile=profile,
        slice_edges=edges,
        material_loss=nothing,
        flank_deviation=nothing,
        cracks=(),
        present=True,
    )
