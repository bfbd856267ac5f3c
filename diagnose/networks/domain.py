"""Domain of a network: the distance of a window's spectrum from those of the training windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import FloatArray, IntArray, WindowSet

METHOD = "nearest_band_levels"
QUANTILE = 0.99  # of the validation windows; 1 % of the known kind is called unlike
N_BANDS = 12  # of equal ratio, from the fourth bin to half the sampling rate
LOWEST_BIN = 4  # the window function spreads the mean over the bins below
FLOOR = 1e-12  # of the mean power, so that silence has a finite level
N_NEIGHBORS = 5  # so that one odd training record does not make windows like it known
MOST_WINDOWS = 1000  # stored, evenly spaced over the training
TENSOR = "domain.levels"


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """Training windows by their `band_levels`.

    Attributes
    ----------
    levels : (window, feature) of training windows, of `window_levels`
    threshold : distance that the share `QUANTILE` of the validation windows does not exceed
    n_validation_windows : number of windows behind the threshold
    """

    levels: NDArray[np.float32]
    threshold: float
    n_validation_windows: int

    def __post_init__(self) -> None:
        is_table = self.levels.ndim == 2 and self.levels.size > 0
        if not (is_table and np.isfinite(self.levels).all()):
            raise DatasetError(
                "the tensor of its out-of-distribution flag holds no levels of windows"
            )
        if not (np.isfinite(self.threshold) and self.threshold > 0):
            raise DatasetError(
                f"the threshold of its out-of-distribution flag is {self.threshold!r}"
            )

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Name -> array, stored with the weights."""
        return {TENSOR: self.levels}

    def facts(self) -> dict[str, Any]:
        """Entries of the description in ``model.json``."""
        return {
            "method": METHOD,
            "quantile": QUANTILE,
            "threshold": self.threshold,
            "n_validation_windows": self.n_validation_windows,
        }


def domain_from(
    facts: Mapping[str, Any], tensors: Mapping[str, NDArray[Any]]
) -> Domain:
    """Domain of a stored model.

    Raises
    ------
    DatasetError    for another method, or facts and tensors that are no such thing
    """
    if facts.get("method") != METHOD:
        raise DatasetError(
            f"its out-of-distribution flag is {facts.get('method')!r}, "
            f"this program knows {METHOD}"
        )
    try:
        return Domain(
            levels=np.asarray(tensors[TENSOR], dtype=np.float32),
            threshold=float(facts["threshold"]),
            n_validation_windows=int(facts["n_validation_windows"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(
            f"its out-of-distribution flag is not whole: {' '.join(str(error).split())}"
        ) from None


def fit_domain(train: WindowSet, validation: WindowSet) -> Domain:
    """Levels of training windows, and the threshold from windows of units not trained on.

    The distance is that to the fifth nearest training window. It assumes no distribution: speeds
    and loads make the levels lie in several clouds. It is taken on the input, not on the
    network's features: a network that never saw noise alone maps it close to quiet records.

    Source: Ramaswamy, Rastogi & Shim (2000), "Efficient algorithms for mining outliers from large
    data sets", SIGMOD, section 3; threshold on held-out known data as in Sun, Ming, Zhu & Li
    (2022), "Out-of-distribution detection with deep nearest neighbors", ICML, section 3.
    """
    kept = train.subset(evenly_spaced(len(train), MOST_WINDOWS))
    levels = window_levels(kept).astype(np.float32)
    distance = neighbor_distance(window_levels(validation), levels)
    return Domain(
        levels=levels,
        threshold=float(np.quantile(distance, QUANTILE, method="higher")),
        n_validation_windows=len(validation),
    )


def evenly_spaced(n: int, most: int) -> IntArray:
    """Whole numbers from 0 to n - 1, at most `most`, evenly spaced."""
    return np.linspace(0, n - 1, min(n, most)).round().astype(int)


def distances(domain: Domain, windows: WindowSet) -> FloatArray:
    """(window,) distance from the fifth nearest training window.

    It is the root of the summed squares of differences of levels, in nepers of power.

    Raises
    ------
    DatasetError    if the domain belongs to other channels
    """
    levels = window_levels(windows)
    if levels.shape[1] != domain.levels.shape[1]:
        raise DatasetError(
            f"the model's out-of-distribution flag has {domain.levels.shape[1]} levels, "
            f"a window {levels.shape[1]}"
        )
    return neighbor_distance(levels, domain.levels)


def window_levels(windows: WindowSet, *, batch_size: int = 64) -> FloatArray:
    """(window, feature) of the windows, or their `band_levels`, the first channel first."""
    if windows.levels is not None:
        return windows.levels
    levels = [band_levels(windows.cut(block)) for block in windows.blocks(batch_size)]
    return np.concatenate(levels).reshape(len(windows), -1)


def band_levels(windows: FloatArray) -> FloatArray:
    """(..., band) natural logarithm of the mean power in bands of equal ratio.

    `windows` has the axes (..., sample).
    """
    n = windows.shape[-1]
    power = np.abs(np.fft.rfft(windows * np.hanning(n), axis=-1)) ** 2
    lowest = max(min(LOWEST_BIN, n // 4), 1)
    edges = np.unique(np.round(np.geomspace(lowest, n // 2, N_BANDS + 1)).astype(int))
    mean = np.add.reduceat(power[..., : n // 2], edges[:-1], axis=-1) / np.diff(edges)
    least = FLOOR * power.mean(axis=-1, keepdims=True) + np.finfo(np.float64).tiny
    return np.log(mean + least)


def neighbor_distance(levels: FloatArray, known: FloatArray) -> FloatArray:
    """(window,) distance of each row from the fifth nearest known row, or from the farthest."""
    from sklearn.neighbors import NearestNeighbors

    neighbors = NearestNeighbors(n_neighbors=min(N_NEIGHBORS, len(known)))
    neighbors.fit(known.astype(float))
    return neighbors.kneighbors(levels)[0][:, -1]
