"""Hostile option files against ``gensig plan``: ``python -m benchmarks.hostile_options``.

Each case is an option file of a stranger: one of the package's options in which one key has a
value of a wrong shape, or a file that is no option at all. It is read, planned, and the inputs of
its first record are made, as ``gensig plan`` does before it simulates. A case is answered by one
line, accepted because the value can be used, or ends otherwise: a traceback, an answer that takes
too long.

``--count`` is the number of cases, ``--seed`` draws them, ``--first`` skips some, ``--json FILE``
writes the figures and ``--table`` prints a line for each case. The exit status is 1 where any case
ended otherwise.
"""

from __future__ import annotations

import argparse
import collections
import json
import random
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import GensigError
from gensig.options.files import groups, options, section_keys, sections
from gensig.text.escaping import escaped, one_line

SECONDS = 60  # of computing, for one case
MOST_RECORDS = 10_000  # whose plan is made; larger plans are only counted
GROUPS = tuple(group.name for group in groups() if group.primary == "generate")
# texts of YAML by what is wrong with them
VALUES = {
    "null": "null",
    "list": "[1, 2]",
    "list of lists": "[[1], {a: [2]}]",
    "empty list": "[]",
    "mapping": "{a: 1, b: [2]}",
    "empty mapping": "{}",
    "text": "abc",
    "empty text": "''",
    "escape sequence": '"\\e[31mred\\e[0m"',
    "formula": "'=cmd'",
    "true": "true",
    "negative": "-1",
    "zero": "0",
    "nan": ".nan",
    "infinity": ".inf",
    "beyond floats": "1e400",
    "huge number": "1" + "0" * 30,
    "date": "2020-01-01",
}
# whole files that are no options
FILES = {
    "empty": "",
    "a remark": "# nothing\n",
    "null": "null\n",
    "a list": "- 1\n- 2\n",
    "a text": "abc\n",
    "kind alone": "kind: 3\n",
    "unknown keys": "a: 1\nb: {c: [2]}\n",
    "no YAML": "a: [1\n",
    "two documents": "a: 1\n---\nb: 2\n",
    "vary is a list": "kind: crack\nvary: [1, 2]\n",
    "vary is a text": "kind: crack\nvary: abc\n",
    "numbers as keys": "1: 2\n2.5: 3\n",
    "sets out": "# @package _global_\nout: ../elsewhere\n",
    "sets an address": "# @package _global_\nexecutor: {kind: dask, address: 'tcp://h:1'}\n",
    "sets the seed": "# @package _global_\nseed: [1]\n",
    "sections are texts": "# @package _global_\nplan: abc\nfault: 3\n",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One hostile file: its group, the option it changes, the key, and the value.

    ``key`` is empty for a whole file; ``text`` is the content of the file.
    """

    group: str
    option: str
    key: str
    kind: str
    text: str


def cases() -> list[Case]:
    """Every case, in a fixed order."""
    result = []
    for group in GROUPS:
        for kind, text in FILES.items():
            result.append(Case(group=group, option="", key="", kind=kind, text=text))
        for option in options(group):
            if group != "experiment":
                text = option.file.read_text(encoding="utf-8")
                result += _changed(group, option.name, text)
    for section in sections():
        keys = section_keys(section)
        for key in keys:
            result += _typed(section, key.name)
    return result


def drawn(everything: list[Case], seed: int) -> list[Case]:
    """The cases in random order, whole files and single keys by turns while both last."""
    random.Random(seed).shuffle(everything)
    files = [case for case in everything if not case.key]
    keys = [case for case in everything if case.key]
    n_both = min(len(files), len(keys))
    pairs = zip(files[:n_both], keys[:n_both], strict=True)
    by_turns = [case for pair in pairs for case in pair]
    return [*by_turns, *files[n_both:], *keys[n_both:]]


def _changed(group: str, option: str, text: str) -> Iterator[Case]:
    """Cases of an option: each of its keys, nested ones too, with each value."""
    content = yaml.safe_load(text) or {}
    head = f"defaults: [{option}, _self_]\n"
    if "@package _global_" in text:
        head = f"# @package _global_\n{head}"
    for path in _paths({key: content[key] for key in content if key != "defaults"}):
        for kind, value in VALUES.items():
            text = value
            for name in reversed(path):
                text = f"{{{json.dumps(name)}: {text}}}"
            body = f"{json.dumps(path[0])}: {text[text.index(':') + 1 : -1].strip()}\n"
            yield Case(
                group=group,
                option=option,
                key=".".join(map(str, path)),
                kind=kind,
                text=head + body,
            )


def _typed(section: str, key: str) -> Iterator[Case]:
    """Cases of a key that has no group, set by an experiment."""
    for kind, value in VALUES.items():
        text = value
        for name in reversed(key.split(".")):
            text = f"{{{name}: {text}}}"
        yield Case(
            group="experiment",
            option="",
            key=key,
            kind=kind,
            text=f"# @package _global_\n{text[1:-1]}\n",
        )


def _paths(content: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for key, value in content.items():
        yield (key,)
        if isinstance(value, dict):
            yield from ((key, *inner) for inner in _paths(value))


def answer(case: Case, folder: Path) -> tuple[str, str]:
    """End of a case: ``one line``, ``accepted`` or ``otherwise``, and its text."""
    target = folder / case.group / "stranger.yaml"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(case.text, encoding="utf-8")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _dry_run([*needed(case), f"{case.group}=stranger"], folder)
    except GensigError as error:
        return "one line", one_line(str(error))
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        return "otherwise", f"{type(error).__name__} in {where}: {error}"
    finally:
        target.unlink()
    return "accepted", ""


# what makes the group of a case read
def needed(case: Case) -> Sequence[str]:
    """Words without which the group of a case is not read."""
    if case.option in HELICAL_GEARS:
        return ("system=helical_pair",)
    return NEEDS.get(case.group, ())


HELICAL_GEARS = {
    option.name
    for option in options("gear")
    if re.search(r"^helix_angle_deg: *[1-9]", option.file.read_text("utf-8"), re.M)
}
NEEDS = {"excitation": ("system=two_stage_gearbox",), "heat": ("system=helical_pair",)}


def _dry_run(words: list[str], folder: Path) -> None:
    """Everything that ``gensig plan`` does before it simulates."""
    from gensig.execution.registry import read_executor
    from gensig.plan.make import count_records, make_plan
    from gensig.plan.request import read_request
    from gensig.record.inputs import InputReader

    config = read_request(words, config_dir=folder).config
    read_executor(config["executor"])
    reader = InputReader(config)
    _ = reader.dataset  # refused where its values are no options
    is_planned = config["life"].get("kind") is None
    if is_planned and count_records(reader).n_records > MOST_RECORDS:
        return
    plan = make_plan(config)
    reader.inputs(plan.record(0))


def run(chosen: list[Case]) -> Iterator[tuple[Case, str, str]]:
    """Cases with their answers; a case that takes too long ends ``otherwise``."""

    def late(_signal: int, _frame: object) -> None:
        raise TimeoutError(f"no answer in {SECONDS} s of computing")

    before = signal.signal(signal.SIGPROF, late)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for case in chosen:
                signal.setitimer(signal.ITIMER_PROF, SECONDS)
                ending, text = answer(case, Path(scratch))
                signal.setitimer(signal.ITIMER_PROF, 0)
                yield case, ending, text
    finally:
        signal.signal(signal.SIGPROF, before)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
    everything = drawn(cases(), arguments.seed)
    chosen = everything[arguments.first : arguments.first + arguments.count]
    counts, bad = collections.Counter[str](), []
    for case, ending, text in run(chosen):
        counts[ending] += 1
        where = f"{case.group}={case.option} {case.key}: {case.kind}"
        if ending == "otherwise":
            bad.append(f"{where}: {escaped(text)}")
        if ending == "otherwise" or arguments.table:
            print(f"{ending}: {where}: {escaped(text)}", flush=True)
    figures = {"cases": len(chosen), "of": len(everything), **counts, "bad": bad}
    print(json.dumps({**figures, "bad": len(bad)}))
    if arguments.json is not None:
        arguments.json.write_text(
            json.dumps(figures, indent=1) + "\n", encoding="utf-8"
        )
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
