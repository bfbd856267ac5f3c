"""Answers of a method beside the truth: the table that scores are functions of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.machines import CountArray, Machines, Support, machines_of
from diagnose.scoring.metrics import (
    MEASURES,
    SCORES,
    over_drawn_seeds,
    recall,
    score_with_interval,
)
from diagnose.scoring.predictions import Prediction

if TYPE_CHECKING:
    from diagnose.data.windows import Task

BOOTSTRAP_SEED, ANSWERS_SEED = 20240607, 20240608


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Answers of one method for records, with the truth.

    Attributes
    ----------
    method : its name
    truth : (record,) class, or h of remaining life
    unit : (record,) 0 to n_units - 1, the unit of each record
    machines : the units of the whole test part
    answers : (seed, record, output) as `diagnose.scoring.predictions.Prediction.answers`; one seed
        for a method without seeds
    """

    method: str
    truth: NDArray[Any]
    unit: IntArray
    machines: Machines
    answers: FloatArray

    @property
    def predicted(self) -> IntArray:
        """(seed, record) the most probable class."""
        return self.answers.argmax(axis=-1)

    @property
    def n_units(self) -> int:
        """Number of units of the whole test part."""
        return self.machines.n_units

    @property
    def support(self) -> Support:
        """Groups of machines behind a score of these records."""
        return self.machines.support(np.unique(self.unit))

    @property
    def n_seeds(self) -> int:
        """Number of trainings."""
        return int(self.answers.shape[0])

    def of(self, records: IntArray | NDArray[np.bool_]) -> Judged:
        """The same method on some of the records, with the same numbers of the units."""
        return replace(
            self,
            truth=self.truth[records],
            unit=self.unit[records],
            answers=self.answers[:, records],
        )

    def confusion(self) -> CountArray:
        """Counts of records, (seed, unit, true class, predicted class)."""
        n_classes = self.answers.shape[-1]
        counts = np.zeros(
            (self.n_seeds, self.n_units, n_classes, n_classes), dtype=np.int64
        )
        for seed, predicted in enumerate(self.predicted):
            np.add.at(counts[seed], (self.unit, self.truth, predicted), 1)
        return counts


def judged_runs(
    task: Task,
    runs: Sequence[Prediction],
    record: IntArray | None = None,
    *,
    further: str | None = None,
    truth: NDArray[Any] | None = None,
) -> Judged:
    """Answers of the trainings of a method for test records.

    Parameters
    ----------
    task : gives classes and machines
    runs : one a seed, of the same records
    record : some of them, sorted; None: all
    further : key of `diagnose.scoring.predictions.Prediction.further`; None: the answers themselves
    truth : (record,) of these; None: their classes
    """
    tables = [run.answers if further is None else run.further[further] for run in runs]
    if record is None:
        record = runs[0].record
    answers = [
        table[np.searchsorted(run.record, record)]
        for table, run in zip(tables, runs, strict=True)
    ]
    return judged_answers(task, runs[0].method, record, np.stack(answers), truth)


def judged_answers(
    task: Task,
    method: str,
    record: IntArray,
    answers: FloatArray,
    truth: NDArray[Any] | None = None,
) -> Judged:
    """Answers (seed, record, output) for records; ``truth`` None: their classes."""
    unit = np.asarray(task.dataset.column("unit_id"))[record]
    if truth is None:
        truth = task.labels()[record]
    return Judged(
        method=method,
        truth=truth,
        unit=np.unique(unit, return_inverse=True)[1],
        machines=machines_of(task.dataset, record),
        answers=answers,
    )


def drawn_scores(
    judged: Judged, measure: str, drawn: CountArray, rng: np.random.Generator
) -> FloatArray:
    """(1 + resample,) score of all machines and seeds, then of resampled ones, see `MEASURES`.

    NaN where a resample draws no record.

    Parameters
    ----------
    judged : the method on the records to score
    measure : key of `MEASURES`
    drawn : (resample, unit) of `diagnose.scoring.machines.Machines.drawn`, the same for all scores
        of a comparison
    rng : draws the seeds
    """
    counts = np.einsum("bu,sutp->bstp", drawn, judged.confusion())
    resampled = over_drawn_seeds(MEASURES[measure](counts), rng)
    return np.concatenate([[score(judged, measure)], resampled])


def score(judged: Judged, measure: str) -> float:
    """Score of `MEASURES`, mean over the seeds."""
    return float(MEASURES[measure](judged.confusion().sum(axis=1)).mean())


def class_scores(
    judged: Judged,
    class_names: Sequence[str],
    n_bootstrap: int,
    *,
    shuffled: bool = False,
) -> dict[str, Any]:
    """Scores of one method with intervals over machines, confusion counts and recall.

    Parameters
    ----------
    n_bootstrap : resamples of the machines
    shuffled : see `diagnose.scoring.metrics.score_with_interval`
    """
    confusion = judged.confusion()
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    scores: dict[str, Any] = {
        name: score_with_interval(
            name,
            confusion,
            n_bootstrap=n_bootstrap,
            rng=rng,
            machines=judged.machines,
            shuffled=shuffled,
        )
        for name in SCORES
    }
    total = confusion.sum(axis=(0, 1))
    shares = zip(class_names, recall(total).tolist(), strict=True)
    scores["confusion"] = total.tolist()
    scores["recall"] = {name: share for name, share in shares if np.isfinite(share)}
    return scores
