"""Simulated other worlds.

Networks trained in one, adapted to another by its healthy records, judged on its units.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import nn

from benchmarks._realism_sets import kept
from diagnose.data.windows import (
    Segments,
    Task,
    WindowSet,
    load_windows,
    subset_segments,
    task_of,
)
from diagnose.networks.adaptation import (
    HEALTHY,
    METHODS,
    Statistics,
    adapt_network,
    chosen_windows,
    statistics_of,
)
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit, over_records
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_model, load_statistics
from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]

# The plan of quickstart in version 0.9, and two sound records of each machine, which are no
# examples, at conditions of their own.
CROSSED = (
    "plan.n_units=40",
    "plan.machines=crossed",
    "plan.fault_gear=as_given",
    "plan.n_reference=2",
)
BASE = (
    "experiment=quickstart",
    *CROSSED,
    "plan.n_gearboxes=8",
    "operating.duration_s=0.5",
)
STORED = ("dataset.store_source=true", "dataset.store_healthy_twin=true")
HOUSING = (*BASE, "sensing=housing")
SOURCE = (*HOUSING, *STORED)  # re-draws need what is stored; it changes no sample
OTHER_SENSORS = (
    "sensing.path.natural_frequency_hz=[150,6000]",
    "sensing.sensor.mounted_resonance_hz=9000",
)  # assumed
WORLDS = {
    "paths": (*HOUSING, "seed=1"),
    "sensors": (*HOUSING, "seed=3", *OTHER_SENSORS),
    "machines": (
        *BASE,
        "sensing=machine",
        "seed=2",
        "system.supports=bearings",
        "quality.support_damping_ratio_low=0.01",
        "quality.support_damping_ratio_high=0.1",
        "quality.iso1328_grade=7",
        *OTHER_SENSORS,
    ),
}
# Randomised training set of gears of the worlds' name plate; nothing else of them is in it. The
# module varies by 1 in 200, since accuracy is drawn once a unit only with a size of the gears.
DRAWN = {
    "gear.normal_module_mm": "{distribution: uniform, low: 1.99, high: 2.01}",
    "operating.speed_rpm": "{distribution: uniform, low: 1000, high: 2600}",
    "operating.torque_nm": "{distribution: uniform, low: 8, high: 44}",
    "sensing.fault_gain": "{distribution: log_uniform, low: 1, high: 4}",
}
BRIDGE = (
    "experiment=bridge",
    "gear=xiamen_23_84",
    "gear.pinion.n_teeth=23",
    "gear.wheel.n_teeth=84",
    "plan.vary={" + ", ".join(f"{key}: {value}" for key, value in DRAWN.items()) + "}",
    "operating.duration_s=0.5",
    "plan.n_units=80",
    "plan.n_records=320",
    "seed=7",
    *STORED,
)
PROTOCOL = "by_unit"
SCOPES = (
    "world",
    "gearbox",
)  # whose healthy records: all gearboxes of the world together, or each its own
BEFORE = "before"
N_BOOTSTRAP = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Records of a world's units that no adaptation saw, and what networks say of them.

    Attributes
    ----------
    label, unit : (record,)
    log_probability : variant -> (seed, record, class)
    n_windows : of the healthy records adapted to, all of the world
    """

    label: IntArray
    unit: NDArray[Any]
    log_probability: Mapping[str, FloatArray]
    n_windows: int


def judge_world(source: Dataset, world: Dataset, models: Sequence[Path]) -> Judged:
    """Adapt each network by the world's healthy training records, judge it on its validation and
    test records.
    """
    seeds: list[dict[str, FloatArray]] = []
    for folder in models:
        model, description = load_model(folder)
        own, other = (_task(description, dataset) for dataset in (source, world))
        adapting = load_windows(
            other, _healthy(other, subset_segments(other, PROTOCOL, "train"))
        )
        parts = [
            subset_segments(other, PROTOCOL, subset)
            for subset in ("validation", "test")
        ]
        judged = load_windows(other, _joined(parts))
        trained = load_windows(own, subset_segments(own, PROTOCOL, "train"))
        healthy = load_statistics(folder)
        assert healthy is not None
        mixture = statistics_of(model, chosen_windows(trained, np.arange(len(trained))))
        result = {BEFORE: predict_windows(model, judged)}
        for scope in SCOPES:
            for name, statistics, method in _variants(healthy, mixture):
                result[f"{name}, {scope}"] = _adapted(
                    model, statistics, method, adapting, judged, _groups(world, scope)
                )
        seeds.append(
            {
                name: over_records(value, judged.record)[1]
                for name, value in result.items()
            }
        )
    record = np.unique(judged.record)
    return Judged(
        label=other.labels()[record],
        unit=np.asarray(world.column("unit_id"))[record],
        log_probability={
            name: np.stack([seed[name] for seed in seeds]) for name in seeds[0]
        },
        n_windows=len(adapting),
    )


def _variants(
    healthy: Statistics, mixture: Statistics
) -> Iterator[tuple[str, Statistics, str]]:
    for method in METHODS:
        yield method, healthy, method
        yield f"naive {method}", mixture, method


def _groups(world: Dataset, scope: str) -> NDArray[Any]:
    """(record,) what is adapted to together."""
    return (
        np.zeros(world.n_records)
        if scope == "world"
        else np.asarray(world.column("gearbox_id"))
    )


def _adapted(
    model: nn.Module,
    source: Statistics,
    method: str,
    adapting: WindowSet,
    judged: WindowSet,
    group: NDArray[Any],
) -> FloatArray:
    """(window, class) log-probabilities, each group of records by the network adapted to its
    healthy ones.
    """
    result = np.empty((len(judged), 0))
    for name in np.unique(group[judged.record]):
        mine, theirs = (
            np.flatnonzero(group[part.record] == name) for part in (adapting, judged)
        )
        network = adapt_network(model, source, chosen_windows(adapting, mine), method)
        said = predict_windows(network, _subset(judged, theirs))
        if not result.size:
            result = np.empty((len(judged), said.shape[1]))
        result[theirs] = said
    return result


def scores(judged: Judged, class_names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Of each variant: scores with 95 % intervals over units and seeds, and differences to the
    network as trained.

    Intervals of differences draw the same units and seeds for both. ``auroc`` is that of
    healthy against the rest.
    """
    n_classes, n_units = len(class_names), np.unique(judged.unit).size
    rng = np.random.default_rng(20240607)
    n_seeds = len(judged.log_probability[BEFORE])
    times = rng.multinomial(n_units, np.full(n_units, 1 / n_units), size=N_BOOTSTRAP)
    seeds = rng.integers(n_seeds, size=(N_BOOTSTRAP, n_seeds))
    healthy = list(class_names).index(HEALTHY)
    table: dict[str, dict[str, Any]] = {}
    base, base_drawn = (
        0.0,
        np.zeros(N_BOOTSTRAP),
    )  # of the first variant, the network as trained
    for name, log_probability in judged.log_probability.items():
        confusion = np.stack(
            [
                confusion_by_unit(
                    judged.label, rows.argmax(axis=1), judged.unit, n_classes
                )
                for rows in log_probability
            ]
        )
        resampled = balanced_accuracy(np.einsum("bu,sutp->bstp", times, confusion))
        drawn = np.take_along_axis(resampled, seeds, axis=1).mean(axis=1)
        mean = float(balanced_accuracy(confusion.sum(axis=1)).mean())
        if name == BEFORE:
            base, base_drawn = mean, drawn
        total = confusion.sum(axis=(0, 1))
        share = np.diagonal(total) / total.sum(axis=1)
        table[name] = {
            "balanced_accuracy": mean,
            "interval": _interval(drawn),
            "gain": mean - base,
            "gain_interval": _interval(drawn - base_drawn),
            "auroc": float(
                np.mean(
                    [_auroc(judged.label, rows, healthy) for rows in log_probability]
                )
            ),
            "recall": dict(zip(class_names, share.tolist(), strict=True)),
        }
    return table


def _auroc(label: IntArray, log_probability: FloatArray, healthy: int) -> float:
    from sklearn.metrics import roc_auc_score

    return float(roc_auc_score(label != healthy, -log_probability[:, healthy]))


def _interval(values: FloatArray) -> list[float]:
    return [float(value) for value in np.quantile(values, [0.025, 0.975])]


def _task(description: Any, dataset: Dataset) -> Task:
    return task_of(
        dataset,
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        classes=description.class_names,
        channels=description.channel_names,
    )


def _healthy(task: Task, segments: Segments) -> Segments:
    kept_rows = task.labels()[segments.record] == task.class_names.index(HEALTHY)
    return _joined([segments], kept_rows)


def _joined(
    parts: Sequence[Segments], mask: NDArray[np.bool_] | None = None
) -> Segments:
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])[
            ... if mask is None else mask
        ]
        for name in ("record", "start", "stop")
    }
    return Segments(**columns)


def _subset(windows: WindowSet, chosen: IntArray) -> WindowSet:
    return replace(
        windows,
        segment=windows.segment[chosen],
        start=windows.start[chosen],
        label=windows.label[chosen],
        record=windows.record[chosen],
    )


def open_world(
    folder: Path, words: Sequence[str], classes: Sequence[str] = ()
) -> Dataset:
    """The data set of these overrides, made where it is not there yet.

    ``classes`` take the place of those of the words, for instance ``surface_damage`` for
    ``pitting``; none leaves them.
    """
    if classes:
        words = (*words, f"plan.classes=[{','.join(classes)}]")
    return kept(folder, list(words))
