"""Verb new: a gearbox of one's own from its data sheet, as options that every verb takes."""

from __future__ import annotations

import json
import shlex
import sys
import tempfile
import warnings
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gensig.commands.new.data_sheet import DataSheet, GearOption, gear_option
from gensig.commands.new.experiment import experiment_text, read_wishes
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.options.compose import options
from gensig.plan.request import read_request
from gensig.systems.registry import SIDES, read_system
from gensig.text.option_writing import is_option_name

STRONGEST = 1000.0  # MPa; about twice sigma_Flim of case-hardened steel (ISO 6336-5), which a smooth root bears
SLACK = 1.0  # MPa of root stress, below which gears do no work
WIDTHS = (1.0, 25.0)  # modules
PITCH_LINE_SPEEDS = (0.05, 60.0)  # m/s
SLOWEST = 30.0  # r/min

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
    wishes = read_wishes(arguments)
    option = gear_option(_sheet(arguments))
    texts = {"gear": option.text(), "experiment": experiment_text(option, wishes)}
    _check_texts(name, texts)
    for message in doubts(option):
        warnings.warn(message, stacklevel=2)
    for group, file in files.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(texts[group], encoding="utf-8")
    commands = _commands(folder, name)
    if arguments.json:
        content = {
            "files": [str(file) for file in files.values()],
            "derived": option.derived(),
        }
        content |= {"bearings": option.bearings(), "next": commands}
        print(json.dumps(content))
    else:
        print(
            f"wrote {' and '.join(str(file) for file in files.values())}; each line there says where it is from"
        )
        print("with the gears as given it follows:")
        for key, value in option.derived().items():
            print(f"  {key:<32}{'-' if value is None else format(value, '.4g')}")
        for side, bearing in option.bearings().items():
            print(f"  {side + '_bearings':<32}{bearing}")
        print("next:", *(f"  {command}" for command in commands), sep="\n")
    return 0


def _check_name(name: str, files: Any) -> None:
    if not is_option_name(name):
        raise ConfigError(
            f"'{name}' cannot be the name of a gearbox: use a letter, then letters, digits, _ and -, at most 64"
        )
    for group in ("gear", "experiment"):
        if name in options(group):
            raise ConfigError(
                f"{group}={name} comes with gensig and would hide yours; choose another name"
            )
    for file in files:
        if file.exists():
            raise ConfigError(
                f"{file} is there already; choose another name or --dir, or edit it"
            )


def _complete(arguments: Namespace) -> None:
    """Ask for what was left out, on a terminal; elsewhere name all that is missing."""
    missing = [
        name
        for name, _, _, needed in QUESTIONS
        if needed and getattr(arguments, name) is None
    ]
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
            answer = _ask(
                question, count, int if name == "teeth" else float, needed=needed
            )
            setattr(arguments, name, answer[0] if answer and count == 1 else answer)


def _ask(
    question: str, count: int, kind: Callable[[str], float], *, needed: bool
) -> list[float] | None:
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
            raise ConfigError(
                f"--{name.replace('_', '-')} takes one number for both gears, or two: pinion and wheel"
            )
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
        addendum=arguments.addendum,
        profile_shifts=both(arguments.profile_shifts),
        supports=both(arguments.supports),
    )


def doubts(option: GearOption) -> list[str]:
    """What no pair of steel gears has, or what gensig will not simulate.

    Perhaps another unit was meant.
    """
    told, found = option.derived(), []
    ratio, speed, torque = (
        told["transverse_contact_ratio"],
        option.gear["rated_speed_rpm"],
        told["wheel_torque_nm"],
    )
    if ratio is not None and ratio < 1.0:
        found.append(
            f"the transverse contact ratio {ratio:.3f} is below 1: the drive is interrupted at every tooth. gensig "
            "stiffness takes these gears, records are refused; use more teeth or another profile shift"
        )
    if speed < SLOWEST:
        found.append(
            f"--speed {speed:g}: the pinion turns slower than {SLOWEST:g} r/min; is it r/min, not Hz?"
        )
    line_speed, (slow, fast) = told["pitch_line_speed_m_per_s"], PITCH_LINE_SPEEDS
    if line_speed is not None and not slow <= line_speed <= fast:
        found.append(
            f"a pitch line speed of {line_speed:.3g} m/s, outside {slow:g} to {fast:g}; are --speed in r/min of the "
            "pinion and --module in mm?"
        )
    for side in SIDES:
        modules = option.gear[side]["face_width_mm"] / option.gear["normal_module_mm"]
        if not WIDTHS[0] <= modules <= WIDTHS[1]:
            found.append(
                f"the {side} is {modules:.3g} modules wide, outside {WIDTHS[0]:g} to {WIDTHS[1]:g}; are --widths in mm?"
            )
    stress = told["nominal_root_stress_mpa"]
    if stress is not None and not SLACK <= stress <= STRONGEST:
        why = (
            f"no steel bears more than about {STRONGEST:g}"
            if stress > STRONGEST
            else "gears that do no work"
        )
        found.append(
            f"a nominal root stress of {stress:.3g} MPa: {why}; are --torque in N m of the pinion (the wheel has "
            f"{torque:.4g}) and --widths in mm?"
        )
    return found


def _check_texts(name: str, texts: dict[str, str]) -> None:
    """Raise for an experiment that does not compose, before anything is written."""
    with tempfile.TemporaryDirectory() as folder:
        for group, text in texts.items():
            (Path(folder) / group).mkdir()
            (Path(folder) / group / f"{name}.yaml").write_text(text, encoding="utf-8")
        request = read_request([f"experiment={name}"], config_dir=folder)
        for fault in request.config["classes"].values():
            read_faults(fault)
        read_system(request.config)


def _commands(folder: Path, name: str) -> list[str]:
    taken = f"--config-dir {shlex.quote(str(folder))} experiment={name}"
    return [
        f"gensig simulate {taken} fault=missing_tooth --plot {name}.png",
        f"gensig generate {taken} out=runs/{name}",
        f"gensig report runs/{name}",
    ]
