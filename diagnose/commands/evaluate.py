"""``diagnose evaluate``."""

from __future__ import annotations

import difflib
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from diagnose.commands.parser import (
    add_model,
    add_overrides,
    note_unsigned,
    refuse_existing,
)
from gensig.errors import ConfigError
from gensig.terminal.printing import show

HELP = """\
Evaluate a trained network on a data set.

  data=DIR         data set made by gensig generate
  out=DIR          optional: receives metrics.json and confusion.png, of remaining lives also
                   predictions.csv; must not exist or be empty
  protocol=NAME    optional: judge on a part of this split of the data set
  subset=NAME      optional: which part (train, validation, test); default test
  channels=A,B     optional: channels in place of those of the training, as many, in their order

Without protocol: the test part of the network's split on the data set that it was trained on, all
records elsewhere. Implants in stretches of recordings that carried in its training are refused."""
EXAMPLE = """\
examples:
  diagnose evaluate data=runs/other
  diagnose evaluate --model runs/hours/models/by_unit-cnn-seed0 data=runs/lives2
  diagnose evaluate --model report/models/new_machine-seed0 data=runs/other
  diagnose evaluate --model report/models/new_machine-seed0 data=runs/other channels=wheel_x"""
KEYS = ("data", "out", "protocol", "subset", "channels")


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_overrides(parser)
    add_model(parser, required=False)


def run(arguments: Namespace) -> int:
    """Judge a trained network and print its scores."""
    values = _key_values(arguments.overrides)
    out = values.get("out")
    if out is not None:
        refuse_existing(Path(out))
    from diagnose.recordings.evaluate import evaluate_network
    from diagnose.recordings.registry import open_network, shipped_network
    from diagnose.studies.result_files import write_metrics
    from gensig.dataset.reader import open_dataset

    channels = None
    if "channels" in values:
        channels = values["channels"].strip("[]").split(",")
    folder = arguments.model or shipped_network()
    network = open_network(folder)
    note_unsigned(folder, network.description)
    result, scores = evaluate_network(
        network,
        open_dataset(values["data"]),
        protocol=values.get("protocol"),
        subset=values.get("subset"),
        channels=channels,
    )
    show(*network.lines(result))
    if out is not None:
        Path(out).mkdir(parents=True, exist_ok=True)
        write_metrics(Path(out), result)
        scores.write(Path(out), result)
    return 0


def _key_values(words: Sequence[str]) -> dict[str, str]:
    """Words of the form key=value as a dictionary.

    Refuses others, unknown keys and missing ones.
    """
    values: dict[str, str] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not value:
            raise ConfigError(f"'{word}' is not of the form key=value")
        if key not in KEYS:
            hint = f"there is {', '.join(KEYS)}"
            if key.startswith("model"):
                hint = "a model is given as --model DIR"
            for close in difflib.get_close_matches(key, KEYS, n=1):
                hint = f"did you mean {close}?"
            raise ConfigError(f"unknown key '{key}'; {hint}")
        if key in values:
            raise ConfigError(f"{key} is given twice")
        values[key] = value
    if "data" not in values:
        raise ConfigError("data is required: give data=DIR")
    return values
