"""Scores of predicted remaining lives: errors, PHM 2008 score, horizons and intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import FloatArray
from diagnose.scoring.hours import LifeFacts, interval
from diagnose.scoring.intervals import Interval, with_interval
from diagnose.scoring.judged import Judged
from diagnose.scoring.machines import Machines
from diagnose.scoring.metrics import ratio

EARLY, LATE = 13.0, 10.0  # units of error in which the score grows e-fold, of PHM 2008
UNITS = 125.0  # of the score in the early level: cycles at which C-MAPSS studies usually cut
BAND = (
    0.2  # of the early level, about the true remaining life, for the horizon; assumed
)
MEASURES = (
    "rmse_h",
    "mae_h",
    "phm_score",
    "phm_score_last",
    "coverage",
    "width_h",
    "horizon_h",
)


def phm_score(error: FloatArray, early_life: float) -> FloatArray:
    """Asymmetric score of PHM 2008: exp(-d/13) - 1 if d < 0, else exp(d/10) - 1.

    d is the error (...) in h, predicted less true, so that d > 0, too late a warning, costs more.
    The score was made for cycles of engines. Here its unit is 1/125 of the early level, which is
    125 cycles in most studies of them.

    Source: Saxena, Goebel, Simon & Eklund (2008), "Damage propagation modeling for aircraft
    engine run-to-failure simulation", International Conference on Prognostics and Health
    Management, in the form of the challenge of that conference. There it is the sum over lives,
    each stopped at one snapshot. The unit is ours.
    """
    d = np.asarray(error, dtype=float) * (UNITS / early_life)
    too_early, too_late = np.minimum(d, 0), np.maximum(d, 0)
    return np.where(d < 0, np.expm1(-too_early / EARLY), np.expm1(too_late / LATE))


def prognostic_horizon(true: FloatArray, predicted: FloatArray, band: float) -> float:
    """Remaining life in h from which on all predictions stay within ``band`` h; 0 if none do.

    Source: Saxena, Celaya, Saha, Saha & Goebel (2010), "Metrics for offline evaluation of
    prognostic performance", International Journal of Prognostics and Health Management 1 (1).
    Their band is a share of the whole life.
    """
    order = np.argsort(true, kind="stable")
    true, predicted = true[order], predicted[order]
    inside = np.logical_and.accumulate(np.abs(predicted - true) <= band)
    return float(max(true[inside], default=0.0))


def conformal_half_width(
    error: FloatArray, life: NDArray[Any], coverage: float
) -> float:
    """Half width of intervals that hold a random snapshot of a new life at least with a
    probability.

    Every calibration life has the same weight 1/(n + 1), shared by its snapshots. The new life
    has the last weight, at infinity: for too few lives, n + 1 < 1/(1 - coverage), the half width
    is infinite.

    Parameters
    ----------
    error : (record,) h absolute errors on lives that took no part in the fit
    life : (record,) name of the life
    coverage : the probability, from 0 to 1

    Source: Lee, Barber & Willett (2023), "Distribution-free inference with hierarchical data",
    arXiv:2306.06342. It assumes lives that are exchangeable with the calibration lives; snapshots
    of one life may be arbitrarily similar.
    """
    names, position, counts = np.unique(life, return_inverse=True, return_counts=True)
    weight = 1.0 / ((names.size + 1) * counts[position])
    order = np.argsort(error, kind="stable")
    reached = np.cumsum(weight[order]) >= coverage - 1e-9
    return float(min(error[order][reached], default=np.inf))


def by_life(judged: Judged, hours: Sequence[LifeFacts]) -> dict[str, NDArray[Any]]:
    """Values (seed, life) behind each of `MEASURES`: means over the snapshots of a life.

    For the RMSE they are mean squared errors.

    Parameters
    ----------
    judged : snapshots of lives that failed, true and predicted h cut at the early level
    hours : of each training
    """
    rows = [
        _by_life(judged.unit, judged.truth, said, facts)
        for said, facts in zip(judged.answers[..., 0], hours, strict=True)
    ]
    return {measure: np.stack([row[measure] for row in rows]) for measure in rows[0]}


def _by_life(
    unit: NDArray[np.integer], true: FloatArray, said: FloatArray, facts: LifeFacts
) -> dict[str, NDArray[Any]]:
    """Values (life,) of one training."""
    level, error = facts.early_life_h, said - true
    low, high = interval(said, facts.half_width_h, level)
    rows = {
        "rmse_h": error**2,
        "mae_h": np.abs(error),
        "phm_score": phm_score(error, level),
        "coverage": ((low <= true) & (true <= high)).astype(float),
        "width_h": high - low,
    }
    counts = np.bincount(unit)
    last, horizon = np.empty(counts.size), np.empty(counts.size)
    for life in range(counts.size):
        member = unit == life
        # at the failure itself there is nothing left to predict
        nearest = np.argmin(np.where(true[member] > 0, true[member], np.inf))
        last[life] = rows["phm_score"][member][nearest]
        horizon[life] = prognostic_horizon(true[member], said[member], BAND * level)
    means = {
        name: np.bincount(unit, weights=row) / counts for name, row in rows.items()
    }
    return means | {"phm_score_last": last, "horizon_h": horizon}


def life_scores(
    values: Mapping[str, FloatArray],
    *,
    machines: Machines,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Scores with 95 % intervals over lives, or over what their machines share.

    Parameters
    ----------
    values : measure -> (seed, life) of `by_life`; the same seeds and lives for every measure
    machines : of the lives
    n_bootstrap : resamples of the lives, with all their snapshots, and of the seeds
    rng : source of the resamples, the same draws for every measure
    """
    n_seeds = next(iter(values.values())).shape[0]
    lives, seeds = drawn(n_seeds, machines, n_bootstrap, rng)
    scores = {}
    for name, table in values.items():
        drawn_means = _over_drawn(name, table, lives, seeds)
        scores[name] = with_interval(drawn_means, machines.support(), "linear")
    return scores


def gain(
    values: FloatArray,
    against: FloatArray,
    *,
    machines: Machines,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> Interval:
    """RMSE of ``against`` less that of ``values``, in h: above 0 is better.

    Both are (seed, life) squared errors, scored on the same resamples of the lives. `low` and
    `high` are the 95 % interval.
    """
    lives, seeds = drawn(values.shape[0], machines, n_bootstrap, rng)
    other_seeds = rng.integers(against.shape[0], size=(n_bootstrap, against.shape[0]))
    of_other = _over_drawn("rmse_h", against, lives, other_seeds)
    of_values = _over_drawn("rmse_h", values, lives, seeds)
    return with_interval(of_other - of_values, machines.support(), "linear")


def drawn(
    n_seeds: int, machines: Machines, n_bootstrap: int, rng: np.random.Generator
) -> tuple[Any, Any]:
    """Counts of each life in each resample, (draw, life), and drawn seeds, (draw, seed).

    Source: percentile interval of Efron & Tibshirani (1993), "An introduction to the bootstrap",
    section 13.3.
    """
    lives = machines.drawn(n_bootstrap, rng)
    return lives, rng.integers(n_seeds, size=(n_bootstrap, n_seeds))


def _over_drawn(name: str, table: FloatArray, lives: Any, seeds: Any) -> FloatArray:
    """(1 + draw,) the measure of all lives and seeds, then of those drawn."""
    means = ratio(lives @ table.T, lives.sum(axis=1, keepdims=True))
    resampled = np.take_along_axis(_finished(name, means), seeds, axis=1).mean(axis=1)
    mean = _finished(name, table.mean(axis=1)).mean()
    return np.concatenate([[mean], resampled])


def _finished(name: str, mean: FloatArray) -> FloatArray:
    if name == "rmse_h":
        return np.sqrt(mean)
    return mean
