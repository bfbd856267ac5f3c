"""Paired comparison of two methods on the same machines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from diagnose.data.windows import FloatArray
from diagnose.scoring.intervals import too_few_text, with_interval
from diagnose.scoring.judged import Judged, drawn_scores
from diagnose.scoring.metrics import ACCURACY

N_PERMUTATIONS = 9999  # all of them if there are fewer


def compare(
    network: Judged,
    others: Sequence[Judged],
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> list[dict[str, Any]]:
    """Difference of balanced accuracy, network less another method, one row a method.

    The interval is that of resampled machines (the same for both) and seeds. The p-value is that
    of a permutation test: for equal methods, swapping their predictions for all records of a
    machine, or of all machines that share gears or a gearbox, changes nothing. Where machines
    share both, the one with fewer groups is swapped. McNemar's test would treat the records of a
    machine as independent.
    The p-values are those of the trainings at hand, corrected for the number of rows.

    Parameters
    ----------
    network, others : on the same records
    n_bootstrap : resamples of the machines
    rng : source of the resamples and of the permutations

    Source: paired bootstrap as Efron & Tibshirani (1993), section 8.3; permutation test as in
    `scipy.stats.permutation_test`, Ernst (2004), "Permutation methods: a basis for exact
    inference", Statistical Science 19 (4); correction Holm (1979), "A simple sequentially
    rejective multiple test procedure", Scandinavian Journal of Statistics 6 (2).
    """
    drawn, support = network.machines.drawn(n_bootstrap, rng), network.support
    of_network = drawn_scores(network, ACCURACY, drawn, rng)
    rows: list[dict[str, Any]] = []
    for other in others:
        difference = of_network - drawn_scores(other, ACCURACY, drawn, rng)
        rows.append(
            {
                "method": network.method,
                "against": other.method,
                "n_units": network.n_units,
                "n_swapped": support.n_groups,
                "swapped": support.kind,
                "difference": with_interval(difference, support),
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
    """Two-sided p-value of equal balanced accuracy; 1 for a single group of machines.

    Balanced accuracy is a sum over groups (each class counts by its records in the whole test
    part). Swapping two methods in a group therefore changes the sign of the group's part of the
    difference.
    """
    from scipy.stats import permutation_test

    if first.support.n_groups < 2:
        return 1.0
    result = permutation_test(
        (_part_of_group(first), _part_of_group(second)),
        lambda a, b, axis: np.sum(a - b, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=N_PERMUTATIONS,
        rng=rng,
    )
    return float(result.pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values corrected for their number, so that the chance of any false one is kept.

    Source: Holm (1979).
    """
    values = np.asarray(p_values, dtype=float)
    order = np.argsort(values, kind="stable")
    stepped = np.maximum.accumulate(values[order] * np.arange(values.size, 0, -1))
    values[order] = np.minimum(stepped, 1.0)
    return values.tolist()


def _part_of_group(judged: Judged) -> FloatArray:
    """(group,) contribution of each group to the balanced accuracy, mean over the seeds."""
    hits = np.diagonal(judged.confusion(), axis1=-2, axis2=-1).mean(axis=0)
    totals = np.bincount(judged.truth, minlength=hits.shape[1])
    present = totals > 0
    of_unit = (hits[:, present] / totals[present]).sum(axis=1) / present.sum()
    group = judged.machines.coarsest().group
    parts = np.zeros(int(group.max()) + 1)
    np.add.at(parts, group, of_unit)
    return parts


def _sentence(row: dict[str, Any]) -> str:
    mean, low, high = (row["difference"][key] for key in ("mean", "low", "high"))
    methods = f"{row['method']} against {row['against'].replace('_', ' ')}: {mean:+.2f}"
    if low is None:
        reason = too_few_text(row["difference"])
        return f"{methods}; {reason}, so that nothing can be said"
    p_value = f"p = {row['p_value_holm']:.3f}"
    if row["p_value_holm"] < 0.001:
        p_value = "p < 0.001"
    verdict = "not told apart"
    if row["p_value_holm"] < 0.05 and not low <= 0 <= high:
        verdict = "better" if mean > 0 else "worse"
    return (
        f"{methods} [{low:+.2f}, {high:+.2f}] balanced accuracy, "
        f"{p_value} (permutation of {row['n_swapped']} {row['swapped']}, Holm): {verdict}"
    )
