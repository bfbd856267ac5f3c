"""How hot gears grow, and what that does to their flanks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import load_angle

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class GearGrowth:
    """Strains of one gear: ``tooth`` of its teeth, ``body`` of its body at the root circle and at
    the bore.

    A free hollow disc with any temperature over the radius has the same growth over radius at its
    rim and at its bore: expansion times the temperature's mean over the area (Timoshenko &
    Goodier, section 150; eq. (5) of the thermal paper at both ends).
    """

    tooth: float
    body: float

    def along_action(self, gear: Gear, curvature_radius: Array) -> Array:
        """How far the flank moves out of the tooth along the line of action, (point,) m, the
        tooth's axis at rest.

        Parameters
        ----------
        curvature_radius : (point,) m

        The root circle moves out by ``body``, and the tooth grows on it by ``tooth`` in height
        and thickness. Both alike, the gear stays similar: the flank moves by strain x curvature
        radius, which is the involute of the grown base circle. Otherwise the tooth is shifted
        along its axis besides.
        """
        shifted = (
            gear.root_radius
            * (self.body - self.tooth)
            * np.sin(load_angle(gear, curvature_radius))
        )
        return self.tooth * curvature_radius + shifted

    def of_tooth_alone(self, gear: Gear, curvature_radius: Array) -> Array:
        """The same for the tooth's own growth, its root at rest, (point,) m."""
        return GearGrowth(tooth=self.tooth, body=0.0).along_action(
            gear, curvature_radius
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PairGrowth:
    """Growth of both gears."""

    pinion: GearGrowth
    wheel: GearGrowth

    def strain(self, pair: GearPair) -> float:
        """The pair's common strain.

        That of both base pitches, weighted as the sum of the base radii is.
        """
        radii = np.array([pair.pinion.base_radius, pair.wheel.base_radius])
        return float(np.array(self.pitch_strains(pair)) @ radii / radii.sum())

    def pitch_strains(self, pair: GearPair) -> tuple[float, float]:
        """Strain of either gear's base pitch, mean over the path of contact."""
        ends = np.array([0.0, pair.path_of_contact])
        pinion, wheel = self._movements(pair, ends)
        path = pair.path_of_contact
        return float(pinion[1] - pinion[0]) / path, float(wheel[0] - wheel[1]) / path

    def deviation(self, pair: GearPair, position: Array) -> Array:
        """How far both flanks stand back of those of the pair grown by its common strain, (node,)
        m; 0 at the pitch point, and less where they stand proud.

        Parameters
        ----------
        position : (node,) m    on the path of contact, from A; beyond it the nearest end counts

        A hotter pinion has the longer base pitch: the pair that enters is late.
        """
        on_path = np.append(
            np.clip(position, 0.0, pair.path_of_contact), pair.pitch_point
        )
        common = self.strain(pair) * pair.tangent_length
        proud = np.sum(self._movements(pair, on_path), axis=0) - common
        return proud[-1] - proud[:-1]

    def closing(self, pair: GearPair, housing_strain: float) -> float:
        """Backlash that growth takes at the pitch point, along the line of action, m.

        Negative where it gives some.
        """
        proud = float(np.sum(self._movements(pair, np.array([pair.pitch_point]))))
        return 2.0 * (proud - housing_strain * pair.tangent_length)

    def teeth_alone(self, pair: GearPair) -> float:
        """How far the teeth's own growth moves the gears apart at the pitch point, along the line
        of action, m.
        """
        at = np.array([pair.pitch_point])
        return float(
            self.pinion.of_tooth_alone(
                pair.pinion, np.asarray(pair.pinion_curvature(at))
            )[0]
            + self.wheel.of_tooth_alone(
                pair.wheel, np.asarray(pair.wheel_curvature(at))
            )[0]
        )

    def _movements(self, pair: GearPair, position: Array) -> tuple[Array, Array]:
        return (
            self.pinion.along_action(
                pair.pinion, np.asarray(pair.pinion_curvature(position))
            ),
            self.wheel.along_action(
                pair.wheel, np.asarray(pair.wheel_curvature(position))
            ),
        )
