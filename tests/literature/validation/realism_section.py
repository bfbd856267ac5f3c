"""The results in docs/howto/realism.md: simulated records beside measured ranges."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gensig.report.realism import (
    RECORDING,
    RESULTS,
    Comparison,
    read_results,
    table,
)

TEXT = """\
Made by `python -m benchmarks.realism --stored`, which simulates the records and stores what it
finds; this page shows it. No parameter was chosen by these numbers: all ranges of the
simulation were frozen before, in the commit named here. *Inside*: the central 90 % of the
simulated values lie within what is beside them; *overlaps*: a part of them; *misses*: none; *no
value*: nothing could be measured. A miss stays visible, with its reason."""

YARDSTICK_TEXT = """\
Beside: published recordings of a two-stage parallel spur gearbox, fault on the intermediate
shaft, three speeds x two loads x two sensors, 5 kHz, one specimen a class, so that class and
assembly are confounded and one RMS ratio is known to about 15 %. Ours: every unit runs three
speeds (1/3, 2/3 and all of the rated) at two torques (10 % and all of the rated), records of at
least ten turns of the faulted shaft, every sensor, resampled to 5 kHz. Ratios are those of a
faulty record over the healthy record of *another* specimen in the same gearbox at the same
speed and torque; `same_unit`: of the same specimen; `full_band`: as simulated, not resampled.
*Slow and light*: a third of the rated speed and 10 % of the rated torque."""

RECORDING_TEXT = """\
*Channels*: beside is the range over the channels of one public recording of a healthy pair of
23 and 46 teeth at 2000 r/min, 25.6 kHz; the verdict says whether the channels lie within the
simulated 5 to 95 %. Its module, torque, bearings and error grade are not known: assumed, the
grade as the middle of what the experiment draws. *Width*: the simulated interval over the range
of the channels, at most 2 asked. *Wrong teeth*, *errors / 3*, *errors x 3*: simulated so on
purpose, beside the 5 to 95 % of the right simulation; *told apart* where the wrong median lies
outside. Gain changes none of the indicators; rotation is read off the mesh's phase, in
simulation and recording alike."""


def realism_lines(path: Path = RESULTS) -> list[str]:
    """Lines of the section; none where nothing has been compared yet."""
    if not path.exists():
        return []
    heading, rows = read_results(path)
    lines = [
        "",
        "## Results",
        "",
        TEXT,
        "",
        f"Compared: {heading}",
    ]
    recording = [row for row in rows if row.id.startswith(RECORDING)]
    yardstick = [row for row in rows if row not in recording]
    lines += _part("Yardstick", YARDSTICK_TEXT, "yardstick", yardstick)
    lines += _part("A healthy recording", RECORDING_TEXT, "recording", recording)
    return lines


def _part(title: str, text: str, figure: str, rows: Sequence[Comparison]) -> list[str]:
    """One table of the section with its figure."""
    if not rows:
        return []
    picture = f"![{title}: simulated beside measured](../figures/realism_{figure}.png)"
    return ["", f"### {title}", "", text, "", picture, "", *table(rows)]
