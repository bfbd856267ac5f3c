"""Force over (phase, approach) of one pair of helical teeth, for every distinct pair of teeth, as the dynamics asks it.

The force of a pair in slices is convex in the approach: the deeper it bites, the more slices bear. It is kept as chords
between fixed depths of bite, so that each is a compliance and a gap like that of a spur pair, and the law of the mesh
is one for both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.mesh.options import MeshOptions

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlicedTable:
    """Chords of the force of single pairs at positions s of the slice that enters first.

    Chord l of a pair is force = (approach - gap[l]) / compliance[l] and holds where approach - gap[0] lies between
    depth[l] and depth[l + 1], the last one beyond; gap[0] is where the pair touches first. Neighbours meet at their
    common depth.

    Parameters
    ----------
    position : (node,) m      equally spaced, ``points_per_pitch`` a base pitch, from ``first_pitch`` to ``last_pitch``
    first_pitch, last_pitch : whole base pitches; pairs followed at once are last_pitch - first_pitch
    depth : (chord,) m        from 0 on
    compliance, compliance_slope, gap, gap_slope : (pinion kind, wheel kind, chord, node) m/N, 1/N, m, 1
    pinion_kind, wheel_kind : (tooth,)    which kind every tooth is; 0 is sound
    pinion_present, wheel_present : (kind,)
    shared_compliance : m/N   of the bodies, that all pairs share
    set_chord : chord of the set torque's mean load, for what asks for one spring
    """

    pair: GearPair
    options: MeshOptions
    position: Array
    first_pitch: int
    last_pitch: int
    depth: Array
    compliance: Array
    compliance_slope: Array
    gap: Array
    gap_slope: Array
    pinion_kind: NDArray[np.int64]
    wheel_kind: NDArray[np.int64]
    pinion_present: NDArray[np.bool_]
    wheel_present: NDArray[np.bool_]
    shared_compliance: float
    set_chord: int
