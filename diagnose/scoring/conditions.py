"""Which condition fails.

Scores against noise, speed, load, gearbox and whatever else varies from record to record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.groups import Group, groups_of
from diagnose.scoring.judged import (
    Judged,
    finite,
    interval_text,
    resampled_score,
    score,
    units_drawn,
    with_interval,
)

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

BASE_COLUMNS = ("snr_db", "speed_set_rpm", "speed_rpm", "torque_nm", "gearbox_id")
RECORDS_A_GROUP = 20  # fewer say little of four classes
MOST_GROUPS = 5
MOST_NAMES = 12  # more gearboxes than this are units, not a condition to compare
LEAST_A_CLASS = 5  # records of each class that balanced accuracy needs in each group
LEAST_UNITS_TESTED = (
    4  # on both sides of a comparison; the spread of fewer is guesswork
)


def condition_columns(
    dataset: Dataset, record: NDArray[np.integer]
) -> dict[str, NDArray[Any]]:
    """Columns that say under which condition a record was taken and differ among the records,
    (record,) each.

    The parameters of faults, seeds and columns that only repeat an earlier one are left out.
    """
    drawn = [
        name
        for name in dataset.column_names
        if name.startswith("params/")
        and not name.startswith("params/fault.")
        and not name.endswith("_seed")
    ]
    columns: dict[str, NDArray[Any]] = {}
    for name in [
        known for known in BASE_COLUMNS if known in dataset.column_names
    ] + drawn:
        values = np.asarray(dataset.column(name))[record]
        is_name = values.dtype.kind in "US"
        if values.ndim != 1 or not (
            is_name or (values.dtype.kind in "fiu" and np.isfinite(values).all())
        ):
            continue
        different = np.unique(values).size
        if (
            different < 2
            or (is_name and different > MOST_NAMES)
            or any(_repeats(values, k) for k in columns.values())
        ):
            continue
        columns[name] = values
    return columns


def by_condition(
    columns: Mapping[str, NDArray[Any]],
    methods: Sequence[Judged],
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Scores of groups of test records, and the groups that the first method finds harder than
    the rest.

    Balanced accuracy where every group of a column has `LEAST_A_CLASS` records of each class of
    the test part, else the share of records that are right.

    Parameters
    ----------
    columns : of `condition_columns`
    methods : the network first; the same records in each
    n_bootstrap : resamples of the units
    rng : source of the resamples

    Returns
    -------
    rows : one a group, with the scores of every method and, of the first one, its difference from the rest
    weakest : names of the groups that are weaker beyond chance, weakest first
    summary : one sentence

    Notes
    -----
    Looking at many groups, one is always the lowest. A group is named only if the upper end of its difference from the
    rest lies below 0, where the ends hold for all the groups at once.

    The standard error is that of the resamples, and no smaller than that of independent records
    which are as often right as all are: a group that is low by luck shows too small a spread of
    its own.

    Source: standard error of resampled units with Student's t of as many degrees of freedom as
    the group has units, less one, as Cameron, Gelbach & Miller (2008), "Bootstrap-based
    improvements for inference with clustered errors", Review of Economics and Statistics 90 (3),
    discuss for few clusters; Bonferroni's correction over the groups.
    """
    network = methods[0]
    drawn = units_drawn(network.n_units, n_bootstrap, rng)
    rows: list[dict[str, Any]] = []
    differences: list[NDArray[np.floating]] = []
    n_groups = int(np.clip(network.label.size // RECORDS_A_GROUP, 1, MOST_GROUPS))
    for column, values in columns.items():
        groups = groups_of(values, most=n_groups)
        if len(groups) < 2:
            continue
        measure = _measure(network.label, groups)
        for group in groups:
            row, resampled = _row(column, group, measure, methods, drawn, rng)
            rows.append(row)
            differences.append(resampled)
    tested = [
        index
        for index, row in enumerate(rows)
        if row["difference_from_rest"] is not None
    ]
    for index in tested:
        row = rows[index]
        overall = score(network, row["measure"])
        spread = _spread(
            differences[index],
            overall,
            row["n_records"],
            network.label.size,
            row["n_units"],
        )
        row["difference_at_most"] = (
            row["difference_from_rest"] + _factor(len(tested), row["n_units"]) * spread
        )
    weak = [
        row
        for row in rows
        if row["difference_at_most"] is not None and row["difference_at_most"] < 0
    ]
    weak.sort(key=lambda row: row["difference_at_most"])
    return {
        "rows": rows,
        "n_groups_compared": len(tested),
        "weakest": [f"{row['column']} {row['group']}" for row in weak],
        "summary": _sentence(network.method, weak, len(tested)),
    }


def _row(
    column: str,
    group: Group,
    measure: str,
    methods: Sequence[Judged],
    drawn: NDArray[np.int64],
    rng: np.random.Generator,
) -> tuple[dict[str, Any], NDArray[np.floating]]:
    """Row of one group, and the resampled differences of the first method from the rest."""
    scores, inside = {}, []
    n_units = int(np.unique(methods[0].unit[group.member]).size)
    for method in methods:
        part = method.of(group.member)
        inside.append(resampled_score(part, measure, drawn, rng))
        scores[method.method] = with_interval(score(part, measure), inside[-1], n_units)
    rest = methods[0].of(~group.member)
    differences = inside[0] - resampled_score(rest, measure, drawn, rng)
    enough = min(n_units, np.unique(rest.unit).size) >= LEAST_UNITS_TESTED
    difference = score(methods[0].of(group.member), measure) - score(rest, measure)
    row = {
        "column": column,
        "group": group.text,
        "low": group.low,
        "high": group.high,
        "n_records": int(group.member.sum()),
        "n_units": n_units,
        "measure": measure,
        "scores": scores,
        "difference_from_rest": finite(difference) if enough else None,
        "difference_at_most": None,
    }
    return row, differences


def _measure(label: NDArray[np.integer], groups: Sequence[Group]) -> str:
    present = np.unique(label)
    fewest = min(
        int((label[group.member] == name).sum()) for group in groups for name in present
    )
    return "balanced_accuracy" if fewest >= LEAST_A_CLASS else "share_right"


def _spread(
    differences: NDArray[np.floating],
    overall: float,
    n_inside: int,
    n_records: int,
    n_units: int,
) -> float:
    """Standard error of a difference between a group and the rest."""
    of_records = np.sqrt(
        overall * (1 - overall) * (1 / n_inside + 1 / (n_records - n_inside))
    )
    return float(
        max(np.nanstd(differences) * np.sqrt(n_units / (n_units - 1)), of_records)
    )


def _factor(n_compared: int, n_units: int) -> float:
    """How many standard errors the ends are off, so that all hold together with 95 % confidence."""
    from scipy.stats import t

    return float(t.ppf(1 - 0.05 / n_compared, n_units - 1))


def _sentence(method: str, weak: Sequence[Mapping[str, Any]], n_tested: int) -> str:
    if not n_tested:
        return "Too few test records or units to compare conditions."
    if not weak:
        return f"No condition stands out: none of {n_tested} groups scores below the rest beyond chance."
    row = weak[0]
    measure = row["measure"].replace("_", " ")
    others = (
        "; also weak: " + ", ".join(f"{o['column']} {o['group']}" for o in weak[1:])
        if weak[1:]
        else ""
    )
    return (
        f"{method} is weakest at {row['column']} {row['group']}: {measure} {interval_text(row['scores'][method])}, "
        f"{-row['difference_from_rest']:.2f} below the rest (at least {-row['difference_at_most']:.2f}, with 95 % "
        f"confidence over all {n_tested} groups){others}."
    )


def _repeats(values: NDArray[Any], known: NDArray[Any]) -> bool:
    """Whether two columns order the records alike, or one of them in reverse."""
    if values.dtype.kind in "US" or known.dtype.kind in "US":
        return False
    correlation = np.corrcoef(values, known)[0, 1]
    return bool(abs(correlation) > 0.999)
