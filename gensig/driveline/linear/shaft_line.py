"""A branched geared shaft line: inertias, shafts, rigid compounds, couplings and gear meshes.

Every rotation counts positive in the sense in which its own node turns, so that speed ratios are
positive numbers; the sense itself is the sign of ``ShaftLine.speed_ratio``. All inertias and
stiffnesses are those of their own shaft, none is referred to another one.
``docs/theory/shaft_line.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.pair import Support
from gensig.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A disc: moment of inertia in kg m2 about its own shaft."""

    name: str
    inertia: float
    place: str = ""  # where it was read, for messages

    def __post_init__(self) -> None:
        if not 0.0 < self.inertia < math.inf:
            raise ConfigError(
                f"{self.place or self.name}: inertia {self.inertia:g} kg m2 must be positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """A torsional spring between two nodes: stiffness in N m/rad, viscous damping in N m s/rad,
    loss factor.

    A ``rigid`` one is a compound that may be merged; one whose stiffness is None always is. One
    of stiffness 0 is a damper alone.
    """

    first: int
    second: int
    stiffness: float | None
    rigid: bool = False
    damping: float = 0.0
    loss_factor: float = 0.0
    place: str = ""

    def __post_init__(self) -> None:
        place = self.place or f"shaft between nodes {self.first} and {self.second}"
        if self.first == self.second:
            raise ConfigError(f"{place}: it joins a node to itself")
        if self.stiffness is None and not self.rigid:
            raise ConfigError(
                f"{place}: it has no stiffness; give one, or make it rigid"
            )
        if self.stiffness is not None and not 0.0 <= self.stiffness < math.inf:
            raise ConfigError(
                f"{place}: stiffness {self.stiffness:g} N m/rad must not be negative"
            )
        _check_losses(place, self.damping, self.loss_factor)
        if self.stiffness == self.damping == 0.0:
            raise ConfigError(
                f"{place}: it has neither stiffness nor damping; give one of both"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class LineGear:
    """A gear on a node.

    ``mass`` in kg and ``support`` serve its lateral motion, which it has where both are known.
    """

    name: str
    node: int
    n_teeth: int
    base_radius: float
    mass: float | None = None
    support: Support | None = None

    def __post_init__(self) -> None:
        if self.n_teeth < 1 or not 0.0 < self.base_radius < math.inf:
            raise ConfigError(
                f"{self.name}: teeth ({self.n_teeth}) and base radius must be positive"
            )
        if self.mass is not None and not 0.0 < self.mass < math.inf:
            raise ConfigError(f"{self.name}: mass {self.mass:g} kg must be positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class GearMesh:
    """Two external gears in mesh, places in ``ShaftLine.gears``; ``stiffness`` N/m along the
    transverse line of action.

    ``backlash`` m is the play along it that is left to the coast flank. ``center_line`` rad is
    the direction from the driving to the driven gear's centre in the common plane and
    ``pressure_angle`` rad the transverse working one: lateral motion needs both.
    """

    driving: int
    driven: int
    stiffness: float
    damping: float = 0.0
    loss_factor: float = 0.0
    backlash: float = 0.0
    center_line: float = 0.0
    pressure_angle: float = 0.0
    place: str = ""

    def __post_init__(self) -> None:
        place = self.place or f"mesh of gears {self.driving} and {self.driven}"
        if not 0.0 < self.stiffness < math.inf:
            raise ConfigError(
                f"{place}: mesh stiffness {self.stiffness:g} N/m must be positive"
            )
        if not 0.0 <= self.backlash < math.inf:
            raise ConfigError(
                f"{place}: backlash {self.backlash:g} m must not be negative"
            )
        _check_losses(place, self.damping, self.loss_factor)


def _check_losses(place: str, damping: float, loss_factor: float) -> None:
    for name, value in (("damping", damping), ("loss factor", loss_factor)):
        if not 0.0 <= value < math.inf:
            raise ConfigError(f"{place}: {name} {value:g} must not be negative")


@dataclass(frozen=True, kw_only=True)
class ShaftLine:
    """Nodes and all that joins them; places count from 0. No slots: what is derived is kept.

    Raises
    ------
    ConfigError    for joints of nodes or gears that there are not, and for loops whose gears would lock
    """

    nodes: tuple[Node, ...]
    shafts: tuple[Shaft, ...] = ()
    gears: tuple[LineGear, ...] = ()
    meshes: tuple[GearMesh, ...] = ()

    def __post_init__(self) -> None:
        if not self.nodes:
            raise ConfigError("a shaft line needs at least one node")
        for shaft in self.shafts:
            self._check_places(
                shaft.place or "a shaft",
                (shaft.first, shaft.second),
                len(self.nodes),
                "node",
            )
        for gear in self.gears:
            self._check_places(gear.name, (gear.node,), len(self.nodes), "node")
        for mesh in self.meshes:
            self._check_places(
                mesh.place or "a mesh",
                (mesh.driving, mesh.driven),
                len(self.gears),
                "gear",
            )
            one, other = self.gears[mesh.driving], self.gears[mesh.driven]
            if one.node == other.node:
                raise ConfigError(
                    f"{mesh.place or 'a mesh'}: {one.name} and {other.name} turn with the same node"
                )
            if not math.isclose(
                one.base_radius * other.n_teeth,
                other.base_radius * one.n_teeth,
                rel_tol=1e-9,
            ):
                raise ConfigError(
                    f"{mesh.place or 'a mesh'}: the base radii of {one.name} and {other.name} are not as their teeth, "
                    f"{one.n_teeth} and {other.n_teeth}; they have another module, pressure angle or helix angle"
                )
        _ = self._turning  # refuses loops that lock

    @staticmethod
    def _check_places(
        what: str, places: tuple[int, ...], count: int, kind: str
    ) -> None:
        for place in places:
            if not 0 <= place < count:
                raise ConfigError(
                    f"{what}: there is no {kind} {place}, only 0..{count - 1}"
                )

    @cached_property
    def _turning(self) -> tuple[tuple[Fraction, ...], tuple[int, ...]]:
        """Signed speed of every node over that of the first of its part, exactly, and the number
        of its part.
        """
        joints: list[list[tuple[int, Fraction, str]]] = [[] for _ in self.nodes]
        for shaft in self.shafts:
            joints[shaft.first].append((shaft.second, Fraction(1), shaft.place))
            joints[shaft.second].append((shaft.first, Fraction(1), shaft.place))
        for mesh in self.meshes:
            one, other = self.gears[mesh.driving], self.gears[mesh.driven]
            joints[one.node].append(
                (other.node, Fraction(-one.n_teeth, other.n_teeth), mesh.place)
            )
            joints[other.node].append(
                (one.node, Fraction(-other.n_teeth, one.n_teeth), mesh.place)
            )
        speed: list[Fraction | None] = [None] * len(self.nodes)
        part = [-1] * len(self.nodes)
        for first in range(len(self.nodes)):
            if speed[first] is not None:
                continue
            speed[first], part[first], waiting = Fraction(1), max(part) + 1, [first]
            while waiting:
                node = waiting.pop()
                own = speed[node]
                assert own is not None
                for mate, ratio, place in joints[node]:
                    known = speed[mate]
                    if known is None:
                        speed[mate], part[mate] = own * ratio, part[first]
                        waiting.append(mate)
                    elif known != own * ratio:
                        raise ConfigError(
                            f"{place or 'a loop'}: this joint closes a loop that locks: it would turn "
                            f"{self.nodes[mate].name} at {float(own * ratio):g} of the first node's speed, the rest of "
                            f"the loop at {float(known):g}; change teeth or leave the joint out"
                        )
        return tuple(value for value in speed if value is not None), tuple(part)

    @property
    def speed_ratio(self) -> Array:
        """Speed of every node over that of the first of its part, negative where it turns the
        other way, (node,).
        """
        return np.array([float(value) for value in self._turning[0]])

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """Nodes of each part of the line that nothing joins to the others.

        A free line has a rigid mode for each.
        """
        part = self._turning[1]
        return tuple(
            tuple(n for n, own in enumerate(part) if own == one)
            for one in range(max(part) + 1)
        )

    @property
    def elastic_parts(self) -> tuple[tuple[int, ...], ...]:
        """Nodes that springs, compounds and meshes hold to each other: the parts, less rings that
        only a fluid holds.

        Each turns as one without deforming anything, first that of the first node.
        """
        leader = list(range(len(self.nodes)))
        joints = [
            (shaft.first, shaft.second)
            for shaft in self.shafts
            if shaft.stiffness != 0.0
        ]
        joints += [
            (self.gears[mesh.driving].node, self.gears[mesh.driven].node)
            for mesh in self.meshes
        ]
        for first, second in joints:
            one, other = sorted((leader[first], leader[second]))
            leader = [one if own == other else own for own in leader]
        return tuple(
            tuple(n for n, own in enumerate(leader) if own == one)
            for one in sorted(set(leader))
        )

    @property
    def n_loops(self) -> int:
        """Independent closed loops: joints beyond those of a tree."""
        return len(self.shafts) + len(self.meshes) - len(self.nodes) + len(self.parts)

    def compounds(self, *, merge_rigid: bool) -> tuple[tuple[int, ...], ...]:
        """Nodes that turn as one, in the order of their first node."""
        leader = list(range(len(self.nodes)))
        for shaft in self.shafts:
            if shaft.stiffness is None or (merge_rigid and shaft.rigid):
                one, other = sorted((leader[shaft.first], leader[shaft.second]))
                leader = [one if own == other else own for own in leader]
        return tuple(
            tuple(n for n, own in enumerate(leader) if own == one)
            for one in sorted(set(leader))
        )
