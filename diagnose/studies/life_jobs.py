"""Jobs of a study of remaining lives: baselines and networks of one protocol."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

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
from diagnose.data.windows import (
    SUBSETS,
    FloatArray,
    IntArray,
    Segments,
    Task,
)
from diagnose.networks.domain import fit_domain
from diagnose.networks.registry import input_of
from diagnose.scoring.hours import AGE, LifeFacts
from diagnose.scoring.life_scores import conformal_half_width
from diagnose.scoring.predictions import Prediction
from diagnose.settings import TrainSettings
from diagnose.studies.counts import n_different
from diagnose.studies.jobs import once
from diagnose.studies.result_files import network_name
from diagnose.training.remaining_life import RemainingLife, shares_of_records
from diagnose.training.train import train_network

AGE_ONLY, CONSTANT, INDICATORS = "age_only", "constant", "indicators"
AND_AGE = "_and_age"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeSets:
    """Snapshots of a protocol with the remaining lives to be learnt.

    Attributes
    ----------
    protocol : name of the split
    lives : of the data set
    parts : subset -> stretches; in training and validation those of known remaining life
    level : h, at which the remaining life is cut
    share : (record,) remaining life as a share of the level, of all records
    calibration : validation records of lives that failed
    coverage : of the intervals
    """

    protocol: str
    lives: Lives
    parts: Mapping[str, Segments]
    level: float
    share: FloatArray
    calibration: IntArray
    coverage: float

    def prediction(
        self,
        method: str,
        detail: str,
        answers: Iterable[tuple[IntArray, FloatArray]],
        seed: int = 0,
        told: Mapping[str, FloatArray] = MappingProxyType({}),
    ) -> Prediction:
        """Test snapshots with a method's answers: records, and their shares of the level.

        ``told`` are the columns that a network takes with the signal, of its training records.
        """
        share = np.full(self.share.size, np.nan)
        for answered, shares in answers:
            share[answered] = shares
        error = self.level * np.abs(share - self.share)[self.calibration]
        life = self.lives.name[self.calibration]
        half_width = conformal_half_width(error, life, self.coverage)
        record = np.sort(self.parts["test"].record)
        return Prediction(
            protocol=self.protocol,
            method=method,
            seed=seed,
            record=record,
            answers=self.level * share[record][:, None],
            detail=detail,
            hours=LifeFacts(
                method=method,
                early_life_h=self.level,
                half_width_h=min(half_width, self.level),
                coverage=self.coverage,
                n_calibration_lives=n_different(life),
                told=tuple(told),
                told_range={
                    name: (float(values.min()), float(values.max()))
                    for name, values in told.items()
                },
            ),
        )


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
    held_out = parts["validation"].record
    return LifeSets(
        protocol=protocol,
        lives=lives,
        parts=parts,
        level=level,
        share=np.minimum(lives.remaining, level) / level,
        calibration=held_out[lives.failed[held_out]],
        coverage=settings.remaining_life.coverage,
    )


def life_baselines(
    task: Task, settings: TrainSettings, sets: LifeSets
) -> list[Prediction]:
    """Predictions of the constant, the age alone and indicators."""
    lives, parts, share = sets.lives, sets.parts, sets.share
    train = parts["train"].record
    usual = constant_regression(share[train], lives.name[train])
    detail = f"{usual:.2f} of the early level for all"
    everywhere = np.arange(share.size), np.full(share.size, usual)
    predictions = [sets.prediction(CONSTANT, detail, [everywhere])]
    cache: Cache = {}
    features = settings.features
    indicators = {
        name: indicator_table(task, lives, part, features=features, cache=cache)
        for name, part in parts.items()
    }
    tables: dict[str, dict[str, Table]] = {
        AGE_ONLY: {name: age_table(lives, part) for name, part in parts.items()},
        INDICATORS: indicators,
    }
    if settings.remaining_life.with_age:
        tables[INDICATORS + AND_AGE] = {
            name: with_age(table, lives) for name, table in indicators.items()
        }
    for method, table in tables.items():
        detail, predict = fit_regression(
            table["train"], table["validation"], lives, share
        )
        answers = (
            (table[subset].record, np.clip(predict(table[subset]), 0.0, 1.0))
            for subset in SUBSETS[1:]
        )
        predictions.append(sets.prediction(method, detail, answers))
    return predictions


def life_networks(
    task: Task, settings: TrainSettings, sets: LifeSets, seed: int
) -> list[Prediction]:
    """Predictions of networks that are trained with a seed, without and with the age."""
    load, lives = input_of(settings.model).load, sets.lives
    windows = once(
        "inputs",
        sets.protocol,
        lambda: {
            name: load(task, part, training=name == "train")
            for name, part in sets.parts.items()
        },
    )
    columns = operating_names(task)
    values = operating_values(task, np.arange(sets.share.size))
    network = network_name(settings)
    conditions = {network: (columns, values)}
    if settings.remaining_life.with_age:
        aged = np.concatenate([values, lives.age[:, None]], axis=1)
        conditions[network + AND_AGE] = ((*columns, AGE), aged)
    weight = np.zeros(sets.share.size)
    for subset in ("train", "validation"):
        record = sets.parts[subset].record
        weight[record] = balanced_weights(lives.name[record])
    train, validation = windows["train"], windows["validation"]
    domain = once("domain", sets.protocol, lambda: fit_domain(train, validation))
    seen = np.unique(train.record)
    predictions = []
    for method, (columns, values) in conditions.items():
        training = train_network(
            train,
            validation,
            target=RemainingLife(conditions=values, share=sets.share, weight=weight),
            settings=settings,
            seed=seed,
        )
        answers = [
            shares_of_records(training.model, windows[subset], values)
            for subset in SUBSETS[1:]
        ]
        told = dict(zip(columns, values[seen].T, strict=True))
        prediction = replace(
            sets.prediction(method, training.detail, answers, seed, told),
            weights=training.weights(),
            domain=domain,
            best_epoch=training.best_epoch,
        )
        predictions.append(prediction)
    return predictions
