"""From the internal rate to the output rate without folding anything into the usable band."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PASS_SHARE = 0.390625  # 20 kHz of 51.2 kHz
ATTENUATION_DB = 80.0


def usable_band(sampling_rate: float) -> tuple[float, float]:
    """Band in Hz in which the recorded signal is flat to 0.01 dB; nothing folds above -80 dB at any frequency."""
    return 0.0, PASS_SHARE * sampling_rate


@dataclass(frozen=True, slots=True)
class Decimator:
    """Linear-phase low-pass and the reach of its taps to either side, in output samples."""

    taps: Array
    oversampling: int
    margin: int

    def apply(self, signal: Array) -> Array:
        """(internal sample, channel) with ``margin`` output samples on both sides -> (channel, sample)."""
        from scipy.signal import upfirdn

        filtered = upfirdn(self.taps, signal, up=1, down=self.oversampling, axis=0)
        n_samples = len(signal) // self.oversampling - 2 * self.margin
        return np.ascontiguousarray(filtered[2 * self.margin : 2 * self.margin + n_samples].T)


@lru_cache(maxsize=16)
def decimator(oversampling: int) -> Decimator:
    """Kaiser-window design: pass to 0.39 of the output rate, stop from half of it, so that nothing folds anywhere.

    A stop band that began where content folds into the pass band would need half the taps, but would leave mesh
    harmonics of 20 to 31 kHz in 20 to 25.6 kHz, between the mesh lines, where residuals see them.
    """
    if oversampling == 1:
        return Decimator(np.ones(1), 1, 0)
    from scipy.signal import firwin, kaiserord

    stop = 0.5
    n_taps, beta = kaiserord(ATTENUATION_DB, (stop - PASS_SHARE) / (0.5 * oversampling))
    margin = math.ceil(0.5 * n_taps / oversampling)
    taps = firwin(2 * margin * oversampling + 1, 0.5 * (PASS_SHARE + stop), window=("kaiser", beta), fs=oversampling)
    return Decimator(taps, oversampling, margin)
