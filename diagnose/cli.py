"""The command ``diagnose``: verbs, help, and one line for a mistake. Everything heavy is imported when needed."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

from diagnose.commands.parser import Parser
from gensig.errors import ConfigError, GensigError

# Verb -> what it does; ``diagnose.commands.VERB`` has ``run(words) -> exit status``.
VERBS = {
    "train": "train, judge and report",
    "evaluate": "judge a trained network",
    "predict": "try a trained network on a recording",
    "export": "write a trained network as ONNX",
    "adapt": "move a trained network to a machine by its healthy recordings",
    "detectability": "which test shows a fault: maps over speed, torque, channel and bandwidth",
    "score": "score predictions of your own, beside a frozen benchmark",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; exit status 0, 2 for a mistake, 3 for the flag of predict, 130 when interrupted."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        return _dispatch(words)
    except GensigError as error:
        print(f"diagnose: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"diagnose: {where}{error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("diagnose: interrupted", file=sys.stderr)
        return 130


def _dispatch(words: list[str]) -> int:
    top = Parser(
        prog="diagnose",
        description="Train and judge fault classifiers on gensig data sets.",
        epilog="Each command has its own --help with an example.",
    )
    verbs = top.add_subparsers(dest="verb", metavar=" | ".join(VERBS), parser_class=Parser)
    for name, summary in VERBS.items():
        verbs.add_parser(name, help=summary, add_help=False)
    if not words:
        top.print_help(sys.stderr)
        return 2
    if words[0] in ("-h", "--help"):
        top.print_help()
        return 0
    if words[0] not in VERBS:
        raise ConfigError(f"no command '{words[0]}'; there is {', '.join(VERBS)}")
    return int(importlib.import_module(f"diagnose.commands.{words[0]}").run(words[1:]))


if __name__ == "__main__":
    sys.exit(main())
