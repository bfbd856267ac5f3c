"""Contact geometry of a gear pair: line of action, contact ratio, corner contact off the path.

Positions s are measured in m along the line of action from A, the start of contact of the driving
pinion; the pinion's curvature radius there is ``start_curvature_radius + s``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from gensig.arrays import Array
from gensig.errors import GeometryError
from gensig.geometry.gear import Gear
from gensig.geometry.involute import inverse_involute, involute

Position = TypeVar("Position", float, Array)

SIDES = ("pinion", "wheel")  # the two gears of a pair, the driving one first


@dataclass(frozen=True, kw_only=True)
class GearPair:
    """A pinion and the wheel that it drives, in the transverse section.

    No slots: what follows from the fields is kept.

    Without ``center_distance_change`` the centre distance is the one that meshes without play.
    ``backlash`` is the play along the line of action that is left to the coast flank, m.
    ``center_distance_change`` is added to the distance without play, m. A negative value brings
    the shafts closer and takes backlash.
    """

    pinion: Gear
    wheel: Gear
    backlash: float
    center_distance_change: float = 0.0

    def __post_init__(self) -> None:
        for key in ("normal_module", "pressure_angle"):
            if getattr(self.pinion, key) != getattr(self.wheel, key):
                raise GeometryError(
                    f"pinion and wheel cannot mesh: their {key} differs"
                )
        if self.pinion.helix_angle != -self.wheel.helix_angle:
            raise GeometryError(
                "pinion and wheel cannot mesh on parallel shafts: helix_angle_deg = "
                f"{math.degrees(self.pinion.helix_angle):g} and "
                f"{math.degrees(self.wheel.helix_angle):g} must be equal and of opposite hand "
                "(sign)"
            )
        if self.backlash < 0.0:
            raise GeometryError(
                f"gear.backlash_um = {self.backlash * 1e6:g} must not be negative"
            )
        if self.path_of_contact <= 0.0:
            raise GeometryError(
                "pinion and wheel never touch on the line of action; check teeth and profile shifts"
            )
        for gear, lowest in (
            (self.pinion, self.start_curvature_radius),
            (self.wheel, self.wheel_curvature(self.path_of_contact)),
        ):
            if lowest < gear.junction_curvature_radius:
                raise GeometryError(
                    f"{gear.name}: contact would reach curvature radius {lowest * 1e3:.4g} mm, "
                    f"below the end of its involute at {gear.junction_curvature_radius * 1e3:.4g} "
                    "mm (interference); use more teeth, a profile shift or a smaller "
                    "addendum_coefficient of the mate"
                )
        for gear, mate in ((self.pinion, self.wheel), (self.wheel, self.pinion)):
            clearance = self.center_distance - gear.tip_radius - mate.root_radius
            if clearance < 0.0:
                raise GeometryError(
                    f"{gear.name}: its tip cuts {-clearance * 1e3:.3g} mm into the root of the "
                    f"{mate.name}; reduce the sum of the profile shifts or addendum_coefficient"
                )

    @property
    def gears(self) -> dict[str, Gear]:
        """The gears by their side of the pair, see ``SIDES``."""
        return {"pinion": self.pinion, "wheel": self.wheel}

    def curvature(self, side: str, position: Position) -> Position:
        """Curvature radius of a gear's flank at positions s, m."""
        if side == "pinion":
            return self.pinion_curvature(position)
        return self.wheel_curvature(position)

    def speed_ratio(self, side: str) -> float:
        """Speed of a gear over the pinion's, positive."""
        return 1.0 / (self.gears[side].n_teeth / self.pinion.n_teeth)

    @cached_property
    def ratio(self) -> float:
        """Gear ratio z_wheel / z_pinion."""
        return self.wheel.n_teeth / self.pinion.n_teeth

    @cached_property
    def base_pitch(self) -> float:
        """Transverse base pitch, m."""
        return self.pinion.base_pitch

    @cached_property
    def working_pressure_angle(self) -> float:
        """Transverse pressure angle at the working centre distance."""
        alpha = self._angle_without_play
        if self.center_distance_change == 0.0:  # to the bit
            return alpha
        base = self.pinion.base_radius + self.wheel.base_radius
        return math.acos(
            min(1.0, base / (base / math.cos(alpha) + self.center_distance_change))
        )

    @cached_property
    def _angle_without_play(self) -> float:
        """Transverse pressure angle at the centre distance that the profile shifts give."""
        shift = self.pinion.profile_shift + self.wheel.profile_shift
        teeth = self.pinion.n_teeth + self.wheel.n_teeth
        alpha = self.pinion.transverse_pressure_angle
        if shift == 0.0:
            return alpha
        return inverse_involute(
            involute(alpha) + 2.0 * shift * math.tan(self.pinion.pressure_angle) / teeth
        )

    @cached_property
    def center_distance(self) -> float:
        """Working centre distance, m."""
        return (self.pinion.base_radius + self.wheel.base_radius) / math.cos(
            self.working_pressure_angle
        )

    @cached_property
    def tangent_length(self) -> float:
        """Length N1N2 between the tangent points on the base circles, m."""
        return (self.pinion.base_radius + self.wheel.base_radius) * math.tan(
            self.working_pressure_angle
        )

    @cached_property
    def start_curvature_radius(self) -> float:
        """Pinion curvature radius at A, where the wheel's tip meets the pinion's flank."""
        return self.tangent_length - math.sqrt(
            self.wheel.tip_radius**2 - self.wheel.base_radius**2
        )

    @cached_property
    def end_curvature_radius(self) -> float:
        """Pinion curvature radius at E, where the pinion's tip leaves."""
        return math.sqrt(self.pinion.tip_radius**2 - self.pinion.base_radius**2)

    @cached_property
    def path_of_contact(self) -> float:
        """Length of the path of contact A to E, m."""
        return self.end_curvature_radius - self.start_curvature_radius

    @cached_property
    def transverse_contact_ratio(self) -> float:
        """Mean number of pairs in contact, eps_alpha."""
        return self.path_of_contact / self.base_pitch

    @cached_property
    def face_width(self) -> float:
        """Width that both gears share, m."""
        return min(self.pinion.face_width, self.wheel.face_width)

    @cached_property
    def base_helix_angle(self) -> float:
        """Helix angle on the base cylinders without its sign, rad."""
        return abs(self.pinion.base_helix_angle)

    @cached_property
    def overlap_ratio(self) -> float:
        """Overlap ratio eps_beta = b sin(beta) / (pi m_n)."""
        return (
            self.face_width
            * math.sin(abs(self.pinion.helix_angle))
            / (math.pi * self.pinion.normal_module)
        )

    @cached_property
    def total_contact_ratio(self) -> float:
        """Total contact ratio eps_gamma = eps_alpha + eps_beta."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @cached_property
    def pitch_point(self) -> float:
        """Position s of the pitch point C, m."""
        return (
            self.pinion.base_radius * math.tan(self.working_pressure_angle)
            - self.start_curvature_radius
        )

    def pinion_curvature(self, position: Position) -> Position:
        """Curvature radius of the pinion's flank at positions s, m."""
        return self.start_curvature_radius + position

    def wheel_curvature(self, position: Position) -> Position:
        """Curvature radius of the wheel's flank at positions s, m."""
        return self.tangent_length - self.start_curvature_radius - position

    def require_continuous_drive(self) -> None:
        """Raise unless at least one pair is always in contact."""
        if self.transverse_contact_ratio < 1.0:
            raise GeometryError(
                f"the transverse contact ratio {self.transverse_contact_ratio:.4f} is below 1, so "
                "the drive is interrupted at every tooth; use more teeth, a smaller module or a "
                "larger addendum_coefficient"
            )


def corner_gap(pair: GearPair, position: Array) -> Array:
    """Gap of a pair whose nominal contact lies beyond the path of contact.

    Parameters
    ----------
    position : (phase,) m    from A; negative before A (by the wheel's own rotation), above the path
        after E (by the
        pinion's own rotation)

    Returns
    -------
    (phase,) m    pinion advance along the line of action at which a tip corner meets the mating
    flank; 0 on the path

    Exact for rigid involutes. Beyond E the pinion's tip corner meets the wheel's flank; before A
    the wheel's tip corner meets the pinion's flank.
    """
    gap = np.zeros_like(position)
    after = position > pair.path_of_contact
    before = position < 0.0
    gap[after] = _pinion_tip_gap(pair, position[after])
    gap[before] = _wheel_tip_gap(pair, position[before])
    return gap


def corner_gap_by_pinion(pair: GearPair, position: Array) -> Array:
    """``corner_gap`` with both sides referred to the pinion's rotation, (phase,) m.

    Before A the touching wheel lags the pinion by the gap itself: the fixed point of
    ``gap(position - gap)``.
    """
    gap = corner_gap(pair, position)
    before = position < 0.0
    for _ in range(40):
        last = gap[before]
        gap[before] = _wheel_tip_gap(pair, position[before] - last)
        if np.all(np.abs(gap[before] - last) < 1e-15):
            break
    return gap


def _pinion_tip_gap(pair: GearPair, position: Array) -> Array:
    alpha, radius = pair.working_pressure_angle, pair.pinion.tip_radius
    r_p, r_g = pair.pinion.base_radius, pair.wheel.base_radius
    roll_tip = pair.end_curvature_radius / r_p
    polar = (
        (pair.start_curvature_radius + position) / r_p
        - roll_tip
        + math.atan(roll_tip)
        - alpha
    )
    x, y = pair.center_distance - radius * np.cos(polar), radius * np.sin(polar)
    return r_g * _flank_lead(
        np.hypot(x, y),
        np.arctan2(y, x),
        r_g,
        alpha,
        pair.wheel_curvature(position),
    )


def _wheel_tip_gap(pair: GearPair, position: Array) -> Array:
    alpha, radius = pair.working_pressure_angle, pair.wheel.tip_radius
    r_p, r_g = pair.pinion.base_radius, pair.wheel.base_radius
    roll_tip = math.sqrt(radius**2 - r_g**2) / r_g
    polar = (
        alpha - pair.wheel_curvature(position) / r_g + roll_tip - math.atan(roll_tip)
    )
    x, y = pair.center_distance - radius * np.cos(polar), radius * np.sin(polar)
    return r_p * _flank_lead(
        np.hypot(x, y),
        -np.arctan2(y, x),
        r_p,
        alpha,
        pair.pinion_curvature(position),
    )


def _flank_lead(
    radius: Array, polar: Array, base_radius: float, alpha: float, curvature: Array
) -> Array:
    """Angle by which a flank with the given nominal curvature radius leads a corner at (radius,
    polar).

    Both angles are measured from the line of centres towards the flank's tangent point.
    """
    roll = np.sqrt(np.maximum(radius**2 - base_radius**2, 0.0)) / base_radius
    return alpha - curvature / base_radius + roll - np.arctan(roll) - polar
