"""Scores of novelty for protocols whose training lacks classes; larger is less like the training.

``healthy_only`` trains on healthy records alone and asks if a fault is noticed. ``open_set``
trains on all classes but one and asks if a network that tells them apart notices the other one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.baselines.features import FeatureTable, feature_table
from diagnose.data.windows import (
    SUBSETS,
    FloatArray,
    IntArray,
    Task,
    WindowSet,
    subset_segments,
)
from diagnose.networks.calibration import probabilities
from diagnose.networks.domain import (
    MOST_WINDOWS,
    distances,
    fit_domain,
    neighbor_distance,
)
from diagnose.scoring.metrics import over_records
from diagnose.scoring.predictions import KNOWN_CLASSES, VALIDATION, Prediction, Rows
from diagnose.settings import TrainSettings
from diagnose.training.autoencoder import fit_autoencoder, reconstruction_error
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import train_network

SITES = 3  # axes (window, site, feature) of the features of a network that scores sites
# Names of the scores in metrics.json, and their labels on the page.
SCORE_LABELS = {
    "nearest_indicators": "5th neighbour, indicators",
    "nearest_indicators_without_level": "5th neighbour, indicators without RMS",
    "forest_indicators": "isolation forest, indicators",
    "forest_indicators_without_level": "isolation forest, indicators without RMS",
    "nearest_band_levels": "5th neighbour, band levels",
    "autoencoder": "autoencoder",
    "largest_probability": "1 - largest probability",
    "energy": "energy",
    "nearest_features": "5th neighbour, network's features",
}


def _run(
    protocol: str,
    method: str,
    detail: str,
    score_of: Callable[[str], FloatArray],
    rows: Mapping[str, WindowSet] | Mapping[str, FeatureTable] | Mapping[str, Rows],
    *,
    seed: int = 0,
    known: FloatArray | None = None,
) -> Prediction:
    """Scores of novelty of the test and the validation records, whose classes were trained on.

    Parameters
    ----------
    score_of : (row,) scores of a subset
    rows : subset -> windows, stretches or records; scores are averaged over each record
    known : (record, class) of a network that tells known classes apart
    """
    (record, answers), (others, scores) = (
        over_records(score_of(subset)[:, None], rows[subset].record)
        for subset in ("test", VALIDATION)
    )
    return Prediction(
        protocol=protocol,
        method=method,
        seed=seed,
        detail=detail,
        record=record,
        answers=answers,
        parts={VALIDATION: Rows(record=others, answers=scores)},
        further={} if known is None else {KNOWN_CLASSES: known},
    )


def fitted_runs(
    task: Task, settings: TrainSettings, protocol: str, sets: Mapping[str, WindowSet]
) -> list[Prediction]:
    """Scores that are fitted: distances of band levels, and for `healthy_only` of indicators.

    Parameters
    ----------
    task, settings : of the study
    protocol : of `diagnose.data.protocols.OPEN_PROTOCOLS`
    sets : windows of each subset
    """
    domain = fit_domain(sets["train"], sets["validation"])
    runs = [
        _run(
            protocol,
            "nearest_band_levels",
            "distance of domain.py",
            lambda subset: distances(domain, sets[subset]),
            sets,
        )
    ]
    if protocol != "healthy_only":
        return runs
    tables = {
        subset: feature_table(
            task, subset_segments(task, protocol, subset), features=settings.features
        )
        for subset in SUBSETS
    }
    names = tables["train"].names
    level = np.array([name.endswith("log_rms") for name in names])
    runs += _indicator_runs(protocol, tables, "indicators", np.ones_like(level))
    runs += _indicator_runs(protocol, tables, "indicators_without_level", ~level)
    return runs


def _indicator_runs(
    protocol: str,
    tables: Mapping[str, FeatureTable],
    suffix: str,
    chosen: NDArray[np.bool_],
) -> list[Prediction]:
    """Distance to the fifth nearest training record, and an isolation forest.

    Both on the chosen indicators, standardised.

    Source: Liu, Ting & Zhou (2008), "Isolation forest", ICDM; the distance as in
    `diagnose.networks.domain`.
    """
    from sklearn.ensemble import IsolationForest
    from sklearn.impute import SimpleImputer
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    train = tables["train"]
    known = np.isfinite(train.values).any(axis=0)
    kept = np.flatnonzero(known & chosen)
    scaler = make_pipeline(SimpleImputer(), StandardScaler()).fit(train.values[:, kept])
    values = {
        subset: scaler.transform(table.values[:, kept])
        for subset, table in tables.items()
    }
    forest = IsolationForest(random_state=0).fit(values["train"])
    scores: dict[str, Callable[[str], FloatArray]] = {
        "nearest": lambda subset: neighbor_distance(values[subset], values["train"]),
        "forest": lambda subset: -forest.score_samples(values[subset]),
    }
    text = f"{kept.size} indicators of {len(train.label)} stretches"
    return [
        _run(protocol, f"{name}_{suffix}", text, score_of, tables)
        for name, score_of in scores.items()
    ]


def trained_runs(
    settings: TrainSettings, protocol: str, seed: int, sets: Mapping[str, WindowSet]
) -> list[Prediction]:
    """Scores of a network trained on the known classes.

    An autoencoder of healthy windows, else a classifier.
    """
    if protocol != "healthy_only":
        return _classifier_runs(settings, protocol, seed, sets)
    model, best_epoch = fit_autoencoder(
        sets["train"], sets["validation"], settings=settings, seed=seed
    )
    return [
        _run(
            protocol,
            "autoencoder",
            f"best epoch {best_epoch}",
            lambda subset: reconstruction_error(model, sets[subset]),
            sets,
            seed=seed,
        )
    ]


def _classifier_runs(
    settings: TrainSettings, protocol: str, seed: int, sets: Mapping[str, WindowSet]
) -> list[Prediction]:
    """Three scores of one classifier of the known classes.

    The largest probability is that of a record's calibrated class probabilities. Energy and
    distance are means over the record's windows, the energy at temperature 1.

    Source: Hendrycks & Gimpel (2017), "A baseline for detecting misclassified and
    out-of-distribution examples in neural networks", ICLR (probability); Liu, Wang, Owens & Li
    (2020), "Energy-based out-of-distribution detection", NeurIPS, equation 4; Sun, Ming, Zhu & Li
    (2022), "Out-of-distribution detection with deep nearest neighbors", ICML, section 3 (distance
    of features of unit length).
    """
    classes = np.unique(sets["train"].label)
    known = {
        name: replace(sets[name], label=np.searchsorted(classes, sets[name].label))
        for name in ("train", "validation")
    }
    training = train_network(
        known["train"],
        known["validation"],
        target=Classes(n_classes=classes.size),
        settings=settings,
        seed=seed,
    )
    model = training.model
    n_train = len(sets["train"])
    rows = np.linspace(0, n_train - 1, min(n_train, MOST_WINDOWS)).round().astype(int)
    trained, _ = network_outputs(model, sets["train"], np.unique(rows))
    outputs = {
        subset: network_outputs(model, sets[subset], np.arange(len(sets[subset])))
        for subset in (VALIDATION, "test")
    }
    records = {subset: rows_of_records(model, sets[subset]) for subset in outputs}
    known_classes = np.full((records["test"].record.size, classes.max() + 1), -np.inf)
    known_classes[:, classes] = records["test"].answers

    def doubt(subset: str) -> FloatArray:
        return 1 - probabilities(records[subset].answers, training.temperature).max(
            axis=1
        )

    def energy(subset: str) -> FloatArray:
        return -np.logaddexp.reduce(outputs[subset][1], axis=1)

    def distance(subset: str) -> FloatArray:
        features = _unit_length(outputs[subset][0])
        return neighbor_distance(features, _unit_length(trained))

    make = partial(
        _run, protocol, detail=training.detail, seed=seed, known=known_classes
    )
    return [
        make("largest_probability", score_of=doubt, rows=records),
        make("energy", score_of=energy, rows=sets),
        make("nearest_features", score_of=distance, rows=sets),
    ]


def rows_of_records(model: nn.Module, windows: WindowSet) -> Rows:
    """Log-probabilities of the records of a set, means over their windows."""
    record, scores = over_records(predict_windows(model, windows), windows.record)
    return Rows(record=record, answers=scores)


def network_outputs(
    model: nn.Module, windows: WindowSet, chosen: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Features (window, feature) that the last layer of the class scores reads, and the scores
    (window, class).

    Of a network that scores sites they are the largest of each feature over the sites.
    """
    heads = [
        part
        for name, part in model.named_modules()
        if name == "head" or name.startswith("head.")
    ]
    layer = [part for part in heads if isinstance(part, nn.Linear)][-1]
    seen: list[torch.Tensor] = []
    scores: list[torch.Tensor] = []
    hook = layer.register_forward_hook(lambda _, inputs, output: seen.append(inputs[0]))
    try:
        with torch.inference_mode():
            for block in np.array_split(chosen, -(-chosen.size // 64)):
                scores.append(model(torch.from_numpy(windows.cut(block))))
    finally:
        hook.remove()
    features = torch.cat(seen)
    if features.ndim == SITES:
        features = features.amax(dim=1)
    return features.numpy().astype(float), torch.cat(scores).numpy().astype(float)


def _unit_length(features: FloatArray) -> FloatArray:
    length = np.linalg.norm(features, axis=1, keepdims=True)
    return np.divide(features, length, out=np.zeros_like(features), where=length > 0)
