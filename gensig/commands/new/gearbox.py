"""``gensig new gearbox``: options of a gearbox from its data sheet."""

from __future__ import annotations

import json
import shlex
import sys
import tempfile
import warnings
from argparse import Namespace
from collections.abc import Callable, Iterable, Mapping
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

GROUPS = ("gear", "experiment")
# MPa; about twice sigma_Flim of case-hardened steel (ISO 6336-5), which a smooth root bears
STRONGEST = 1000.0
LEAST_STRESS = 1.0  # MPa at the root, below which gears do no work
WIDTHS = (1.0, 25.0)  # modules
PITCH_LINE_SPEEDS = (0.05, 60.0)  # m/s
SLOWEST = 30.0  # r/min

# attribute, question, number of values; those that are needed come first
NEEDED = (
    ("teeth", "teeth of pinion and wheel", 2),
    ("module", "normal module, mm", 1),
    ("speed", "rated speed of the pinion, r/min", 1),
    ("torque", "rated torque of the pinion, N m", 1),
)
OPTIONAL = (
    ("helix", "helix angle, degrees", 1),
    ("widths", "face widths of both, mm", 2),
    ("bores", "bore diameters of both, mm", 2),
    ("supports", "radial stiffness of what holds each gear, N/m", 2),
)
PAIRS = ("widths", "bores", "supports", "profile_shifts")


def new(arguments: Namespace) -> int:
    """Write the options of a gearbox, and print derived values and the next commands."""
    folder, name = Path(arguments.dir), arguments.name
    files = {group: folder / group / f"{name}.yaml" for group in GROUPS}
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
    content: dict[str, Any] = {
        "files": [str(file) for file in files.values()],
        "derived": option.derived(),
        "bearings": option.bearings(),
        "next": _commands(folder, name),
    }
    if arguments.json:
        print(json.dumps(content))
        return 0
    names = " and ".join(content["files"])
    print(f"wrote {names}; each line there says where it is from")
    print("with the gears as given it follows:")
    for key, value in content["derived"].items():
        text = "-"
        if value is not None:
            text = format(value, ".4g")
        print(f"  {key:<32}{text}")
    for side, bearing in content["bearings"].items():
        print(f"  {side + '_bearings':<32}{bearing}")
    print("next:", *content["next"], sep="\n  ")
    return 0


def _check_name(name: str, files: Iterable[Path]) -> None:
    if not is_option_name(name):
        raise ConfigError(
            f"'{name}' cannot be the name of a gearbox: "
            "use a letter, then letters, digits, _ and -, at most 64"
        )
    for group in GROUPS:
        if name in options(group):
            raise ConfigError(
                f"{group}={name} comes with gensig and would hide yours; "
                "choose another name"
            )
    for file in files:
        if file.exists():
            raise ConfigError(
                f"{file} is there already; choose another name or --dir, or edit it"
            )


def _complete(arguments: Namespace) -> None:
    """Ask for missing values on a terminal; elsewhere raise ConfigError that names them."""
    missing = [name for name, _, _ in NEEDED if getattr(arguments, name) is None]
    if not missing:
        return
    if not sys.stdin.isatty():
        flags = ", ".join(f"--{name}" for name in missing)
        raise ConfigError(
            f"missing {flags}; for instance gensig new gearbox {arguments.name} "
            "--teeth 23 84 --module 2 --speed 1800 --torque 20"
        )
    for name, question, count in (*NEEDED, *OPTIONAL):
        if getattr(arguments, name) is None:
            if name in missing:
                answer = _ask(question, count, needed=True)
            else:
                answer = _ask(f"{question} (empty: assumed)", count, needed=False)
            setattr(arguments, name, answer)


def _ask(question: str, count: int, *, needed: bool) -> float | list[float] | None:
    """The numbers that are typed, one alone as itself; None for an empty optional answer."""
    kind: Callable[[str], float] = float
    if question == NEEDED[0][1]:
        kind = int
    while True:
        words = input(f"{question}: ").replace(",", " ").split()
        if not words and not needed:
            return None
        try:
            numbers = [kind(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) == count == 1:
            return numbers[0]
        if len(numbers) == count:
            return numbers
        print(f"give {count} number{'s' * (count > 1)}")


def _sheet(arguments: Namespace) -> DataSheet:
    pairs = {}
    for name in PAIRS:
        given = getattr(arguments, name)
        if given is None:
            continue
        if len(given) > 2:
            raise ConfigError(
                f"--{name.replace('_', '-')} takes one number for both gears, "
                "or two: pinion and wheel"
            )
        pairs[name] = (given[0], given[-1])
    return DataSheet(
        name=arguments.name,
        teeth=tuple(arguments.teeth),
        module=arguments.module,
        speed=arguments.speed,
        torque=arguments.torque,
        helix_angle=arguments.helix or 0.0,
        pressure_angle=arguments.pressure_angle,
        addendum=arguments.addendum,
        **pairs,
    )


def doubts(option: GearOption) -> list[str]:
    """Warnings of values that no pair of steel gears has, or that gensig will not simulate.

    They often mean that another unit was meant.
    """
    values, result = option.derived(), []
    gear = option.gear
    ratio = option.pair.transverse_contact_ratio
    if ratio < 1.0:
        result.append(
            f"the transverse contact ratio {ratio:.3f} is below 1: the drive is "
            "interrupted at every tooth. gensig stiffness takes these gears, records are "
            "refused; use more teeth or another profile shift"
        )
    speed = gear["rated_speed_rpm"]
    if speed < SLOWEST:
        result.append(
            f"--speed {speed:g}: the pinion turns slower than {SLOWEST:g} r/min; "
            "is it r/min, not Hz?"
        )
    line_speed, (slow, fast) = values["pitch_line_speed_m_per_s"], PITCH_LINE_SPEEDS
    if line_speed is not None and not slow <= line_speed <= fast:
        result.append(
            f"a pitch line speed of {line_speed:.3g} m/s, outside {slow:g} to {fast:g}; "
            "are --speed in r/min of the pinion and --module in mm?"
        )
    for side in SIDES:
        modules = gear[side]["face_width_mm"] / gear["normal_module_mm"]
        if not WIDTHS[0] <= modules <= WIDTHS[1]:
            result.append(
                f"the {side} is {modules:.3g} modules wide, outside {WIDTHS[0]:g} "
                f"to {WIDTHS[1]:g}; are --widths in mm?"
            )
    stress, torque = values["nominal_root_stress_mpa"], values["wheel_torque_nm"]
    if stress is not None and not LEAST_STRESS <= stress <= STRONGEST:
        reason = "gears that do no work"
        if stress > STRONGEST:
            reason = f"no steel bears more than about {STRONGEST:g}"
        result.append(
            f"a nominal root stress of {stress:.3g} MPa: {reason}; are --torque in N m of "
            f"the pinion (the wheel has {torque:.4g}) and --widths in mm?"
        )
    return result


def _check_texts(name: str, texts: Mapping[str, str]) -> None:
    """Raise ConfigError for an experiment that does not compose, before anything is written."""
    with tempfile.TemporaryDirectory() as folder:
        for group, text in texts.items():
            file = Path(folder) / group / f"{name}.yaml"
            file.parent.mkdir()
            file.write_text(text, encoding="utf-8")
        config = read_request([f"experiment={name}"], config_dir=folder).config
        for fault in config["classes"].values():
            read_faults(fault)
        read_system(config)


def _commands(folder: Path, name: str) -> list[str]:
    words = f"--config-dir {shlex.quote(str(folder))} experiment={name}"
    return [
        f"gensig simulate {words} fault=missing_tooth --plot {name}.png",
        f"gensig generate {words} out=runs/{name}",
        f"gensig report runs/{name}",
    ]
