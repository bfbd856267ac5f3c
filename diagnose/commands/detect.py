"""``diagnose detect``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from diagnose.commands.parser import add_shared, add_tacho, described, show_json
from gensig.terminal.printing import show

if TYPE_CHECKING:
    from diagnose.detection.followed_shafts import FollowedRecording
    from diagnose.detection.gear_stages import GearStages

HELP = """\
Compare recordings of a gearbox with healthy recordings of the same gearbox: healthy or changed, by
how much, and where. Nothing is trained and nothing simulated.

The speed is followed by the mesh of any stage, or by --tacho. Every recording needs 4 turns of the
slowest shaft, a single healthy one 8, at 5000 samples a second or more. A sensor mounted anew looks
like a fault; recordings of other mountings, --mounting, make that rarer."""
EXAMPLE = """\
examples:
  diagnose detect today.csv --healthy a.csv b.csv --teeth 23 46 --speed-rpm 1500
  diagnose detect today.csv --healthy a.csv --teeth 32 80 48 64 --speed-rpm 1800
  diagnose detect x.csv y.csv --healthy a.csv --mounting c.csv d.csv --teeth 23 46 --tacho pulses"""
CHANGED = 3
EXITS = {0: "healthy", CHANGED: "at least one recording is changed"}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_shared(parser, "recording")
    parser.add_argument(
        "--healthy",
        metavar="FILE",
        nargs="+",
        required=True,
        help="of the same machine when healthy, best of several sessions",
    )
    parser.add_argument(
        "--mounting",
        metavar="FILE",
        nargs="+",
        default=[],
        help="healthy too, each after the sensor was taken off and mounted again",
    )
    parser.add_argument(
        "--teeth",
        metavar="N",
        nargs="+",
        type=int,
        required=True,
        help="DRIVING DRIVEN of every stage, from the input on",
    )
    _add_speed(parser)
    add_shared(parser, "--channels", "--unit", "--array")
    parser.add_argument(
        "--other-load",
        action="store_true",
        help="the load differs from the healthy recordings': levels do not count",
    )
    parser.add_argument(
        "--false-alarms",
        type=float,
        default=0.05,
        metavar="SHARE",
        help="of healthy recordings (default: 0.05)",
    )
    add_shared(parser, "--json")


def _add_speed(parser: ArgumentParser) -> None:
    """Add the arguments on rates and speeds."""
    parser.add_argument(
        "--speed-rpm",
        type=float,
        metavar="RPM",
        help="of the input shaft, within 3 %%; not needed with --tacho",
    )
    add_shared(parser, "--healthy-speed-rpm", "--sampling-rate")
    add_tacho(parser, "input")


def run(arguments: Namespace) -> int:
    """Print the findings; exit status 3 if a recording is changed."""
    from diagnose.detection.finding import finding_content, finding_lines
    from diagnose.detection.gear_stages import stages_of
    from diagnose.detection.healthy_machine import HealthyMachine

    stages = stages_of(arguments.teeth)
    speed = arguments.speed_rpm
    healthy_speed = arguments.healthy_speed_rpm or speed
    recordings = _followed(arguments, arguments.recording, speed, stages)
    machine = HealthyMachine.fit_followed(
        _followed(arguments, arguments.healthy, healthy_speed, stages),
        stages,
        mounting=_followed(arguments, arguments.mounting, healthy_speed, stages),
        false_alarms=arguments.false_alarms,
        shortest=min(recordings, key=lambda one: one.n_turns),
    )
    findings = [
        machine.judge_followed(one, other_load=arguments.other_load)
        for one in recordings
    ]
    if arguments.json:
        show_json([finding_content(finding) for finding in findings])
    else:
        for finding in findings:
            show(*finding_lines(finding))
    if any(finding.is_changed for finding in findings):
        return CHANGED
    return 0


def _followed(
    arguments: Namespace,
    files: list[str],
    speed_rpm: float | None,
    stages: GearStages,
) -> list[FollowedRecording]:
    """Recordings as they are described, followed over the angle."""
    from diagnose.detection.followed_shafts import follow_file

    return [
        follow_file(described(arguments, file, speed_rpm=speed_rpm), stages)
        for file in files
    ]
