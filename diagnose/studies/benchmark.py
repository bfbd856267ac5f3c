"""Scores of somebody's predictions on a data set's own split, beside the frozen results where it
is a benchmark.
"""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import Task, subset_segments, task_of
from diagnose.scoring.judged import interval_text
from diagnose.studies.study import is_leaky, score_predictions
from gensig.dataset.folder.layout import PLAN, SPLITS
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

N_BOOTSTRAP = 2000
REQUIRED = ("record_id", "predicted")
RTOL = 1e-6  # between processors; the signals have 24 bits
LARGEST_FILE = 200_000_000  # bytes

Run = tuple[NDArray[np.integer], NDArray[np.integer]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """A frozen data set: what identifies it, whichever version made it, and what was reached on it.

    Parameters
    ----------
    name : str
    generator_version : str               version of gensig that made it when it was frozen
    plan_sha256 : str                     of plan.csv
    split_sha256 : protocol -> str        of splits/PROTOCOL.csv
    signal_rms : record_id -> (channel,)  m/s^2, of some records; other noise as strong changes its fourth digit
    results : protocol -> method -> balanced accuracy with its interval, or one number
    """

    name: str
    generator_version: str
    plan_sha256: str
    split_sha256: Mapping[str, str]
    signal_rms: Mapping[str, Sequence[float]]
    results: Mapping[str, Mapping[str, Any]]

    def differences(self, dataset: Dataset) -> list[str]:
        """What a data set with this plan has otherwise than the benchmark, one line each."""
        lines = []
        for protocol, expected in self.split_sha256.items():
            path = dataset.folder / SPLITS / f"{protocol}.csv"
            if not path.is_file() or sha256(path) != expected:
                lines.append(f"its split {protocol} is another one")
        if n_failed := int(np.sum(~np.asarray(dataset.usable, dtype=bool))):
            return [*lines, f"{n_failed} of its records are missing or failed"]
        number_of = {
            str(name): index for index, name in enumerate(dataset.column("record_id"))
        }
        known = {
            number_of[name]: values
            for name, values in self.signal_rms.items()
            if name in number_of
        }
        if not all(
            np.allclose(signal_rms(dataset, record), values, rtol=RTOL, atol=0)
            for record, values in known.items()
        ):
            lines.append(
                f"its signals are not those that gensig {self.generator_version} made"
            )
        return lines


def signal_rms(dataset: Dataset, record: int) -> NDArray[np.floating]:
    """(channel,) RMS of a record in m/s^2."""
    return np.sqrt(np.mean(np.square(dataset.signals(record), dtype=float), axis=-1))


def sha256(path: Path) -> str:
    """Hexadecimal digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def benchmark_of(dataset: Dataset) -> Benchmark | None:
    """The frozen benchmark that has this data set's plan, None for every other data set."""
    digest = sha256(dataset.folder / PLAN)
    for entry in files("diagnose").joinpath("frozen").iterdir():
        if entry.name.endswith(".json"):
            benchmark = Benchmark(**json.loads(entry.read_text(encoding="utf-8")))
            if benchmark.plan_sha256 == digest:
                return benchmark
    return None


def score_file(
    dataset: Dataset, path: Path, *, protocol: str | None = None
) -> dict[str, Any]:
    """Score the predictions of a CSV file on the test parts of the data set's splits.

    Parameters
    ----------
    dataset : open data set
    path : CSV with the columns record_id and predicted (a class name), and, if it likes, protocol, method and seed.
        For each of these the file names every test record once
    protocol : of files without that column; ``by_unit`` where None

    Returns
    -------
    plain dictionary: `scores` by protocol and method, `chance` by protocol, `benchmark` (name, differences, results) or
    None

    Raises
    ------
    DatasetError    for a file that cannot be read, or lacks or repeats a test record
    ConfigError    for a class or protocol that does not exist, or a leaky protocol
    """
    task = task_of(dataset, window_samples=1, stride_samples=1, normalise="none")
    scores: dict[str, dict[str, Any]] = {}
    chance: dict[str, float] = {}
    for (name, method), runs in _runs(task, path, protocol).items():
        found = score_predictions(task, runs, N_BOOTSTRAP)
        present = np.unique(task.labels()[runs[0][0]])
        chance[name] = 1 / present.size
        scores.setdefault(name, {})[method] = {
            **found,
            "n_records": int(runs[0][0].size),
            "n_seeds": len(runs),
        }
    frozen = benchmark_of(dataset)
    benchmark = None
    if frozen is not None:
        differences = frozen.differences(dataset)
        results = (
            {}
            if differences
            else {name: frozen.results.get(name, {}) for name in scores}
        )
        benchmark = {
            "name": frozen.name,
            "differences": differences,
            "results": results,
        }
    return {
        "data": str(dataset.folder),
        "scores": scores,
        "chance": chance,
        "benchmark": benchmark,
    }


def _runs(
    task: Task, path: Path, protocol: str | None
) -> dict[tuple[str, str], list[Run]]:
    """(protocol, method) -> for each seed the records of the test part, sorted, and their labels,
    (record,) both.
    """
    number_of = {
        str(name): index for index, name in enumerate(task.dataset.column("record_id"))
    }
    class_of = {name: index for index, name in enumerate(task.class_names)}
    said: dict[tuple[str, str, str], dict[int, int]] = {}
    for line, row in enumerate(_rows(path), start=2):
        key = (
            row.get("protocol") or protocol or "by_unit",
            row.get("method") or path.stem,
            row.get("seed") or "0",
        )
        if row["record_id"] not in number_of:
            raise DatasetError(
                f"{path} line {line}: the data set has no record {row['record_id']!r}"
            )
        if row["predicted"] not in class_of:
            known = ", ".join(class_of)
            raise ConfigError(
                f"{path} line {line}: there is no class {row['predicted']!r}; there is {known}"
            )
        mine = said.setdefault(key, {})
        record = number_of[row["record_id"]]
        if record in mine:
            raise DatasetError(
                f"{path} line {line}: record {row['record_id']} twice for {', '.join(key)}"
            )
        mine[record] = class_of[row["predicted"]]
    runs: dict[tuple[str, str], list[Run]] = {}
    for (name, method, seed), mine in said.items():
        if is_leaky(name):
            continue
        expected = np.unique(subset_segments(task, name, "test").record)
        missing, others = (
            set(expected.tolist()) - set(mine),
            set(mine) - set(expected.tolist()),
        )
        if missing or others:
            raise DatasetError(
                f"{path}: {method}, seed {seed} must name each of the {expected.size} test records of {name} once; "
                f"{len(missing)} are missing, {len(others)} are not of the test part"
            )
        runs.setdefault((name, method), []).append(
            (expected, np.array([mine[record] for record in expected.tolist()]))
        )
    if not runs:
        raise ConfigError(
            f"{path} holds predictions of leaky protocols only: those are no results"
        )
    return runs


def _rows(path: Path) -> list[dict[str, str]]:
    """Rows of the file; refuses one that is no CSV with the columns asked for."""
    if path.is_file() and path.stat().st_size > LARGEST_FILE:
        raise DatasetError(
            f"{path} has {path.stat().st_size} bytes, and at most {LARGEST_FILE} are read"
        )
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, strict=True)
            missing = [
                name for name in REQUIRED if name not in (reader.fieldnames or ())
            ]
            if missing:
                raise DatasetError(
                    f"{path} has no column {missing[0]}; it needs {' and '.join(REQUIRED)}"
                )
            rows = list(reader)
    except (UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f"{path} is no CSV file in UTF-8: {error}") from None
    if not rows:
        raise DatasetError(f"{path} has no rows")
    if any(None in row or None in row.values() for row in rows):
        raise DatasetError(f"{path}: its rows have not all as many cells as its head")
    return rows


def score_table(result: Mapping[str, Any]) -> list[str]:
    """Markdown table: a row for each protocol and method, those of the benchmark marked."""
    lines = ["| protocol | method | balanced accuracy | chance |", "|---|---|---|---|"]
    shipped = {} if result["benchmark"] is None else result["benchmark"]["results"]
    for protocol, methods in result["scores"].items():
        rows: Sequence[tuple[str, Any]] = [
            *((name, score["balanced_accuracy"]) for name, score in methods.items()),
            *(
                (f"{name} (shipped)", score)
                for name, score in shipped.get(protocol, {}).items()
            ),
        ]
        for name, score in rows:
            lines.append(
                f"| {protocol} | {name} | {interval_text(score, '.3f')} | {result['chance'][protocol]:.3f} |"
            )
    return lines
