"""Verb new: a gearbox of one's own from its data sheet, as options that every verb takes."""

from __future__ import annotations

import json
import math
import shlex
import sys
import warnings
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gensig.compose import options
from gensig.errors import ConfigError
from gensig.gearbox import DataSheet, GearOption, gear_option
from gensig.option_file import is_option_name

LEAST_TURNS = 10  # of the pinion in a record at the slowest speed
SPEED_SHARES, TORQUE_SHARES = (0.5, 1.2), (0.3, 1.2)  # of the rated ones, over which a plan draws

# attribute, what to ask, how many numbers, whether it is needed
QUESTIONS = (
    ("teeth", "teeth of pinion and wheel", 2, True),
    ("module", "normal module, mm", 1, True),
    ("speed", "rated speed of the pinion, r/min", 1, True),
    ("torque", "rated torque of the pinion, N m", 1, True),
    ("helix", "helix angle, degrees", 1, False),
    ("widths", "face widths of both, mm", 2, False),
    ("bores", "bore diameters of both, mm", 2, False),
    ("supports", "radial stiffness of what holds each gear, N/m", 2, False),
)


def new(arguments: Namespace) -> int:
    """Write the options of a gearbox, say what was derived and what to run next."""
    folder, name = Path(arguments.dir), arguments.name
    files = {group: folder / group / f"{name}.yaml" for group in ("gear", "experiment")}
    _check_name(name, files.values())
    _complete(arguments)
    option = gear_option(_sheet(arguments))
    _warn(option)
    texts = {"gear": option.text(), "experiment": _experiment(option)}
    for group, file in files.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(texts[group], encoding="utf-8")
    commands = _commands(folder, name)
    if arguments.json:
        content = {"files": [str(file) for file in files.values()], "derived": option.derived(), "next": commands}
        print(json.dumps(content))
    else:
        print(f"wrote {' and '.join(str(file) for file in files.values())}; each line there says where it is from")
        print("derived: " + ", ".join(f"{key} {value:.4g}" for key, value in option.derived().items()))
        print("next:", *(f"  {command}" for command in commands), sep="\n")
    return 0


def _check_name(name: str, files: Any) -> None:
    if not is_option_name(name):
        raise ConfigError(
            f"'{name}' cannot be the name of a gearbox: use a letter, then letters, digits, _ and -, at most 64"
        )
    for group in ("gear", "experiment"):
        if name in options(group):
            raise ConfigError(f"{group}={name} comes with gensig and would hide yours; choose another name")
    for file in files:
        if file.exists():
            raise ConfigError(f"{file} is there already; choose another name or --dir, or edit it")


def _complete(arguments: Namespace) -> None:
    """Ask for what was left out, on a terminal; elsewhere name all that is missing."""
    missing = [name for name, _, _, needed in QUESTIONS if needed and getattr(arguments, name) is None]
    if not missing:
        return
    if not sys.stdin.isatty():
        flags = ", ".join(f"--{name}" for name in missing)
        raise ConfigError(
            f"missing {flags}; for instance gensig new gearbox {arguments.name} --teeth 23 84 --module 2 --speed 1800 "
            "--torque 20"
        )
    for name, question, count, needed in QUESTIONS:
        if getattr(arguments, name) is None:
            answer = _ask(question, count, int if name == "teeth" else float, needed=needed)
            setattr(arguments, name, answer[0] if answer and count == 1 else answer)


def _ask(question: str, count: int, kind: Callable[[str], float], *, needed: bool) -> list[float] | None:
    hint = "" if needed else " (empty: assumed)"
    while True:
        words = input(f"{question}{hint}: ").replace(",", " ").split()
        if not words and not needed:
            return None
        try:
            numbers = [kind(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) == count:
            return numbers
        print(f"give {count} number{'s' * (count > 1)}")


def _sheet(arguments: Namespace) -> DataSheet:
    def both(values: list[float] | None) -> tuple[float, float] | None:
        return None if values is None else (values[0], values[-1])

    for name in ("widths", "bores", "supports", "profile_shifts"):
        if (given := getattr(arguments, name)) is not None and len(given) > 2:
            raise ConfigError(f"--{name.replace('_', '-')} takes one number for both gears, or two: pinion and wheel")
    return DataSheet(
        name=arguments.name,
        teeth=(arguments.teeth[0], arguments.teeth[1]),
        module=arguments.module,
        speed=arguments.speed,
        torque=arguments.torque,
        widths=both(arguments.widths),
        bores=both(arguments.bores),
        helix_angle=arguments.helix or 0.0,
        pressure_angle=arguments.pressure_angle,
        profile_shifts=both(arguments.profile_shifts),
        supports=both(arguments.supports),
    )


def _warn(option: GearOption) -> None:
    ratio = option.pair.transverse_contact_ratio
    if ratio < 1.0:
        warnings.warn(
            f"the transverse contact ratio {ratio:.3f} is below 1: the drive is interrupted at every tooth. gensig "
            "stiffness takes these gears, records are refused; use more teeth or another profile shift",
            stacklevel=2,
        )
    speed = 2.0 * math.pi / 60.0 * option.gear["rated_speed_rpm"] * option.pair.pinion.pitch_radius
    if speed > 100.0:
        warnings.warn(f"a pitch line speed of {speed:.0f} m/s; are speed and module right?", stacklevel=2)


def _experiment(option: GearOption) -> str:
    """A plan over all that the gears are rated for."""
    name, speed, torque = (option.gear[key] for key in ("name", "rated_speed_rpm", "rated_torque_nm"))
    duration = max(1.0, math.ceil(10.0 * LEAST_TURNS * 60.0 / (SPEED_SHARES[0] * speed)) / 10.0)
    helical = "  - override /system: helical_pair\n" if option.is_helical else ""
    channels = (
        "[pinion_y, pinion_z, wheel_y, wheel_z]" if option.is_helical else "[pinion_x, pinion_y, wheel_x, wheel_y]"
    )
    speeds, torques = (
        f"low: {shares[0] * rated:.6g}, high: {shares[1] * rated:.6g}"
        for shares, rated in ((SPEED_SHARES, speed), (TORQUE_SHARES, torque))
    )
    return f"""# @package _global_
# Written by gensig new gearbox: 80 records of {name}, five classes from 8 units. Faults are drawn in shares of a tooth.
defaults:
{helical}  - override /gear: {name}
  - _self_

operating:
  duration_s: {duration:g}                 # at least {LEAST_TURNS} turns of the pinion at the slowest speed
sensing:
  channels: {channels}   # at the bearings
plan:
  n_records: 80
  n_units: 8
  classes: [healthy, crack, pitting, chipped, missing_tooth]
  vary:                          # ranges assumed: shares of the rated values
    operating.speed_rpm: {{distribution: uniform, {speeds}}}
    operating.torque_nm: {{distribution: uniform, {torques}}}
    sensing.snr_db: {{distribution: uniform, low: 10, high: 30}}
"""


def _commands(folder: Path, name: str) -> list[str]:
    taken = f"--config-dir {shlex.quote(str(folder))} experiment={name}"
    return [
        f"gensig simulate {taken} fault=missing_tooth --plot {name}.png",
        f"gensig generate {taken} out=runs/{name}",
        f"gensig report runs/{name}",
    ]
