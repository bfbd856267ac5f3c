"""Operation of a machine over its life: blocks of time, each at one set-point, and standstills."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import ConfigError

MOST_BLOCKS = 200_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class History:
    """Blocks of constant speed and load of one machine.

    Parameters
    ----------
    begin, end : (block,) s       clock time since the machine was new; it stands still between
        two blocks
    setpoint : (block,) int       index of the block's set-point
    speed, torque : (setpoint,)   of the driving pinion, rad/s and N m
    """

    begin: Array
    end: Array
    setpoint: Integers
    speed: Array
    torque: Array

    def __post_init__(self) -> None:
        overlap = (self.begin[1:] < self.end[:-1]).any()
        if not len(self.begin) or (self.end <= self.begin).any() or overlap:
            raise ConfigError(
                "a history needs blocks that end after they begin and do not overlap, "
                "in order of time"
            )
        if self.begin[0] < 0.0:
            raise ConfigError(
                f"a history begins at {self.begin[0] / 3600.0:g} h; times count from 0, the new "
                "machine"
            )
        if not (self.speed > 0.0).all() or not (self.torque > 0.0).all():
            raise ConfigError(
                "the speeds and torques of a history must be positive; a standstill is a gap"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnBlocks:
    """Distribution of blocks: uniform lengths, chance of standstills and their uniform lengths.

    ``gap_chance`` is that of a standstill after a block; all lengths in s.
    """

    shortest: float
    longest: float
    gap_chance: float
    gap_shortest: float
    gap_longest: float

    def __post_init__(self) -> None:
        for low, high, name in (
            (self.shortest, self.longest, "block"),
            (self.gap_shortest, self.gap_longest, "gap"),
        ):
            if not 0.0 < low <= high:
                raise ConfigError(
                    f"life.{name}_low_h = {low / 3600.0:g} and life.{name}_high_h = "
                    f"{high / 3600.0:g} must be positive and in order"
                )
        if not 0.0 <= self.gap_chance < 1.0:
            raise ConfigError(
                f"life.gap_chance = {self.gap_chance:g} must lie in 0..1, 1 excluded"
            )


def draw_history(
    blocks: DrawnBlocks,
    speed: Array,
    torque: Array,
    horizon: float,
    rng: np.random.Generator,
) -> History:
    """Blocks at set-points drawn with equal chance, up to the horizon in s of clock time, where
    the last is cut.

    Raises
    ------
    ConfigError    for a horizon of more than ``MOST_BLOCKS`` blocks
    """
    most = math.ceil(horizon / blocks.shortest) + 1
    if most > MOST_BLOCKS:
        raise ConfigError(
            f"life.horizon_h = {horizon / 3600.0:g} may hold {most:,} blocks of life.block_low_h = "
            f"{blocks.shortest / 3600.0:g}, more than {MOST_BLOCKS:,}; take longer blocks or a "
            "nearer horizon"
        )
    lengths = rng.uniform(blocks.shortest, blocks.longest, most)
    has_gap = rng.random(most) < blocks.gap_chance
    gap = rng.uniform(blocks.gap_shortest, blocks.gap_longest, most)
    gaps = np.where(has_gap, gap, 0.0)
    setpoint = rng.integers(len(speed), size=most)
    begin = np.concatenate([[0.0], np.cumsum(lengths + gaps)[:-1]])
    end = np.minimum(begin + lengths, horizon)
    kept = begin < horizon
    return History(
        begin=begin[kept],
        end=end[kept],
        setpoint=setpoint[kept],
        speed=speed,
        torque=torque,
    )


def given_history(rows: tuple[tuple[float, ...], ...], horizon: float) -> History:
    """Blocks as listed, (begin s, end s, speed rad/s, torque N m) each, cut at the horizon.

    Raises
    ------
    ConfigError    for blocks that overlap, run backwards, or all begin after the horizon
    """
    table = np.array(rows, dtype=np.float64)
    points, setpoint = np.unique(table[:, 2:], axis=0, return_inverse=True)
    kept = table[:, 0] < horizon
    # checked whole: a mistake behind the horizon is one too
    whole = History(
        begin=table[:, 0],
        end=table[:, 1],
        setpoint=setpoint.ravel(),
        speed=points[:, 0],
        torque=points[:, 1],
    )
    if not kept.any():
        raise ConfigError(
            f"life.blocks: none begins before life.horizon_h = {horizon / 3600.0:g}"
        )
    return replace(
        whole,
        begin=whole.begin[kept],
        end=np.minimum(whole.end[kept], horizon),
        setpoint=whole.setpoint[kept],
    )
