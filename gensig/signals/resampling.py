"""Change of sampling rate by the low-pass of the simulated recorder.

It is flat to 0.39 of the lower rate and shut from half. Rates may be samples a second or samples
a turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray
from gensig.errors import ConfigError

# of the lower rate, as in gensig.dynamics.decimation: recorders of 2.56 samples a cycle
PASS_SHARE = 0.390625
ATTENUATION_DB = 100.0
MOST_STEPS = 1000  # of the ratio of two rates; leaves an error of 0.0005 at most


@dataclass(frozen=True, slots=True, kw_only=True)
class RateChange:
    """A change of rate by a ratio of whole numbers.

    Attributes
    ----------
    up, down : new rate over old rate is up / down, in lowest terms
    """

    up: int
    down: int

    def __post_init__(self) -> None:
        if self.up < 1 or self.down < 1 or math.gcd(self.up, self.down) != 1:
            raise ValueError(
                f"{self.up} / {self.down} is no ratio of rates in lowest terms"
            )

    @property
    def ratio(self) -> float:
        """New rate over old rate."""
        return self.up / self.down

    @property
    def is_none(self) -> bool:
        """True where both rates are the same."""
        return self.up == self.down

    def n_samples(self, n_given: int) -> int:
        """Samples at the new rate that lie inside as many at the old one."""
        return n_given * self.up // self.down

    def apply(self, signal: ArrayLike) -> FloatArray:
        """Signal (..., sample) at the new rate; beyond its ends it counts as zero.

        Source: `scipy.signal.resample_poly` with a Kaiser-window low-pass as in
        ``gensig.dynamics.decimation``.
        """
        x = np.asarray(signal, dtype=float)
        if self.is_none:
            return x
        from scipy.signal import resample_poly

        samples = resample_poly(x, self.up, self.down, axis=-1, window=self._taps())
        return samples[..., : self.n_samples(x.shape[-1])]

    def apply_to_part(
        self,
        read: Callable[[int, int], FloatArray],
        n_given: int,
        start: int,
        stop: int,
    ) -> FloatArray:
        """Samples from start to stop of `apply`, read and computed from what they need of the
        signal.

        Parameters
        ----------
        read : from first and last (exclusive) sample at the old rate to (..., sample)
        n_given : samples of the whole signal at the old rate
        start, stop : in samples at the new rate
        """
        reach = math.ceil(len(self._taps()) / 2 / self.down) + 1
        first = max(start - reach, 0) // self.up * self.up  # a sample of both rates
        last = min(math.ceil((stop + reach) * self.down / self.up), n_given)
        part = self.apply(read(first // self.up * self.down, last))
        return part[..., start - first : stop - first]

    def _taps(self) -> FloatArray:
        from scipy.signal import firwin, kaiserord

        # lower of both rates over the rate that both divide
        lower = 1.0 / max(self.up, self.down)
        n_taps, beta = kaiserord(ATTENUATION_DB, 2.0 * (0.5 - PASS_SHARE) * lower)
        return firwin(n_taps | 1, (PASS_SHARE + 0.5) * lower, window=("kaiser", beta))


def rate_change(given: float, wanted: float) -> RateChange:
    """Change to the nearest rate by a ratio of whole numbers up to `MOST_STEPS`.

    Raises
    ------
    ConfigError    for rates more than `MOST_STEPS` times apart
    """
    if not given <= wanted * MOST_STEPS <= given * MOST_STEPS**2:
        raise ConfigError(
            f"{given:g} samples a second cannot be changed to {wanted:g}: the rates may be "
            f"{MOST_STEPS} times apart at most"
        )
    ratio = Fraction(wanted / given).limit_denominator(MOST_STEPS)
    return RateChange(up=ratio.numerator, down=ratio.denominator)
