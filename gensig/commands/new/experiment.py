"""The experiment of a new gearbox: a plan over its rated speed and torque."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.commands.new.data_sheet import GearOption, check_positive
from gensig.commands.new.tip_relief import tip_reliefs
from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.plan.request import read_request

PLAIN, REALISTIC = "plain", "realistic"
LEAST_TURNS = 10  # of the pinion in a record at the slowest speed
# shares of the rated speed and torque over which a plan draws
SPEED_SHARES = (0.5, 1.2)
TORQUE_SHARES = (0.3, 1.2)
LARGEST_SHARE = 3.0
# A quarter of the units is tested: four machines, the fewest that make an interval.
N_UNITS = 16
CLASSES = ("healthy", "crack", "pitting", "chipped", "missing_tooth")
GRADE_STEP = math.sqrt(2.0)  # between the limits of neighboring grades of ISO 1328-1
LOWEST_SNR = {PLAIN: 10, REALISTIC: 5}  # dB


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """Flags on the experiment; None where left out. Ranges are shares of the rated values."""

    base: str = PLAIN
    rate: float | None = None
    duration: float | None = None
    grade: int | None = None
    classes: Sequence[str] | None = None
    sensors: Sequence[str] | None = None
    speed_range: Sequence[float] | None = None
    torque_range: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if self.sensors is not None and self.base == PLAIN:
            raise ConfigError(
                f"--sensors are on a housing: add --experiment {REALISTIC}"
            )
        check_positive("--duration", self.duration)
        ranges = {
            "--speed-range": self.speed_range,
            "--torque-range": self.torque_range,
        }
        for flag, shares in ranges.items():
            if shares is not None and not 0.0 < shares[0] < shares[1] <= LARGEST_SHARE:
                raise ConfigError(
                    f"{flag} {shares[0]:g} {shares[1]:g}: give shares of the rated value, "
                    f"lowest first, for instance {flag} 0.95 1.05"
                )

    @property
    def is_realistic(self) -> bool:
        """True for signals as measured, False for clean signals at the bearings."""
        return self.base == REALISTIC

    @property
    def speed_shares(self) -> Sequence[float]:
        """Lowest and highest speed over the rated one."""
        return self.speed_range or SPEED_SHARES


def read_wishes(arguments: Namespace) -> Wishes:
    """The flags of the verb that are about the experiment."""
    names = set(Wishes.__dataclass_fields__) - {"base"}
    values = {name: getattr(arguments, name) for name in names}
    return Wishes(base=arguments.experiment, **values)


def experiment_text(option: GearOption, wishes: Wishes) -> str:
    """The file of the experiment, with the origin of each value."""
    check_rate(option, wishes)
    name = option.gear["name"]
    classes = list(wishes.classes or CLASSES)
    n_records = N_UNITS * len(classes)
    lines = [
        "# @package _global_",
        f"# Written by gensig new gearbox: {n_records} records of {name}, "
        f"{len(classes)} classes from {N_UNITS} machines. "
        "Faults are drawn in shares of a tooth.",
    ]
    defaults = []
    if wishes.is_realistic:
        lines.append(
            f"# All else is that of experiment={REALISTIC}, assumed; "
            "so are the rotors of its unbalance, 1 and 4 kg."
        )
        defaults.append(f"  - {REALISTIC}")
    if option.is_helical:
        defaults.append("  - override /system: helical_pair")
    lines += ["defaults:", *defaults, f"  - override /gear: {name}"]
    if tip_reliefs(option):
        lines.append(f"  - override /modification: {name}")
    lines += ["  - _self_", ""]
    lines += operating_lines(option, wishes)
    if wishes.grade is not None:
        lines += quality_lines(wishes, wishes.grade)
    if wishes.is_realistic:
        lines += [*_couplings(option), *_housing(wishes)]
    else:
        lines += _bearings(option, wishes)
    lines += plan_lines(option, wishes, classes, n_records)
    return "\n".join(lines) + "\n"


def remarked(text: str, remark: str) -> str:
    """A line of YAML with a remark behind it."""
    return f"{text:<32} # {remark}"


def short_text(value: float) -> str:
    """A number in three digits."""
    return f"{float(f'{value:.3g}'):g}"


def check_rate(option: GearOption, wishes: Wishes) -> None:
    """Raise ConfigError where the mesh frequency lies above the usable band."""
    fastest = wishes.speed_shares[1] * option.gear["rated_speed_rpm"] / 60.0
    mesh = fastest * option.pair.pinion.n_teeth
    if wishes.rate is not None and not usable_band(wishes.rate)[1] > mesh:
        raise ConfigError(
            f"--rate {wishes.rate:g}: the mesh frequency reaches {mesh:.4g} Hz, "
            f"above the usable band of {usable_band(wishes.rate)[1]:.4g} Hz; "
            f"give a rate of several times {mesh / usable_band(1.0)[1]:.0f} Hz"
        )


def origin_of(given: object) -> str:
    """The origin of a value that a flag may give."""
    if given is None:
        return "assumed"
    return "given"


def operating_lines(option: GearOption, wishes: Wishes) -> list[str]:
    """The group ``operating``: the duration of a record."""
    duration, remark = wishes.duration, "given"
    if duration is None:
        slowest = wishes.speed_shares[0] * option.gear["rated_speed_rpm"]
        least = LEAST_TURNS * 60.0 / slowest
        duration = max(1.0, math.ceil(10.0 * least) / 10.0)
        turns = f"{LEAST_TURNS} turns of the pinion"
        remark = f"derived: at least {turns} at the slowest speed"
    return ["operating:", remarked(f"  duration_s: {duration:g}", remark)]


def quality_lines(wishes: Wishes, grade: int) -> list[str]:
    """The group ``quality`` for a grade of ISO 1328."""
    lines = ["quality:", remarked(f"  iso1328_grade: {grade}", "given")]
    if wishes.is_realistic:
        base = _realistic("quality")
        base_grade, base_tilt = base["iso1328_grade"], base["misalignment_um"]
        tilt = base_tilt * GRADE_STEP ** (grade - base_grade)
        remark = (
            f"assumed: {base_tilt:g} at grade {base_grade}, "
            "a factor of sqrt(2) a grade as in ISO 1328-1"
        )
        lines.append(remarked(f"  misalignment_um: {tilt:.3g}", remark))
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledRotor:
    """Motor or load of the realistic experiment, scaled to a torque as bodies of one shape.

    ``inertia`` kg m2 and ``stiffness`` N m/rad of its coupling; ``base_inertia``,
    ``base_stiffness`` are those at ``base_torque`` N m. An inertia goes with torque^(5/3), a
    coupling with the torque.
    """

    inertia: float
    stiffness: float
    base_inertia: float
    base_stiffness: float
    base_torque: float

    @property
    def origin(self) -> str:
        """The origin of the inertia, for a remark."""
        return f"{self.base_inertia:g} kg m2 at {self.base_torque:.3g} N m, times torque^(5/3)"


def scaled_rotor(name: str, torque: float) -> ScaledRotor:
    """The ``motor`` or the ``load`` of the realistic experiment for a torque of its shaft, N m."""
    body, gear = _realistic("system")[name], _realistic("gear")
    base_torque = gear["rated_torque_nm"]
    if name == "load":
        base_torque *= _ratio(gear)
    size = torque / base_torque
    inertia, stiffness = body["inertia_kg_m2"], body["coupling_stiffness_nm_per_rad"]
    return ScaledRotor(
        inertia=float(short_text(inertia * size ** (5 / 3))),
        stiffness=float(short_text(stiffness * size)),
        base_inertia=inertia,
        base_stiffness=stiffness,
        base_torque=base_torque,
    )


def _couplings(option: GearOption) -> list[str]:
    """Motor and load of the realistic experiment, scaled as bodies of one shape."""
    gear, lines = option.gear, ["system:"]
    torque = gear["rated_torque_nm"]
    for name, of_rotor in (("motor", torque), ("load", torque * _ratio(gear))):
        rotor = scaled_rotor(name, of_rotor)
        lines += [
            f"  {name}:",
            remarked(
                f"    inertia_kg_m2: {rotor.inertia:g}",
                f"assumed: {rotor.base_inertia:g} at {rotor.base_torque:.3g} N m, "
                "times torque^(5/3), bodies of one shape",
            ),
            remarked(
                f"    coupling_stiffness_nm_per_rad: {rotor.stiffness:g}",
                f"assumed: {rotor.base_stiffness:g} there, likewise",
            ),
        ]
    return lines


def _ratio(gear: Mapping[str, Any]) -> float:
    return float(gear["wheel"]["n_teeth"] / gear["pinion"]["n_teeth"])


def _housing(wishes: Wishes) -> list[str]:
    """Sensors on the housing, their path and noise cut to the sampling rate."""
    sensing, rate = _realistic("sensing"), wishes.rate
    if rate is None:
        rate = sensing["sampling_rate_hz"]
    lines = [
        "sensing:",
        remarked(f"  sampling_rate_hz: {rate:g}", origin_of(wishes.rate)),
    ]
    if wishes.sensors is not None:
        lines.append(remarked(f"  sensors: [{', '.join(wishes.sensors)}]", "given"))
    lowest, highest = sensing["path"]["natural_frequency_hz"]
    usable = usable_band(rate)[1]
    if highest > usable:
        low = min(lowest, 0.5 * usable)
        band = f"    natural_frequency_hz: [{low:g}, {usable:g}]"
        remark = f"assumed, {highest:g} cut to the usable band of the rate"
        lines += ["  path:", remarked(band, remark)]
    low, high = sensing["noise"]["band_hz"]
    if high > 0.5 * rate:
        band = f"    band_hz: [{low:g}, {0.5 * rate:g}]"
        lines += ["  noise:", remarked(band, f"assumed, {high:g} cut to half the rate")]
    return lines


def _bearings(option: GearOption, wishes: Wishes) -> list[str]:
    axes = "xy"
    if option.is_helical:
        axes = "yz"
    channels = [f"{gear}_{axis}" for gear in ("pinion", "wheel") for axis in axes]
    lines = ["sensing:"]
    if wishes.rate is not None:
        lines.append(remarked(f"  sampling_rate_hz: {wishes.rate:g}", "given"))
    lines.append(remarked(f"  channels: [{', '.join(channels)}]", "at the bearings"))
    return lines


def plan_lines(
    option: GearOption, wishes: Wishes, classes: list[str], n_records: int
) -> list[str]:
    """The group ``plan``: counts, classes, and ranges of the rated speed and torque."""
    speed, torque = option.gear["rated_speed_rpm"], option.gear["rated_torque_nm"]
    torque_shares = wishes.torque_range or TORQUE_SHARES
    lowest = LOWEST_SNR[wishes.base]
    lines = [
        "plan:",
        remarked(f"  n_records: {n_records}", "assumed: one of each class and machine"),
        remarked(
            f"  n_units: {N_UNITS}",
            "assumed; a machine is one set of gears in one housing",
        ),
        remarked(
            "  n_gearboxes: null",
            "about the square root of n_units; 1: all sets of gears in one housing, yours",
        ),
        remarked(f"  classes: [{', '.join(classes)}]", origin_of(wishes.classes)),
        "  vary:",
        _drawn("speed_rpm", speed, wishes.speed_shares, wishes.speed_range),
        _drawn("torque_nm", torque, torque_shares, wishes.torque_range),
        remarked(
            f"    sensing.snr_db: {{distribution: uniform, low: {lowest}, high: 30}}",
            "assumed",
        ),
    ]
    return lines


def _drawn(key: str, rated: float, shares: Sequence[float], given: object) -> str:
    """A line of ``plan.vary`` for a range of shares of a rated value."""
    low, high = shares
    ends = f"low: {low * rated:.6g}, high: {high * rated:.6g}"
    return remarked(
        f"    operating.{key}: {{distribution: uniform, {ends}}}",
        f"{origin_of(given)}: {low:g} to {high:g} of the rated",
    )


def _realistic(section: str) -> Section:
    return read_request([f"experiment={REALISTIC}"]).config.section(section)
