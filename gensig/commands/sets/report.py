"""The verb report: a data set as one page to look at."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from gensig.report.document import write_report


def report(arguments: Namespace) -> int:
    """Write the page, beside or away from the data set, which is left alone."""
    out = Path(arguments.out).expanduser() if arguments.out else None
    path, said = write_report(Path(arguments.folder), out, per_class=arguments.records)
    print(f"{path}: {said}; open it in a browser")
    return 0
