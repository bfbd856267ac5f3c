"""Option files of users: plain YAML of bounded size inside their folder, checked before use.

The files may come from anybody. Nothing is composed of a file that a check refuses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import ConfigError
from gensig.options.references import (
    MOST_DEPTH,
    OPENING,
    Size,
    check_key,
    check_text,
    shortened,
)
from gensig.text.ordinary_file import is_refused, open_ordinary

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
MOST_BYTES = 1_000_000
LONGEST_NUMBER = 200  # characters
NUMBER = re.compile(r"[-+.]?[0-9][-+.:\w]*")
PACKAGE = re.compile(r"^\s*#\s*@\s*package\s*:?\s*(\S+)", re.MULTILINE)
HEADER_CHARACTERS = 512  # in which Hydra looks for a package
HYDRA = "hydra"
DEFAULTS = "defaults"


def option_text(path: Path, folder: Path) -> str:
    """Text of a file of a user's folder.

    Parameters
    ----------
    path : the file
    folder : the folder that it must lie in, links resolved

    Raises
    ------
    ConfigError    for a file that lies outside, is no regular file, too large, or no text in UTF-8
    """
    try:
        if not path.resolve().is_relative_to(folder.resolve()):
            raise ConfigError(
                f"{path} leads out of {folder}; option files must lie in the folder itself"
            )
        with open_ordinary(path) as stream:
            content = stream.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ConfigError(
                f"{path} is larger than {MOST_BYTES // 1_000_000} MB; it is no option file"
            )
        return content.decode("utf-8")
    except OSError as error:
        if is_refused(error) or isinstance(error, IsADirectoryError):
            raise ConfigError(f"{path} is no file; remove it from {folder}") from None
        raise ConfigError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(
            f"{path} is no text in UTF-8; save it as UTF-8, or remove it"
        ) from None


def check_option(path: Path, text: str) -> None:
    """Refuse an option file that is more than plain values of a moderate number.

    Parameters
    ----------
    path : names the file in messages
    text : its content

    Raises
    ------
    ConfigError    for no YAML, tags, aliases that stand for too much, deep nesting, keys that make
        objects, settings of Hydra, options out of the folder, and references to anything but keys
    """
    for package in PACKAGE.findall(text[:HEADER_CHARACTERS]):
        _check_package(path, package)
    try:
        _check_events(path, text)
        tree = yaml.compose(text, Loader=LOADER)
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{path} is no YAML: {reason}") from None
    if tree is None:
        return
    if not isinstance(tree, yaml.MappingNode):
        raise ConfigError(f"{path} is no mapping; write keys with their values")
    for key, value in tree.value:
        if key.value == HYDRA:
            raise ConfigError(f"{path} sets keys of Hydra itself; leave out {HYDRA}")
        if key.value == DEFAULTS:
            for node in _nodes(value):
                if isinstance(node, yaml.ScalarNode):
                    check_choice(node.value, str(path))
    for node in _nodes(tree):
        _check_node(path, node)


def check_choice(text: str, where: str) -> None:
    """Refuse the name of a group or an option that leads elsewhere than to an option.

    Raises
    ------
    ConfigError    for a path out of the folder, a reference, another source, or Hydra's groups
    """
    parts = re.split(r"[/@:\s]", text)
    leads_out = ".." in parts or "//" in text or "\\" in text or OPENING in text
    if leads_out or parts[0].startswith("~"):
        raise ConfigError(
            f"{where}: '{shortened(text)}' leads out of the options; choose an option by its name"
        )
    if HYDRA in parts:
        raise ConfigError(
            f"{where}: '{shortened(text)}' is a setting of Hydra itself; leave it out"
        )


def _check_package(path: Path, package: str) -> None:
    if HYDRA in package.split("."):
        raise ConfigError(
            f"{path} puts its keys into '{shortened(package)}', which are Hydra's own; "
            "leave out that line"
        )


def _check_events(path: Path, text: str) -> None:
    """Refuse tags, and a size with aliases expanded that no option file has."""
    where = str(path)
    anchors: dict[str, Size] = {}
    content, names = [Size()], [""]  # of the lists and mappings that are open
    for event in yaml.parse(text, Loader=LOADER):
        if getattr(event, "tag", None) is not None:
            raise ConfigError(
                f"{where}, line {event.start_mark.line + 1}: the tag '{shortened(event.tag)}' is "
                "refused: option files hold plain values; leave it out"
            )
        if isinstance(event, yaml.CollectionStartEvent):
            content.append(Size())
            names.append(event.anchor or "")
            if len(content) > MOST_DEPTH:
                Size(depth=len(content)).check(where)
            continue
        if isinstance(event, yaml.AliasEvent):
            size, name = anchors.get(event.anchor), ""
            if size is None:
                raise ConfigError(
                    f"{where}: the alias *{shortened(event.anchor)} stands for itself or nothing; "
                    "write the value"
                )
        elif isinstance(event, yaml.ScalarEvent):
            size, name = Size(1, len(event.value)), event.anchor
        elif isinstance(event, yaml.CollectionEndEvent):
            size, name = content.pop().nested(), names.pop()
        else:
            continue
        if name:
            anchors[name] = size
        content[-1] += size
        content[-1].check(where)
        if len(content) + size.depth > MOST_DEPTH:
            Size(depth=len(content) + size.depth).check(where)


def _check_node(path: Path, node: Any) -> None:
    """Refuse keys and values of one node."""
    where = f"{path}, line {node.start_mark.line + 1}"
    if isinstance(node, yaml.MappingNode):
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise ConfigError(f"{where}: a key must be a text")
            check_key(key.value, where)
    if not isinstance(node, yaml.ScalarNode):
        return
    check_text(node.value, where)
    is_long = len(node.value) > LONGEST_NUMBER and not node.style
    if is_long and NUMBER.fullmatch(node.value):
        raise ConfigError(
            f"{where}: a number of {len(node.value)} digits; write it shorter"
        )


def _nodes(root: Any) -> Iterator[Any]:
    """Every node below one, and itself, each once however many aliases name it."""
    seen: set[int] = set()
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        yield node
        if isinstance(node, yaml.MappingNode):
            waiting += [part for pair in node.value for part in pair]
        elif isinstance(node, yaml.SequenceNode):
            waiting += node.value
