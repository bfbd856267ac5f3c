"""Recordings cut into time blocks of a few turns of the slowest shaft."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.block_features import Block, Feature, Layout, measure_block
from diagnose.detection.followed_shafts import FollowedRecording
from gensig.errors import ConfigError
from gensig.signals.indicators import rms

FloatArray = NDArray[np.floating]

BLOCKS_A_RECORDING = 3  # wanted of the shortest recording
BLOCKS_OF_ONE = 4  # of a single healthy recording
FEWEST_TURNS, MOST_TURNS = 4.0, 16.0  # of the slowest shaft in a block


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockedRecording:
    """A recording by its time blocks.

    Attributes
    ----------
    name : for messages
    speed_rpm : r/min of the input shaft, mean
    blocks : in time order
    turns : for each shaft (channel, sample), the mean of the blocks
    level : (channel,) m/s2, RMS
    """

    name: str
    speed_rpm: float
    blocks: tuple[Block, ...]
    turns: tuple[FloatArray, ...]
    level: FloatArray

    def halves(self) -> list[BlockedRecording]:
        """Its first and its second blocks, two or more, as recordings."""
        middle = len(self.blocks) // 2
        return [self._of(self.blocks[:middle]), self._of(self.blocks[middle:])]

    def _of(self, blocks: tuple[Block, ...]) -> BlockedRecording:
        return replace(self, blocks=blocks, turns=_mean_turns(blocks))

    @property
    def features(self) -> tuple[Feature, ...]:
        """Names of the values of its blocks."""
        return self.blocks[0].features

    @property
    def values(self) -> FloatArray:
        """(block, feature) that need no healthy turns."""
        return np.stack([block.values for block in self.blocks])


def block_turns(slow_turns: list[float], *, is_one_session: bool) -> float:
    """Turns of the slowest shaft in a block, from those of all recordings.

    Raises
    ------
    ConfigError    for a single healthy recording that does not hold two blocks
    """
    fewest = min(slow_turns)
    if is_one_session and slow_turns[0] < 2.0 * FEWEST_TURNS:
        raise ConfigError(
            f"one healthy recording of {slow_turns[0]:.2g} turns of the slowest shaft holds no two "
            f"time blocks: record {2.0 * FEWEST_TURNS:g} turns, or give several"
        )
    wanted = fewest / BLOCKS_A_RECORDING
    if is_one_session:
        wanted = min(wanted, slow_turns[0] / BLOCKS_OF_ONE)
    return float(np.clip(wanted, min(FEWEST_TURNS, fewest), MOST_TURNS))


def cut_blocks(
    recording: FollowedRecording, turns: float, to: Layout
) -> BlockedRecording:
    """Blocks of so many turns of the slowest shaft; the rest at the end is left out."""
    slow_turn = recording.samples_per_turn / to.stages.slowest
    length = min(int(turns * slow_turn), recording.signal.shape[-1])
    starts = range(0, recording.signal.shape[-1] - length + 1, length)
    blocks = tuple(
        measure_block(
            recording.signal[:, start : start + length],
            recording.samples_per_turn,
            recording.speed_rpm,
            start,
            to,
        )
        for start in starts
    )
    return BlockedRecording(
        name=recording.name,
        speed_rpm=recording.speed_rpm,
        blocks=blocks,
        turns=_mean_turns(blocks),
        level=rms(recording.signal),
    )


def _mean_turns(blocks: tuple[Block, ...]) -> tuple[FloatArray, ...]:
    """Mean turn of every shaft."""
    of_shafts = zip(*(block.turns for block in blocks), strict=True)
    return tuple(np.mean(turns, axis=0) for turns in of_shafts)
