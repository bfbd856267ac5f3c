"""``gensig export`` and ``gensig report``: a data set in another format, or as one page."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from gensig.dataset.exports.export import export as export_folder
from gensig.report.document import write_report


def export(arguments: Namespace) -> int:
    """Write a data set in another format; the data set itself is left alone."""
    made = export_folder(
        Path(arguments.folder),
        arguments.to,
        Path(arguments.out).expanduser(),
        samples=arguments.samples,
        one_channel=arguments.one_channel,
    )
    print(
        f"{arguments.out}: {made['records']} records as {arguments.to}, "
        f"{made['files']} file(s), {made['bytes']} bytes"
    )
    return 0


def report(arguments: Namespace) -> int:
    """Write the page of a data set, in its folder or elsewhere."""
    out = None
    if arguments.out:
        out = Path(arguments.out).expanduser()
    path, text = write_report(Path(arguments.folder), out, per_class=arguments.records)
    print(f"{path}: {text}; open it in a browser")
    return 0
