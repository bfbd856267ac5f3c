"""``gensig modify-flank``: the best modifications for a range of torques and misalignments."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from typing import Any

from gensig.commands.console import step
from gensig.commands.figures.flank_figures import front_figure
from gensig.commands.gears.flanks import sound_pair
from gensig.commands.output import Answer, answered
from gensig.errors import ConfigError
from gensig.mesh.modification import FlankModification, PairModification
from gensig.options.configuration import Configuration
from gensig.systems.flank_optimum import Cases, Optimum, judge, optimise
from gensig.systems.registry import PairParts
from gensig.systems.sliced_pair import SlicedPair
from gensig.units import from_si

DIGITS = {"um": 3, "mm": 4}  # of the keys that are written: 1 nm and 0.1 um


@answered(group="modification")
def modify_flank(config: Configuration, arguments: Namespace) -> Answer:
    """The front of the best modifications, and the chosen one as an option."""
    if arguments.points < 1:
        raise ConfigError(
            f"--points {arguments.points}: give 1 for the least ripple alone, "
            "3 or more for a front"
        )
    system = sound_pair(PairParts(config), config["fault"])
    given = system.modification.misalignment
    misalignments = (given + value * 1e-6 for value in arguments.misalignments)
    cases = Cases(
        torques=tuple(arguments.torques or (system.torque,)),
        misalignments=tuple(misalignments),
    )
    aligned = replace(system.modification, misalignment=0.0)
    before = judge(system, aligned, cases)
    front = optimise(
        system,
        cases,
        n_front=arguments.points,
        seed=arguments.seed,
        on_done=lambda done, total: step(f"{done} of {total} points"),
    )
    chosen = _knee(front, before)
    content = {
        "before": _content(before),
        "chosen": _content(chosen),
        "front": [_content(optimum) for optimum in front],
    }
    states = [("before", before)]
    states += [(("front", "chosen")[each is chosen], each) for each in front]
    return Answer(
        content,
        _lines(states, cases),
        lambda: front_figure(system, before, chosen, front),
        lambda: option_text(chosen, system, cases),
    )


def _lines(states: Sequence[tuple[str, Optimum]], cases: Cases) -> Iterator[str]:
    yield f"{'':<12}{'peak to peak':>14}{'line load':>16}   worst of {_cases(cases)}"
    for name, optimum in states:
        ripple, line_load = optimum.ripple * 1e6, optimum.line_load * 1e-3
        yield f"{name:<12}{ripple:>11.4f} um{line_load:>11.2f} N/mm"


def _knee(front: Sequence[Optimum], before: Optimum) -> Optimum:
    """The point of the front nearest to the origin, both axes over their values before."""

    def distance(optimum: Optimum) -> float:
        ripple = optimum.ripple / before.ripple
        line_load = optimum.line_load / before.line_load
        return ripple**2 + line_load**2

    return min(front, key=distance)


def _cases(cases: Cases) -> str:
    torques = ", ".join(f"{value:g}" for value in cases.torques)
    misalignments = ", ".join(f"{value * 1e6:g}" for value in cases.misalignments)
    return f"{torques} N m with misalignments of {misalignments} um"


def option_text(optimum: Optimum, system: SlicedPair, cases: Cases) -> str:
    """The modification as YAML that the group ``modification`` takes."""
    pair = system.pair
    teeth = f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth"
    ripple, line_load = optimum.ripple * 1e6, optimum.line_load * 1e-3
    lines = [
        f"# Found by gensig modify-flank for {teeth}, {_cases(cases)}:",
        f"# {ripple:.4f} um from peak to peak and {line_load:.2f} N/mm at the worst.",
        "misalignment_um: 0",
    ]
    for name, keys in _keys(optimum.modification).items():
        lines += [f"{name}:", *(f"  {key}: {value}" for key, value in keys.items())]
    return "\n".join(lines) + "\n"


def _keys(modification: PairModification) -> dict[str, dict[str, Any]]:
    """Boundary keys of both gears, rounded as they are written."""
    sides: dict[str, dict[str, Any]] = {}
    for name in ("pinion", "wheel"):
        side, values = getattr(modification, name), {}
        for field in fields(FlankModification):
            unit, value = field.metadata.get("unit"), getattr(side, field.name)
            if unit is None:
                values[field.name] = value
            else:
                key = f"{field.name}_{unit}"
                values[key] = round(from_si(key, value), DIGITS[unit])
        sides[name] = values
    return sides


def _content(optimum: Optimum) -> dict[str, Any]:
    return {
        "peak_to_peak_um": optimum.ripple * 1e6,
        "max_line_load_n_per_mm": optimum.line_load * 1e-3,
        "modification": _keys(optimum.modification),
    }
