"""``diagnose bridge``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from diagnose.commands.parser import refuse_existing
from gensig.errors import ConfigError
from gensig.terminal.printing import remark, show

if TYPE_CHECKING:
    from diagnose.bridge.bridge_machine import BridgeMachine
    from gensig.measured.measured_set import MeasuredSet

HELP = """\
What a simulation is worth on a measured machine: a frozen protocol on a measured set, with
comparators beside every score.

A network is trained on the machine's healthy recordings plus simulated residuals of faults
(implants), and judged on its faulty recordings and on what was held out of the healthy ones. Beside
it stand novelty without faults, the handbook's rule, bursts of noise in place of residuals, gain 0,
shuffled labels and a wrong gearbox. Where physics does not beat them, the page says so.

--on takes a known set and its folder (gensig measured lists them), or the YAML of a folder of your
own. --data is a gensig data set with healthy twins and without noise, made for gears like the
machine's."""
EXAMPLE = """\
examples:
  diagnose bridge --on mcc5_thu downloads/mcc5_thu --data runs/residuals --out runs/bridge
  diagnose bridge --on rig/measured.yaml --data runs/residuals --out runs/bridge"""
OPTION = "measured_machine"  # no experiment of gensig has this name
FAULTS = "healthy,crack,broken,missing_tooth,distributed_pitting"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    parser.add_argument(
        "--on",
        required=True,
        nargs="+",
        metavar="SET",
        help="SET DIR of a known set, or the measured.yaml of a folder",
    )
    parser.add_argument(
        "--data",
        metavar="DIR",
        help="data set with healthy twins; without it the command that makes one is printed",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        help="folder to write; must not exist or be empty",
    )
    parser.add_argument(
        "--machine",
        metavar="NAME",
        help="of a set of several (default: the one with most classes)",
    )


def run(arguments: Namespace) -> int:
    """Run the protocol, write the page and print what it says."""
    if arguments.out is not None:
        refuse_existing(Path(arguments.out))
    from diagnose.bridge.bridge_machine import bridge_machine
    from diagnose.bridge.protocol import FROZEN

    found = _opened(arguments.on)
    machine = bridge_machine(found, FROZEN, machine=arguments.machine)
    if arguments.data is None:
        show("no --data: a source of residuals for this machine is made by")
        show(*[f"  {line}" for line in source_lines(machine)])
        show(
            "module and torque are assumed where the set does not tell them: give yours"
        )
        return 0
    if arguments.out is None:
        raise ConfigError("--out is missing; give the folder to write")
    from diagnose.bridge.bridge_page import write_bridge
    from diagnose.bridge.bridge_run import run_bridge
    from diagnose.bridge.bridge_words import comparisons, headline
    from gensig.dataset.reader import open_dataset

    with open_dataset(arguments.data) as data:
        result = run_bridge(machine, data, FROZEN, on_step=_step)
    page = write_bridge(Path(arguments.out), found, Path(arguments.data), result)
    show(*headline(result))
    show(*[one.sentence for one in comparisons(result)])
    show(f"{page}: the page, with the confusion of every method")
    return 0


def _opened(words: list[str]) -> MeasuredSet:
    """The measured set of the words of --on."""
    from gensig.measured.loading import load, sets

    if len(words) > 2:
        raise ConfigError(f"--on: '{words[2]}' is too much; give SET DIR, or a YAML")
    if len(words) == 2:
        return load(words[0], words[1])
    if words[0] in sets() and not Path(words[0]).exists():
        raise ConfigError(f"--on {words[0]}: give its folder too: --on {words[0]} DIR")
    return load(None, words[0])


def source_lines(machine: BridgeMachine) -> list[str]:
    """Commands that make a source of residuals for the gears of a machine."""
    teeth = " ".join(map(str, machine.teeth))
    speed = 60.0 * max(one.shaft_frequency for one in machine.healthy)
    return [
        f"gensig new gearbox {OPTION} --teeth {teeth} --module 2 --speed {speed:g} --torque 20 "
        "--no-level",
        f"gensig generate experiment={OPTION} plan.classes=[{FAULTS}] plan.n_reference=0 "
        "sensing.snr_db=null dataset.store_healthy_twin=true out=runs/residuals",
    ]


def _step(text: str) -> None:
    remark("diagnose", text)
