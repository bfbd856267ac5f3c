"""Features of windows, averaged over each stretch of signal, for baselines that see the signal alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from diagnose.baselines.features import FeatureTable
from diagnose.baselines.minirocket import fit_minirocket, minirocket_features
from diagnose.data.windows import WindowSet
from diagnose.networks.spectrum import log_spectrum

FloatArray = NDArray[np.floating]
SPECTRUM_FLOOR = 0.01  # 40 dB below white noise of the same RMS, as in configs/model/spectrum.yaml
BLOCK = 16  # windows at once, so that they stay in the cache of a processor
N_EXAMPLES = 512  # windows that thresholds may be taken from


def spectrum_table(windows: WindowSet, scale: Sequence[float]) -> FeatureTable:
    """Log-magnitude spectra of the stretches, one row each, mean over their windows, channels side by side.

    Parameters
    ----------
    windows : of one subset
    scale : (channel,) what the windows are divided by: the training windows' `diagnose.training.train.input_scale`
    """
    divisor = torch.tensor(list(scale), dtype=torch.float32)[:, None]

    def spectra(block: NDArray[np.float32]) -> FloatArray:
        return log_spectrum(torch.from_numpy(block) / divisor, SPECTRUM_FLOOR).flatten(1).numpy()

    return _over_stretches(windows, spectra, "bin")


def rocket_tables(
    train: WindowSet, validation: WindowSet, test: WindowSet, *, n_features: int
) -> tuple[FeatureTable, FeatureTable, FeatureTable]:
    """MiniRocket features of the stretches of three subsets, one row each, mean over their windows.

    Everything is chosen on the training windows. The draws are those of seed 0: the features hardly depend on them.
    """
    rng = np.random.default_rng(0)
    examples = np.sort(rng.permutation(len(train))[:N_EXAMPLES])
    banks = fit_minirocket(train.cut(examples), n_features=n_features, rng=rng)

    def table(windows: WindowSet) -> FeatureTable:
        return _over_stretches(windows, lambda block: minirocket_features(block, banks), "rocket")

    return table(train), table(validation), table(test)


def _over_stretches(
    windows: WindowSet, features: Callable[[NDArray[np.float32]], FloatArray], name: str
) -> FeatureTable:
    stretch, first, position = np.unique(windows.segment, return_index=True, return_inverse=True)
    every = np.arange(len(windows))
    total: FloatArray | None = None
    for block in np.array_split(every, -(-every.size // BLOCK)):
        values = features(windows.cut(block))
        if total is None:
            total = np.zeros((stretch.size, values.shape[1]))
        np.add.at(total, position[block], values)
    assert total is not None
    return FeatureTable(
        values=total / np.bincount(position)[:, None],
        names=tuple(f"{name}_{index}" for index in range(total.shape[1])),
        label=windows.label[first],
        record=windows.record[first],
    )
