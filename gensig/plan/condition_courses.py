"""Courses of a plan's records: one random walk per condition; durations given in revolutions."""

from __future__ import annotations

import math
from collections.abc import Collection

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
from gensig.options.configuration import Configuration
from gensig.record.machines import read_machine
from gensig.units import to_si

SEED_KEY, DURATION_KEY, SPEED_KEY = (
    "operating.course_seed",
    "operating.duration_s",
    "operating.speed_rpm",
)
EVERY_SEED = {"distribution": "integers", "low": 0, "high": 999_999, "levels": None}


def settle_courses(config: Configuration, typed: Collection[str]) -> Configuration:
    """The configuration with what follows from its plan for its courses.

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
    if (
        any(isinstance(course, RandomWalk) for course in courses.values())
        and SEED_KEY not in typed
    ):
        config = config.with_keys(
            "operating", course_seed=operating.get("course_seed", 0)
        )
        config = config.with_keys(
            "plan", vary={**vary, SEED_KEY: vary.get(SEED_KEY, dict(EVERY_SEED))}
        )
    schedule = read_schedule(operating)
    if schedule.turns is None:
        return config
    if DURATION_KEY in typed:
        raise ConfigError(
            f"{DURATION_KEY} and operating.turns are both given; leave one out"
        )
    system = read_machine(
        config.with_keys("operating", **dict.fromkeys((*QUANTITIES, *RIPPLES)))
    )
    least = least_speed(config, system.operating.speed)
    pair = system.pair
    n_teeth = {side: gear.n_teeth for side, gear in pair.gears.items()}
    gears = (
        _faulted(config) & set(n_teeth)
        if schedule.turns_of == "faulted"
        else {schedule.turns_of}
    )
    slowest = max((n_teeth[gear] for gear in gears), default=pair.pinion.n_teeth)
    slowdown = slowest / pair.pinion.n_teeth
    seconds = schedule.turns * slowdown * 2.0 * math.pi / least
    rate = system.sensing.sampling_rate
    duration = math.ceil(seconds * rate * (1.0 - 1e-12)) / rate
    return config.with_keys("operating", duration_s=duration)


def least_speed(config: Configuration, set_speed: float) -> float:
    """The slowest set speed of the pinion that records of a plan can have, rad/s.

    The lower end of what the plan draws (else ``set_speed`` in rad/s), times the smallest factor
    of the course.

    Raises
    ------
    ConfigError    where the plan draws the course itself
    """
    operating, vary = config["operating"], config["plan"]["vary"]
    if drawn := [
        key
        for key in vary
        if key.startswith(("operating.speed_profile.", "operating.speed_ripple."))
    ]:
        raise ConfigError(
            f"operating.turns: the plan draws {drawn[0]}, so the slowest turn is not known; use "
            "duration_s"
        )
    if SPEED_KEY in vary:
        drawn_speed = read_distribution(f"plan.vary.{SPEED_KEY}", vary[SPEED_KEY])
        set_speed = to_si(SPEED_KEY, drawn_speed.least)
    course, ripple = (
        read_course(operating, "speed_profile"),
        read_ripple(operating, "speed_ripple"),
    )
    factor = (1.0 if course is None else course.least) * (
        1.0 if ripple is None else 1.0 - ripple.share
    )
    if not set_speed * factor > 0.0:
        raise ConfigError(
            "operating.turns: the slowest speed of the plan must be positive"
        )
    return set_speed * factor


def _faulted(config: Configuration) -> set[str]:
    """Gears that carry a fault in any class."""
    return {
        str(part.get("gear"))
        for fault in config["classes"].values()
        for part in fault_parts(fault)
    }
