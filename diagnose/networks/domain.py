"""What a network was trained on.

How far the spectrum of a window lies from those of the training windows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import WindowSet

FloatArray = NDArray[np.floating]

METHOD = "nearest_band_levels"
QUANTILE = 0.99  # of the validation windows; one in a hundred of the known kind is called unlike
N_BANDS = 12  # of equal ratio, from the fourth bin to half the sampling rate
LOWEST_BIN = 4  # the window function spreads the mean over the bins below
FLOOR = 1e-12  # of the mean power: what is silent has a level still
N_NEIGHBORS = 5  # so that one odd training record does not make what is like it known
MOST_WINDOWS = 1000  # stored, evenly spaced over the training
TENSOR = "domain.levels"


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """Training windows by their `band_levels`.

    Attributes
    ----------
    levels : (window, feature) of training windows, the bands of one channel after those of another
    threshold : distance that the share `QUANTILE` of the validation windows does not exceed
    n_validation_windows : that it comes from
    """

    levels: NDArray[np.float32]
    threshold: float
    n_validation_windows: int

    def __post_init__(self) -> None:
        if (
            self.levels.ndim != 2
            or self.levels.size == 0
            or not np.isfinite(self.levels).all()
        ):
            raise DatasetError(
                "the tensor of its out-of-distribution flag holds no levels of windows"
            )
        if not (np.isfinite(self.threshold) and self.threshold > 0):
            raise DatasetError(
                f"the threshold of its out-of-distribution flag is {self.threshold!r}"
            )

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """What is stored beside the weights."""
        return {TENSOR: self.levels}

    def facts(self) -> dict[str, Any]:
        """What is stored in the description."""
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
            f"its out-of-distribution flag is {facts.get('method')!r}, this program knows {METHOD}"
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
    """Levels of training windows, and the threshold from windows of units that were not trained on.

    The distance is that to the fifth nearest training window, which asks for no distribution:
    speeds and loads make the levels lie in several clouds. It is held on the input, not on the
    network's features: a network that was never shown noise alone maps it beside quiet records.

    Source: Ramaswamy, Rastogi & Shim (2000), "Efficient algorithms for mining outliers from large
    data sets", SIGMOD, section 3; threshold on held-out known data as in Sun, Ming, Zhu & Li
    (2022), "Out-of-distribution detection with deep nearest neighbors", ICML, section 3.
    """
    kept = np.unique(
        np.linspace(0, len(train) - 1, min(len(train), MOST_WINDOWS))
        .round()
        .astype(int)
    )
    levels = window_levels(train, kept).astype(np.float32)
    distance = neighbor_distance(
        window_levels(validation, np.arange(len(validation))), levels
    )
    return Domain(
        levels=levels,
        threshold=float(np.quantile(distance, QUANTILE, method="higher")),
        n_validation_windows=len(validation),
    )


def distances(domain: Domain, windows: WindowSet) -> FloatArray:
    """(window,) to the fifth nearest training window, root of the summed squares of nepers of
    power.

    Raises
    ------
    DatasetError    if the domain belongs to other channels
    """
    levels = window_levels(windows, np.arange(len(windows)))
    if levels.shape[1] != domain.levels.shape[1]:
        raise DatasetError(
            f"the model's out-of-distribution flag has {domain.levels.shape[1]} levels, a window {levels.shape[1]}"
        )
    return neighbor_distance(levels, domain.levels)


def window_levels(
    windows: WindowSet, chosen: NDArray[np.integer], *, batch_size: int = 64
) -> FloatArray:
    """(window, feature) `band_levels` of chosen windows at their planned starts, channel after
    channel.
    """
    blocks = np.array_split(chosen, -(-chosen.size // batch_size))
    return np.concatenate(
        [band_levels(windows.cut(block)).reshape(block.size, -1) for block in blocks]
    )


def band_levels(windows: NDArray[np.floating]) -> FloatArray:
    """(..., band) natural logarithm of the mean power in bands of equal ratio, of windows (...,
    sample).
    """
    n = windows.shape[-1]
    power = np.abs(np.fft.rfft(windows * np.hanning(n), axis=-1)) ** 2
    lowest = max(min(LOWEST_BIN, n // 4), 1)
    edges = np.unique(np.round(np.geomspace(lowest, n // 2, N_BANDS + 1)).astype(int))
    mean = np.add.reduceat(power[..., : n // 2], edges[:-1], axis=-1) / np.diff(edges)
    least = FLOOR * power.mean(axis=-1, keepdims=True) + np.finfo(np.float64).tiny
    return np.log(mean + least)


def neighbor_distance(levels: FloatArray, known: FloatArray) -> FloatArray:
    """(window,) from each row to the fifth nearest of the known ones, the last where there are
    fewer.
    """
    from sklearn.neighbors import NearestNeighbors

    neighbors = NearestNeighbors(n_neighbors=min(N_NEIGHBORS, len(known))).fit(
        known.astype(float)
    )
    return neighbors.kneighbors(levels)[0][:, -1]
