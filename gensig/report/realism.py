"""Simulated records beside measured ranges: how they are judged, stored and shown.

``realism_ranges.csv`` holds the published ranges: ``id``, ``at`` (which conditions), ``unit``,
``low``, ``high`` (empty: open; both empty: shown without a range) and ``source``.
``realism_results.csv`` holds what ``python -m benchmarks.realism --stored`` found; its first line
says what was compared, and which commit froze the simulation before. The column ``reason`` is
written by hand and kept by later runs.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gensig.errors import ConfigError

FOLDER = Path(__file__).resolve().parent
RANGES, RESULTS = FOLDER / "realism_ranges.csv", FOLDER / "realism_results.csv"
INSIDE, OVERLAPS, MISSES, WITHOUT, NOTHING = (
    "inside",
    "overlaps",
    "misses",
    "no range",
    "no value",
)
TOLD, NOT_TOLD = "told apart", "not told apart"
VERDICTS = (INSIDE, OVERLAPS, MISSES, WITHOUT, NOTHING, TOLD, NOT_TOLD)
RECORDING = "recording"  # ids that begin so belong to the second table

Place = tuple[str, str]  # id, at


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
    def place(self) -> Place:
        """What names a row."""
        return self.id, self.at


def judge(low: float | None, high: float | None, p5: float, p95: float) -> str:
    """*Inside*: the central 90 % lie within the range.

    *overlaps*: a part of them; *misses*: none.
    """
    if math.isnan(p5) or math.isnan(p95):
        return NOTHING
    if low is None and high is None:
        return WITHOUT
    bottom, top = -math.inf if low is None else low, math.inf if high is None else high
    if bottom <= p5 and p95 <= top:
        return INSIDE
    return OVERLAPS if p5 <= top and p95 >= bottom else MISSES


def points(values: ArrayLike) -> tuple[float, float, float, int]:
    """Median, 5 and 95 % points and number of the finite values; NaN where there is none."""
    finite = np.asarray(values, dtype=float).ravel()
    finite = finite[np.isfinite(finite)]
    if finite.size == 0:
        return math.nan, math.nan, math.nan, 0
    median, p5, p95 = (float(value) for value in np.percentile(finite, [50, 5, 95]))
    return median, p5, p95, int(finite.size)


def compare(measured: Range, values: ArrayLike) -> Comparison:
    """Put simulated values beside a measured range."""
    median, p5, p95, n = points(values)
    verdict = judge(measured.low, measured.high, p5, p95)
    return Comparison(
        **asdict(measured), median=median, p5=p5, p95=p95, n=n, verdict=verdict
    )


def read_ranges(path: Path = RANGES) -> dict[Place, Range]:
    """The measured ranges, by id and conditions, in the order of the file."""
    with path.open(encoding="utf-8", newline="") as file:
        found = [Range(**_read(line, ("low", "high"))) for line in csv.DictReader(file)]
    return {(one.id, one.at): one for one in found}


def write_results(path: Path, heading: str, found: Sequence[Comparison]) -> None:
    """Store comparisons under one line that says what they are.

    The reasons of a former file stay.
    """
    former = (
        {one.place: one.reason for one in read_results(path)[1]}
        if path.exists()
        else {}
    )
    names = [field.name for field in fields(Comparison)]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {' '.join(heading.split())}\n")
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        for one in found:
            values = {**asdict(one), "reason": one.reason or former.get(one.place, "")}
            writer.writerow({name: _written(value) for name, value in values.items()})


def read_results(path: Path = RESULTS) -> tuple[str, list[Comparison]]:
    """The heading and the comparisons of a stored file.

    Raises
    ------
    ConfigError    for a file without its heading, or a row with an unknown verdict
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or not lines[0].startswith("# "):
        raise ConfigError(
            f"{path.name} must begin with a line '# ' that says what was compared; make it again"
        )
    found = [
        Comparison(
            **{**_read(line, ("low", "high", "median", "p5", "p95")), **_points(line)}
        )
        for line in csv.DictReader(lines[1:])
    ]
    return lines[0][2:], found


def realism_lines(path: Path = RESULTS) -> list[str]:
    """The section of ``docs/validation.md``; empty where nothing has been compared yet."""
    if not path.exists():
        return []
    heading, found = read_results(path)
    lines = [
        "",
        "## Realism: beside measurements",
        "",
        TEXT,
        "",
        f"Compared: {heading}",
        "",
    ]
    yardstick = [one for one in found if not one.id.startswith(RECORDING)]
    recording = [one for one in found if one.id.startswith(RECORDING)]
    for title, text, figure, rows in (
        ("Yardstick", YARDSTICK_TEXT, "realism_yardstick.png", yardstick),
        ("A healthy recording", RECORDING_TEXT, "realism_recording.png", recording),
    ):
        if rows:
            lines += [
                f"### {title}",
                "",
                text,
                "",
                f"![{title}: simulated beside measured](figures/{figure})",
                "",
                *table(rows),
                "",
            ]
    return lines[:-1]


def table(found: Sequence[Comparison]) -> list[str]:
    """Comparisons as lines of a Markdown table."""
    lines = [
        "| quantity | at | beside | median | 5 to 95 % | values | verdict | source | reason |",
        "|---" * 9 + "|",
    ]
    for one in found:
        name, spread = (
            f"{one.id}, {one.unit}".rstrip(", "),
            f"{_number(one.p5)} to {_number(one.p95)}",
        )
        cells = (
            name,
            one.at,
            shown_range(one),
            _number(one.median),
            spread,
            str(one.n),
            one.verdict,
            one.source,
        )
        lines.append(f"| {' | '.join((*cells, one.reason))} |")
    return lines


def shown_range(one: Range) -> str:
    """A range in words."""
    if one.low is None and one.high is None:
        return ""
    if one.low is None:
        return f"below {one.high:.3g}"
    if one.high is None:
        return f"above {one.low:.3g}"
    return f"{one.low:.3g} to {one.high:.3g}"


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.3g}"


def _written(value: Any) -> Any:
    return (
        "" if value is None else f"{value:.6g}" if isinstance(value, float) else value
    )


def _read(line: Mapping[str, str], numbers: Sequence[str]) -> dict[str, Any]:
    return {
        key: (float(text) if text else None) if key in numbers else text
        for key, text in line.items()
    }


def _points(line: Mapping[str, str]) -> dict[str, Any]:
    return {"n": int(line["n"])}


TEXT = """Made by `python -m benchmarks.realism --stored`, which simulates the records and stores what it finds; this
page shows it. No parameter was chosen by these numbers: all ranges of the simulation were frozen before, in the commit
named here. *Inside*: the central 90 % of the simulated values lie within what is beside them; *overlaps*: a part of
them; *misses*: none; *no value*: nothing could be measured. A miss stays visible, with its reason."""

YARDSTICK_TEXT = """Beside: published recordings of a two-stage parallel spur gearbox, fault on the intermediate shaft,
three speeds x two loads x two sensors, 5 kHz, one specimen a class, so that class and assembly are confounded and one
RMS ratio is known to about 15 %. Ours: every unit runs three speeds (1/3, 2/3 and all of the rated) at two torques
(10 % and all of the rated), records of at least ten turns of the faulted shaft, every sensor, resampled to 5 kHz.
Ratios are those of a faulty record over the healthy record of *another* specimen in the same gearbox at the same speed
and torque; `same_unit`: of the same specimen; `full_band`: as simulated, not resampled. *Slow and light*: a third of
the rated speed and 10 % of the rated torque."""

RECORDING_TEXT = """*Channels*: beside is the range over the channels of one public recording of a healthy pair of 23
and 46 teeth at 2000 r/min, 25.6 kHz; the verdict says whether the channels lie within the simulated 5 to 95 %. Its
module, torque, bearings and error grade are not known: assumed, the grade as the middle of what the experiment draws.
*Width*: the simulated interval over the range of the channels, at most 2 asked. *Wrong teeth*, *errors / 3*,
*errors x 3*: simulated so on purpose, beside the 5 to 95 % of the right simulation; *told apart* where the wrong median
lies outside. Gain changes none of the indicators; rotation is read off the mesh's phase, in simulation and recording
alike."""
