"""Files of a result: ``metrics.json``, CSV tables and networks."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.data.windows import Task
from diagnose.scoring.predictions import Prediction
from diagnose.settings import TrainSettings
from diagnose.training.store import (
    data_fingerprint,
    model_description,
    save_model,
)
from gensig.text.csv_tables import write_records
from gensig.version import __version__

METRICS_SCHEMA_VERSION = 1
Entry = dict[str, Any]  # made for ``metrics.json``
Content = Mapping[str, Any]  # read from it


def network_name(settings: TrainSettings) -> str:
    """Name of the network's method in ``metrics.json``."""
    return str(settings.model.get("name", "network"))


def study_facts(task: Task, settings: TrainSettings) -> dict[str, Any]:
    """Data, settings and versions of a finished study, keys of ``metrics.json``."""
    return {
        "metrics_schema_version": METRICS_SCHEMA_VERSION,
        "data": str(task.dataset.folder),
        "data_fingerprint": data_fingerprint(task.dataset),
        "n_records": int(task.dataset.n_records),
        "sampling_rate_hz": float(task.dataset.sampling_rate),
        "channel_names": list(task.channel_names),
        "model": network_name(settings),
        "settings": {**asdict(settings), "model": dict(settings.model)},
        "environment": environment(),
    }


def environment() -> dict[str, str]:
    """Versions that a result depends on, and the time at which it was made."""
    import sklearn
    import torch

    return {
        "gensig": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "torch": str(torch.__version__),
        "scikit_learn": str(sklearn.__version__),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def sha256(path: Path) -> str:
    """Hexadecimal digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_metrics(folder: Path, metrics: Content) -> None:
    """Write ``metrics.json`` into a folder."""
    text = json.dumps(metrics, indent=2, allow_nan=False)
    (folder / "metrics.json").write_text(f"{text}\n", encoding="utf-8")


def write_rows(path: Path, rows: Iterable[Content]) -> None:
    """Write rows with the same keys, at least one, as a CSV file."""
    first, *others = rows
    with path.open("w", newline="", encoding="utf-8") as file:
        write_records(file, list(first), [first, *others])


def save_network(
    folder: Path,
    name: str,
    task: Task,
    settings: TrainSettings,
    run: Prediction,
    **facts: Any,
) -> None:
    """Write a network into ``models/<name>-seed<k>`` below a folder.

    Parameters
    ----------
    run : its training, which has weights
    facts : further fields of its description
    """
    tensors = dict(run.weights or {})
    if run.domain is not None:
        tensors |= run.domain.tensors()
    description = replace(model_description(task, settings, run), **facts)
    save_model(folder / "models" / f"{name}-seed{run.seed}", tensors, description)
