"""The one converter between unit-suffixed names at the file boundary and SI inside.

``normal_module_mm: 2`` in a file is ``normal_module = 0.002`` in the code. A name without a known
suffix is a number without unit (``n_teeth``, ``damping_ratio``), taken as it is.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from gensig.errors import ConfigError

# suffix: (factor to SI, what it measures); longer suffixes first, so that kg_m2 is not read as m2
UNITS: dict[str, tuple[float, str]] = {
    "mpa_sqrt_m": (1e6, "stress intensity"),
    "kg_m2": (1.0, "moment of inertia"),
    "w_per_m2k": (1.0, "heat transfer coefficient"),
    "w_per_mk": (1.0, "thermal conductivity"),
    "j_per_kgk": (1.0, "specific heat"),
    "per_k": (1.0, "thermal expansion"),
    "degc": (
        1.0,
        "temperature",
    ),  # degrees Celsius inside too: only differences and tables of steel are asked
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

T = TypeVar("T")


@functools.lru_cache(maxsize=1024)
def split_unit(name: str) -> tuple[str, str | None]:
    """Split a boundary name into its bare name and its unit suffix (None where it has none)."""
    for suffix in UNITS:
        if name.endswith("_" + suffix):
            return name[: -len(suffix) - 1], suffix
    return name, None


def to_si(name: str, value: float) -> float:
    """Value of a suffixed name in SI units."""
    _, suffix = split_unit(name)
    return value if suffix is None else value * UNITS[suffix][0]


def from_si(name: str, value: float) -> float:
    """SI value in the unit that the suffixed name states."""
    _, suffix = split_unit(name)
    return value if suffix is None else value / UNITS[suffix][0]


def is_turning(channel: str) -> bool:
    """Whether a channel's acceleration is that of an angle, in rad/s2."""
    return channel.endswith(TURNING)


def channel_unit(channel: str) -> str:
    """Unit of a channel by its name."""
    if channel.endswith(SPEED):
        return "rad/s"
    return "rad/s^2" if is_turning(channel) else "m/s^2"


def read(cls: type[T], values: Mapping[str, Any], where: str, **given: Any) -> T:
    """Build a frozen dataclass from boundary keys.

    Parameters
    ----------
    cls : dataclass whose fields are SI quantities without suffix; ``metadata={"unit": "mm"}`` names the suffix
        that files use (a field without it is a plain number, text or flag)
    values : keys with suffixes, as in a configuration
    where : how to name the place in an error, for instance ``"gear.pinion"``
    given : fields that do not come from ``values``

    Raises
    ------
    ConfigError    for an unknown or missing key, a wrong suffix or a value of the wrong type
    """
    names = {
        key: field
        for key, field in _boundary_fields(cls).items()
        if field.name not in given
    }  # type: ignore[arg-type]
    hints = _hints(cls)  # type: ignore[arg-type]
    if not isinstance(values, Mapping):
        raise ConfigError(
            f"{where} = {values!r} must be a group of keys, not one value"
        )
    result = dict(given)
    for key, value in values.items():
        if key not in names:
            fields = {field.name: field for field in names.values()}
            raise ConfigError(f"{where}: {_unknown(key, fields, list(names))}")
        field = names[key]
        result[field.name] = _convert(f"{where}.{key}", key, value, hints[field.name])
    missing = [
        name
        for name, field in names.items()
        if field.name not in result
        and field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise ConfigError(f"{where}: missing {', '.join(missing)}")
    return cls(**result)


@functools.lru_cache(maxsize=64)
def _boundary_fields(cls: type) -> dict[str, dataclasses.Field[Any]]:
    """Fields of a dataclass by their boundary names."""
    return {_boundary_name(field): field for field in dataclasses.fields(cls)}


@functools.lru_cache(maxsize=64)
def _hints(cls: type) -> dict[str, Any]:
    """Types of a dataclass's fields; looking them up costs more than all else in reading one."""
    return typing.get_type_hints(cls)


def unit(suffix: str, *, default: Any = dataclasses.MISSING) -> Any:
    """Dataclass field whose boundary name carries ``suffix``."""
    return dataclasses.field(default=default, metadata={"unit": suffix})


def _boundary_name(field: dataclasses.Field[Any]) -> str:
    suffix = field.metadata.get("unit")
    return field.name if suffix is None else f"{field.name}_{suffix}"


def _unknown(key: str, fields: Mapping[str, Any], names: list[str]) -> str:
    bare, _ = split_unit(key)
    if bare in fields or key in fields:
        right = _boundary_name(fields[bare if bare in fields else key])
        return f"'{key}' has the wrong unit; write it as '{right}'"
    close = difflib.get_close_matches(key, names, n=1)
    hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"
    return f"unknown key '{key}'; {hint}"


def _convert(place: str, key: str, value: Any, hint: Any) -> Any:
    kinds = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    if value is None:
        if type(None) in kinds:
            return None
        raise ConfigError(f"{place} is null; give a value")
    if isinstance(value, list | tuple):
        items = {
            typing.get_args(kind)[0]
            for kind in kinds
            if typing.get_origin(kind) is tuple
        }
        for item in items & {str, int, float}:
            if item is float and all(
                type(entry) is float and math.isfinite(entry) for entry in value
            ):
                suffix = split_unit(key)[1]  # looked up once: profiles are long
                return (
                    tuple(value)
                    if suffix is None
                    else tuple(entry * UNITS[suffix][0] for entry in value)
                )
            if all(_is_a(item, entry) for entry in value):
                return tuple(
                    to_si(key, float(entry)) if item is float else entry
                    for entry in value
                )
    for kind in (float, int, bool, str):
        if kind in kinds and _is_a(kind, value):
            return to_si(key, float(value)) if kind is float else value
    if float in kinds and _is_a(float, value, finite=False):
        raise ConfigError(f"{place} = {value} is not finite")
    raise ConfigError(
        f"{place} = {value!r} is not {' or '.join(_named(kind) for kind in kinds if kind is not None)}"
    )


def _is_a(kind: type, value: Any, *, finite: bool = True) -> bool:
    """Whether a value of a file stands for ``kind``.

    Whole numbers are numbers too, true and false are none.
    """
    if kind is float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and (not finite or math.isfinite(value))
    return isinstance(value, kind) and (kind is bool or not isinstance(value, bool))


def _named(kind: Any) -> str:
    """What a user calls a type."""
    if typing.get_origin(kind) is tuple:
        return {
            str: "a list of names",
            int: "a list of whole numbers",
            float: "a list of numbers",
        }[typing.get_args(kind)[0]]
    return {
        float: "a number",
        int: "a whole number",
        bool: "true or false",
        str: "text",
    }.get(kind, "null")
