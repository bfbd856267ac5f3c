"""The experiment of a new gearbox: a plan over its rated speed and torque."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.commands.new.data_sheet import GearOption, check_positive
from gensig.commands.new.stages import Gearbox
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
LINE_RATE = 51200.0  # Hz, of sensing=geared_line_bearings
SPUR_STEPS, HELICAL_STEPS = 5, 8  # of a sample at that rate: errors of 1e-4 and 4e-4


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

    @property
    def shown_classes(self) -> Sequence[str]:
        """Classes of the plan."""
        return self.classes or CLASSES


def read_wishes(arguments: Namespace) -> Wishes:
    """The flags of the verb that are about the experiment."""
    names = set(Wishes.__dataclass_fields__) - {"base"}
    values = {name: getattr(arguments, name) for name in names}
    return Wishes(base=arguments.experiment, **values)


def experiment_text(gearbox: Gearbox, wishes: Wishes) -> str:
    """The file of the experiment, with the origin of each value."""
    for option in gearbox.stages:
        _check_rate(option, wishes)
    name, option = gearbox.sheet.name, gearbox.stages[0]
    n_classes = len(wishes.shown_classes)
    written = (
        f"# Written by gensig new gearbox: {N_UNITS * n_classes} records of {name}, "
        f"{n_classes} classes from {N_UNITS} machines. Faults are"
    )
    if len(gearbox.stages) > 1:
        head = [
            written,
            "# drawn in shares of a tooth, on any gear. On one gear: "
            "plan.fault_gear=as_given fault.gear=wheel",
        ]
        choices = [
            f"override /system: {name}",
            "override /sensing: geared_line_bearings  # along y at the bearings of all gears",
        ]
        signals = _integration(gearbox, wishes)
        drawn = [remarked("  fault_gear: drawn", "any gear, by equal chance")]
    else:
        head = [f"{written} drawn in shares of a tooth."]
        choices, signals, drawn = [], _bearings(option, wishes), []
        if wishes.is_realistic:
            head.append(
                f"# All else is that of experiment={REALISTIC}, assumed; "
                "so are the rotors of its unbalance, 1 and 4 kg."
            )
            choices.append(REALISTIC)
            signals = [*_couplings(option), *_housing(wishes)]
        if option.sheet.is_helical:
            choices.append("override /system: helical_pair")
        choices.append(f"override /gear: {name}")
        if tip_reliefs(option):
            choices.append(f"override /modification: {name}")
    lines = [
        "# @package _global_",
        *head,
        "defaults:",
        *[f"  - {choice}" for choice in (*choices, "_self_")],
        "",
        *_operating(option, wishes),
        *_quality(wishes),
        *signals,
        *_plan(option, wishes),
        *drawn,
    ]
    return "\n".join(lines) + "\n"


def remarked(text: str, remark: str) -> str:
    """A line of YAML with a remark behind it."""
    return f"{text:<32} # {remark}"


def short_text(value: float) -> str:
    """A number in three digits."""
    return f"{float(f'{value:.3g}'):g}"


def _check_rate(option: GearOption, wishes: Wishes) -> None:
    """Raise ConfigError where the mesh frequency lies above the usable band."""
    fastest = wishes.speed_shares[1] * option.gear["rated_speed_rpm"] / 60.0
    mesh = fastest * option.pair.pinion.n_teeth
    if wishes.rate is not None and not usable_band(wishes.rate)[1] > mesh:
        raise ConfigError(
            f"--rate {wishes.rate:g}: the mesh frequency reaches {mesh:.4g} Hz, "
            f"above the usable band of {usable_band(wishes.rate)[1]:.4g} Hz; "
            f"give a rate of several times {mesh / usable_band(1.0)[1]:.0f} Hz"
        )


def _origin_of(given: object) -> str:
    """The origin of a value that a flag may give."""
    if given is None:
        return "assumed"
    return "given"


def _operating(option: GearOption, wishes: Wishes) -> list[str]:
    """The group ``operating``: the duration of a record."""
    duration, remark = wishes.duration, "given"
    if duration is None:
        slowest = wishes.speed_shares[0] * option.gear["rated_speed_rpm"]
        least = LEAST_TURNS * 60.0 / slowest
        duration = max(1.0, math.ceil(10.0 * least) / 10.0)
        turns = f"{LEAST_TURNS} turns of the pinion"
        remark = f"derived: at least {turns} at the slowest speed"
    return ["operating:", remarked(f"  duration_s: {duration:g}", remark)]


def _quality(wishes: Wishes) -> list[str]:
    """The group ``quality`` for a grade of ISO 1328; empty where none is given."""
    grade = wishes.grade
    if grade is None:
        return []
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
    lines = ["sensing:", _rate(rate, wishes)]
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


def _rate(rate: float, wishes: Wishes) -> str:
    return remarked(f"  sampling_rate_hz: {rate:g}", _origin_of(wishes.rate))


def _bearings(option: GearOption, wishes: Wishes) -> list[str]:
    axes = "xy"
    if option.sheet.is_helical:
        axes = "yz"
    channels = [f"{gear}_{axis}" for gear in ("pinion", "wheel") for axis in axes]
    lines = ["sensing:"]
    if wishes.rate is not None:
        lines.append(_rate(wishes.rate, wishes))
    lines.append(remarked(f"  channels: [{', '.join(channels)}]", "at the bearings"))
    return lines


def _integration(gearbox: Gearbox, wishes: Wishes) -> list[str]:
    """The groups ``solver`` and ``sensing``: method, steps and sampling rate."""
    least = SPUR_STEPS
    if gearbox.sheet.is_helical:
        least = HELICAL_STEPS
    rate = wishes.rate or LINE_RATE
    steps = max(least, math.ceil(least * LINE_RATE / rate))
    lines = [
        "solver:",
        remarked(
            "  backend: nystroem", "two evaluations a step, friction in every mesh"
        ),
        remarked(
            f"  oversampling: {steps}",
            f"derived: steps of 1/{steps * rate:.0f} s, errors below 1e-3",
        ),
    ]
    if wishes.rate is not None:
        lines += ["sensing:", _rate(wishes.rate, wishes)]
    return lines


def _plan(option: GearOption, wishes: Wishes) -> list[str]:
    """The group ``plan``: counts, classes, and ranges of the rated speed and torque."""
    classes = wishes.shown_classes
    n_records = N_UNITS * len(classes)
    speed, torque = option.gear["rated_speed_rpm"], option.gear["rated_torque_nm"]
    torque_shares = wishes.torque_range or TORQUE_SHARES
    lowest = LOWEST_SNR[wishes.base]
    return [
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
        remarked(f"  classes: [{', '.join(classes)}]", _origin_of(wishes.classes)),
        "  vary:",
        _drawn("speed_rpm", speed, wishes.speed_shares, wishes.speed_range),
        _drawn("torque_nm", torque, torque_shares, wishes.torque_range),
        remarked(
            f"    sensing.snr_db: {{distribution: uniform, low: {lowest}, high: 30}}",
            "assumed",
        ),
    ]


def _drawn(key: str, rated: float, shares: Sequence[float], given: object) -> str:
    """A line of ``plan.vary`` for a range of shares of a rated value."""
    low, high = shares
    ends = f"low: {low * rated:.6g}, high: {high * rated:.6g}"
    return remarked(
        f"    operating.{key}: {{distribution: uniform, {ends}}}",
        f"{_origin_of(given)}: {low:g} to {high:g} of the rated",
    )


def _realistic(section: str) -> Section:
    return read_request([f"experiment={REALISTIC}"]).config.section(section)
