"""How much a longer signal helps.

Records judged by their first windows only, with the networks as trained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.scoring.judged import (
    Judged,
    interval_text,
    resampled_score,
    score,
    units_drawn,
    with_interval,
)
from diagnose.scoring.metrics import over_records

IntArray = NDArray[np.integer]
FloatArray = NDArray[np.floating]


def by_window_length(
    judged: Judged,
    windows: Sequence[tuple[IntArray, FloatArray]],
    *,
    window_seconds: float,
    step_seconds: float,
    n_bootstrap: int,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Balanced accuracy of records judged by their first 1, 2, 4, ... windows and by all of them.

    Parameters
    ----------
    judged : the network on the test records, these sorted by their number
    windows : for each seed, record (window,) and log-probabilities (window, class), windows of a record in time order
    window_seconds, step_seconds : length of a window and from one to the next, s
    n_bootstrap, rng : resamples of the units and their source

    Returns
    -------
    rows : windows, seconds of signal, score with interval
    gain : what all windows bring over the first one, from the same resamples
    summary : one sentence
    """
    place = [_place_in_record(record) for record, _ in windows]
    longest = int(max(order.max() for order in place)) + 1
    counts = [
        2**power for power in range(longest.bit_length()) if 2**power < longest
    ] + [longest]
    drawn = units_drawn(judged.n_units, n_bootstrap, rng)
    rows, resampled, scores = [], [], []
    for count in counts:
        by_record = [
            over_records(scored[order < count], record[order < count])[1]
            for (record, scored), order in zip(windows, place, strict=True)
        ]
        part = replace(judged, log_probability=np.stack(by_record))
        # the same seeds in every row: what differs is the length alone
        resampled.append(
            resampled_score(part, "balanced_accuracy", drawn, np.random.default_rng(0))
        )
        scores.append(score(part, "balanced_accuracy"))
        rows.append(
            {
                "n_windows": count,
                "seconds": window_seconds + (count - 1) * step_seconds,
                "balanced_accuracy": with_interval(
                    scores[-1], resampled[-1], judged.n_units
                ),
            }
        )
    gain = with_interval(
        scores[-1] - scores[0], resampled[-1] - resampled[0], judged.n_units
    )
    return {
        "method": judged.method,
        "rows": rows,
        "gain": gain,
        "summary": _sentence(judged.method, rows, gain),
    }


def _place_in_record(record: IntArray) -> IntArray:
    """(window,) 0 for the first window of its record, 1 for the second, ..."""
    order = np.argsort(record, kind="stable")
    _, first, counts = np.unique(record[order], return_index=True, return_counts=True)
    place = np.empty_like(order)
    place[order] = np.arange(record.size) - np.repeat(first, counts)
    return place


def _sentence(
    method: str, rows: Sequence[dict[str, Any]], gain: dict[str, float | None]
) -> str:
    first, last = rows[0], rows[-1]
    if len(rows) == 1:
        return (
            f"Records hold one window of {first['seconds']:.3g} s: nothing to compare."
        )
    text = (
        f"{method} scores {interval_text(first['balanced_accuracy'])} on the first {first['seconds']:.3g} s of a "
        f"record and {interval_text(last['balanced_accuracy'])} on {last['seconds']:.3g} s"
    )
    if gain["low"] is None or gain["high"] is None:
        return text + "."
    verdict = (
        "more signal helps"
        if gain["low"] > 0
        else "more signal hurts"
        if gain["high"] < 0
        else "not told apart"
    )
    return f"{text}: {verdict} ({gain['mean']:+.2f} [{gain['low']:+.2f}, {gain['high']:+.2f}])."
