"""The group ``excitation`` of a configuration whose line a motor turns.

``kind: motor_and_load``.
"""

from __future__ import annotations

from dataclasses import dataclass

from gensig.driveline.drive_line import DriveLine
from gensig.driveline.excitation.engine import (
    GROUP,
    check_group,
    check_keys,
    named_groups,
    read_named,
)
from gensig.driveline.excitation.engine import KEYS as ENGINE_KEYS
from gensig.driveline.excitation.line_torques import Load, Reference
from gensig.driveline.excitation.motor_torques import MotorDrive, TorqueRipple
from gensig.driveline.table_rows import told_nodes
from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.units import read

KIND = "motor_and_load"
KEYS = ("kind", "reference", "motor", "load", "loads", "toothed_wheels")
TOGETHER = (
    "the tables want system.motor_node, system.load_node and, for records, "
    "system.record_mesh of their own"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Motor:
    """Keys of ``excitation.motor``."""

    slip: float
    torque_ripple: TorqueRipple | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Load:
    """Keys of ``excitation.load``."""

    law: str


def read_motor(values: Section, drive: DriveLine) -> MotorDrive:
    """A motor and its load on the nodes that ``system.motor_node`` and ``system.load_node`` name.

    Raises
    ------
    ConfigError    for unknown or missing keys, nodes that the line has not, an engine beside
        the motor
    """
    if both := [key for key in values if key in ENGINE_KEYS and key not in KEYS]:
        raise ConfigError(
            f"{GROUP}.{both[0]} is of an engine, {GROUP}.kind = {KIND} of a motor: a "
            "line is turned by one of them; "
            "take excitation=motor_and_load or excitation=engine_v20"
        )
    check_keys(values, KEYS)
    given = values["motor"]
    check_group(f"{GROUP}.motor", given)
    ripple = given.get("torque_ripple")
    if ripple is not None:
        ripple = read_named(
            TorqueRipple, ripple, "motor.torque_ripple", "torque_ripple"
        )
    motor = read(
        _Motor,
        {key: value for key, value in given.items() if key != "torque_ripple"},
        f"{GROUP}.motor",
        torque_ripple=ripple,
    )
    loads = {
        name: read_named(Load, value, f"loads.{name}", "load")
        for name, value in named_groups("loads", values["loads"])
    }
    for name, load in loads.items():
        if load.node not in drive.numbers:
            raise ConfigError(
                f"{GROUP}.loads.{name}.node: {_no_node(drive, load.node)}"
            )
    motor_node = _node(drive, "motor_node", "a motor", drive.motor_node)
    load_node = _node(drive, "load_node", "its load", drive.load_node)
    if motor_node == load_node and not loads:
        raise ConfigError(
            f"system.motor_node and system.load_node are both {motor_node}: the load would take "
            "the torque where the motor gives it, and no gear would carry any; put the load on "
            "another node"
        )
    return MotorDrive(
        reference=read(Reference, values["reference"], f"{GROUP}.reference"),
        motor_node=motor_node,
        load_node=load_node,
        slip=motor.slip,
        ripple=motor.torque_ripple,
        load_law=read(_Load, values["load"], f"{GROUP}.load").law,
        loads=loads,
    )


def _node(drive: DriveLine, key: str, what: str, node: int | None) -> int:
    """A node of the line; the motor's turns as fast as the first one, to which all speeds refer."""
    if node is None:
        raise ConfigError(
            f"system.{key} = null: {GROUP}={KIND} needs the node of {what}, and "
            f"{drive.name} has branches: give one of {told_nodes(drive.numbers)}; {TOGETHER}"
        )
    if node not in drive.numbers:
        raise ConfigError(f"system.{key} = {node}: {_no_node(drive, node)}; {TOGETHER}")
    ratio = abs(float(drive.line.speed_ratio[drive.numbers.index(node)]))
    if key == "motor_node" and abs(ratio - 1.0) > 1e-9:
        raise ConfigError(
            f"system.motor_node = {node} turns {ratio:.4g} times as fast as the first "
            "node, to which speeds refer; put "
            "the motor's row first in system.shafting_csv"
        )
    return node


def _no_node(drive: DriveLine, node: int) -> str:
    return f"the shaft line has no node {node}; it has {told_nodes(drive.numbers)}"
