"""A data set as one that was recorded slower.

Training at 5, 12.8 or 25.6 kHz on data of 51.2 kHz.
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
    """The data set, its accelerations low-passed and decimated whenever they are read.

    Parameters
    ----------
    dataset : as opened by `gensig.dataset.reader.open_dataset`
    sampling_rate : Hz    None leaves everything as it is

    Returns
    -------
    what reads like a data set: ``sampling_rate``, ``n_samples`` and ``signals`` are those of the lower rate, all else
    is the data set's. Other traces and ``attributes`` keep their rate

    Raises
    ------
    ConfigError    for a rate above that of the data set, or one that is no ratio of small numbers away from it

    Notes
    -----
    The low-pass is that of the simulated recorder, so that the samples are those of a set made at the lower rate. A
    sample needs what lies up to 30 samples around it: in a split that cuts records (the leaky one) that much crosses
    the cut.
    """
    found = float(dataset.sampling_rate)
    if sampling_rate is None or abs(sampling_rate / found - 1) < EXACT:
        return dataset
    if sampling_rate > found:
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} is above the {found:g} samples a second of {dataset.folder}; "
            "give a lower one or null"
        )
    change = rate_change(found, sampling_rate)
    if abs(found * change.up / change.down / sampling_rate - 1) > EXACT:
        near = found * change.up / change.down
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} is no ratio of small whole numbers away from {found:g}; "
            f"the nearest that is: {near:.9g}"
        )
    if change.n_samples(int(dataset.n_samples)) < 1:
        raise ConfigError(
            f"sampling_rate_hz={sampling_rate:g} leaves no sample of a record of {dataset.folder}"
        )
    return cast("Dataset", _Slower(dataset, change))


def at_rate_of(dataset: Dataset, other: Dataset) -> Dataset:
    """A data set read at a lower rate where the other one is; else as it is."""
    return (
        at_rate(dataset, other.sampling_rate) if isinstance(other, _Slower) else dataset
    )


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
        """Acceleration of one record, (channel, sample) float32 in m/s^2, start and stop counted
        at this rate.
        """

        def read(first: int, last: int) -> np.ndarray:
            return np.asarray(
                self._dataset.signals(record_index, first, last, channels, **which)
            )

        last = self.n_samples if stop is None else stop
        part = self._change.apply_to_part(
            read, int(self._dataset.n_samples), start, last
        )
        return part.astype(np.float32)
