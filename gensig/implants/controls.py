"""Residuals without physics, for comparison: noise bursts, and shuffled phases."""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.implants.simulated_pairs import HEALTHY, ONE_TOOTH

# all assumed: a burst's decay, and the angles of a turn at which many teeth burst
DECAY = (0.0003, 0.003)  # s
MOST_DECAY = 0.05  # of the turn
MANY_BURSTS = (5, 40)
LEAST_SHARE = 0.2  # of the strongest of many bursts
DECAYS = 5.0  # after which a burst is over


def shuffled(signal: Array, rng: np.random.Generator) -> Array:
    """The signal with random phases: its spectrum, and no pattern in time.

    Parameters
    ----------
    signal : (channel, sample); phases between channels are kept
    """
    n_samples = signal.shape[-1]
    spectrum = np.fft.rfft(signal, axis=-1)
    phase = rng.uniform(0.0, 2.0 * math.pi, spectrum.shape[-1])
    return np.asarray(np.fft.irfft(spectrum * np.exp(1j * phase), n_samples, axis=-1))


def noise_bursts(
    name: str,
    turns: Array,
    sampling_rate: float,
    n_channels: int,
    rng: np.random.Generator,
) -> Array:
    """White noise in bursts by the angle of a shaft; steady for a healthy record.

    Parameters
    ----------
    name : of the class: one burst a turn, or many at angles that repeat every turn
    turns : (sample,) turns of the shaft
    sampling_rate : Hz

    Returns
    -------
    (channel, sample)
    """
    noise = rng.standard_normal((n_channels, len(turns)))
    n_bursts = 1
    if name not in (HEALTHY, ONE_TOOTH):
        n_bursts = int(rng.integers(MANY_BURSTS[0], MANY_BURSTS[1] + 1))
    angles = rng.uniform(0.0, 1.0, n_bursts)
    sizes = rng.uniform(LEAST_SHARE, 1.0, n_bursts)
    low, high = np.log(DECAY)
    decay = math.exp(rng.uniform(low, high))
    if name == HEALTHY:
        return noise
    a_turn = (len(turns) - 1) / float(turns[-1] - turns[0]) / sampling_rate
    decay = min(decay, MOST_DECAY * a_turn) / a_turn
    envelope = np.zeros(len(turns))
    for angle, size in zip(angles, sizes, strict=True):
        since = np.mod(turns - angle, 1.0)
        burst = size * np.exp(-since / decay)
        envelope += np.where(since < DECAYS * decay, burst, 0.0)
    return noise * envelope
