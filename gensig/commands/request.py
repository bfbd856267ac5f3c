"""The configuration of a verb, and a note on typed keys that the verb does not read."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence

from gensig.commands.console import remark
from gensig.options.compose import override_keys
from gensig.options.configuration import Configuration
from gensig.plan.request import read_request

CHOOSES_OTHERS = "experiment"  # read by every verb


def read_configuration(arguments: Namespace) -> Configuration:
    """Configuration of the typed overrides; keeps the kind of machine for `print_unread`."""
    config = read_request(arguments.overrides, config_dir=arguments.config_dir).config
    arguments.machine_kind = str(config["system"].get("kind"))
    return config


def print_unread(
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
    sections = None
    kind = getattr(arguments, "machine_kind", None)
    if reads is not None and kind is not None:
        sections = {*reads.get(kind, reads[""]), CHOOSES_OTHERS}
    for key in override_keys(getattr(arguments, "overrides", ()) or ()):
        text = f"note: {key} is not read by {arguments.verb}"
        replaced = [name for name in instead if f"{key}.".startswith(f"{name}.")]
        if replaced and instead[replaced[0]]:
            text += f"; use {instead[replaced[0]]}"
        is_read = sections is None or key.partition(".")[0] in sections
        if replaced or not is_read:
            remark(text)
