"""Scores of predicted remaining lives.

Errors, the PHM 2008 score, horizons and intervals, life by life.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]
EARLY, LATE = 13.0, 10.0  # units of error in which the score grows e-fold, of PHM 2008
UNITS = 125.0  # units of the score in the early level: the cycles at which C-MAPSS studies usually cut
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshots:
    """Test records of lives that failed, with what one trained method says of them.

    Attributes
    ----------
    life : (record,) 0 to n_lives - 1
    true, said : (record,) h, both cut at the early level
    half_width : h, of the interval about what is said
    early_life : h
    """

    life: NDArray[np.integer]
    true: FloatArray
    said: FloatArray
    half_width: float
    early_life: float

    @property
    def low(self) -> FloatArray:
        """(record,) h lower ends of the intervals."""
        return interval(self.said, self.half_width, self.early_life)[0]

    @property
    def high(self) -> FloatArray:
        """(record,) h upper ends."""
        return interval(self.said, self.half_width, self.early_life)[1]


def interval(
    said: FloatArray, half_width: float, early_life: float
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends in h about what is said, (...) each.

    The early level stands for itself and all above it.
    """
    return np.maximum(said - half_width, 0.0), np.minimum(said + half_width, early_life)


def intervals_hold(n_lives: int, coverage: float) -> bool:
    """Whether so many calibration lives are enough for intervals of a coverage, see
    `conformal_half_width`.
    """
    return bool((n_lives + 1) * (1 - coverage) >= 1 - 1e-9)


def phm_score(error: FloatArray, early_life: float) -> FloatArray:
    """Asymmetric score of PHM 2008, (...) for errors (...) in h: exp(-d/13) - 1 if d < 0, else
    exp(d/10) - 1.

    d is what is predicted less what is true, so that d > 0, too late a warning, costs more. The
    score was made for cycles of engines; here its unit is 1/125 of the early level, which is cut
    at 125 cycles in most studies of them.

    Source: Saxena, Goebel, Simon & Eklund (2008), "Damage propagation modeling for aircraft
    engine run-to-failure simulation", International Conference on Prognostics and Health
    Management, in the form of the challenge of that conference. There it is the sum over lives,
    each stopped at one snapshot. The unit is ours.
    """
    d = np.asarray(error, dtype=float) * (UNITS / early_life)
    return np.where(
        d < 0, np.expm1(-np.minimum(d, 0) / EARLY), np.expm1(np.maximum(d, 0) / LATE)
    )


def prognostic_horizon(true: FloatArray, said: FloatArray, band: float) -> float:
    """Remaining life in h from which on everything said of a life stays within ``band`` h of it;
    0 if not at its end.

    Source: Saxena, Celaya, Saha, Saha & Goebel (2010), "Metrics for offline evaluation of
    prognostic performance", International Journal of Prognostics and Health Management 1 (1).
    Their band is a share of the whole life.
    """
    order = np.argsort(true, kind="stable")
    outside = np.abs(said - true)[order] > band
    n_inside = int(np.argmax(outside)) if outside.any() else outside.size
    return float(true[order][n_inside - 1]) if n_inside else 0.0


def conformal_half_width(
    error: FloatArray, life: NDArray[Any], coverage: float
) -> float:
    """Half width of intervals that hold a random snapshot of a new life with at least the
    probability ``coverage``.

    Every calibration life has the same weight 1/(n + 1), shared by its snapshots, and the new
    life the last one at infinity: where n lives are too few, n + 1 < 1/(1 - coverage), the half
    width is infinite.

    Parameters
    ----------
    error : (record,) h absolute errors on lives that took no part in the fit
    life : (record,) which life
    coverage : from 0 to 1

    Source: Lee, Barber & Willett (2023), "Distribution-free inference with hierarchical data",
    arXiv:2306.06342. It assumes lives that are exchangeable with the calibration lives; snapshots
    of one life may be as alike as they are.
    """
    names, place, counts = np.unique(life, return_inverse=True, return_counts=True)
    weight = 1.0 / ((names.size + 1) * counts[place])
    order = np.argsort(error, kind="stable")
    reached = np.cumsum(weight[order]) >= coverage - 1e-9
    return float(error[order][np.argmax(reached)]) if reached.any() else float("inf")


def by_life(snapshots: Snapshots) -> dict[str, NDArray[Any]]:
    """What `MEASURES` are made of, (life,) each.

    Means over the snapshots of a life, squared errors for the RMSE.
    """
    error = snapshots.said - snapshots.true
    inside = (snapshots.low <= snapshots.true) & (snapshots.true <= snapshots.high)
    rows = {
        "rmse_h": error**2,
        "mae_h": np.abs(error),
        "phm_score": phm_score(error, snapshots.early_life),
        "coverage": inside.astype(float),
        "width_h": snapshots.high - snapshots.low,
    }
    counts = np.bincount(snapshots.life)
    found = {
        name: np.bincount(snapshots.life, weights=row) / counts
        for name, row in rows.items()
    }
    last, horizon = np.empty(counts.size), np.empty(counts.size)
    for life in range(counts.size):
        mine = np.flatnonzero(snapshots.life == life)
        before = mine[
            snapshots.true[mine] > 0
        ]  # at the failure itself there is nothing left to predict
        at = before[np.argmin(snapshots.true[before])] if before.size else mine[0]
        last[life] = rows["phm_score"][at]
        band = BAND * snapshots.early_life
        horizon[life] = prognostic_horizon(
            snapshots.true[mine], snapshots.said[mine], band
        )
    return found | {"phm_score_last": last, "horizon_h": horizon}


def life_scores(
    values: Mapping[str, FloatArray], *, n_bootstrap: int, rng: np.random.Generator
) -> dict[str, Any]:
    """Scores with 95 % intervals over lives.

    Parameters
    ----------
    values : measure -> (seed, life) of `by_life`; the same seeds and lives for every measure
    n_bootstrap : resamples, each drawing as many lives as there are, with all their snapshots, and as many seeds
    rng : source of the resamples, the same draws for every measure
    """
    some = next(iter(values.values()))
    lives, seeds = drawn(some.shape[0], some.shape[1], n_bootstrap, rng)
    found = {}
    for name, table in values.items():
        resampled = _over_drawn(name, table, lives, seeds)
        low, high = np.quantile(resampled, [0.025, 0.975])
        mean = float(_finished(name, table.mean(axis=1)).mean())
        found[name] = {"mean": mean, "low": float(low), "high": float(high)}
    return found


def gain(
    values: FloatArray,
    against: FloatArray,
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, float]:
    """RMSE of ``against`` less that of ``values``, (seed, life) squared errors each, in h: above
    0 is better.

    Both on the same resamples of the lives; `low` and `high` are the 95 % interval.
    """
    lives, seeds = drawn(values.shape[0], values.shape[1], n_bootstrap, rng)
    other_seeds = rng.integers(against.shape[0], size=(n_bootstrap, against.shape[0]))
    difference = _over_drawn("rmse_h", against, lives, other_seeds) - _over_drawn(
        "rmse_h", values, lives, seeds
    )
    low, high = np.quantile(difference, [0.025, 0.975])
    mean = np.sqrt(against.mean(axis=1)).mean() - np.sqrt(values.mean(axis=1)).mean()
    return {"mean": float(mean), "low": float(low), "high": float(high)}


def drawn(
    n_seeds: int, n_lives: int, n_bootstrap: int, rng: np.random.Generator
) -> tuple[Any, Any]:
    """How often each life is drawn, (draw, life), and which seeds, (draw, seed).

    Source: percentile interval of Efron & Tibshirani (1993), "An introduction to the bootstrap",
    section 13.3.
    """
    lives = rng.multinomial(n_lives, np.full(n_lives, 1 / n_lives), size=n_bootstrap)
    return lives, rng.integers(n_seeds, size=(n_bootstrap, n_seeds))


def _over_drawn(name: str, table: FloatArray, lives: Any, seeds: Any) -> FloatArray:
    """(draw,) the measure of resampled lives, mean over the seeds drawn."""
    by_seed = _finished(name, lives @ table.T / table.shape[1])
    return np.take_along_axis(by_seed, seeds, axis=1).mean(axis=1)


def _finished(name: str, mean: FloatArray) -> FloatArray:
    return np.sqrt(mean) if name == "rmse_h" else mean
