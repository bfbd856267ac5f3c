"""``diagnose predict``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from diagnose.commands.parser import (
    add_model,
    add_shared,
    add_tacho,
    described,
    note_unsigned,
    show_json,
)
from gensig.errors import ConfigError
from gensig.terminal.printing import remark, show

if TYPE_CHECKING:
    from diagnose.recordings.source import Source
    from diagnose.recordings.stored_network import StoredNetwork

HELP = """\
Class probabilities of one recording, or how long the machine still runs, with a flag for
recordings unlike the training data.

A model takes windows of its length, at its rate, of a speed that does not change within them. The
recording is resampled to that rate; one with less bandwidth is refused. Where the speed wanders,
order tracking plays the recording at one speed, its mean or --to-speed: with --tacho by the pulses
of the driving shaft, with --teeth and --speed-rpm by the mesh. A model of remaining life must know
speed and torque too.

A recording that carried implants in the training is refused; with --held-out only what was held
out of it is scored."""
EXAMPLE = """\
examples:
  diagnose predict mine.wav --teeth 23 46 --speed-rpm 1800
  diagnose predict --model report/models/new_machine-seed0 a.csv --channels left --speed-rpm 1500
  diagnose predict --model report/models/new_machine-seed0 runup.csv --tacho pulses
  diagnose predict --model report/models/new_machine-seed0 bench.csv --teeth 23 84 --speed-rpm 1500
  diagnose predict --model runs/mine_report/models/new_machine-seed0 monday.csv --held-out
  diagnose predict --model runs/hours/models/by_unit-cnn-seed0 a.csv --speed-rpm 90 --torque-nm 9"""
OUT_OF_DISTRIBUTION = 3
EXITS = {
    0: "predicted, and like the training data (or the model is too old to tell)",
    OUT_OF_DISTRIBUTION: "predicted, but out of distribution: do not rely on the class",
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_shared(parser, "recording")
    add_model(parser, required=False)
    _add_rotation(parser)
    add_shared(parser, "--channels", "--unit", "--array")
    parser.add_argument(
        "--held-out",
        action="store_true",
        help="of a recording that carried implants in the training, score only what was held out",
    )
    _add_healthy(parser)
    parser.add_argument(
        "--torque-nm",
        type=float,
        metavar="NM",
        help="of the driving shaft, for remaining lives",
    )
    parser.add_argument(
        "--life-time-h",
        type=float,
        metavar="H",
        help="since new, for remaining lives with the age",
    )
    parser.add_argument(
        "--plot",
        metavar="FILE",
        help="picture of the most suspicious tooth (.png); of one recording",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print everything, window by window, as JSON",
    )


def _add_healthy(parser: ArgumentParser) -> None:
    """Add the arguments on healthy recordings of the same machine."""
    parser.add_argument(
        "--healthy",
        metavar="FILE",
        nargs="+",
        default=[],
        help="of the same machine when healthy, for models with_reference",
    )
    add_shared(parser, "--healthy-speed-rpm")


def _add_rotation(parser: ArgumentParser) -> None:
    """Add the arguments on rates, speeds and order tracking."""
    add_shared(parser, "--sampling-rate")
    parser.add_argument(
        "--speed-rpm",
        type=float,
        metavar="RPM",
        help="of the driving shaft: was it trained at such?",
    )
    parser.add_argument(
        "--teeth",
        nargs=2,
        type=int,
        metavar=("DRIVING", "DRIVEN"),
        help="was it trained at such?",
    )
    add_tacho(parser, "driving")
    parser.add_argument(
        "--to-speed",
        type=float,
        metavar="RPM",
        help="play it at this speed of the training instead",
    )
    parser.add_argument(
        "--as-recorded",
        action="store_true",
        help="no order tracking, even with --teeth or --tacho",
    )


def run(arguments: Namespace) -> int:
    """Print the answers; exit status 3 if a recording is unlike the training data."""
    from diagnose.recordings.predict import predict_recording
    from diagnose.recordings.registry import open_network, shipped_network
    from diagnose.training.carried import BY_CHECKSUM
    from diagnose.training.store import load_domain

    sources = _sources(arguments)
    if arguments.plot and len(sources) > 1:
        raise ConfigError("--plot is the picture of one recording; give one")
    if arguments.plot and not arguments.plot.endswith(".png"):
        raise ConfigError(f"--plot {arguments.plot} must end in .png")
    folder = arguments.model or shipped_network()
    network = open_network(folder)
    note_unsigned(folder, network.description)
    if arguments.held_out and network.description.carried is None:
        raise ConfigError(
            f"--held-out: {folder} knows of no implants (trained on none, or too old); leave it out"
        )
    carried = network.description.carried
    if carried is not None and not carried.fingerprints:
        remark("diagnose", f"note: {BY_CHECKSUM}")
    domain = load_domain(folder, network.description)
    if arguments.plot:
        _plot(arguments.plot, network, sources[0])
    results = []
    for source in sources:
        result = predict_recording(network, domain, source)
        results.append({"model": str(folder), **result})
        if not arguments.json:
            show(network.line(result) + _held_out_text(arguments, result))
    if arguments.json:
        show_json(results)
    if any(result["out_of_distribution"] for result in results):
        return OUT_OF_DISTRIBUTION
    return 0


def _sources(arguments: Namespace) -> list[Source]:
    """Recordings as they are described, with the healthy ones of the same machine."""
    from dataclasses import replace

    sources = [
        described(
            arguments,
            recording,
            speed_rpm=arguments.speed_rpm,
            teeth=arguments.teeth and tuple(arguments.teeth),
            as_recorded=arguments.as_recorded,
            to_speed_rpm=arguments.to_speed,
            torque_nm=arguments.torque_nm,
            life_time_h=arguments.life_time_h,
            held_out=arguments.held_out,
        )
        for recording in arguments.recording
    ]
    speed = arguments.healthy_speed_rpm or arguments.speed_rpm
    return [
        replace(
            source,
            healthy=tuple(
                replace(source, file=file, speed_rpm=speed)
                for file in arguments.healthy
            ),
        )
        for source in sources
    ]


def _held_out_text(arguments: Namespace, result: Mapping[str, Any]) -> str:
    """Samples that were scored, where those held out are asked for."""
    if not arguments.held_out:
        return ""
    part = result["held_out"]
    if part is None:
        return "; held out: it carried nothing in the training, all of it was scored"
    return (
        f"; held out: only samples {part['start_sample']} to {part['stop_sample']} "
        f"({part['start_s']:.4g} to {part['stop_s']:.4g} s) of {part['n_samples_recorded']} "
        "were scored, the others carried implants in the training"
    )


def _plot(file: str, network: StoredNetwork, source: Source) -> None:
    """Write the picture of the most suspicious tooth of a recording."""
    from pathlib import Path

    from diagnose.recordings.accused import accused_tooth
    from diagnose.report.tooth_figure import tooth_figure

    accused = accused_tooth(network, source)
    title = f"{Path(source.file).name}: {accused.gear}, tooth {accused.tooth}"
    tooth_figure(Path(file), accused, title)
