"""docs/commands.md, made from the verbs. ``python tests/command_page.py`` writes it."""

import argparse
import importlib
from pathlib import Path

import diagnose.cli
import gensig.cli
from gensig.commands.verbs import VERBS
from gensig.terminal.program import EXITS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "commands.md"
END_OF_HEAD = "| status | meaning |"


def status_1(name: str) -> dict[int, str]:
    """Exit statuses of a verb of gensig that not every verb has."""
    meaning = VERBS[name].status_1
    if meaning is None:
        return {}
    return {1: meaning}


def diagnose_exits(name: str) -> dict[int, str]:
    """Exit statuses of a verb of diagnose that not every verb has."""
    return getattr(importlib.import_module(f"diagnose.commands.{name}"), "EXITS", {})


def examples(epilog: str | None) -> list[str]:
    """The commands below 'example:' of a help text."""
    text = (epilog or "").partition("example")[2].partition(":\n")[2]
    return [line.strip() for line in text.splitlines() if line.strip()]


def parsers() -> dict[str, argparse.ArgumentParser]:
    """The parser of every verb of both commands, by 'command verb'."""
    return {
        f"{command} {name}": module.verb_parser(name)
        for command, module in (("gensig", gensig.cli), ("diagnose", diagnose.cli))
        for name in module.VERBS
    }


def page() -> str:
    """The whole page; the text above the table of exit statuses is written by hand."""
    head = PAGE.read_text(encoding="utf-8").partition(END_OF_HEAD)[0]
    lines = [f"{head}{END_OF_HEAD}", "|---|---|"]
    lines += [f"| {status} | {text} |" for status, text in EXITS.items()]
    lines += ["", "Beside these, or in place of them:", ""]
    summaries = {
        "gensig": {name: verb.summary for name, verb in VERBS.items()},
        "diagnose": diagnose.cli.VERBS,
    }
    exits = {"gensig": status_1, "diagnose": diagnose_exits}
    for command, verbs in summaries.items():
        for name in verbs:
            for status, text in exits[command](name).items():
                lines.append(f"- `{command} {name}`, {status}: {text}")
    by_name = parsers()
    for command, verbs in summaries.items():
        lines += ["", f"## {command}"]
        for name, summary in verbs.items():
            shown = examples(by_name[f"{command} {name}"].epilog)
            lines += ["", f"**{name}**: {summary}", ""]
            lines += [f"    {example}" for example in shown]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
