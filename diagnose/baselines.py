"""What a network must beat: thresholds on one number, a simple model on condition indicators, and chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.features import FeatureTable
from diagnose.metrics import balanced_accuracy, confusion_by_unit, over_records

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
Prediction = tuple[str, IntArray, IntArray]


def rms_threshold(train: FeatureTable, test: FeatureTable, *, n_classes: int) -> Prediction:
    """Thresholds on the level: as many intervals of the log RMS, mean over the channels, as there are classes.

    Returns
    -------
    what was fitted, records (record,), predicted labels (record,)
    """
    from sklearn.tree import DecisionTreeClassifier

    tree = DecisionTreeClassifier(max_leaf_nodes=max(n_classes, 2), class_weight="balanced", random_state=0)
    tree.fit(_level(train), train.label)
    thresholds = sorted(float(np.exp(cut)) for cut in tree.tree_.threshold[tree.tree_.feature >= 0])
    text = "thresholds " + ", ".join(f"{value:.3g}" for value in thresholds) + " m/s^2"
    return (text, *_vote(tree, _level(test), test.record, n_classes))


def indicator_model(
    train: FeatureTable, validation: FeatureTable, test: FeatureTable, *, n_classes: int, with_level: bool
) -> Prediction:
    """Logistic regression or gradient boosting on the indicators, the better one on the validation units.

    Parameters
    ----------
    train, validation, test : tables with the same columns
    with_level : whether the RMS takes part; without it the comparison with RMS-normalised windows is fair

    Returns
    -------
    what was chosen, records (record,), predicted labels (record,)
    """
    known = np.flatnonzero(np.isfinite(train.values).any(axis=0)).tolist()  # the boosting's bins need a value
    kept = [index for index in known if with_level or not train.names[index].endswith("log_rms")]
    scored = []
    for name, make in _candidates().items():
        model = make()
        model.fit(train.values[:, kept], train.label)
        records, predicted = _vote(model, validation.values[:, kept], validation.record, n_classes)
        label = _label_of(records, validation)
        confusion = confusion_by_unit(label, predicted, np.zeros_like(label), n_classes)
        scored.append((float(balanced_accuracy(confusion[0])), name, model))
    _, name, model = max(scored, key=lambda row: row[0])
    return (name, *_vote(model, test.values[:, kept], test.record, n_classes))


def _candidates() -> dict[str, Callable[[], Any]]:
    """Untrained models by name, the first winning ties."""
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.impute import SimpleImputer
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def logistic(strength: float) -> Any:
        model = LogisticRegression(C=strength, max_iter=2000, class_weight="balanced")
        return make_pipeline(SimpleImputer(keep_empty_features=True), StandardScaler(), model)

    def boosting() -> Any:
        return HistGradientBoostingClassifier(
            max_iter=60, max_leaf_nodes=8, learning_rate=0.15, class_weight="balanced", random_state=0
        )

    return {
        "logistic regression, C=0.1": lambda: logistic(0.1),
        "logistic regression, C=1": lambda: logistic(1.0),
        "logistic regression, C=10": lambda: logistic(10.0),
        "gradient boosting": boosting,
    }


def _level(table: FeatureTable) -> FloatArray:
    """(row, 1) log RMS, mean over the channels; a silent channel counts as very quiet."""
    columns = [index for index, name in enumerate(table.names) if name.endswith("log_rms")]
    return np.nan_to_num(table.values[:, columns], nan=-50.0).mean(axis=1, keepdims=True)


def _vote(model: Any, values: FloatArray, record: IntArray, n_classes: int) -> tuple[IntArray, IntArray]:
    """Records and their predicted labels: the largest mean log-probability over the record's rows."""
    log_probability = np.full((values.shape[0], n_classes), np.log(1e-9))
    log_probability[:, model.classes_] = np.log(np.maximum(model.predict_proba(values), 1e-9))
    records, by_record = over_records(log_probability, record)
    return records, by_record.argmax(axis=1)


def _label_of(records: IntArray, table: FeatureTable) -> IntArray:
    label = dict(zip(table.record.tolist(), table.label.tolist(), strict=True))
    return np.array([label[record] for record in records.tolist()], dtype=np.int64)
