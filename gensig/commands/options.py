"""The verb options: which groups, options and keys there are, a line each."""

from __future__ import annotations

import json
import shutil
import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from gensig.errors import ConfigError
from gensig.options import files as option_files
from gensig.options.files import (
    PRIMARY,
    Key,
    chosen_beside,
    groups,
    option_keys,
    options,
    section_keys,
    sections,
)
from gensig.text import nearest

VALUE_WIDTH = 34  # a longer value is cut; --json has it whole
READ_BY = {"generate": "gensig", "train": "diagnose train"}


def list_options(arguments: Namespace) -> int:
    """Print the groups, the options of one group, or the keys of one option."""
    word, folder = arguments.what, arguments.config_dir
    if word is None:
        content, lines = _all_groups(folder)
    else:
        group, equals, option = word.partition("=")
        content, lines = (
            _one_option(group, option, folder) if equals else _one_group(group, folder)
        )
    print(json.dumps(content, indent=1) if arguments.json else "\n".join(lines))
    return 0


def _all_groups(folder: str | None) -> tuple[Any, list[str]]:
    found, parts = groups(folder), sections()
    content = {
        "groups": [
            {
                **asdict(group),
                "options": [one.name for one in options(group.name, folder)],
            }
            for group in found
        ],
        "sections": list(parts),
    }
    rows = [(group.name, group.default or "-", group.about) for group in found]
    lines = [
        "groups: choose with GROUP=OPTION; `gensig options GROUP` lists the options",
        "",
    ]
    lines += _table(("group", "default", "what it is"), rows)
    lines += [
        "",
        "keys without a choice: set with KEY=VALUE; `gensig options NAME` lists them",
        "",
    ]
    lines += _table(
        ("name", "read by", "keys"),
        [(name, READ_BY[parts[name]], _key_names(name)) for name in parts],
    )
    return content, lines


def _one_group(group: str, folder: str | None) -> tuple[Any, list[str]]:
    if group in sections():
        keys = section_keys(group)
        return {"section": group, "keys": [asdict(key) for key in keys]}, _key_table(
            keys
        )
    _check_group(group, folder)
    found = options(group, folder)
    content = {
        "group": group,
        "options": [{"name": one.name, "about": one.about} for one in found],
    }
    default = next(one.default for one in groups(folder) if one.name == group)
    rows = [
        (f"{group}={one.name}" + (" *" if one.name == default else ""), one.about)
        for one in found
    ]
    star = ["", "* taken where none is typed"] if default else []
    return content, [
        *_table(("option", "what it is"), rows),
        *star,
        f"`gensig options {group}=NAME` lists its keys",
    ]


def _one_option(group: str, option: str, folder: str | None) -> tuple[Any, list[str]]:
    _check_group(group, folder)
    found = {one.name: one for one in options(group, folder)}
    if option not in found:
        there = option_files.elsewhere(group, option) or nearest.hint(option, found)
        raise ConfigError(f"no option '{option}' of {group}; {there}")
    keys, beside = (
        option_keys(group, option, folder),
        chosen_beside(group, option, folder),
    )
    about = found[option].about
    listed = [asdict(key) for key in keys]
    content = {
        "group": group,
        "option": option,
        "about": about,
        "chooses": beside,
        "keys": listed,
    }
    head = [f"{group}={option}: {about}"]
    if beside:
        head.append(
            f"chooses too: {' '.join(f'{name}={other}' for name, other in beside.items())}"
        )
    return content, [*head, "", *_key_table(keys)]


def _check_group(group: str, folder: str | None) -> None:
    names = [one.name for one in groups(folder)]
    if group not in names:
        known = [*names, *sections()]
        having = [
            name
            for name in names
            if group in [one.name for one in options(name, folder)]
        ]
        if having:
            raise ConfigError(
                f"'{group}' is an option; type gensig options {having[0]}={group}"
            )
        raise ConfigError(
            f"no group '{group}'; {nearest.hint(group, known)}; `gensig options` says what each is"
        )


def _key_names(section: str) -> str:
    names = [
        key.name if section in PRIMARY else key.name.partition(".")[2]
        for key in section_keys(section)
    ]
    return ", ".join(names[:4]) + (", ..." if len(names) > 4 else "")


def _key_table(keys: Sequence[Key]) -> list[str]:
    rows = [(key.name, _cut(key.text), key.unit, key.comment) for key in keys]
    return _table(("key", "value", "unit", "comment"), rows)


def _cut(text: str) -> str:
    return text if len(text) <= VALUE_WIDTH else f"{text[: VALUE_WIDTH - 4]} ..."


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Aligned columns.

    On a terminal the last one is cut to its width, so that every row is one line.
    """
    widths = [
        max(len(row[place]) for row in (head, *rows)) for place in range(len(head) - 1)
    ]
    lines = []
    for row in (head, *rows):
        cells = "  ".join(
            cell.ljust(width) for cell, width in zip(row, widths, strict=False)
        )
        lines.append(f"{cells}  {row[-1]}".rstrip())
    if not sys.stdout.isatty():
        return lines
    room = shutil.get_terminal_size().columns
    return [line if len(line) <= room else f"{line[: room - 4]} ..." for line in lines]
