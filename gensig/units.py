"""Conversion between unit-suffixed names in files and SI inside, with checks of values.

``normal_module_mm: 2`` in a file is ``normal_module = 0.002`` in the code. A name without a known
suffix is a number without unit (``n_teeth``, ``damping_ratio``), taken as it is.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import functools
import math
import sys
import types
import typing
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

from gensig.errors import ConfigError

# suffix: (factor to SI, what it measures); longer suffixes first, so that kg_m2 is not read as m2
UNITS: dict[str, tuple[float, str]] = {
    "mpa_sqrt_m": (1e6, "stress intensity"),
    "kg_m2": (1.0, "moment of inertia"),
    "w_per_m2k": (1.0, "heat transfer coefficient"),
    "w_per_mk": (1.0, "thermal conductivity"),
    "j_per_kgk": (1.0, "specific heat"),
    "per_k": (1.0, "thermal expansion"),
    # degrees Celsius inside too: only differences and tables of steel are needed
    "degc": (1.0, "temperature"),
    "n_per_m": (1.0, "stiffness"),
    "ns_per_m": (1.0, "damping"),
    "nm_per_rad": (1.0, "torsional stiffness"),
    "knm_per_rad": (1e3, "torsional stiffness"),
    "mnm_per_rad": (1e6, "torsional stiffness"),  # mega, as shaft lines print it
    "nms_per_rad": (1.0, "torsional damping"),
    "mm": (1e-3, "length"),
    "um": (1e-6, "length"),
    "m": (1.0, "length"),
    "deg": (math.pi / 180.0, "angle"),
    "rad": (1.0, "angle"),
    "rpm": (2.0 * math.pi / 60.0, "speed"),
    "nm": (1.0, "torque"),
    "n": (1.0, "force"),
    "kg": (1.0, "mass"),
    "s": (1.0, "time"),
    "h": (3600.0, "time"),
    "hz": (1.0, "frequency"),
    "gpa": (1e9, "stress"),
    "mpa": (1e6, "stress"),
    "hbs": (9.80665e6, "hardness"),  # Brinell with a steel ball, kgf/mm2
    "db": (1.0, "level"),
}

# how channels end whose acceleration is one of an angle
TURNING = ("rotation", "tilt_x", "tilt_y")
# how channels end that are the speed of a shaft, less its nominal one
SPEED = "_speed"

# types of lists in files by that of their entries
LISTS: dict[type, Any] = {
    float: tuple[float, ...],
    int: tuple[int, ...],
    str: tuple[str, ...],
}
# a type as a user calls it
TYPES: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    str: "text",
    tuple[float, ...]: "a list of numbers",
    tuple[int, ...]: "a list of whole numbers",
    tuple[str, ...]: "a list of names",
}

T = TypeVar("T")


@functools.lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, str | None]:
    """Split a boundary name into its bare name and its unit suffix (None without one)."""
    for suffix in UNITS:
        if name.endswith("_" + suffix):
            return name[: -len(suffix) - 1], suffix
    return name, None


def to_si(name: str, value: float) -> float:
    """Value of a suffixed name in SI units."""
    _, suffix = split_unit(name)
    if suffix is None:
        return value
    return value * UNITS[suffix][0]


def from_si(name: str, value: float) -> float:
    """SI value in the unit of the suffixed name."""
    _, suffix = split_unit(name)
    if suffix is None:
        return value
    return value / UNITS[suffix][0]


def is_turning(channel: str) -> bool:
    """True for a channel that is the acceleration of an angle, in rad/s2."""
    return channel.endswith(TURNING)


def channel_unit(channel: str) -> str:
    """Unit of a channel by its name."""
    if channel.endswith(SPEED):
        return "rad/s"
    if is_turning(channel):
        return "rad/s^2"
    return "m/s^2"


def unit(suffix: str, *, default: Any = dataclasses.MISSING) -> Any:
    """Dataclass field with ``suffix`` in its boundary name."""
    return dataclasses.field(default=default, metadata={"unit": suffix})


def read(cls: type[T], values: Mapping[str, Any], where: str, **given: Any) -> T:
    """Build a frozen dataclass from boundary keys.

    Parameters
    ----------
    cls : dataclass whose fields are SI quantities without suffix. ``metadata={"unit": "mm"}``
        names the suffix in files. A field without it is a plain number, text or flag.
    values : keys with suffixes, as in a configuration
    where : name of the group in an error, for instance ``"gear.pinion"``
    given : fields that do not come from ``values``

    Raises
    ------
    ConfigError    for an unknown or missing key, a wrong suffix or a value of the wrong type
    """
    if not isinstance(values, Mapping):
        raise ConfigError(
            f"{where} = {values!r} must be a group of keys, not one value"
        )
    if given:
        return _filled(cls, values, where, given)
    try:
        items, kinds = tuple(values.items()), tuple(map(type, values.values()))
        kept: T = _kept(cls, where, items, kinds)  # type: ignore[arg-type, assignment]
        return kept
    except TypeError:  # a list has no hash
        return _filled(cls, values, where, given)


@functools.lru_cache(maxsize=256)
def _kept(
    cls: type[T],
    where: str,
    items: tuple[tuple[str, Any], ...],
    kinds: tuple[type, ...],
) -> T:
    """The dataclass of equal keys, read once: machines of a plan differ in a few keys.

    ``kinds`` are types of the values: true is equal to 1.
    """
    return _filled(cls, dict(items), where, {})


def _filled(
    cls: type[T], values: Mapping[str, Any], where: str, given: Mapping[str, Any]
) -> T:
    keys = _keys(cls)  # type: ignore[arg-type]
    result = dict(given)
    for key, value in values.items():
        known = keys.get(key)
        if known is None or known.field.name in given:
            names = {
                name: each.field
                for name, each in keys.items()
                if each.field.name not in given
            }
            raise ConfigError(f"{where}: {_unknown(key, names)}")
        result[known.field.name] = _convert(where, key, value, known)
    missing = [
        name
        for name, known in keys.items()
        if known.is_required and known.field.name not in result
    ]
    if missing:
        raise ConfigError(f"{where}: missing {', '.join(missing)}")
    return cls(**result)


def read_kind(kinds: Mapping[str, type[T]], values: Any, where: str) -> T:
    """Build the dataclass that the key ``kind`` of a group names, from its other keys.

    Raises
    ------
    ConfigError    for unknown kinds, keys or values, naming ``where``
    """
    rest: dict[str, Any] = {}
    if isinstance(values, Mapping):
        rest.update(values)
    kind = rest.pop("kind", None)
    check_choice(f"{where}: kind", kind, list(kinds))
    with naming(f"{where}."):
        return read(kinds[kind], rest, where)


@contextlib.contextmanager
def naming(where: str) -> Iterator[None]:
    """Put ``where`` before a ConfigError whose text does not begin with its group."""
    group, dot, _ = where.partition(".")
    try:
        yield
    except ConfigError as error:
        if str(error).startswith(group + dot):
            raise
        raise ConfigError(f"{where}{error}") from None


def is_number(value: Any, *, finite: bool = True) -> bool:
    """True for a number of a file; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return not finite or abs(value) <= sys.float_info.max


def check_positive(group: Any, where: str, *names: str) -> None:
    """Raise ConfigError unless fields of a group are positive or None."""
    for name in names:
        value = getattr(group, name)
        if value is not None and not value > 0.0:
            key, (shown,) = _shown(group, name, value)
            raise ConfigError(f"{where}{key} = {shown} must be positive")


def check_limits(group: Any, where: str, **limits: tuple[float, float]) -> None:
    """Raise ConfigError unless fields of a group are None or within (low, high), both included.

    Parameters
    ----------
    group : dataclass in SI
    where : before the field's boundary name in the error, for instance ``"sensing.sensor."``
    limits : in SI, by field name
    """
    for name, (low, high) in limits.items():
        value = getattr(group, name)
        if value is not None and not low <= value <= high:
            key, shown = _shown(group, name, value, low, high)
            raise ConfigError(
                f"{where}{key} = {shown[0]} must lie in {shown[1]}..{shown[2]}"
            )


def check_ranges(group: Any, where: str, **limits: tuple[float, float]) -> None:
    """Raise ConfigError unless fields are two ordered numbers, [low, high], within limits."""
    for name, (low, high) in limits.items():
        ends = getattr(group, name)
        if len(ends) != 2 or not low <= ends[0] <= ends[1] <= high:
            key, (least, most, *shown) = _shown(group, name, low, high, *ends)
            raise ConfigError(
                f"{where}{key} = [{', '.join(shown)}] must be two ordered numbers, "
                f"[low, high], in {least}..{most}"
            )


def check_choice(key: str, value: Any, allowed: Collection[Any]) -> None:
    """Raise ConfigError for a value that is not one of ``allowed``."""
    if value not in allowed:
        raise ConfigError(f"{key} = {value!r}; allowed: {', '.join(map(str, allowed))}")


def _shown(group: Any, name: str, *values: float) -> tuple[str, list[str]]:
    """Boundary name of a dataclass's field, and its SI values as text in that unit."""
    key = _boundary_name(type(group).__dataclass_fields__[name])
    return key, [f"{from_si(key, value):g}" for value in values]


class _Key(NamedTuple):
    """A key of a file: the field that it fills, types that it may have, SI value of its unit."""

    field: dataclasses.Field[Any]
    kinds: tuple[Any, ...]
    factor: float
    is_required: bool


@functools.lru_cache(maxsize=128)
def _keys(cls: type) -> dict[str, _Key]:
    """Keys of a dataclass by their boundary names, which cost more than reading one."""
    hints, keys = typing.get_type_hints(cls), {}
    for field in dataclasses.fields(cls):
        name, hint = _boundary_name(field), hints[field.name]
        kinds = (hint,)
        if isinstance(hint, types.UnionType):
            kinds = typing.get_args(hint)
        is_required = (
            field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING
        )
        keys[name] = _Key(field, kinds, to_si(name, 1.0), is_required)
    return keys


def _boundary_name(field: dataclasses.Field[Any]) -> str:
    return "_".join([field.name, *field.metadata.values()])


def _unknown(key: str, names: Mapping[str, dataclasses.Field[Any]]) -> str:
    for right, field in names.items():
        if field.name in (key, split_unit(key)[0]):
            return f"'{key}' has the wrong unit; write it as '{right}'"
    close = difflib.get_close_matches(key, names, n=1)
    hint = f"known: {', '.join(names)}"
    if close:
        hint = f"did you mean '{close[0]}'?"
    return f"unknown key '{key}'; {hint}"


def _convert(where: str, key: str, value: Any, known: _Key) -> Any:
    kinds, factor = known.kinds, known.factor
    if float in kinds and is_number(value):
        return float(value) * factor
    if value is None and type(None) in kinds:
        return None
    name = f"{where}.{key}"
    if value is None:
        raise ConfigError(f"{name} is null; give a value")
    if any(_is_a(kind, value) for kind in (int, bool, str) if kind in kinds):
        return value
    for kind, row in LISTS.items():
        is_list = row in kinds and isinstance(value, list | tuple)
        if is_list and all(_is_a(kind, entry) for entry in value):
            if kind is float:
                return tuple(float(entry) * factor for entry in value)
            return tuple(value)
    if float in kinds and is_number(value, finite=False):
        raise ConfigError(f"{name} = {value} is not finite")
    wanted = " or ".join(TYPES.get(kind, "null") for kind in kinds)
    raise ConfigError(f"{name} = {value!r} is not {wanted}")


def _is_a(kind: Any, value: Any) -> bool:
    """True for a value of a file that stands for ``kind``; whole numbers are numbers too."""
    if kind is float:
        return is_number(value)
    return isinstance(value, kind) and (kind is bool or not isinstance(value, bool))
