"""Questions on a terminal for what the flags of a new gearbox leave out."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from typing import Any

from gensig.errors import ConfigError
from gensig.terminal.printing import show

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


def ask_missing(arguments: Namespace) -> None:
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
        show(f"give {counts_text(counts)} number{'s' * (max(counts) > 1)}")


def _typed_line(question: str) -> str:
    """The answer to a question; ConfigError where the input ends, as by Ctrl-D."""
    try:
        return input(f"{question}: ")
    except EOFError:
        show("")  # the cursor stands behind the question
        raise ConfigError(
            f"the input ended before an answer to '{question}'; nothing is written"
        ) from None


def counts_text(counts: Sequence[int]) -> str:
    """Allowed numbers of values, as a sentence has them: 2, 4 or 6."""
    *first, last = map(str, counts)
    if not first:
        return last
    return f"{', '.join(first)} or {last}"
