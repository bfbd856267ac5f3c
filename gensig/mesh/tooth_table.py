"""Table of the teeth of a mesh: compliance and gap of every distinct pair by contact position."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gensig.arrays import Array, Flags, Integers
from gensig.geometry.contact import GearPair
from gensig.mesh.options import MeshOptions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GearTeeth:
    """Kinds of the teeth of a gear: ``kind`` (tooth,), ``present`` (kind,). Kind 0 is healthy."""

    kind: Integers
    present: Flags

    @property
    def healthy(self) -> GearTeeth:
        """The gear with healthy teeth alone."""
        return replace(self, kind=np.zeros_like(self.kind))

    @property
    def commonest(self) -> int:
        """The kind of most teeth."""
        return int(np.bincount(self.kind).argmax())


class TablePart(NamedTuple):
    """An addend of compliances in m/N and gaps in m, each with its slope over the position.

    (pinion kind, wheel kind, chord, node); one kind of a gear stands for all of its teeth.
    """

    compliance: Array
    compliance_slope: Array
    gap: Array
    gap_slope: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToothTable:
    """Springs of single pairs of teeth at positions s, tabulated for every distinct pair.

    The force of a pair is convex in its approach. It is tabulated as chords between fixed depths;
    spur teeth that are not sliced have one chord. Chord l of a single loaded pair is force =
    (approach - gap[l]) / compliance[l]. With other pairs in contact, force = (local - gap[l]) /
    (compliance[l] - shared_compliance), where local = approach - shared_compliance x total force.
    Chord l holds where local - gap[0] lies between depth[l] and depth[l + 1], the last chord also
    beyond. gap[0] is the first touch. Neighbouring chords meet at their common depth, so that the
    force is the largest of all chords.

    Between nodes slopes are linear, and values are their integral.

    Parameters
    ----------
    position : (node,) m      of the contact, of sliced teeth of the slice that enters first; at
        equal distances from ``first_pitch`` to ``last_pitch``
    first_pitch, last_pitch : whole base pitches; their difference is the pairs at once
    depth : (chord,) m        beginning with 0
    pinion, wheel : kinds of the teeth
    parts : whose sum is the table: one of each gear, or one of both
    shared_compliance : m/N   body compliance that all pairs in contact share
    set_chord : chord of the mean load at the set torque, for uses that need one spring
    """

    pair: GearPair
    options: MeshOptions
    position: Array
    first_pitch: int
    last_pitch: int
    depth: Array
    pinion: GearTeeth
    wheel: GearTeeth
    parts: tuple[TablePart, ...]
    shared_compliance: float
    set_chord: int = 0

    @property
    def n_pairs(self) -> int:
        """Pairs of teeth that are looked at together."""
        return self.last_pitch - self.first_pitch

    @property
    def nodes_per_pitch(self) -> int:
        """Cells between the nodes of a base pitch."""
        return (len(self.position) - 1) // self.n_pairs

    @property
    def is_separable(self) -> bool:
        """True where a pair is the sum of what its two teeth have by themselves."""
        return len(self.parts) > 1

    @property
    def half_lag(self) -> float:
        """Position of the slice that enters first less that of the middle of the face, m.

        0 for spur teeth. Quantities that grow with the contact's position (tilts of single teeth,
        sliding) grow with position - half_lag.
        """
        return 0.5 * self.pair.face_width * math.tan(self.pair.base_helix_angle)

    @property
    def present(self) -> Flags:
        """True for pairs of teeth neither of which is missing, (pinion kind, wheel kind)."""
        return self.pinion.present[:, None] & self.wheel.present[None, :]

    @property
    def healthy(self) -> ToothTable:
        """The table of a mesh of healthy teeth alone."""
        pinion, wheel = self.pinion.healthy, self.wheel.healthy
        return replace(self, pinion=pinion, wheel=wheel)

    @property
    def first_touch(self) -> Array:
        """The least gap of all pairs of teeth that are present, (node,) m."""
        touch = np.zeros(len(self.position))
        for part in self.parts:
            # kind 0, which stands for all teeth, is healthy
            n_pinion, n_wheel = part.gap.shape[:2]
            is_there = self.present[:n_pinion, :n_wheel]
            touch += part.gap[is_there][:, 0].min(axis=0)
        return touch

    @property
    def pairs(self) -> TablePart:
        """The sum of the parts: compliances and gaps of all pairs of kinds."""
        return TablePart._make(sum(column) for column in zip(*self.parts, strict=True))


def left_out_energy(table: ToothTable) -> tuple[Array, Array]:
    """Energy that every chord's spring omits, J, and its slope, N.

    Both are (pinion kind, wheel kind, chord, node). At the depth D_l where chord l begins, a pair
    holds the work of its force up to there. The springs of the two chords that meet there hold
    0.5 F (D - gap) of it with their own gaps; F is their common force. The difference to the
    chord before is therefore 0.5 F (gap_l - gap_(l - 1)).
    """
    compliance, compliance_slope, gap, gap_slope = table.pairs
    compliance = compliance - table.shared_compliance
    value, slope = np.zeros_like(gap), np.zeros_like(gap)
    for chord in range(1, len(table.depth)):
        here, before = np.s_[:, :, chord], np.s_[:, :, chord - 1]
        deflection = gap[:, :, 0] + table.depth[chord] - gap[here]
        deflection_slope = gap_slope[:, :, 0] - gap_slope[here]
        force = deflection / compliance[here]
        change = deflection_slope - force * compliance_slope[here]
        force_slope = change / compliance[here]
        step = gap[here] - gap[before]
        step_slope = gap_slope[here] - gap_slope[before]
        value[here] = value[before] + 0.5 * force * step
        work_slope = force_slope * step + force * step_slope
        slope[here] = slope[before] + 0.5 * work_slope
    return value, slope
