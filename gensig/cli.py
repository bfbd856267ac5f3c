"""The command ``gensig``.

Verbs, help, and one line for a mistake. Only the verbs that need physics import it.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from functools import cache

from gensig.commands.flags import OVERRIDES_HELP
from gensig.commands.verbs import GROUPS, VERBS
from gensig.terminal.printing import show, show_text, tell_text
from gensig.terminal.program import HELP_FLAGS, Parser, exit_text, guarded, refuse_verb
from gensig.version import __version__

PROGRAM = "gensig"
OF_DIAGNOSE = (
    "train",
    "evaluate",
    "predict",
    "detect",
    "bridge",
    "detectability",
    "score",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Exit status 0, 1 for partial or damaged results, 2 for a mistake, 130 when interrupted, 143 for
    SIGTERM.
    """
    from gensig.terminal.completion import answer, is_asked

    if is_asked():
        verbs = {
            name: (verb.summary, verb.add_arguments) for name, verb in VERBS.items()
        }
        answer(PROGRAM, verbs, primary="generate")
    words = list(sys.argv[1:] if argv is None else argv)
    return guarded(PROGRAM, lambda: _run(words))


def _run(words: list[str]) -> int:
    if words[:1] == ["help"]:
        words = [*words[1:2], HELP_FLAGS[1]]
    if not words:
        tell_text(_help())
        return 2
    name, *arguments = words
    if name in HELP_FLAGS:
        show_text(_help())
        return 0
    if name in ("-V", "--version"):
        show(f"gensig {__version__}")
        return 0
    if name not in VERBS:
        refuse_verb(PROGRAM, name, VERBS, "diagnose", OF_DIAGNOSE)
    return _run_verb(name, arguments)


def _run_verb(name: str, words: list[str]) -> int:
    verb = VERBS[name]
    try:
        arguments = verb_parser(name).parse_intermixed_args(words)
    except SystemExit as leaving:
        return int(leaving.code or 0)
    from gensig.commands.console import step
    from gensig.compilation import on_compilation
    from gensig.terminal.run_progress import COMPILING
    from gensig.terminal.warning_lines import one_line_warnings

    module, function = verb.runs.split(":")
    is_quiet = getattr(arguments, "quiet", False)

    @cache
    def on_compiling() -> None:
        if not is_quiet:
            step(COMPILING)

    with one_line_warnings(PROGRAM, quiet=is_quiet), on_compilation(on_compiling):
        status = int(getattr(importlib.import_module(module), function)(arguments))
    if verb.instead is not None and not is_quiet:
        from gensig.commands.request import print_unread

        print_unread(arguments, verb.reads, verb.instead)
    return status


def verb_parser(name: str) -> Parser:
    """The parser of a verb, with its help."""
    verb = VERBS[name]
    exits = {}
    if verb.status_1 is not None:
        exits[1] = verb.status_1
    summary = f"{verb.summary[0].upper()}{verb.summary[1:]}"
    if not summary.endswith("?"):
        summary += "."
    examples = [f"example{'s' * (len(verb.examples) > 1)}:", *verb.examples]
    parser = Parser(f"{PROGRAM} {name}", summary, "\n  ".join(examples), exits)
    verb.add_arguments(parser)
    parser.set_defaults(verb=name)
    return parser


def _help() -> str:
    width = max(map(len, VERBS))
    statuses = exit_text(
        {1: "partial, damaged or other results: each COMMAND --help says which"}
    )
    groups = []
    for group, names in GROUPS.items():
        lines = [f"  {name:<{width}}  {VERBS[name].summary}" for name in names]
        groups.append("\n".join([f"{group}:", *lines]))
    verbs = "\n\n".join(groups)
    return (
        "usage: gensig COMMAND [ARGUMENTS]\n\n"
        "Labelled gear-fault vibration data sets from physics.\n\n"
        f"{verbs}\n\n"
        f"{OVERRIDES_HELP}\n"
        "gensig options lists the groups, their options and their keys.\n"
        f"gensig COMMAND --help explains each, with an example.\n\n{statuses}"
    )


if __name__ == "__main__":
    sys.exit(main())
