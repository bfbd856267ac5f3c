"""Estimators that several baselines share, and their choice on validation units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import FeatureTable
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit, over_records

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
LEAST_PROBABILITY = 1e-9  # so that the logarithm is finite


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenModel:
    """Fitted estimator of scikit-learn with the columns that it reads."""

    name: str
    model: Any
    columns: list[int]
    n_classes: int

    def probability(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class)."""
        return class_probability(
            self.model, table.values[:, self.columns], self.n_classes
        )


def choose_model(
    train: FeatureTable,
    validation: FeatureTable,
    n_classes: int,
    *,
    without: str | None = None,
) -> ChosenModel:
    """Logistic regression or gradient boosting, the better one on the validation units.

    Parameters
    ----------
    train, validation : tables with the same columns
    n_classes : of the task
    without : columns whose names end so are left out
    """
    columns = known_columns(train)
    if without is not None:
        columns = [
            index for index in columns if not train.names[index].endswith(without)
        ]
    best, best_accuracy = None, -1.0
    for name, make in _candidates().items():
        model = make().fit(train.values[:, columns], train.label)
        chosen = ChosenModel(
            name=name, model=model, columns=columns, n_classes=n_classes
        )
        accuracy = record_accuracy(chosen.probability(validation), validation)
        if accuracy > best_accuracy:
            best, best_accuracy = chosen, accuracy
    assert best is not None
    return best


def boosted_trees(train: FeatureTable, n_classes: int) -> ChosenModel:
    """Gradient boosting without a choice."""
    columns = known_columns(train)
    model = _boosting().fit(train.values[:, columns], train.label)
    return ChosenModel(
        name="gradient boosting", model=model, columns=columns, n_classes=n_classes
    )


def known_columns(table: FeatureTable) -> list[int]:
    """Columns with a finite value; the bins of the boosting need one."""
    return [
        int(index) for index in np.flatnonzero(np.isfinite(table.values).any(axis=0))
    ]


def class_probability(model: Any, values: FloatArray, n_classes: int) -> FloatArray:
    """Probabilities (row, class); 0 for classes that the training did not have."""
    probability = np.zeros((values.shape[0], n_classes))
    probability[:, model.classes_] = model.predict_proba(values)
    return probability


def record_scores(
    probability: FloatArray, record: IntArray
) -> tuple[IntArray, FloatArray]:
    """Records (record,) and the means (record, class) of the log-probabilities of their rows."""
    return over_records(np.log(np.maximum(probability, LEAST_PROBABILITY)), record)


def record_accuracy(probability: FloatArray, table: FeatureTable) -> float:
    """Balanced accuracy over the records of a table, whose rows have these probabilities."""
    records, scores = record_scores(probability, table.record)
    label_of = dict(zip(table.record.tolist(), table.label.tolist(), strict=True))
    label = np.array([label_of[record] for record in records.tolist()], dtype=np.int64)
    one_unit = np.zeros_like(label)
    n_classes = probability.shape[1]
    confusion = confusion_by_unit(label, scores.argmax(axis=1), one_unit, n_classes)
    return float(balanced_accuracy(confusion[0]))


def _candidates() -> dict[str, Callable[[], Any]]:
    """Untrained models by name, the first winning ties."""
    return {
        "logistic regression, C=0.1": lambda: _logistic(0.1),
        "logistic regression, C=1": lambda: _logistic(1.0),
        "logistic regression, C=10": lambda: _logistic(10.0),
        "gradient boosting": _boosting,
    }


def _logistic(strength: float) -> Any:
    from sklearn.impute import SimpleImputer
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    model = LogisticRegression(C=strength, max_iter=2000, class_weight="balanced")
    return make_pipeline(
        SimpleImputer(keep_empty_features=True), StandardScaler(), model
    )


def _boosting() -> Any:
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=60,
        max_leaf_nodes=8,
        learning_rate=0.15,
        class_weight="balanced",
        random_state=0,
    )
