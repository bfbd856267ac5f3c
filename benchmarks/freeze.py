"""Freeze a data set and what was reached on it as a benchmark: ``python -m benchmarks.freeze NAME
DATA REPORT...``.

DATA is the folder of ``gensig generate experiment=NAME``, each REPORT that of a ``diagnose
train`` on it. Writes ``diagnose/frozen/NAME.json``; an existing one is never written again: a
benchmark that changes needs another name.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from diagnose.baselines.base import Role
from diagnose.baselines.registry import baseline_names
from diagnose.studies.baseline_runs import LABEL_SHUFFLE
from diagnose.studies.benchmark import Benchmark, sha256, signal_rms
from diagnose.studies.class_jobs import ORACLE_NETWORK
from diagnose.studies.controls import is_sham
from diagnose.studies.protocol_results import is_leaky
from gensig.dataset.reader import open_dataset

FOLDER = Path(__file__).parents[1] / "diagnose" / "frozen"
N_RECORDS = 20  # whose RMS is kept
DIGITS = 9
CONTROLS = {
    ORACLE_NETWORK,
    *baseline_names(Role.AT_CHANCE, Role.FOLLOWER, Role.BOUND),
}


def freeze(name: str, data: Path, reports: Sequence[Path]) -> Benchmark:
    """The benchmark that a data set and reports on it make."""
    dataset = open_dataset(data)
    results: dict[str, dict[str, dict[str, float]]] = {}
    for report in reports:
        for protocol, methods in _results(report).items():
            results.setdefault(protocol, {}).update(methods)
    chosen = np.linspace(0, dataset.n_records - 1, N_RECORDS).astype(int)
    return Benchmark(
        name=name,
        generator_version=str(dataset.manifest.generator_version),
        plan_sha256=sha256(data / "plan.csv"),
        split_sha256={
            protocol: sha256(data / "splits" / f"{protocol}.csv")
            for protocol in results
        },
        signal_rms={
            str(dataset.column("record_id")[record]): [
                float(f"{v:.{DIGITS}g}") for v in signal_rms(dataset, int(record))
            ]
            for record in chosen
        },
        results=results,
    )


def _results(report: Path) -> dict[str, dict[str, dict[str, float]]]:
    """Balanced accuracy with its interval by clean protocol and method."""
    metrics = json.loads((report / "metrics.json").read_text(encoding="utf-8"))
    return {
        protocol: {
            method: {
                key: round(values["balanced_accuracy"][key], 4)
                for key in ("mean", "low", "high")
            }
            for method, values in result["methods"].items()
            if isinstance(values["balanced_accuracy"], dict)
            and method not in CONTROLS
            and not method.startswith(LABEL_SHUFFLE)
            and not is_sham(method)
        }
        for protocol, result in metrics["protocols"].items()
        if not is_leaky(protocol)
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("name")
    parser.add_argument("data", type=Path)
    parser.add_argument("report", type=Path, nargs="+")
    arguments = parser.parse_args()
    target = FOLDER / f"{arguments.name}.json"
    benchmark = freeze(arguments.name, arguments.data, arguments.report)
    with target.open("x", encoding="utf-8") as file:
        file.write(json.dumps(asdict(benchmark), indent=1) + "\n")
    print(target)


if __name__ == "__main__":
    main()
