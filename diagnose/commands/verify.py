"""``diagnose verify``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from diagnose.commands.parser import add_shared, show_json
from gensig.terminal.printing import show

HELP = """\
Is a trained network whole and unaltered?

Checked are the sha256 of every file of the folder, types and ranges in model.json, types and shapes
of the weights, that every number is finite, and that the network answers. MODEL may be a study: all
its models are checked. Models of versions before 0.17 have no sha256; a note says so."""
EXAMPLE = """\
examples:
  diagnose verify report/models/new_machine-seed0
  diagnose verify runs/report --json"""
DAMAGED = 1
EXITS = {DAMAGED: "damaged or altered; every problem is printed"}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    parser.add_argument(
        "model",
        metavar="MODEL",
        nargs="?",
        help="folder of a network, or of a study (default: the network that comes with gensig)",
    )
    add_shared(parser, "--json")


def run(arguments: Namespace) -> int:
    """Print every problem; the exit status is 0 where there is none."""
    from diagnose.recordings.model_check import check_model, models_in
    from diagnose.recordings.registry import shipped_network

    folder = shipped_network()
    if arguments.model is not None:
        folder = Path(arguments.model)
    checks = [check_model(path) for path in models_in(folder)]
    if arguments.json:
        show_json([check.content() for check in checks])
    else:
        for check in checks:
            for line in (*check.problems, *check.notes):
                show(line)
            state = (
                f"is whole and unaltered: {check.n_files} file(s), {check.n_weights} weights, "
                "all finite"
            )
            if check.notes:
                state = f"can be used: {check.n_weights} weights, all finite"
            if check.problems:
                state = f"is NOT whole: {len(check.problems)} problem(s)"
            show(f"{check.folder} {state}")
    if any(check.problems for check in checks):
        return DAMAGED
    return 0
