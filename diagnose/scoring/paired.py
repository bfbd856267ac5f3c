"""Is one method better than another: both judged on the same units, each unit one witness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.scoring.judged import (
    Judged,
    resampled_score,
    score,
    units_drawn,
    with_interval,
)

FloatArray = NDArray[np.floating]
N_PERMUTATIONS = 9999  # all of them where there are no more


def compare(
    network: Judged,
    others: Sequence[Judged],
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> list[dict[str, Any]]:
    """Difference of balanced accuracy, network less another method, one row a method.

    The interval comes of resampled units (the same for both) and seeds. The p-value is that of a
    permutation test over units: if the two were alike, swapping what they say of all records of a
    unit would change nothing. McNemar's test would count every record as a witness of its own,
    and records of one unit are none. The p-values are of the trainings at hand, corrected for the
    number of rows.

    Parameters
    ----------
    network, others : on the same records
    n_bootstrap : resamples of the units
    rng : source of the resamples and of the permutations

    Source: paired bootstrap as Efron & Tibshirani (1993), section 8.3; permutation test as in
    `scipy.stats.permutation_test`, Ernst (2004), "Permutation methods: a basis for exact
    inference", Statistical Science 19 (4); correction Holm (1979), "A simple sequentially
    rejective multiple test procedure", Scandinavian Journal of Statistics 6 (2).
    """
    drawn = units_drawn(network.n_units, n_bootstrap, rng)
    mine = resampled_score(network, "balanced_accuracy", drawn, rng)
    rows: list[dict[str, Any]] = []
    for other in others:
        difference = score(network, "balanced_accuracy") - score(
            other, "balanced_accuracy"
        )
        resampled = mine - resampled_score(other, "balanced_accuracy", drawn, rng)
        rows.append(
            {
                "method": network.method,
                "against": other.method,
                "n_units": network.n_units,
                "difference": with_interval(difference, resampled, network.n_units),
                "p_value": permutation_p_value(network, other, rng),
            }
        )
    for row, adjusted in zip(rows, holm([row["p_value"] for row in rows]), strict=True):
        row["p_value_holm"] = adjusted
        row["summary"] = _sentence(row)
    return rows


def permutation_p_value(
    first: Judged, second: Judged, rng: np.random.Generator
) -> float:
    """Two-sided p-value that two methods have the same balanced accuracy, by swapping them unit
    by unit.

    Balanced accuracy is a sum over units (each class counts by its records in the whole test
    part), so that swapping two methods in a unit changes the sign of the unit's part of the
    difference. 1 for a single unit.
    """
    from scipy.stats import permutation_test

    if first.n_units < 2:
        return 1.0
    parts = (_part_of_unit(first), _part_of_unit(second))
    result = permutation_test(
        parts,
        lambda a, b, axis: np.sum(a - b, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=N_PERMUTATIONS,
        rng=rng,
    )
    return float(result.pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """The same p-values, corrected so that the chance of any false finding among them is kept.

    Source: Holm (1979).
    """
    values = np.asarray(p_values, dtype=float)
    order = np.argsort(values, kind="stable")
    stepped = np.maximum.accumulate(values[order] * np.arange(values.size, 0, -1))
    adjusted = np.empty_like(values)
    adjusted[order] = np.minimum(stepped, 1.0)
    return [float(value) for value in adjusted]


def _part_of_unit(judged: Judged) -> FloatArray:
    """(unit,) what each unit adds to the balanced accuracy, mean over the seeds."""
    hits = np.diagonal(judged.confusion(), axis1=-2, axis2=-1).mean(axis=0)
    totals = np.bincount(judged.label, minlength=hits.shape[1])
    present = totals > 0
    return (hits[:, present] / totals[present]).sum(axis=1) / present.sum()


def _sentence(row: dict[str, Any]) -> str:
    difference = row["difference"]
    what = f"{row['method']} against {row['against'].replace('_', ' ')}: {difference['mean']:+.2f}"
    if difference["low"] is None:
        return f"{what}; one unit shows no spread, so that nothing can be said"
    sure = (
        row["p_value_holm"] < 0.05 and not difference["low"] <= 0 <= difference["high"]
    )
    p_value = (
        "p < 0.001" if row["p_value_holm"] < 0.001 else f"p = {row['p_value_holm']:.3f}"
    )
    verdict = (
        ("better" if difference["mean"] > 0 else "worse") if sure else "not told apart"
    )
    return (
        f"{what} [{difference['low']:+.2f}, {difference['high']:+.2f}] balanced accuracy, "
        f"{p_value} (permutation of {row['n_units']} units, Holm): {verdict}"
    )
