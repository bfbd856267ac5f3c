"""``gensig verify``, ``reproduce`` and ``inspect``: checks of a data set on disk."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from gensig.dataset.folder.inspection import inspect as inspect_path
from gensig.dataset.folder.verify import verify as verify_folder
from gensig.errors import ConfigError
from gensig.terminal.printing import show, show_text
from gensig.text.amounts import typed_count


def verify(arguments: Namespace) -> int:
    """Print every problem of a data set; the exit status is 0 for a whole and unaltered one."""
    folder, depth = arguments.folder, "every byte"
    result = verify_folder(Path(folder), quick=arguments.quick)
    show(*result.problems)
    if result.problems:
        show(f"{folder} is NOT whole: {len(result.problems)} problem(s)")
        return 1
    if arguments.quick:
        depth = "sizes and manifest"
    records = f"{result.n_records} records"
    if result.n_failed:
        records += f", {result.n_failed} marked failed"
    show(f"{folder} is whole and unaltered ({depth} checked): {records}")
    return 0


def reproduce(arguments: Namespace) -> int:
    """Simulate records anew from their parameters and compare; exit status 0 where they agree."""
    from gensig.production.reproduction import ACCEPTED
    from gensig.production.reproduction import reproduce as reproduce_records

    records = _wanted_records(arguments.records)
    result = reproduce_records(Path(arguments.folder), records)
    for name, (recorded, present) in result.other.items():
        recorded, present = recorded or "unknown", present or "unknown"
        show(f"made with {name} {recorded}, here is {present}")
    line = f"{result.n_equal} of {result.n_records} records have the same bits"
    if result.n_failed:
        line += (
            f"; {result.n_failed} failed again for the same reason and hold no signal"
        )
    show(line)
    if result.worst:
        accepted = "here every bit must agree"
        if result.other:
            accepted = f"{ACCEPTED:g} is accepted"
        largest, worst = result.largest, result.worst
        show(f"largest difference {largest:.2g} of the record's RMS, in {worst}")
        show(f"{result.n_refused} record(s) NOT reproduced; {accepted}")
    return int(result.n_refused > 0)


def _wanted_records(given: str) -> int | list[str]:
    """A number of records, or the ids or numbers of some, several with commas between them."""
    count = typed_count(given)
    if count is None and given.lstrip("-").isdecimal():
        count = int(given)
    records = [name for name in map(str.strip, given.split(",")) if name]
    if not records or (count is not None and count < 1):
        raise ConfigError(f"--records {given} must be at least 1, or name records")
    return records if count is None else count


def inspect(arguments: Namespace) -> int:
    """Print what a data set, an HDF5 file or a CSV holds."""
    path = Path(arguments.path)
    if path.suffix.lower() == ".csv" and path.is_file():
        from gensig.commands.sets.table_text import table_text

        show_text(table_text(arguments.path))
        return 0
    show_text(inspect_path(path))
    return 0
