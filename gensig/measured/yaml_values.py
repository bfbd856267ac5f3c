"""Values of the keys of a YAML with their types, and one line for each that is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gensig.errors import ConfigError
from gensig.text.nearest import hint


@dataclass(frozen=True, slots=True)
class Place:
    """A mapping of a YAML and its name in messages."""

    where: str
    tree: Mapping[str, Any]

    def names(self) -> tuple[str, ...]:
        """Keys of the mapping."""
        return tuple(self.tree)

    def raw(self, key: str) -> Any:
        """The value of a key as it stands; None where there is none."""
        return self.tree.get(key)

    def refuse_unknown(self, known: Iterable[str]) -> None:
        """Raise ConfigError for a key that nothing reads."""
        known = tuple(known)
        for key in self.tree:
            if key not in known:
                raise ConfigError(
                    f"{self.where}: unknown key '{key}'; {hint(str(key), known)}"
                )

    def text(self, key: str) -> str | None:
        """A text, or a plain number as it is written; None where the key is empty."""
        value = self.raw(key)
        if value is None or value == "":
            return None
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise ConfigError(f"{self.where}: {key} must be a text, not {_kind(value)}")
        return str(value)

    def required(self, key: str) -> str:
        """A text that must be there."""
        value = self.text(key)
        if value is None:
            raise ConfigError(f"{self.where}: {key} is missing; give it")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """Texts of a list, or of one text; empty where the key is."""
        value = self.raw(key)
        if value is None:
            return ()
        if isinstance(value, str):
            return (value,)
        is_plain = isinstance(value, list) and all(
            isinstance(item, str | int | float) and not isinstance(item, bool)
            for item in value
        )
        if not is_plain or len(set(map(str, value))) < len(value):
            raise ConfigError(f"{self.where}: {key} must be a list of texts, each once")
        return tuple(map(str, value))

    def text_map(self, key: str) -> dict[str, str]:
        """Texts by name."""
        inner = self.within(key)
        return {name: inner.required(name) for name in inner.names()}

    def within(self, key: str) -> Place:
        """The mapping of a key; an empty one where the key is empty."""
        where = f"{self.where}: {key}"
        return Place(where, mapping(self.raw(key) or {}, where))

    def number(self, key: str, low: float, high: float) -> float | None:
        """A number of a range; None where the key is empty."""
        value = self.raw(key)
        if value is None:
            return None
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not math.isfinite(value) or not low <= value <= high:
            raise ConfigError(
                f"{self.where}: {key} must be a number of {low:g} to {high:g}, not {value!r:.40}"
            )
        return float(value)

    def whole(self, key: str, low: int, high: int) -> int | None:
        """A whole number of a range; None where the key is empty."""
        value = self.number(key, low, high)
        if value is None:
            return None
        if not value.is_integer():
            raise ConfigError(
                f"{self.where}: {key} must be a whole number, not {value:g}"
            )
        return int(value)

    def flag(self, key: str) -> bool:
        """True or false; false where the key is empty."""
        value = self.raw(key)
        if value is None:
            return False
        if not isinstance(value, bool):
            raise ConfigError(
                f"{self.where}: {key} must be true or false, not {_kind(value)}"
            )
        return value


def mapping(value: Any, where: str) -> dict[str, Any]:
    """A mapping with texts as keys.

    Raises
    ------
    ConfigError    for anything else
    """
    if not isinstance(value, dict):
        raise ConfigError(f"{where} must be keys with their values, not {_kind(value)}")
    return {str(key): item for key, item in value.items()}


def entry_list(value: Any, where: str) -> list[dict[str, Any]]:
    """Entries of files: a list of mappings, or a mapping of patterns to labels or mappings.

    Raises
    ------
    ConfigError    for anything else
    """
    if value is None:
        return []
    if isinstance(value, list):
        return [
            mapping(entry, f"{where}: files {n}")
            for n, entry in enumerate(value, start=1)
        ]
    entries = []
    for pattern, entry in mapping(value, f"{where}: files").items():
        if isinstance(entry, dict):
            entries.append({"pattern": pattern, **mapping(entry, f"{where}: files")})
        else:
            entries.append({"pattern": pattern, "label": entry})
    return entries


def _kind(value: Any) -> str:
    """The kind of a value in words of YAML."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    return repr(value)[:40]
