"""The experiment of a gearbox of one's own.

A plan over its rated speed and torque, at the bearings or as measured.
"""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.commands.new.data_sheet import GearOption
from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request

PLAIN, REALISTIC = "plain", "realistic"
LEAST_TURNS = 10  # of the pinion in a record at the slowest speed
SPEED_SHARES, TORQUE_SHARES = (
    (0.5, 1.2),
    (0.3, 1.2),
)  # of the rated ones, over which a plan draws
LARGEST_SHARE = 3.0
N_UNITS = (
    16  # a quarter of them is tested: four machines, the fewest that make an interval
)
CLASSES = ("healthy", "crack", "pitting", "chipped", "missing_tooth")
GRADE_STEP = math.sqrt(2.0)  # between the limits of neighbouring grades of ISO 1328-1


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """What was asked of the experiment.

    None where it was left out. Ranges are shares of the rated values.
    """

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
        for flag, shares in (
            ("--speed-range", self.speed_range),
            ("--torque-range", self.torque_range),
        ):
            if shares is not None and not 0.0 < shares[0] < shares[1] <= LARGEST_SHARE:
                raise ConfigError(
                    f"{flag} {shares[0]:g} {shares[1]:g}: give shares of the rated value, lowest first, for instance "
                    f"{flag} 0.95 1.05"
                )


def read_wishes(arguments: Namespace) -> Wishes:
    """The flags of the verb that are about the experiment."""
    names = (
        "rate",
        "duration",
        "grade",
        "classes",
        "sensors",
        "speed_range",
        "torque_range",
    )
    return Wishes(
        base=arguments.experiment, **{name: getattr(arguments, name) for name in names}
    )


def experiment_text(option: GearOption, wishes: Wishes) -> str:
    """The file of the experiment, each value with where it is from."""
    _check_rate(option, wishes)
    name = option.gear["name"]
    classes = list(wishes.classes or CLASSES)
    n_records = N_UNITS * len(classes)
    about = (
        f"{n_records} records of {name}, {len(classes)} classes from {N_UNITS} units"
    )
    realistic = wishes.base == REALISTIC
    lines = [
        "# @package _global_",
        f"# Written by gensig new gearbox: {about}. Faults are drawn in shares of a tooth.",
        *([f"# All else is that of experiment={REALISTIC}, assumed; so are the rotors of its unbalance, 1 and 4 kg."]
          if realistic else []),
        "defaults:",
        *([f"  - {REALISTIC}"] if realistic else []),
        *(["  - override /system: helical_pair"] if option.is_helical else []),
        f"  - override /gear: {name}",
        "  - _self_",
        "",
        *_operating(option, wishes),
        *(_quality(wishes) if wishes.grade is not None else []),
        *(_couplings(option) if realistic else []),
        *(_housing(wishes) if realistic else _bearings(option, wishes)),
        *_plan(option, wishes, classes, n_records),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _line(text: str, remark: str) -> str:
    return f"{text:<32} # {remark}"


def _short(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"


def _check_rate(option: GearOption, wishes: Wishes) -> None:
    """Raise where the mesh is not heard."""
    fastest = (
        (wishes.speed_range or SPEED_SHARES)[1] * option.gear["rated_speed_rpm"] / 60.0
    )
    mesh = fastest * option.pair.pinion.n_teeth
    if wishes.rate is not None and not usable_band(wishes.rate)[1] > mesh:
        raise ConfigError(
            f"--rate {wishes.rate:g}: the mesh frequency reaches {mesh:.4g} Hz, above the usable band of "
            f"{usable_band(wishes.rate)[1]:.4g} Hz; give a rate of several times {mesh / usable_band(1.0)[1]:.0f} Hz"
        )


def _origin(given: object) -> str:
    return "assumed" if given is None else "given"


def _operating(option: GearOption, wishes: Wishes) -> list[str]:
    slowest = (wishes.speed_range or SPEED_SHARES)[0] * option.gear["rated_speed_rpm"]
    least = LEAST_TURNS * 60.0 / slowest
    duration = (
        max(1.0, math.ceil(10.0 * least) / 10.0)
        if wishes.duration is None
        else wishes.duration
    )
    if not (math.isfinite(duration) and duration > 0.0):
        raise ConfigError(f"--duration {duration:g} must be positive")
    derived = (
        f"derived: at least {LEAST_TURNS} turns of the pinion at the slowest speed"
    )
    return [
        "operating:",
        _line(
            f"  duration_s: {duration:g}",
            derived if wishes.duration is None else "given",
        ),
    ]


def _quality(wishes: Wishes) -> list[str]:
    lines = ["quality:", _line(f"  iso1328_grade: {wishes.grade}", "given")]
    if wishes.base == REALISTIC and wishes.grade is not None:
        quality = _realistic()["quality"]
        steps = wishes.grade - quality["iso1328_grade"]
        tilt = quality["misalignment_um"] * GRADE_STEP**steps
        there = f"{quality['misalignment_um']:g} at grade {quality['iso1328_grade']}"
        remark = f"assumed: {there}, a factor of sqrt(2) a grade as in ISO 1328-1"
        lines.append(_line(f"  misalignment_um: {tilt:.3g}", remark))
    return lines


def _couplings(option: GearOption) -> list[str]:
    """Motor and load of the realistic experiment, as bodies of the same shape for the rated
    torque.
    """
    base = _realistic()
    torque = option.gear["rated_torque_nm"]
    lines = ["system:"]
    for name, ratio, there_ratio in (
        ("motor", 1.0, 1.0),
        ("load", _ratio(option.gear), _ratio(base["gear"])),
    ):
        body, there = (
            base["system"][name],
            base["gear"]["rated_torque_nm"] * there_ratio,
        )
        size = torque * ratio / there
        inertia, stiffness = (
            body["inertia_kg_m2"],
            body["coupling_stiffness_nm_per_rad"],
        )
        lines += [
            f"  {name}:",
            _line(
                f"    inertia_kg_m2: {_short(inertia * size ** (5 / 3))}",
                f"assumed: {inertia:g} at {there:.3g} N m, times torque^(5/3), bodies of one shape",
            ),
            _line(
                f"    coupling_stiffness_nm_per_rad: {_short(stiffness * size)}",
                f"assumed: {stiffness:g} there, likewise",
            ),
        ]
    return lines


def _ratio(gear: Mapping[str, Any]) -> float:
    return float(gear["wheel"]["n_teeth"] / gear["pinion"]["n_teeth"])


def _housing(wishes: Wishes) -> list[str]:
    sensing = _realistic()["sensing"]
    rate = sensing["sampling_rate_hz"] if wishes.rate is None else wishes.rate
    lines = ["sensing:", _line(f"  sampling_rate_hz: {rate:g}", _origin(wishes.rate))]
    if wishes.sensors is not None:
        lines.append(_line(f"  sensors: [{', '.join(wishes.sensors)}]", "given"))
    (lowest, highest), band = (
        sensing["path"]["natural_frequency_hz"],
        sensing["noise"]["band_hz"],
    )
    usable = usable_band(rate)[1]
    if highest > usable:
        lines += [
            "  path:",
            _line(
                f"    natural_frequency_hz: [{min(lowest, 0.5 * usable):g}, {usable:g}]",
                f"assumed, {highest:g} cut to the usable band of the rate",
            ),
        ]
    if band[1] > 0.5 * rate:
        lines += [
            "  noise:",
            _line(
                f"    band_hz: [{band[0]:g}, {0.5 * rate:g}]",
                f"assumed, {band[1]:g} cut to half the rate",
            ),
        ]
    return lines


def _bearings(option: GearOption, wishes: Wishes) -> list[str]:
    axes = "yz" if option.is_helical else "xy"
    channels = ", ".join(
        f"{gear}_{axis}" for gear in ("pinion", "wheel") for axis in axes
    )
    rate = (
        []
        if wishes.rate is None
        else [_line(f"  sampling_rate_hz: {wishes.rate:g}", "given")]
    )
    return ["sensing:", *rate, _line(f"  channels: [{channels}]", "at the bearings")]


def _plan(
    option: GearOption, wishes: Wishes, classes: list[str], n_records: int
) -> list[str]:
    ranges = []
    for key, rated, given, assumed in (
        ("speed_rpm", option.gear["rated_speed_rpm"], wishes.speed_range, SPEED_SHARES),
        (
            "torque_nm",
            option.gear["rated_torque_nm"],
            wishes.torque_range,
            TORQUE_SHARES,
        ),
    ):
        low, high = given or assumed
        ranges.append(
            _line(
                f"    operating.{key}: {{distribution: uniform, low: {low * rated:.6g}, high: {high * rated:.6g}}}",
                f"{_origin(given)}: {low:g} to {high:g} of the rated",
            )
        )
    lowest = 5 if wishes.base == REALISTIC else 10
    shards = [
        "dataset:",
        _line(
            f"  records_per_shard: {4 * len(classes)}",
            "whole groups; small shards keep two workers busy to the end",
        ),
    ]
    return [
        "plan:",
        _line(f"  n_records: {n_records}", "assumed: one of each class and unit"),
        _line(
            f"  n_units: {N_UNITS}",
            "assumed; a unit is one set of gears in one housing",
        ),
        _line(
            "  n_gearboxes: null",
            "about the square root of n_units; 1: all sets of gears in one housing, yours",
        ),
        _line(f"  classes: [{', '.join(classes)}]", _origin(wishes.classes)),
        "  vary:",
        *ranges,
        _line(
            f"    sensing.snr_db: {{distribution: uniform, low: {lowest}, high: 30}}",
            "assumed",
        ),
        *(shards if wishes.base == REALISTIC else []),
    ]


def _realistic() -> Configuration:
    return read_request([f"experiment={REALISTIC}"]).config
