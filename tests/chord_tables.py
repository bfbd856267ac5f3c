"""Tables of chords made by hand: a spur pair's own in other clothes, and slices that touch one
after the other.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gensig.dynamics.pair import Body, RunningPair
from gensig.geometry.contact import GearPair
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.pair_table import FIRST_PITCH, LAST_PITCH
from gensig.mesh.smooth_table import smooth
from gensig.mesh.tooth_table import TablePart, ToothTable

FARTHEST = 1e-3  # m, gap of a pair that is nowhere near


def as_chords(table: ToothTable, n_chords: int = 1) -> ToothTable:
    """A spur pair's table as chords that are all alike."""

    columns = (np.repeat(column, n_chords, axis=2) for column in table.pairs)
    return replace(
        table,
        depth=5e-6 * np.arange(n_chords),
        parts=(TablePart._make(columns),),
        set_chord=n_chords - 1,
    )


def repeated(part: TablePart, n_kinds: int) -> TablePart:
    """A part whose kinds of pinion teeth come ``n_kinds`` times, one after the other."""
    return TablePart._make(np.concatenate(n_kinds * [column]) for column in part)


def helical_pair(pair: GearPair, helix_angle: float) -> GearPair:
    """The spur pair's racks on a helix, positive: a right-handed pinion."""
    return replace(
        pair,
        pinion=replace(pair.pinion, helix_angle=helix_angle),
        wheel=replace(pair.wheel, helix_angle=-helix_angle),
    )


class Slices:
    """Independent slices with crowned flanks, each as soft as its share of a spur pair: forces
    without any table.
    """

    def __init__(
        self, system, helix_angle: float, n_slices: int = 24, crowning: float = 8e-6
    ) -> None:
        self.pair, self.force = (
            helical_pair(system.pair, helix_angle),
            system.mesh_force,
        )
        self.spur = loaded_pair_table(
            self.pair, system.material, system.mesh, force=self.force
        )
        across = (np.arange(n_slices) + 0.5) / n_slices
        self.lag = across * self.pair.face_width * math.tan(self.pair.base_helix_angle)
        self.crowned, self.shared = (
            crowning * (2.0 * across - 1.0) ** 2,
            self.spur.shared_compliance,
        )
        own = self.spur.pairs.compliance[0, 0, 0] - self.shared
        self.own, self.gap = (
            own * n_slices,
            self.spur.pairs.gap[0, 0, 0],
        )

    def at(self, position):
        """Compliance and gap of every slice of pairs at positions s of the first, (..., slice)."""
        place = np.asarray(position)[..., None] - self.lag
        gap = np.interp(
            place, self.spur.position, self.gap, left=FARTHEST, right=FARTHEST
        )
        return np.interp(place, self.spur.position, self.own), gap + self.crowned

    def force_at(self, position, within):
        """Force of pairs under an approach less the shared deflection, N."""
        own, gap = self.at(position)
        return (np.maximum(np.asarray(within)[..., None] - gap, 0.0) / own).sum(axis=-1)

    @property
    def last_pitch(self) -> int:
        return LAST_PITCH + math.ceil(self.lag[-1] / self.pair.base_pitch)

    def table(self, depth) -> ToothTable:
        """Chords between depths (chord,) m, the last of which goes on as from there to once and a
        half as deep.
        """
        per_pitch, pitch = self.spur.options.points_per_pitch, self.pair.base_pitch
        position = (
            pitch
            / per_pitch
            * np.arange(FIRST_PITCH * per_pitch, self.last_pitch * per_pitch + 1)
        )
        first = np.minimum(self.at(position)[1].min(axis=-1), FARTHEST)
        knots = np.append(depth, 1.5 * depth[-1] if len(depth) > 1 else 2e-5)
        forces = np.array([self.force_at(position, first + knot) for knot in knots])
        own = np.diff(knots)[:, None] / np.maximum(np.diff(forces, axis=0), 1e-6)
        gap = first + knots[:-1, None] - forces[:-1] * own
        columns = (
            *smooth(own + self.shared, pitch / per_pitch, np.inf),
            *smooth(gap, pitch / per_pitch, np.inf),
        )
        return ToothTable(
            pair=self.pair,
            options=self.spur.options,
            position=position,
            first_pitch=FIRST_PITCH,
            last_pitch=self.last_pitch,
            depth=np.asarray(depth),
            pinion=self.spur.pinion,
            wheel=self.spur.wheel,
            parts=(TablePart._make(column[None, None] for column in columns),),
            shared_compliance=self.shared,
            set_chord=len(depth) - 1,
        )


def on_axial_supports(
    body: Body, stiffness_z=2e8, stiffness_tilt=1e5, damping_ratio=0.03
) -> Body:
    """A gear that is held along its axis and against tilting too."""
    tilt_inertia = 0.6 * body.inertia
    support = replace(
        body.support,
        stiffness_z=stiffness_z,
        damping_z=2.0 * damping_ratio * math.sqrt(stiffness_z * body.mass),
        stiffness_tilt=stiffness_tilt,
        damping_tilt=2.0 * damping_ratio * math.sqrt(stiffness_tilt * tilt_inertia),
    )
    return replace(body, support=support, tilt_inertia=tilt_inertia)


def with_table(running: RunningPair, table: ToothTable) -> RunningPair:
    """The same machine on another table, its gears held along their axes."""
    return replace(
        running,
        teeth=replace(running.teeth, table=table),
        pinion=on_axial_supports(running.pinion),
        wheel=on_axial_supports(running.wheel),
    )
