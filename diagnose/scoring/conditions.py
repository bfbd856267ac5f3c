"""Scores by condition: noise, speed, load, gearbox and all else that varies between records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.groups import Group, groups_of
from diagnose.data.windows import FloatArray, IntArray
from diagnose.scoring.intervals import interval_text, with_interval
from diagnose.scoring.judged import Judged, drawn_scores, score
from diagnose.scoring.machines import CountArray
from gensig.text.amounts import finite

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

BASE_COLUMNS = ("snr_db", "speed_set_rpm", "speed_rpm", "torque_nm", "gearbox_id")
RECORDS_A_GROUP = 20  # fewer say little of four classes
MOST_GROUPS = 5
MOST_NAMES = 12  # more gearboxes than this are units, not a condition to compare
LEAST_A_CLASS = 5  # records of each class that balanced accuracy needs in each group


def condition_columns(dataset: Dataset, record: IntArray) -> dict[str, NDArray[Any]]:
    """Columns of the conditions that differ among the records, (record,) each.

    The parameters of faults, seeds and columns that only repeat an earlier one are left out.
    """
    names = [name for name in BASE_COLUMNS if name in dataset.column_names]
    for name in dataset.column_names:
        is_drawn = name.startswith("params/") and not name.endswith("_seed")
        if is_drawn and not name.startswith("params/fault."):
            names.append(name)
    columns: dict[str, NDArray[Any]] = {}
    for name in names:
        values = np.asarray(dataset.column(name))[record]
        if values.ndim != 1:
            continue
        most = values.size
        if values.dtype.kind in "US":
            most = MOST_NAMES
        elif values.dtype.kind not in "fiu" or not np.isfinite(values).all():
            continue
        if not 2 <= np.unique(values).size <= most:
            continue
        if not any(_same_order(values, known) for known in columns.values()):
            columns[name] = values
    return columns


def by_condition(
    columns: Mapping[str, NDArray[Any]],
    methods: Sequence[Judged],
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Scores of groups of test records, and the groups that are harder for the first method.

    The score is balanced accuracy if every group of a column has `LEAST_A_CLASS` records of each
    class of the test part, else the share of records that are right.

    Parameters
    ----------
    columns : of `condition_columns`
    methods : the network first; the same records in each
    n_bootstrap : resamples of the machines
    rng : source of the resamples

    Returns
    -------
    rows : one a group, with the scores of every method and the difference of the first one from
        the rest
    weakest : names of the groups that are weaker beyond chance, weakest first
    summary : one sentence

    Notes
    -----
    Among many groups one is always the lowest. A group is named only if the upper end of its
    difference from the rest lies below 0. The ends hold for all groups at once.

    The standard error is that of the resamples, and no smaller than that of independent records
    which are as often right as all are. A group that is low by luck shows too small a spread.

    Source: standard error of resampled machines with Student's t of as many degrees of freedom as
    the group has machines (or what is drawn of them), less one, as Cameron, Gelbach & Miller
    (2008), "Bootstrap-based improvements for inference with clustered errors", Review of Economics
    and Statistics 90 (3), discuss for few clusters; Bonferroni's correction over the groups.
    """
    network = methods[0]
    drawn = network.machines.drawn(n_bootstrap, rng)
    rows: list[dict[str, Any]] = []
    tested: list[tuple[dict[str, Any], FloatArray, int]] = []
    n_groups = int(np.clip(network.truth.size // RECORDS_A_GROUP, 1, MOST_GROUPS))
    for column, values in columns.items():
        groups = groups_of(values, most=n_groups)
        if len(groups) < 2:
            continue
        measure = _measure(network.truth, groups)
        for group in groups:
            compared = _compared(column, group, measure, methods, drawn, rng)
            rows.append(compared[0])
            if compared[0]["difference_from_rest"] is not None:
                tested.append(compared)
    for row, differences, n_machines in tested:
        spread = _standard_error(network, row, differences, n_machines)
        factor = _factor(len(tested), n_machines)
        row["difference_at_most"] = row["difference_from_rest"] + factor * spread
    weak = [row for row, *_ in tested if row["difference_at_most"] < 0]
    weak.sort(key=lambda row: row["difference_at_most"])
    return {
        "rows": rows,
        "n_groups_compared": len(tested),
        "weakest": [_group_name(row) for row in weak],
        "summary": _sentence(network.method, weak, len(tested)),
    }


def _compared(
    column: str,
    group: Group,
    measure: str,
    methods: Sequence[Judged],
    drawn: CountArray,
    rng: np.random.Generator,
) -> tuple[dict[str, Any], FloatArray, int]:
    """One group of records against the rest.

    Returns
    -------
    row of ``metrics.json``, (resample,) differences of the first method, group less rest, and the
    groups of machines behind the score of the group
    """
    network = methods[0]
    support = network.of(group.member).support
    values = [
        drawn_scores(method.of(group.member), measure, drawn, rng) for method in methods
    ]
    rest = network.of(~group.member)
    differences = values[0] - drawn_scores(rest, measure, drawn, rng)
    difference = None
    if support.too_few is None and rest.support.too_few is None:
        difference = finite(differences[0])
    row = {
        "column": column,
        "group": group.text,
        "low": group.low,
        "high": group.high,
        "n_records": int(group.member.sum()),
        "n_units": int(np.unique(network.unit[group.member]).size),
        "measure": measure,
        "scores": {
            method.method: with_interval(scores, support)
            for method, scores in zip(methods, values, strict=True)
        },
        "difference_from_rest": difference,
        "difference_at_most": None,
    }
    return row, differences[1:], support.n_groups


def _measure(label: IntArray, groups: Sequence[Group]) -> str:
    """Score that all groups of a column have enough records for."""
    for group in groups:
        for present in np.unique(label):
            if (label[group.member] == present).sum() < LEAST_A_CLASS:
                return "share_right"
    return "balanced_accuracy"


def _standard_error(
    network: Judged, row: Mapping[str, Any], differences: FloatArray, n_groups: int
) -> float:
    """Standard error of the difference between a group and the rest."""
    overall, n_inside = score(network, row["measure"]), row["n_records"]
    n_outside = network.truth.size - n_inside
    of_records = np.sqrt(overall * (1 - overall) * (1 / n_inside + 1 / n_outside))
    spread = np.nanstd(differences)
    of_machines = spread * np.sqrt(n_groups / (n_groups - 1))
    return float(max(of_machines, of_records))


def _factor(n_compared: int, n_groups: int) -> float:
    """Distance of the ends in standard errors, for 95 % confidence in all of them together."""
    from scipy.stats import t

    return float(t.ppf(1 - 0.05 / n_compared, n_groups - 1))


def _sentence(method: str, weak: Sequence[Mapping[str, Any]], n_tested: int) -> str:
    if not n_tested:
        return "Too few test records or machines to compare conditions."
    if not weak:
        return (
            f"No condition stands out: none of {n_tested} groups "
            "scores below the rest beyond chance."
        )
    row, *others = weak
    measure = row["measure"].replace("_", " ")
    also = ""
    if others:
        also = "; also weak: " + ", ".join(_group_name(other) for other in others)
    return (
        f"{method} is weakest at {_group_name(row)}: {measure} "
        f"{interval_text(row['scores'][method])}, "
        f"{-row['difference_from_rest']:.2f} below the rest "
        f"(at least {-row['difference_at_most']:.2f}, with 95 % confidence "
        f"over all {n_tested} groups){also}."
    )


def _group_name(row: Mapping[str, Any]) -> str:
    return f"{row['column']} {row['group']}"


def _same_order(values: NDArray[Any], known: NDArray[Any]) -> bool:
    """True if two columns order the records in the same way, or one of them in reverse."""
    if values.dtype.kind in "US" or known.dtype.kind in "US":
        return False
    correlation = np.corrcoef(values, known)[0, 1]
    return bool(abs(correlation) > 0.999)
