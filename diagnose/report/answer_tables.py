"""Numbers of ``metrics.json`` as flat CSV files, for spreadsheets and other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from diagnose.studies.result_files import Content, Entry, write_rows

SCORES = "scores.csv"
BY_CONDITION = "by_condition.csv"
BY_SEVERITY = "by_severity.csv"
LIMITS = "detection_limits.csv"
COMPARISONS = "comparisons.csv"


def write_tables(folder: Path, metrics: Content) -> list[str]:
    """Write the CSV files into the folder and return their names.

    A file that would have no row is left out.

    Parameters
    ----------
    folder : exists
    metrics : of `diagnose.studies.study.run_study`
    """
    names = metrics["class_names"]
    tables: dict[str, list[Content]] = {
        SCORES: [],
        **{name: [] for name in ANSWER_ROWS},
    }
    for protocol, result in metrics["protocols"].items():
        first = {"protocol": protocol}
        tables[SCORES] += [first | row for row in _score_rows(result)]
        if result["answers"]:
            for name, rows in ANSWER_ROWS.items():
                tables[name] += [first | row for row in rows(result["answers"])]
        confusion = result["methods"][metrics["model"]]["confusion"]
        tables[f"confusion_{protocol}.csv"] = [
            {"true": true} | dict(zip(names, counts, strict=True))
            for true, counts in zip(names, confusion, strict=True)
        ]
    written = [name for name, rows in tables.items() if rows]
    for name in written:
        write_rows(folder / name, tables[name])
    return written


def _score_rows(result: Content) -> Iterator[Entry]:
    for method, scores in result["methods"].items():
        for name, score in scores.items():
            if isinstance(score, float):
                score = {"mean": score, "low": None, "high": None}
            if not isinstance(score, Mapping) or "mean" not in score:
                continue
            yield {
                "leaky": result["leaky"],
                "method": method,
                "score": name,
                "mean": score["mean"],
                "low": score["low"],
                "high": score["high"],
                "n_seeds": len(score.get("per_seed", ())) or None,
                "n_records": result["n_records"]["test"],
                "n_units": result["n_units"]["test"],
            }


def _condition_rows(answers: Content) -> Iterator[Entry]:
    for row in answers["conditions"]["rows"]:
        difference = _chosen(row, "difference_from_rest", "difference_at_most")
        for method, score in row["scores"].items():
            if method != answers["network"]:
                difference = dict.fromkeys(difference)
            yield {
                **_chosen(row, "column", "group"),
                "group_low": row["low"],
                "group_high": row["high"],
                "method": method,
                "measure": row["measure"],
                **_chosen(score, "mean", "low", "high"),
                **_chosen(row, "n_records", "n_units"),
                **difference,
            }


def _class_rows(answers: Content, key: str) -> Iterator[tuple[Entry, Content]]:
    """Method and class, and each entry of a list of ``detection``."""
    for method, detection in answers.get("detection", {}).items():
        for name, result in detection["classes"].items():
            for row in result[key]:
                yield {"method": method, "class": name}, row


def _severity_rows(answers: Content) -> Iterator[Entry]:
    for first, row in _class_rows(answers, "by_severity"):
        yield {
            **first,
            **_chosen(row, "severity_low", "severity_high"),
            **_spread("share_found", row),
            **_chosen(row, "share_right_class", "n_records", "n_units"),
        }


def _limit_rows(answers: Content) -> Iterator[Entry]:
    for first, row in _class_rows(answers, "limits"):
        yield {**first, **row}


def _comparison_rows(answers: Content) -> Iterator[Entry]:
    for row in answers["comparisons"]:
        others = [key for key in row if key not in ("difference", "summary")]
        yield _chosen(row, *others) | _spread("difference", row)


def _chosen(row: Content, *keys: str) -> Entry:
    return {key: row[key] for key in keys}


def _spread(name: str, row: Content) -> Entry:
    """Mean and interval of a score as columns."""
    score = row[name]
    return {
        name: score["mean"],
        f"{name}_low": score["low"],
        f"{name}_high": score["high"],
    }


# File -> rows of the answers of a protocol.
ANSWER_ROWS: dict[str, Callable[[Content], Iterator[Entry]]] = {
    BY_CONDITION: _condition_rows,
    BY_SEVERITY: _severity_rows,
    LIMITS: _limit_rows,
    COMPARISONS: _comparison_rows,
}
