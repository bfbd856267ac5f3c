"""What a network must beat: thresholds on one number, a simple model on condition indicators, and chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import FeatureTable
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit, over_records

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
Prediction = tuple[str, IntArray, FloatArray]


def rms_threshold(train: FeatureTable, test: FeatureTable, *, n_classes: int) -> Prediction:
    """Thresholds on the level: as many intervals of the log RMS, mean over the channels, as there are classes.

    Returns
    -------
    what was fitted, records (record,), their log-probabilities (record, class)
    """
    from sklearn.tree import DecisionTreeClassifier

    tree = DecisionTreeClassifier(max_leaf_nodes=max(n_classes, 2), class_weight="balanced", random_state=0)
    tree.fit(_level(train), train.label)
    thresholds = sorted(float(np.exp(cut)) for cut in tree.tree_.threshold[tree.tree_.feature >= 0])
    text = "thresholds " + ", ".join(f"{value:.3g}" for value in thresholds) + " m/s^2"
    return (text, *over_records(_log_probability(tree, _level(test), n_classes), test.record))


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
    what was chosen, records (record,), their log-probabilities (record, class)
    """
    known = np.flatnonzero(np.isfinite(train.values).any(axis=0)).tolist()  # the boosting's bins need a value
    kept = [index for index in known if with_level or not train.names[index].endswith("log_rms")]
    train, validation, test = (replace(table, values=table.values[:, kept]) for table in (train, validation, test))
    name, model = best_candidate(train, validation, n_classes=n_classes)
    return (name, *judged(model, test, n_classes))


def best_candidate(train: FeatureTable, validation: FeatureTable, *, n_classes: int) -> tuple[str, Any]:
    """Name and fitted model of logistic regression or gradient boosting, the better one on the validation units."""
    scored = []
    for name, make in _candidates().items():
        model = make().fit(train.values, train.label)
        scored.append((_accuracy(*judged(model, validation, n_classes), validation, n_classes), name, model))
    _, name, model = max(scored, key=lambda row: row[0])
    return name, model


def gradient_boosting(train: FeatureTable) -> Any:
    """Fitted gradient boosting."""
    return _candidates()["gradient boosting"]().fit(train.values, train.label)


def judged(model: Any, table: FeatureTable, n_classes: int) -> tuple[IntArray, FloatArray]:
    """Records (record,) of a table and their log-probabilities (record, class)."""
    return over_records(_log_probability(model, table.values, n_classes), table.record)


def nearest_spectrum(train: FeatureTable, test: FeatureTable, *, n_classes: int) -> Prediction:
    """Class of the training stretch whose spectrum is nearest, by the Euclidean distance of `spectrum_table` rows.

    Returns
    -------
    what was fitted, records (record,), their log-probabilities (record, class)
    """
    from sklearn.neighbors import KNeighborsClassifier

    model = KNeighborsClassifier(n_neighbors=1).fit(train.values, train.label)
    return (
        f"1-NN of {len(train.label)} spectra",
        *over_records(_log_probability(model, test.values, n_classes), test.record),
    )


def ridge_model(train: FeatureTable, validation: FeatureTable, test: FeatureTable, *, n_classes: int) -> Prediction:
    """Ridge regression on class membership, features standardised, its penalty chosen on the validation units.

    Returns
    -------
    what was chosen, records (record,), their log-probabilities (record, class)
    """
    from sklearn.linear_model import RidgeClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    scored = []
    for penalty in np.logspace(5, -1, 7):
        model = make_pipeline(StandardScaler(), RidgeClassifier(alpha=penalty, class_weight="balanced"))
        model.fit(train.values, train.label)
        found = over_records(_soft_score(model, validation.values, n_classes), validation.record)
        scored.append((_accuracy(*found, validation, n_classes), f"ridge, penalty {penalty:g}", model))
    _, name, model = max(scored, key=lambda row: row[0])
    return (name, *over_records(_soft_score(model, test.values, n_classes), test.record))


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


def _log_probability(model: Any, values: FloatArray, n_classes: int) -> FloatArray:
    """(row, class), no smaller than log 1e-9, as for classes that the training did not have."""
    log_probability = np.full((values.shape[0], n_classes), np.log(1e-9))
    log_probability[:, model.classes_] = np.log(np.maximum(model.predict_proba(values), 1e-9))
    return log_probability


def _soft_score(model: Any, values: FloatArray, n_classes: int) -> FloatArray:
    """(row, class) log-softmax of scores, which ranks as they do; a regression on membership has no probabilities."""
    from scipy.special import log_softmax

    score = model.decision_function(values)
    if score.ndim == 1:  # two classes: one score, positive for the second
        score = np.stack([-score, score], axis=1)
    by_class = np.full((values.shape[0], n_classes), np.log(1e-9))
    by_class[:, model.classes_] = log_softmax(score, axis=1)
    return by_class


def _accuracy(records: IntArray, log_probability: FloatArray, table: FeatureTable, n_classes: int) -> float:
    """Balanced accuracy over the records of a table."""
    label_of = dict(zip(table.record.tolist(), table.label.tolist(), strict=True))
    label = np.array([label_of[record] for record in records.tolist()], dtype=np.int64)
    confusion = confusion_by_unit(label, log_probability.argmax(axis=1), np.zeros_like(label), n_classes)
    return float(balanced_accuracy(confusion[0]))
