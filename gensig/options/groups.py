"""Hydra's parser of overrides, and its groups with their options, in the package alone."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

from hydra import initialize_config_module
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException

from gensig.errors import ConfigError
from gensig.options.shell_words import unquoted

CONFIG_MODULE = "gensig.configs"


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
    ConfigError    for a word that is no override; says which to quote
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
    try:
        return list(OverridesParser.create().parse_overrides(overrides=list(overrides)))
    except HydraException as error:
        raise ConfigError(f"cannot read the override: {first_line(error)}") from None


def first_line(error: Exception) -> str:
    """First line of an error's message."""
    return str(error).strip().splitlines()[0]
