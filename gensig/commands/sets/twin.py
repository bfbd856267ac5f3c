"""Verb twin: a configuration like a measured healthy machine."""

from __future__ import annotations

import math
import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import Recording
from gensig.systems.registry import read_system
from gensig.twin.check import check, held_out_duration
from gensig.twin.fitting import Fit, fit
from gensig.twin.machine_recording import read_recording
from gensig.twin.speed import find_motion
from gensig.twin.summary import check_summary, fitted_rows, report_text, verdict
from gensig.twin.writing import option_name, write_options

FACE_WIDTH_IN_MODULES = 10.0
BORE_SHARE = 0.4  # of the smaller pitch radius
GEAR_WORD = "gear."


def twin(arguments: Namespace) -> int:
    """Fit a twin, write its options, hold it beside what it was not fitted to, and say so."""
    out = Path(arguments.out)
    name = option_name(out)
    recording = _read(arguments.recording, arguments)
    gear, remarks = _gear(arguments, name)
    torque, torque_from = _torque(arguments, gear)
    fitted_part, held_out, held_out_name = _split(recording, arguments)
    teeth = Teeth(driving=arguments.teeth[0], driven=arguments.teeth[1])
    system = read_system(_config(gear, torque, arguments.speed))
    fitted = fit(fitted_part, system, arguments.speed, _tell)
    speed = 60.0 * fitted.motion.mesh_frequency / teeth.driving
    gear = {**gear, "rated_speed_rpm": round(speed, 4), "rated_torque_nm": torque}
    remarks |= {"rated_speed_rpm": "fitted", "rated_torque_nm": torque_from}
    motion = find_motion(held_out, teeth, arguments.speed)
    write_options(out, fitted, gear, remarks, torque, duration=1.0)
    duration = held_out_duration(held_out, fitted_part)
    words = [f"experiment={name}", f"operating.duration_s={duration!r}"]
    _tell("simulating healthy records of the twin")
    found = check(
        read_request(words, config_dir=out).config, held_out, motion, fitted_part, teeth
    )
    assumed = {f"gear.{key}": text for key, text in remarks.items() if text != "fitted"}
    typed = [
        arguments.recording,
        "--teeth",
        *map(str, arguments.teeth),
        "--speed",
        f"{arguments.speed:g}",
    ]
    text = report_text(
        name, fitted, found, assumed, held_out_name, teeth.driving, typed
    )
    (out / "report.md").write_text(text, encoding="utf-8")
    from gensig.commands.figures.twin_figure import plot_twin

    plot_twin(fitted, found, out / "report.png")
    _print(fitted, teeth)
    print(*check_summary(found), sep="\n")
    print(verdict(found))
    print(
        f"{out}/report.md has it all; gensig generate --config-dir {out} experiment={name} out=runs/{name}"
    )
    return 0


def _print(fitted: Fit, teeth: Teeth) -> None:
    for key, value in fitted_rows(fitted, teeth.driving):
        print(f"{key:<16}{value}")


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _read(file: str, arguments: Namespace) -> Recording:
    return read_recording(
        file,
        rate=arguments.rate,
        unit=arguments.unit,
        channels=arguments.channels,
        array=arguments.array,
    )


def _split(
    recording: Recording, arguments: Namespace
) -> tuple[Recording, Recording, str]:
    """What is fitted to, what is held out, and how to name that."""
    if arguments.check is None:
        return (
            recording.part(0.0, 0.5),
            recording.part(0.5, 1.0),
            "The second half of the recording",
        )
    held_out = _read(arguments.check, arguments)
    if held_out.sensors != recording.sensors:
        raise ConfigError(
            f"--check {arguments.check} has the channels {', '.join(held_out.sensors)}, the recording has "
            f"{', '.join(recording.sensors)}; give the same, in the same order"
        )
    if not math.isclose(held_out.sampling_rate, recording.sampling_rate, rel_tol=1e-3):
        raise ConfigError(
            f"--check {arguments.check} has {held_out.sampling_rate:g} samples a second, the recording "
            f"{recording.sampling_rate:g}; resample one of them"
        )
    return recording, held_out, f"`{arguments.check}`"


def _gear(arguments: Namespace, name: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The group ``gear`` of the machine, and where each value that was not fitted is from."""
    n_driving, n_driven = arguments.teeth
    module = 2.0 if arguments.module is None else arguments.module
    for key, value in (
        ("--speed", arguments.speed),
        ("--module", module),
        ("--torque", arguments.torque),
    ):
        if value is not None and not (value > 0.0 and math.isfinite(value)):
            raise ConfigError(f"{key} {value:g} must be positive")
    if wrong := [
        word for word in arguments.overrides if not word.startswith(GEAR_WORD)
    ]:
        raise ConfigError(
            f"{wrong[0]}: twin takes overrides of the gears only, such as gear.pinion.face_width_mm=15"
        )
    typed = {word.partition("=")[0] for word in arguments.overrides}
    for key, flag in (("gear.pinion.n_teeth", "--teeth"), ("gear.wheel.n_teeth", "--teeth"),
                      ("gear.normal_module_mm", "--module")):  # fmt: skip
        if key in typed:
            raise ConfigError(f"{key} is what {flag} says; leave it out")
    bore = round(BORE_SHARE * 0.5 * module * min(n_driving, n_driven), 3)
    own: dict[str, Any] = {"gear.normal_module_mm": module, "gear.name": name}
    for side, n_teeth in (("pinion", n_driving), ("wheel", n_driven)):
        own |= {
            f"gear.{side}.n_teeth": n_teeth,
            f"gear.{side}.face_width_mm": FACE_WIDTH_IN_MODULES * module,
            f"gear.{side}.bore_radius_mm": bore,
            f"gear.{side}.mass_kg": "null",
            f"gear.{side}.inertia_kg_m2": "null",
        }
    words = [f"{key}={value}" for key, value in own.items() if key not in typed]
    gear = read_request([*words, *arguments.overrides]).config["gear"].plain()
    return gear, _remarks(gear, typed, arguments.module is not None)


def _remarks(
    gear: dict[str, Any], typed: set[str], knows_module: bool
) -> dict[str, str]:
    remarks = {
        key: "assumed, the default's"
        for key in gear
        if key not in ("name", "pinion", "wheel", "normal_module_mm")
    }
    remarks["normal_module_mm"] = "given" if knows_module else "assumed"
    for side in ("pinion", "wheel"):
        remarks |= {
            f"{side}.n_teeth": "given",
            f"{side}.profile_shift": "assumed",
            f"{side}.face_width_mm": f"assumed: {FACE_WIDTH_IN_MODULES:g} modules",
            f"{side}.bore_radius_mm": f"assumed: {BORE_SHARE:g} of the smaller pitch radius",
            f"{side}.mass_kg": "derived from a solid disc",
            f"{side}.inertia_kg_m2": "derived from a solid disc",
        }
        for part in ("support", "bearing", "shaft"):
            remarks |= {
                f"{side}.{part}.{key}": "assumed, the default's"
                for key in gear[side][part]
            }
    return {
        key: "given" if f"gear.{key}" in typed else text
        for key, text in remarks.items()
    }


def _torque(arguments: Namespace, gear: dict[str, Any]) -> tuple[float, str]:
    """Torque as given, or that at which the teeth are loaded as those of the default machine are."""
    if arguments.torque is not None:
        return float(arguments.torque), "given"
    default = read_request([]).config["gear"].plain()

    def size(one: dict[str, Any]) -> float:
        return float(
            one["pinion"]["n_teeth"]
            * one["normal_module_mm"] ** 2
            * one["pinion"]["face_width_mm"]
        )

    torque = round(default["rated_torque_nm"] * size(gear) / size(default), 3)
    return (
        torque,
        "assumed: tooth load over module and face width as the default machine has it",
    )


def _config(gear: dict[str, Any], torque: float, speed: float) -> Configuration:
    config = read_request([]).config.with_entries(gear=gear)
    return config.with_keys("operating", torque_nm=torque, speed_rpm=speed)
