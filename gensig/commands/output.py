"""Answers of the verbs on one machine: numbers as JSON, a figure, an option, a summary.

Names are checked before anything is computed. Options and records are replaced with ``--force``
only. JSON files and figures are replaced.
"""

from __future__ import annotations

import functools
import json
import math
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from gensig.arrays import Array
from gensig.commands.console import replaced_file
from gensig.commands.figures.panels import Figure, draw
from gensig.commands.request import read_configuration
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.terminal.printing import show

FIGURE_TYPES = (".png", ".svg", ".pdf")


def check_file(flag: str, name: str | None, types: tuple[str, ...] = ()) -> None:
    """Raise ConfigError for a file that cannot be written, or whose name ends otherwise."""
    if name is None:
        return
    path = Path(name)
    if types and path.suffix not in types:
        raise ConfigError(f"{flag} {name}: the name must end in {', '.join(types)}")
    if not path.parent.is_dir():
        raise ConfigError(
            f"{flag} {name}: there is no folder {path.parent}; make it first"
        )
    if path.is_dir():
        raise ConfigError(f"{flag} {name} is a folder; give the name of a file")


def check_new(flag: str, name: str | None, *, force: bool) -> None:
    """Raise ConfigError for a file that exists, unless it may be replaced."""
    if name is not None and Path(name).exists() and not force:
        raise ConfigError(
            f"{flag} {name} is there already; choose another name, "
            "or add --force to replace it"
        )


def option_file(name: str, group: str, *, force: bool) -> Path:
    """File of a new option of a configuration group; its stem becomes the option's name."""
    target = Path(name)
    if target.suffix != ".yaml" or not target.stem.isidentifier():
        raise ConfigError(
            f"--out {name}: give a file NAME.yaml in a folder {group}, NAME without spaces"
        )
    # A missing folder of the group's name is made with the option.
    if target.parent.name != group or target.parent.exists():
        check_file("--out", name)
    check_new("--out", name, force=force)
    return target


def write_option(target: Path, text: str) -> None:
    """Write an option of a group with its folder, and print how to select it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with replaced_file(target) as path:
        path.write_text(text, encoding="utf-8")
    group, folder = target.absolute().parent.name, target.parent.parent
    show(f"{target}: take it with {group}={target.stem} --config-dir {folder}")


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Result of a verb on one machine.

    Attributes
    ----------
    content : of ``--json``
    lines : of the summary
    figure : makes the figure of ``--plot``
    option : makes the text of the option of ``--out``
    """

    content: Mapping[str, Any]
    lines: Iterable[str]
    figure: Callable[[], Figure]
    option: Callable[[], str] | None = None


Question: TypeAlias = Callable[[Configuration, Namespace], Answer | int]
Verb: TypeAlias = Callable[[Namespace], int]


def answered(group: str | None = None) -> Callable[[Question], Verb]:
    """The verb that writes and prints the answer to a question on a configuration.

    Names of files are checked before anything is computed. A question without an answer gives an
    exit status. ``group`` is that of the option of ``--out``.
    """
    return lambda question: functools.partial(_answer, question, group)


def _answer(question: Question, group: str | None, arguments: Namespace) -> int:
    check_file("--json", arguments.json)
    check_file("--plot", arguments.plot, FIGURE_TYPES)
    target = None
    if group is not None and arguments.out is not None:
        target = option_file(arguments.out, group, force=arguments.force)
    answer = question(read_configuration(arguments), arguments)
    if isinstance(answer, int):
        return answer
    if arguments.json is not None:
        text = json.dumps(plain(answer.content), indent=1, allow_nan=False)
        with replaced_file(arguments.json) as path:
            path.write_text(text + "\n", encoding="utf-8")
    if arguments.plot is not None:
        with replaced_file(arguments.plot) as path:
            draw(answer.figure(), path)
    show(*answer.lines)
    if target is not None and answer.option is not None:
        write_option(target, answer.option())
    return 0


def plain(value: Any) -> Any:
    """Value for JSON: arrays as lists, and null for a number that is not finite."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def columns(content: Mapping[str, Any], *keys: str) -> Iterator[tuple[Any, ...]]:
    """Rows of the columns of some keys."""
    return zip(*(content[key] for key in keys), strict=True)


def span(values: Array, form: str) -> str:
    """Least and greatest value; a value that is 0 up to rounding has no sign."""
    ends = [
        value * (abs(value) >= 1e-9) + 0.0 for value in (values.min(), values.max())
    ]
    return " .. ".join(format(value, form) for value in ends)


def highest(sound: Array, faulty: Array | None) -> str:
    """Highest stiffness of a tooth pair, healthy and faulty."""
    text = f"{sound.max():.4e} N/m"
    if faulty is not None:
        text += f" healthy, {faulty.max():.4e} N/m faulty"
    return text
