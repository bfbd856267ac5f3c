"""The command ``gensig``: verbs, help, and one line for a mistake. Only the verbs that need physics import it."""

from __future__ import annotations

import argparse
import difflib
import importlib
import sys
from collections.abc import Sequence
from typing import NoReturn

from gensig.commands.verbs import OVERRIDES, VERBS
from gensig.errors import ConfigError, GensigError
from gensig.version import __version__


class _Parser(argparse.ArgumentParser):
    """Parser whose complaints are the one line of ``main``."""

    def error(self, message: str) -> NoReturn:
        raise ConfigError(f"{message}; see {self.prog} --help")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; exit status 0, 1 for partial or damaged results, 2 for a mistake, 130 when interrupted."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        return _run(words)
    except GensigError as error:
        return _complain(str(error))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _complain(f"{where}{error.strerror or error}")
    except KeyboardInterrupt:
        _complain("interrupted; a data set begun is incomplete, and gensig resume DIR finishes it")
        return 130


def _complain(message: str) -> int:
    print(f"gensig: {' '.join(message.split())}", file=sys.stderr)
    return 2


def _run(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help"):
        print(_help(), file=sys.stdout if words else sys.stderr)
        return 0 if words else 2
    if words[0] in ("-V", "--version"):
        print(f"gensig {__version__}")
        return 0
    name = words[0]
    if name not in VERBS:
        close = difflib.get_close_matches(name, VERBS, n=1)
        hint = f"did you mean '{close[0]}'?" if close else f"there is {', '.join(VERBS)}"
        raise ConfigError(f"no command '{name}'; {hint}")
    verb = VERBS[name]
    parser = _Parser(
        prog=f"gensig {name}",
        description=f"{verb.summary[0].upper()}{verb.summary[1:]}.",
        epilog=f"example:\n  {verb.example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.arguments(parser)
    try:
        arguments = parser.parse_intermixed_args(words[1:])
    except SystemExit as leaving:
        return int(leaving.code or 0)
    from gensig.commands.console import one_line_warnings

    module, function = verb.runs.split(":")
    with one_line_warnings("gensig"):
        return int(getattr(importlib.import_module(module), function)(arguments))


def _help() -> str:
    verbs = "\n".join(f"  {name:<10} {verb.summary}" for name, verb in VERBS.items())
    return (
        "usage: gensig COMMAND [ARGUMENTS]\n\n"
        "Labelled gear-fault vibration data sets from physics.\n\n"
        f"commands:\n{verbs}\n\n"
        f"{OVERRIDES}\n"
        "gensig COMMAND --help explains each, with an example."
    )


if __name__ == "__main__":
    sys.exit(main())
