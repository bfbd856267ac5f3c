"""Quantities of drive lines, by the names that the rows use."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from gensig.driveline.drive_line import DriveLine, read_drive_line
from gensig.driveline.linear.matrices import line_matrices
from gensig.driveline.linear.modal import Modes, natural_modes
from gensig.driveline.linear.shaft_line import Shaft, ShaftLine
from gensig.errors import ConfigError
from gensig.options.compose import compose

LineCheck = Callable[[DriveLine, str], float]


@lru_cache(maxsize=16)
def read_line_case(overrides: tuple[str, ...]) -> DriveLine:
    """Compose the line of a row."""
    return read_drive_line(compose("generate", overrides))


def _ratios_ignored(line: ShaftLine) -> ShaftLine:
    """Every mesh as a shaft of its torsional stiffness k = k_mesh r_b1 r_b2, all at one speed."""
    shafts = []
    for mesh in line.meshes:
        one, other = line.gears[mesh.driving], line.gears[mesh.driven]
        stiffness = mesh.stiffness * one.base_radius * other.base_radius
        shafts.append(
            Shaft(
                first=one.node,
                second=other.node,
                stiffness=stiffness,
                loss_factor=mesh.loss_factor,
            )
        )
    return ShaftLine(nodes=line.nodes, shafts=(*line.shafts, *shafts))


def _crank_only(line: ShaftLine) -> ShaftLine:
    """Nodes from the first one on that shafts alone join to it."""
    own = ShaftLine(nodes=line.nodes, shafts=line.shafts).parts[0]
    if own != tuple(range(len(own))):
        raise ConfigError(
            "crank_only: the nodes of the crank line must come first in the table"
        )
    return ShaftLine(
        nodes=line.nodes[: len(own)],
        shafts=tuple(s for s in line.shafts if s.first in own),
    )


VARIANTS: dict[str, Callable[[ShaftLine], ShaftLine]] = {
    "true_ratios": lambda line: line,
    "ratios_ignored": _ratios_ignored,
    "crank_only": _crank_only,
}


@lru_cache(maxsize=16)
def _modes(line: ShaftLine) -> Modes:
    return natural_modes(line_matrices(line, merge_rigid=False))


def _frequency(case: DriveLine, at: str) -> float:
    """Natural frequency in Hz of a variant; ``at`` is ``variant mode``, the rigid mode being 0."""
    variant, mode = at.split()
    return float(_modes(VARIANTS[variant](case.line)).frequency[int(mode)])


def _kinetic_share(case: DriveLine, at: str) -> float:
    """Share of a mode's kinetic energy in one node; ``at`` is ``mode node``."""
    mode, number = (int(word) for word in at.split())
    return float(_modes(case.line).kinetic_share[mode, case.numbers.index(number)])


LINES: dict[str, LineCheck] = {
    "line.natural_frequency": _frequency,
    "line.kinetic_share": _kinetic_share,
}
