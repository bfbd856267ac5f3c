"""Example of a new baseline: one module, and one line in the registry.

In a checkout this file would be ``diagnose/baselines/nearest_crest.py``. One step follows: the
entry `NearestCrest` in `diagnose.baselines.registry.BASELINES`. Then ``baselines=[nearest_crest]``
runs it, and the page shows it.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Baseline, MethodText, Role
from diagnose.baselines.features import FeatureTable
from diagnose.baselines.indicator_models import INDICATOR_INPUT

FloatArray = NDArray[np.floating]


@final
class NearestCrest(Baseline):
    """Class whose mean crest factor is nearest."""

    text = MethodText(
        name="nearest_crest",
        label="nearest crest factor",
        card_label="nearest crest factor",
        meaning="the class whose mean crest factor over the training signals is nearest.",
    )
    role = Role.RIVAL  # the network must beat it
    reads = INDICATOR_INPUT  # stretches of signal with their condition indicators

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Keep the mean of each class; an absent class is infinitely far."""
        crest = _crest_factor(train)
        self._mean = np.full(n_classes, np.inf)
        for label in np.unique(train.label):
            self._mean[label] = crest[train.label == label].mean()
        return "class means " + ", ".join(f"{mean:.3g}" for mean in self._mean)

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class), the larger the nearer the mean of the class."""
        distance = np.abs(_crest_factor(table)[:, None] - self._mean)
        nearness = np.exp(-distance)
        return nearness / nearness.sum(axis=1, keepdims=True)


def _crest_factor(table: FeatureTable) -> FloatArray:
    """(row,) mean over the channels."""
    columns = [name.endswith("crest_factor") for name in table.names]
    return table.values[:, columns].mean(axis=1)
