"""Nearest training spectrum, which shows if a split lets a method recognise machines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Baseline, Input, MethodText, Parts, Role, Source
from diagnose.baselines.estimators import class_probability
from diagnose.baselines.features import FeatureTable
from diagnose.baselines.window_features import over_stretches
from diagnose.data.windows import FloatArray, WindowSet, input_scale

if TYPE_CHECKING:
    from sklearn.neighbors import KNeighborsClassifier

# 40 dB below white noise of the same RMS, as in configs/model/spectrum.yaml
SPECTRUM_FLOOR = 0.01


def spectrum_table(windows: WindowSet, scale: Sequence[float]) -> FeatureTable:
    """Log-magnitude spectra of stretches, means over their windows, channels side by side.

    Parameters
    ----------
    windows : of one subset
    scale : (channel,) divisor of the windows: `input_scale` of the training windows
    """
    import torch

    from diagnose.networks.spectrum import log_spectrum

    divisor = torch.tensor(list(scale), dtype=torch.float32)[:, None]

    def spectra(block: NDArray[np.float32]) -> FloatArray:
        scaled = torch.from_numpy(block) / divisor
        return log_spectrum(scaled, SPECTRUM_FLOOR).flatten(1).numpy()

    return over_stretches(windows, spectra, "bin")


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
