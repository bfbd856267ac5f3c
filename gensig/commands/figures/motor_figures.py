"""Panels of a drive line that a motor turns: mean torques and mean tooth forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.commands.figures.style import FAULTY, SOUND, titles, zero_line
from gensig.commands.lines.results import ResponseResult
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.engine_torques import Engine


def turner(line: EngineLine) -> str:
    """Name of the shaft that the speeds and angles of a line are given for."""
    if isinstance(line.engine, Engine):
        return "crank"
    return "motor"


def natural_hz(line: EngineLine) -> dict[str, float]:
    """Natural frequencies of a line, Hz, by their rounded values."""
    frequencies = line.drive.modes().frequency
    return {f"{hz:.0f}": float(hz) for hz in frequencies if hz > 0.0}


def turns_evenly(line: EngineLine) -> bool:
    """True when nothing excites the line while its meshes never part."""
    return not isinstance(line.engine, Engine) and line.engine.ripple is None


def node_name(line: EngineLine, node: int) -> str:
    """Name and number of a node."""
    return f"{line.drive.line.nodes[line.drive.numbers.index(node)].name} ({node})"


def motor_rows(axes: Any, line: EngineLine, result: ResponseResult) -> None:
    """Draw mean torques on the nodes and mean tooth forces of the meshes, (2,) axes."""
    torques, forces = axes
    mean = result.torques.on(line.drive.numbers).mean(axis=1)
    colors = np.where(mean < 0.0, FAULTY, SOUND).tolist()
    torques.bar([str(number) for number in line.drive.numbers], mean, color=colors)
    zero_line(torques)
    title = "Mean torques: given (blue) and taken (red)"
    titles(torques, title, "node", "N m, on its own shaft")
    force = result.response.element_forces(line.linear()[1])[0]
    forces.bar(list(line.mesh_names), force / 1e3, color=SOUND, width=0.4)
    title = "Mean tooth force of the meshes"
    if turns_evenly(line):
        title += " (no torque ripple: even in the linear line)"
    titles(forces, title, "mesh", "kN")
