"""docs/commands.md, made from the verbs: ``python tests/command_page.py`` writes it, a test compares it."""

import argparse
from pathlib import Path

import diagnose.cli
import gensig.cli
from diagnose.commands import (
    adapt,
    detectability,
    evaluate,
    export,
    predict,
    score,
    train,
)
from gensig.commands.verbs import VERBS
from gensig.terminal.program import EXITS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "commands.md"
DIAGNOSE = {
    "train": train, "evaluate": evaluate, "predict": predict, "export": export, "adapt": adapt,
    "detectability": detectability, "score": score,
}  # fmt: skip
HEAD = """\
# Commands

Made from the verbs themselves: `python tests/command_page.py`. `gensig COMMAND --help` says what each argument does.

## What can be chosen and set

    gensig options                 # groups, a line each, and the keys that offer no choice
    gensig options fault           # options of a group; also of your own: --config-dir DIR
    gensig options fault=crack     # keys of an option with value, unit and comment; --json for programs

A name that does not exist is answered with the nearest ones. A key that a verb on one machine does not read is named on
stderr (`note: operating.speed_rpm is not read by forced-response; use --speed`), so that the same words can be given to
several verbs.

## Tab key

Commands, flags, groups, options, keys and the paths of `data=`, `out=` and tables, of both commands:

    eval "$(gensig completion bash)"          # in ~/.bashrc
    eval "$(gensig completion zsh)"           # in ~/.zshrc, after compinit
    gensig completion fish | source           # in ~/.config/fish/config.fish

Type groups and keys together: those behind a flag that follows others are offered no candidates.

## Exit status

"""


def gensig_exits(name: str) -> dict[int, str]:
    """Exit statuses of a verb of gensig that not every verb has."""
    one = VERBS[name].one
    return {} if one is None else {1: one}


def diagnose_exits(name: str) -> dict[int, str]:
    """Exit statuses of a verb of diagnose that not every verb has."""
    return getattr(DIAGNOSE[name], "EXITS", {})


def examples(epilog: str | None) -> list[str]:
    """The commands below 'example:' of a help text."""
    text = (epilog or "").partition("example")[2].partition(":\n")[2]
    return [line.strip() for line in text.splitlines() if line.strip()]


def parsers() -> dict[str, argparse.ArgumentParser]:
    """The parser of every verb of both commands, by 'command verb'."""
    mine = {f"gensig {name}": gensig.cli.verb_parser(name) for name in VERBS}
    return mine | {
        f"diagnose {name}": diagnose.cli.verb_parser(name)
        for name in diagnose.cli.VERBS
    }


def page() -> str:
    """The whole page."""
    lines = [
        HEAD + "| status | meaning |",
        "|---|---|",
        *(f"| {status} | {text} |" for status, text in EXITS.items()),
    ]
    lines += [
        "",
        "Beside these, or in place of them:",
        "",
        "| command | status | meaning |",
        "|---|---|---|",
    ]
    for command, exits, names in (
        ("gensig", gensig_exits, VERBS),
        ("diagnose", diagnose_exits, diagnose.cli.VERBS),
    ):
        lines += [
            f"| `{command} {name}` | {at} | {text} |"
            for name in names
            for at, text in exits(name).items()
        ]
    summaries = {
        "gensig": {name: verb.summary for name, verb in VERBS.items()},
        "diagnose": diagnose.cli.VERBS,
    }
    by_name = parsers()
    for command, verbs in summaries.items():
        lines += ["", f"## {command}"]
        for name, summary in verbs.items():
            shown = examples(by_name[f"{command} {name}"].epilog)
            lines += [
                "",
                f"**{name}**: {summary}",
                "",
                *(f"    {example}" for example in shown),
            ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
