"""Predictions of the further heads, severity and faulty gear, and their scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch.nn.functional import log_softmax

from diagnose.data.packed_turns import tooth_counts
from diagnose.data.targets import GEARS, record_targets
from diagnose.data.windows import FloatArray, IntArray, Task, WindowSet
from diagnose.networks.network import Network, SiteNetwork
from diagnose.scoring.intervals import interval_text, with_interval
from diagnose.scoring.judged import ANSWERS_SEED, Judged, judged_runs
from diagnose.scoring.metrics import (
    ACCURACY,
    over_records,
    ratio,
    score_with_interval,
)
from diagnose.scoring.predictions import Prediction


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
    rng = np.random.default_rng(ANSWERS_SEED)
    record = runs[0].record
    truth = record_targets(task.dataset, record)
    known = record_targets(task.dataset, trained_on)
    scores: dict[str, Any] = {}
    if "severity" in truth and all("severity" in run.further for run in runs):
        labels = task.labels()
        scores["severity_mae"] = {}
        for index, name in enumerate(task.class_names):
            chosen = (labels[record] == index) & ~np.isnan(truth["severity"])
            if chosen.any():
                in_training = known["severity"][labels[trained_on] == index]
                scores["severity_mae"][name] = _severity_error(
                    judged_runs(
                        task,
                        runs,
                        record[chosen],
                        further="severity",
                        truth=truth["severity"][chosen],
                    ),
                    index,
                    in_training,
                    n_bootstrap=n_bootstrap,
                    rng=rng,
                )
    if "gear" in truth and all("gear" in run.further for run in runs):
        judged = judged_runs(task, runs, further="gear", truth=truth["gear"])
        score = score_with_interval(
            ACCURACY,
            judged.confusion(),
            n_bootstrap=n_bootstrap,
            rng=rng,
            machines=judged.machines,
        )
        scores["faulted_gear"] = {
            ACCURACY: score,
            "chance": 1.0 / np.unique(truth["gear"]).size,
            "gears": list(GEARS),
        }
    return scores


def _severity_error(
    judged: Judged,
    label: int,
    in_training: FloatArray,
    *,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Error of the severities of one class, whose training records have those given."""
    error = np.abs(judged.answers[..., label] - judged.truth).mean(axis=0)
    drawn = judged.machines.drawn(n_bootstrap, rng)
    resampled = ratio(
        drawn @ np.bincount(judged.unit, weights=error),
        drawn @ np.bincount(judged.unit),
    )
    means = np.concatenate([[error.mean()], resampled])
    known = in_training[~np.isnan(in_training)]
    constant = None
    if known.size:
        constant = float(np.abs(np.median(known) - judged.truth).mean())
    return {
        **with_interval(means, judged.support, "linear"),
        "constant": constant,
        "n_records": int(judged.truth.size),
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
