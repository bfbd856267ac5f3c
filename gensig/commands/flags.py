"""Declarations of verbs and of their command-line arguments. Imports nothing that is slow."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

OVERRIDES_HELP = (
    "OVERRIDES are group=option and key=value, as in Hydra: "
    "fault=crack operating.speed_rpm=1200 seed=3."
)


@dataclass(frozen=True)
class Argument:
    """One argument of a verb: its names and the options of ``add_argument``."""

    names: tuple[str, ...]
    options: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Verb:
    """A verb of the command ``gensig``.

    Attributes
    ----------
    summary : what the verb does, for the help
    examples : commands as they are typed, a line each
    runs : ``module:function`` below ``gensig.commands``; takes the parsed arguments
    arguments : of the verb, in the order of its help
    status_1 : meaning of exit status 1, None where the verb does not have it
    instead : key that the verb does not read -> flag to use in its place, or an empty text;
        None for verbs that do not look at one machine
    reads : kind of machine -> sections of the configuration that the verb reads; the empty
        kind stands for all others; None reads all sections
    """

    summary: str
    examples: tuple[str, ...]
    runs: str
    arguments: Sequence[Argument]
    status_1: str | None = None
    instead: Mapping[str, str] | None = None
    reads: Mapping[str, tuple[str, ...]] | None = None

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments of the verb to a parser."""
        for argument in self.arguments:
            parser.add_argument(*argument.names, **argument.options)


def text(name: str, metavar: str, help: str, **options: Any) -> Argument:
    """An argument that takes one text."""
    return Argument((name,), {"metavar": metavar, "help": help, **options})


def number(name: str, metavar: str, help: str, **options: Any) -> Argument:
    """An argument that takes one number."""
    return text(name, metavar, help, type=float, **options)


def numbers(
    name: str, metavar: str | tuple[str, ...], help: str, **options: Any
) -> Argument:
    """An argument of several numbers: as many as the names in ``metavar``, or one and more."""
    n_values = "+" if isinstance(metavar, str) else len(metavar)
    common = {"metavar": metavar, "help": help, "type": float, "nargs": n_values}
    return Argument((name,), {**common, **options})


def count(name: str, metavar: str, help: str, **options: Any) -> Argument:
    """An argument that takes one whole number."""
    return text(name, metavar, help, type=int, **options)


def counts(
    name: str, metavar: str | tuple[str, ...], help: str, **options: Any
) -> Argument:
    """An argument of several whole numbers, as many as of `numbers`."""
    return numbers(name, metavar, help, type=int, **options)


def switch(*names: str, help: str) -> Argument:
    """An argument without a value."""
    return Argument(names, {"action": "store_true", "help": help})


def choice(name: str, choices: tuple[str, ...], help: str, **options: Any) -> Argument:
    """An argument that takes one of some words."""
    return Argument((name,), {"choices": choices, "help": help, **options})


def overrides(help: str) -> Argument:
    """The words of the form group=option and key=value."""
    return text("overrides", "OVERRIDES", help, nargs="*")


CONFIG_DIR = text(
    "--config-dir",
    "DIR",
    "folder with groups and options of your own (default: ./configs, if there)",
)
CONFIGURATION = (overrides(OVERRIDES_HELP), CONFIG_DIR)
FOLDER = text("folder", "DIR", "folder of a data set")
PLOT = text("--plot", "FILE", "write a figure (PNG, SVG or PDF)")
REPLACE_OUT = switch("--force", help="replace the file of --out")
SEARCH_SEED = count("--seed", "N", "of the search (default: 0)", default=0)
MULTIRUN = switch(
    "-m", "--multirun", help="one data set for each combination of values a,b"
)
# flags for keys that people look for among the flags
OUT = text("--out", "DIR", "the same as out=DIR", dest="out_flag")
STORED = text(
    "--config",
    "FILE",
    "configuration of a data set, its config.yaml, in place of the options; OVERRIDES change it",
)
WORKERS = Argument(
    ("-j", "--workers"),
    {
        "metavar": "N",
        "type": int,
        "help": "worker processes (default: one a core); as executor.n_workers=N",
    },
)
QUIET = switch("--quiet", help="print nothing but mistakes")


CHANNELS = text("--channels", "NAME", "columns to use (default: all)", nargs="+")
ARRAY = text(
    "--array", "NAME", "array of a .npz, .h5 or .mat file (default: acceleration)"
)
UNIT = Argument(
    ("--unit",),
    {
        "default": "m/s2",
        "help": "m/s2 or g, where the column does not say (default: m/s2)",
    },
)


def json_file(help: str) -> Argument:
    """The argument for the file of numbers."""
    return text("--json", "FILE", help)


def required_out(metavar: str, help: str) -> Argument:
    """The argument for a file or folder that the verb always writes."""
    return text("--out", metavar, help, required=True)
