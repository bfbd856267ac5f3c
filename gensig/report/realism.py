"""Simulated records beside measured ranges: how they are judged and shown.

``realism_ranges.csv`` holds the published ranges: ``id``, ``at`` (which conditions), ``unit``,
``low``, ``high`` (empty: open; both empty: shown without a range) and ``source``.
``realism_results.csv`` holds what ``python -m benchmarks.realism --stored`` found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gensig.errors import ConfigError
from gensig.text.csv_tables import read_records

FOLDER = Path(__file__).resolve().parent
RANGES = FOLDER / "realism_ranges.csv"
INSIDE, OVERLAPS, MISSES, WITHOUT, NOTHING = (
    "inside",
    "overlaps",
    "misses",
    "no range",
    "no value",
)
APART, NOT_APART = "told apart", "not told apart"
VERDICTS = (INSIDE, OVERLAPS, MISSES, WITHOUT, NOTHING, APART, NOT_APART)

RangeKey = tuple[str, str]  # id, at


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """A measured range; None is an open end."""

    id: str
    at: str
    unit: str
    low: float | None
    high: float | None
    source: str

    def __post_init__(self) -> None:
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise ConfigError(
                f"{self.id}, {self.at}: low = {self.low:g} lies above high = {self.high:g}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison(Range):
    """A range and what was simulated beside it.

    Median, 5 and 95 % points, number of values, verdict.
    """

    median: float
    p5: float
    p95: float
    n: int
    verdict: str
    reason: str = ""

    def __post_init__(self) -> None:
        # slots make a new class, so the zero-argument super() would look at the old one
        Range.__post_init__(self)
        if self.verdict not in VERDICTS:
            raise ConfigError(
                f"{self.id}, {self.at}: verdict = {self.verdict!r}; allowed: {', '.join(VERDICTS)}"
            )

    @property
    def key(self) -> RangeKey:
        """The key of a row: its id and its conditions."""
        return self.id, self.at


def judge(low: float | None, high: float | None, p5: float, p95: float) -> str:
    """Verdict on a central 90 %: inside the range, overlapping it, or missing it."""
    if math.isnan(p5) or math.isnan(p95):
        return NOTHING
    if low is None and high is None:
        return WITHOUT
    bottom = -math.inf if low is None else low
    top = math.inf if high is None else high
    if bottom <= p5 and p95 <= top:
        return INSIDE
    if p5 <= top and p95 >= bottom:
        return OVERLAPS
    return MISSES


def points(values: ArrayLike) -> tuple[float, float, float, int]:
    """Median, 5 and 95 % points and number of the finite values; NaN where there is none."""
    finite = np.asarray(values, dtype=float).ravel()
    finite = finite[np.isfinite(finite)]
    if finite.size == 0:
        return math.nan, math.nan, math.nan, 0
    median, p5, p95 = (float(value) for value in np.percentile(finite, [50, 5, 95]))
    return median, p5, p95, int(finite.size)


def compare(measured: Range, values: ArrayLike) -> Comparison:
    """Simulated values compared with a measured range."""
    median, p5, p95, n = points(values)
    verdict = judge(measured.low, measured.high, p5, p95)
    return Comparison(
        **asdict(measured), median=median, p5=p5, p95=p95, n=n, verdict=verdict
    )


def read_ranges(path: Path = RANGES) -> dict[RangeKey, Range]:
    """The measured ranges, by id and conditions, in the order of the file."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = [
            Range(**with_numbers(line, ("low", "high"))) for line in read_records(file)
        ]
    return {(row.id, row.at): row for row in rows}


def with_numbers(line: Mapping[str, str], numbers: Sequence[str]) -> dict[str, Any]:
    """A line of a file; empty cells of number columns are None."""
    values: dict[str, Any] = dict(line)
    for name in numbers:
        values[name] = float(line[name]) if line[name] else None
    return values


def shown_range(measured: Range) -> str:
    """A range in words."""
    low, high = measured.low, measured.high
    if low is None and high is None:
        return ""
    if low is None:
        return f"below {high:.3g}"
    if high is None:
        return f"above {low:.3g}"
    return f"{low:.3g} to {high:.3g}"


def number_text(value: float) -> str:
    """Three digits; 'none' for NaN."""
    return "none" if math.isnan(value) else f"{value:.3g}"
