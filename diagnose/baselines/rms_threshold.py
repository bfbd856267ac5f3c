"""Thresholds on the level of the signal."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import numpy as np

from diagnose.baselines.base import Baseline, MethodText, Role
from diagnose.baselines.estimators import class_probability
from diagnose.baselines.features import LEVEL, FeatureTable
from diagnose.baselines.indicator_models import INDICATOR_INPUT
from diagnose.data.windows import FloatArray

if TYPE_CHECKING:
    from sklearn.tree import DecisionTreeClassifier

LOG_RMS_OF_SILENCE = -50.0


@final
class RmsThreshold(Baseline):
    """As many intervals of the log RMS, mean over the channels, as there are classes."""

    text = MethodText(
        name="rms_threshold",
        label="RMS threshold",
        card_label="RMS threshold",
        meaning="thresholds on the level alone.",
    )
    role = Role.RIVAL
    reads = INDICATOR_INPUT
    _tree: DecisionTreeClassifier
    _n_classes: int

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Grow a tree on one number."""
        from sklearn.tree import DecisionTreeClassifier

        self._n_classes = n_classes
        self._tree = DecisionTreeClassifier(
            max_leaf_nodes=max(n_classes, 2),
            class_weight="balanced",
            random_state=0,
        )
        self._tree.fit(_level(train), train.label)
        nodes = self._tree.tree_
        thresholds = np.sort(np.exp(nodes.threshold[nodes.feature >= 0]))
        values = ", ".join(f"{value:.3g}" for value in thresholds)
        return f"thresholds {values} m/s^2"

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Shares (row, class) of the training rows in the interval of each row."""
        return class_probability(self._tree, _level(table), self._n_classes)


def _level(table: FeatureTable) -> FloatArray:
    """(row, 1) log RMS, mean over the channels; a silent channel counts as very quiet."""
    columns = [index for index, name in enumerate(table.names) if name.endswith(LEVEL)]
    level = np.nan_to_num(table.values[:, columns], nan=LOG_RMS_OF_SILENCE)
    return level.mean(axis=1, keepdims=True)
