"""Verdict on a mutant of a model: what ``diagnose predict`` and ``diagnose verify`` do with it."""

from __future__ import annotations

import contextlib
import io
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks._damaged_folders import Mutant
from benchmarks._damaged_models import mutate
from benchmarks._fuzz_judge import Campaign, Judged
from benchmarks._stored_models import ASKED
from diagnose.cli import main

ANSWERED, REFUSED, DAMAGED = (0, 3), 2, 1
PLACES = ("recording", "model")  # of an answer; where things lie


def said(words: Sequence[str]) -> tuple[int, str, str]:
    """Exit status, output and errors of ``diagnose``, in this process."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        status = main(list(words))
    return status, out.getvalue(), error.getvalue()


def answers(models: Path) -> dict[str, Any]:
    """Answer of every model of a folder to its recording."""
    return {asked.name: json.loads(said(asked.words(models))[1]) for asked in ASKED}


def judge(
    models: Path,
    mutant: Mutant,
    whole: dict[str, Any],
    _tell: Callable[[str], None] = print,
) -> Judged:
    """The fault ('' for none), whether anything noticed the change, whether predict refused."""
    name = mutant.kind.partition(":")[0]
    (asked,) = (one for one in ASKED if one.name == name)
    faults = []
    results = []
    for words in (asked.words(models), ["verify", str(models / name)]):
        try:
            results.append(said(words))
        except Exception as error:
            faults.append(f"{words[0]}: {type(error).__name__}: {str(error)[:150]}")
    if faults:
        return "; ".join(faults), False, False
    (status, answer, line), (verified, _, complaint) = results
    is_refused, is_noticed = status == REFUSED, verified != 0
    if is_refused and (line.count("\n") != 1 or answer):
        faults.append("refused in other than one line")
    if verified not in (0, DAMAGED, REFUSED) or (verified == REFUSED and not complaint):
        faults.append(f"verify ended with status {verified}")
    if status not in (*ANSWERED, REFUSED):
        faults.append(f"predict ended with status {status}")
    if not is_refused:
        faults += _answer_faults(json.loads(answer), mutant, whole[name])
    if is_refused and not is_noticed and not mutant.forged:
        faults.append("damage that predict refuses, and verify does not see")
    return "; ".join(faults), is_refused or is_noticed, is_refused


def _answer_faults(answer: Any, mutant: Mutant, untouched: Any) -> list[str]:
    """Faults of an answer that was given."""
    faults = []
    if mutant.refused:
        faults.append("answered where it must refuse")
    if not _is_finite(answer):
        faults.append("an answer that is not finite")
    if not mutant.forged and _without_places(answer) != _without_places(untouched):
        faults.append("another answer than the untouched model's")
    return faults


def _without_places(answer: Any) -> Any:
    return {key: value for key, value in answer.items() if key not in PLACES}


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


CAMPAIGN = Campaign(change=mutate, judge=judge, meaning=answers)
