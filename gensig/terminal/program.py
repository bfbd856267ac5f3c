"""Parser, exit statuses and error line of both commands."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from gensig.errors import ConfigError, GensigError
from gensig.terminal.interruptions import INTERRUPTED, TERMINATED, terminable
from gensig.terminal.printing import remark, show_text
from gensig.text import nearest
from gensig.text.amounts import typed_count

MISTAKE = 2
EXITS = {
    0: "as asked",
    MISTAKE: "a mistake or a file that cannot be used: one line says what",
    INTERRUPTED: "interrupted",
    TERMINATED: "stopped by SIGTERM",
}
HELP_FLAGS = ("-h", "--help")
# how argparse begins what it says of words that it does not know, and of words that it misses
UNKNOWN = "unrecognized arguments: "
MISSING = "the following arguments are required: "
# flags that people type for keys of the overrides
KEYS_FOR_FLAGS = {
    "--data": "data=DIR",
    "--out": "out=DIR",
    "--seed": "seed=N",
    "--seeds": "'seeds=[0,1]'",
    "--epochs": "epochs=N",
    "--fault": "fault=NAME",
    "--gear": "gear=NAME",
}
MULTIRUN_FLAGS = ("-m", "--multirun")
OF_MULTIRUN = "gensig generate, gensig plan and diagnose train"
NUMBERS: dict[Any, str] = {int: "whole number", float: "number"}


class Parser(argparse.ArgumentParser):
    """Parser of one verb; raises ConfigError where argparse would print and exit.

    Parameters
    ----------
    prog : command and verb
    description, examples : texts of ``--help`` above and below the arguments
    exits : meanings of exit statuses that only this verb has
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
        """Parse as argparse does, but name an unknown flag before a missing one."""
        for word in sys.argv[1:] if args is None else args:
            if word == "--":
                break
            name = word.partition("=")[0]
            if name.startswith("--") and name not in self._option_string_actions:
                self.error(f"{UNKNOWN}{word}")
        return super().parse_known_args(args, namespace)

    def _print_message(self, message: str, file: Any = None) -> None:
        show_text(message)

    def error(self, message: str) -> NoReturn:
        """Raise ConfigError in place of the usual message and exit."""
        if message.startswith(UNKNOWN):
            message = self._unknown(message.removeprefix(UNKNOWN).split())
        elif message.startswith(MISSING):
            names = message.removeprefix(MISSING).split(", ")
            wanted = [f"{name} {self._values_of(name)}".strip() for name in names]
            message = f"missing: {', '.join(wanted)}"
        raise ConfigError(f"{message}; see {self.prog} --help")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError:
            count = typed_count(arg_string)
            if action.type is int and count is not None:
                return count
            kind = NUMBERS.get(action.type)
            if kind is None:
                raise
            name = _shown_name(action)
            message = f"{name} {arg_string} is not a {kind}"
            if "=" in arg_string:
                message += f"; key=value words stand before {name}"
            self.error(message)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = ", ".join(map(str, action.choices))
            self.error(f"{_shown_name(action)} {value} is not one of {known}")

    def _match_argument(self, action: argparse.Action, arg_strings_pattern: str) -> int:
        try:
            return super()._match_argument(action, arg_strings_pattern)
        except argparse.ArgumentError as error:
            name = action.option_strings[0]
            wanted = self._values_of(name) or error.message.removeprefix("expected ")
            self.error(f"{name} needs {wanted}")

    def _unknown(self, words: list[str]) -> str:
        word = next((word for word in words if word.startswith("-")), words[0])
        if not word.startswith("-"):
            return f"'{word}' is one word too many"
        known = [name for name in self._option_string_actions if name.startswith("--")]
        name, equals, _ = word.partition("=")
        takes_keys = any(action.dest == "overrides" for action in self._actions)
        if name in MULTIRUN_FLAGS:
            return f"no flag '{name}' here: {OF_MULTIRUN} take it"
        begun = any(flag.startswith(name) for flag in known)
        is_key = takes_keys and name in KEYS_FOR_FLAGS and not begun
        if equals and (is_key or not nearest.near(name, known)):
            text = word.lstrip("-")
            return f"no flag '{word}'; groups and keys have no dashes: {text}"
        if is_key:
            return f"no flag '{name}'; type {KEYS_FOR_FLAGS[name]}"
        return f"no flag '{word}'; {nearest.hint(name, known)}"

    def _values_of(self, name: str) -> str:
        """The values that a flag takes, as its help names them; empty for a switch."""
        action = self._option_string_actions.get(name)
        if action is None or action.nargs == 0:
            return ""
        if isinstance(action.metavar, tuple):
            return " ".join(action.metavar)
        value = str(action.metavar or action.dest)
        if action.nargs == "+":
            return f"{value} ..."
        if isinstance(action.nargs, int):
            return " ".join([value] * action.nargs)
        return value


def _shown_name(action: argparse.Action) -> str:
    """The flag as it is typed; a positional argument by its name in the help."""
    names = action.option_strings or [str(action.metavar or action.dest)]
    return "/".join(names)


def exit_text(exits: Mapping[int, str]) -> str:
    """Lines of a help text with the exit statuses of a verb."""
    meanings = sorted({**EXITS, **exits}.items())
    lines = [f"  {status:<4} {meaning}" for status, meaning in meanings]
    return "\n".join(["exit status:", *lines])


def refuse_verb(
    program: str,
    word: str,
    verbs: Mapping[str, object],
    other: str,
    other_verbs: tuple[str, ...],
) -> None:
    """Raise ConfigError for a first word that is no verb.

    The message names the nearest verbs, or the command that has the verb.
    """
    if word in other_verbs:
        raise ConfigError(f"'{word}' is a command of {other}; type {other} {word}")
    if word.startswith("-") or "=" in word:
        raise ConfigError(
            f"'{word}' stands behind a command; there is {', '.join(verbs)}"
        )
    raise ConfigError(f"no command '{word}'; {nearest.hint(word, verbs)}")


def guarded(program: str, run: Callable[[], int]) -> int:
    """Run a command and return its exit status.

    A mistake, a file that cannot be used and an interruption become one line on stderr.
    """
    with terminable() as stop:
        try:
            return _status_of(program, run)
        except KeyboardInterrupt as interruption:
            remark(program, stop.line(str(interruption)))
            return stop.status


def _status_of(program: str, run: Callable[[], int]) -> int:
    try:
        status = run()
        sys.stdout.flush()
        return status
    except GensigError as error:
        return complain(program, str(error))
    except BrokenPipeError:
        # The reader of a pipe has gone, as head does. Nobody is there to be told.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except OSError as error:
        message = error.strerror or str(error)
        if error.filename:
            message = f"{error.filename}: {message}"
        return complain(program, message)


def complain(program: str, message: str) -> int:
    """Print one line on stderr and return the exit status of a mistake."""
    remark(program, message)
    return MISTAKE
