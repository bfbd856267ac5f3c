"""Hydra's parser of overrides, and its groups with their options, in the package alone."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from typing import Any

from hydra import initialize_config_module
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import QuotedString
from hydra.errors import HydraException

from gensig.errors import ConfigError
from gensig.options.plain_file import HYDRA, check_choice
from gensig.options.references import (
    MOST_DEPTH,
    check_key,
    check_text,
    check_values,
    shortened,
)
from gensig.options.shell_words import CLOSING, OPENING, unquoted

CONFIG_MODULE = "gensig.configs"
LONGEST_WORD = 100_000  # characters of an override


class HydraState:
    """Hydra's global state, set up for one call and always left clean."""

    def __enter__(self) -> GlobalHydra:
        GlobalHydra.instance().clear()
        self._context = initialize_config_module(CONFIG_MODULE, version_base="1.3")
        self._context.__enter__()
        return GlobalHydra.instance()

    def __exit__(self, *details: Any) -> None:
        self._context.__exit__(*details)
        GlobalHydra.instance().clear()


@functools.cache
def group_names() -> frozenset[str]:
    """Names of all groups of the package."""
    with HydraState() as hydra:
        return frozenset(hydra.config_loader().list_groups(""))


def options(group: str) -> list[str]:
    """Names that a group offers in the package, sorted."""
    with HydraState() as hydra:
        return sorted(hydra.config_loader().get_group_options(group))


def parse(overrides: Sequence[str]) -> list[Any]:
    """Hydra's reading of overrides.

    Raises
    ------
    ConfigError    for a word that is no override, and says which to quote; for settings of Hydra
        itself, references to anything but keys, and keys that make objects
    """
    for word in overrides:
        if not isinstance(word, str):
            raise ConfigError(
                f"an override is a text such as 'seed=1', not {word!r}; give each as its "
                "own argument"
            )
    if advice := unquoted(overrides):
        raise ConfigError(advice)
    for word in overrides:
        if "=" not in word and not word.startswith("~"):
            text = (
                "is neither group=option nor key=value, such as fault=crack or seed=1"
            )
            raise ConfigError(f"cannot read the override: '{word}' {text}")
        _check_text(word)
    try:
        result = list(
            OverridesParser.create().parse_overrides(overrides=list(overrides))
        )
    except HydraException as error:
        raise ConfigError(f"cannot read the override: {first_line(error)}") from None
    for override in result:
        _check_override(override)
    return result


def _check_text(word: str) -> None:
    """Refuse a word that is too large to be read, or that refers to more than to keys."""
    if len(word) > LONGEST_WORD or _most_open(word) > MOST_DEPTH:
        raise ConfigError(
            f"cannot read the override: '{shortened(word)}' is longer than {LONGEST_WORD} "
            f"characters or nested deeper than {MOST_DEPTH} levels; shorten it"
        )
    check_text(word, "an override")


def _most_open(word: str) -> int:
    """Largest number of brackets that are open at once."""
    n_open = most = 0
    for sign in word:
        n_open += sign in OPENING
        n_open -= sign in CLOSING
        most = max(most, n_open)
    return most


def _check_override(override: Any) -> None:
    """Refuse what an override that is read would do beyond setting values and options."""
    key, line = str(override.key_or_group), str(override.input_line)
    where = f"the override {shortened(line)}"
    heads = re.split(r"[./@:]", f"{key}.{override.package or ''}")
    if HYDRA in heads:
        raise ConfigError(f"{where} is a setting of Hydra itself; leave it out")
    check_key(key, where)
    value = plain_value(override.value())
    if override.is_sweep_override():
        return
    check_values(value, where)
    is_group = "/" in key or key in group_names()
    names = value
    if not isinstance(value, list):
        names = [value]
    for name in names:
        if is_group and isinstance(name, str):
            check_choice(name, where)


def plain_value(value: Any) -> Any:
    """Hydra's quoted strings and nested values as plain Python."""
    if isinstance(value, dict):
        return {
            str(plain_value(name)): plain_value(item) for name, item in value.items()
        }
    if isinstance(value, list):
        return [plain_value(item) for item in value]
    if isinstance(value, QuotedString):
        return str(value)
    return value


def first_line(error: Exception) -> str:
    """First line of an error's message."""
    return str(error).strip().splitlines()[0]
