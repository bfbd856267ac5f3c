"""Torques of a motor and of what it drives on the nodes of a shaft line: no engine, no cams."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.driveline.excitation.cycle import cycle_angles
from gensig.driveline.excitation.line_torques import (
    LAWS,
    POINTS,
    LineTorques,
    Load,
    Reference,
    by_node,
    load_torques,
)
from gensig.errors import ConfigError

MOST_ORDER = 100.0  # of a ripple over the turn, which the steady response reaches


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueRipple:
    """A motor's torque pulsation: a share of its mean torque, so many waves in a turn."""

    share: float
    order: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ConfigError(f"torque_ripple.share = {self.share:g} must lie in 0..1")
        if not (0.0 < self.order <= MOST_ORDER and (2.0 * self.order).is_integer()):
            raise ConfigError(
                f"torque_ripple.order = {self.order:g}: give waves in a turn of the "
                "motor, a multiple of 0.5 up to "
                f"{MOST_ORDER:g}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorDrive:
    """A motor at one node and a load at another one, with further driven machines between them.

    ``slip`` is the motor's at the reference: (synchronous speed - speed) / synchronous speed.
    ``load_law`` names how the load's torque changes with its speed.
    """

    reference: Reference
    motor_node: int
    load_node: int
    slip: float
    ripple: TorqueRipple | None
    load_law: str
    loads: Mapping[str, Load]

    def __post_init__(self) -> None:
        if not 0.0 < self.slip < 1.0:
            raise ConfigError(
                f"excitation.motor.slip = {self.slip:g} must lie between 0 and 1, such as 0.03"
            )
        if self.load_law not in LAWS:
            raise ConfigError(
                f"excitation.load.law = {self.load_law!r}; allowed: {', '.join(LAWS)}"
            )

    @property
    def driving_nodes(self) -> tuple[int, ...]:
        """Numbers of the nodes that what speeds the line up comes from.

        Speeds are those of the first.
        """
        return (self.motor_node,)

    @property
    def load_exponent(self) -> int:
        """Power of the speed by which the load's torque changes along a course."""
        return LAWS[self.load_law]

    @property
    def pressure_decides_torque(self) -> bool:
        """Never: there is no cylinder."""
        return False

    def dampers(self, ratios: Mapping[int, float]) -> dict[int, float]:
        """Slopes of torque over speed by node, N m s/rad: the motor gives less when faster, loads
        take more.

        Near its synchronous speed the torque of an induction motor is in proportion to the slip
        (Fitzgerald, Kingsley & Umans, Electric Machinery, 6th ed., section 6.5; from memory),
        which makes T (1 - s) / (s omega) at the reference; under V/f control that slope is the
        same at every speed. Of the loads it is n T / omega of their laws there.
        """
        speed, torque = self.reference.speed, self.reference.torque
        slopes = {self.motor_node: torque * (1.0 - self.slip) / (self.slip * speed)}
        taken = [(self.load_node, self.load_law, torque / ratios[self.load_node])]
        taken += [(load.node, load.law, load.torque) for load in self.loads.values()]
        for node, law, torque_there in taken:
            slopes[node] = slopes.get(node, 0.0) + LAWS[law] * torque_there / (
                speed * ratios[node]
            )
        return slopes


def motor_torques(
    drive: MotorDrive,
    speed: float,
    torque: float,
    ratios: Mapping[int, float],
    *,
    n_points: int = POINTS,
) -> LineTorques:
    """Torques on the shaft line at a speed of the motor and a torque that the load takes.

    Parameters
    ----------
    speed : rad/s      of the motor
    torque : N m       of the load, as the motor feels it: over the ratio of their speeds
    ratios : speed of each node over the motor's
    n_points : of two turns

    Raises
    ------
    ConfigError    for a speed or a torque that no motor gives

    Notes
    -----
    The motor gives what the load and the further machines take, so that the mean powers
    balance: what meshes and joints lose is a matter of vibration, and the slip and the governor
    give it.
    """
    if not speed > 0.0:
        raise ConfigError(
            f"the speed of the motor, {speed * 30.0 / math.pi:g} r/min, must be positive"
        )
    if not 0.0 <= torque < math.inf:
        raise ConfigError(
            f"the torque of the load, {torque:g} N m at the motor, must be 0 or more"
        )
    share = speed / drive.reference.speed
    parts = load_torques(drive.loads, share)
    parts.append((drive.load_node, np.array(-torque / ratios[drive.load_node])))
    taken = -sum(ratios[node] * float(row) for node, row in parts)
    wave: Array = np.ones(n_points)
    if drive.ripple is not None:
        wave = wave + drive.ripple.share * np.sin(
            drive.ripple.order * cycle_angles(n_points)
        )
    given = taken / ratios[drive.motor_node] * wave
    nodes, torques = by_node([(drive.motor_node, given), *parts], n_points)
    return LineTorques(speed=speed, brake_torque=torque, nodes=nodes, torque=torques)
