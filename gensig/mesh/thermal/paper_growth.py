"""Growth of hot teeth by the equations of the paper on helical stiffness with temperature.

``mesh.heat_law`` names the reading of the equations. Theory: ``docs/theory/heat.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import load_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A reading of the paper's equations.

    Parameters
    ----------
    angles : growth of half angles. ``printed``: eqs. (11), (12) and (15), which take the growth
        at the base circle away everywhere. ``twice``: eq. (11) in full, above the growth that the
        base circle's displacement holds. ``once``: that of the displacement alone
    has_bulk : the rise of eqs. (10) to (12) is that of the teeth and the flash; False: the flash
        alone, as eq. (13) has it
    has_printed_body : eqs. (7) and (8) with Poisson's ratio where it is printed
    has_misprints : eqs. (15), (18), (28) and (29) as they are printed, see ``paper_teeth``
    """

    angles: str = "printed"
    has_bulk: bool = False
    has_printed_body: bool = True
    has_misprints: bool = False


READINGS: dict[str, Reading] = {
    "paper": Reading(),
    "paper_misprints": Reading(has_misprints=True),
    "paper_contact": Reading(has_bulk=True),
    "paper_twice": Reading(angles="twice", has_bulk=True, has_printed_body=False),
    "paper_once": Reading(angles="once", has_bulk=True, has_printed_body=False),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperGearGrowth:
    """Growth of one gear.

    ``base`` and ``root`` are the displacements u_b and u_f of base and root circle, m; ``tooth``
    is the strain that the teeth have at every position.
    """

    base: float
    root: float
    tooth: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperGrowth:
    """Growth of both gears by one reading.

    Parameters
    ----------
    reading : name in ``READINGS``
    pinion, wheel : PaperGearGrowth
    flash_position : (position,) m    on the path of contact, from A, rising
    flash_strain : (position,)        expansion times the flash temperature, eq. (13)
    """

    reading: str
    pinion: PaperGearGrowth
    wheel: PaperGearGrowth
    flash_position: tuple[float, ...]
    flash_strain: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.reading not in READINGS:
            raise ConfigError(
                f"mesh.heat_law = {self.reading!r}; readings: {', '.join(READINGS)}"
            )

    @property
    def rules(self) -> Reading:
        """The reading."""
        return READINGS[self.reading]

    def strain(self, side: str, position: Array) -> Array:
        """Strain of the teeth, lambda dT of eqs. (10) to (12), at contacts there, (phase,)."""
        flash = np.interp(position, self.flash_position, self.flash_strain)
        return flash + self.of(side).tooth

    def of(self, side: str) -> PaperGearGrowth:
        """Growth of the gear of one side of the pair."""
        return {"pinion": self.pinion, "wheel": self.wheel}[side]


_AT_REST = PaperGearGrowth(base=0.0, root=0.0, tooth=0.0)


def no_growth(reading: str) -> PaperGrowth:
    """Cold teeth by a reading of the equations."""
    sides = {"pinion": _AT_REST, "wheel": _AT_REST}
    return PaperGrowth(
        reading=reading, **sides, flash_position=(0.0,), flash_strain=(0.0,)
    )


def gear_growth(
    gear: Gear,
    reading: Reading,
    *,
    bore_rise: float,
    tooth_rise: float,
    expansion: float,
    poisson_ratio: float,
) -> PaperGearGrowth:
    """Displacements of base and root circle, and the strain of the teeth without the flash.

    Parameters
    ----------
    bore_rise, tooth_rise : K    of T(R_i) and T(R_0) above the reference temperature

    Source: thermal paper eqs. (4) to (9). Eq. (5) at the outer radius R_0 = max(R_b, R_f) is (6)
    or (9); at the other of both circles it is (8) or (7).
    """
    outer = max(gear.base_radius, gear.root_radius)
    rises = bore_rise, tooth_rise

    def displacement(radius: float) -> float:
        if radius == outer:
            return expansion * _outer_displacement(gear.bore_radius, outer, *rises)
        nu = poisson_ratio
        radii = gear.bore_radius, outer
        moved = _inner_displacement(
            radius, radii, rises, nu, is_printed=reading.has_printed_body
        )
        return expansion * moved

    return PaperGearGrowth(
        base=displacement(gear.base_radius),
        root=displacement(gear.root_radius),
        tooth=expansion * tooth_rise if reading.has_bulk else 0.0,
    )


def _outer_displacement(
    bore: float, outer: float, bore_rise: float, rise: float
) -> float:
    """Displacement of the outer radius over the expansion, m K: eqs. (6) and (9)."""
    difference = rise - bore_rise
    logarithm = math.log(outer) - math.log(bore)
    solid = outer**3 * difference / (outer**2 - bore**2)
    return outer * bore_rise + solid - outer * difference / (2.0 * logarithm)


def _inner_displacement(
    radius: float,
    radii: tuple[float, float],
    rises: tuple[float, float],
    nu: float,
    *,
    is_printed: bool,
) -> float:
    """Displacement at a radius within over the expansion, m K: eq. (5).

    Eqs. (7) and (8), which should be eq. (5), have its first weight with Poisson's ratios swapped
    and its first integral up to ``radius`` in place of the outer radius.
    """
    bore, outer = radii
    within = _moment(radius, radii, rises)
    solid = outer**2 - bore**2
    own = (1.0 + nu) / radius * within
    if is_printed:
        weight = (1.0 + nu) * radius**2 + (1.0 - nu) * bore**2
        return weight / (radius * solid) * within + own
    weight = (1.0 - nu) * radius**2 + (1.0 + nu) * bore**2
    return weight / (radius * solid) * _moment(outer, radii, rises) + own


def _moment(
    radius: float, radii: tuple[float, float], rises: tuple[float, float]
) -> float:
    """Integral of T r from the bore to a radius, m2 K, with T of eq. (4)."""
    bore, outer = radii
    ratio = radius / bore
    slope = (rises[1] - rises[0]) / math.log(outer / bore)
    logarithmic = 0.5 * radius**2 * math.log(ratio) - 0.25 * (radius**2 - bore**2)
    return 0.5 * rises[0] * (radius**2 - bore**2) + slope * logarithmic


def shift_angle(gear: Gear) -> float:
    """Half angle that the profile shift adds to the tooth, 2 x tan(alpha_n) / z, rad."""
    return 2.0 * gear.profile_shift * math.tan(gear.pressure_angle) / gear.n_teeth


@dataclass(frozen=True, slots=True, kw_only=True)
class HotGear:
    """The teeth of one grown gear by a reading of the equations."""

    gear: Gear
    growth: PaperGearGrowth
    reading: Reading

    def outline(
        self, strain: Array, radius: Array, half_angle: Array
    ) -> tuple[Array, Array]:
        """Radii R' and half angles of points of the tooth's outline, each (phase, point).

        Parameters
        ----------
        strain : (phase, 1)             lambda dT
        radius, half_angle : (point,)   or (phase, 1); of the cold outline, m and rad

        Source: thermal paper eqs. (10) to (12), and (15), whose alpha_2 holds the growth of the
        base circle's angle, theta'(0). The tooth's half angle is alpha_2 - theta'. A point below
        the involute moves by the same equations.
        """
        base, moved = self.gear.base_radius, self.growth.base
        grown = radius + moved + strain * (radius - base)
        if self.reading.angles == "once":
            return grown, half_angle + np.zeros_like(grown)
        wider = strain * radius * half_angle / grown
        if self.reading.angles == "printed":
            # the growth of the half angle at the base circle, -theta'(0)
            wider = wider - strain * base * self.base_half_angle / (base + moved)
        return grown, half_angle + wider

    def base_point(self, strain: Array) -> tuple[Array, Array]:
        """``outline`` of the point on the base circle, (phase, 1)."""
        base = np.array([self.gear.base_radius])
        return self.outline(strain, base, np.array([self.base_half_angle]))

    @property
    def base_half_angle(self) -> float:
        """Half angle of the cold tooth at the base circle, rad.

        alpha_2 of eq. (15) leaves out what the profile shift adds.
        """
        if not self.reading.has_misprints:
            return self.gear.half_tooth_angle_base
        return self.gear.half_tooth_angle_base - shift_angle(self.gear)

    def half_angle(self, roll: Array) -> Array:
        """Half angle of the cold flank at roll angles, (point,) rad."""
        return self.base_half_angle - (roll - np.arctan(roll))

    def load_angle(self, curvature_radius: Array, entry: tuple[float, float]) -> Array:
        """Angle alpha' between the load and the tooth's thickness direction, (phase,) rad.

        Parameters
        ----------
        curvature_radius : (phase,) m    of the cold flank
        entry : m and strain             curvature radius where the tooth enters, and its strain

        Source: thermal paper eqs. (20) and (23): the angle of the hot profile's normal where the
        tooth enters contact, and the gear's rotation from there.
        """
        start, strain = np.array([entry[0]]), entry[1]
        at_rest = replace(self, growth=_AT_REST)
        turned = self._normal_angle(strain, start) - at_rest._normal_angle(0.0, start)
        return load_angle(self.gear, curvature_radius) + float(turned[0])

    def _normal_angle(self, strain: float, curvature: Array) -> Array:
        """arccot(-x' / z') of the hot profile at curvature radii of the cold one, (point,) rad."""
        base = self.gear.base_radius
        radius = np.hypot(base, curvature)
        half = self.half_angle(curvature / base)
        (grown,), (angle,) = self.outline(np.array([[strain]]), radius, half)
        radius_slope = curvature / radius
        half_slope = -(curvature**2) / (base * radius**2)
        grown_slope = (1.0 + strain) * radius_slope
        angle_slope = half_slope
        if self.reading.angles != "once":
            arc_slope = radius_slope * half + radius * half_slope
            of_radius = radius * half * grown_slope / grown
            angle_slope = half_slope + strain * (arc_slope - of_radius) / grown
        turn = grown * angle_slope
        height = grown_slope * np.cos(angle) - turn * np.sin(angle)
        thickness = grown_slope * np.sin(angle) + turn * np.cos(angle)
        return np.arctan2(-thickness, height)
