"""Number of options that an option file of a user builds on, by its defaults list."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import ConfigError
from gensig.options.plain_file import DEFAULTS, LOADER, check_option, option_text

MOST_OPTIONS = 100  # of a composition; Hydra takes seconds for so many
SELF = "_self_"


class OptionCounts:
    """Options that files of one folder build on, each counted as often as it is composed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[Path, int] = {}
        self._open: list[Path] = []

    def check(self, file: Path) -> str:
        """Text of an option file, after all checks of it and of the files that it builds on.

        Raises
        ------
        ConfigError    for a file that is refused, builds on itself, or builds on too many options
        """
        text = option_text(file, self._folder)
        self._count(file, text)
        return text

    def _count(self, file: Path, text: str) -> int:
        if file in self._known:
            return self._known[file]
        if file in self._open:
            raise ConfigError(f"{file} builds on itself; leave it out of its defaults")
        check_option(file, text)
        self._open.append(file)
        group = file.relative_to(self._folder).parent
        total = 1
        for name in _named(yaml.compose(text, Loader=LOADER), str(group)):
            inner = self._folder / f"{name}.yaml"
            n_options = 1
            if inner.is_file():
                n_options = self._count(inner, option_text(inner, self._folder))
            total += n_options
            if total > MOST_OPTIONS or len(self._open) > MOST_OPTIONS // 4:
                raise ConfigError(
                    f"{file} builds on more than {MOST_OPTIONS} options, or through too many "
                    "files; leave some out of its defaults"
                )
        self._open.pop()
        self._known[file] = total
        return total


def _named(tree: Any, group: str) -> Iterator[str]:
    """Options that a defaults list names, as ``group/option``."""
    if not isinstance(tree, yaml.MappingNode):
        return
    lists = [value for key, value in tree.value if key.value == DEFAULTS]
    for entry in [entry for node in lists for entry in _entries(node)]:
        if isinstance(entry, yaml.MappingNode):
            for key, value in entry.value:
                inner = _joined(group, key.value)
                yield from (_joined(inner, name.value) for name in _entries(value))
        elif entry.value != SELF:
            yield _joined(group, str(entry.value))


def _entries(node: Any) -> list[Any]:
    """Nodes of a list; a single value is a list of one."""
    if isinstance(node, yaml.SequenceNode):
        return list(node.value)
    return [node]


def _joined(group: str, name: Any) -> str:
    """Path of a group or option from the group that names it, without its package."""
    path = (str(name).split() or [""])[-1].partition("@")[0]
    if path.startswith("/"):
        return path[1:]
    return f"{group}/{path}"
