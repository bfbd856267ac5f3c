"""The numbers of ``metrics.json`` as flat CSV files, for spreadsheets and other programs."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]
SCORES = "scores.csv"
BY_CONDITION = "by_condition.csv"
BY_SEVERITY = "by_severity.csv"
LIMITS = "detection_limits.csv"
COMPARISONS = "comparisons.csv"


def write_tables(folder: Path, metrics: Mapping[str, Any]) -> list[str]:
    """Write the CSV files into the folder and return their names; a file that would have no row
    is left out.

    Parameters
    ----------
    folder : exists
    metrics : of `diagnose.studies.study.run_study`
    """
    results = metrics["protocols"]
    answers = {
        name: result["answers"] for name, result in results.items() if result["answers"]
    }
    tables: dict[str, list[dict[str, Any]]] = {
        SCORES: [
            row for name, result in results.items() for row in _score_rows(name, result)
        ],
        BY_CONDITION: [
            row for name, part in answers.items() for row in _condition_rows(name, part)
        ],
        BY_SEVERITY: [
            row for name, part in answers.items() for row in _severity_rows(name, part)
        ],
        LIMITS: [
            row for name, part in answers.items() for row in _limit_rows(name, part)
        ],
        COMPARISONS: [
            {
                "protocol": name,
                **{
                    key: value
                    for key, value in row.items()
                    if key not in ("difference", "summary")
                },
            }
            | _spread("difference", row["difference"])
            for name, part in answers.items()
            for row in part["comparisons"]
        ],
    }
    for name, result in results.items():
        confusion = result["methods"][metrics["model"]]["confusion"]
        tables[f"confusion_{name}.csv"] = [
            {"true": true} | dict(zip(metrics["class_names"], counts, strict=True))
            for true, counts in zip(metrics["class_names"], confusion, strict=True)
        ]
    written = [name for name, rows in tables.items() if rows]
    for name in written:
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(tables[name][0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(tables[name])
    return written


def _score_rows(protocol: str, result: Row) -> Iterable[dict[str, Any]]:
    for method, scores in result["methods"].items():
        for name, value in scores.items():
            if isinstance(value, float):
                value = {"mean": value, "low": None, "high": None}
            if not isinstance(value, Mapping) or "mean" not in value:
                continue
            yield {
                "protocol": protocol,
                "leaky": result["leaky"],
                "method": method,
                "score": name,
                "mean": value["mean"],
                "low": value["low"],
                "high": value["high"],
                "n_seeds": len(value["per_seed"]) if "per_seed" in value else None,
                "n_records": result["n_records"]["test"],
                "n_units": result["n_units"]["test"],
            }


def _condition_rows(protocol: str, answers: Row) -> Iterable[dict[str, Any]]:
    for row in answers["conditions"]["rows"]:
        for method, score in row["scores"].items():
            network = method == answers["network"]
            yield {
                "protocol": protocol,
                "column": row["column"],
                "group": row["group"],
                "group_low": row["low"],
                "group_high": row["high"],
                "method": method,
                "measure": row["measure"],
                **score,
                "n_records": row["n_records"],
                "n_units": row["n_units"],
                "difference_from_rest": row["difference_from_rest"]
                if network
                else None,
                "difference_at_most": row["difference_at_most"] if network else None,
            }


def _severity_rows(protocol: str, answers: Row) -> Iterable[dict[str, Any]]:
    for method, detection in answers.get("detection", {}).items():
        for name, found in detection["classes"].items():
            for row in found["by_severity"]:
                yield {
                    "protocol": protocol,
                    "method": method,
                    "class": name,
                    "severity_low": row["severity_low"],
                    "severity_high": row["severity_high"],
                    **_spread("share_found", row["share_found"]),
                    "share_right_class": row["share_right_class"],
                    "n_records": row["n_records"],
                    "n_units": row["n_units"],
                }


def _limit_rows(protocol: str, answers: Row) -> Iterable[dict[str, Any]]:
    for method, detection in answers.get("detection", {}).items():
        for name, found in detection["classes"].items():
            for row in found["limits"]:
                yield {"protocol": protocol, "method": method, "class": name, **row}


def _spread(name: str, value: Row) -> dict[str, Any]:
    return {
        name: value["mean"],
        f"{name}_low": value["low"],
        f"{name}_high": value["high"],
    }
