"""How far the answer for a recording carries.

The runner-up, and what the network scored on machines it never saw.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnose.scoring.judged import interval_text
from diagnose.scoring.metrics import is_above

LEAST_MARGIN = 0.10  # between the two most probable classes; assumed


def verdict(
    probabilities: Mapping[str, float], test_score: Mapping[str, Any] | None
) -> dict[str, Any]:
    """The most probable class, the one behind it, and why neither can be said.

    Parameters
    ----------
    probabilities : of each class
    test_score : of `diagnose.studies.study.test_score`; None for a model that stores none

    Returns
    -------
    part of what ``diagnose predict --json`` prints; the class is undecided where `undecided_because` is not empty
    """
    (first, highest), (second, next_highest) = sorted(
        probabilities.items(), key=lambda item: -item[1]
    )[:2]
    because = []
    if highest - next_highest < LEAST_MARGIN:
        because.append(f"the two are less than {LEAST_MARGIN:.2f} apart")
    if test_score is not None and not is_above(
        test_score["balanced_accuracy"], test_score["chance"]
    ):
        because.append("the model was not shown to be better than chance")
    return {
        "class": first,
        "probability": highest,
        "runner_up": second,
        "runner_up_probability": next_highest,
        "undecided": bool(because),
        "undecided_because": because,
        "model_test_score": None if test_score is None else dict(test_score),
    }


def class_text(said: Mapping[str, Any]) -> str:
    """The class and the one behind it, or that there is none."""
    first, second = (
        f"{said['probability']:.2f}",
        f"{said['runner_up']} {said['runner_up_probability']:.2f}",
    )
    if said["undecided"]:
        return f"undecided, {said['class']} {first} or {second} ({'; '.join(said['undecided_because'])})"
    return f"{said['class']}, probability {first}, next {second}"


def score_text(said: Mapping[str, Any]) -> str:
    """What the model scored when it was trained."""
    score = said["model_test_score"]
    if score is None:
        return "this model stores no test score, train it again"
    where = f"on {score['n_units']} machines it never saw"
    if score["leaky"]:
        where = "in a LEAKY split, no measure of diagnosis"
    elif said["adaptation"] is not None:
        where += ", before it was adapted"
    value = interval_text(score["balanced_accuracy"])
    return (
        f"this model: balanced accuracy {value} {where}, chance {score['chance']:.2f}"
    )
