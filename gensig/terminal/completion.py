"""Shell completion: the verb that prints what to source, and the candidates for a half-typed word.

``argcomplete`` asks the command itself at a press of the tab key; nothing of it is loaded at any
other time.
"""

from __future__ import annotations

import argparse
import os
from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from typing import Any

COMMANDS = ("gensig", "diagnose")


def completion(arguments: Namespace) -> int:
    """Print the lines that make a shell complete both commands."""
    from argcomplete.shell_integration import shellcode

    print(shellcode(COMMANDS, shell=arguments.shell))
    return 0


def is_asked() -> bool:
    """Whether this run is a press of the tab key."""
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
        for action in parser._actions:
            _offer(action, name, primary)
    argcomplete.autocomplete(top, always_complete_options="long")


def _offer(action: argparse.Action, verb: str, primary: str) -> None:
    """Give an argument its candidates."""
    if action.dest == "overrides":
        action.completer = lambda prefix, parsed_args, **_: candidates(  # type: ignore[attr-defined]
            prefix,
            list(parsed_args.overrides or ()),
            parsed_args,
            "generate" if verb == "detectability" else primary,
        )
    elif action.dest == "what":
        action.completer = lambda prefix, parsed_args, **_: what_candidates(
            prefix, parsed_args
        )  # type: ignore[attr-defined]


def candidates(
    prefix: str, typed: Sequence[str], arguments: Any, primary: str
) -> dict[str, str]:
    """Groups, their options, keys of the chosen options, each with its line.

    Paths for the keys that take one.
    """
    from argcomplete.completers import FilesCompleter

    from gensig.options.files import (
        groups,
        option_keys,
        options,
        section_keys,
        sections,
    )

    folder = getattr(arguments, "config_dir", None)
    offered = [group for group in groups(folder) if group.primary == primary]
    name, equals, value = prefix.partition("=")
    if equals and (name in ("data", "out") or name.endswith("_csv")):
        return {f"{name}={path}": "" for path in FilesCompleter()(value)}
    if equals:
        known = (
            options(name, folder) if name in [group.name for group in offered] else []
        )
        return {f"{name}={one.name}": one.about for one in known}
    found = {f"{group.name}=": group.about for group in offered}
    chosen = dict(word.partition("=")[::2] for word in typed)
    for section in (section for section, file in sections().items() if file == primary):
        found |= {f"{key.name}=": key.comment for key in section_keys(section)}
    for group in offered:
        option = chosen.get(group.name) or group.default
        if prefix.startswith(group.name[: len(prefix)]) and option in [
            one.name for one in options(group.name, folder)
        ]:
            found |= {
                f"{key.name}=": key.comment
                for key in option_keys(group.name, str(option), folder)
            }
    return found


def what_candidates(prefix: str, arguments: Any) -> dict[str, str]:
    """Groups, parts of the configuration, and options of a group, for ``gensig options``."""
    from gensig.options.files import groups, options, sections

    folder = getattr(arguments, "config_dir", None)
    name, equals, _ = prefix.partition("=")
    if equals:
        return {f"{name}={one.name}": one.about for one in options(name, folder)}
    return {group.name: group.about for group in groups(folder)} | dict.fromkeys(
        sections(), "keys without a choice"
    )
