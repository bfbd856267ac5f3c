"""Data sets read at a lower sampling rate.

They serve for training at 5, 12.8 or 25.6 kHz on data of 51.2 kHz.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gensig.errors import ConfigError
from gensig.signals.resampling import RateChange, rate_change

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

EXACT = 1e-9  # relative


def at_rate(dataset: Dataset, sampling_rate: float | None) -> Dataset:
    """The data set with accelerations that are low-passed and decimated when they are read.

    Parameters
    ----------
    dataset : as opened by `gensig.dataset.reader.open_dataset`
    sampling_rate : Hz    None leaves everything as it is

    Returns
    -------
    object with the interface of a data set: ``sampling_rate``, ``n_samples`` and ``signals``
    are those of the lower rate, all else is the data set's. Other traces and ``attributes``
    keep their rate

    Raises
    ------
    ConfigError    for a rate above that of the data set, or one whose ratio to it is not of
        small whole numbers

    Notes
    -----
    The low-pass is that of the simulated recorder, so that the samples are those of a set made
    at the lower rate. A sample depends on up to 30 samples on either side of it. In a split that
    cuts records (the leaky one) these lie beyond the cut.
    """
    stored = float(dataset.sampling_rate)
    if sampling_rate is None or abs(sampling_rate / stored - 1) < EXACT:
        return dataset
    if sampling_rate > stored:
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} is above the {stored:g} samples a second "
            f"of {dataset.folder}; give a lower one or null"
        )
    change = rate_change(stored, sampling_rate)
    nearest = stored * change.up / change.down
    if abs(nearest / sampling_rate - 1) > EXACT:
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} is no ratio of small whole numbers "
            f"away from {stored:g}; the nearest that is: {nearest:.9g}"
        )
    if change.n_samples(int(dataset.n_samples)) < 1:
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} leaves no sample of a record of {dataset.folder}"
        )
    return cast("Dataset", _Slower(dataset, change))


def at_rate_of(dataset: Dataset, other: Dataset) -> Dataset:
    """A data set read at the rate of another one, if that one is read at a lower rate."""
    if isinstance(other, _Slower):
        return at_rate(dataset, other.sampling_rate)
    return dataset


class _Slower:
    """A data set whose accelerations are read at another rate."""

    def __init__(self, dataset: Any, change: RateChange) -> None:
        self._dataset, self._change = dataset, change
        self.sampling_rate = float(dataset.sampling_rate) * change.up / change.down
        self.n_samples = change.n_samples(int(dataset.n_samples))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._dataset, name)

    def __reduce__(self) -> tuple[Any, ...]:
        return _Slower, (self._dataset, self._change)

    def signals(
        self,
        record_index: int,
        start: int = 0,
        stop: int | None = None,
        channels: Sequence[int | str] | None = None,
        **which: Any,
    ) -> np.ndarray:
        """Acceleration of one record, (channel, sample) float32 in m/s^2.

        `start` and `stop` count samples of this rate.
        """

        def read(first: int, last: int) -> np.ndarray:
            return np.asarray(
                self._dataset.signals(record_index, first, last, channels, **which)
            )

        if stop is None:
            stop = self.n_samples
        n_stored = int(self._dataset.n_samples)
        part = self._change.apply_to_part(read, n_stored, start, stop)
        return part.astype(np.float32)
