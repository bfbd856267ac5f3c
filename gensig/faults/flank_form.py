"""Flanks that stand where they should not: manufacturing and mounting errors, wear, and relief
that is meant.

Each has a declared limit; its severity is the share of it that is used.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gensig.faults.base import Fault, Growth, require, require_not_negative
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth
from gensig.units import unit

Array = NDArray[np.float64]

N_SLICES = 40  # across the face of a misaligned tooth
RELIEF_CURVES = ("linear", "parabolic")


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankForm(Fault):
    """A deviation whose ``limit`` is declared; ``size`` is what the limit bounds."""

    limit: float = unit("um")

    def __post_init__(self) -> None:
        Fault.__post_init__(self)
        require(self, "limit_um", self.limit > 0.0, "must be positive")

    @abstractmethod
    def size(self) -> float:
        """What is compared with the limit, m."""

    def severity(self, gear: Gear) -> float:
        """Share of the declared limit."""
        return self.size() / self.limit

    def on_other_flank(self) -> None:
        """None: what was ground, worn or measured on a flank stays with it."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class PitchError(FlankForm):
    """One tooth stands back by ``pitch_error`` along the line of action (negative: proud)."""

    kind: ClassVar[str] = "pitch_error"
    growth: ClassVar[Growth] = Growth.NONE
    pitch_error: float = unit("um")

    def size(self) -> float:
        """Its size."""
        return abs(self.pitch_error)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Move the flank."""
        return (
            tooth.with_deviation(np.array(self.pitch_error))
            if self.pitch_error
            else tooth
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileError(FlankForm):
    """Slope and form of the profile.

    ``profile_slope`` is how much more the flank stands back at its tip than at its lower end (the
    middle stays), ``profile_form`` the height of ``profile_waves`` waves from end to end, all of
    them back from the nominal flank.
    """

    kind: ClassVar[str] = "profile_error"
    growth: ClassVar[Growth] = Growth.NONE
    profile_slope: float = unit("um")
    profile_form: float = unit("um")
    profile_waves: float

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "profile_form_um", "profile_waves")

    def size(self) -> float:
        """Slope and form together, as the total profile deviation counts them."""
        return abs(self.profile_slope) + self.profile_form

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Bend the flank."""
        share = _share(tooth)
        wave = 0.5 * (1.0 - np.cos(2.0 * np.pi * self.profile_waves * share))
        deviation = self.profile_slope * (share - 0.5) + self.profile_form * wave
        return tooth.with_deviation(deviation) if deviation.any() else tooth


@dataclass(frozen=True, slots=True, kw_only=True)
class Runout(FlankForm):
    """The teeth sit on a circle ``eccentricity`` off the axis; ``tooth`` stands back most, at the
    pitch point.

    Half the radial runout F_r. The change of working pressure angle is left out (second order).
    """

    kind: ClassVar[str] = "runout"
    growth: ClassVar[Growth] = Growth.NONE
    alike: ClassVar[bool] = False
    eccentricity: float = unit("um")

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "eccentricity_um")
        require(
            self,
            "tooth",
            isinstance(self.tooth, int),
            "must be the one tooth that stands back most",
        )

    def teeth(self, gear: Gear) -> tuple[int, ...]:
        """All of them."""
        Fault.teeth(self, gear)
        return tuple(range(gear.n_teeth))

    def size(self) -> float:
        """The eccentricity."""
        return self.eccentricity

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Move the flank by the eccentricity's part along the line of action, which turns with
        the gear.

        One pitch further round, a tooth touches one base pitch lower on the pinion and higher on
        the wheel.
        """
        if self.eccentricity == 0.0:
            return tooth
        assert isinstance(self.tooth, int)
        gear = tooth.gear
        roll = tooth.profile.curvature_radius / gear.base_radius - np.tan(
            gear.transverse_pressure_angle
        )
        turn = 2.0 * np.pi / gear.n_teeth * (number - self.tooth)
        angle = roll + (turn if self.gear == "pinion" else -turn)
        return tooth.with_deviation(self.eccentricity * np.cos(angle))


@dataclass(frozen=True, slots=True, kw_only=True)
class Misalignment(FlankForm):
    """The flanks stand back by ``misalignment`` more at one end of the face than at the other
    (its sign says which).
    """

    kind: ClassVar[str] = "misalignment"
    growth: ClassVar[Growth] = Growth.NONE
    of_mounting: ClassVar[bool] = True
    misalignment: float = unit("um")

    def size(self) -> float:
        """Its size, as the helix slope deviation counts it."""
        return abs(self.misalignment)

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Tilt the flank about the end that bears."""
        if self.misalignment == 0.0:
            return tooth
        width = tooth.gear.face_width
        sliced = tooth.split(np.linspace(0.0, width, N_SLICES + 1))
        along = 0.5 * (sliced.slice_edges[1:] + sliced.slice_edges[:-1]) / width
        back = self.misalignment * (along if self.misalignment > 0.0 else along - 1.0)
        return sliced.with_deviation(back[:, None])


@dataclass(frozen=True, slots=True, kw_only=True)
class Wear(FlankForm):
    """Material worn off: ``wear_depth`` everywhere, or times ``wear_profile``.

    ``wear_profile`` gives the depth along the flank as multiples of ``wear_depth``, at curvature
    radii evenly spaced from the lower end of the involute to the tip; None is uniform wear.
    """

    kind: ClassVar[str] = "wear"
    growth: ClassVar[Growth] = Growth.ARCHARD
    wear_depth: float = unit("um")
    wear_profile: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "wear_depth_um")
        given = self.wear_profile
        rule = "must hold two depths or more, none negative"
        require(
            self,
            "wear_profile",
            given is None or (len(given) >= 2 and min(given) >= 0.0),
            rule,
        )

    def size(self) -> float:
        """The greatest depth."""
        return self.wear_depth * (
            1.0 if self.wear_profile is None else max(self.wear_profile)
        )

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Take the worn layer off."""
        if self.size() == 0.0:
            return tooth
        shape = (1.0,) * 2 if self.wear_profile is None else self.wear_profile
        depth = self.wear_depth * np.interp(
            _share(tooth), np.linspace(0.0, 1.0, len(shape)), shape
        )
        return tooth.with_loss(tooth.material_loss + depth)


@dataclass(frozen=True, slots=True, kw_only=True)
class TipRelief(FlankForm):
    """The tip stands back by ``relief``, falling off to nothing ``relief_length`` below it on the
    line of action.
    """

    kind: ClassVar[str] = "tip_relief"
    growth: ClassVar[Growth] = Growth.NONE
    relief: float = unit("um")
    relief_length: float = unit("mm")
    relief_curve: str = "linear"

    def __post_init__(self) -> None:
        FlankForm.__post_init__(self)
        require_not_negative(self, "relief_um", "relief_length_mm")
        require(
            self,
            "relief_curve",
            self.relief_curve in RELIEF_CURVES,
            f"is none of {', '.join(RELIEF_CURVES)}",
        )

    def size(self) -> float:
        """The relief at the tip, none without length."""
        return self.relief if self.relief_length > 0.0 else 0.0

    def apply(self, tooth: Tooth, number: int) -> Tooth:
        """Relieve the tip."""
        if self.relief * self.relief_length == 0.0:
            return tooth
        curvature = tooth.profile.curvature_radius
        span = curvature[-1] - curvature[0]
        rule = f"must not be above {span * 1e3:.4g} mm, the involute of the {self.gear}"
        require(self, "relief_length_mm", self.relief_length <= span, rule)
        share = np.maximum(1.0 - (curvature[-1] - curvature) / self.relief_length, 0.0)
        return tooth.with_deviation(
            self.relief * (share if self.relief_curve == "linear" else share**2)
        )


def _share(tooth: Tooth) -> Array:
    """Place along the flank.

    0 at the lower end of the involute, 1 at the tip, linear in roll, (profile,).
    """
    curvature = tooth.profile.curvature_radius
    return (curvature - curvature[0]) / (curvature[-1] - curvature[0])
