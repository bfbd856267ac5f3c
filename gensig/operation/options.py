"""The group ``operating`` of a configuration.

Set-points and their courses, and what a record tells of them.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.operation.courses import Profile, Ramp, RandomWalk, Ripple
from gensig.operation.setpoint import Operating
from gensig.options.configuration import Section
from gensig.text.user_file import check_columns, read_table
from gensig.units import read, to_si

Array = NDArray[np.float64]

QUANTITIES = {"speed_profile": "speed_rpm", "torque_profile": "torque_nm"}
RIPPLES = ("speed_ripple", "torque_ripple")
KINDS = ("ramp", "random_walk", "file")
TURNS_OF = ("pinion", "wheel", "faulted")


@dataclass(frozen=True, slots=True, kw_only=True)
class FileCourse:
    """A course that a user gave: as factors, or absolutely, and then the set-point cancels."""

    key: str
    file: str
    profile_given: Profile
    step: float
    is_absolute: bool

    @property
    def least(self) -> float:
        """The smallest factor."""
        return self.profile_given.least

    def profile(self, duration: float) -> Profile:
        """The course of a record of ``duration`` s; ConfigError unless the file covers it."""
        first, last = self.profile_given.times[0], self.profile_given.times[-1]
        if first > 0.0 or last + self.step < duration * (1.0 - 1e-9):
            raise ConfigError(
                f"{self.key}.file = {self.file} is too short: it runs from {first:g} s to "
                f"{last:g} s, the record from "
                f"0 to {duration:g} s; give times that cover it, or a shorter operating.duration_s"
            )
        return self.profile_given


Course = Profile | Ramp | RandomWalk | FileCourse


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """How long records are where that is told in turns, and the seed of random walks."""

    turns: float | None = None
    turns_of: str = "faulted"
    course_seed: int = 0

    def __post_init__(self) -> None:
        if self.turns is not None and not self.turns > 0.0:
            raise ConfigError(
                f"operating.turns = {self.turns:g} must be positive, or null to use duration_s"
            )
        if self.turns_of not in TURNS_OF:
            raise ConfigError(
                f"operating.turns_of = {self.turns_of!r}; allowed: {', '.join(TURNS_OF)}"
            )
        if self.course_seed < 0:
            raise ConfigError(
                f"operating.course_seed = {self.course_seed} must not be negative"
            )


SCHEDULE_KEYS = tuple(Schedule.__dataclass_fields__)


def read_schedule(values: Section) -> Schedule:
    """Turns and seed of a group ``operating``; ConfigError for what cannot be used."""
    return read(
        Schedule,
        {key: values[key] for key in SCHEDULE_KEYS if key in values},
        "operating",
    )


def read_operating(values: Section) -> Operating:
    """Set-points, courses and drive of a group ``operating``.

    Raises
    ------
    ConfigError    for unknown or missing keys, kinds, values and files
    """
    seed = read_schedule(values).course_seed
    own = {
        key: value
        for key, value in values.items()
        if key not in (*SCHEDULE_KEYS, *QUANTITIES, *RIPPLES)
    }
    steady = read(Operating, own, "operating")
    ripples = {key: read_ripple(values, key) for key in RIPPLES}
    profiles = {}
    for place, key in enumerate(QUANTITIES):
        course = read_course(values, key)
        rng = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(place,)))
        )
        try:
            profiles[key] = _profile(course, steady.duration, rng)
        except ConfigError as error:
            raise ConfigError(_named(f"operating.{key}", error)) from None
    return read(Operating, own, "operating", **profiles, **ripples)


def read_course(values: Section, key: str) -> Course | None:
    """The course that ``key``, speed_profile or torque_profile, of a group ``operating``
    describes; None for null.

    Raises
    ------
    ConfigError    for anything else than a list of [time_s, factor] pairs or a group with a known
        kind
    """
    where, value = f"operating.{key}", values.get(key)
    if not isinstance(value, Mapping):
        return read_profile(where, value)
    kind, own = (
        value.get("kind"),
        {name: entry for name, entry in value.items() if name != "kind"},
    )
    try:
        if kind == "ramp":
            return read(Ramp, own, where)
        if kind == "random_walk":
            return read(RandomWalk, own, where)
        if kind == "file":
            return _read_file(where, own, QUANTITIES[key], values.get(QUANTITIES[key]))
    except ConfigError as error:
        raise ConfigError(_named(where, error)) from None
    raise ConfigError(f"{where}.kind = {kind!r}; allowed: {', '.join(KINDS)}")


def read_profile(key: str, value: Any) -> Profile | None:
    """Profile of a list of [time_s, factor] pairs, as a configuration has it; None for null.

    Raises
    ------
    ConfigError    for anything else, naming ``key``
    """
    if value is None:
        return None
    if not isinstance(value, list | tuple):
        raise ConfigError(
            f"{key} = {value!r} is no list; give [time_s, factor] pairs, a group with a kind, or "
            "null for a constant"
        )
    for place, point in enumerate(value):
        if not (
            isinstance(point, list | tuple)
            and len(point) == 2
            and all(_is_number(one) for one in point)
        ):
            raise ConfigError(
                f"{key}: point {place} = {point!r}; give two finite numbers, [time_s, factor]"
            )
    try:
        return Profile(
            times=tuple(float(time) for time, _ in value),
            factors=tuple(float(factor) for _, factor in value),
        )
    except ConfigError as error:
        raise ConfigError(f"{key}: {error}") from None


def _profile(
    course: Course | None, duration: float, rng: np.random.Generator
) -> Profile | None:
    if course is None or isinstance(course, Profile):
        return course
    return (
        course.profile(duration, rng)
        if isinstance(course, RandomWalk)
        else course.profile(duration)
    )


def _read_file(
    where: str, own: Mapping[str, Any], quantity: str, set_point: Any
) -> FileCourse:
    """``time_s`` and ``factor``, or ``time_s`` and the quantity itself, which is divided by the
    set-point.
    """
    if not (set(own) == {"file"} and isinstance(own["file"], str)):
        raise ConfigError(
            f"{where}: kind = file needs exactly file, the name of a CSV file with a header"
        )
    file, key = own["file"], f"{where}.file"
    names, columns = read_table(key, file, least_rows=2)
    value = quantity if quantity in names else "factor"
    if value == "factor" and "factor" not in names:
        raise ConfigError(
            f"{key} = {file}: no column {quantity} or factor; it must have time_s and one of the "
            "two"
        )
    check_columns(key, file, names, ["time_s", value])
    times, factors = columns[names.index("time_s")], columns[names.index(value)]
    if value == quantity:
        if not (_is_number(set_point) and set_point > 0.0):
            raise ConfigError(
                f"operating.{quantity} = {set_point!r} must be a positive number"
            )
        factors = to_si(quantity, 1.0) * factors / to_si(quantity, float(set_point))
    try:
        profile = Profile(times=tuple(times.tolist()), factors=tuple(factors.tolist()))
    except ConfigError as error:
        raise ConfigError(f"{key} = {file}: {error}") from None
    step = float(times[-1] - times[-2])
    return FileCourse(
        key=where,
        file=file,
        profile_given=profile,
        step=step,
        is_absolute=value == quantity,
    )


def read_ripple(values: Section, key: str) -> Ripple | None:
    """The ripple that ``key``, speed_ripple or torque_ripple, of a group ``operating`` describes;
    None for null.

    Raises
    ------
    ConfigError    for keys and values that make no ripple
    """
    where, own = f"operating.{key}", values.get(key)
    if own is None:
        return None
    try:
        return read(Ripple, own, where)
    except ConfigError as error:
        raise ConfigError(_named(where, error)) from None


def _named(where: str, error: ConfigError) -> str:
    text = str(error)
    return text if text.startswith("operating.") else f"{where}: {text}"


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and abs(value) <= sys.float_info.max
    )


def operating_signals(
    operating: Operating,
    sampling_rate: float,
    shaft_angle: Array,
    load_exponent: int = 0,
) -> dict[str, NDArray[np.float32]]:
    """Traces of a record, (sample,) each: ``shaft_speed`` in rad/s, as the shaft turned, and
    ``torque_set`` in N m.

    The speed is the central difference of the shaft angle: it takes sin(x) / x with x = 2 pi f /
    sampling_rate of a change at f, 1 % less at 0.039 of the rate (2 kHz of 51.2 kHz), -3 dB at
    0.22 of it. An angle of one NaN a sample is a failed record's. ``load_exponent`` is the power
    of the nominal speed that the torque of the load follows.
    """
    times = np.arange(len(shaft_angle)) / sampling_rate
    speed = np.full_like(shaft_angle, operating.speed)
    if len(shaft_angle) > 2:
        speed = np.gradient(shaft_angle, 1.0 / sampling_rate, edge_order=2)
    nominal = operating.nominal(times)
    torque = (
        operating.torque
        * nominal.torque_factor
        * (nominal.speed / operating.speed) ** load_exponent
    )
    return {
        "shaft_speed": speed.astype(np.float32),
        "torque_set": torque.astype(np.float32),
    }
