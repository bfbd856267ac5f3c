"""Scores of a user's predictions on the split of a data set, and those of a frozen benchmark."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import Task, subset_segments, task_of
from diagnose.scoring.intervals import interval_text
from diagnose.scoring.judged import class_scores, judged_runs
from diagnose.scoring.predictions import Prediction
from diagnose.studies.counts import n_different
from diagnose.studies.protocol_results import is_leaky
from diagnose.studies.result_files import Content, Entry, sha256
from gensig.dataset.folder.layout import PLAN, SPLITS
from gensig.errors import ConfigError, DatasetError
from gensig.text.csv_tables import read_rows
from gensig.text.markdown import table_lines
from gensig.text.user_file import open_table

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

N_BOOTSTRAP = 2000
REQUIRED = ("record_id", "predicted")
RTOL = 1e-6  # between processors; the signals have 24 bits
LARGEST_FILE = 200_000_000  # bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """A frozen data set: digests that identify it, and results that were reached on it.

    Attributes
    ----------
    name : of the benchmark
    generator_version : version of gensig that made it when it was frozen
    plan_sha256 : of plan.csv
    split_sha256 : protocol -> digest of splits/PROTOCOL.csv
    signal_rms : record_id -> (channel,) m/s^2, of some records; other noise as strong changes its
        fourth digit
    results : protocol -> method -> balanced accuracy with its interval, or one number
    """

    name: str
    generator_version: str
    plan_sha256: str
    split_sha256: Mapping[str, str]
    signal_rms: Mapping[str, Sequence[float]]
    results: Mapping[str, Content]

    def differences(self, dataset: Dataset) -> list[str]:
        """Differences of a data set with this plan from the benchmark, one line each."""
        lines = []
        for protocol, expected in self.split_sha256.items():
            path = dataset.folder / SPLITS / f"{protocol}.csv"
            if not path.is_file() or sha256(path) != expected:
                lines.append(f"its split {protocol} is another one")
        if n_failed := int(np.sum(~np.asarray(dataset.usable, dtype=bool))):
            return [*lines, f"{n_failed} of its records are missing or failed"]
        for record, name in enumerate(dataset.column("record_id")):
            values = self.signal_rms.get(str(name))
            if values is None:
                continue
            if not np.allclose(signal_rms(dataset, record), values, rtol=RTOL, atol=0):
                version = self.generator_version
                return [*lines, f"its signals are not those that gensig {version} made"]
        return lines


def signal_rms(dataset: Dataset, record: int) -> NDArray[np.floating]:
    """(channel,) RMS of a record in m/s^2."""
    return np.sqrt(np.mean(np.square(dataset.signals(record), dtype=float), axis=-1))


def benchmark_of(dataset: Dataset) -> Benchmark | None:
    """The frozen benchmark that has this data set's plan, None for every other data set.

    Of several with the same plan, such as those of other methods of integration, the one that
    the signals differ from least.
    """
    digest = sha256(dataset.folder / PLAN)
    same = [each for each in frozen_benchmarks() if each.plan_sha256 == digest]
    return min(same, key=lambda each: len(each.differences(dataset)), default=None)


def frozen_benchmarks() -> list[Benchmark]:
    """All frozen benchmarks, by name."""
    folder = files("diagnose").joinpath("frozen")
    texts = {
        entry.name: entry.read_text(encoding="utf-8")
        for entry in folder.iterdir()
        if entry.name.endswith(".json")
    }
    return [Benchmark(**json.loads(texts[name])) for name in sorted(texts)]


def score_file(dataset: Dataset, path: Path, *, protocol: str | None = None) -> Entry:
    """Score the predictions of a CSV file on the test parts of the data set's splits.

    Parameters
    ----------
    dataset : open data set
    path : CSV with the columns record_id and predicted (a class name), and optional columns
        protocol, method and seed. For each of these the file names every test record once
    protocol : of files without that column; ``by_unit`` where None

    Returns
    -------
    plain dictionary: `scores` by protocol and method, `chance` by protocol, `benchmark` (name,
    differences, results) or None

    Raises
    ------
    DatasetError    for a file that cannot be read, or lacks or repeats a test record
    ConfigError    for a class or protocol that does not exist, or a leaky protocol
    """
    task = task_of(dataset, window_samples=1, stride_samples=1, normalise="none")
    scores: dict[str, Entry] = {}
    chance: dict[str, float] = {}
    for (name, method), runs in _runs(task, path, protocol).items():
        judged = judged_runs(task, runs)
        chance[name] = 1 / n_different(judged.truth)
        scores.setdefault(name, {})[method] = {
            **class_scores(judged, task.class_names, N_BOOTSTRAP),
            "n_records": int(judged.truth.size),
            "n_seeds": len(runs),
        }
    return {
        "data": str(dataset.folder),
        "scores": scores,
        "chance": chance,
        "benchmark": _comparison(dataset, list(scores)),
    }


def _comparison(dataset: Dataset, protocols: Sequence[str]) -> Entry | None:
    """Frozen benchmark of a data set, with results only where nothing differs; None without."""
    frozen = benchmark_of(dataset)
    if frozen is None:
        return None
    differences = frozen.differences(dataset)
    results: Entry = {}
    if not differences:
        results = {name: frozen.results.get(name, {}) for name in protocols}
    return {"name": frozen.name, "differences": differences, "results": results}


def _runs(
    task: Task, path: Path, protocol: str | None
) -> dict[tuple[str, str], list[Prediction]]:
    """(protocol, method) -> for each seed the predictions for the test part."""
    runs: dict[tuple[str, str], list[Prediction]] = {}
    one_hot = np.eye(len(task.class_names))
    for (name, method, seed), labels in _labels(task, path, protocol).items():
        if is_leaky(name):
            continue
        expected = np.unique(subset_segments(task, name, "test").record)
        missing = set(expected.tolist()) - set(labels)
        others = set(labels) - set(expected.tolist())
        if missing or others:
            raise DatasetError(
                f"{path}: {method}, seed {seed} must name each of the {expected.size} test "
                f"records of {name} once; {len(missing)} are missing, "
                f"{len(others)} are not of the test part"
            )
        predicted = [labels[record] for record in expected.tolist()]
        run = Prediction(
            protocol=name,
            method=method,
            seed=len(runs.get((name, method), [])),
            record=expected,
            answers=one_hot[predicted],
            detail=seed,
        )
        runs.setdefault((name, method), []).append(run)
    if not runs:
        raise ConfigError(
            f"{path} holds predictions of leaky protocols only: those are no results"
        )
    return runs


def _labels(
    task: Task, path: Path, protocol: str | None
) -> dict[tuple[str, str, str], dict[int, int]]:
    """(protocol, method, seed) -> predicted label of each record that the file names."""
    number_of = {
        str(name): index for index, name in enumerate(task.dataset.column("record_id"))
    }
    class_of = {name: index for index, name in enumerate(task.class_names)}
    result: dict[tuple[str, str, str], dict[int, int]] = {}
    for line, row in enumerate(_rows(path), start=2):
        key = (
            row.get("protocol") or protocol or "by_unit",
            row.get("method") or path.stem,
            row.get("seed") or "0",
        )
        name, predicted, where = (
            row["record_id"],
            row["predicted"],
            f"{path} line {line}",
        )
        if name not in number_of:
            raise DatasetError(f"{where}: the data set has no record {name!r}")
        if predicted not in class_of:
            known = ", ".join(class_of)
            raise ConfigError(
                f"{where}: there is no class {predicted!r}; there is {known}"
            )
        labels = result.setdefault(key, {})
        if number_of[name] in labels:
            raise DatasetError(f"{where}: record {name} twice for {', '.join(key)}")
        labels[number_of[name]] = class_of[predicted]
    return result


def _rows(path: Path) -> list[dict[str, str]]:
    """Rows of the file; refuses one that is no CSV with the required columns."""
    try:
        with open_table(str(path), path, most_bytes=LARGEST_FILE) as file:
            names, *cells = [row for row in read_rows(file) if row] or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f"{path} is no CSV file in UTF-8: {error}") from None
    for name in REQUIRED:
        if name not in names:
            raise DatasetError(
                f"{path} has no column {name}; it needs {' and '.join(REQUIRED)}"
            )
    if not cells:
        raise DatasetError(f"{path} has no rows")
    if any(len(row) != len(names) for row in cells):
        raise DatasetError(f"{path}: its rows have not all as many cells as its head")
    return [dict(zip(names, row, strict=True)) for row in cells]


def score_table(result: Content) -> list[str]:
    """Markdown table: a row for each protocol and method, those of the benchmark marked."""
    cells = []
    shipped = (result["benchmark"] or {"results": {}})["results"]
    for protocol, methods in result["scores"].items():
        rows = {name: score["balanced_accuracy"] for name, score in methods.items()}
        for name, score in shipped.get(protocol, {}).items():
            rows[f"{name} (shipped)"] = score
        chance = f"{result['chance'][protocol]:.3f}"
        for name, score in rows.items():
            cells.append((protocol, name, interval_text(score, ".3f"), chance))
    return table_lines(("protocol", "method", "balanced accuracy", "chance"), cells)
