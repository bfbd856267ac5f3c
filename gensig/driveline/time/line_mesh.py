"""A gear mesh of a shaft line as plain arrays.

Pairs of teeth over the roll, on both flanks, tooth by tooth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.time.mesh_friction import MeshFriction
from gensig.errors import ConfigError, GeometryError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineMesh:
    """One mesh of gear a with gear b, one-sided on both flanks.

    The mesh has rolled u pitches: ``start_phase`` where all angles are 0, and one more for each
    tooth of gear a that its degree of freedom ``roll_dof`` turns on. Pair i stands at u - i
    pitches, in tables that begin at ``first_pitch`` and reach over ``n_pairs`` pitches, so that
    as many pairs are looked at; its teeth are ``start_teeth`` + i, counted as they enter. The
    back flanks meet along the mirrored roll ``mirror`` - u.

    direction : (dof,)                 gradient of the approach along the transverse line of
        action, m/rad or 1
    gap : (row, node)                  of one pair in m; a smooth cubic between nodes
    depth : (spring,)                  m, how deep a pair bites where each of its springs begins
        to bear; from 0 on
    stiffness : (row * spring, node)   of each spring in N/m, those of one row after those of
        the one before
    rows, coast_rows : (kind, kind)    the row of a pair of kinds of teeth of a and b on either
                                       flank, -1 for a pair that never touches (a missing tooth)
    kinds : (tooth,) of a and of b     the kind of every tooth
    errors : (tooth,) of a and of b    m, open the gaps of their teeth on the drive flank
    tilts : (tooth,) of a and of b     m a pitch, by which these gaps grow as a pair rolls on
    upright : pitches                  where a pair stands as its tilts add nothing
    backlash : m                       along the line of action
    damping : s/m                      times the rate of a pair is the share by which it raises
        its elastic force
    shared_compliance : m/N            what all pairs in contact share
    friction : of the drive flanks; None for a mesh that slides freely
    """

    name: str
    direction: Array
    roll_dof: int
    stiffness: Array
    gap: Array
    rows: Index
    coast_rows: Index
    kinds: tuple[Index, Index]
    errors: tuple[Array, Array]
    tilts: tuple[Array, Array]
    upright: float
    n_pairs: int
    first_pitch: int
    start_teeth: tuple[int, int]
    start_phase: float
    mirror: float
    backlash: float
    damping: float
    shared_compliance: float = 0.0
    depth: Array = field(default_factory=lambda: np.zeros(1))
    friction: MeshFriction | None = None

    def __post_init__(self) -> None:
        self._check_tables()
        self._check_teeth()
        for key in ("backlash", "damping", "shared_compliance"):
            if not 0.0 <= getattr(self, key) < math.inf:
                raise self._error(f"{key} {getattr(self, key):g} must not be negative")

    def _error(self, message: str) -> ConfigError:
        return ConfigError(f"mesh '{self.name}': {message}")

    def _check_tables(self) -> None:
        """Raise for springs, stiffnesses and gaps that make no table."""
        n_springs = len(self.depth)
        grows = np.all(np.diff(self.depth) > 0.0)
        if not n_springs or self.depth[0] != 0.0 or not grows:
            raise self._error(f"depth {self.depth} must begin at 0 and grow")
        expected = len(self.gap) * n_springs, *self.gap.shape[1:]
        if self.stiffness.ndim != 2 or self.stiffness.shape != expected:
            raise self._error(
                f"stiffness {self.stiffness.shape} and gap {self.gap.shape} must be "
                f"alike, (row, node), with {n_springs} springs a row"
            )
        n_nodes = self.gap.shape[1]
        if self.n_pairs < 1 or n_nodes < 2 or (n_nodes - 1) % self.n_pairs:
            raise self._error(
                f"{n_nodes} nodes over {self.n_pairs} pitches; give a whole number of "
                "cells a pitch and one node more"
            )
        for values, what in ((self.stiffness, "stiffness"), (self.gap, "gap")):
            if not np.isfinite(values).all():
                raise self._error(
                    f"{what} is not finite; a pair that never touches is row -1"
                )
        if self.stiffness.min() < 0.0:
            raise self._error(
                f"stiffness {self.stiffness.min():g} N/m must not be negative"
            )

    def _check_teeth(self) -> None:
        """Raise for kinds, errors, tilts and start teeth that do not fit the tables."""
        counts = tuple(int(kind.max()) + 1 for kind in self.kinds)
        last = len(self.gap) - 1
        for rows, what in ((self.rows, "rows"), (self.coast_rows, "coast_rows")):
            is_small = rows.shape[0] < counts[0] or rows.shape[1] < counts[1]
            if is_small or rows.min() < -1 or rows.max() > last:
                raise self._error(
                    f"{what} {rows.shape} must name rows -1..{last} for {counts} kinds"
                )
        if not math.isfinite(self.upright):
            raise self._error(f"upright {self.upright:g} must be finite")
        teeth = zip(self.kinds, self.errors, self.tilts, self.start_teeth, strict=True)
        for kind, error, tilt, start in teeth:
            n = len(kind)
            for values, what in ((error, "errors"), (tilt, "tilts")):
                if n != len(values) or kind.min() < 0 or not np.isfinite(values).all():
                    raise self._error(
                        f"{n} teeth need as many kinds, and finite {what}, not {len(values)}"
                    )
            if not 0 <= start < n:
                raise self._error(f"start tooth {start} must lie in 0..{n - 1}")

    @property
    def least_gap(self) -> float:
        """No less than this is the gap of any pair on the drive flank at a node, m."""
        n_cells = self.gap.shape[1] - 1
        rolled = np.arange(n_cells + 1) * (self.n_pairs / n_cells)
        beyond = self.first_pitch + rolled - self.upright
        least = self.gap.min(axis=0)
        for error, tilt in zip(self.errors, self.tilts, strict=True):
            turned = np.minimum(tilt.min() * beyond, tilt.max() * beyond)
            least = least + error.min() + turned
        return float(least.min())

    @property
    def n_teeth(self) -> tuple[int, int]:
        """Teeth of gears a and b."""
        return len(self.kinds[0]), len(self.kinds[1])


def even_mesh(
    name: str,
    *,
    direction: Array,
    roll_dof: int,
    n_teeth: tuple[int, int],
    stiffness: float,
    backlash: float,
    damping: float,
    start_phase: float,
    mirror: float,
) -> LineMesh:
    """A mesh of one stiffness in N/m wherever it has rolled, whose teeth are all alike."""
    row = np.zeros((1, 1), dtype=np.int64)
    perfect = np.zeros(n_teeth[0]), np.zeros(n_teeth[1])
    return LineMesh(
        name=name,
        direction=direction,
        roll_dof=roll_dof,
        stiffness=np.full((1, 2), stiffness),
        gap=np.zeros((1, 2)),
        rows=row,
        coast_rows=row,
        kinds=(perfect[0].astype(np.int64), perfect[1].astype(np.int64)),
        errors=perfect,
        tilts=perfect,
        upright=0.0,
        n_pairs=1,
        first_pitch=0,
        start_teeth=(0, 0),
        start_phase=start_phase,
        mirror=mirror,
        backlash=backlash,
        damping=damping,
    )


def mesh_start(
    n_teeth: int,
    *,
    mate_angle: float,
    drives: bool,
    tooth_angle: float = 0.0,
    pitch_point: float = 0.0,
) -> tuple[int, float]:
    """Start tooth and start phase of a gear's mesh with a mate at an angle, so that its meshes
    agree with each other.

    Parameters
    ----------
    mate_angle : rad    from the gear's center to the mate's, counted in the sense in which the
        gear turns
    drives : whether the gear drives there (its leading flanks touch) or is driven (its trailing
        flanks)
    tooth_angle : rad   where the middle of the gear's tooth 0 stands when all angles are 0
    pitch_point : position of the pitch point in the tables of the mesh, pitches

    Returns
    -------
    the tooth of pair 0, and the phase in pitches

    Tooth 0's middle passes the mate at mate_angle, its flank a quarter pitch before (leading) or
    behind (trailing); the tooth that enters next stands one pitch back. Standard teeth: tooth and
    space are equal on the pitch circle. Source: the phases of Parker & Lin, Mesh Phasing
    Relationships in Planetary and Epicyclic Gears (ASME DETC2003/PTG-48067), written for one
    gear.
    """
    if n_teeth < 1:
        raise GeometryError(f"a gear of {n_teeth} teeth has no phase")
    passed = (
        (tooth_angle - mate_angle) * n_teeth / (2.0 * math.pi)
        + _quarter(drives)
        + pitch_point
    )
    pair = math.floor(passed)
    # the phase is taken within a pitch, so what was pair ``pair`` becomes pair 0
    return pair % n_teeth, passed - pair


def tooth_angle(
    n_teeth: int,
    *,
    mate_angle: float,
    drives: bool,
    start: tuple[int, float],
    pitch_point: float = 0.0,
) -> float:
    """Angle of the middle of a gear's tooth 0 if one of its meshes begins at ``start``, rad.

    The inverse of ``mesh_start``, for the other meshes of a gear whose phase in one is known.
    """
    tooth, phase = start
    return (
        mate_angle
        + (tooth + phase - _quarter(drives) - pitch_point) * 2.0 * math.pi / n_teeth
    )


def _quarter(drives: bool) -> float:
    """Lead of the flank that touches over the middle of its tooth, pitches."""
    return 0.5 * drives - 0.25
