"""Changes of a stored configuration by overrides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import OverrideType
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from gensig.errors import ConfigError
from gensig.options import files as option_files
from gensig.options.compose import (
    composed_groups,
    dotted_keys,
    nearest_key,
    plain_tree,
)
from gensig.options.groups import group_names, parse
from gensig.options.plain_values import check_values
from gensig.options.references import check_tree, refuse_references


def changed_content(
    content: Mapping[str, Any],
    config_name: str,
    overrides: Sequence[str],
    *,
    config_dir: str | Path | None = None,
) -> dict[str, Any]:
    """A stored configuration with overrides on top, as plain nested dictionaries.

    A typed group replaces the stored group of keys, and those that its option chooses. What it
    refers to is taken from the stored groups.

    Parameters
    ----------
    content : resolved configuration, unchanged by the call
    config_name : primary file whose groups may be typed
    overrides : ``group=option`` and ``key=value``
    config_dir : folder with a user's own options

    Raises
    ------
    ConfigError    for an unknown key or option, and for overrides of another form
    """
    refuse_references(content, "a stored configuration")
    chosen: dict[str, str] = {}
    words, changes = [], []
    for word, override in zip(overrides, parse(overrides), strict=True):
        if override.type is not OverrideType.CHANGE or override.package is not None:
            raise ConfigError(
                f"{word}: on top of a stored configuration type group=option or key=value"
            )
        if override.key_or_group in group_names():
            chosen[str(override.key_or_group)] = str(override.value())
            words.append(word)
        else:
            changes.append((override.key_or_group, override.value()))
    config = OmegaConf.create(dict(content))
    if chosen:
        composed = composed_groups(config_name, words, config_dir=config_dir)
        _replace_groups(config, composed, chosen, config_dir)
    OmegaConf.set_struct(config, True)
    for key, value in changes:
        try:
            OmegaConf.update(config, key, value, merge=True)
        except OmegaConfBaseException:
            near = nearest_key(key, dotted_keys(dict(content)))
            raise ConfigError(f"unknown key '{key}'{near}") from None
    check_tree(plain_tree(config))
    try:
        result = plain_tree(config, resolve=True)
    except OmegaConfBaseException as error:
        text = " ".join(str(error).split())
        raise ConfigError(
            f"a stored configuration cannot be changed so: {text}"
        ) from None
    refuse_references(result, "a stored configuration")
    check_values(result)
    return {
        key: value for key, value in result.items() if value is not None or key == "out"
    }


def _replace_groups(
    config: DictConfig,
    composed: Mapping[str, Any],
    chosen: Mapping[str, str],
    config_dir: str | Path | None,
) -> None:
    """Put the keys of chosen options into ``config``, those of other groups that they set too."""
    options_of: dict[str, str] = {}
    for group, option in chosen.items():
        options_of |= option_files.chosen_options(group, option, config_dir)
    options_of |= chosen
    for group in options_of:
        config[group] = composed.get(group)
    for group, option in options_of.items():
        if option == str(None):  # a group without an option
            continue
        for key in option_files.option_keys(group, option, config_dir):
            if not key.name.startswith(f"{group}."):
                value = _at(composed, key.name)
                OmegaConf.update(config, key.name, value, merge=False)


def _at(tree: Mapping[str, Any], dotted: str) -> Any:
    """Value of a dotted key in nested dictionaries; None where there is none."""
    node: Any = tree
    for name in dotted.split("."):
        node = node.get(name) if isinstance(node, Mapping) else None
    return node
