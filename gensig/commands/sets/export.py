"""The verb export: a data set in another format."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from gensig.dataset.exports.export import export as export_folder


def export(arguments: Namespace) -> int:
    """Write a data set in another format, beside the data set itself."""
    made = export_folder(
        Path(arguments.folder),
        arguments.to,
        Path(arguments.out).expanduser(),
        samples=arguments.samples,
        one_channel=arguments.one_channel,
    )
    print(
        f"{arguments.out}: {made['records']} records as {arguments.to}, {made['files']} file(s), {made['bytes']} bytes"
    )
    return 0
