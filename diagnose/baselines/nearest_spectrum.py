"""Nearest training spectrum, which shows if a split lets a method recognise machines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, final

import numpy as np

from diagnose.baselines.base import Baseline, Input, MethodText, Parts, Role, Source
from diagnose.baselines.estimators import class_probability
from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import FloatArray, WindowSet, input_scale

if TYPE_CHECKING:
    import torch
    from sklearn.neighbors import KNeighborsClassifier

SPECTRUM_FLOOR = 0.01  # 40 dB below white noise of the same RMS
BLOCK = 16  # windows at once, so that they stay in the cache of a processor


def log_spectrum(windows: torch.Tensor, floor: float) -> torch.Tensor:
    """Logarithm of the magnitude spectrum, tapered by a Hann window.

    Parameters
    ----------
    windows : (..., sample), of about unit RMS
    floor : added to the magnitude, whose root mean square is 1 for white noise of unit RMS; bins
        below it are equal

    Returns
    -------
    (..., bin) from 0 to half the sampling rate, natural logarithm
    """
    import torch

    n = windows.shape[-1]
    taper = torch.hann_window(n, dtype=windows.dtype, device=windows.device)
    # 3/8 is the mean square of the taper
    magnitude = torch.fft.rfft(windows * taper).abs() / math.sqrt(3 * n / 8)
    return torch.log(magnitude + floor)


def spectrum_table(windows: WindowSet, scale: Sequence[float]) -> FeatureTable:
    """Log-magnitude spectra of stretches, means over their windows, channels side by side.

    Parameters
    ----------
    windows : of one subset
    scale : (channel,) divisor of the windows: `input_scale` of the training windows
    """
    import torch

    divisor = torch.tensor(list(scale), dtype=torch.float32)[:, None]
    stretch, first, position = np.unique(
        windows.segment, return_index=True, return_inverse=True
    )
    total = np.zeros((stretch.size, 0))
    for block in windows.blocks(BLOCK):
        scaled = torch.from_numpy(windows.cut(block)) / divisor
        spectra = log_spectrum(scaled, SPECTRUM_FLOOR).flatten(1).numpy()
        if not total.size:
            total = np.zeros((stretch.size, spectra.shape[1]))
        np.add.at(total, position[block], spectra)
    return FeatureTable(
        values=total / np.bincount(position)[:, None],
        names=tuple(f"bin_{index}" for index in range(total.shape[1])),
        label=windows.label[first],
        record=windows.record[first],
    )


def spectrum_tables(source: Source) -> Parts:
    """Spectra of the windows of every subset, with the same divisor."""
    sets = source.windows()
    scale = input_scale(sets["train"])
    return Parts.of(lambda subset: spectrum_table(sets[subset], scale), sets)


SPECTRUM_INPUT = Input(name="spectra", make=spectrum_tables)


@final
class NearestSpectrum(Baseline):
    """Class of the training stretch at the least Euclidean distance of spectra."""

    text = MethodText(
        name="nearest_spectrum",
        label="1-NN on spectra",
        card_label="1-NN on spectra",
        meaning="the class of the training signal with the nearest log-magnitude spectrum, "
        "mean over the windows.",
    )
    role = Role.RIVAL
    reads = SPECTRUM_INPUT
    _model: KNeighborsClassifier
    _n_classes: int

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Keep the training spectra."""
        from sklearn.neighbors import KNeighborsClassifier

        self._n_classes = n_classes
        self._model = KNeighborsClassifier(n_neighbors=1).fit(train.values, train.label)
        return f"1-NN of {len(train.label)} spectra"

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """(row, class) 1 for the class of the nearest spectrum, else 0."""
        return class_probability(self._model, table.values, self._n_classes)
