"""The pieces of a study of remaining lives: baselines and networks of one protocol."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import Cache
from diagnose.baselines.life_models import (
    Table,
    age_table,
    constant_regression,
    fit_regression,
    indicator_table,
    operating_names,
    operating_values,
    with_age,
)
from diagnose.data.lives import (
    Lives,
    balanced_weights,
    early_level,
    kept_segments,
    life_segments,
    lives_of,
)
from diagnose.data.windows import SUBSETS, Segments, Task
from diagnose.networks.domain import Domain, fit_domain
from diagnose.networks.registry import input_of
from diagnose.scoring.life_scores import conformal_half_width
from diagnose.settings import TrainSettings
from diagnose.studies.jobs import Job
from diagnose.training.life_store import AGE, LifeFacts
from diagnose.training.remaining_life import LifeNetwork, RemainingLife, shares_of_records
from diagnose.training.train import Training, train_network

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
AGE_ONLY, CONSTANT, INDICATORS, AND_AGE = "age_only", "constant", "indicators", "_and_age"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifePrediction:
    """Test snapshots of a protocol with the answers of one method, trained with one seed.

    Attributes
    ----------
    record : (record,) place in the data set, sorted, each once
    said : (record,) h remaining life, cut at the early level
    half_width : h, of the intervals; the early level where calibration lives are too few
    early_life : h
    detail : fit or training, in words
    facts, weights, domain, best_epoch : of networks only, for their files
    temperature : 1, there are no probabilities
    """

    protocol: str
    method: str
    seed: int
    record: IntArray
    said: FloatArray
    half_width: float
    early_life: float
    detail: str
    facts: LifeFacts | None = None
    weights: dict[str, NDArray[Any]] | None = None
    domain: Domain | None = None
    best_epoch: int = 0
    temperature: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeSets:
    """Snapshots of a protocol, and the remaining life that is to be learnt of them.

    Attributes
    ----------
    lives : of the data set
    parts : subset -> stretches; in training and validation those of known remaining life
    level : h, at which the remaining life is cut
    share : (record,) remaining life as a share of the level, of all records
    """

    lives: Lives
    parts: Mapping[str, Segments]
    level: float
    share: FloatArray

    def weight(self) -> FloatArray:
        """(record,) weights by which every life of a subset counts the same; 0 in the test."""
        weight = np.zeros(self.share.size)
        for subset in ("train", "validation"):
            record = self.parts[subset].record
            weight[record] = balanced_weights(self.lives.name[record])
        return weight

    def calibration_records(self) -> IntArray:
        """Validation records of lives that failed."""
        record = self.parts["validation"].record
        return record[self.lives.failed[record]]

    def half_width(self, share: FloatArray, coverage: float) -> float:
        """Half width in h of the intervals about shares of all records, at most the level."""
        record = self.calibration_records()
        error = self.level * np.abs(share[record] - self.share[record])
        return min(conformal_half_width(error, self.lives.name[record], coverage), self.level)


def life_sets(task: Task, settings: TrainSettings, protocol: str) -> LifeSets:
    """Snapshots of one protocol."""
    lives = lives_of(task)
    parts = {subset: life_segments(task, lives, protocol, subset) for subset in SUBSETS}
    level = early_level(
        lives,
        parts["train"].record,
        level_h=settings.remaining_life.early_life_h,
        share=settings.remaining_life.early_life_share,
    )
    known = lives.known(level)
    for subset in ("train", "validation"):
        parts[subset] = kept_segments(parts[subset], known)
    share = np.minimum(lives.remaining, level) / level
    return LifeSets(lives=lives, parts=parts, level=level, share=share)


def run_life_job(task: Task, settings: TrainSettings, job: Job) -> list[LifePrediction]:
    """Predictions on the test part of a protocol: of the baselines, or with a seed those of the network."""
    (protocol,), seed = job.protocols, job.seed or 0
    sets = life_sets(task, settings, protocol)
    if job.seed is None:
        answers = _baselines(task, settings, sets)
    else:
        answers = _networks(task, settings, sets, seed)
    record = np.sort(sets.parts["test"].record)
    coverage = settings.remaining_life.coverage
    predictions = []
    for answer in answers:
        prediction = LifePrediction(
            protocol=protocol,
            method=answer.method,
            seed=seed,
            record=record,
            said=sets.level * answer.share[record],
            half_width=sets.half_width(answer.share, coverage),
            early_life=sets.level,
            detail=answer.detail,
        )
        if answer.network is not None:
            prediction = _with_network(prediction, answer.network, sets, coverage)
        predictions.append(prediction)
    return predictions


@dataclass(frozen=True, slots=True, kw_only=True)
class _Network:
    """A training, its domain, and the range of each column beside the signal."""

    training: Training[LifeNetwork]
    domain: Domain
    told_range: dict[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answer:
    """Shares of the level of one method, (record,), NaN in the training part."""

    method: str
    detail: str
    share: FloatArray
    network: _Network | None = None


def _with_network(
    prediction: LifePrediction,
    network: _Network,
    sets: LifeSets,
    coverage: float,
) -> LifePrediction:
    """The prediction with all that goes on disk."""
    facts = LifeFacts(
        method=prediction.method,
        early_life_h=prediction.early_life,
        half_width_h=prediction.half_width,
        coverage=coverage,
        n_calibration_lives=int(np.unique(sets.lives.name[sets.calibration_records()]).size),
        told=tuple(network.told_range),
        told_range=network.told_range,
    )
    weights = network.training.model.state_dict()
    return replace(
        prediction,
        facts=facts,
        weights={name: value.numpy() for name, value in weights.items()},
        domain=network.domain,
        best_epoch=network.training.best_epoch,
    )


def _baselines(task: Task, settings: TrainSettings, sets: LifeSets) -> list[_Answer]:
    lives, parts, share = sets.lives, sets.parts, sets.share
    train = parts["train"].record
    usual = constant_regression(share[train], lives.name[train])
    detail = f"{usual:.2f} of the early level for all"
    found = [_Answer(method=CONSTANT, detail=detail, share=np.full(share.size, usual))]
    cache: Cache = {}
    clock = {name: age_table(lives, part) for name, part in parts.items()}
    heard = {
        name: indicator_table(task, lives, part, features=settings.features, cache=cache)
        for name, part in parts.items()
    }
    tables: dict[str, dict[str, Table]] = {AGE_ONLY: clock, INDICATORS: heard}
    if settings.remaining_life.with_age:
        tables[INDICATORS + AND_AGE] = {name: with_age(table, lives) for name, table in heard.items()}
    for method, table in tables.items():
        detail, predict = fit_regression(table["train"], table["validation"], lives, share)
        said = np.full(share.size, np.nan)
        for part in ("validation", "test"):
            said[table[part].record] = np.clip(predict(table[part]), 0.0, 1.0)
        found.append(_Answer(method=method, detail=detail, share=said))
    return found


def _networks(task: Task, settings: TrainSettings, sets: LifeSets, seed: int) -> list[_Answer]:
    load = input_of(settings.model).load
    windows = {name: load(task, part, training=name == "train") for name, part in sets.parts.items()}
    name = str(settings.model.get("name", "network"))
    columns, values = operating_names(task), operating_values(task, np.arange(sets.share.size))
    conditions = {name: (columns, values)}
    if settings.remaining_life.with_age:
        aged = np.concatenate([values, sets.lives.age[:, None]], axis=1)
        conditions[name + AND_AGE] = ((*columns, AGE), aged)
    domain = fit_domain(windows["train"], windows["validation"])
    weight = sets.weight()
    seen = np.unique(windows["train"].record)
    found = []
    for method, (columns, values) in conditions.items():
        target = RemainingLife(conditions=values, share=sets.share, weight=weight)
        training = train_network(
            windows["train"],
            windows["validation"],
            target=target,
            settings=settings,
            seed=seed,
        )
        said = np.full(sets.share.size, np.nan)
        for part in ("validation", "test"):
            record, share = shares_of_records(training.model, windows[part], values)
            said[record] = share
        low, high = values[seen].min(axis=0).tolist(), values[seen].max(axis=0).tolist()
        ranges = dict(zip(columns, zip(low, high, strict=True), strict=True))
        network = _Network(training=training, domain=domain, told_range=ranges)
        found.append(_Answer(method=method, detail=training.detail, share=said, network=network))
    return found
