"""The group ``excitation`` of a configuration: an engine and what it drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.driveline.excitation.cams import Cam
from gensig.driveline.excitation.cycle import Cylinder
from gensig.driveline.excitation.engine_torques import Dynamometer, Engine, ValveTrain
from gensig.driveline.excitation.firing import Layout
from gensig.driveline.excitation.injection_pump import Plunger
from gensig.driveline.excitation.line_torques import Load, Reference
from gensig.driveline.excitation.pressure import PressureFile, WiebeCycle
from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.sensing.toothed_wheel import ToothedWheel
from gensig.units import read, to_si

GROUP = "excitation"
KEYS = (
    "kind",
    "reference",
    "cylinder",
    "layout",
    "pressure",
    "crankcase_pressure_mpa",
    "friction_mean_pressure_mpa",
    "throw_nodes",
    "valves",
    "valve_nodes",
    "injection_pump",
    "loads",
    "dynamometer",
    "toothed_wheels",
)


def read_engine(values: Section) -> Engine:
    """An engine of the boundary keys of the group ``excitation``.

    Raises
    ------
    ConfigError    for unknown or missing keys, and values that make no engine
    """
    check_group(GROUP, values)
    if values.get("kind", "engine") != "engine":
        raise ConfigError(
            f"{GROUP}.kind = {values['kind']!r}; allowed: engine, motor_and_load"
        )
    if "motor" in values:
        raise ConfigError(
            f"{GROUP}.motor is of a motor, {GROUP}.kind = engine of an engine: a line "
            "is turned by one of them; take "
            "excitation=engine_v20 or excitation=motor_and_load"
        )
    check_keys(values, KEYS)
    plunger, plunger_nodes = _read_pump(values["injection_pump"])
    return Engine(
        cylinder=read(Cylinder, values["cylinder"], f"{GROUP}.cylinder"),
        layout=read(Layout, values["layout"], f"{GROUP}.layout"),
        pressure=_read_pressure(values["pressure"]),
        crankcase_pressure=_number("crankcase_pressure_mpa", values),
        friction_mean_pressure=_number("friction_mean_pressure_mpa", values),
        reference=read(Reference, values["reference"], f"{GROUP}.reference"),
        throw_nodes=_whole_numbers("throw_nodes", values["throw_nodes"]),
        valve_trains={
            name: _read_train(name, value)
            for name, value in named_groups("valves", values["valves"])
        },
        valve_nodes={
            name: _whole_numbers(f"valve_nodes.{name}", value)
            for name, value in named_groups("valve_nodes", values["valve_nodes"])
        },
        plunger=plunger,
        plunger_nodes=plunger_nodes,
        loads={
            name: read_named(Load, value, f"loads.{name}", "load")
            for name, value in named_groups("loads", values["loads"])
        },
        dynamometer=read(Dynamometer, values["dynamometer"], f"{GROUP}.dynamometer"),
    )


def check_keys(values: Section, keys: tuple[str, ...]) -> None:
    """Raise for keys of the group ``excitation`` that are unknown or missing."""
    for key in values:
        if key not in keys:
            raise ConfigError(f"{GROUP}: unknown key '{key}'; known: {', '.join(keys)}")
    if missing := [key for key in keys if key not in values]:
        raise ConfigError(f"{GROUP}: missing {', '.join(missing)}")


def read_wheels(values: Section) -> dict[str, ToothedWheel]:
    """The toothed wheels of the group ``excitation``, by their names; none where it is null."""
    check_group(GROUP, values)
    return {
        name: read_named(ToothedWheel, value, f"toothed_wheels.{name}", "toothed_wheel")
        for name, value in named_groups("toothed_wheels", values.get("toothed_wheels"))
    }


def _read_pressure(values: Any) -> WiebeCycle | PressureFile:
    """The cycle, or the file in its place where one is given."""
    check_group(f"{GROUP}.pressure", values)
    cycle = read(
        WiebeCycle,
        {key: value for key, value in values.items() if key != "file"},
        f"{GROUP}.pressure",
    )
    if values.get("file") is None:
        return cycle
    return read(PressureFile, {"file": values["file"]}, f"{GROUP}.pressure")


def _read_train(name: str, values: Any) -> ValveTrain:
    train: ValveTrain = _read_with_cam(ValveTrain, values, f"valves.{name}")
    return train


def _read_with_cam(
    cls: type[Any], values: Any, key: str, left_out: tuple[str, ...] = ()
) -> Any:
    """A dataclass with a cam; keys of ``left_out`` are read elsewhere."""
    check_group(f"{GROUP}.{key}", values)
    given = {key: values[key] for key in values if key not in ("cam", *left_out)}
    cam = read_named(Cam, values.get("cam"), f"{key}.cam", "cam")
    return read(cls, given, f"{GROUP}.{key}", cam=cam)


def _read_pump(values: Any) -> tuple[Plunger | None, dict[str, int]]:
    """The plunger, and for each cylinder the node of its plunger.

    Null is an engine without this pump, with a common rail.
    """
    if values is None:
        return None, {}
    check_group(f"{GROUP}.injection_pump", values)
    nodes = _whole_numbers("injection_pump.nodes", values.get("nodes"))
    cylinders = values.get("cylinders")
    is_list = isinstance(cylinders, list | tuple)
    if not is_list or not len(set(cylinders)) == len(cylinders) == len(nodes):
        raise ConfigError(
            f"{GROUP}.injection_pump.cylinders must name a different cylinder for "
            f"each of its {len(nodes)} nodes"
        )
    plunger = _read_with_cam(
        Plunger, values, "injection_pump", left_out=("nodes", "cylinders")
    )
    return plunger, dict(zip(cylinders, nodes, strict=True))


def read_named(cls: type[Any], values: Any, key: str, name: str) -> Any:
    """A dataclass whose own errors begin with ``name``: with the whole key instead."""
    check_group(f"{GROUP}.{key}", values)
    try:
        return read(cls, values, name)
    except ConfigError as error:
        raise ConfigError(f"{GROUP}.{key}{str(error).removeprefix(name)}") from None


def named_groups(key: str, values: Any) -> list[tuple[str, Any]]:
    """Names and values of a group that may be null."""
    if values is None:
        return []
    check_group(f"{GROUP}.{key}", values)
    return [(str(name), value) for name, value in values.items()]


def check_group(key: str, values: Any) -> None:
    """Raise for anything that is no group of keys."""
    if not isinstance(values, Mapping):
        raise ConfigError(f"{key} = {values!r} must be a group of keys, not one value")


def _whole_numbers(key: str, values: Any) -> tuple[int, ...]:
    if not isinstance(values, list | tuple) or not all(
        type(value) is int for value in values
    ):
        raise ConfigError(f"{GROUP}.{key} = {values!r} is not a list of whole numbers")
    return tuple(values)


def _number(key: str, values: Section) -> float:
    value = values[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{GROUP}.{key} = {value!r} is not a number")
    return to_si(key, float(value))
