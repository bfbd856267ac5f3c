"""The data sets of ``python -m benchmarks.realism``.

Overrides on a base experiment, made once and kept.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

import gensig
from gensig.dataset.folder.layout import OVERRIDES
from gensig.dataset.reader import Dataset
from gensig.errors import ConfigError
from gensig.faults.crack import Crack
from gensig.faults.registry import read_faults
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request
from gensig.systems.registry import SIDES, read_system

SPEED, TORQUE, GRADE = (
    "operating.speed_rpm",
    "operating.torque_nm",
    "quality.iso1328_grade",
)
CLASSES = ("healthy", "crack", "missing_tooth", "distributed_pitting")
CRACK_SHARES = (0.25, 0.5)  # of the root chord, as asked
RUN_IN_SHARE = 0.5  # assumed, before any record was made with it

# The recording: teeth and speed from its description; sampling rate and length as recorded.
RECORDING_TEETH, RECORDING_SPEED, RECORDING_RATE, RECORDING_DURATION = (
    (23, 46),
    2000.0,
    25600.0,
    2.56,
)
WRONG_TEETH = (27, 42)  # the same sum, so the same center distance
ERROR_FACTOR = 3.0
GRADE_STEPS = 2.0 * math.log2(
    ERROR_FACTOR
)  # ISO 1328-1: a grade is a factor of sqrt(2)
CONTROLS = ("right", "wrong teeth", "errors / 3", "errors x 3")


# Gears that run in every gearbox, with faults where their option says, whatever the base plans.
CROSSED = ("plan.machines=crossed", "plan.fault_gear=as_given", "plan.n_reference=0")


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """Extent of the simulation; speeds and torques as shares of the rated ones.

    The first speed and torque are the slow and light corner: at 1800 r/min and 20 N m rated,
    600 r/min and 2 N m.
    """

    n_units: int = 40
    n_gearboxes: int = 8
    speeds: tuple[float, ...] = (1 / 3, 2 / 3, 1.0)
    torques: tuple[float, ...] = (0.1, 1.0)
    n_turns: float = (
        10.5  # of the slowest record; ten whole ones at a speed that drifts
    )
    recording_duration: float = RECORDING_DURATION

    def __post_init__(self) -> None:
        if self.n_units < 2 * self.n_gearboxes:
            raise ConfigError(
                f"{self.n_units} units in {self.n_gearboxes} gearboxes: another specimen "
                "needs two in each at least"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """One data set of the yardstick: classes, further overrides, suffix of its faults' ids."""

    name: str
    classes: tuple[str, ...]
    words: tuple[str, ...] = ()
    suffix: str = ""


# those after the first stand beside it and leave its records alone
GRIDS = (
    Grid(name="yardstick", classes=CLASSES),
    Grid(name="surface", classes=("healthy", "surface_damage")),
    Grid(
        name="run_in",
        classes=("healthy", "missing_tooth"),
        words=(f"quality.run_in_share={RUN_IN_SHARE}",),
        suffix="_run_in",
    ),
)


ADDED = Size(n_units=16, n_gearboxes=4)  # of the grids after the first, when made alone
QUICK = Size(n_units=8, n_gearboxes=2, n_turns=10.5, recording_duration=1.28)


def yardstick_words(
    base: Sequence[str], size: Size, grid: Grid = GRIDS[0]
) -> list[str]:
    """Overrides of a grid.

    Every unit runs every speed and torque, healthy and with each fault.
    """
    config = base_config(tuple(base))
    gear = config["gear"]
    speeds = [round(share * gear["rated_speed_rpm"], 6) for share in size.speeds]
    torques = [round(share * gear["rated_torque_nm"], 6) for share in size.torques]
    vary = {key: _drawn(spec) for key, spec in config["plan"]["vary"].items()}
    vary |= {
        key: {"distribution": "choice", "values": levels}
        for key, levels in ((SPEED, speeds), (TORQUE, torques))
    }
    cracks = []
    if "crack" in grid.classes:
        chord = root_chord(base)
        low, high = (round(share * chord * 1e3, 4) for share in CRACK_SHARES)
        depths = {"distribution": "uniform", "low": low, "high": high}
        cracks = [f"fault.vary={_flow({'crack_depth_mm': depths})}"]
    return [
        *base,
        *grid.words,
        *_steady_length(config, size.n_turns * 60.0 / min(speeds)),
        "plan.design=grid",
        "plan.n_records=null",
        f"plan.classes=[{','.join(grid.classes)}]",
        f"plan.n_units={size.n_units}",
        f"plan.n_gearboxes={size.n_gearboxes}",
        *CROSSED,
        f"plan.vary={_flow(vary)}",
        *cracks,
        "dataset.store_shaft_angle=true",
    ]


def recording_words(base: Sequence[str], size: Size, control: str) -> list[str]:
    """Overrides of the machine of the recording, healthy.

    Right, or wrong on purpose in one thing.
    """
    config = base_config(tuple(base))
    teeth = WRONG_TEETH if control == "wrong teeth" else RECORDING_TEETH
    step = {"errors / 3": -GRADE_STEPS, "errors x 3": GRADE_STEPS}.get(control, 0.0)
    return [
        *base,
        *_steady_length(config, size.recording_duration),
        "plan.design=latin_hypercube",
        f"plan.n_records={size.n_units}",
        "plan.conditions_per_unit=null",
        "plan.n_repeats=1",
        "plan.classes=[healthy]",
        f"plan.n_units={size.n_units}",
        f"plan.n_gearboxes={size.n_gearboxes}",
        *CROSSED,
        f"gear.pinion.n_teeth={teeth[0]}",
        f"gear.wheel.n_teeth={teeth[1]}",
        *(
            f"gear.{side}.{key}=null"
            for side in SIDES
            for key in ("mass_kg", "inertia_kg_m2")
        ),
        f"{SPEED}={RECORDING_SPEED:g}",
        f"{GRADE}={middle_grade(config) + step:.4f}",
    ]


def middle_grade(config: Configuration) -> float:
    """The middle of the error grades that an experiment draws, or the one that it has."""
    spec = config["plan"]["vary"].get(GRADE)
    if isinstance(spec, Mapping) and "low" in spec:
        return 0.5 * (float(spec["low"]) + float(spec["high"]))
    grade = config["quality"]["iso1328_grade"]
    if grade is None:
        raise ConfigError(
            f"{GRADE} = null: perfect gears have no errors to be wrong about; choose another base"
        )
    return float(grade)


@lru_cache(maxsize=4)
def base_config(base: tuple[str, ...]) -> dict[str, Any]:
    """The base with a root crack as its only class, composed once: composing takes seconds."""
    return read_request([*base, "fault=crack"]).config


def root_chord(base: Sequence[str]) -> float:
    """Thickness of the sound tooth where the experiment's crack starts, m."""
    config = base_config(tuple(base))
    system = read_system(config)
    (crack,) = read_faults(
        {key: value for key, value in config["fault"].items() if key != "vary"}
    )
    assert isinstance(crack, Crack)
    return crack.root_chord(
        system.pair.pinion if crack.gear == "pinion" else system.pair.wheel
    )


def kept(folder: Path, words: Sequence[str]) -> Dataset:
    """The data set of these overrides in a folder: opened where it is there, else made.

    Raises
    ------
    ConfigError    for a folder with a data set of other overrides
    """
    if (folder / OVERRIDES).is_file():
        written = yaml.safe_load((folder / OVERRIDES).read_text(encoding="utf-8"))
        if written != list(words):
            raise ConfigError(
                f"{folder} holds a data set of other overrides; remove it, or choose another --data"
            )
        return gensig.open_dataset(folder)
    return gensig.generate(*words, out=folder)


def _steady_length(config: Configuration, duration: float) -> list[str]:
    """A length in seconds, whatever the base says about turns."""
    words = [f"operating.duration_s={duration:.6g}"]
    return (
        [*words, "operating.turns=null"]
        if config["operating"].get("turns") is not None
        else words
    )


def _drawn(spec: Any) -> dict[str, Any]:
    """A distribution that a grid draws from instead of crossing it."""
    plain = copy.deepcopy(dict(spec))
    if plain.get("distribution") == "choice":
        raise ConfigError(
            "a base whose plan.vary has distribution: choice would be crossed; pin that "
            "key in --base"
        )
    return {**plain, "levels": None}


def _flow(mapping: Mapping[str, Any]) -> str:
    """A mapping of names and numbers as it is typed on the command line."""
    return json.dumps(mapping).replace('"', "")
