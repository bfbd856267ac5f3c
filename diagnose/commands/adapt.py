"""``diagnose adapt``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from diagnose.commands.parser import add_model, add_recording_options, refuse_existing

HELP = """\
Move a trained network to a machine by healthy recordings of it, and write it as another model for
predict.

A difference between the healthy recordings and the healthy training data is taken for the effect
of the machine's path, sensors and noise, and undone. Healthy recordings cannot show whether faults
are moved alike: docs/howto/bridge.md says what was gained and lost where it could be measured.
Recordings that carried implants in the training are taken: nothing is judged by them.
Speeds and loads should be those of the training."""
EXAMPLE = """\
example:
  diagnose adapt --model report/models/new_machine-seed0 --healthy a.csv --method coral --out mine
  diagnose predict --model mine today.csv"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_model(parser)
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
        help="adabn for networks with batch normalisations, coral for any",
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
    add_recording_options(parser)


def run(arguments: Namespace) -> int:
    """Write the adapted model and print its answers for the recordings before and after."""
    out = Path(arguments.out)
    refuse_existing(out)
    from diagnose.recordings.machine import adapt_model
    from diagnose.recordings.source import Source

    sources = [
        Source(
            file=file,
            sampling_rate=arguments.sampling_rate,
            speed_rpm=arguments.speed_rpm,
            channels=arguments.channels and tuple(arguments.channels),
            unit=arguments.unit,
            array=arguments.array,
        )
        for file in arguments.healthy
    ]
    result = adapt_model(arguments.model, sources, arguments.method, out)
    before, after, n_windows = result["before"], result["after"], result["n_windows"]
    print(
        f"{out}: adapted by {result['method']} to {result['n_recordings']} healthy recording(s), "
        f"{n_windows} windows; of these, called healthy {before['probability_healthy']:.2f} "
        f"before and {after['probability_healthy']:.2f} after (mean probability)"
    )
    if after["n_windows_beyond"] is not None:
        print(
            f"unlike the training data: {before['n_windows_beyond']} of {n_windows} windows "
            f"before, {after['n_windows_beyond']} after"
        )
    if result["carried"]:
        print(
            f"{', '.join(result['carried'])}: carried implants in the training; what is said of "
            "them above is memory"
        )
    print(
        "Healthy recordings cannot show whether faults are still found: docs/howto/bridge.md"
    )
    return 0
