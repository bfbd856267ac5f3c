"""``gensig modify-flank``.

The modifications of a pair that are best for a range of torques and misalignments.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from gensig.commands.console import one_line_warnings
from gensig.commands.gears.flanks import sound_pair
from gensig.commands.output import (
    check_outputs,
    option_file,
    write_option,
    write_outputs,
)
from gensig.commands.request import read_configuration
from gensig.errors import ConfigError
from gensig.mesh.modification import FlankModification, PairModification
from gensig.systems.flank_optimum import Cases, Optimum, judge, optimise
from gensig.systems.sliced_pair import SlicedPair
from gensig.units import from_si

GROUP = "modification"


def modify_flank(arguments: Namespace) -> int:
    """Search, print the front, write the chosen modification as an option of the group
    ``modification``.
    """
    if arguments.points < 1:
        raise ConfigError(
            f"--points {arguments.points}: give 1 for the least ripple alone, 3 or more for a front"
        )
    check_outputs(arguments)
    target = option_file(arguments.out, GROUP, force=arguments.force)
    config = read_configuration(arguments)
    with one_line_warnings("gensig"):
        system = sound_pair(config)
        given = system.modification.misalignment
        cases = Cases(
            torques=tuple(arguments.torques or (system.torque,)),
            misalignments=tuple(
                given + value * 1e-6 for value in arguments.misalignments
            ),
        )
        plain = replace(system.modification, misalignment=0.0)
        before = judge(system, plain, cases)
        front = optimise(
            system, cases, n_front=arguments.points, seed=arguments.seed, on_done=_say
        )
    chosen = _chosen(front, before)
    content = {
        "before": _content(before),
        "chosen": _content(chosen),
        "front": [_content(one) for one in front],
    }

    def draw(path: Path) -> None:
        from gensig.commands.figures.flank_figures import plot_front

        plot_front(system, before, chosen, front, path)

    write_outputs(arguments, content, draw)
    print(f"{'':<12}{'peak to peak':>14}{'line load':>16}   worst of {_cases(cases)}")
    for name, one in (
        ("before", before),
        *((("chosen" if one is chosen else "front"), one) for one in front),
    ):
        print(
            f"{name:<12}{one.ripple * 1e6:>11.4f} um{one.line_load * 1e-3:>11.2f} N/mm"
        )
    write_option(target, option_text(chosen, system, cases))
    return 0


def _say(done: int, total: int) -> None:
    print(f"{done} of {total} points", file=sys.stderr, flush=True)


def _chosen(front: Sequence[Optimum], before: Optimum) -> Optimum:
    """The point nearest to none of both, each counted by its value before.

    The knee of the front.
    """
    return min(
        front,
        key=lambda one: (
            (one.ripple / before.ripple) ** 2 + (one.line_load / before.line_load) ** 2
        ),
    )


def _cases(cases: Cases) -> str:
    torques = ", ".join(f"{value:g}" for value in cases.torques)
    askew = ", ".join(f"{value * 1e6:g}" for value in cases.misalignments)
    return f"{torques} N m with misalignments of {askew} um"


def option_text(optimum: Optimum, system: SlicedPair, cases: Cases) -> str:
    """The modification as YAML that the group ``modification`` takes."""
    pair = system.pair
    lines = [
        f"# Found by gensig modify-flank for {pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, {_cases(cases)}:",
        f"# {optimum.ripple * 1e6:.4f} um from peak to peak and {optimum.line_load * 1e-3:.2f} N/mm at the worst.",
        "misalignment_um: 0",
    ]
    for name, keys in _keys(optimum.modification).items():
        lines += [f"{name}:", *(f"  {key}: {value}" for key, value in keys.items())]
    return "\n".join(lines) + "\n"


def _keys(modification: PairModification) -> dict[str, dict[str, Any]]:
    """Boundary keys of both gears; rounded to 1 nm and 0.1 um."""
    sides = {}
    for name, side in (("pinion", modification.pinion), ("wheel", modification.wheel)):
        values: dict[str, Any] = {}
        for field in fields(FlankModification):
            suffix = field.metadata.get("unit")
            key = field.name if suffix is None else f"{field.name}_{suffix}"
            value = getattr(side, field.name)
            values[key] = (
                value
                if suffix is None
                else round(from_si(key, value), {"um": 3, "mm": 4}[suffix])
            )
        sides[name] = values
    return sides


def _content(optimum: Optimum) -> dict[str, Any]:
    return {
        "peak_to_peak_um": optimum.ripple * 1e6,
        "max_line_load_n_per_mm": optimum.line_load * 1e-3,
        "modification": _keys(optimum.modification),
    }
