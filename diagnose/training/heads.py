"""Predictions of the further heads, severity and faulty gear, and their scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch.nn.functional import log_softmax

from diagnose.data.packed_turns import tooth_counts
from diagnose.data.targets import GEARS, record_targets
from diagnose.data.windows import FloatArray, IntArray, Task, WindowSet
from diagnose.networks.network import Network, SiteNetwork
from diagnose.scoring.judged import interval_text
from diagnose.scoring.machines import machines_of
from diagnose.scoring.metrics import (
    confusion_by_unit,
    over_records,
    score_with_interval,
    spread_of,
)

if TYPE_CHECKING:
    from diagnose.scoring.predictions import Prediction

BOOTSTRAP_SEED = 20240608


def predict_heads(
    model: Network, windows: WindowSet, *, batch_size: int = 64
) -> dict[str, FloatArray]:
    """Predictions of the further heads for records.

    The records are in the order of `diagnose.scoring.metrics.over_records`.

    Returns
    -------
    severity : (record, class) from 0 to 1, mean over the windows, for a record of that class
    gear : (record, gear) mean log-probability of `diagnose.data.targets.GEARS`
    """
    if not model.head_names:
        return {}
    model.eval()
    blocks = windows.blocks(batch_size)
    with torch.inference_mode():
        answers = [
            model.answers(torch.from_numpy(windows.cut(block))) for block in blocks
        ]
    predictions = {}
    for name in model.head_names:
        output = torch.cat([answer[name] for answer in answers])
        output = output.sigmoid() if name == "severity" else log_softmax(output, dim=1)
        by_window = output.numpy().astype(float)
        predictions[name] = over_records(by_window, windows.record)[1]
    return predictions


def fault_site(
    model: SiteNetwork, windows: WindowSet, label: int
) -> tuple[str, int, float]:
    """Most probable site of a fault of a class in the record of some windows.

    Returns
    -------
    gear of `diagnose.data.targets.GEARS`, tooth (-1 for no single one), and the share of the class
    that this site has
    """
    cut = torch.from_numpy(windows.cut(np.arange(len(windows))))
    with torch.inference_mode():
        scores = model.site_scores(cut)
    share = torch.softmax(scores.mean(dim=0)[:, label], dim=0)
    best = int(share.argmax())
    site = model.sites(tooth_counts(windows.signals[0]))[best]
    return *site, float(share[best])


def head_scores(
    task: Task, trained_on: IntArray, runs: Sequence[Prediction], *, n_bootstrap: int
) -> dict[str, Any]:
    """Scores of the further heads on test records, for ``metrics.json``.

    Parameters
    ----------
    task : gives severities, gears and machines
    trained_on : records of the training part
    runs : one a seed, of one protocol
    n_bootstrap : resamples of the machines

    Returns
    -------
    severity_mae : class -> mean absolute error for the true class, with its interval, and
        ``constant``, the error of the median severity of that class in the training; sound
        records do not count
    faulted_gear : balanced accuracy with its interval, and chance
    """
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    record = runs[0].record
    truth = record_targets(task.dataset, record)
    known = record_targets(task.dataset, trained_on)
    unit = np.asarray(task.dataset.column("unit_id"))[record]
    scores: dict[str, Any] = {}
    if "severity" in truth and all("severity" in run.heads for run in runs):
        labels = task.labels()
        label, every = labels[record], np.arange(record.size)
        predicted = np.stack([run.heads["severity"][every, label] for run in runs])
        scores["severity_mae"] = {}
        for index, name in enumerate(task.class_names):
            chosen = (label == index) & ~np.isnan(truth["severity"])
            if chosen.any():
                scores["severity_mae"][name] = _severity_error(
                    task,
                    record[chosen],
                    predicted[:, chosen],
                    truth["severity"][chosen],
                    known["severity"][labels[trained_on] == index],
                    n_bootstrap=n_bootstrap,
                    rng=rng,
                )
    if "gear" in truth and all("gear" in run.heads for run in runs):
        gears = [run.heads["gear"].argmax(axis=1) for run in runs]
        counts = [
            confusion_by_unit(truth["gear"], gear, unit, len(GEARS)) for gear in gears
        ]
        score = score_with_interval(
            "balanced_accuracy",
            np.stack(counts),
            n_bootstrap=n_bootstrap,
            rng=rng,
            machines=machines_of(task.dataset, record),
        )
        scores["faulted_gear"] = {
            "balanced_accuracy": asdict(score),
            "chance": 1.0 / np.unique(truth["gear"]).size,
            "gears": list(GEARS),
        }
    return scores


def _severity_error(
    task: Task,
    record: IntArray,
    predicted: FloatArray,
    truth: FloatArray,
    in_training: FloatArray,
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Error of one class: ``predicted`` is (seed, record), all else (record,)."""
    error = np.abs(predicted - truth).mean(axis=0)
    unit = np.asarray(task.dataset.column("unit_id"))[record]
    position = np.unique(unit, return_inverse=True)[1]
    machines = machines_of(task.dataset, record)
    support, drawn = machines.support(), machines.drawn(n_bootstrap, rng)
    total, n_drawn = (
        drawn @ np.bincount(position, weights=error),
        drawn @ np.bincount(position),
    )
    means = np.divide(
        total, n_drawn, out=np.full(total.shape, np.nan), where=n_drawn > 0
    )
    known = in_training[~np.isnan(in_training)]
    constant = None
    if known.size:
        constant = float(np.abs(np.median(known) - truth).mean())
    return {
        **spread_of(error.mean(), means, support),
        "constant": constant,
        "n_records": int(truth.size),
    }


def heads_notes(clean: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Title and sentence on the further heads, for clean protocols of ``metrics.json``.

    Empty without further heads.
    """
    notes = []
    for name, result in clean.items():
        phrases = []
        for kind, row in result["heads"].get("severity_mae", {}).items():
            phrase = f"mean error of the severity of {kind} {interval_text(row, '.3f')}"
            if row["constant"] is not None:
                phrase += f" (the training median for all: {row['constant']:.3f})"
            phrases.append(phrase)
        if "faulted_gear" in result["heads"]:
            gear = result["heads"]["faulted_gear"]
            accuracy = interval_text(gear["balanced_accuracy"], ".2f")
            phrases.append(f"faulted gear {accuracy}, {gear['chance']:.2f} by chance")
        for name_of_gear, row in result.get("by_gear", {}).items():
            accuracy = interval_text(row, ".2f")
            phrases.append(
                f"balanced accuracy with faults on the {name_of_gear} {accuracy}"
            )
        if phrases:
            notes.append((f"{name}, severity and gear", "; ".join(phrases) + "."))
    return notes
