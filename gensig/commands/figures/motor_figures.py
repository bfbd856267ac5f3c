"""Figures of a line that a motor turns.

Mean torques by node and what its meshes carry, names of what turns a line.
"""

from __future__ import annotations

from typing import Any

from gensig.commands.figures.machine_figures import FAULTY, GREY, SOUND
from gensig.commands.lines.results import ResponseResult
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.engine_torques import Engine


def turner(line: EngineLine) -> str:
    """What speeds and angles of a line are those of."""
    return "crank" if isinstance(line.engine, Engine) else "motor"


def turns_evenly(line: EngineLine) -> bool:
    """Whether nothing shakes the line while its meshes never part."""
    return not isinstance(line.engine, Engine) and line.engine.ripple is None


def motor_rows(axes: Any, line: EngineLine, found: ResponseResult) -> None:
    """Mean torques on the nodes, and mean tooth forces of the meshes, (2,) axes."""
    mean = found.torques.on(line.drive.numbers).mean(axis=1)
    names = [f"{number}" for number in line.drive.numbers]
    axes[0].bar(names, mean, color=[FAULTY if value < 0.0 else SOUND for value in mean])
    axes[0].axhline(0.0, color=GREY, linewidth=0.8)
    axes[0].set(
        title="Mean torques: given (blue) and taken (red)",
        xlabel="node",
        ylabel="N m, on its own shaft",
    )
    force = found.response.element_forces(line.linear()[1])[0]
    axes[1].bar(list(line.mesh_names), force / 1e3, color=SOUND, width=0.4)
    evenly = (
        " (no torque ripple: even in the linear line)" if turns_evenly(line) else ""
    )
    axes[1].set(
        title=f"Mean tooth force of the meshes{evenly}", xlabel="mesh", ylabel="kN"
    )
