"""Options of the group ``operating``: set-points, their courses, and the traces of a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.operation.courses import Profile, Ramp, RandomWalk, Ripple
from gensig.operation.setpoint import Operating
from gensig.options.configuration import Section
from gensig.text.user_file import check_columns, read_table
from gensig.units import check_choice, is_number, naming, read, to_si

QUANTITIES = {"speed_profile": "speed_rpm", "torque_profile": "torque_nm"}
RIPPLES = ("speed_ripple", "torque_ripple")
KINDS = {"ramp": Ramp, "random_walk": RandomWalk}
FILE = "file"
TURNS_OF = ("pinion", "wheel", "faulted")


@dataclass(frozen=True, slots=True, kw_only=True)
class FileCourse:
    """Course of a user's file, as factors or absolute; absolute values do not use the set-point."""

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
        """Course of a record of ``duration`` s; ConfigError unless the file covers it."""
        first, last = self.profile_given.times[0], self.profile_given.times[-1]
        if first > 0.0 or last + self.step < duration * (1.0 - 1e-9):
            raise ConfigError(
                f"{self.key}.file = {self.file} is too short: it runs from {first:g} s to "
                f"{last:g} s, the record from 0 to {duration:g} s; give times that cover it, "
                "or a shorter operating.duration_s"
            )
        return self.profile_given


Course = Profile | Ramp | RandomWalk | FileCourse


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """Length of records in turns of a shaft, and the seed of random walks."""

    turns: float | None = None
    turns_of: str = "faulted"
    course_seed: int = 0

    def __post_init__(self) -> None:
        if self.turns is not None and not self.turns > 0.0:
            raise ConfigError(
                f"operating.turns = {self.turns:g} must be positive, or null to use duration_s"
            )
        check_choice("operating.turns_of", self.turns_of, TURNS_OF)
        if self.course_seed < 0:
            raise ConfigError(
                f"operating.course_seed = {self.course_seed} must not be negative"
            )


SCHEDULE_KEYS = tuple(Schedule.__dataclass_fields__)


def read_schedule(values: Section) -> Schedule:
    """Turns and seed of a group ``operating``; ConfigError for what cannot be used."""
    schedule = {key: values[key] for key in SCHEDULE_KEYS if key in values}
    return read(Schedule, schedule, "operating")


def read_operating(values: Section) -> Operating:
    """Set-points, courses and drive of a group ``operating``.

    Raises
    ------
    ConfigError    for unknown or missing keys, kinds, values and files
    """
    seed = read_schedule(values).course_seed
    special = (*SCHEDULE_KEYS, *QUANTITIES, *RIPPLES)
    plain = {key: value for key, value in values.items() if key not in special}
    steady = read(Operating, plain, "operating")
    ripples = {key: read_ripple(values, key) for key in RIPPLES}
    profiles = {}
    for index, key in enumerate(QUANTITIES):
        course = read_course(values, key)
        sequence = np.random.SeedSequence(seed, spawn_key=(index,))
        rng = np.random.Generator(np.random.SFC64(sequence))
        with naming(f"operating.{key}: "):
            profiles[key] = _profile(course, steady.duration, rng)
    return read(Operating, plain, "operating", **profiles, **ripples)


def read_course(values: Section, key: str) -> Course | None:
    """Course under ``key``, speed_profile or torque_profile, of a group ``operating``.

    None for null.

    Raises
    ------
    ConfigError    for anything else than a list of [time_s, factor] pairs or a group with a known
        kind
    """
    where, value = f"operating.{key}", values.get(key)
    if not isinstance(value, Mapping):
        return read_profile(where, value)
    rest = dict(value)
    kind = rest.pop("kind", None)
    check_choice(f"{where}.kind", kind, (*KINDS, FILE))
    with naming(f"{where}: "):
        if kind == FILE:
            quantity = QUANTITIES[key]
            return _read_file(where, rest, quantity, values.get(quantity))
        return read(KINDS[kind], rest, where)


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
            f"{key} = {value!r} is no list; give [time_s, factor] pairs, a group with a kind, "
            "or null for a constant"
        )
    for index, point in enumerate(value):
        is_pair = isinstance(point, list | tuple) and len(point) == 2
        if not is_pair or not all(map(is_number, point)):
            raise ConfigError(
                f"{key}: point {index} = {point!r}; give two finite numbers, [time_s, factor]"
            )
    with naming(f"{key}: "):
        return Profile(
            times=tuple(float(time) for time, _ in value),
            factors=tuple(float(factor) for _, factor in value),
        )


def _profile(
    course: Course | None, duration: float, rng: np.random.Generator
) -> Profile | None:
    if course is None or isinstance(course, Profile):
        return course
    if isinstance(course, RandomWalk):
        return course.profile(duration, rng)
    return course.profile(duration)


def _read_file(
    where: str, values: Mapping[str, Any], quantity: str, set_point: Any
) -> FileCourse:
    """Course of a file with ``time_s`` and ``factor``, or ``time_s`` and the quantity.

    The quantity is divided by the set-point.
    """
    if not (set(values) == {"file"} and isinstance(values["file"], str)):
        raise ConfigError(
            f"{where}: kind = file needs exactly file, the name of a CSV file with a header"
        )
    file, key = values["file"], f"{where}.file"
    names, columns = read_table(key, file, least_rows=2)
    is_absolute = quantity in names
    if not is_absolute and "factor" not in names:
        raise ConfigError(
            f"{key} = {file}: no column {quantity} or factor; "
            "it must have time_s and one of the two"
        )
    column = "factor"
    if is_absolute:
        column = quantity
    check_columns(key, file, names, ["time_s", column])
    times, factors = columns[names.index("time_s")], columns[names.index(column)]
    if is_absolute:
        if not (is_number(set_point) and set_point > 0.0):
            raise ConfigError(
                f"operating.{quantity} = {set_point!r} must be a positive number"
            )
        factors = to_si(quantity, 1.0) * factors / to_si(quantity, float(set_point))
    with naming(f"{key} = {file}: "):
        profile = Profile(times=tuple(times.tolist()), factors=tuple(factors.tolist()))
    return FileCourse(
        key=where,
        file=file,
        profile_given=profile,
        step=float(times[-1] - times[-2]),
        is_absolute=is_absolute,
    )


def read_ripple(values: Section, key: str) -> Ripple | None:
    """Ripple under ``key``, speed_ripple or torque_ripple, of a group ``operating``.

    None for null.

    Raises
    ------
    ConfigError    for keys and values that make no ripple
    """
    where, ripple = f"operating.{key}", values.get(key)
    if ripple is None:
        return None
    with naming(f"{where}: "):
        return read(Ripple, ripple, where)


def operating_signals(
    operating: Operating,
    sampling_rate: float,
    shaft_angle: Array,
    load_exponent: int = 0,
) -> dict[str, NDArray[np.float32]]:
    """Traces of a record: ``shaft_speed`` in rad/s, as the shaft turned, ``torque_set`` in N m.

    Each is (sample,). The speed is the central difference of the shaft angle. It takes sin(x) / x
    with x = 2 pi f / sampling_rate of a change at f: 1 % less at 0.039 of the rate (2 kHz of
    51.2 kHz), -3 dB at 0.22 of it. A failed record has an angle of one NaN a sample.
    ``load_exponent`` is the power of the nominal speed that the torque of the load follows.
    """
    times = np.arange(len(shaft_angle)) / sampling_rate
    speed = np.full_like(shaft_angle, operating.speed)
    if len(shaft_angle) > 2:
        speed = np.gradient(shaft_angle, 1.0 / sampling_rate, edge_order=2)
    nominal = operating.nominal(times)
    slowed = (nominal.speed / operating.speed) ** load_exponent
    torque = operating.torque * nominal.torque_factor * slowed
    return {
        "shaft_speed": speed.astype(np.float32),
        "torque_set": torque.astype(np.float32),
    }
