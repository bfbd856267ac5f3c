"""Torsional vibration dampers: a ring on a node of a shaft line, held by a fluid, a spring or both.

``docs/theory/engine.md``. Source: J. P. Den Hartog, Mechanical Vibrations (1956), 3.2 and 3.3,
5.4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array, Complex
from gensig.driveline.linear.shaft_line import Node, Shaft, ShaftLine
from gensig.errors import ConfigError
from gensig.units import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class TorsionalDamper:
    """A ring of its own inertia (kg m2) held on ``node`` by ``damping`` (N m s/rad) and
    ``stiffness`` (N m/rad).

    ``node`` is the number that the line's table gives it. Without stiffness it is a viscous
    damper (Houdaille), whose ring only the fluid takes along.
    """

    node: int
    ring_inertia: float = unit("kg_m2")
    damping: float = unit("nms_per_rad")
    stiffness: float = unit("nm_per_rad")

    def __post_init__(self) -> None:
        if not 0.0 < self.ring_inertia < math.inf:
            raise ConfigError(
                f"damper.ring_inertia_kg_m2 = {self.ring_inertia:g} must be positive"
            )
        for key, value in (
            ("damping_nms_per_rad", self.damping),
            ("stiffness_nm_per_rad", self.stiffness),
        ):
            if not 0.0 <= value < math.inf:
                raise ConfigError(f"damper.{key} = {value:g} must not be negative")
        if self.damping == self.stiffness == 0.0:
            raise ConfigError(
                "damper: without damping and stiffness nothing holds the ring; give one of both"
            )

    def dynamic_stiffness(self, frequency: Array) -> Complex:
        """Dynamic stiffness that it adds to its node at angular frequencies in rad/s, N m/rad.

        The ring's equation solved for the ring: -w^2 J (k + i w c) / (k + i w c - w^2 J).
        """
        w = np.asarray(frequency, dtype=float)
        hold = self.stiffness + 1j * w * self.damping
        mass = np.square(w) * self.ring_inertia
        return -mass * hold / (hold - mass)


def with_dampers(
    line: ShaftLine, numbers: Sequence[int], dampers: Sequence[TorsionalDamper]
) -> tuple[ShaftLine, tuple[int, ...]]:
    """A line with its dampers' rings as further nodes, and the numbers of all nodes; rings count
    on from the highest.

    Raises
    ------
    ConfigError    for a node that the line has not
    """
    nodes, shafts, known = list(line.nodes), list(line.shafts), list(numbers)
    for damper in dampers:
        if damper.node not in numbers:
            raise ConfigError(
                f"system.dampers: node {damper.node} is not in the shaft line; it has "
                f"{min(numbers)} to {max(numbers)}"
            )
        hub = numbers.index(damper.node)
        name = f"Damper ring on {line.nodes[hub].name}"
        shafts.append(
            Shaft(
                first=hub,
                second=len(nodes),
                stiffness=damper.stiffness,
                damping=damper.damping,
                location=name,
            )
        )
        nodes.append(Node(name=name, inertia=damper.ring_inertia))
        known.append(max(known) + 1)
    return replace(line, nodes=tuple(nodes), shafts=tuple(shafts)), tuple(known)
