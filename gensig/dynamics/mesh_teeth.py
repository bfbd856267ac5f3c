"""The teeth of two gears in mesh, as every machine has them: tables, errors, and their start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import GearPair
from gensig.mesh.load_distribution import (
    Meeting,
    PairStates,
    StaticMesh,
    pair_states,
    static_mesh,
)
from gensig.mesh.tooth_table import GearTeeth, ToothTable

PER_PITCH = 32  # phases of a base pitch over which the stiffness is averaged
# over a turn of the wheel, at which static loads give the mean friction: a prime, so that the rolls
# sample each tooth at other positions than the last. Another number changes the level of a record
# by up to 0.3 %, and no longer makes the frozen benchmark
FRICTION_POSITIONS = 509
OfGears = tuple[Array, Array]  # of the pinion and the wheel, (tooth,) each


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshTeeth:
    """The teeth of a mesh, of a pinion that drives a wheel.

    Parameters
    ----------
    errors : m    by which the gaps of the teeth are open at the pitch point
    tilts : m/m   growth of these gaps along the path
    start_teeth : teeth of pinion and wheel that meet in pair 0
    start_phase : pitches that pair 0 is past A at time 0; of helical teeth its first slice
    """

    table: ToothTable
    errors: OfGears
    tilts: OfGears
    start_teeth: tuple[int, int] = (0, 0)
    start_phase: float = 0.0

    @classmethod
    def perfect(cls, table: ToothTable, **start: Any) -> Self:
        """Teeth without errors, whose tables may have faults."""
        pinion, wheel = (np.zeros(gear.n_teeth) for gear in table.pair.gears.values())
        return cls(table=table, errors=(pinion, wheel), tilts=(pinion, wheel), **start)

    @property
    def pair(self) -> GearPair:
        """The two gears."""
        return self.table.pair

    @property
    def start_roll(self) -> float:
        """Roll along the line of action at time 0, the first recorded sample, m."""
        return self.start_phase * self.pair.base_pitch

    def mean_stiffness(self, force: float) -> float:
        """Mean tangent stiffness of healthy teeth over a base pitch under a force in N, N/m."""
        return mean_mesh_stiffness(self.table, force)

    def friction_torque(self, force: float) -> float:
        """Mean friction torque under a normal force in N, reduced to the pinion, N m.

        From the static loads over one turn of the wheel.
        """
        pair = self.pair
        shares = (np.arange(FRICTION_POSITIONS) + 0.5) / FRICTION_POSITIONS
        states = self.states(pair.base_pitch * pair.wheel.n_teeth * shares)
        load = self.static(states, force).load
        lost = (load * loss_arm(self.table, states.position)).sum(axis=1)
        return self.table.options.friction_coefficient * float(np.mean(lost))

    def states(self, roll: Array) -> PairStates:
        """Pairs of teeth at rolls of the pinion in m, (phase,)."""
        return pair_states(self.table, roll, self.meeting)

    def static(self, states: PairStates, force: float) -> StaticMesh:
        """Equilibrium of pairs of teeth under a normal force in N."""
        return static_mesh(self.table, states, force)

    @property
    def healthy(self) -> MeshTeeth:
        """Teeth without faults and errors in their place, as the back flanks are taken."""
        return MeshTeeth.perfect(self.table.healthy)

    def mirrored(self, roll: Array) -> Array:
        """Rolls of the back flanks where the drive flanks have rolled so far, m."""
        middle = self.pair.pitch_point + self.table.half_lag
        return np.asarray(2.0 * middle + 0.5 * self.pair.base_pitch - roll)

    @property
    def nearest_gaps(self) -> Array:
        """No less than these are the gaps of any pair of teeth, with their errors, (node,) m."""
        table = self.table
        beyond = table.position - table.pair.pitch_point - table.half_lag
        nearest = table.first_touch
        for error, tilt in zip(self.errors, self.tilts, strict=True):
            tilted = np.minimum(tilt.min() * beyond, tilt.max() * beyond)
            nearest = nearest + error.min() + tilted
        return nearest

    @property
    def meeting(self) -> Meeting:
        """Start teeth and errors, for statics."""
        return Meeting(
            start_teeth=self.start_teeth, errors=self.errors, tilts=self.tilts
        )


def loss_arm(table: ToothTable, position: Array) -> Array:
    """Moment of unit friction on pairs at positions s, reduced to the pinion, m.

    The shape is that of ``position``. Sliding turns at the pitch point. The contact of helical
    teeth spans a part of the path, and the mean over the face turns as gently as in the compiled
    core.
    """
    pair, lag = table.pair, table.half_lag
    middle = position - lag
    arm = pair.start_curvature_radius + np.clip(middle, 0.0, pair.path_of_contact)
    sliding = np.sign(middle - pair.pitch_point)
    if lag > 0.0:
        width = table.options.friction_transition * pair.base_pitch + 2.0 * lag
        part = np.clip(2.0 * (middle - pair.pitch_point) / width, -1.0, 1.0)
        sliding = part * (1.5 - 0.5 * part**2)
    return np.asarray(sliding * (arm - (pair.tangent_length - arm) / pair.ratio))


def mean_mesh_stiffness(table: ToothTable, force: float) -> float:
    """Mean tangent stiffness over a base pitch under a force in N, N/m.

    Of the kind of most teeth, the healthy ones. Where no kind has a majority, the median over the
    teeth.
    """
    pinion, wheel = _of_one_kind(table.pinion), _of_one_kind(table.wheel)
    n_pitches = table.pair.pinion.n_teeth
    if pinion is not None and wheel is not None:
        n_pitches = 1
        table = replace(table, pinion=pinion, wheel=wheel)
    roll = table.pair.base_pitch * (np.arange(n_pitches * PER_PITCH) + 0.5) / PER_PITCH
    static = static_mesh(table, pair_states(table, roll), force)
    by_pitch = static.stiffness.reshape(-1, PER_PITCH)
    return float(np.median(by_pitch, axis=0).mean())


def _of_one_kind(teeth: GearTeeth) -> GearTeeth | None:
    """A gear all of whose teeth are of the kind of most; None without a majority."""
    if np.count_nonzero(teeth.kind == teeth.commonest) <= len(teeth.kind) // 2:
        return None
    return replace(teeth, kind=np.full_like(teeth.kind, teeth.commonest))
