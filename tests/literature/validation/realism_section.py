"""The results in docs/howto/realism.md: simulated records beside measured ranges."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

from benchmarks._realism_results import RECORDING, RESULTS, read_results
from gensig.report.realism import (
    APART,
    MISSES,
    OVERLAPS,
    Comparison,
    number_text,
    shown_range,
)
from gensig.text.markdown import table_lines

WIDTH = 100
ALL, CHANNELS, SPREAD = "all conditions", "channels", "width"
COLUMNS = ("quantity", "measured", "simulated: median [5, 95 %]", "verdict")

TEXT = """\
Made by `python -m benchmarks.realism --stored`. No parameter was chosen by these numbers: all
ranges of the simulation were frozen before, in the commit named here. *Inside*: the central 90 % of
the simulated values lie within the measured range; *overlaps*: a part of them; *misses*: none.
Every row with its reason, those without a measured range too:
[realism_results.csv](../../gensig/report/realism_results.csv)."""

YARDSTICK_TEXT = """\
Measured: published recordings of a two-stage parallel spur gearbox, fault on the intermediate
shaft, three speeds x two loads x two sensors, 5 kHz. There is one set of gears a class, so that
class and assembly are confounded and one RMS ratio is known to about 15 %. *Slow and light*: a
third of the rated speed and 10 % of the rated torque."""

RECORDING_TEXT = """\
Measured: the range over the channels of one public recording of a healthy pair of 23 and 46 teeth
at 2000 r/min, 25.6 kHz. The verdict says whether the channels lie within the simulated 5 to 95 %.
Module, torque, bearings and grade of the recorded gears are not known: assumed, the grade as the
middle of what the experiment draws. *Told apart*: the median of a simulation that is wrong on
purpose lies outside the 5 to 95 % of the right one."""


def realism_lines(path: Path = RESULTS) -> list[str]:
    """Lines of the section; none where nothing has been compared yet."""
    if not path.exists():
        return []
    heading, rows = read_results(path)
    recording = [row for row in rows if row.id.startswith(RECORDING)]
    yardstick = [row for row in rows if row not in recording and shown_range(row)]
    channels = [row for row in recording if row.at == CHANNELS]
    others = [row for row in recording if row not in channels]
    lines = ["", "## Results", "", *_filled(TEXT), "", *_filled(f"Compared: {heading}")]
    lines += _part("Yardstick", YARDSTICK_TEXT, "yardstick", yardstick)
    lines += _part("A healthy recording", RECORDING_TEXT, "recording", channels)
    if others:
        lines += ["", *[line for item in _answers(others) for line in _filled(item)]]
    return lines


def _part(title: str, text: str, figure: str, rows: Sequence[Comparison]) -> list[str]:
    """One table of the section with its figure; rows that overlap are counted."""
    if not rows:
        return []
    picture = f"![{title}: simulated beside measured](../figures/realism_{figure}.png)"
    told = [row for row in rows if row.verdict != OVERLAPS]
    count = f"{len(rows) - len(told)} of {len(rows)} rows overlap; the others:"
    head = ["", f"### {title}", "", *_filled(text), "", picture, ""]
    return [*head, count, "", *_table(told)]


def _table(rows: Sequence[Comparison]) -> list[str]:
    cells = []
    for row in rows:
        middle, *ends = map(number_text, (row.median, row.p5, row.p95))
        values = f"{middle} [{', '.join(ends)}]"
        cells.append((_name(row), shown_range(row), values, row.verdict))
    return table_lines(COLUMNS, cells)


def _name(row: Comparison) -> str:
    """Quantity, unit and conditions, where they are not all."""
    at = "" if row.at in (ALL, CHANNELS) else row.at
    name = row.id.removeprefix(f"{RECORDING}.")
    return ", ".join(part for part in (name, row.unit, at) if part)


def _answers(rows: Sequence[Comparison]) -> list[str]:
    """Quantities of the recording that are simulated too wide, and those that tell it apart."""
    named: dict[str, list[str]] = {row.at: [] for row in rows}
    for row in rows:
        if row.verdict in (MISSES, APART):
            named[row.at].append(row.id.removeprefix(f"{RECORDING}."))
    questions = {
        at: "simulated more than twice as wide"
        if at == SPREAD
        else f"{at} told apart by"
        for at in named
    }
    return [
        f"- {questions[at]}: {', '.join(names) or 'none'}."
        for at, names in named.items()
    ]


def _filled(text: str) -> list[str]:
    return textwrap.wrap(
        " ".join(text.split()),
        WIDTH,
        subsequent_indent="  " if text.startswith("- ") else "",
        break_long_words=False,
        break_on_hyphens=False,
    )
