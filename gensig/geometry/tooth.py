"""One tooth as the mesh sees it: sections that carry, a flank that touches. Faults change these and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import ToothProfile, tooth_profile

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tooth:
    """A tooth on its outline.

    ``area`` (cell,) m2 and ``second_moment`` (cell,) m4 belong to the cells of the outline, root to tip;
    ``contact_width`` (profile,) m and ``flank_deviation`` (slice, profile) m of material removed to the nodes of
    the involute; ``present`` is False for a missing tooth.
    """

    profile: ToothProfile
    area: Array
    second_moment: Array
    contact_width: Array
    flank_deviation: Array
    present: bool

    @property
    def gear(self) -> Gear:
        """The gear this tooth belongs to."""
        return self.profile.gear

    @property
    def cell_abscissa(self) -> Array:
        """X of the cell centres, (cell,) m."""
        return 0.5 * (self.profile.abscissa[1:] + self.profile.abscissa[:-1])

    @property
    def cell_half_thickness(self) -> Array:
        """Half thickness of the sound outline at the cell centres, (cell,) m."""
        return 0.5 * (self.profile.half_thickness[1:] + self.profile.half_thickness[:-1])


def healthy_tooth(gear: Gear, profile: ToothProfile | None = None) -> Tooth:
    """The tooth that the cutter makes: full sections, full width, no deviation."""
    outline = tooth_profile(gear) if profile is None else profile
    thickness = outline.half_thickness[1:] + outline.half_thickness[:-1]
    n_nodes = len(outline.curvature_radius)
    return Tooth(
        profile=outline,
        area=thickness * gear.face_width,
        second_moment=thickness**3 * gear.face_width / 12.0,
        contact_width=np.full(n_nodes, gear.face_width),
        flank_deviation=np.zeros((1, n_nodes)),
        present=True,
    )
