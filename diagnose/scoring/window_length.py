"""Scores of records by their first windows only: the effect of a longer signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from diagnose.data.windows import IntArray
from diagnose.scoring.intervals import Interval, interval_text, with_interval
from diagnose.scoring.judged import Judged, drawn_scores
from diagnose.scoring.metrics import ACCURACY, over_records
from diagnose.scoring.predictions import Rows


def by_window_length(
    judged: Judged,
    windows: Sequence[Rows],
    *,
    window_seconds: float,
    step_seconds: float,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Balanced accuracy by the first 1, 2, 4, ... windows of each record, and by all of them.

    Parameters
    ----------
    judged : the network on the test records, these sorted by their number
    windows : for each seed, those of a record in time order
    window_seconds, step_seconds : length of a window and step to the next one, s
    n_bootstrap, rng : resamples of the machines and their source

    Returns
    -------
    rows : windows, seconds of signal, score with interval
    gain : score by all windows less that by the first one, from the same resamples
    summary : one sentence
    """
    positions = [_position_in_record(part.record) for part in windows]
    longest = int(max(position.max() for position in positions)) + 1
    counts = [1 << power for power in range((longest - 1).bit_length())] + [longest]
    drawn, support = judged.machines.drawn(n_bootstrap, rng), judged.support
    rows, scores = [], []
    for count in counts:
        by_record = []
        for part, position in zip(windows, positions, strict=True):
            first = position < count
            answers = over_records(part.answers[first], part.record[first])[1]
            by_record.append(answers)
        shorter = replace(judged, answers=np.stack(by_record))
        # the same seeds in every row, so that only the length differs
        seeds = np.random.default_rng(0)
        scores.append(drawn_scores(shorter, ACCURACY, drawn, seeds))
        rows.append(
            {
                "n_windows": count,
                "seconds": window_seconds + (count - 1) * step_seconds,
                ACCURACY: with_interval(scores[-1], support),
            }
        )
    gain = with_interval(scores[-1] - scores[0], support)
    return {
        "method": judged.method,
        "rows": rows,
        "gain": gain,
        "summary": _sentence(judged.method, rows, gain),
    }


def _position_in_record(record: IntArray) -> IntArray:
    """(window,) 0 for the first window of its record, 1 for the second, ..."""
    order = np.argsort(record, kind="stable")
    _, first, counts = np.unique(record[order], return_index=True, return_counts=True)
    position = np.empty_like(order)
    position[order] = np.arange(record.size) - np.repeat(first, counts)
    return position


def _sentence(method: str, rows: Sequence[dict[str, Any]], gain: Interval) -> str:
    first, last = rows[0], rows[-1]
    if len(rows) == 1:
        seconds = f"{first['seconds']:.3g} s"
        return f"Records hold one window of {seconds}: nothing to compare."
    text = (
        f"{method} scores {interval_text(first['balanced_accuracy'])} "
        f"on the first {first['seconds']:.3g} s of a record and "
        f"{interval_text(last['balanced_accuracy'])} on {last['seconds']:.3g} s"
    )
    low, high = gain["low"], gain["high"]
    if low is None or high is None:
        return text + "."
    verdict = "not told apart"
    if low > 0:
        verdict = "more signal helps"
    elif high < 0:
        verdict = "more signal hurts"
    return f"{text}: {verdict} ({gain['mean']:+.2f} [{low:+.2f}, {high:+.2f}])."
