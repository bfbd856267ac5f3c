"""Scores of novelty, for protocols whose training lacks classes: the more, the less like what was
trained on.

``healthy_only`` knows healthy records alone and asks whether a fault is noticed. ``open_set``
knows all classes but one and asks whether a network that tells them apart notices the one it was
never shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.baselines.features import FeatureTable, feature_table
from diagnose.data.windows import SUBSETS, Task, WindowSet, subset_segments
from diagnose.networks.calibration import probabilities
from diagnose.networks.domain import (
    MOST_WINDOWS,
    distances,
    fit_domain,
    neighbor_distance,
)
from diagnose.scoring.metrics import over_records
from diagnose.settings import TrainSettings
from diagnose.training.autoencoder import fit_autoencoder, reconstruction_error
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import train_network

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
SCORED = SUBSETS[1:]
WITH_LEVEL, WITHOUT_LEVEL = "indicators", "indicators_without_level"
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


@dataclass(frozen=True, slots=True, kw_only=True)
class NoveltyRun:
    """Scores of the test records of a protocol by one method and seed, larger for what is less
    like the training.

    Attributes
    ----------
    record, score : (record,) of the test part
    validation_score : (record,) of the validation part, whose classes are those of the training
    predicted : (record,) labels of a network that tells known classes apart; None of other methods
    """

    protocol: str
    method: str
    seed: int
    detail: str
    record: IntArray
    score: FloatArray
    validation_score: FloatArray
    predicted: IntArray | None = None


def fitted_runs(
    task: Task, settings: TrainSettings, protocol: str, sets: Mapping[str, WindowSet]
) -> list[NoveltyRun]:
    """Scores that need no training by steps: distance of band levels, and of healthy records
    those of indicators.

    Parameters
    ----------
    task, settings : of the study
    protocol : of `diagnose.data.protocols.OPEN_PROTOCOLS`
    sets : windows of each subset
    """
    domain = fit_domain(sets["train"], sets["validation"])
    scores = {
        name: over_records(distances(domain, sets[name])[:, None], sets[name].record)
        for name in SCORED
    }
    found = [_run(protocol, "nearest_band_levels", "distance of domain.py", scores)]
    if protocol != "healthy_only":
        return found
    tables = {
        subset: feature_table(
            task, subset_segments(task, protocol, subset), features=settings.features
        )
        for subset in SUBSETS
    }
    for suffix, with_level in ((WITH_LEVEL, True), (WITHOUT_LEVEL, False)):
        found += _indicator_runs(protocol, tables, suffix, with_level)
    return found


def _indicator_runs(
    protocol: str, tables: Mapping[str, FeatureTable], suffix: str, with_level: bool
) -> list[NoveltyRun]:
    """Distance to the fifth nearest training record, and an isolation forest, on standardised
    indicators.

    Source: Liu, Ting & Zhou (2008), "Isolation forest", ICDM; the distance as in
    `diagnose.networks.domain`.
    """
    from sklearn.ensemble import IsolationForest
    from sklearn.impute import SimpleImputer
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    train = tables["train"]
    known = np.isfinite(train.values).any(axis=0)
    level = np.array([name.endswith("log_rms") for name in train.names])
    kept = np.flatnonzero(known & (with_level | ~level))
    scaler = make_pipeline(SimpleImputer(), StandardScaler()).fit(train.values[:, kept])
    values = {
        subset: scaler.transform(table.values[:, kept])
        for subset, table in tables.items()
    }
    forest = IsolationForest(random_state=0).fit(values["train"])
    near = {
        subset: neighbor_distance(values[subset], values["train"]) for subset in SCORED
    }
    rare = {subset: -forest.score_samples(values[subset]) for subset in SCORED}
    text = f"{kept.size} indicators of {len(train.label)} stretches"
    return [
        _run(
            protocol,
            f"{name}_{suffix}",
            text,
            {
                subset: over_records(score[:, None], tables[subset].record)
                for subset, score in scores.items()
            },
        )
        for name, scores in (("nearest", near), ("forest", rare))
    ]


def trained_runs(
    settings: TrainSettings, protocol: str, seed: int, sets: Mapping[str, WindowSet]
) -> list[NoveltyRun]:
    """Scores of a network trained on the known classes.

    An autoencoder of healthy windows, else a classifier.
    """
    if protocol != "healthy_only":
        return _classifier_runs(settings, protocol, seed, sets)
    model = fit_autoencoder(
        sets["train"], sets["validation"], settings=settings, seed=seed
    )
    scores = {
        subset: over_records(
            reconstruction_error(model, sets[subset])[:, None], sets[subset].record
        )
        for subset in SCORED
    }
    return [
        _run(
            protocol, "autoencoder", f"best epoch {model.best_epoch}", scores, seed=seed
        )
    ]


def _classifier_runs(
    settings: TrainSettings, protocol: str, seed: int, sets: Mapping[str, WindowSet]
) -> list[NoveltyRun]:
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
        for name in SUBSETS[:2]
    }
    training = train_network(
        known["train"],
        known["validation"],
        target=Classes(n_classes=classes.size),
        settings=settings,
        seed=seed,
    )
    rows = np.unique(
        np.linspace(0, len(sets["train"]) - 1, min(len(sets["train"]), MOST_WINDOWS))
        .round()
        .astype(int)
    )
    trained_features, _ = network_outputs(training.model, sets["train"], rows)
    found: dict[str, dict[str, tuple[IntArray, FloatArray]]] = {}
    for subset in SCORED:
        windows = sets[subset]
        record, log_probability = over_records(
            predict_windows(training.model, windows), windows.record
        )
        largest = probabilities(log_probability, training.temperature).max(
            axis=1, keepdims=True
        )
        features, logits = network_outputs(
            training.model, windows, np.arange(len(windows))
        )
        energy = -np.logaddexp.reduce(logits, axis=1)
        distance = neighbor_distance(
            _unit_length(features), _unit_length(trained_features)
        )
        found.setdefault("largest_probability", {})[subset] = (record, 1 - largest)
        found.setdefault("energy", {})[subset] = over_records(
            energy[:, None], windows.record
        )
        found.setdefault("nearest_features", {})[subset] = over_records(
            distance[:, None], windows.record
        )
    predicted = classes[log_probability.argmax(axis=1)]
    return [
        replace(
            _run(protocol, name, training.detail, found[name], seed=seed),
            predicted=predicted,
        )
        for name in found
    ]


def network_outputs(
    model: nn.Module, windows: WindowSet, chosen: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Features (window, feature) that the last layer of the class scores reads, and its output
    (window, class).
    """
    heads = [
        part
        for name, part in model.named_modules()
        if name == "head" or name.startswith("head.")
    ]
    layer = [part for part in heads if isinstance(part, nn.Linear)][-1]
    seen: list[tuple[torch.Tensor, torch.Tensor]] = []
    hook = layer.register_forward_hook(
        lambda _, inputs, output: seen.append((inputs[0], output))
    )
    try:
        with torch.inference_mode():
            for block in np.array_split(chosen, -(-chosen.size // 64)):
                model(torch.from_numpy(windows.cut(block)))
    finally:
        hook.remove()
    features, logits = (
        torch.cat(parts).numpy().astype(float) for parts in zip(*seen, strict=True)
    )
    return features, logits


def _unit_length(features: FloatArray) -> FloatArray:
    length = np.linalg.norm(features, axis=1, keepdims=True)
    return np.divide(features, length, out=np.zeros_like(features), where=length > 0)


def _run(
    protocol: str,
    method: str,
    detail: str,
    scores: Mapping[str, tuple[IntArray, FloatArray]],
    *,
    seed: int = 0,
) -> NoveltyRun:
    record, score = scores["test"]
    return NoveltyRun(
        protocol=protocol,
        method=method,
        seed=seed,
        detail=detail,
        record=record,
        score=score[:, 0],
        validation_score=scores["validation"][1][:, 0],
    )
