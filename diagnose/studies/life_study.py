"""A study of remaining lives: what each method says of each snapshot, and the numbers that come of it."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
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
    choose_life_protocols,
    early_level,
    life_segments,
    lives_of,
)
from diagnose.data.windows import SUBSETS, Segments, Task
from diagnose.networks.domain import Domain, fit_domain
from diagnose.networks.registry import build_model, check_window, input_of
from diagnose.scoring.life_scores import (
    UNITS,
    Snapshots,
    by_life,
    conformal_half_width,
    gain,
    interval,
    intervals_hold,
    life_scores,
)
from diagnose.settings import BOTH, TrainSettings
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import BOOTSTRAP_SEED, METRICS_SCHEMA_VERSION, environment, n_cores
from diagnose.training.life_network import LifeTraining, said_of_records, train_life_network
from diagnose.training.life_store import AGE, LifeFacts, StoredLife, save_life_model
from diagnose.training.store import data_fingerprint
from diagnose.training.train import device_of
from gensig.errors import ConfigError

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
AGE_ONLY, CONSTANT, INDICATORS, AND_AGE = "age_only", "constant", "indicators", "_and_age"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifePrediction:
    """Test snapshots of a protocol with what one method, trained with one seed, says of them.

    Attributes
    ----------
    record : (record,) place in the data set, sorted, each once
    said : (record,) h remaining life, cut at the early level
    half_width : h, of the intervals; the early level where there are too few calibration lives for one
    early_life : h
    detail : what was fitted or trained, in words
    stored : the network as it goes on disk; None for a baseline
    """

    protocol: str
    method: str
    seed: int
    record: IntArray
    said: FloatArray
    half_width: float
    early_life: float
    detail: str
    stored: StoredLife | None = None


def check_life_settings(settings: TrainSettings) -> None:
    """Refuse what a study of remaining lives does not know, rather than ignore it.

    Raises
    ------
    ConfigError    with the key
    """
    unknown = {
        "heads": bool(settings.heads),
        "sham": settings.sham is not None,
        "test_channels": settings.test_channels is not None,
        "tensorboard": settings.tensorboard,
    }
    for name, given in unknown.items():
        if given:
            raise ConfigError(f"{name} is not for task=remaining_life; leave it out")
    if settings.normalise == BOTH:
        raise ConfigError("normalise=both is not for task=remaining_life; choose none (level kept) or rms")


def plan_life_study(task: Task, settings: TrainSettings) -> tuple[tuple[str, ...], dict[str, str], list[Job]]:
    """Protocols, why others wanted are left out, and the jobs, after checking that every subset can be used.

    Raises
    ------
    ConfigError    as `diagnose.data.lives.choose_life_protocols`, and for a window or a device that cannot be used
    DatasetError    for a data set without lives
    """
    lives = lives_of(task)
    protocols, left_out = choose_life_protocols(task, lives, settings.protocols)
    model = build_model(settings.model, n_channels=len(task.channel_names), n_classes=2)
    inputs = input_of(settings.model)
    for protocol in protocols:
        for subset in SUBSETS:
            segments = life_segments(task, lives, protocol, subset)
            inputs.check(task, segments, str(settings.model.get("name", "network")))
    check_window(model, len(task.channel_names), inputs.n_points(task.window_samples))
    device_of(settings.device)
    jobs = [Job(protocols=(protocol,), seed=seed) for protocol in protocols for seed in (None, *settings.seeds)]
    return protocols, left_out, jobs


def run_life_job(task: Task, settings: TrainSettings, job: Job) -> list[LifePrediction]:
    """Predictions on the test part of a protocol: of the baselines, or with a seed those of the network."""
    lives, protocol = lives_of(task), job.protocols[0]
    parts = {subset: life_segments(task, lives, protocol, subset) for subset in SUBSETS}
    level = early_level(
        lives,
        parts["train"].record,
        level_h=settings.remaining_life.early_life_h,
        share=settings.remaining_life.early_life_share,
    )
    known = lives.known(level)
    for subset in ("train", "validation"):
        parts[subset] = _only(parts[subset], known)
    target = np.minimum(lives.remaining, level) / level
    found = _baselines if job.seed is None else _networks
    predictions = []
    for answer in found(task, settings, lives, parts, target, job.seed or 0):
        said = answer.said
        order = np.argsort(parts["test"].record)
        held_out = parts["validation"].record[lives.failed[parts["validation"].record]]
        error = level * np.abs(said[held_out] - target[held_out])
        half_width = conformal_half_width(error, lives.name[held_out], settings.remaining_life.coverage)
        stored = None
        if answer.network is not None:
            facts = LifeFacts(
                method=answer.method,
                early_life_h=level,
                half_width_h=min(half_width, level),
                coverage=settings.remaining_life.coverage,
                n_calibration_lives=int(np.unique(lives.name[held_out]).size),
                told=tuple(answer.network.told_range),
                told_range=answer.network.told_range,
            )
            training = answer.network.training
            stored = StoredLife(
                facts=facts,
                weights={name: value.numpy() for name, value in training.model.state_dict().items()},
                domain=answer.network.domain,
                protocol=protocol,
                seed=job.seed or 0,
                best_epoch=training.best_epoch,
            )
        record = parts["test"].record[order]
        predictions.append(
            LifePrediction(
                protocol=protocol,
                method=answer.method,
                seed=job.seed or 0,
                record=record,
                said=level * said[record],
                half_width=min(half_width, level),
                early_life=level,
                detail=answer.detail,
                stored=stored,
            )
        )
    return predictions


@dataclass(frozen=True, slots=True, kw_only=True)
class _Network:
    """A training, with what its windows and columns looked like."""

    training: LifeTraining
    domain: Domain
    told_range: dict[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answer:
    """What one method says: (record,) share of the level, NaN where not asked."""

    method: str
    detail: str
    said: FloatArray
    network: _Network | None = None


def _baselines(
    task: Task, settings: TrainSettings, lives: Lives, parts: dict[str, Segments], target: FloatArray, seed: int
) -> list[_Answer]:
    train = parts["train"].record
    usual = constant_regression(target[train], lives.name[train])
    detail = f"{usual:.2f} of the early level for all"
    found = [_Answer(method=CONSTANT, detail=detail, said=np.full(target.size, usual))]
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
        detail, predict = fit_regression(table["train"], table["validation"], lives, target)
        said = np.full(target.size, np.nan)
        for part in ("validation", "test"):
            said[table[part].record] = np.clip(predict(table[part]), 0.0, 1.0)
        found.append(_Answer(method=method, detail=detail, said=said))
    return found


def _networks(
    task: Task, settings: TrainSettings, lives: Lives, parts: dict[str, Segments], target: FloatArray, seed: int
) -> list[_Answer]:
    load = input_of(settings.model).load
    windows = {name: load(task, part, training=name == "train") for name, part in parts.items()}
    every = np.arange(target.size)
    weight = np.zeros(target.size)
    for part in ("train", "validation"):
        weight[parts[part].record] = balanced_weights(lives.name[parts[part].record])
    network, operating = str(settings.model.get("name", "network")), operating_values(task, every)
    beside = {network: (operating_names(task), operating)}
    if settings.remaining_life.with_age:
        beside[network + AND_AGE] = (
            (*operating_names(task), AGE),
            np.concatenate([operating, lives.age[:, None]], axis=1),
        )
    domain = fit_domain(windows["train"], windows["validation"])
    seen = np.unique(windows["train"].record)
    found = []
    for method, (names, values) in beside.items():
        training = train_life_network(
            windows["train"], windows["validation"], values, target, weight, settings=settings, seed=seed
        )
        said = np.full(target.size, np.nan)
        for part in ("validation", "test"):
            record, share = said_of_records(training.model, windows[part], values)
            said[record] = share
        told = zip(names, values[seen].min(axis=0).tolist(), values[seen].max(axis=0).tolist(), strict=True)
        found.append(
            _Answer(
                method=method,
                detail=f"best epoch {training.best_epoch} of {len(training.validation_loss)}",
                said=said,
                network=_Network(
                    training=training, domain=domain, told_range={name: (low, high) for name, low, high in told}
                ),
            )
        )
    return found


def run_life_study(
    task: Task,
    settings: TrainSettings,
    folder: Path,
    *,
    protocols: Sequence[str],
    left_out: dict[str, str],
    jobs: Sequence[Job],
    on_done: Callable[[str], None] = lambda line: None,
) -> tuple[dict[str, Any], list[LifePrediction]]:
    """Run the jobs, write ``predictions.csv`` and ``models/<protocol>-<method>-seed<k>`` into `folder`, and return what
    goes into ``metrics.json``, and the predictions."""
    started = time.perf_counter()

    def report(found: list[LifePrediction]) -> None:
        on_done(f"{found[-1].protocol}, {', '.join(one.method for one in found)}, seed {found[-1].seed}")

    n_workers = settings.n_threads or n_cores()
    predictions: list[LifePrediction] = run_jobs(
        task, settings, jobs, n_workers=n_workers, on_done=report, run=run_life_job
    )
    lives = lives_of(task)
    for one in predictions:
        if one.stored is not None:
            save_life_model(
                folder / "models" / f"{one.protocol}-{one.method}-seed{one.seed}", task, settings, one.stored
            )
    write_life_predictions(folder / "predictions.csv", task, lives, predictions)
    metrics = {
        "metrics_schema_version": METRICS_SCHEMA_VERSION,
        "task": settings.task,
        "data": str(task.dataset.folder),
        "data_fingerprint": data_fingerprint(task.dataset),
        "n_records": int(task.dataset.n_records),
        "sampling_rate_hz": float(task.dataset.sampling_rate),
        "channel_names": list(task.channel_names),
        "model": str(settings.model.get("name", "network")),
        "settings": {**asdict(settings), "model": dict(settings.model)},
        "protocols": {name: _result(task, settings, lives, name, predictions) for name in protocols},
        "protocols_left_out": left_out,
        "duration_s": round(time.perf_counter() - started, 1),
        "environment": environment(),
    }
    return metrics, predictions


def scored_snapshots(lives: Lives, prediction: LifePrediction) -> Snapshots:
    """The snapshots of lives that failed: how long a censored one would have run on is not known."""
    chosen = lives.failed[prediction.record]
    record = prediction.record[chosen]
    return Snapshots(
        life=np.unique(lives.name[record], return_inverse=True)[1],
        true=np.minimum(lives.remaining[record], prediction.early_life),
        said=prediction.said[chosen],
        half_width=prediction.half_width,
        early_life=prediction.early_life,
    )


def _result(
    task: Task, settings: TrainSettings, lives: Lives, protocol: str, predictions: Sequence[LifePrediction]
) -> dict[str, Any]:
    mine = [one for one in predictions if one.protocol == protocol]
    runs = {name: [one for one in mine if one.method == name] for name in dict.fromkeys(one.method for one in mine)}
    tables: dict[str, dict[str, FloatArray]] = {}
    for name, of_seeds in runs.items():
        rows = [by_life(scored_snapshots(lives, one)) for one in of_seeds]
        tables[name] = {measure: np.stack([row[measure] for row in rows]) for measure in rows[0]}
    methods = {}
    for name, of_seeds in runs.items():
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        methods[name] = {
            **life_scores(tables[name], n_bootstrap=settings.n_bootstrap, rng=rng),
            "gain_over_age_only_h": gain(
                tables[name]["rmse_h"],
                tables[AGE_ONLY]["rmse_h"],
                n_bootstrap=settings.n_bootstrap,
                rng=np.random.default_rng(BOOTSTRAP_SEED),
            ),
            "half_width_h": [one.half_width for one in of_seeds],
            "censored_below_bound": float(np.mean([below_bound(lives, one) for one in of_seeds])),
            "seeds": [one.seed for one in of_seeds],
            "detail": [one.detail for one in of_seeds],
        }
    parts = {subset: life_segments(task, lives, protocol, subset).record for subset in SUBSETS}
    level = mine[0].early_life
    n_calibration = np.unique(lives.name[parts["validation"][lives.failed[parts["validation"]]]]).size
    return {
        "early_life_h": level,
        "phm_unit_h": level / UNITS,
        "coverage_wanted": settings.remaining_life.coverage,
        "intervals_hold": intervals_hold(n_calibration, settings.remaining_life.coverage),
        "n_lives": {subset: _n_lives(lives, record, failed=True) for subset, record in parts.items()},
        "n_lives_censored": {subset: _n_lives(lives, record, failed=False) for subset, record in parts.items()},
        "n_records": {subset: int(record.size) for subset, record in parts.items()},
        "n_records_unknown": {
            subset: int((~lives.known(level)[record]).sum()) for subset, record in parts.items() if subset != "test"
        },
        "methods": methods,
    }


def below_bound(lives: Lives, prediction: LifePrediction) -> float:
    """Share of the censored test snapshots of which less is said than they have run on; 0 where there are none."""
    censored = ~lives.failed[prediction.record]
    bound = np.minimum(lives.remaining[prediction.record], prediction.early_life)[censored]
    return float(np.mean(prediction.said[censored] < bound)) if bound.size else 0.0


def _n_lives(lives: Lives, record: IntArray, *, failed: bool) -> int:
    return int(np.unique(lives.name[record[lives.failed[record] == failed]]).size)


def _only(segments: Segments, kept: NDArray[np.bool_]) -> Segments:
    """The stretches of the records that are kept, (record,) of the data set."""
    chosen = kept[segments.record]
    return Segments(record=segments.record[chosen], start=segments.start[chosen], stop=segments.stop[chosen])


def write_life_predictions(path: Path, task: Task, lives: Lives, predictions: Sequence[LifePrediction]) -> None:
    """Write one row a prediction; ``scored`` is 0 for a censored life, whose remaining life is a lower bound."""
    ids = np.asarray(task.dataset.column("record_id"))
    head = ["protocol", "method", "seed", "record_id", "life_id", "life_time_h", "remaining_life_h", "life_failed"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*head, "early_life_h", "predicted_h", "low_h", "high_h", "scored"])
        for one in predictions:
            low, high = interval(one.said, one.half_width, one.early_life)
            for row, record in enumerate(one.record.tolist()):
                failed = int(lives.failed[record])
                writer.writerow(
                    [one.protocol, one.method, one.seed, ids[record], lives.name[record]]
                    + [f"{lives.age[record]:.6g}", f"{lives.remaining[record]:.6g}", failed]
                    + [f"{value:.6g}" for value in (one.early_life, one.said[row], low[row], high[row])]
                    + [failed]
                )
