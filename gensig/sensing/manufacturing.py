"""Differences between specimens (sets of gears) and between gearboxes.

See ``docs/theory/manufacturing.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.faults.base import ALL
from gensig.faults.flank_form import FlankForm, Misalignment, ProfileError
from gensig.geometry.gear import Gear
from gensig.sensing.gear_tolerances import (
    HIGHEST_GRADE,
    LOWEST_GRADE,
    check_covered,
    cumulative_pitch_limit,
    profile_form_limit,
    profile_slope_limit,
    runout_limit,
    single_pitch_limit,
)
from gensig.units import check_limits, from_si, unit

# most waves of the form deviation from end to end; whole ones have no slope
FORM_WAVES = 3
SUPPORT_SCATTERS = ("support_stiffness_scatter", "support_damping_scatter")
AXES = 2  # x and y of each support
# in which the eccentricity is made smaller until the index deviation fits its limit
RUNOUT_STEPS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """Manufacturing grade and scatter between gears and between gearboxes.

    Every deviation of a gear uses the same share of its ISO 1328-1 limit, between
    ``used_share_low`` and ``used_share_high``. ``iso1328_grade`` None makes perfect gears: only
    the supports scatter. ``tooth_share`` is the part of the profile slope that differs from tooth
    to tooth, ``undulation_share`` that of the profile form that is ``undulation_waves`` waves.
    Misalignment is uniform within plus and minus ``misalignment``, backlash within plus and minus
    the share ``backlash_scatter`` of the nominal one. The support scatters are standard
    deviations of the logarithm. Where the damping ratios are given, each support of a gearbox has
    one between them, and their scatter is not read. Running-in has worn off ``run_in_share`` of
    the profile deviations and of the random pitch, not of eccentricity and misalignment.
    """

    iso1328_grade: float | None
    used_share_low: float
    used_share_high: float
    profile_errors: bool
    tooth_share: float
    undulation_share: float
    undulation_waves: int
    misalignment: float = unit("um")
    backlash_scatter: float
    support_stiffness_scatter: float
    support_damping_scatter: float
    support_damping_ratio_low: float | None = None
    support_damping_ratio_high: float | None = None
    run_in_share: float = 0.0

    def __post_init__(self) -> None:
        if (
            self.iso1328_grade is not None
            and not LOWEST_GRADE <= self.iso1328_grade <= HIGHEST_GRADE
        ):
            grades = f"{LOWEST_GRADE}..{HIGHEST_GRADE}"
            raise ConfigError(
                f"quality.iso1328_grade = {self.iso1328_grade:g} must lie in {grades}, or be null"
            )
        if not 0.0 <= self.used_share_low <= self.used_share_high <= 1.0:
            raise ConfigError(
                "quality.used_share_low and used_share_high must be ordered and lie in 0..1"
            )
        shares = ("tooth_share", "undulation_share", "backlash_scatter", "run_in_share")
        limits = dict.fromkeys((*shares, *SUPPORT_SCATTERS), (0.0, 1.0))
        check_limits(self, "quality.", **limits, undulation_waves=(1, 50))
        if self.misalignment < 0.0:
            value = from_si("misalignment_um", self.misalignment)
            raise ConfigError(
                f"quality.misalignment_um = {value:g} must not be negative"
            )
        low, high = self.support_damping_ratio_low, self.support_damping_ratio_high
        if (low is None) != (high is None) or (
            low is not None and high is not None and not 0.0 < low <= high <= 1.0
        ):
            raise ConfigError(
                f"quality.support_damping_ratio_low = {low} and support_damping_ratio_high = "
                f"{high} must be ordered, "
                "above 0 and at most 1, or both null"
            )

    def check_covered(self, *gears: Gear) -> None:
        """Raise ConfigError where there is a grade and a gear that the standard does not cover."""
        if self.iso1328_grade is not None:
            for gear in gears:
                check_covered(gear)

    @property
    def support_damping_ratio(self) -> float | None:
        """The ratio in the middle of its range on a logarithmic scale.

        None where supports give their damping.
        """
        low, high = self.support_damping_ratio_low, self.support_damping_ratio_high
        if low is None or high is None:
            return None
        return float(np.sqrt(low * high))


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherGear:
    """A gear outside the followed mesh; ``drives`` is True where it drives in its home mesh."""

    gear: Gear
    drives: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class GearErrors:
    """Manufacturing errors of one gear.

    Parameters
    ----------
    error : (tooth,) m    how far every tooth stands back at the pitch point, as a gap
    tilt : (tooth,) m/m   how fast that grows with the contact's position along the path
    forms : deviations that the flanks of all its teeth share
    """

    error: Array
    tilt: Array
    forms: tuple[FlankForm, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Mounting:
    """Errors of the mounting of one mesh.

    ``backlash_factor`` is on the nominal backlash; ``misalignment`` in m is that of the driving
    gear over its face width, within plus and minus ``limit`` in m.
    """

    backlash_factor: float = 1.0
    misalignment: float = 0.0
    limit: float = 1e-6

    def forms(self, gear: str) -> tuple[FlankForm, ...]:
        """The misalignment as a form of the teeth of ``gear``; none where it is 0."""
        if self.misalignment == 0.0:
            return ()
        form = Misalignment(
            gear=gear, tooth=ALL, misalignment=self.misalignment, limit=self.limit
        )
        return (form,)


NOMINAL_MOUNTING = Mounting()


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """A set of gears.

    Parameters
    ----------
    pinion_error, wheel_error : (tooth,) m    how far every tooth stands back at the pitch point,
        as a gap
    pinion_tilt, wheel_tilt : (tooth,) m/m    how fast that grows with the contact's position along
        the path; 0: nowhere
    forms : deviations that the flanks of all teeth share, as transforms before a record's faults
    backlash_factor : on the nominal backlash
    others : errors of the gears outside the followed mesh, by their names; perfect without
    mountings : of the meshes that are not followed, in the order of ``Machine.meshes``; nominal
        without
    """

    pinion_error: Array
    wheel_error: Array
    pinion_tilt: Array | float = 0.0
    wheel_tilt: Array | float = 0.0
    forms: tuple[FlankForm, ...] = ()
    backlash_factor: float = 1.0
    others: Mapping[str, GearErrors] = field(default_factory=dict)
    mountings: tuple[Mounting, ...] = ()

    @property
    def gear_forms(self) -> tuple[FlankForm, ...]:
        """Forms of all gears, those of the followed mesh first."""
        further = [form for errors in self.others.values() for form in errors.forms]
        return (*self.forms, *further)

    def errors_of(self, name: str, n_teeth: int) -> GearErrors:
        """Errors of the teeth of a gear, without forms of its flanks; 0 without errors."""
        none = np.zeros(n_teeth)
        if name == "pinion":
            return GearErrors(error=self.pinion_error, tilt=self.pinion_tilt + none)
        if name == "wheel":
            return GearErrors(error=self.wheel_error, tilt=self.wheel_tilt + none)
        if name in self.others:
            return replace(self.others[name], forms=())
        return GearErrors(error=none, tilt=none)

    def mounting(self, number: int) -> Mounting:
        """Mounting of a mesh by its number among those that are not followed."""
        if number < len(self.mountings):
            return self.mountings[number]
        return NOMINAL_MOUNTING


@dataclass(frozen=True, slots=True, kw_only=True)
class Gearbox:
    """Housing, bearings and sensors: factors on the supports and gains of the channels.

    Supports are x and y of pinion, wheel and the further gears in the order of ``Machine.gears``.
    ``damping_ratio`` (support,) of the gears on their supports; None leaves the damping that the
    supports are given.
    """

    stiffness_factor: Array
    damping_factor: Array
    gain: Array
    damping_ratio: Array | None = None


def draw_specimen(
    rng: np.random.Generator,
    pinion: Gear,
    wheel: Gear,
    quality: Quality,
    *,
    others: Sequence[FurtherGear] = (),
    n_mountings: int = 0,
) -> Specimen:
    """Draw a set of gears within its grade.

    What is drawn does not depend on what is switched on, so that one key leaves the other
    deviations alone. Pinion, wheel and their mounting come first, then the ``others``, then the
    mountings of ``n_mountings`` further meshes.

    Raises
    ------
    ConfigError    for a gear that the standard does not cover
    """
    of_pinion = _draw_gear(rng, pinion, quality, drives=True)
    of_wheel = _draw_gear(rng, wheel, quality, drives=False)
    mounting = _draw_mounting(rng, quality)
    further = {
        other.gear.name: _draw_gear(rng, other.gear, quality, drives=other.drives)
        for other in others
    }
    mountings = tuple(_draw_mounting(rng, quality) for _ in range(n_mountings))
    if quality.iso1328_grade is None:
        return perfect_specimen(pinion, wheel)
    return Specimen(
        pinion_error=of_pinion.error,
        wheel_error=of_wheel.error,
        pinion_tilt=of_pinion.tilt,
        wheel_tilt=of_wheel.tilt,
        forms=(*of_pinion.forms, *of_wheel.forms, *mounting.forms(pinion.name)),
        backlash_factor=mounting.backlash_factor,
        others=further,
        mountings=mountings,
    )


def _draw_mounting(rng: np.random.Generator, quality: Quality) -> Mounting:
    """Misalignment and backlash of one mesh."""
    tilted, play = rng.uniform(-1.0, 1.0, 2)
    return Mounting(
        backlash_factor=1.0 + play * quality.backlash_scatter,
        misalignment=tilted * quality.misalignment,
        limit=max(quality.misalignment, 1e-6),
    )


def _draw_gear(
    rng: np.random.Generator, gear: Gear, quality: Quality, *, drives: bool
) -> GearErrors:
    """Errors of one gear; a driving gear's contact runs towards its tip, a driven one's away."""
    share = rng.uniform(quality.used_share_low, quality.used_share_high)
    runout_share, angle = rng.random(), rng.uniform(0.0, 2.0 * math.pi)
    shape = rng.standard_normal(gear.n_teeth)
    of_teeth = rng.uniform(-1.0, 1.0, gear.n_teeth)
    sign, waves = rng.choice((-1.0, 1.0)), int(rng.integers(1, FORM_WAVES + 1))
    if quality.iso1328_grade is None:
        return GearErrors(error=np.zeros(gear.n_teeth), tilt=np.zeros(gear.n_teeth))
    eccentricity, pitch_error = _scaled_index(
        gear, quality.iso1328_grade, share, runout_share, angle, shape
    )
    turn = 2.0 * math.pi / gear.n_teeth * np.arange(gear.n_teeth) - angle
    left = 1.0 - quality.run_in_share
    # the same turning point of an eccentric gear for all teeth in contact: its teeth do not step,
    # see the theory
    error = eccentricity * np.cos(turn) + left * pitch_error
    tilt = -eccentricity / gear.base_radius * np.sin(turn)
    if not quality.profile_errors:
        return GearErrors(error=error, tilt=tilt)
    slope = left * share * profile_slope_limit(gear, quality.iso1328_grade)
    form = left * share * profile_form_limit(gear, quality.iso1328_grade)
    involute = (
        math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
        - gear.junction_curvature_radius
    )
    # as the contact runs along the path
    towards_tip = -1.0
    if drives:
        towards_tip = 1.0
    tilt = tilt + towards_tip * quality.tooth_share * slope / involute * of_teeth
    common_slope = sign * (1.0 - quality.tooth_share) * slope
    common_form = (1.0 - quality.undulation_share) * form
    parts = (
        (common_slope, common_form, waves),
        (0.0, quality.undulation_share * form, quality.undulation_waves),
    )
    forms = tuple(
        ProfileError(
            gear=gear.name,
            tooth=ALL,
            profile_slope=float(part_slope),
            profile_form=float(height),
            profile_waves=float(n_waves),
            limit=slope + form,
        )
        for part_slope, height, n_waves in parts
        if part_slope or height
    )
    return GearErrors(error=error, tilt=tilt, forms=forms)


def _scaled_index(
    gear: Gear,
    grade: float,
    share: float,
    runout_share: float,
    angle: float,
    shape: Array,
) -> tuple[float, Array]:
    """Eccentricity in m and random pitch errors (tooth,) m that keep to the share of three limits.

    The random part has no once-per-turn part, so that all runout is the
    eccentricity's. It is as large as the single pitch deviation allows; the eccentricity starts
    at ``runout_share`` of what the runout allows and shrinks until the total index deviation
    fits. Arcs on the reference circle are cos(alpha) long along the line of action.
    """
    turn = 2.0 * math.pi / gear.n_teeth * np.arange(gear.n_teeth)
    random = shape - shape.mean()
    for once in (np.cos(turn), np.sin(turn)):
        random = random - 2.0 / gear.n_teeth * (random @ once) * once
    once = np.cos(turn - angle)
    arc = share * math.cos(gear.transverse_pressure_angle)
    step = arc * single_pitch_limit(gear, grade)
    total = arc * cumulative_pitch_limit(gear, grade)
    steps, steps_once = (np.diff(part, append=part[0]) for part in (random, once))
    most = 0.5 * runout_share * share * runout_limit(gear, grade)
    tried = np.linspace(most, 0.0, RUNOUT_STEPS + 1)
    # the largest random part at which no step of the sum is above its limit
    fits_once = np.abs(steps_once) * tried[:, None] <= step
    left = step - np.sign(steps) * tried[:, None] * steps_once
    room = np.where(fits_once, left, 0.0)
    height = (room / np.maximum(np.abs(steps), 1e-300)).min(axis=1)
    index = tried[:, None] * once + height[:, None] * random
    fits = (np.ptp(index, axis=1) <= total) & (height > 0.0)
    if fits.any():
        first = int(fits.argmax())
        return float(tried[first]), height[first] * random
    return 0.0, min(float(height[-1]), total / float(np.ptp(random))) * random


def perfect_specimen(pinion: Gear, wheel: Gear) -> Specimen:
    """Gears without errors."""
    return Specimen(
        pinion_error=np.zeros(pinion.n_teeth),
        wheel_error=np.zeros(wheel.n_teeth),
        pinion_tilt=np.zeros(pinion.n_teeth),
        wheel_tilt=np.zeros(wheel.n_teeth),
    )


def draw_gearbox(
    rng: np.random.Generator,
    n_channels: int,
    quality: Quality,
    gain_scatter: float,
    *,
    n_gears: int = 2,
) -> Gearbox:
    """Log-normal factors, so that none can turn negative.

    Those of the supports of pinion and wheel and of the gains come first, then those of the
    supports of further gears.
    """
    n_first, n_further = AXES * 2, AXES * (n_gears - 2)
    stiffness, damping = rng.standard_normal(n_first), rng.standard_normal(n_first)
    gain = np.exp(gain_scatter * rng.standard_normal(n_channels))
    stiffness = np.append(stiffness, rng.standard_normal(n_further))
    damping = np.append(damping, rng.standard_normal(n_further))
    return Gearbox(
        stiffness_factor=np.exp(quality.support_stiffness_scatter * stiffness),
        damping_factor=np.exp(quality.support_damping_scatter * damping),
        gain=gain,
    )


def nominal_gearbox(n_channels: int, *, n_gears: int = 2) -> Gearbox:
    """The gearbox as configured: no scatter."""
    n_supports = AXES * n_gears
    return Gearbox(
        stiffness_factor=np.ones(n_supports),
        damping_factor=np.ones(n_supports),
        gain=np.ones(n_channels),
    )


def with_damping_ratio(
    gearbox: Gearbox, rng: np.random.Generator, quality: Quality
) -> Gearbox:
    """Gearbox with a log-uniform damping ratio for each of its supports.

    Without a range in ``quality`` the gearbox stays as it is.
    """
    low, high = quality.support_damping_ratio_low, quality.support_damping_ratio_high
    if low is None or high is None:
        return gearbox
    n_supports = len(gearbox.stiffness_factor)
    ratio = np.exp(rng.uniform(np.log(low), np.log(high), n_supports))
    return replace(gearbox, damping_ratio=ratio)
