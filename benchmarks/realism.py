"""``python -m benchmarks.realism``: simulated records beside measured ones, quantity by quantity.

Makes the data sets of the yardstick from ``experiment=realistic`` (or ``--base``), healthy and
faulty at three speeds and two torques, and of a healthy machine like that of one public
recording; resamples them to 5 kHz and 25.6 kHz; prints what is measured beside what is
simulated. The recording is read from the folder ``$GENSIG_MEASURED`` where it is set. What is
compared and how it is judged: ``gensig/report/realism.py``; nothing here is a target to tune
to.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import shlex
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks import _realism_figures as figures
from benchmarks._measure import machine, print_machine
from benchmarks._realism_recording import (
    VARIABLE,
    find_recording,
    recording_comparisons,
    recording_indicators,
    simulated_indicators,
)
from benchmarks._realism_results import RESULTS, read_results, table, write_results
from benchmarks._realism_sets import (
    ADDED,
    CONTROLS,
    GRIDS,
    QUICK,
    Grid,
    Size,
    kept,
    recording_words,
    yardstick_words,
)
from benchmarks._realism_values import quantities, read_table
from gensig.errors import GensigError
from gensig.report.realism import Comparison, RangeKey, compare, read_ranges
from gensig.version import __version__

ROOT = Path(__file__).resolve().parent.parent
FIGURES = ROOT / "docs" / "figures"
BASE = "experiment=realistic"
HEALTHY = "healthy"
# in the heading of stored results, before that of rows made alone
ADDED_HEADING = "; surface_damage and missing_tooth_run_in: "
PAGE = "gensig validate --markdown docs/validation.md"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; 0 when it was made, whatever it says."""
    options = _parser().parse_args(arguments)
    if options.stored and not re.fullmatch(r"[0-9a-f]{7,40}", options.frozen or ""):
        print(
            "benchmarks.realism: --stored needs --frozen COMMIT, the commit that froze the ranges",
            file=sys.stderr,
        )
        return 2
    if options.added and not options.stored:
        print(
            "benchmarks.realism: --added puts rows into the stored results; it needs --stored",
            file=sys.stderr,
        )
        return 2
    if options.stored and options.quick:
        print(
            "benchmarks.realism: --quick simulates too few units to store; leave it out",
            file=sys.stderr,
        )
        return 2
    size, base, begun = Size(), shlex.split(options.base), time.perf_counter()
    if options.quick:
        size = QUICK
    if options.added:
        size = ADDED
    named = machine()
    print_machine(named)
    pictures = FIGURES if options.stored else options.figures
    heading = (
        f"{' '.join(base)}, gensig {__version__}, {size.n_units} units in "
        f"{size.n_gearboxes} gearboxes; "
        f"ranges frozen in commit {options.frozen or '(none named)'}"
    )
    place = nullcontext(options.data) if options.data else tempfile.TemporaryDirectory()
    try:
        with place as folder:
            if options.added:
                heading, result = add_to_stored(
                    base, size, Path(folder), heading, FIGURES
                )
            else:
                result = compare_all(base, size, Path(folder), pictures)
    except (GensigError, OSError) as error:
        print(f"benchmarks.realism: {error}", file=sys.stderr)
        return 1
    print(
        "\n".join(
            [
                "",
                heading,
                "",
                *table(result),
                "",
                f"{time.perf_counter() - begun:.0f} s",
            ]
        )
    )
    if options.json:
        rows = [
            {key: _plain(value) for key, value in asdict(one).items()} for one in result
        ]
        text = json.dumps(
            {"machine": named, "compared": heading, "rows": rows}, indent=1
        )
        options.json.write_text(text + "\n", encoding="utf-8")
    if options.stored:
        write_results(RESULTS, heading, result)
        print(
            f"stored in {RESULTS.name}; write the reasons of misses into its last column, "
            f"then run {PAGE}"
        )
    return 0


def compare_all(
    base: Sequence[str], size: Size, folder: Path, pictures: Path | None
) -> list[Comparison]:
    """Make or open all data sets and put them beside what is measured.

    Parameters
    ----------
    base : overrides that the data sets start from
    folder : where the data sets are kept
    pictures : folder of the figures, None for none
    """
    yardstick = yardstick_comparisons(base, size, folder)
    recording = find_recording()
    if recording is None:
        print(
            f"The real recording is left out: ${VARIABLE} names no folder that holds it."
        )
    recorded = (
        None
        if recording is None
        else recording_indicators(recording, size.recording_duration)
    )
    simulated = {}
    for control in CONTROLS:
        name = re.sub(r"\W+", "_", f"recording {control.replace('/', 'over')}")
        with kept(folder / name, recording_words(base, size, control)) as data:
            simulated[control] = simulated_indicators(data)
        print(f"{name}: {data.n_records} records", flush=True)
    if pictures is not None:
        figures.plot_yardstick(yardstick, pictures / "realism_yardstick.png")
        figures.plot_recording(simulated, recorded, pictures / "realism_recording.png")
    return yardstick + recording_comparisons(simulated, recorded)


def yardstick_comparisons(
    base: Sequence[str], size: Size, folder: Path, grids: Sequence[Grid] = GRIDS
) -> list[Comparison]:
    """Rows of the first table; without the first grid only those of the others."""
    values: dict[RangeKey, Any] = {}
    for grid in grids:
        with kept(folder / grid.name, yardstick_words(base, size, grid)) as data:
            result = read_table(data)
        least = result.indicators["n_turns"].min()
        told = (
            f"{data.n_records} records, {result.n_failed} failed, at least {least:.0f} turns of "
            "the faulted shaft"
        )
        print(f"{grid.name}: {told}", flush=True)
        for (name, at), found in quantities(result).items():
            fault, dot, indicator = name.partition(".")
            if fault != HEALTHY:
                values[f"{fault}{grid.suffix}{dot}{indicator}", at] = found
            elif grid is GRIDS[0]:
                values[name, at] = found
    ranges = read_ranges()
    if GRIDS[0] not in grids:
        ranges = {place: one for place, one in ranges.items() if place in values}
    return [compare(one, values.get(place, math.nan)) for place, one in ranges.items()]


def add_to_stored(
    base: Sequence[str], size: Size, folder: Path, heading: str, pictures: Path
) -> tuple[str, list[Comparison]]:
    """Heading and rows of the stored results with the rows of the added grids made now.

    All other rows stay as they are stored.
    """
    stored_heading, stored = read_results(RESULTS)
    made = {
        row.key: row for row in yardstick_comparisons(base, size, folder, GRIDS[1:])
    }
    rows = {row.key: row for row in stored} | made
    yardstick = [rows.pop(place) for place in read_ranges() if place in rows]
    figures.plot_yardstick(yardstick, pictures / "realism_yardstick.png")
    first = stored_heading.partition(ADDED_HEADING)[0]
    return f"{first}{ADDED_HEADING}{heading}", [*yardstick, *rows.values()]


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.realism", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument(
        "--base",
        default=BASE,
        help="overrides to start from, quoted (default: %(default)s)",
    )
    parser.add_argument("--quick", action="store_true", help="8 units instead of 40")
    parser.add_argument(
        "--data",
        type=Path,
        help="folder of the data sets: read where they are there, else made and kept",
    )
    parser.add_argument("--figures", type=Path, help="folder to draw the figures in")
    parser.add_argument(
        "--json", type=Path, help="also write the table, with the machine, to this file"
    )
    parser.add_argument(
        "--stored",
        action="store_true",
        help="store the results and figures for docs/howto/realism.md",
    )
    parser.add_argument(
        "--added",
        action="store_true",
        help="with --stored: make surface damage and run-in alone, other stored rows stay",
    )
    parser.add_argument(
        "--frozen",
        help="commit that froze all ranges of the simulation; --stored needs it",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
