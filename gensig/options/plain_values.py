"""Values of a composed configuration: finite numbers, texts, switches, lists and groups of them.

Checked once where a configuration is made, so that no reader meets another value.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gensig.errors import ConfigError
from gensig.options.references import shortened
from gensig.text import nearest

LARGEST = 2**63  # beyond it a whole number fits in no file
LONGEST = 4_000  # characters of a text
# keys that choose among names, wherever they stand
CHOOSING = ("kind", "distribution", "of")
VARY = "vary"


def check_values(tree: Mapping[str, Any], where: str = "") -> None:
    """Refuse what no key of a configuration can be.

    Raises
    ------
    ConfigError    naming the key: NaN, infinity, whole numbers beyond 64 bits, dates, keys that
        are no text, a ``vary`` that is no mapping, a ``kind`` that is no text
    """
    for key, value in tree.items():
        if not isinstance(key, str):
            at = where.rstrip(".") or "the configuration"
            raise ConfigError(f"{at}: the key {_text(key)} must be a text")
        name = f"{where}{key}"
        if key in CHOOSING and not isinstance(value, str | None):
            raise ConfigError(f"{name} = {_text(value)} must be the name of one")
        if key == VARY and not isinstance(value, Mapping | None):
            raise ConfigError(
                f"{name} = {_text(value)} must be a mapping of keys to distributions, for "
                "instance {speed_rpm: {distribution: uniform, low: 1, high: 2}}, or null"
            )
        _check(name, value)


def _check(name: str, value: Any) -> None:
    if isinstance(value, Mapping):
        check_values(value, f"{name}.")
    elif isinstance(value, list):
        for number, item in enumerate(value):
            _check(f"{name}[{number}]", item)
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise ConfigError(f"{name} = {value} must be a finite number")
    elif isinstance(value, int):
        if abs(value) >= LARGEST:
            raise ConfigError(
                f"{name} = {_text(value)} is beyond 64 bits; give a smaller number"
            )
    elif isinstance(value, str):
        if len(value) > LONGEST:
            raise ConfigError(
                f"{name} is a text of {len(value)} characters; shorten it"
            )
    elif value is not None:
        raise ConfigError(
            f"{name} = {_text(value)} must be a number, a text, true, false or null; put a text "
            "in quotes"
        )


def require_keys(tree: Mapping[str, Any], where: str, *keys: str) -> None:
    """Refuse a group that lacks keys, as an option file that is empty or of something else.

    Raises
    ------
    ConfigError    naming the first that is missing
    """
    for key in keys:
        if key not in tree:
            hint = nearest.hint(key, list(tree)) if tree else "it is empty"
            raise ConfigError(
                f"{where} has no key '{key}', {hint}; complete its option file, or choose another "
                "option"
            )


def _text(value: Any) -> str:
    return shortened(str(value))
