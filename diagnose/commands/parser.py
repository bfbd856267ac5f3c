"""Arguments that verbs share, and the refusal of a folder that holds something."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gensig.errors import DatasetError
from gensig.terminal.printing import remark, show_text

if TYPE_CHECKING:
    from diagnose.recordings.source import Source
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


# Arguments that verbs share, by their names.
ARGUMENTS: dict[str, dict[str, Any]] = {
    "recording": {
        "metavar": "RECORDING",
        "nargs": "+",
        "help": "one or more: .csv, .wav, .npy, .npz, .h5, .hdf5 or .mat",
    },
    "--sampling-rate": {
        "type": float,
        "metavar": "HZ",
        "help": "samples a second, where the file is silent",
    },
    "--healthy-speed-rpm": {
        "type": float,
        "metavar": "RPM",
        "help": "of the healthy recordings (default: --speed-rpm)",
    },
    "--pulses-per-turn": {
        "type": int,
        "default": 1,
        "metavar": "N",
        "help": "of --tacho (default: 1)",
    },
    "--channels": {
        "nargs": "+",
        "metavar": "NAME",
        "help": "of the file; a model takes them in its order",
    },
    "--unit": {
        "default": "m/s2",
        "help": "m/s2 or g, where the column does not say (default: m/s2)",
    },
    "--array": {
        "metavar": "NAME",
        "help": "array of .npz, .h5 or .mat files (default: acceleration)",
    },
    "--json": {"action": "store_true", "help": "print everything as JSON"},
}


def add_shared(parser: ArgumentParser, *names: str) -> None:
    """Add some of `ARGUMENTS`."""
    for name in names:
        parser.add_argument(name, **ARGUMENTS[name])


def add_tacho(parser: ArgumentParser, shaft: str) -> None:
    """Add the channel with the pulses of a shaft, which the help names."""
    text = f"pulses of the {shaft} shaft, to follow its speed"
    parser.add_argument("--tacho", metavar="CHANNEL", help=text)
    add_shared(parser, "--pulses-per-turn")


def described(arguments: Namespace, file: str, **further: Any) -> Source:
    """A recording as the arguments describe it."""
    from diagnose.recordings.source import Source

    return Source(
        file=file,
        sampling_rate=arguments.sampling_rate,
        tacho=arguments.tacho,
        pulses_per_turn=arguments.pulses_per_turn,
        channels=arguments.channels and tuple(arguments.channels),
        unit=arguments.unit,
        array=arguments.array,
        **further,
    )


def show_json(results: Sequence[Mapping[str, Any]]) -> None:
    """Print results as JSON, a single one by itself."""
    import json

    printed = results[0] if len(results) == 1 else results
    show_text(json.dumps(printed, indent=2, allow_nan=False))


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
