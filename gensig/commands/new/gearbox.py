"""``gensig new gearbox``: options of a gearbox from its data sheet."""

from __future__ import annotations

import json
import sys
import warnings
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from gensig.commands.new.data_sheet import DataSheet, gear_option
from gensig.commands.new.doubts import all_doubts
from gensig.commands.new.experiment import experiment_text, read_wishes
from gensig.commands.new.healthy_level import read_level
from gensig.commands.new.option_files import (
    check_free,
    check_name,
    check_texts,
    next_commands,
    write_options,
)
from gensig.commands.new.staged_gearbox import new_staged, read_staged_sheet
from gensig.commands.new.tip_relief import modification_text
from gensig.errors import ConfigError
from gensig.terminal.printing import show, show_text

GROUPS = ("gear", "modification", "experiment")  # written in this order
N_TEETH = (2, 4, 6)  # two gears a stage

# attribute, question, numbers of values; those that are needed come first
NEEDED = (
    ("teeth", "teeth of pinion and wheel, of each stage in turn", N_TEETH),
    ("module", "normal module, mm", (1, 2, 3)),
    ("speed", "rated speed of the pinion, r/min", (1,)),
    ("torque", "rated torque of the pinion, N m", (1,)),
)
OPTIONAL = (
    ("helix", "helix angle, degrees", (1,)),
    ("widths", "face widths of both, mm", (2,)),
    ("bores", "bore diameters of both, mm", (2,)),
    ("supports", "radial stiffness of what holds each gear, N/m", (2,)),
)
# asked of one stage only
OF_ONE_STAGE = ("widths", "bores", "supports")
PAIRS = ("widths", "bores", "supports", "profile_shifts")


def new(arguments: Namespace) -> int:
    """Write the options of a gearbox, and print derived values and the next commands."""
    folder, name = Path(arguments.dir), arguments.name
    files = {group: folder / group / f"{name}.yaml" for group in GROUPS}
    check_name(name, ["experiment"], [files["experiment"]])
    _complete(arguments)
    if len(arguments.teeth) not in N_TEETH:
        raise ConfigError(
            f"--teeth takes {_counts(N_TEETH)} numbers, driving and driven gear of each stage, "
            f"not {len(arguments.teeth)}"
        )
    if len(arguments.teeth) > 2:
        return new_staged(read_staged_sheet(arguments), arguments)
    check_name(name, GROUPS[:2], ())
    wishes = read_wishes(arguments)
    option = gear_option(_sheet(arguments))
    texts = {
        "gear": option.text(),
        "modification": modification_text(option),
        "experiment": experiment_text(option, wishes),
    }
    texts = {group: text for group, text in texts.items() if text}
    new_files = {files[group]: text for group, text in texts.items()}
    check_free(new_files)
    check_texts(name, texts)
    for message in all_doubts([option]):
        warnings.warn(message, stacklevel=2)
    write_options(new_files)
    content: dict[str, Any] = {
        "files": [str(file) for file in new_files],
        "derived": option.derived(),
        "bearings": option.bearings(),
        "next": next_commands(folder, name),
    }
    level = read_level(arguments, folder)
    if level is not None:
        content["healthy_level"] = level.content()
    if arguments.json:
        show_text(json.dumps(content))
        return 0
    *first, last = content["files"]
    show(f"wrote {', '.join(first)} and {last}; each line there says where it is from")
    show("with the gears as given it follows:")
    for key, value in content["derived"].items():
        text = "-"
        if value is not None:
            text = format(value, ".4g")
        show(f"  {key:<32}{text}")
    for side, bearing in content["bearings"].items():
        show(f"  {side + '_bearings':<32}{bearing}")
    if level is not None:
        show(*level.lines())
    show("next:", *[f"  {line}" for line in content["next"]])
    return 0


def _complete(arguments: Namespace) -> None:
    """Ask for missing values on a terminal; elsewhere raise ConfigError that names them."""
    missing = [name for name, _, _ in NEEDED if getattr(arguments, name) is None]
    if not missing:
        return
    if not sys.stdin.isatty():
        flags = ", ".join(f"--{name}" for name in missing)
        raise ConfigError(
            f"missing {flags}; for instance gensig new gearbox {arguments.name} "
            "--teeth 23 84 --module 2 --speed 1800 --torque 20"
        )
    for name, question, counts in (*NEEDED, *OPTIONAL):
        if getattr(arguments, name) is not None:
            continue
        if name in OF_ONE_STAGE and len(arguments.teeth) > 2:
            continue
        if name in missing:
            answer = _ask(question, counts, needed=True)
        else:
            answer = _ask(f"{question} (empty: assumed)", counts, needed=False)
        if answer is not None and counts == (1,):
            answer = answer[0]
        setattr(arguments, name, answer)


def _ask(question: str, counts: Sequence[int], *, needed: bool) -> Any:
    """The numbers that are typed, as many as allowed; None for an empty optional answer."""
    kind: Callable[[str], float] = float
    if question == NEEDED[0][1]:
        kind = int
    while True:
        words = _typed_line(question).replace(",", " ").split()
        if not words and not needed:
            return None
        try:
            numbers = [kind(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) in counts:
            return numbers
        show(f"give {_counts(counts)} number{'s' * (max(counts) > 1)}")


def _typed_line(question: str) -> str:
    """The answer to a question; ConfigError where the input ends, as by Ctrl-D."""
    try:
        return input(f"{question}: ")
    except EOFError:
        show("")  # the cursor stands behind the question
        raise ConfigError(
            f"the input ended before an answer to '{question}'; nothing is written"
        ) from None


def _counts(counts: Sequence[int]) -> str:
    """Allowed numbers of values, as a sentence has them: 2, 4 or 6."""
    *first, last = map(str, counts)
    if not first:
        return last
    return f"{', '.join(first)} or {last}"


def _sheet(arguments: Namespace) -> DataSheet:
    pairs = {}
    for name in PAIRS:
        given = getattr(arguments, name)
        if given is None:
            continue
        if len(given) > 2:
            raise ConfigError(
                f"--{name.replace('_', '-')} takes one number for both gears, "
                "or two: pinion and wheel"
            )
        pairs[name] = (given[0], given[-1])
    if len(arguments.module) > 1:
        raise ConfigError(
            f"--module takes one number for a pair of gears, not {len(arguments.module)}; "
            "one a stage where --teeth has several stages"
        )
    return DataSheet(
        name=arguments.name,
        teeth=tuple(arguments.teeth),
        module=arguments.module[0],
        speed=arguments.speed,
        torque=arguments.torque,
        helix_angle=arguments.helix or 0.0,
        pressure_angle=arguments.pressure_angle,
        addendum=arguments.addendum,
        **pairs,
    )
