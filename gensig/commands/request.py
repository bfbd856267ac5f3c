"""The configuration of a verb, and a word for what was typed and never read."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping
from typing import Any

from gensig.options.compose import override_keys
from gensig.plan.request import read_request

CHOOSES_OTHERS = "experiment"  # its keys are those of many verbs


class Watched(Mapping[str, Any]):
    """A configuration that knows which of its sections somebody has asked for. Copies count as reading all."""

    def __init__(self, config: Mapping[str, Any]) -> None:
        self._config = config
        self.read: set[str] = set()

    def __getitem__(self, key: str) -> Any:
        self.read.add(key)
        return self._config[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._config)

    def __len__(self) -> int:
        return len(self._config)


def read_watched(arguments: Namespace) -> Watched:
    """The configuration of the typed overrides; `say_unread` looks later which part of it the verb has read."""
    arguments.watched = Watched(read_request(arguments.overrides, config_dir=arguments.config_dir).config)
    return arguments.watched


def say_unread(arguments: Namespace, instead: Mapping[str, str]) -> None:
    """One line on stderr for every typed key that the verb has not read; ``instead`` names the flag to use."""
    watched = getattr(arguments, "watched", None)
    for key in override_keys(getattr(arguments, "overrides", ()) or ()):
        section = key.partition(".")[0]
        flag = next((flag for name, flag in instead.items() if key == name or key.startswith(f"{name}.")), None)
        unread = watched is not None and section not in watched.read and section != CHOOSES_OTHERS
        if flag is not None or unread:
            hint = f"; use {flag}" if flag else ""
            print(f"gensig: note: {key} is not read by {arguments.verb}{hint}", file=sys.stderr)
