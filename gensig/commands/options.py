"""``gensig options``: groups, options and keys, a line each."""

from __future__ import annotations

import json
import shutil
import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.options.files import (
    PRIMARY,
    Key,
    chosen_options,
    groups,
    option_keys,
    options,
    section_keys,
    sections,
    user_folder,
)
from gensig.options.own_options import say_read
from gensig.terminal.printing import show, show_text
from gensig.text import nearest

VALUE_WIDTH = 34  # longer values are cut; --json has them whole
SHOWN_KEYS = 4  # of a section in the list of groups
READ_BY = {"generate": "gensig", "train": "diagnose train"}

Listing = tuple[Any, list[str]]  # content for --json, and the lines of text


def list_options(arguments: Namespace) -> int:
    """Print the groups, the options of one group, or the keys of one option."""
    folder = arguments.config_dir
    if folder is None and (folder := user_folder()) is not None:
        say_read()
    content, lines = _listing(arguments.what, folder)
    if arguments.json:
        show_text(json.dumps(content, indent=1))
    else:
        show(*lines)
    return 0


def _listing(word: str | None, folder: str | Path | None) -> Listing:
    if word is None:
        return _all_groups(folder)
    group, equals, option = word.partition("=")
    if equals:
        return _option_listing(group, option, folder)
    if group in sections():
        keys = section_keys(group)
        content = {"section": group, "keys": [asdict(key) for key in keys]}
        return content, _key_table(keys)
    return _group_listing(group, folder)


def _all_groups(folder: str | Path | None) -> Listing:
    result, parts = groups(folder), sections()
    contents = []
    for group in result:
        names = [option.name for option in options(group.name, folder)]
        contents.append({**asdict(group), "options": names})
    group_rows = [(group.name, group.default or "-", group.about) for group in result]
    section_rows = [(name, READ_BY[parts[name]], _key_names(name)) for name in parts]
    lines = [
        "groups: choose with GROUP=OPTION; `gensig options GROUP` lists the options",
        "",
        *_table(("group", "default", "what it is"), group_rows),
        "",
        "keys without a choice: set with KEY=VALUE; `gensig options NAME` lists them",
        "",
        *_table(("name", "read by", "keys"), section_rows),
    ]
    return {"groups": contents, "sections": list(parts)}, lines


def _group_listing(group: str, folder: str | Path | None) -> Listing:
    default = _defaults(group, folder)[group]
    rows, contents = [], []
    for option in options(group, folder):
        contents.append({"name": option.name, "about": option.about})
        name = f"{group}={option.name}"
        if option.name == default:
            name += " *"
        rows.append((name, option.about))
    lines = _table(("option", "what it is"), rows)
    if default:
        lines += ["", "* taken where none is typed"]
    lines.append(f"`gensig options {group}=NAME` lists its keys")
    return {"group": group, "options": contents}, lines


def _option_listing(group: str, option: str, folder: str | Path | None) -> Listing:
    _defaults(group, folder)
    abouts = {result.name: result.about for result in options(group, folder)}
    if option not in abouts:
        hint = nearest.hint(option, abouts)
        raise ConfigError(f"no option '{option}' of {group}; {hint}")
    keys = option_keys(group, option, folder)
    chosen = chosen_options(group, option, folder)
    about = abouts[option]
    content = {
        "group": group,
        "option": option,
        "about": about,
        "chooses": chosen,
        "keys": [asdict(key) for key in keys],
    }
    lines = [f"{group}={option}: {about}"]
    if chosen:
        words = " ".join(f"{name}={other}" for name, other in chosen.items())
        lines.append(f"chooses too: {words}")
    return content, [*lines, "", *_key_table(keys)]


def _defaults(group: str, folder: str | Path | None) -> dict[str, Any]:
    """Group -> default option; raises ConfigError where ``group`` is no group."""
    defaults = {result.name: result.default for result in groups(folder)}
    if group in defaults:
        return defaults
    for name in defaults:
        if group in [option.name for option in options(name, folder)]:
            raise ConfigError(
                f"'{group}' is an option; type gensig options {name}={group}"
            )
    hint = nearest.hint(group, [*defaults, *sections()])
    raise ConfigError(f"no group '{group}'; {hint}; `gensig options` says what each is")


def _key_names(section: str) -> str:
    names = [key.name for key in section_keys(section)]
    if section not in PRIMARY:
        names = [name.partition(".")[2] for name in names]
    return ", ".join(names[:SHOWN_KEYS]) + ", ..." * (len(names) > SHOWN_KEYS)


def _key_table(keys: Sequence[Key]) -> list[str]:
    rows = [
        (key.name, _cut(key.text, VALUE_WIDTH), key.unit, key.comment) for key in keys
    ]
    return _table(("key", "value", "unit", "comment"), rows)


def _cut(text: str, width: int) -> str:
    if len(text) <= width:
        return text
    return f"{text[: width - 4]} ..."


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Aligned columns; on a terminal every row is cut to one line."""
    table = [head, *rows]
    columns = list(zip(*table, strict=True))[:-1]
    widths = [max(map(len, column)) for column in columns]
    lines = []
    for row in table:
        cells = [
            cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    if not sys.stdout.isatty():
        return lines
    room = shutil.get_terminal_size().columns
    return [_cut(line, room) for line in lines]
