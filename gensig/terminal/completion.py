"""Shell completion: the verb that prints the shell code, and candidates for a half-typed word.

``argcomplete`` asks the command itself at a press of the tab key. It is loaded at no other time.
"""

from __future__ import annotations

import argparse
import functools
import os
from argparse import Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gensig.terminal.printing import show_text

COMMANDS = ("gensig", "diagnose")


def completion(arguments: Namespace) -> int:
    """Print the lines that make a shell complete both commands."""
    from argcomplete.shell_integration import shellcode

    show_text(shellcode(COMMANDS, shell=arguments.shell))
    return 0


def is_asked() -> bool:
    """True when this run is a press of the tab key."""
    return "_ARGCOMPLETE" in os.environ


def answer(
    program: str,
    verbs: Mapping[str, tuple[str, Callable[[argparse.ArgumentParser], None]]],
    *,
    primary: str,
) -> None:
    """Print the candidates for the word at the cursor and leave.

    Parameters
    ----------
    program : name of the command
    verbs : verb -> its summary, and the function that adds its arguments to a parser
    primary : the configuration that its overrides are of, ``"generate"`` or ``"train"``
    """
    import argcomplete

    top = argparse.ArgumentParser(prog=program)
    choices = top.add_subparsers()
    for name, (summary, add_arguments) in verbs.items():
        parser = choices.add_parser(name, help=summary)
        add_arguments(parser)
        of_verb = {"detectability": "generate"}.get(name, primary)
        completers = {
            "overrides": functools.partial(candidates, primary=of_verb),
            "what": what_candidates,
        }
        for action in parser._actions:
            if action.dest in completers:
                action.completer = completers[action.dest]  # type: ignore[attr-defined]
    argcomplete.autocomplete(top, always_complete_options="long")


def candidates(
    prefix: str, parsed_args: Any, *, primary: str, **_: Any
) -> dict[str, str]:
    """Groups, options and keys that a half-typed override may become, each with its remark.

    Keys that take a path get the files and folders.
    """
    from argcomplete.completers import FilesCompleter

    from gensig.options.files import (
        groups,
        option_keys,
        options,
        section_keys,
        sections,
        user_folder,
    )

    folder = getattr(parsed_args, "config_dir", None) or user_folder()
    offered = {
        group.name: group for group in groups(folder) if group.primary == primary
    }
    name, equals, value = prefix.partition("=")
    if equals and (name in ("data", "out") or name.endswith("_csv")):
        return {f"{name}={path}": "" for path in FilesCompleter()(value)}
    if equals and name not in offered:
        return {}
    if equals:
        return _options_of(name, folder)
    result = {f"{group.name}=": group.about for group in offered.values()}
    keys = [
        key
        for section, file in sections().items()
        if file == primary
        for key in section_keys(section)
    ]
    chosen = dict(word.partition("=")[::2] for word in parsed_args.overrides or ())
    for group in offered.values():
        option = str(chosen.get(group.name) or group.default)
        known = {option.name for option in options(group.name, folder)}
        if prefix.startswith(group.name[: len(prefix)]) and option in known:
            keys += option_keys(group.name, option, folder)
    return result | {f"{key.name}=": key.comment for key in keys}


def what_candidates(prefix: str, parsed_args: Any, **_: Any) -> dict[str, str]:
    """Candidates for ``gensig options``: groups, sections, and options of a group."""
    from gensig.options.files import groups, sections, user_folder

    folder = getattr(parsed_args, "config_dir", None) or user_folder()
    name, equals, _value = prefix.partition("=")
    if equals:
        return _options_of(name, folder)
    result = {group.name: group.about for group in groups(folder)}
    return result | dict.fromkeys(sections(), "keys without a choice")


def _options_of(group: str, folder: str | Path | None) -> dict[str, str]:
    from gensig.options.files import options

    return {f"{group}={option.name}": option.about for option in options(group, folder)}
