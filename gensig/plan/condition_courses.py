"""Courses of a plan's records: one random walk per condition; durations given in revolutions."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from gensig.dataset.distributions import read_distribution
from gensig.errors import ConfigError
from gensig.faults.registry import fault_parts
from gensig.operation.courses import RandomWalk
from gensig.operation.options import (
    QUANTITIES,
    RIPPLES,
    FileCourse,
    read_course,
    read_ripple,
    read_schedule,
)
from gensig.options.configuration import Configuration, Section
from gensig.plan.draws import drawn_gears
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine
from gensig.record.options import GEAR_KEYS
from gensig.units import to_si

SEED_KEY = "operating.course_seed"
DURATION_KEY = "operating.duration_s"
SPEED_KEY = "operating.speed_rpm"
EVERY_SEED = {"distribution": "integers", "low": 0, "high": 999_999, "levels": None}


def settle_courses(config: Configuration, typed: Collection[str]) -> Configuration:
    """Configuration with the course seeds and the duration that follow from its plan.

    Random walks get a seed for each condition in ``plan.vary``, unless ``operating.course_seed``
    is among the keys that were ``typed``. ``operating.duration_s`` becomes that of
    ``operating.turns``.

    Raises
    ------
    ConfigError    for turns with a typed duration, and for what is varied but set by a file
    """
    operating, vary = config["operating"], config["plan"]["vary"]
    courses = {key: read_course(operating, key) for key in QUANTITIES}
    for key, course in courses.items():
        varied = f"operating.{QUANTITIES[key]}"
        if isinstance(course, FileCourse) and course.is_absolute and varied in vary:
            raise ConfigError(
                f"operating.{key}.file = {course.file} gives {QUANTITIES[key]} itself, but the "
                f"plan varies {varied}; name its column factor, or pin {varied}"
            )
    walks = any(isinstance(course, RandomWalk) for course in courses.values())
    if walks and SEED_KEY not in typed:
        seed = operating.get("course_seed", 0)
        config = config.with_keys("operating", course_seed=seed)
        seeds = vary.get(SEED_KEY, dict(EVERY_SEED))
        config = config.with_keys("plan", vary={**vary, SEED_KEY: seeds})
    schedule = read_schedule(operating)
    if schedule.turns is None:
        return config
    if DURATION_KEY in typed:
        raise ConfigError(
            f"{DURATION_KEY} and operating.turns are both given; leave one out"
        )
    steady = dict.fromkeys((*QUANTITIES, *RIPPLES))
    system = read_machine(config.with_keys("operating", **steady))
    least = least_speed(config["operating"], vary, system.operating.speed)
    turning = {schedule.turns_of}
    if schedule.turns_of == "faulted":
        turning = _faulted(InputReader(config)) & set(system.gears)
    if turning - {"pinion"}:
        _refuse_varied_teeth(vary)
    slowdown = max([system.pinion_turns[gear] for gear in turning], default=1.0)
    seconds = schedule.turns * slowdown * 2.0 * math.pi / least
    rate = system.sensing.sampling_rate
    duration = math.ceil(seconds * rate * (1.0 - 1e-12)) / rate
    return config.with_keys("operating", duration_s=duration)


def _refuse_varied_teeth(vary: Collection[str]) -> None:
    """Raise ConfigError where the turns of the wheel last longer in some units than in others."""
    for key in vary:
        if key.startswith(GEAR_KEYS) and key.endswith("n_teeth"):
            raise ConfigError(
                f"operating.turns: the plan draws {key}, so the turns of the wheel take another "
                "time in every machine; give operating.turns_of=pinion, or duration_s"
            )


def least_speed(operating: Section, vary: Mapping[str, Any], set_speed: float) -> float:
    """The slowest set speed of the pinion that records of a plan can have, rad/s.

    The lower end of what the plan draws (else ``set_speed`` in rad/s), times the smallest factor
    of the course.

    Raises
    ------
    ConfigError    where the plan draws the course itself
    """
    for key in vary:
        if key.startswith(("operating.speed_profile.", "operating.speed_ripple.")):
            raise ConfigError(
                f"operating.turns: the plan draws {key}, so the slowest turn is not known; use "
                "duration_s"
            )
    if SPEED_KEY in vary:
        drawn_speed = read_distribution(f"plan.vary.{SPEED_KEY}", vary[SPEED_KEY])
        set_speed = to_si(SPEED_KEY, drawn_speed.least)
    factor = 1.0
    if course := read_course(operating, "speed_profile"):
        factor = course.least
    if ripple := read_ripple(operating, "speed_ripple"):
        factor *= 1.0 - ripple.share
    if not set_speed * factor > 0.0:
        raise ConfigError(
            "operating.turns: the slowest speed of the plan must be positive"
        )
    return set_speed * factor


def _faulted(reader: InputReader) -> set[str]:
    """Gears that carry a fault in any class; all that the plan draws from where it draws."""
    named = {
        str(part.get("gear"))
        for fault in reader.classes.values()
        for part in fault_parts(fault)
    }
    if named and (drawn := drawn_gears(reader)):
        return set(drawn)
    return named
