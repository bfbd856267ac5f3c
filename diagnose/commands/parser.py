"""Arguments that verbs share, and the refusal of a folder that holds something."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import TYPE_CHECKING

from gensig.errors import DatasetError
from gensig.terminal.printing import remark

if TYPE_CHECKING:
    from diagnose.training.store import ModelDescription


def add_overrides(parser: ArgumentParser, metavar: str = "key=value") -> None:
    """Add words of the form key=value, which the help explains."""
    parser.add_argument("overrides", nargs="*", metavar=metavar, help="see above")


def add_model(parser: ArgumentParser, *, required: bool = True) -> None:
    """Add the folder of a network; where it is not required, one comes with gensig."""
    text = "folder that diagnose train wrote below models/"
    if not required:
        text += " (default: the network for any pair of gears that comes with gensig)"
    parser.add_argument("--model", required=required, metavar="DIR", help=text)


def add_recordings(parser: ArgumentParser) -> None:
    """Add the recordings that are looked at."""
    parser.add_argument(
        "recording",
        metavar="RECORDING",
        nargs="+",
        help="one or more: .csv, .wav, .npy, .npz, .h5, .hdf5 or .mat",
    )


def add_sampling_rate(parser: ArgumentParser) -> None:
    """Add the rate of recordings that do not tell theirs."""
    parser.add_argument(
        "--sampling-rate",
        type=float,
        metavar="HZ",
        help="samples a second, where the file is silent",
    )


def add_healthy_speed(parser: ArgumentParser) -> None:
    """Add the speed of healthy recordings."""
    parser.add_argument(
        "--healthy-speed-rpm",
        type=float,
        metavar="RPM",
        help="of the healthy recordings (default: --speed-rpm)",
    )


def add_tacho(parser: ArgumentParser, shaft: str) -> None:
    """Add the channel with the pulses of a shaft, which the help names."""
    parser.add_argument(
        "--tacho",
        metavar="CHANNEL",
        help=f"pulses of the {shaft} shaft, to follow its speed",
    )
    parser.add_argument(
        "--pulses-per-turn",
        type=int,
        default=1,
        metavar="N",
        help="of --tacho (default: 1)",
    )


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


def note_unsigned(folder: str | Path, description: ModelDescription) -> None:
    """Say on stderr that a model of an older version has no sha256 to be checked by."""
    from diagnose.training.model_files import NOT_SIGNED

    if not description.is_signed:
        remark("diagnose", f"note: {folder} {NOT_SIGNED}")


def refuse_existing(folder: Path) -> None:
    """Refuse an output folder that holds anything; touches nothing."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        raise DatasetError(
            f"out={folder} exists and is not an empty folder; choose another or remove it"
        )
