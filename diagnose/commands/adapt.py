"""``diagnose adapt``."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from diagnose.commands.parser import Parser, refuse_existing, verb_parser

HELP = """\
Move a trained network to a machine by healthy recordings of it, and write it as another model for predict.

What healthy recordings of the machine have instead of the healthy training data is taken for the effect of its path,
sensors and noise, and undone. Whether faults are moved alike cannot be seen from healthy recordings:
docs/howto/bridge.md says what was gained and lost where it could be measured. Speeds and loads should be those of the
training."""
EXAMPLE = """\
example:
  diagnose adapt --model runs/report/models/by_unit-seed0 --healthy a.csv b.csv --method adabn --out runs/mine
  diagnose predict --model runs/mine today.csv"""


def parser() -> Parser:
    """The verb's parser, with its help."""
    parser = verb_parser("adapt", HELP, EXAMPLE)
    add_arguments(parser)
    return parser


def add_arguments(parser: ArgumentParser) -> None:
    """What can be typed behind the verb."""
    parser.add_argument(
        "--model",
        required=True,
        metavar="DIR",
        help="folder that diagnose train wrote below models/",
    )
    parser.add_argument(
        "--healthy",
        required=True,
        nargs="+",
        metavar="RECORDING",
        help="as diagnose predict takes",
    )
    parser.add_argument(
        "--method",
        required=True,
        choices=("adabn", "coral"),
        help="see docs/howto/bridge.md",
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder to write; must not exist or be empty",
    )
    parser.add_argument(
        "--sampling-rate",
        type=float,
        metavar="HZ",
        help="samples a second, where files are silent",
    )
    parser.add_argument(
        "--speed-rpm",
        type=float,
        metavar="RPM",
        help="of the driving shaft; one not trained is refused",
    )
    parser.add_argument(
        "--channels",
        nargs="+",
        metavar="NAME",
        help="for the model's channels, in their order",
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


def run(words: Sequence[str]) -> int:
    """Write the adapted model and say what changed for the recordings that it was adapted by."""
    arguments = parser().parse_args(words)
    out = Path(arguments.out)
    refuse_existing(out)
    from diagnose.recordings.machine import adapt_model
    from diagnose.recordings.source import Source

    sources = [
        Source(
            file=file,
            sampling_rate=arguments.sampling_rate,
            speed_rpm=arguments.speed_rpm,
            channels=None if arguments.channels is None else tuple(arguments.channels),
            unit=arguments.unit,
            array=arguments.array,
        )
        for file in arguments.healthy
    ]
    result = adapt_model(arguments.model, sources, arguments.method, out)
    before, after, n_windows = result["before"], result["after"], result["n_windows"]
    print(
        f"{out}: adapted by {result['method']} to {result['n_recordings']} healthy recording(s), {n_windows} windows; "
        f"of these, called healthy {before['probability_healthy']:.2f} before and {after['probability_healthy']:.2f} "
        "after (mean probability)"
    )
    if after["n_windows_beyond"] is not None:
        print(
            f"unlike the training data: {before['n_windows_beyond']} of {n_windows} windows before, "
            f"{after['n_windows_beyond']} after"
        )
    print(
        "Healthy recordings cannot show whether faults are still found: docs/howto/bridge.md"
    )
    return 0
