"""Deviations of the flank: manufacturing and mounting errors, wear, tip relief.

Each has a declared limit; its severity is its size over that limit.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import (
    Fault,
    Growth,
    require,
    require_choice,
    require_not_negative,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

N_SLICES = 40  # across the face of a misaligned tooth
RELIEF_CURVES = {"linear": 1, "parabolic": 2}  # exponent of the share of the length


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankForm(Fault):
    """A deviation with a declared ``limit`` of its ``size``."""

    limit: float = unit("um")

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require(self, "limit_um", self.limit > 0.0, "must be positive")

    @abstractmethod
    def size(self) -> float:
        """Size of the deviation, m, bounded by the limit."""

    def severity(self, gear: Gear) -> float:
        """Share of the declared limit."""
        return self.size() / self.limit

    def on_other_flank(self) -> None:
        """None: grinding, wear and measured errors belong to one flank."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class PitchError(FlankForm):
    """A tooth ``pitch_error`` behind its position along the line of action; negative: in front."""

    kind = "pitch_error"
    growth = Growth.NONE
    sizes = (("pitch_error_um",),)
    pitch_error: float = unit("um")

    def size(self) -> float:
        """Absolute pitch error."""
        return abs(self.pitch_error)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with its flank moved."""
        return tooth.with_deviation(np.array(self.pitch_error))


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileError(FlankForm):
    """Slope and form of the profile.

    ``profile_slope`` is the deviation at the tip less that at the lower end; the middle stays in
    place. ``profile_form`` is the height of ``profile_waves`` waves from end to end, all of them
    behind the nominal flank.
    """

    kind = "profile_error"
    growth = Growth.NONE
    sizes = (("profile_slope_um", "profile_form_um"),)
    profile_slope: float = unit("um")
    profile_form: float = unit("um")
    profile_waves: float

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "profile_form_um", "profile_waves")

    def size(self) -> float:
        """Slope plus form, as in the total profile deviation."""
        return abs(self.profile_slope) + self.profile_form

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with the profile error."""
        share = _share(tooth)
        wave = 0.5 * (1.0 - np.cos(2.0 * np.pi * self.profile_waves * share))
        deviation = self.profile_slope * (share - 0.5) + self.profile_form * wave
        return tooth.with_deviation(deviation)


@dataclass(frozen=True, slots=True, kw_only=True)
class Runout(FlankForm):
    """Teeth on a circle ``eccentricity`` off the axis: half the radial runout F_r.

    At the pitch point ``tooth`` stands back most. The change of working pressure angle is left
    out (second order).
    """

    kind = "runout"
    growth = Growth.NONE
    sizes = (("eccentricity_um",),)
    alike = False
    eccentricity: float = unit("um")

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "eccentricity_um")
        rule = "must be the one tooth that stands back most"
        require(self, "tooth", isinstance(self.tooth, int), rule)

    def teeth(self, gear: Gear) -> tuple[int, ...]:
        """All teeth of the gear."""
        Fault.teeth(self, gear)
        return tuple(range(gear.n_teeth))

    def size(self) -> float:
        """The eccentricity."""
        return self.eccentricity

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with its flank moved by the eccentricity's part along the line of action.

        The eccentricity turns with the gear. A tooth one pitch further round touches one base
        pitch lower on the pinion and higher on the wheel.
        """
        gear = tooth.gear
        pitch_roll = np.tan(gear.transverse_pressure_angle)
        roll = tooth.profile.curvature_radius / gear.base_radius - pitch_roll
        turn = 2.0 * np.pi / gear.n_teeth * (number - self.first_tooth)
        if self.gear == "wheel":
            turn = -turn
        return tooth.with_deviation(self.eccentricity * np.cos(roll + turn))


@dataclass(frozen=True, slots=True, kw_only=True)
class Misalignment(FlankForm):
    """Flanks that stand back ``misalignment`` more at one end of the face; its sign says which."""

    kind = "misalignment"
    growth = Growth.NONE
    sizes = (("misalignment_um",),)
    of_mounting = True
    misalignment: float = unit("um")

    def size(self) -> float:
        """Absolute misalignment, as in the helix slope deviation."""
        return abs(self.misalignment)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with its flank tilted about the end that bears."""
        if self.misalignment == 0.0:
            return tooth
        width = tooth.gear.face_width
        sliced = tooth.split(np.linspace(0.0, width, N_SLICES + 1))
        along = sliced.slice_middle / width
        if self.misalignment < 0.0:
            along = along - 1.0
        return sliced.with_deviation(self.misalignment * along[:, None])


@dataclass(frozen=True, slots=True, kw_only=True)
class Wear(FlankForm):
    """Material worn off: ``wear_depth`` times ``wear_profile``.

    ``wear_profile`` holds factors at curvature radii evenly spaced from the lower end of the
    involute to the tip; None is uniform wear.
    """

    kind = "wear"
    growth = Growth.ARCHARD
    sizes = (("wear_depth_um",),)
    wear_depth: float = unit("um")
    wear_profile: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "wear_depth_um")
        holds = len(self.factors) >= 2 and min(self.factors) >= 0.0
        rule = "must hold two depths or more, none negative"
        require(self, "wear_profile", holds, rule)

    @property
    def factors(self) -> tuple[float, ...]:
        """Factors of the wear depth from the lower end of the involute to the tip."""
        if self.wear_profile is None:
            return 1.0, 1.0
        return self.wear_profile

    def size(self) -> float:
        """Greatest depth."""
        return self.wear_depth * max(self.factors)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth without the worn layer."""
        nodes = np.linspace(0.0, 1.0, len(self.factors))
        depth = self.wear_depth * np.interp(_share(tooth), nodes, self.factors)
        return tooth.with_loss(tooth.material_loss + depth)


@dataclass(frozen=True, slots=True, kw_only=True)
class TipRelief(FlankForm):
    """A tip relieved by ``relief``, over ``relief_length`` along the line of action."""

    kind = "tip_relief"
    growth = Growth.NONE
    sizes = (
        ("relief_um",),
        ("relief_length_mm",),
    )
    relief: float = unit("um")
    relief_length: float = unit("mm")
    relief_curve: str = "linear"

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "relief_um", "relief_length_mm")
        require_choice(self, "relief_curve", RELIEF_CURVES)

    def size(self) -> float:
        """Relief at the tip, 0 without length."""
        return self.relief * (self.relief_length > 0.0)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """The tooth with its tip relieved."""
        if self.relief * self.relief_length == 0.0:
            return tooth
        curvature = tooth.profile.curvature_radius
        span = curvature[-1] - curvature[0]
        rule = f"must not be above {span * 1e3:.4g} mm, the involute of the {self.gear}"
        require(self, "relief_length_mm", self.relief_length <= span, rule)
        share = np.maximum(1.0 - (curvature[-1] - curvature) / self.relief_length, 0.0)
        power = RELIEF_CURVES[self.relief_curve]
        return tooth.with_deviation(self.relief * share**power)


def _share(tooth: Tooth) -> Array:
    """Position along the flank, linear in roll: 0 at the lower end, 1 at the tip, (profile,)."""
    curvature = tooth.profile.curvature_radius
    return (curvature - curvature[0]) / (curvature[-1] - curvature[0])
