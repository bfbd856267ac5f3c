"""Baselines that are the better of a linear model and boosted trees on a table of features."""

from __future__ import annotations

from typing import ClassVar

from diagnose.baselines.base import Baseline
from diagnose.baselines.estimators import FittedModel, choose_model
from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import FloatArray


class ChosenModelBaseline(Baseline):
    """Logistic regression or gradient boosting; subclasses name the table that it reads.

    Attributes
    ----------
    without : columns whose names end in this text are left out; None keeps all
    """

    without: ClassVar[str | None] = None
    _model: FittedModel

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Fit all candidates and keep the best one."""
        self._model = choose_model(train, validation, n_classes, without=self.without)
        return self._model.name

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class) of the chosen model."""
        return self._model.probability(table)
