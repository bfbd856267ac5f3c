"""A stored network of remaining lives: hours that a machine has left, scores, its graph."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import numpy as np
from numpy.typing import NDArray

from diagnose.data.lives import Lives, kept_segments, lives_of
from diagnose.recordings.followed import SPEED_TOLERANCE
from diagnose.recordings.onnx_export import N_CHECKED
from diagnose.recordings.prepared import PreparedRecording
from diagnose.recordings.source import Source
from diagnose.recordings.stored_network import (
    Answer,
    Graph,
    Scores,
    StoredNetwork,
    reliance,
    require_finite,
)
from diagnose.report.life_report import life_figure
from diagnose.scoring.hours import AGE, LifeFacts, interval
from diagnose.scoring.intervals import spread_text
from diagnose.scoring.judged import BOOTSTRAP_SEED
from diagnose.scoring.life_scores import MEASURES, by_life, life_scores
from diagnose.scoring.predictions import Prediction
from diagnose.studies.life_study import (
    below_bound,
    count_lives,
    judged_lives,
    write_life_predictions,
)
from diagnose.studies.result_files import Content
from diagnose.training.remaining_life import (
    LifeNetwork,
    load_life_model,
    shares_of_records,
    shares_of_windows,
)
from diagnose.training.store import ModelDescription
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import Segments, Task
    from gensig.dataset.reader import Dataset

# Column that a network may take, beside the speed -> its option and its unit.
OPTIONS = {"torque_nm": "--torque-nm", AGE: "--life-time-h"}
UNITS = {"torque_nm": "N m", AGE: "h"}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class StoredLife(StoredNetwork):
    """A network of remaining lives, with the facts of its hours."""

    model: LifeNetwork
    description: ModelDescription
    facts: LifeFacts

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Network of remaining lives of a folder."""
        model, description, facts = load_life_model(folder)
        return cls(model=model, description=description, facts=facts)

    def check(self, source: Source) -> None:
        """Refuse a torque or an age that is missing, not taken or below 0."""
        for name, option in OPTIONS.items():
            value, is_taken = getattr(source, name), name in self.facts.told
            if value is None and is_taken:
                raise ConfigError(
                    f"this model must know {name} of {source.file}: say {option}"
                )
            if value is None:
                continue
            if not is_taken:
                raise ConfigError(
                    f"{option}: {self.facts.method} is not told {name}; leave it out",
                )
            if not 0.0 <= value < float("inf"):
                raise ConfigError(f"{option} {value:g} must be 0 or above")

    def answer(self, source: Source, prepared: PreparedRecording) -> Answer:
        """Remaining life in h, with the interval of its training."""
        facts, speed = self.facts, prepared.speed_rpm
        if speed is None:
            raise ConfigError(
                f"this model must know the speed of {source.file}: say --speed-rpm or --tacho",
            )
        known = {"speed_rpm": speed} | {name: getattr(source, name) for name in OPTIONS}
        values = {name: known[name] for name in facts.told}
        conditions = np.array([list(values.values())], dtype=float)
        by_window = shares_of_windows(self.model, prepared.windows, conditions)
        require_finite(remaining_life=by_window)
        level = facts.early_life_h
        share = float(np.clip(by_window.mean(), 0.0, 1.0))
        low, high = interval(np.array(share * level), facts.half_width_h, level)
        hours = np.clip(by_window, 0.0, 1.0).astype(float) * level
        return Answer(
            record={
                "remaining_life_h": share * level,
                "low_h": float(low),
                "high_h": float(high),
                "at_early_level": share == 1.0,
                "early_life_h": level,
                "coverage": facts.coverage,
                "intervals_hold": facts.intervals_hold,
                "n_calibration_lives": facts.n_calibration_lives,
                "method": facts.method,
            },
            windows=[{"remaining_life_h": value} for value in hours.tolist()],
            conditions={
                "told": values,
                "trained_range": {
                    name: list(facts.told_range[name]) for name in values
                },
            },
            training={"trained_classes": list(self.description.class_names)},
            reasons=_outside(facts, values),
        )

    def line(self, result: Content) -> str:
        """Hours left with their interval, and how far the model can be relied on."""
        level, hours = result["early_life_h"], result["remaining_life_h"]
        left = f"{hours:.3g} h left"
        if result["at_early_level"]:
            left = f"{level:.3g} h or longer"
        text = f"{result['recording']}: {left}"
        if result["intervals_hold"]:
            end = f"{result['high_h']:.3g} h"
            if result["high_h"] >= level:
                end += " or longer"
            text += (
                f", {result['coverage']:.0%} interval {result['low_h']:.3g} to {end}"
            )
        else:
            n_lives = result["n_calibration_lives"]
            text += f"; no interval: {n_lives} validation lives are too few for one"
        return f"{text}; {reliance(result, 'it')}"

    def classes_of(self, dataset: Dataset) -> tuple[str, ...]:
        """Classes of the training that the data set has, at least one."""
        trained = self.description.class_names
        classes = tuple(name for name in trained if name in dataset.class_names)
        if not classes:
            raise DatasetError(
                f"{dataset.folder} does not fit the model: its classes are "
                f"{', '.join(dataset.class_names)}, the model was trained on {', '.join(trained)}"
            )
        return classes

    def scores(self, task: Task, segments: Segments, part: str) -> Scores:
        """Scores by life, with the level and the intervals of the training."""
        facts, dataset, description = self.facts, task.dataset, self.description
        lives = self._lives(task)
        segments = kept_segments(segments, lives.name != "")
        if not lives.failed[segments.record].any():
            raise ConfigError(
                f"{dataset.folder}, {part}: no life failed, so that there is nothing to score",
            )
        columns = [np.asarray(dataset.column(name), dtype=float) for name in facts.told]
        windows = self.inputs().load(task, segments)
        told = np.stack(columns, axis=1)
        record, share = shares_of_records(self.model, windows, told)
        require_finite(remaining_life=share)
        prediction = Prediction(
            protocol=description.protocol,
            method=facts.method,
            seed=description.seed,
            record=record,
            answers=facts.early_life_h * share[:, None],
            detail=part,
            hours=facts,
        )
        judged = judged_lives(task, lives, [prediction])

        def write(folder: Path, result: dict[str, Any]) -> None:
            path = folder / "predictions.csv"
            write_life_predictions(path, task, lives, [prediction])
            life_figure(folder / "remaining_life.png", lives, [prediction])

        return Scores(
            counts={
                "n_records": int(record.size),
                "n_lives": count_lives(lives, record, failed=True),
                "n_lives_censored": count_lives(lives, record, failed=False),
            },
            method={"method": facts.method},
            values={
                "early_life_h": facts.early_life_h,
                "half_width_h": facts.half_width_h,
                "coverage_wanted": facts.coverage,
                "intervals_hold": facts.intervals_hold,
                "censored_below_bound": below_bound(lives, prediction),
                "resampled": judged.machines.counts(),
                **life_scores(
                    by_life(judged, [facts]),
                    machines=judged.machines,
                    n_bootstrap=description.n_bootstrap,
                    rng=np.random.default_rng(BOOTSTRAP_SEED),
                ),
            },
            write=write,
        )

    def _lives(self, task: Task) -> Lives:
        """Lives of a data set, which must have the columns that the network takes."""
        lives, dataset = lives_of(task), task.dataset
        for name in self.facts.told:
            if name not in dataset.column_names:
                raise DatasetError(
                    f"{dataset.folder} does not fit the model, which is told {name}: "
                    "it has no such column"
                )
        return lives

    def lines(self, result: Content) -> list[str]:
        """Part, channels, every measure, and the coverage that was wanted."""
        lives, censored = result["n_lives"], result["n_lives_censored"]
        channels, level = ", ".join(result["channel_names"]), result["early_life_h"]
        lines = [
            f"{result['n_records']} records of {lives} lives that failed "
            f"(and {censored} censored): {result['part']}",
            f"channels {channels}; remaining life cut at {level:.4g} h",
        ]
        for name in MEASURES:
            spread = spread_text(result[name], result["resampled"], ".4g")
            lines.append(f"{name} {result[name]['mean']:.4g}, {spread}")
        wanted = f"coverage wanted {result['coverage_wanted']:.0%}"
        if not result["intervals_hold"]:
            wanted += ": too few validation lives for such intervals"
        return [*lines, wanted]

    def graph(self) -> Graph:
        """Windows in m/s^2 and the columns beside them in, hours out."""
        facts = self.facts
        ranges = {name: list(ends) for name, ends in facts.told_range.items()}
        return Graph(
            answer=lambda model, windows, conditions: model(windows, conditions),
            further={"told": _condition_examples(facts)},
            output="remaining_life_h",
            unit=facts.early_life_h,
            unit_text="the early level",
            agreement="hours within {:.1g} of the early level of torch's",
            facts={
                "told": list(facts.told),
                "told_range": ranges,
                "early_life_h": facts.early_life_h,
                "half_width_h": facts.half_width_h,
                "coverage": facts.coverage,
                "intervals_hold": facts.intervals_hold,
                "record": "mean of remaining_life_h over the windows of a record, cut to "
                "0..early_life_h, which stands for itself and all above; interval: half_width_h "
                "to both sides, cut alike",
            },
        )


def _condition_examples(facts: LifeFacts) -> NDArray[np.float32]:
    """(window, column) within the ranges of the training, as many as examples of windows."""
    ranges = np.array([facts.told_range[name] for name in facts.told])
    low, high = ranges.reshape(-1, 2).T
    share = np.random.default_rng(1).uniform(size=(N_CHECKED, len(facts.told)))
    return (low + share * (high - low)).astype(np.float32)


def _outside(facts: LifeFacts, values: Mapping[str, float]) -> list[str]:
    """Reasons why torque and age are unlike those of the training."""
    reasons = []
    for name in OPTIONS:
        if name not in values:
            continue
        value, unit = values[name], UNITS[name]
        low, high = facts.told_range[name]
        if not low * (1 - SPEED_TOLERANCE) <= value <= high * (1 + SPEED_TOLERANCE):
            reasons.append(
                f"{value:g} {unit} is outside the {low:.4g} to {high:.4g} {unit} of the training"
            )
    return reasons
