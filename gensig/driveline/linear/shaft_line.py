"""A branched geared shaft line: inertias, shafts, rigid compounds, couplings and gear meshes.

Every rotation counts positive in the sense in which its own node turns, so that speed ratios are
positive numbers; the sense itself is the sign of ``ShaftLine.speed_ratio``. All inertias and
stiffnesses are those of their own shaft, none is referred to another one.
``docs/theory/drive_lines.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.pair import Support
from gensig.errors import ConfigError

Groups = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A disc: moment of inertia in kg m2 about its own shaft."""

    name: str
    inertia: float
    location: str = ""  # where it was read, for messages

    def __post_init__(self) -> None:
        if not 0.0 < self.inertia < math.inf:
            raise ConfigError(
                f"{self.location or self.name}: inertia {self.inertia:g} kg m2 must be positive"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """A torsional spring between two nodes.

    Stiffness in N m/rad, viscous damping in N m s/rad, loss factor.
    A ``rigid`` one is a compound that may be merged; one whose stiffness is None always is. One
    of stiffness 0 is a damper alone.
    """

    first: int
    second: int
    stiffness: float | None
    rigid: bool = False
    damping: float = 0.0
    loss_factor: float = 0.0
    location: str = ""

    def __post_init__(self) -> None:
        location = (
            self.location or f"shaft between nodes {self.first} and {self.second}"
        )
        if self.first == self.second:
            raise ConfigError(f"{location}: it joins a node to itself")
        if self.stiffness is None and not self.rigid:
            raise ConfigError(
                f"{location}: it has no stiffness; give one, or make it rigid"
            )
        if self.stiffness is not None and not 0.0 <= self.stiffness < math.inf:
            raise ConfigError(
                f"{location}: stiffness {self.stiffness:g} N m/rad must not be negative"
            )
        _check_losses(location, self.damping, self.loss_factor)
        if self.stiffness == self.damping == 0.0:
            raise ConfigError(
                f"{location}: it has neither stiffness nor damping; give one of both"
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
    """Two external gears in mesh, by their numbers in ``ShaftLine.gears``.

    ``stiffness`` N/m is along the transverse line of action. ``backlash`` m is the play along it
    that is left to the coast flank. ``center_line`` rad is the direction from the driving to the
    driven gear's centre in the common plane and ``pressure_angle`` rad the transverse working
    one: lateral motion needs both.
    """

    driving: int
    driven: int
    stiffness: float
    damping: float = 0.0
    loss_factor: float = 0.0
    backlash: float = 0.0
    center_line: float = 0.0
    pressure_angle: float = 0.0
    location: str = ""

    def __post_init__(self) -> None:
        location = self.location or f"mesh of gears {self.driving} and {self.driven}"
        if not 0.0 < self.stiffness < math.inf:
            raise ConfigError(
                f"{location}: mesh stiffness {self.stiffness:g} N/m must be positive"
            )
        if not 0.0 <= self.backlash < math.inf:
            raise ConfigError(
                f"{location}: backlash {self.backlash:g} m must not be negative"
            )
        _check_losses(location, self.damping, self.loss_factor)


def _check_losses(location: str, damping: float, loss_factor: float) -> None:
    for name, value in (("damping", damping), ("loss factor", loss_factor)):
        if not 0.0 <= value < math.inf:
            raise ConfigError(f"{location}: {name} {value:g} must not be negative")


def _loop(
    reached_from: Mapping[int, int | None], first: int, last: int
) -> tuple[int, ...]:
    """Nodes from one to another along the tree that reached both."""
    ways = []
    for node in (first, last):
        way: list[int] = []
        step: int | None = node
        while step is not None:
            way.append(step)
            step = reached_from[step]
        ways.append(way)
    there, back = ways
    meeting = next(node for node in there if node in back)
    return (
        *there[: there.index(meeting) + 1],
        *reversed(back[: back.index(meeting)]),
    )


def _check_numbers(name: str, numbers: tuple[int, ...], count: int, kind: str) -> None:
    for number in numbers:
        if not 0 <= number < count:
            raise ConfigError(
                f"{name}: there is no {kind} {number}, only 0..{count - 1}"
            )


@dataclass(frozen=True, kw_only=True)
class ShaftLine:
    """Nodes and all that joins them; numbers count from 0. No slots: derived values are kept.

    Raises
    ------
    ConfigError    for joints of nodes or gears that do not exist, and for loops whose gears lock
    """

    nodes: tuple[Node, ...]
    shafts: tuple[Shaft, ...] = ()
    gears: tuple[LineGear, ...] = ()
    meshes: tuple[GearMesh, ...] = ()

    def __post_init__(self) -> None:
        if not self.nodes:
            raise ConfigError("a shaft line needs at least one node")
        n_nodes, n_gears = len(self.nodes), len(self.gears)
        for shaft in self.shafts:
            ends = shaft.first, shaft.second
            _check_numbers(shaft.location or "a shaft", ends, n_nodes, "node")
        for gear in self.gears:
            _check_numbers(gear.name, (gear.node,), n_nodes, "node")
        for mesh in self.meshes:
            location = mesh.location or "a mesh"
            _check_numbers(location, (mesh.driving, mesh.driven), n_gears, "gear")
            driving, driven = self.gears[mesh.driving], self.gears[mesh.driven]
            if driving.node == driven.node:
                raise ConfigError(
                    f"{location}: {driving.name} and {driven.name} turn with the same node"
                )
            expected = driving.base_radius * driven.n_teeth
            if not math.isclose(
                expected, driven.base_radius * driving.n_teeth, rel_tol=1e-9
            ):
                raise ConfigError(
                    f"{location}: the base radii of {driving.name} and {driven.name} are not as "
                    f"their teeth, {driving.n_teeth} and {driven.n_teeth}; "
                    "they have another module, pressure angle or helix angle"
                )
        _ = self._speeds  # refuses loops that lock

    @cached_property
    def _speeds(self) -> tuple[Fraction, ...]:
        """Signed speed of every node over that of the first of its part, exactly, (node,)."""
        joints: list[list[tuple[int, Fraction, str]]] = [[] for _ in self.nodes]
        for shaft in self.shafts:
            joints[shaft.first].append((shaft.second, Fraction(1), shaft.location))
            joints[shaft.second].append((shaft.first, Fraction(1), shaft.location))
        for mesh in self.meshes:
            driving, driven = self.gears[mesh.driving], self.gears[mesh.driven]
            ratio = Fraction(-driving.n_teeth, driven.n_teeth)
            joints[driving.node].append((driven.node, ratio, mesh.location))
            joints[driven.node].append((driving.node, 1 / ratio, mesh.location))
        speeds: dict[int, Fraction] = {}
        reached_from: dict[int, int | None] = {}
        for first in range(len(self.nodes)):
            if first in speeds:
                continue
            speeds[first], reached_from[first] = Fraction(1), None
            waiting = [first]
            while waiting:
                node = waiting.pop()
                for mate, ratio, location in joints[node]:
                    speed = speeds[node] * ratio
                    if mate not in speeds:
                        speeds[mate], reached_from[mate] = speed, node
                        waiting.append(mate)
                    elif speeds[mate] != speed:
                        loop = _loop(reached_from, node, mate)
                        names = " - ".join(self.nodes[n].name for n in loop)
                        raise ConfigError(
                            f"{location or 'a loop'}: this joint closes a loop that locks, "
                            f"{names}: it would turn {self.nodes[mate].name} at "
                            f"{float(speed):g} of the first node's speed, the rest of the loop "
                            f"at {float(speeds[mate]):g}; change teeth or leave a joint out"
                        )
        return tuple(speeds[node] for node in range(len(self.nodes)))

    @property
    def speed_ratio(self) -> Array:
        """Speed of every node over that of the first of its part, (node,).

        Negative where it turns the other way.
        """
        return np.array([float(speed) for speed in self._speeds])

    def _joined(self, shafts: Iterable[Shaft], *, with_meshes: bool) -> Groups:
        """Nodes that chains of some shafts, and of all meshes, join; by their first nodes."""
        joints = [(shaft.first, shaft.second) for shaft in shafts]
        if with_meshes:
            joints += [
                (self.gears[mesh.driving].node, self.gears[mesh.driven].node)
                for mesh in self.meshes
            ]
        leader = np.arange(len(self.nodes))
        for first, second in joints:
            kept, merged = sorted((leader[first], leader[second]))
            leader[leader == merged] = kept
        return tuple(
            tuple(np.flatnonzero(leader == first).tolist())
            for first in np.unique(leader)
        )

    @property
    def parts(self) -> Groups:
        """Nodes of each part of the line that nothing joins to the others.

        A free line has a rigid mode for each.
        """
        return self._joined(self.shafts, with_meshes=True)

    @property
    def elastic_parts(self) -> Groups:
        """Nodes that springs, compounds and meshes hold to each other.

        The parts, less rings that only a fluid holds. Each turns as one without deforming
        anything, first that of the first node.
        """
        springs = [shaft for shaft in self.shafts if shaft.stiffness != 0.0]
        return self._joined(springs, with_meshes=True)

    @property
    def n_loops(self) -> int:
        """Independent closed loops: joints beyond those of a tree."""
        return len(self.shafts) + len(self.meshes) - len(self.nodes) + len(self.parts)

    def compounds(self, *, merge_rigid: bool) -> Groups:
        """Nodes that turn as one, in the order of their first node."""
        rigid = [
            shaft
            for shaft in self.shafts
            if shaft.stiffness is None or (merge_rigid and shaft.rigid)
        ]
        return self._joined(rigid, with_meshes=False)
