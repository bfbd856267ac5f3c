"""Torques on the nodes of a line at an operating point, of an engine or a motor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.units import unit

POINTS = 2880  # of a cycle of two turns, a quarter of a degree

LAWS = {"constant": 0, "linear": 1, "quadratic": 2}  # exponent of the speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """The point at which loads and drives are stated.

    ``torque`` is taken from the crank or the motor.
    """

    speed: float = unit("rpm")
    torque: float = unit("nm")

    def __post_init__(self) -> None:
        if not (self.speed > 0.0 and self.torque > 0.0):
            raise ConfigError(
                "excitation.reference: speed_rpm and torque_nm must be positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A driven machine; ``torque`` on its shaft is that at the reference speed."""

    node: int
    law: str
    torque: float = unit("nm")

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise ConfigError(f"load.law = {self.law!r}; allowed: {', '.join(LAWS)}")
        if not self.torque >= 0.0:
            raise ConfigError(f"load.torque_nm = {self.torque:g} must not be negative")


@dataclass(frozen=True, slots=True, kw_only=True)
class LineTorques:
    """Torques at one operating point; positive turns a node in its own sense of rotation.

    ``nodes`` (excited,) are node numbers, ``torque`` (excited, point) N m over two turns of the
    shaft that ``speed`` rad/s is of. ``brake_torque`` N m is what the load takes, at that shaft.
    """

    speed: float
    brake_torque: float
    nodes: tuple[int, ...]
    torque: Array

    def on(self, line_nodes: tuple[int, ...]) -> Array:
        """The torques on the nodes of a line, in its order, (node, point); 0 where nothing acts."""
        out = np.zeros((len(line_nodes), self.torque.shape[1]))
        for node, row in zip(self.nodes, self.torque, strict=True):
            out[line_nodes.index(node)] += row
        return out


def load_torques(
    loads: Mapping[str, Load], speed_share: float
) -> list[tuple[int, Array]]:
    """Mean torques of driven machines on their nodes at a share of the reference speed."""
    return [
        (load.node, np.array(-load.torque * speed_share ** LAWS[load.law]))
        for load in loads.values()
    ]


def by_node(
    parts: list[tuple[int, Array]], n_points: int
) -> tuple[tuple[int, ...], Array]:
    """Nodes of some torques in ascending order, and the sum on each, (node, point)."""
    nodes = tuple(sorted({node for node, _ in parts}))
    torques = np.zeros((len(nodes), n_points))
    for node, row in parts:
        torques[nodes.index(node)] += row
    return nodes, torques
