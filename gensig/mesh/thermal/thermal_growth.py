"""Thermal growth of gears and the flank deviations that it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import load_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class GearGrowth:
    """Strains of one gear: ``tooth`` of its teeth, ``body`` of its body at root circle and bore.

    A free hollow disc with any temperature over the radius has the same growth over radius at its
    rim and at its bore: expansion times the temperature's mean over the area (Timoshenko &
    Goodier, section 150; eq. (5) of the thermal paper at both ends).
    """

    tooth: float
    body: float

    def along_action(self, gear: Gear, curvature_radius: Array) -> Array:
        """Movement of the flank out of the tooth along the line of action, (point,) m.

        Parameters
        ----------
        curvature_radius : (point,) m

        The tooth's axis is at rest. The root circle moves out by ``body``, and the tooth on it
        grows by ``tooth`` in height and thickness. With equal strains the gear stays similar: the
        flank moves by strain x curvature radius, the involute of the grown base circle. Unequal
        strains also shift the tooth along its axis.
        """
        shift = gear.root_radius * (self.body - self.tooth)
        sine = np.sin(load_angle(gear, curvature_radius))
        return self.tooth * curvature_radius + shift * sine

    @property
    def of_tooth_alone(self) -> GearGrowth:
        """The growth of the teeth, their roots at rest."""
        return GearGrowth(tooth=self.tooth, body=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairGrowth:
    """Growth of both gears."""

    pinion: GearGrowth
    wheel: GearGrowth

    def strain(self, pair: GearPair) -> float:
        """The pair's common strain: that of both base pitches, weighted by the base radii."""
        radii = np.array([gear.base_radius for gear in pair.gears.values()])
        return float(np.array(self.pitch_strains(pair)) @ radii / radii.sum())

    def pitch_strains(self, pair: GearPair) -> tuple[float, float]:
        """Strain of either gear's base pitch, mean over the path of contact."""
        ends = np.array([0.0, pair.path_of_contact])
        pinion, wheel = self._movements(pair, ends)
        path = pair.path_of_contact
        return float(pinion[1] - pinion[0]) / path, float(wheel[0] - wheel[1]) / path

    def deviation(self, pair: GearPair, position: Array) -> Array:
        """Distance of both flanks behind those of the pair grown by its common strain, (node,) m.

        0 at the pitch point, negative where the flanks stand proud.

        Parameters
        ----------
        position : (node,) m    on the path of contact, from A; beyond it the nearest end counts

        A hotter pinion has the longer base pitch: the entering tooth pair is late.
        """
        on_path = np.clip(position, 0.0, pair.path_of_contact)
        points = np.append(on_path, pair.pitch_point)
        common = self.strain(pair) * pair.tangent_length
        proud = np.sum(self._movements(pair, points), axis=0) - common
        return proud[-1] - proud[:-1]

    def profile(self, pair: GearPair, name: str, curvature_radius: Array) -> Array:
        """Share of one gear's flank in ``deviation``, (point,) m.

        Parameters
        ----------
        name : side of the gear
        curvature_radius : (point,) m    beyond the path of contact its nearest end counts
        """
        ends = np.array([0.0, pair.path_of_contact, pair.pitch_point])
        radii = pair.curvature(name, ends)
        points = np.append(
            np.clip(curvature_radius, radii[:2].min(), radii[:2].max()), radii[2]
        )
        growth = {"pinion": self.pinion, "wheel": self.wheel}[name]
        moved = growth.along_action(pair.gears[name], points)
        proud = moved - self.strain(pair) * points
        return proud[-1] - proud[:-1]

    def closing(self, pair: GearPair, housing_strain: float) -> float:
        """Loss of backlash at the pitch point, along the line of action, m; negative for a gain."""
        proud = float(np.sum(self._movements(pair, np.array([pair.pitch_point]))))
        return 2.0 * (proud - housing_strain * pair.tangent_length)

    def teeth_alone(self, pair: GearPair) -> float:
        """Distance that growth of the teeth alone adds between the gears at the pitch point, m.

        It is measured along the line of action.
        """
        pinion, wheel = self.pinion.of_tooth_alone, self.wheel.of_tooth_alone
        teeth = PairGrowth(pinion=pinion, wheel=wheel)
        movements = teeth._movements(pair, np.array([pair.pitch_point]))
        return float(np.sum(movements))

    def _movements(self, pair: GearPair, position: Array) -> list[Array]:
        growths = zip(SIDES, (self.pinion, self.wheel), strict=True)
        return [
            growth.along_action(pair.gears[side], pair.curvature(side, position))
            for side, growth in growths
        ]
