"""Answers of a network on teeth by what is known of the place at which a tooth comes into mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch.nn.functional import log_softmax

from diagnose.data.windows import FloatArray, Task, WindowSet
from diagnose.networks.network import Network, SiteNetwork
from diagnose.networks.tooth_entry import sample_of
from diagnose.scoring.intervals import interval_text
from diagnose.scoring.judged import class_scores, judged_runs
from diagnose.scoring.metrics import ACCURACY, over_records
from diagnose.scoring.predictions import Prediction

KNOWN, UNKNOWN, ERROR = "known", "unknown", "median_error"


def predict_entries(
    model: Network, windows: WindowSet, *, batch_size: int = 16
) -> dict[str, FloatArray]:
    """Predictions of records with other entries than the estimated ones.

    Empty for a network that scores no teeth, and where the data set does not say the start.

    Returns
    -------
    known : (record, class) mean log-probability, with the true entry
    unknown : the same, where teeth are taken to begin at the first sample
    median_error : () of the estimate, share of a passage
    """
    entry = windows.targets.get("entry")
    if not isinstance(model, SiteNetwork) or entry is None or np.isnan(entry).any():
        return {}
    rows: dict[str, list[torch.Tensor]] = {KNOWN: [], UNKNOWN: []}
    errors = []
    with torch.inference_mode():
        for block in windows.blocks(batch_size):
            cut = torch.from_numpy(windows.cut(block))
            true = sample_of(torch.from_numpy(entry[block]), model.n_places)
            for name, start in ((KNOWN, true), (UNKNOWN, torch.zeros_like(true))):
                scores = torch.logsumexp(model.site_scores(cut, start), dim=1)
                rows[name].append(log_softmax(scores, dim=1))
            apart = (model.entries(cut) - true).numpy() / model.n_places
            errors.append(np.abs(apart - np.round(apart)))
    answers = {
        name: over_records(torch.cat(values).numpy().astype(float), windows.record)[1]
        for name, values in rows.items()
    }
    return answers | {ERROR: np.median(np.concatenate(errors))}


def entry_scores(
    task: Task, runs: Sequence[Prediction], *, n_bootstrap: int
) -> dict[str, Any]:
    """Scores of `predict_entries` for ``metrics.json``; empty where a run has none.

    Parameters
    ----------
    task : gives classes and machines
    runs : one a seed, of one protocol
    """
    if not all(KNOWN in run.further for run in runs):
        return {}
    scores: dict[str, Any] = {}
    for name in (KNOWN, UNKNOWN):
        judged = judged_runs(task, runs, further=name)
        scores[name] = class_scores(judged, task.class_names, n_bootstrap)[ACCURACY]
    errors = [float(run.further[ERROR]) for run in runs]
    return scores | {ERROR: float(np.mean(errors))}


def entry_notes(clean: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Title and sentence on the entries, for clean protocols of ``metrics.json``."""
    notes = []
    for protocol, result in clean.items():
        scores = result.get("entry")
        if not scores:
            continue
        phrases = [
            f"estimated, off by {scores[ERROR]:.1%} of a passage in the median",
            f"with the true one balanced accuracy {interval_text(scores[KNOWN])}",
            f"with that of the first sample {interval_text(scores[UNKNOWN])}",
        ]
        notes.append((f"{protocol}, entry of a tooth", "; ".join(phrases) + "."))
    return notes
