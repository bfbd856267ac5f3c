"""What both commands have in common.

One line for a mistake, exit statuses, nearest names for flags.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from gensig.errors import ConfigError, GensigError
from gensig.text import nearest

MISTAKE, INTERRUPTED = 2, 130
EXITS = {
    0: "as asked",
    MISTAKE: "a mistake or a file that cannot be used: one line says what",
    INTERRUPTED: "interrupted",
}
HELP_FLAGS = ("-h", "--help")


class Parser(argparse.ArgumentParser):
    """Parser of one verb, whose complaints are the one line of `guarded`.

    Parameters
    ----------
    prog : command and verb
    description, examples : what ``--help`` says above and below the arguments
    exits : what exit statuses mean that only this verb has
    """

    def __init__(
        self, prog: str, description: str, examples: str, exits: Mapping[int, str]
    ) -> None:
        super().__init__(
            prog=prog,
            description=description,
            epilog=f"{exit_text(exits)}\n\n{examples}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As usual, but a flag that does not exist is named before one that is missing."""
        for word in sys.argv[1:] if args is None else args:
            if word == "--":
                break
            if (
                word.startswith("--")
                and word.partition("=")[0] not in self._option_string_actions
            ):
                self.error(f"unrecognized arguments: {word}")
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Refuse the words."""
        raise ConfigError(f"{self._mended(message)}; see {self.prog} --help")

    def _mended(self, message: str) -> str:
        """The complaint with what was given, what is allowed and what to do."""
        if found := re.match(r"unrecognized arguments: (.*)", message):
            return self._unknown(found.group(1).split())
        if found := re.match(
            r"argument (\S+): invalid (float|int) value: '(.*)'", message
        ):
            flag, kind, given = found.groups()
            text = f"{flag} {given} is not a {'whole ' if kind == 'int' else ''}number"
            return (
                f"{text}; key=value words stand before {flag}" if "=" in given else text
            )
        if found := re.match(
            r"argument (\S+): invalid choice: '(.*?)' \(choose from (.*)\)", message
        ):
            flag, given, known = found.groups()
            names = [name.strip(" '") for name in known.split(",")]
            return f"{flag} {given} is not one of {', '.join(names)}"
        if found := re.match(r"argument (\S+?)(?:/\S+)?: expected (.*)", message):
            flag, wanted = found.groups()
            return f"{flag} needs {self._wanted(flag) or wanted}"
        if found := re.match(r"the following arguments are required: (.*)", message):
            names = found.group(1).split(", ")
            return f"missing: {', '.join(f'{name} {self._wanted(name)}'.strip() for name in names)}"
        return message

    def _unknown(self, words: list[str]) -> str:
        word = next((one for one in words if one.startswith("-")), words[0])
        if not word.startswith("-"):
            return f"'{word}' is one word too many"
        flags = [
            flag
            for action in self._actions
            for flag in action.option_strings
            if flag.startswith("--")
        ]
        if "=" in word and not nearest.near(word.partition("=")[0], flags):
            return (
                f"no flag '{word}'; groups and keys have no dashes: {word.lstrip('-')}"
            )
        return f"no flag '{word}'; {nearest.hint(word.partition('=')[0], flags)}"

    def _wanted(self, name: str) -> str:
        """The values of a flag as the help names them."""
        for action in self._actions:
            if name in action.option_strings and action.nargs != 0:
                names = (
                    action.metavar
                    if isinstance(action.metavar, tuple)
                    else (str(action.metavar or action.dest),)
                )
                names = (
                    names * action.nargs
                    if isinstance(action.nargs, int) and len(names) == 1
                    else names
                )
                return " ".join(names) + (" ..." if action.nargs == "+" else "")
        return ""


def exit_text(exits: Mapping[int, str]) -> str:
    """The exit statuses of a verb, a line each, for its help."""
    lines = [
        f"  {status:<4} {meaning}"
        for status, meaning in sorted({**EXITS, **exits}.items())
    ]
    return "\n".join(["exit status:", *lines])


def refuse_verb(
    program: str,
    word: str,
    verbs: Mapping[str, object],
    other: str,
    other_verbs: tuple[str, ...],
) -> None:
    """Raise for a first word that is no verb, with the nearest ones or the command that has it."""
    if word in other_verbs:
        raise ConfigError(f"'{word}' is a command of {other}; type {other} {word}")
    if word.startswith("-") or "=" in word:
        raise ConfigError(
            f"'{word}' stands behind a command; there is {', '.join(verbs)}"
        )
    raise ConfigError(f"no command '{word}'; {nearest.hint(word, verbs)}")


def guarded(program: str, run: Callable[[], int], *, interrupted: str) -> int:
    """Exit status of ``run``.

    A mistake, a file that cannot be used and an interruption are one line on stderr.
    """
    try:
        status = run()
        sys.stdout.flush()
        return status
    except GensigError as error:
        return complain(program, str(error))
    except BrokenPipeError:  # the reader of a pipe has gone, as head does: nothing to say, and nowhere to say it
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return complain(program, f"{where}{error.strerror or error}")
    except KeyboardInterrupt:
        complain(program, interrupted)
        return INTERRUPTED


def complain(program: str, message: str) -> int:
    """Print one line on stderr; gives the exit status of a mistake."""
    print(f"{program}: {' '.join(message.split())}", file=sys.stderr)
    return MISTAKE
