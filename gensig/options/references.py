"""References of one value to another, ``${key}``: the allowed forms and their expanded size.

OmegaConf resolves far more, the environment among it. An option file, a typed word or a stored
configuration of somebody else may refer to keys of the configuration alone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gensig.errors import ConfigError
from gensig.text.escaping import escaped

OPENING = "${"
# ${a.b}, ${.b}, ${a[0]}, ${oc.select:a.b} and ${oc.select:a.b,2.5}
REFERENCE = re.compile(
    r"\$\{\s*(?P<select>oc\.select:\s*)?"
    r"(?P<dots>\.*)(?P<key>[\w/-]+(?:\.[\w/-]+|\[\w+\])*)\s*"
    r"(?(select)(?:,\s*[\w.+-]*\s*)?)\}"
)
# keys by which Hydra makes objects
INSTANTIATION = frozenset(
    ("_target_", "_args_", "_partial_", "_convert_", "_recursive_")
)
MOST_DEPTH = 40  # of nested keys, lists and references
MOST_NODES = 20_000  # keys and values; the largest shipped configuration has about 500
MOST_CHARACTERS = 2_000_000

Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a value with all that it refers to: values, characters and levels."""

    nodes: int = 0
    characters: int = 0
    depth: int = 0

    def __add__(self, other: Size) -> Size:
        """Size of two values side by side."""
        return Size(
            self.nodes + other.nodes,
            self.characters + other.characters,
            max(self.depth, other.depth),
        )

    def nested(self) -> Size:
        """Size of a list or mapping with this content."""
        return Size(self.nodes + 1, self.characters, self.depth + 1)

    def check(self, where: str) -> None:
        """Raise ConfigError for a value that is larger than any configuration."""
        limits = (
            (self.depth, MOST_DEPTH, "is nested in {} levels"),
            (self.nodes, MOST_NODES, "stands for {} values"),
            (self.characters, MOST_CHARACTERS, "stands for {} characters"),
        )
        for value, most, text in limits:
            if value > most:
                raise ConfigError(
                    f"{where} {text.format(f'more than {most}')}, aliases and references "
                    "included; it is no gensig configuration"
                )


def check_text(text: str, where: str) -> None:
    """Raise ConfigError for a text with another reference than to a key."""
    if OPENING not in text:
        return
    rest = REFERENCE.sub("", text)
    if OPENING in rest or f"\\{OPENING}" in text:
        raise ConfigError(
            f"{where}: '{shortened(text)}' is no reference to a key; allowed are ${{key}} and "
            "${oc.select:key,value}, neither the environment nor other resolvers"
        )


def check_key(key: Any, where: str) -> None:
    """Raise ConfigError for a key that would make an object, or that is no text."""
    if not isinstance(key, str):
        raise ConfigError(f"{where}: the key {key!r} must be a text; quote it")
    parts = key.split(".")
    if forbidden := INSTANTIATION.intersection(parts):
        raise ConfigError(
            f"{where}: the key {min(forbidden)} is refused: a configuration holds values and "
            "makes no objects; leave it out"
        )
    check_text(key, where)


def check_values(value: Any, where: str) -> None:
    """Raise ConfigError for a key or text in nested values that is not allowed."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            check_key(key, where)
            check_values(item, where)
    elif isinstance(value, list | tuple):
        for item in value:
            check_values(item, where)
    elif isinstance(value, str):
        check_text(value, where)


def check_tree(tree: Mapping[str, Any]) -> None:
    """Refuse a composed configuration whose references must not or cannot be resolved.

    Parameters
    ----------
    tree : plain nested values, references unresolved

    Raises
    ------
    ConfigError    for a reference of another form, one to itself, and for references that
        together stand for more than a configuration can hold
    """
    check_values(tree, "the configuration")
    _Expansion(tree).size((), tree).check("the configuration")


def refuse_references(value: Any, where: str) -> None:
    """Raise ConfigError for a reference where all must be resolved, and for refused keys."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            check_key(str(key), where)
            refuse_references(item, where)
    elif isinstance(value, list | tuple):
        for item in value:
            refuse_references(item, where)
    elif isinstance(value, str) and OPENING in value:
        raise ConfigError(f"{where} holds values, not references: '{shortened(value)}'")


def shortened(text: str) -> str:
    """The text on one line, printable, at most 80 characters of it."""
    line = escaped(text)
    if len(line) > 80:
        return f"{line[:77]}..."
    return line


class _Expansion:
    """Sizes of the values of a tree with what they refer to, without expanding them."""

    def __init__(self, tree: Mapping[str, Any]) -> None:
        self._tree = tree
        self._known: dict[Path, Size] = {}
        self._open: set[Path] = set()

    def size(self, path: Path, value: Any) -> Size:
        """Size of the value at a path."""
        if path in self._known:
            return self._known[path]
        name = ".".join(path) or "the configuration"
        if path in self._open:
            raise ConfigError(f"{name} refers to itself")
        if len(self._open) > MOST_DEPTH:
            Size(depth=len(self._open)).check(name)
        self._open.add(path)
        result = self._content(path, value)
        self._open.remove(path)
        result.check(name)
        self._known[path] = result
        return result

    def _content(self, path: Path, value: Any) -> Size:
        items = _items(value)
        if items is not None:
            total = Size()
            for name, item in items.items():
                total += Size(0, len(name)) + self.size((*path, name), item)
            return total.nested()
        if not isinstance(value, str):
            return Size(1, 8)
        total = Size(1, len(value))
        for match in REFERENCE.finditer(value):
            if (target := self._target(path, match, 0)) is not None:
                total += self.size(*target).nested()
        return total

    def _target(
        self, path: Path, match: re.Match[str], steps: int
    ) -> tuple[Path, Any] | None:
        """Path and value that a reference stands for; None where there is none."""
        n_dots = len(match["dots"])
        base: Path = ()
        if n_dots:
            base = path[: max(0, len(path) - n_dots)]
        parts = re.split(r"[.\[]", match["key"].replace("]", ""))
        return self._at((*base, *parts), steps)

    def _at(self, path: Path, steps: int) -> tuple[Path, Any] | None:
        """Path and value of a name that may lead through other references."""
        if steps > MOST_DEPTH:
            raise ConfigError(f"{'.'.join(path)} refers to itself")
        value: Any = self._tree
        for index, name in enumerate(path):
            items = _items(value)
            if items is None or name not in items:
                return None
            value = items[name]
            is_last = index == len(path) - 1
            if is_last or not isinstance(value, str):
                continue
            match = REFERENCE.search(value)
            if match is None:
                return None
            here, rest = path[: index + 1], path[index + 1 :]
            target = self._target(here, match, steps + 1)
            if target is None:
                return None
            return self._at((*target[0], *rest), steps + 1)
        return path, value


def _items(value: Any) -> Mapping[str, Any] | None:
    """Content of a mapping or list by name; None for a plain value."""
    if isinstance(value, Mapping):
        return value
    if isinstance(value, Sequence) and not isinstance(value, str):
        return {str(index): item for index, item in enumerate(value)}
    return None
