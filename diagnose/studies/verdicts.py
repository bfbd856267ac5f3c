"""Verdicts on the controls of each method: one whose control fails has no headline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnose.baselines.base import Role
from diagnose.baselines.registry import baseline_names
from diagnose.scoring.intervals import is_above
from diagnose.scoring.predictions import Prediction
from diagnose.studies.baseline_runs import LABEL_SHUFFLE, shuffle_method
from diagnose.studies.class_jobs import LEVEL_KEPT, WITH_REFERENCE
from diagnose.studies.result_files import Content, Entry
from diagnose.training.sham import sham_method

UNLIKELY = 1e-4  # of guesses that follow as many canaries
FAILED = "failed"


def control_verdicts(
    methods: Content, runs: Mapping[str, Sequence[Prediction]], network: str
) -> dict[str, Entry]:
    """Method whose score stands on the page -> its controls, and those that failed.

    Parameters
    ----------
    methods : scores of one clean protocol, with its controls
    runs : method -> its predictions
    network : name of the network

    Returns
    -------
    ``holds``, ``failed`` (in words), ``ran``, and ``canaries``: the most answers of a run that
    are the random label of their record, of how many, and the probability of as many by guessing
    """
    shown = (network, WITH_REFERENCE, LEVEL_KEPT, *baseline_names(Role.RIVAL))
    chance = methods["chance"]["balanced_accuracy"]
    return {
        name: _of_method(name, methods, runs[name], network, chance)
        for name in shown
        if name in methods
    }


def failed_controls(result: Content, method: str) -> str:
    """Controls of a method that failed on a protocol, in words; empty where all held."""
    verdict = result.get("controls", {}).get(method)
    if verdict is None:
        return ""
    return "; ".join(verdict[FAILED])


def _of_method(
    name: str,
    methods: Content,
    runs: Sequence[Prediction],
    network: str,
    chance: float,
) -> Entry:
    """Verdicts on the controls of one method."""
    shuffle = LABEL_SHUFFLE if name == network else shuffle_method(name)
    at_chance = {
        "label shuffle": shuffle,
        "sham": sham_method(name, network),
        **{probe.replace("_", " "): probe for probe in baseline_names(Role.AT_CHANCE)},
    }
    ran = {text: key for text, key in at_chance.items() if key in methods}
    failed = [
        f"{text} above chance ({methods[key]['balanced_accuracy']['mean']:.2f})"
        for text, key in ran.items()
        if is_above(methods[key]["balanced_accuracy"], chance)
    ]
    canaries = _canaries(runs)
    if canaries is not None and canaries["probability"] < UNLIKELY:
        failed.append(
            f"its answers follow random labels of the test records "
            f"({canaries['n_followed']} of {canaries['n_records']})"
        )
    return {
        "holds": not failed,
        FAILED: failed,
        "ran": [*ran, *(["canaries"] if canaries else [])],
        "canaries": canaries,
    }


def _canaries(runs: Sequence[Prediction]) -> dict[str, Any] | None:
    """Answers that are canaries, of the run with the most; None where none were given."""
    from scipy.stats import binom

    counts = [
        (run.n_followed, run.record.size, run.answers.shape[1])
        for run in runs
        if run.n_followed is not None
    ]
    if not counts:
        return None
    n_followed, n_records, n_classes = max(counts)
    by_guessing = binom.sf(n_followed - 1, n_records, 1 / n_classes)
    return {
        "n_followed": n_followed,
        "n_records": int(n_records),
        "probability": float(by_guessing),
    }
