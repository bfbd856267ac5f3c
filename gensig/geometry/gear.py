"""One spur or helical gear as a rack-type cutter makes it, in the transverse section."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from gensig.errors import GeometryError
from gensig.geometry.involute import involute
from gensig.units import from_si, unit

# degrees; the slices of a steeper tooth are not spur teeth
LARGEST_HELIX = 45.0


@dataclass(frozen=True, kw_only=True)
class Gear:
    """Geometry of one external gear, lengths in m, angles in rad.

    No slots: what follows from the fields is kept.

    ``pressure_angle`` and ``normal_module`` are those of the basic rack, so of the normal
    section; coefficients count normal modules. All radii and half angles are of the transverse
    section, which for ``helix_angle`` 0 is the same. ``helix_angle`` is that on the reference
    cylinder, positive for a right-handed gear.

    ``cutter_tip_radius_coefficient`` is the rounding of the rack's tip over the module; it
    generates the root curve. In the transverse section of a helical gear the rounding is an
    ellipse, taken as a circle of the same radius. ``name`` is "pinion" or "wheel".

    Source: ISO 21771-1:2024, with x tan(alpha_n) = x cos(beta) tan(alpha_t).
    """

    name: str
    n_teeth: int
    normal_module: float = unit("mm")
    pressure_angle: float = unit("deg")
    addendum_coefficient: float
    clearance_coefficient: float
    cutter_tip_radius_coefficient: float
    profile_shift: float
    face_width: float = unit("mm")
    bore_radius: float = unit("mm")
    helix_angle: float = unit("deg", default=0.0)

    def __post_init__(self) -> None:
        self._check_ranges()
        if self.junction_curvature_radius <= 0.0:
            depth = self.straight_flank_depth / self.transverse_module
            sine = math.sin(self.transverse_pressure_angle)
            limit = math.ceil(2.0 * depth / sine**2)
            raise GeometryError(
                f"{self.name}: {self.n_teeth} teeth with profile shift {self.profile_shift:g} are "
                f"undercut; use at least {limit} teeth or a larger profile_shift"
            )
        if self.root_half_angle >= math.pi / self.n_teeth:
            raise GeometryError(
                f"{self.name}: a rack tip rounded by cutter_tip_radius_coefficient = "
                f"{self.cutter_tip_radius_coefficient:g} is wider than the space between two "
                f"teeth at {math.degrees(self.pressure_angle):g} degrees; reduce it"
            )
        if self.half_tooth_angle_at(self.tip_radius) <= 0.0:
            raise GeometryError(
                f"{self.name}: the teeth are pointed below the tip radius "
                f"{self.tip_radius * 1e3:.4g} mm; reduce profile_shift {self.profile_shift:g} or "
                f"addendum_coefficient {self.addendum_coefficient:g}"
            )
        if not 0.0 < self.bore_radius < self.root_radius:
            raise GeometryError(
                f"{self.name}: bore_radius_mm = {self.bore_radius * 1e3:g} must lie between 0 and "
                f"the root radius {self.root_radius * 1e3:.4g} mm"
            )

    def _check_ranges(self) -> None:
        if self.n_teeth < 3:
            raise GeometryError(
                f"{self.name}: n_teeth = {self.n_teeth} must be at least 3"
            )
        for key in ("normal_module_mm", "face_width_mm", "addendum_coefficient"):
            value = from_si(key, getattr(self, key.removesuffix("_mm")))
            if not value > 0.0:
                raise GeometryError(f"{self.name}: {key} = {value:g} must be positive")
        if not math.radians(10.0) <= self.pressure_angle <= math.radians(35.0):
            raise GeometryError(
                f"{self.name}: pressure_angle_deg = {math.degrees(self.pressure_angle):g} must "
                "lie between 10 and 35"
            )
        if not abs(self.helix_angle) <= math.radians(LARGEST_HELIX):
            raise GeometryError(
                f"{self.name}: helix_angle_deg = {math.degrees(self.helix_angle):g} must lie "
                f"between -{LARGEST_HELIX:g} and {LARGEST_HELIX:g}"
            )
        if not 0.0 <= self.clearance_coefficient <= 1.0:
            raise GeometryError(
                f"{self.name}: clearance_coefficient = {self.clearance_coefficient:g} must lie in "
                "0..1"
            )
        rounding = self.cutter_tip_radius_coefficient
        sine = math.sin(self.transverse_pressure_angle)
        room = self.clearance_coefficient / (1.0 - sine)
        if not 0.0 < rounding <= room * 1.001:
            raise GeometryError(
                f"{self.name}: cutter_tip_radius_coefficient = {rounding:g} must be positive and "
                f"at most {room:.4g}, where the rounding reaches the working flank"
            )

    @cached_property
    def transverse_module(self) -> float:
        """Transverse module m_t = m_n / cos(beta)."""
        return self.normal_module / math.cos(self.helix_angle)

    @cached_property
    def transverse_pressure_angle(self) -> float:
        """Transverse pressure angle, tan(alpha_t) = tan(alpha_n) / cos(beta)."""
        if self.helix_angle == 0.0:  # to the bit
            return self.pressure_angle
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @cached_property
    def base_helix_angle(self) -> float:
        """Helix angle on the base cylinder, sin(beta_b) = sin(beta) cos(alpha_n)."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @cached_property
    def pitch_radius(self) -> float:
        """Reference pitch radius r = m_t z / 2."""
        return 0.5 * self.transverse_module * self.n_teeth

    @cached_property
    def base_radius(self) -> float:
        """Base radius r_b = r cos(alpha_t)."""
        return self.pitch_radius * math.cos(self.transverse_pressure_angle)

    @cached_property
    def tip_radius(self) -> float:
        """Tip radius r_a, without tip shortening."""
        return (
            self.pitch_radius
            + (self.addendum_coefficient + self.profile_shift) * self.normal_module
        )

    @cached_property
    def root_radius(self) -> float:
        """Root radius r_f that the cutter's tip generates."""
        return self.pitch_radius - self._root_depth

    @cached_property
    def _root_depth(self) -> float:
        """Depth of the root circle below the pitch circle, m."""
        rack_depth = self.addendum_coefficient + self.clearance_coefficient
        return (rack_depth - self.profile_shift) * self.normal_module

    @cached_property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt, m."""
        return 2.0 * math.pi * self.base_radius / self.n_teeth

    @cached_property
    def half_tooth_angle_base(self) -> float:
        """Half tooth angle on the base circle, th_b."""
        return (
            math.pi / (2.0 * self.n_teeth)
            + 2.0 * self.profile_shift * math.tan(self.pressure_angle) / self.n_teeth
            + involute(self.transverse_pressure_angle)
        )

    def half_tooth_angle_at(self, radius: float) -> float:
        """Half tooth angle on the circle of ``radius`` (at least the base radius)."""
        return self.half_tooth_angle_base - involute(
            math.acos(min(1.0, self.base_radius / radius))
        )

    @cached_property
    def cutter_tip_radius(self) -> float:
        """Radius of the rack's tip rounding, r_rho."""
        return self.cutter_tip_radius_coefficient * self.normal_module

    @cached_property
    def rounding_center_depth(self) -> float:
        """Distance a_1 from the pitch line to the centre of the rack's tip rounding."""
        return self._root_depth - self.cutter_tip_radius

    @cached_property
    def rounding_center_offset(self) -> float:
        """Distance b_1 from the tooth centreline to the rounding's centre, along the pitch line."""
        alpha, rounding = self.transverse_pressure_angle, self.cutter_tip_radius
        rack_depth = self.addendum_coefficient + self.clearance_coefficient
        return (
            math.pi * self.transverse_module / 4.0
            + rack_depth * self.normal_module * math.tan(alpha)
            - rounding * math.tan(alpha)
            + rounding / math.cos(alpha)
        )

    @cached_property
    def root_half_angle(self) -> float:
        """Half angle theta_f = b_1 / r of the tooth where its root curve meets the root circle."""
        return self.rounding_center_offset / self.pitch_radius

    @cached_property
    def straight_flank_depth(self) -> float:
        """Depth below the pitch line at which the rack's straight flank ends, m."""
        return self.rounding_center_depth + self.cutter_tip_radius * math.sin(
            self.transverse_pressure_angle
        )

    @cached_property
    def junction_curvature_radius(self) -> float:
        """Curvature radius of the involute where the root curve joins it.

        Not positive when undercut.
        """
        alpha = self.transverse_pressure_angle
        below_pitch_line = self.straight_flank_depth / math.sin(alpha)
        return self.base_radius * math.tan(alpha) - below_pitch_line
