"""Confidence of a prediction: margin to the second class, score on machines never seen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnose.scoring.intervals import interval_text, is_above
from diagnose.studies.result_files import Content

LEAST_MARGIN = 0.10  # between the two most probable classes; assumed


def verdict(
    probabilities: Mapping[str, float], test_score: Content | None
) -> dict[str, Any]:
    """The two most probable classes, and the reasons why the first is not sure.

    Parameters
    ----------
    probabilities : of each class
    test_score : of `diagnose.studies.protocol_results.test_score`; None in older models

    Returns
    -------
    part of what ``diagnose predict --json`` prints; the class is undecided where
    `undecided_because` is not empty
    """
    ranked = sorted(probabilities.items(), key=lambda item: -item[1])
    (first, highest), (second, next_highest) = ranked[:2]
    because = []
    if highest - next_highest < LEAST_MARGIN:
        because.append(f"the two are less than {LEAST_MARGIN:.2f} apart")
    if test_score is not None:
        test_score = dict(test_score)
        if not is_above(test_score["balanced_accuracy"], test_score["chance"]):
            because.append("the model was not shown to be better than chance")
    return {
        "class": first,
        "probability": highest,
        "runner_up": second,
        "runner_up_probability": next_highest,
        "undecided": bool(because),
        "undecided_because": because,
        "model_test_score": test_score,
    }


def class_text(result: Content) -> str:
    """Both classes with their probabilities, or the reasons why the class is undecided."""
    name, first = result["class"], f"{result['probability']:.2f}"
    second = f"{result['runner_up']} {result['runner_up_probability']:.2f}"
    if result["undecided"]:
        because = "; ".join(result["undecided_because"])
        return f"undecided, {name} {first} or {second} ({because})"
    return f"{name}, probability {first}, next {second}"


def score_text(result: Content) -> str:
    """Score of the model when it was trained."""
    score = result["model_test_score"]
    if score is None:
        return "this model stores no test score, train it again"
    where = f"on {score['n_units']} machines it never saw"
    if score["leaky"]:
        where = "in a LEAKY split, no measure of diagnosis"
    elif result["adaptation"] is not None:
        where += ", before it was adapted"
    value = interval_text(score["balanced_accuracy"])
    return (
        f"this model: balanced accuracy {value} {where}, chance {score['chance']:.2f}"
    )
