"""Change of the turn of a shaft against healthy turns: how much, how local, and at which tooth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.block_features import SIDEBANDS, TEETH, Feature, Layout
from gensig.signals.alignment import changed_turn, rotation
from gensig.signals.indicators import kurtosis

FloatArray = NDArray[np.floating]

TINY = 1e-30
# name of a feature of a turn -> group, and True where speed and load change it
NAMES = {
    "highest tooth of the change": (TEETH, False),
    "share of the change": (TEETH, True),
    "kurtosis of the change": (TEETH, False),
    "highest tooth": (TEETH, False),
    "kurtosis": (TEETH, False),
    "level of the change": (SIDEBANDS, True),
    "level": (SIDEBANDS, True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnChange:
    """Part of a shaft's turn that healthy turns do not explain.

    Attributes
    ----------
    rest : (channel, sample) that part
    profile : (sample,) its mean square in a window of a tooth, over the median of the turn
    share_db : dB (channel,) of its mean square over that of the turn
    """

    rest: FloatArray
    profile: FloatArray
    share_db: FloatArray

    @property
    def peak_db(self) -> float:
        """Highest place of the profile over its median, dB."""
        return float(10.0 * np.log10(self.profile.max() + TINY))

    @property
    def place(self) -> float:
        """Place of the peak, share of a turn after the recording began."""
        return float(self.profile.argmax() / self.profile.size)


def aligned(turn: FloatArray, to: FloatArray) -> FloatArray:
    """A turn rotated to where another one of the same shaft begins."""
    return np.roll(turn, -rotation(turn, to), axis=-1)


def turn_change(
    turn: FloatArray, sound: Sequence[FloatArray], n_teeth: int
) -> TurnChange:
    """Change of a turn against healthy ones.

    Parameters
    ----------
    turn : (channel, sample)
    sound : as long, rotated to the turn
    n_teeth : of the gear with fewer teeth on the shaft

    Notes
    -----
    Healthy turns predict the turn through any smooth transfer
    (`gensig.signals.alignment.changed_turn`), so that another mounting explains nothing.
    """
    rest = changed_turn(turn, sound, turn.shape[-1] / n_teeth)
    share = np.square(rest).mean(axis=-1) / (np.square(turn).mean(axis=-1) + TINY)
    return TurnChange(
        rest=rest,
        profile=tooth_profile(rest, turn, n_teeth),
        share_db=10.0 * np.log10(share + TINY),
    )


def fewest_teeth(to: Layout, shaft: int) -> int:
    """Teeth of the gear with fewer teeth on a shaft."""
    return min(gear.n_teeth for gear in to.stages.gears(shaft))


def tooth_features(to: Layout) -> tuple[Feature, ...]:
    """Names of the values of `tooth_values`."""
    return tuple(
        Feature(name=name, group=group, part=shaft, is_level=is_level)
        for shaft in range(len(to.stages.shaft_orders))
        for name, (group, is_level) in NAMES.items()
    )


def tooth_values(
    turns: Sequence[FloatArray], sound: Sequence[Sequence[FloatArray]], to: Layout
) -> FloatArray:
    """(feature,) of the turns of all shafts against those of healthy recordings.

    Parameters
    ----------
    turns : for each shaft (channel, sample)
    sound : for each shaft its healthy turns, rotated to that turn
    """
    values = []
    for shaft, (turn, others) in enumerate(zip(turns, sound, strict=True)):
        n_teeth = fewest_teeth(to, shaft)
        change = turn_change(turn, others, n_teeth)
        values += [
            change.peak_db,
            float(change.share_db.mean()),
            _impulsive(change.rest),
            float(10.0 * np.log10(tooth_profile(turn, turn, n_teeth).max() + TINY)),
            _impulsive(turn),
            _level(change.rest),
            _level(turn),
        ]
    return np.array(values)


def tooth_profile(part: FloatArray, turn: FloatArray, n_teeth: int) -> FloatArray:
    """(sample,) mean square of a part of a turn in a window of a tooth, over its median.

    Each channel counts by the power of its turn, both (channel, sample).
    """
    from scipy.ndimage import uniform_filter1d

    power = np.square(turn).mean(axis=-1, keepdims=True) + TINY
    weighted = (np.square(part) / power).mean(axis=0)
    width = max(round(turn.shape[-1] / n_teeth), 3)
    level = uniform_filter1d(weighted, width, mode="wrap")
    return level / (np.median(level) + TINY)


def _impulsive(part: FloatArray) -> float:
    """Kurtosis of a part of a turn, dB, mean of the channels."""
    value = np.nan_to_num(kurtosis(part), nan=3.0).mean()
    return float(10.0 * np.log10(value))


def _level(part: FloatArray) -> float:
    """Mean square of a part of a turn, dB, mean of the channels."""
    power = np.square(part).mean(axis=-1) + TINY
    return float(np.mean(10.0 * np.log10(power)))
