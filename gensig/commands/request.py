"""The configuration of a verb, and a note on typed keys that the verb does not read."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Mapping, Sequence

from gensig.options.compose import override_keys
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request

CHOOSES_OTHERS = "experiment"  # its keys are those of many verbs


def read_configuration(arguments: Namespace) -> Configuration:
    """The configuration of the typed overrides; its kind of machine is kept for `say_unread`."""
    config = read_request(arguments.overrides, config_dir=arguments.config_dir).config
    arguments.machine_kind = str(config["system"].get("kind"))
    return config


def say_unread(
    arguments: Namespace,
    reads: Mapping[str, Sequence[str]] | None,
    instead: Mapping[str, str],
) -> None:
    """Print a note on stderr for every typed key that the verb does not read.

    Parameters
    ----------
    reads : sections that the verb reads, by the kind of machine; None where it reads all
    instead : flag to use in place of a key
    """
    kind = getattr(arguments, "machine_kind", None)
    sections = None if reads is None or kind is None else reads.get(kind, reads[""])
    for key in override_keys(getattr(arguments, "overrides", ()) or ()):
        section = key.partition(".")[0]
        flag = next(
            (
                flag
                for name, flag in instead.items()
                if key == name or key.startswith(f"{name}.")
            ),
            None,
        )
        unread = (
            sections is not None
            and section not in sections
            and section != CHOOSES_OTHERS
        )
        if flag is not None or unread:
            hint = f"; use {flag}" if flag else ""
            print(
                f"gensig: note: {key} is not read by {arguments.verb}{hint}",
                file=sys.stderr,
            )
