"""Interfaces of `gensig.production.fault_pairs.FaultPairs` and its cells, without its physics."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gensig.options.configuration import Configuration

Array = NDArray[np.float64]


class Pairs(Protocol):
    """Machines with and without a fault over a map.

    Every member as `gensig.production.fault_pairs.FaultPairs` says.
    """

    @property
    def config(self) -> Configuration:
        """The composed configuration."""

    @property
    def speeds_rpm(self) -> tuple[float, ...]:
        """Rising."""

    @property
    def torques_nm(self) -> tuple[float, ...]:
        """Rising."""

    @property
    def n_units(self) -> int:
        """Machines of the same build."""

    @property
    def gears(self) -> dict[str, tuple[int, float]]:
        """Gears with a fault: teeth, and turns for one of the pinion."""

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names along the channel axis."""

    @property
    def sampling_rate(self) -> float:
        """Hz."""

    @property
    def usable_frequency(self) -> float:
        """Hz up to which the signals are flat."""

    @property
    def duration(self) -> float:
        """Seconds of a record."""

    @property
    def size_key(self) -> str | None:
        """Key of the fault's first size; None for several faults or one without a size."""

    @property
    def n_cells(self) -> int:
        """Speeds times torques."""

    def cell(self, index: int, /) -> PairCell:
        """Pairs of all units at one speed and torque."""


class PairCell(Protocol):
    """Pairs of all units at one speed and torque.

    Every member as `gensig.production.fault_pairs.PairCell` says.
    """

    @property
    def residual(self) -> Array:
        """(unit, channel, sample)."""

    @property
    def sound(self) -> Array:
        """(unit, channel, sample)."""

    @property
    def faulty(self) -> Array:
        """(unit, channel, sample)."""

    @property
    def sound_angle(self) -> Array:
        """(unit, sample)."""

    @property
    def faulty_angle(self) -> Array:
        """(unit, sample)."""

    @property
    def noise_power(self) -> Array:
        """(unit, channel)."""

    @property
    def noise_density(self) -> Array:
        """(unit, channel, bin)."""
