"""Nuisances: forces on one gear that follow angles of its machine, and how they are drawn."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gensig.arrays import Array, Complex, Integers
from gensig.dynamics.response import LinearMachine
from gensig.units import check_limits, check_ranges

TURN = 2.0 * math.pi
Limits = dict[str, tuple[float, float]]
MOST_HARMONICS = 50


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tones:
    """Forces on one gear that follow angles: of its shaft, of what rolls on it, of what it drives.

    Each of ``base`` (base,) is an angle's order, its turns per turn of the gear's shaft. Tone t
    is Re(force_t e^(i phase_t)). The phase is the sum of ``multiple`` (tone, base) times base
    times the shaft's angle from its tooth 0 on. ``force`` (tone, 3) acts on the gear's x and y in
    N and on its rotation in N m. It holds at the set speed and torque and grows with ``follows``:
    speed_squared, torque or nothing.
    """

    gear: str
    base: Array
    multiple: Integers
    force: Complex
    follows: str

    @property
    def order(self) -> Array:
        """Order of every tone, (tone,) of the gear's shaft."""
        return np.asarray(self.multiple @ self.base)


@dataclass(frozen=True, slots=True)
class Draws:
    """Random numbers of one part, from a generator of its own; ``ends`` are [low, high]."""

    rng: np.random.Generator

    def uniform(self, ends: tuple[float, ...]) -> float:
        """One number between two ends."""
        return float(self.rng.uniform(ends[0], ends[1]))

    def logarithmic(self, ends: tuple[float, ...]) -> float:
        """One number between two ends, uniform in its logarithm."""
        return math.exp(self.rng.uniform(math.log(ends[0]), math.log(ends[1])))

    def angle(self) -> float:
        """One angle of a turn, rad."""
        return TURN * self.rng.random()

    def angles(self, *shape: int) -> Array:
        """Angles of a turn, rad."""
        return TURN * self.rng.random(shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class Nuisance(ABC):
    """One cause of vibration at the shaft of one gear of the machine, ``gear`` its name.

    Ranges are [low, high]; equal ends give one value. ``level`` is the unit for which the
    machine's part is drawn: the gearbox, or the specimen, a set of gears. ``limits`` and
    ``ranges`` are those of the fields, in SI.
    """

    level: ClassVar[str] = "gearbox"
    limits: ClassVar[Limits] = {}
    ranges: ClassVar[Limits]
    gear: str

    def __post_init__(self) -> None:
        check_limits(self, "", **self.limits)
        check_ranges(self, "", **self.ranges)

    @abstractmethod
    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """Forces of one unit, with the angles that differ between its records."""

    def tones(
        self, base: list[float], multiple: Any, force: Any, follows: str
    ) -> Tones:
        """Tones on this gear, of lists or arrays."""
        return Tones(
            gear=self.gear,
            base=np.array(base),
            multiple=np.array(multiple, dtype=np.int64),
            force=np.array(force, dtype=np.complex128),
            follows=follows,
        )


def turning(sense: float) -> Complex:
    """Unit force that turns with the shaft.

    It acts along x first, a quarter of a turn later along y, by the sense of its gear.
    """
    return np.array([1.0, -1j * sense, 0.0])


def fixed(angle: float) -> Array:
    """Unit force in a fixed direction, from x towards y."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])
