"""Estimators that several baselines share, and their choice on validation units."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit, over_records

LEAST_PROBABILITY = 1e-9  # so that the logarithm is finite
BOOSTING = "gradient boosting"
# Candidates of logistic regression: name -> inverse strength of the penalty. The first wins ties.
_LOGISTIC = {f"logistic regression, C={value:g}": value for value in (0.1, 1.0, 10.0)}


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedModel:
    """Fitted estimator of scikit-learn with the columns that it reads."""

    name: str
    model: Any
    columns: list[int]
    n_classes: int

    def probability(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class)."""
        values = table.values[:, self.columns]
        return class_probability(self.model, values, self.n_classes)

    def accuracy(self, table: FeatureTable) -> float:
        """Balanced accuracy over the records of a table."""
        return record_accuracy(self.probability(table), table)


def choose_model(
    train: FeatureTable,
    validation: FeatureTable,
    n_classes: int,
    *,
    without: str | None = None,
) -> FittedModel:
    """Logistic regression or gradient boosting, the better one on the validation units.

    Parameters
    ----------
    train, validation : tables with the same columns
    n_classes : of the task
    without : columns whose names end in this text are left out; None keeps all
    """
    columns = known_columns(train.values)
    if without is not None:
        columns = [
            index for index in columns if not train.names[index].endswith(without)
        ]
    fitted = [
        _fitted(name, train, columns, n_classes) for name in (*_LOGISTIC, BOOSTING)
    ]
    return max(fitted, key=lambda model: model.accuracy(validation))


def boosted_trees(train: FeatureTable, n_classes: int) -> FittedModel:
    """Gradient boosting on all columns with values."""
    return _fitted(BOOSTING, train, known_columns(train.values), n_classes)


def logistic_regression(
    train: FeatureTable, n_classes: int, strength: float
) -> FittedModel:
    """Logistic regression on all columns with values; strength is the inverse of the penalty."""
    columns = known_columns(train.values)
    name, model = f"logistic regression, C={strength:g}", _logistic(strength)
    model.fit(train.values[:, columns], train.label)
    return FittedModel(name=name, model=model, columns=columns, n_classes=n_classes)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModel:
    """Logistic regression as arrays; it reads all columns of a table.

    Attributes
    ----------
    fill, mean, scale : (column,) value of unknown entries, and what is taken off and divided by
    weight, bias : (class, column) and (class,) of the scores; -inf for classes never trained on
    """

    fill: FloatArray
    mean: FloatArray
    scale: FloatArray
    weight: FloatArray
    bias: FloatArray

    def scores(self, values: FloatArray) -> FloatArray:
        """(row, class) unnormalised log-probabilities of (row, column) values."""
        known = np.where(np.isfinite(values), values, self.fill)
        return (known - self.mean) / self.scale @ self.weight.T + self.bias

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Name of each array -> the array."""
        return {
            field.name: np.asarray(getattr(self, field.name), dtype=np.float32)
            for field in fields(self)
        }


def linear_model(fitted: FittedModel, n_columns: int) -> LinearModel:
    """Arrays of a `logistic_regression` on some of the columns of a table."""
    imputer, scaler, regression = (step for _, step in fitted.model.steps)
    arrays = {"fill": np.zeros(n_columns), "mean": np.zeros(n_columns)}
    arrays["scale"] = np.ones(n_columns)
    values = {"fill": imputer.statistics_, "mean": scaler.mean_, "scale": scaler.scale_}
    for name, of_columns in values.items():
        arrays[name][fitted.columns] = of_columns
    weight = np.zeros((fitted.n_classes, n_columns))
    bias = np.full(fitted.n_classes, -np.inf)
    coefficients, intercepts = regression.coef_, regression.intercept_
    if len(coefficients) == 1:  # two classes have one score, that of the second
        coefficients = np.concatenate([np.zeros_like(coefficients), coefficients])
        intercepts = np.concatenate([np.zeros_like(intercepts), intercepts])
    for label, row, intercept in zip(
        regression.classes_, coefficients, intercepts, strict=True
    ):
        weight[label, fitted.columns], bias[label] = row, intercept
    return LinearModel(**arrays, weight=weight, bias=bias)


def known_columns(values: FloatArray) -> list[int]:
    """Columns of (row, column) values with a finite one; the bins of the boosting need it."""
    return np.flatnonzero(np.isfinite(values).any(axis=0)).tolist()


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
    _, scores = record_scores(probability, table.record)
    _, first = np.unique(table.record, return_index=True)
    label, predicted = table.label[first], scores.argmax(axis=1)
    one_unit = np.zeros_like(label)
    confusion = confusion_by_unit(label, predicted, one_unit, probability.shape[1])
    return float(balanced_accuracy(confusion[0]))


def _fitted(
    name: str, train: FeatureTable, columns: list[int], n_classes: int
) -> FittedModel:
    """Candidate of a name, fitted to some columns of a table."""
    model = _boosting() if name == BOOSTING else _logistic(_LOGISTIC[name])
    model.fit(train.values[:, columns], train.label)
    return FittedModel(name=name, model=model, columns=columns, n_classes=n_classes)


def _logistic(strength: float) -> Any:
    from sklearn.linear_model import LogisticRegression

    model = LogisticRegression(C=strength, max_iter=2000, class_weight="balanced")
    return scaled(model)


def scaled(model: Any) -> Any:
    """An estimator behind the filling and scaling of columns."""
    from sklearn.impute import SimpleImputer
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    imputer = SimpleImputer(keep_empty_features=True)
    return make_pipeline(imputer, StandardScaler(), model)


def _boosting() -> Any:
    from sklearn.ensemble import HistGradientBoostingClassifier

    return HistGradientBoostingClassifier(
        max_iter=60,
        max_leaf_nodes=8,
        learning_rate=0.15,
        class_weight="balanced",
        random_state=0,
    )
