"""What a network says beside the class, how severe a fault is and on which gear, and how far that
is right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import log_softmax

from diagnose.data.targets import GEARS, record_targets
from diagnose.data.windows import Task, WindowSet
from diagnose.networks.network import Network
from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import (
    confusion_by_unit,
    over_records,
    percentile_interval,
    score_with_interval,
)

if TYPE_CHECKING:
    from diagnose.scoring.predictions import Prediction

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
BOOTSTRAP_SEED = 20240608


def predict_heads(
    model: Network, windows: WindowSet, *, batch_size: int = 64
) -> dict[str, FloatArray]:
    """What the further heads say of records, in the order of
    `diagnose.scoring.metrics.over_records`.

    Returns
    -------
    severity : (record, class) from 0 to 1, mean over the windows: how severe, if it is of that class
    gear : (record, gear) mean log-probability of `diagnose.data.targets.GEARS`
    """
    if not model.further:
        return {}
    model.eval()
    said: dict[str, list[torch.Tensor]] = {name: [] for name in model.further}
    every = np.arange(len(windows))
    with torch.inference_mode():
        for block in np.array_split(every, -(-every.size // batch_size)):
            answers = model.answers(torch.from_numpy(windows.cut(block)))
            for name, values in said.items():
                values.append(
                    answers[name].sigmoid()
                    if name == "severity"
                    else log_softmax(answers[name], dim=1)
                )
    return {
        name: over_records(torch.cat(values).numpy().astype(float), windows.record)[1]
        for name, values in said.items()
    }


def head_scores(
    task: Task, trained_on: IntArray, runs: Sequence[Prediction], *, n_bootstrap: int
) -> dict[str, Any]:
    """Scores of the further heads on test records, for ``metrics.json``.

    Parameters
    ----------
    task : gives severities, gears and units
    trained_on : records of the training part
    runs : one a seed, of one protocol
    n_bootstrap : resamples of the units

    Returns
    -------
    severity_mae : class -> mean absolute error of what is said of the true class, with its interval, and ``constant``,
        the error of the median severity of that class in the training; sound records do not count
    faulted_gear : balanced accuracy with its interval, and chance
    """
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    record = runs[0].record
    truth, known = (
        record_targets(task.dataset, record),
        record_targets(task.dataset, trained_on),
    )
    unit = np.asarray(task.dataset.column("unit_id"))[record]
    found: dict[str, Any] = {}
    if "severity" in truth and all("severity" in run.heads for run in runs):
        labels = task.labels()
        said = np.stack(
            [
                run.heads["severity"][np.arange(record.size), labels[record]]
                for run in runs
            ]
        )
        found["severity_mae"] = {
            name: _severity_error(
                said[:, chosen],
                truth["severity"][chosen],
                known["severity"][labels[trained_on] == index],
                unit[chosen],
                n_bootstrap=n_bootstrap,
                rng=rng,
            )
            for index, name in enumerate(task.class_names)
            if (
                chosen := (labels[record] == index) & ~np.isnan(truth["severity"])
            ).any()
        }
    if "gear" in truth and all("gear" in run.heads for run in runs):
        confusion = np.stack(
            [
                confusion_by_unit(
                    truth["gear"], run.heads["gear"].argmax(axis=1), unit, len(GEARS)
                )
                for run in runs
            ]
        )
        score = score_with_interval(
            "balanced_accuracy", confusion, n_bootstrap=n_bootstrap, rng=rng
        )
        chance = 1.0 / np.unique(truth["gear"]).size
        found["faulted_gear"] = {
            "balanced_accuracy": asdict(score),
            "chance": chance,
            "gears": list(GEARS),
        }
    return found


def _severity_error(
    said: FloatArray,
    truth: FloatArray,
    in_training: FloatArray,
    unit: NDArray[Any],
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Error of one class: ``said`` is (seed, record), all else (record,)."""
    error = np.abs(said - truth).mean(axis=0)
    names, position = np.unique(unit, return_inverse=True)
    counts = np.bincount(position)
    times_drawn = rng.multinomial(
        names.size, np.full(names.size, 1 / names.size), size=n_bootstrap
    )
    means = (times_drawn @ np.bincount(position, weights=error)) / (
        times_drawn @ counts
    )
    low, high = percentile_interval(means, names.size)
    usual = in_training[~np.isnan(in_training)]
    return {
        "mean": float(error.mean()),
        "low": low,
        "high": high,
        "constant": float(np.abs(np.median(usual) - truth).mean())
        if usual.size
        else None,
        "n_records": int(truth.size),
    }


def heads_notes(clean: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Title and sentence on the further heads, by clean protocol of ``metrics.json``.

    Empty where there are none.
    """
    notes = []
    for name, result in clean.items():
        said = [
            f"severity of {kind} off by {interval_text(row, '.3f')}"
            + (
                ""
                if row["constant"] is None
                else f", by {row['constant']:.3f} if its usual one is said of all"
            )
            for kind, row in result["heads"].get("severity_mae", {}).items()
        ]
        if "faulted_gear" in result["heads"]:
            gear = result["heads"]["faulted_gear"]
            said.append(
                f"faulted gear {interval_text(gear['balanced_accuracy'], '.2f')}, {gear['chance']:.2f} by chance"
            )
        if said:
            notes.append((f"{name}, severity and gear", "; ".join(said) + "."))
    return notes
