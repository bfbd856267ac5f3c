"""Arguments that verbs share, and the refusal of a folder that holds something."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from gensig.errors import DatasetError


def add_overrides(parser: ArgumentParser, metavar: str = "key=value") -> None:
    """Add words of the form key=value, which the help explains."""
    parser.add_argument("overrides", nargs="*", metavar=metavar, help="see above")


def add_model(parser: ArgumentParser, *, required: bool = True) -> None:
    """Add the folder of a network; where it is not required, one comes with gensig."""
    text = "folder that diagnose train wrote below models/"
    if not required:
        text += " (default: the network for any pair of gears that comes with gensig)"
    parser.add_argument("--model", required=required, metavar="DIR", help=text)


def add_recording_options(parser: ArgumentParser) -> None:
    """Add options on how a recording is read."""
    parser.add_argument(
        "--channels",
        nargs="+",
        metavar="NAME",
        help="of the file; a model takes them in its order",
    )
    parser.add_argument(
        "--unit",
        default="m/s2",
        help="m/s2 or g, where the column does not say (default: m/s2)",
    )
    parser.add_argument(
        "--array",
        metavar="NAME",
        help="array of .npz, .h5 or .mat files (default: acceleration)",
    )


def refuse_existing(folder: Path) -> None:
    """Refuse an output folder that holds anything; touches nothing."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        raise DatasetError(
            f"out={folder} exists and is not an empty folder; choose another or remove it"
        )
