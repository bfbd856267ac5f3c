"""A simulated signal over the angle of a shaft, played by another shaft's angle.

Computed order tracking, K. R. Fyfe & E. D. S. Munck (1997), Mechanical Systems and Signal
Processing 11 (2), 187-205, from one machine to another: what happens once a turn of the simulated
shaft happens once a turn of the other. All frequencies change by the ratio of the two shafts'
speeds, those of resonances too.
"""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array, FloatArray
from gensig.errors import DatasetError
from gensig.signals.averaging import interpolate
from gensig.signals.resampling import rate_change

FINER = (
    2  # upsampling before the interpolation, whose error grows towards half the rate
)
# samples of the lower rate at either end that the low-pass of the rate change reaches beyond
REACH = 32
FADE = 0.1  # turns over which the end of the last whole turn passes into the first
FEWEST_TURNS = 2  # whole ones of the simulated shaft


def samples_a_turn(turned: Array) -> float:
    """Mean samples in a turn of a shaft, from its turns at every sample."""
    return (len(turned) - 1) / float(turned[-1] - turned[0])


class Played:
    """A simulated signal that another shaft plays, in a loop of whole turns.

    Parameters
    ----------
    signal : (channel, sample)
    turned : (sample,) turns of its shaft, rising
    per_turn : samples in a turn of the shaft that plays it; what would alias is filtered out

    Attributes
    ----------
    n_turns : whole turns in the loop

    Raises
    ------
    DatasetError    for a signal of fewer than two whole turns
    """

    def __init__(self, signal: Array, turned: Array, per_turn: float) -> None:
        given = samples_a_turn(turned)
        change = rate_change(given, min(given, per_turn))
        fine = _finer(change.apply(signal))
        self._fine = fine
        # samples of the fine signal in one of the given
        self._scale = FINER * change.ratio
        margin = math.ceil(REACH / change.ratio) if not change.is_none else REACH
        first, last = margin, len(turned) - 1 - margin
        self._turned = turned
        self._begin = float(turned[min(first, len(turned) - 1)])
        whole = float(turned[max(last, 0)]) - self._begin - FADE
        self.n_turns = math.floor(whole)
        if first >= last or self.n_turns < FEWEST_TURNS:
            total = float(turned[-1] - turned[0])
            raise DatasetError(
                f"a simulated record has {total:.2g} turns of the shaft with the fault, too few "
                f"to loop: {FEWEST_TURNS + 1} are needed; make a set with a longer "
                "operating.duration_s"
            )

    def at(self, turns: Array) -> Array:
        """The signal at some turns of the shaft, (channel, sample), without end.

        Parameters
        ----------
        turns : (sample,) from the begin of the loop, at least 0
        """
        place = np.mod(turns, self.n_turns)
        values = self._values(place)
        fading = np.flatnonzero(place < FADE)
        if len(fading):
            share = place[fading] / FADE
            after = self._values(place[fading] + self.n_turns)
            values[:, fading] = share * values[:, fading] + (1.0 - share) * after
        return values

    def _values(self, place: Array) -> Array:
        samples = np.arange(len(self._turned), dtype=float)
        position = np.interp(self._begin + place, self._turned, samples) * self._scale
        position = np.minimum(position, self._fine.shape[-1] - 1.0)
        return np.asarray(interpolate(self._fine, position), dtype=float)


def _finer(signal: FloatArray) -> Array:
    from scipy.signal import resample_poly

    return np.asarray(resample_poly(signal, FINER, 1, axis=-1))
