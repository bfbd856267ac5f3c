"""``gensig twin``: a configuration fitted to a measured healthy machine."""

from __future__ import annotations

import math
from argparse import Namespace
from pathlib import Path
from typing import Any

from gensig.commands.console import step
from gensig.commands.figures.panels import draw
from gensig.commands.figures.twin_figure import twin_figure
from gensig.commands.new.data_sheet import check_positive
from gensig.errors import ConfigError
from gensig.plan.request import read_request
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import Recording
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.registry import SIDES, read_system
from gensig.terminal.printing import show
from gensig.twin.check import check, held_out_duration
from gensig.twin.fitting import fit
from gensig.twin.machine_recording import read_recording
from gensig.twin.speed import find_motion
from gensig.twin.summary import check_summary, fitted_rows, report_text, verdict
from gensig.twin.writing import option_name, write_options

FACE_WIDTH_IN_MODULES = 10.0
BORE_SHARE = 0.4  # of the smaller pitch radius
DEFAULT_MODULE = 2.0  # mm
GEAR_WORD = "gear."
# keys that flags of the verb set
FLAGS = {
    "gear.pinion.n_teeth": "--teeth",
    "gear.wheel.n_teeth": "--teeth",
    "gear.normal_module_mm": "--module",
}
ASSUMED = "assumed, the default's"


def twin(arguments: Namespace) -> int:
    """Fit a machine, write its options, compare it with a held-out recording, and report."""
    out = Path(arguments.out)
    name = option_name(out)
    recording = _read(arguments.recording, arguments)
    gear, remarks = _gear(arguments, name)
    torque, torque_from = _torque(arguments, gear)
    fitted_part, held_out, held_out_name = _split(recording, arguments)
    teeth = Teeth(driving=arguments.teeth[0], driven=arguments.teeth[1])
    system = _machine(gear, torque, arguments.speed)
    fitted = fit(fitted_part, system, arguments.speed, step)
    speed = 60.0 * fitted.motion.mesh_frequency / teeth.driving
    gear = {**gear, "rated_speed_rpm": round(speed, 4), "rated_torque_nm": torque}
    remarks |= {"rated_speed_rpm": "fitted", "rated_torque_nm": torque_from}
    motion = find_motion(held_out, teeth, arguments.speed)
    write_options(out, fitted, gear, remarks, torque, duration=1.0)
    duration = held_out_duration(held_out, fitted_part)
    words = [f"experiment={name}", f"operating.duration_s={duration!r}"]
    step("simulating healthy records of the twin")
    config = read_request(words, config_dir=out).config
    result = check(config, held_out, motion, fitted_part, teeth)
    assumed = {f"gear.{key}": text for key, text in remarks.items() if text != "fitted"}
    typed = [arguments.recording, "--teeth", *map(str, arguments.teeth)]
    typed += ["--speed", f"{arguments.speed:g}"]
    text = report_text(
        name, fitted, result, assumed, held_out_name, teeth.driving, typed
    )
    (out / "report.md").write_text(text, encoding="utf-8")
    draw(twin_figure(fitted, result), out / "report.png")
    for key, value in fitted_rows(fitted, teeth.driving):
        show(f"{key:<16}{value}")
    show(*check_summary(result), verdict(result))
    show(
        f"{out}/report.md has it all; gensig generate --config-dir {out} "
        f"experiment={name} out=runs/{name}"
    )
    return 0


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
    """The recording that is fitted, the one that is held out, and its name."""
    if arguments.check is None:
        first, second = recording.part(0.0, 0.5), recording.part(0.5, 1.0)
        return first, second, "The second half of the recording"
    held_out = _read(arguments.check, arguments)
    if held_out.sensors != recording.sensors:
        raise ConfigError(
            f"--check {arguments.check} has the channels {', '.join(held_out.sensors)}, "
            f"the recording has {', '.join(recording.sensors)}; "
            "give the same, in the same order"
        )
    if not math.isclose(held_out.sampling_rate, recording.sampling_rate, rel_tol=1e-3):
        raise ConfigError(
            f"--check {arguments.check} has {held_out.sampling_rate:g} samples a second, "
            f"the recording {recording.sampling_rate:g}; resample one of them"
        )
    return recording, held_out, f"`{arguments.check}`"


def _gear(arguments: Namespace, name: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The group ``gear`` of the machine, and the origin of each value that was not fitted."""
    module = arguments.module
    if module is None:
        module = DEFAULT_MODULE
    check_positive("--speed", arguments.speed)
    check_positive("--module", module)
    check_positive("--torque", arguments.torque)
    for word in arguments.overrides:
        if not word.startswith(GEAR_WORD):
            raise ConfigError(
                f"{word}: twin takes overrides of the gears only, "
                "such as gear.pinion.face_width_mm=15"
            )
    typed = {word.partition("=")[0] for word in arguments.overrides}
    for key, flag in FLAGS.items():
        if key in typed:
            raise ConfigError(f"{key} is what {flag} says; leave it out")
    bore = round(BORE_SHARE * 0.5 * module * min(arguments.teeth), 3)
    values: dict[str, Any] = {"gear.normal_module_mm": module, "gear.name": name}
    for side, n_teeth in zip(SIDES, arguments.teeth, strict=True):
        values |= {
            f"gear.{side}.n_teeth": n_teeth,
            f"gear.{side}.face_width_mm": FACE_WIDTH_IN_MODULES * module,
            f"gear.{side}.bore_radius_mm": bore,
            f"gear.{side}.mass_kg": "null",
            f"gear.{side}.inertia_kg_m2": "null",
        }
    words = [f"{key}={value}" for key, value in values.items() if key not in typed]
    gear = read_request([*words, *arguments.overrides]).config["gear"].plain()
    if arguments.module is not None:
        typed.add("gear.normal_module_mm")
    return gear, _remarks(gear, typed)


def _remarks(gear: dict[str, Any], typed: set[str]) -> dict[str, str]:
    """Origin of each value of the group ``gear``."""
    others = ("name", *SIDES, "normal_module_mm")
    remarks = {key: ASSUMED for key in gear if key not in others}
    remarks["normal_module_mm"] = "assumed"
    for side in SIDES:
        remarks |= {
            f"{side}.n_teeth": "given",
            f"{side}.profile_shift": "assumed",
            f"{side}.face_width_mm": f"assumed: {FACE_WIDTH_IN_MODULES:g} modules",
            f"{side}.bore_radius_mm": f"assumed: {BORE_SHARE:g} of the smaller pitch radius",
            f"{side}.mass_kg": "derived from a solid disc",
            f"{side}.inertia_kg_m2": "derived from a solid disc",
        }
        for part in ("support", "bearing", "shaft"):
            keys = (f"{side}.{part}.{key}" for key in gear[side][part])
            remarks |= dict.fromkeys(keys, ASSUMED)
    given = {key: "given" for key in remarks if f"gear.{key}" in typed}
    return {**remarks, **given}


def _torque(arguments: Namespace, gear: dict[str, Any]) -> tuple[float, str]:
    """The given torque, or the one that loads the teeth like those of the default machine."""
    if arguments.torque is not None:
        return float(arguments.torque), "given"
    default = read_request([]).config["gear"].plain()

    def size(gear: dict[str, Any]) -> float:
        pinion, module = gear["pinion"], gear["normal_module_mm"]
        return float(pinion["n_teeth"] * module**2 * pinion["face_width_mm"])

    torque = round(default["rated_torque_nm"] * size(gear) / size(default), 3)
    return (
        torque,
        "assumed: tooth load over module and face width as the default machine has it",
    )


def _machine(gear: dict[str, Any], torque: float, speed: float) -> GearPairMachine:
    config = read_request([]).config.with_entries(gear=gear)
    return read_system(config.with_keys("operating", torque_nm=torque, speed_rpm=speed))
