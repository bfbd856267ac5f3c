"""The command ``diagnose``.

Verbs, help, and one line for a mistake. Everything heavy is imported when needed.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Sequence
from typing import Any

from gensig.errors import ConfigError
from gensig.terminal.printing import show, show_text, tell_text
from gensig.terminal.program import HELP_FLAGS, Parser, exit_text, guarded, refuse_verb
from gensig.text.escaping import set_warning_lines
from gensig.text.installation import install
from gensig.version import __version__

# Verb -> its purpose. ``diagnose.commands.VERB`` has HELP, EXAMPLE, ``add_arguments(parser)`` and
# ``run(arguments) -> exit status``.
VERBS = {
    "train": "train, judge and report",
    "resume": "finish a study that was stopped",
    "evaluate": "judge a trained network",
    "predict": "try a trained network on a recording",
    "detect": "compare a recording with healthy ones of the same gearbox",
    "export": "write a trained network as ONNX",
    "verify": "is a trained network whole and unaltered?",
    "bridge": "what a simulation is worth on a measured machine, with comparators",
    "detectability": "which test shows a fault: maps over speed, torque, channel and bandwidth",
    "score": "score predictions of your own, beside a frozen benchmark",
}
OF_GENSIG = (
    "generate",
    "plan",
    "inspect",
    "simulate",
    "options",
    "completion",
    "reproduce",
)
# verb of an older version -> what became of it
REMOVED = {
    "adapt": "removed in 0.15; use diagnose predict --healthy with a network trained with a "
    "reference, or diagnose detect",
}
PROGRAM = "diagnose"
FLAGS = "predict: unlike the training data; detect: changed"
# module -> package of the extra, which an installation of gensig alone does not have
EXTRA = {
    "torch": "torch",
    "sklearn": "scikit-learn",
    "safetensors": "safetensors",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Exit status 0, 2 for a mistake, 3 for the flags of predict and detect, 130 when interrupted,
    143 for SIGTERM.
    """
    from gensig.terminal.completion import answer, is_asked

    if is_asked():
        verbs = {
            name: (summary, _module(name).add_arguments)
            for name, summary in VERBS.items()
        }
        answer(PROGRAM, verbs, primary="train")
    if argv is None:
        argv = sys.argv[1:]
    words = list(argv)
    return guarded(PROGRAM, lambda: _dispatch(words))


def _dispatch(words: list[str]) -> int:
    if words[:1] == ["help"]:
        words = [*words[1:2], HELP_FLAGS[1]]
    if not words or words[0] in HELP_FLAGS:
        if not words:
            tell_text(_help())
            return 2
        show_text(_help())
        return 0
    if words[0] in ("-V", "--version"):
        show(f"diagnose {__version__}")
        return 0
    if words[0] in REMOVED:
        raise ConfigError(f"'{words[0]}' was {REMOVED[words[0]]}")
    if words[0] not in VERBS:
        refuse_verb(PROGRAM, words[0], VERBS, "gensig", OF_GENSIG)
    verb, *rest = words
    try:
        arguments = verb_parser(verb).parse_intermixed_args(rest)
        _require_packages()
        set_warning_lines(PROGRAM)
        return int(_module(verb).run(arguments))
    except SystemExit as leaving:  # --help
        return int(leaving.code or 0)


def _require_packages() -> None:
    """Raise ConfigError where a package of the extra is missing, before any work begins."""
    missing = [name for module, name in EXTRA.items() if not _is_installed(module)]
    if missing:
        raise ConfigError(
            f"{PROGRAM} needs {', '.join(missing)}: {install('diagnose')}"
        )


def _is_installed(module: str) -> bool:
    if module in sys.modules:
        return sys.modules[module] is not None
    return importlib.util.find_spec(module) is not None


def verb_parser(name: str) -> Parser:
    """The parser of a verb, with its help."""
    verb = _module(name)
    exits = getattr(verb, "EXITS", {})
    parser = Parser(f"{PROGRAM} {name}", verb.HELP, verb.EXAMPLE, exits)
    verb.add_arguments(parser)
    return parser


def _module(verb: str) -> Any:
    return importlib.import_module(f"diagnose.commands.{verb}")


def _help() -> str:
    width = max(map(len, VERBS))
    verbs = "\n".join(
        f"  {name:<{width}}  {summary}" for name, summary in VERBS.items()
    )
    statuses = exit_text({3: FLAGS})
    return (
        "usage: diagnose COMMAND [ARGUMENTS]\n\n"
        "Train and judge fault classifiers on gensig data sets.\n\n"
        f"commands:\n{verbs}\n\n"
        "gensig options train lists the keys of diagnose train, gensig options model its "
        "networks.\n"
        f"diagnose COMMAND --help explains each, with an example.\n\n{statuses}"
    )


if __name__ == "__main__":
    sys.exit(main())
