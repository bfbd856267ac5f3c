"""Turns whose spectrum is flat: what a machine's resonances add to it is taken away.

A tooth makes a machine ring at the machine's own frequencies, for as long as its damping says.
The smoothed spectrum of a turn shows these resonances. Its minimum-phase inverse makes the ringing
short again, so that turns of different machines look alike.

A. V. Oppenheim & R. W. Schafer (2010), "Discrete-time signal processing", section 13.5: minimum
phase from the cepstrum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gensig.signals.separation import FloatArray, GearTurns

WIDTH = 0.5  # mesh orders over which a spectrum is smoothed; assumed
FLOOR = 1e-3  # of the greatest smoothed power, below which a band is not raised further; assumed
TINY = 1e-300

ComplexArray = NDArray[np.complexfloating]


def whitened_turns(turns: GearTurns) -> GearTurns:
    """Turns of both gears through the inverse of their own smoothed spectrum.

    The mean passage goes through the geometric mean of both filters.

    Parameters
    ----------
    turns : (channel, sample) of `gensig.signals.separation.separate_gears`
    """
    n_samples = turns.mesh.shape[-1]
    spectra, filtered = [], []
    for turn in (turns.driving, turns.driven):
        n_teeth = turn.shape[-1] // n_samples
        logarithm = _minimum_phase(_smoothed_power(turn, n_teeth), turn.shape[-1])
        spectrum = np.fft.rfft(turn) * np.exp(-logarithm)
        filtered.append(np.fft.irfft(spectrum, turn.shape[-1]))
        spectra.append(logarithm[..., ::n_teeth])
    of_mesh = np.fft.rfft(turns.mesh) * np.exp(-0.5 * (spectra[0] + spectra[1]))
    return GearTurns(
        driving=filtered[0], driven=filtered[1], mesh=np.fft.irfft(of_mesh, n_samples)
    )


def _smoothed_power(turn: FloatArray, n_teeth: int) -> FloatArray:
    """Power spectrum (channel, order) of a turn, averaged over `WIDTH` mesh orders.

    The mesh orders themselves, which a turn without its mean passage lacks, do not count.
    """
    power = np.square(np.abs(np.fft.rfft(turn)))
    counts = np.ones(power.shape[-1])
    counts[::n_teeth] = 0.0
    reach = max(1, round(WIDTH * n_teeth / 2))
    sums = _running_sum(power * counts, reach)
    smoothed = sums / np.maximum(_running_sum(counts, reach), 1.0)
    floor = FLOOR * smoothed.max(axis=-1, keepdims=True)
    return np.asarray(smoothed + floor + TINY)


def _running_sum(values: FloatArray, reach: int) -> FloatArray:
    """Sums over ``reach`` values on either side, mirrored at both ends."""
    beside = [(0, 0)] * (values.ndim - 1)
    wide = np.pad(values, [*beside, (reach, reach)], mode="reflect")
    total = np.cumsum(np.pad(wide, [*beside, (1, 0)]), axis=-1)
    length = 2 * reach + 1
    return np.asarray(total[..., length:] - total[..., :-length])


def _minimum_phase(power: FloatArray, n_samples: int) -> ComplexArray:
    """Logarithm (channel, order) of the minimum-phase spectrum with this power."""
    cepstrum = np.fft.irfft(0.5 * np.log(power), n_samples)
    cepstrum[..., 1 : n_samples // 2] *= 2.0
    cepstrum[..., n_samples // 2 + 1 :] = 0.0
    return np.fft.rfft(cepstrum)
