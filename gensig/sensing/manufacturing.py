"""What differs from one specimen and one gearbox to the next."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.geometry.gear import Gear

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """Manufacturing grade and scatter between gearboxes.

    ``iso1328_grade`` limits the single pitch deviation; a gear uses a share of the limit between ``used_share_low``
    and ``used_share_high``. None makes perfect gears. The support scatters are standard deviations of the logarithm.
    Where the damping ratios are given, each support of a gearbox has one between them, and their scatter is not read.
    """

    iso1328_grade: float | None
    used_share_low: float
    used_share_high: float
    support_stiffness_scatter: float
    support_damping_scatter: float
    support_damping_ratio_low: float | None = None
    support_damping_ratio_high: float | None = None

    def __post_init__(self) -> None:
        if self.iso1328_grade is not None and not 1 <= self.iso1328_grade <= 11:
            raise ConfigError(f"quality.iso1328_grade = {self.iso1328_grade:g} must lie in 1..11, or be null")
        if not 0.0 <= self.used_share_low <= self.used_share_high <= 1.0:
            raise ConfigError("quality.used_share_low and used_share_high must be ordered and lie in 0..1")
        for key in ("support_stiffness_scatter", "support_damping_scatter"):
            if not 0.0 <= getattr(self, key) <= 1.0:
                raise ConfigError(f"quality.{key} = {getattr(self, key):g} must lie in 0..1")
        low, high = self.support_damping_ratio_low, self.support_damping_ratio_high
        if (low is None) != (high is None) or (low is not None and high is not None and not 0.0 < low <= high <= 1.0):
            raise ConfigError(
                f"quality.support_damping_ratio_low = {low} and support_damping_ratio_high = {high} must be ordered, "
                "above 0 and at most 1, or both null"
            )

    @property
    def support_damping_ratio(self) -> float | None:
        """The ratio in the middle of its range on a logarithmic scale; None where supports give their damping."""
        low, high = self.support_damping_ratio_low, self.support_damping_ratio_high
        return None if low is None or high is None else float(np.sqrt(low * high))


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """A set of gears: position error of every tooth as a gap offset, (tooth,) m."""

    pinion_error: Array
    wheel_error: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Gearbox:
    """Housing, bearings and sensors: factors on the supports (pinion x, y, wheel x, y) and gains of the channels.

    ``damping_ratio`` (support,) of the gears on their supports; None leaves the damping that the supports are given.
    """

    stiffness_factor: Array
    damping_factor: Array
    gain: Array
    damping_ratio: Array | None = None


def single_pitch_limit(gear: Gear, grade: float) -> float:
    """Limit of the single pitch deviation, m.

    Source: ISO 1328-1:2013, f_pT = (0.001 d + 0.4 m + 5) sqrt(2)^(A - 5) with d and m in mm, result in micrometres.
    """
    diameter, module = 2e3 * gear.pitch_radius, 1e3 * gear.normal_module
    return 1e-6 * (0.001 * diameter + 0.4 * module + 5.0) * np.sqrt(2.0) ** (grade - 5.0)


def draw_specimen(rng: np.random.Generator, pinion: Gear, wheel: Gear, quality: Quality) -> Specimen:
    """Independent tooth positions whose largest step between neighbours is the used share of the limit."""
    errors = []
    for gear in (pinion, wheel):
        shape = rng.standard_normal(gear.n_teeth)
        share = rng.uniform(quality.used_share_low, quality.used_share_high)
        if quality.iso1328_grade is None:
            errors.append(np.zeros(gear.n_teeth))
            continue
        largest_step = np.abs(np.diff(np.append(shape, shape[0]))).max()
        error = shape / largest_step * share * single_pitch_limit(gear, quality.iso1328_grade)
        errors.append(error - error.mean())
    return Specimen(pinion_error=errors[0], wheel_error=errors[1])


def perfect_specimen(pinion: Gear, wheel: Gear) -> Specimen:
    """Gears without errors."""
    return Specimen(pinion_error=np.zeros(pinion.n_teeth), wheel_error=np.zeros(wheel.n_teeth))


def draw_gearbox(rng: np.random.Generator, n_channels: int, quality: Quality, gain_scatter: float) -> Gearbox:
    """Log-normal factors, so that none can turn negative."""
    return Gearbox(
        stiffness_factor=np.exp(quality.support_stiffness_scatter * rng.standard_normal(4)),
        damping_factor=np.exp(quality.support_damping_scatter * rng.standard_normal(4)),
        gain=np.exp(gain_scatter * rng.standard_normal(n_channels)),
    )


def nominal_gearbox(n_channels: int) -> Gearbox:
    """The gearbox as configured: no scatter."""
    return Gearbox(stiffness_factor=np.ones(4), damping_factor=np.ones(4), gain=np.ones(n_channels))


def with_damping_ratio(gearbox: Gearbox, rng: np.random.Generator, quality: Quality) -> Gearbox:
    """The gearbox with a damping ratio for each of its four supports, log-uniform, where ``quality`` has a range."""
    low, high = quality.support_damping_ratio_low, quality.support_damping_ratio_high
    if low is None or high is None:
        return gearbox
    return replace(gearbox, damping_ratio=np.exp(rng.uniform(np.log(low), np.log(high), 4)))
