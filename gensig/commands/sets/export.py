"""``gensig export`` and ``gensig report``: a data set in another format, or as one page."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from gensig.commands.console import step
from gensig.dataset.exports.export import HUGGING_FACE
from gensig.dataset.exports.export import export as export_folder
from gensig.report.document import write_report
from gensig.terminal.printing import show


def export(arguments: Namespace) -> int:
    """Write a data set in another format; the data set itself is left alone."""
    out = Path(arguments.out).expanduser()
    made = export_folder(
        Path(arguments.folder),
        arguments.to,
        out,
        samples=arguments.samples,
        one_channel=arguments.one_channel,
        protocols=arguments.protocol,
    )
    show(
        f"{arguments.out}: {made['records']} records as {arguments.to}, "
        f"{made['files']} file(s), {made['bytes']} bytes"
    )
    if arguments.to == HUGGING_FACE:
        for folder in sorted((out / "data").iterdir()):
            show(f"datasets.load_dataset({str(out)!r}, {folder.name!r})")
    return 0


def report(arguments: Namespace) -> int:
    """Write the page of a data set, in its folder or elsewhere."""
    out = None
    if arguments.out:
        out = Path(arguments.out).expanduser()
    path, text = write_report(
        Path(arguments.folder),
        out,
        per_class=arguments.records,
        on_begin=lambda n: step(f"{arguments.folder}: measuring {n} records"),
    )
    show(f"{path}: {text}; open it in a browser")
    return 0
