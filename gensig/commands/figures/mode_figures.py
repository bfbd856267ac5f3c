"""Figure of natural modes: Campbell diagram and the shapes of the lowest ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.style import (
    FAULTY,
    GREY,
    SMALL,
    SOUND,
    THIRD,
    curve,
    empty_figure,
    save,
    titles,
)
from gensig.driveline.drive_line import DriveLine
from gensig.driveline.linear.modal import Modes
from gensig.units import from_si

N_SHAPES = 6
MOST_BARS = 12  # degrees of freedom up to which each gets a bar with its name
LATERAL = (" x", " y")  # ends of the names of lateral motions
ENERGIES = "signed root of the kinetic energy share"
ANGLES = "angle on the own shaft, largest 1 (dashed: gear meshes)"


def plot_modes(line: DriveLine, modes: Modes, path: Path) -> None:
    """Draw the Campbell diagram and the lowest modes that deform something."""
    figure = empty_figure(13, 8.4)
    last = min(modes.n_rigid + N_SHAPES, len(modes.frequency))
    elastic = range(modes.n_rigid, last)
    grid = figure.add_gridspec(max(1, len(elastic)), 2, width_ratios=(1.0, 1.15))
    _campbell(figure.add_subplot(grid[:, 0]), line, modes)
    draw, abscissa, what = _angles, "node", ANGLES
    if line.lateral:
        draw, what = _energies, ENERGIES
        abscissa = (
            "degree of freedom: rotations (blue), then x and y of every gear (green)"
        )
    axes = None
    for row, mode in enumerate(elastic):
        if axes is not None:
            axes.set_xticklabels([])
        axes = figure.add_subplot(grid[row, 1])
        draw(axes, line, modes, mode)
        hz, damping = modes.frequency[mode], modes.damping_ratio[mode]
        axes.set_title(f"mode {mode}: {hz:.2f} Hz, damping {damping:.3f}", fontsize=9)
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.set_ylim(-1.15, 1.15)
        axes.tick_params(labelsize=7)
    if axes is not None:
        axes.set_xlabel(abscissa)
    size = f"inertias {len(line.line.nodes)}, gear meshes {len(line.line.meshes)}"
    figure.suptitle(f"{line.name}: {size}; shapes: {what}")
    save(figure, path)


def _campbell(axes: Any, line: DriveLine, modes: Modes) -> None:
    """Natural frequencies across the speeds, rays of the orders, dots where they meet."""
    low = from_si("speed_rpm", line.campbell.low_speed)
    high = from_si("speed_rpm", line.campbell.high_speed)
    top = 1.08 * max(line.campbell_orders) * high / 60.0
    shown = [(mode, hz) for mode, hz in enumerate(modes.frequency) if 0.0 < hz < top]
    speeds = np.array([low, high])
    note = {"textcoords": "offset points", "fontsize": SMALL}
    for order in line.campbell_orders:
        curve(axes, speeds, order * speeds / 60.0, GREY, width=0.8)
        end = (high, order * high / 60.0)
        axes.annotate(f"{order:.4g}", end, xytext=(3, 0), va="center", **note)
        for _, hz in shown:
            speed = 60.0 * hz / order
            if low <= speed <= high:
                axes.plot(speed, hz, "o", color=FAULTY, markersize=4)
    for mode, hz in shown:
        axes.axhline(hz, color=SOUND, linewidth=1.2)
        offset = (3, (-9, 2)[mode % 2])
        axes.annotate(f"{mode}", (low, hz), xytext=offset, color=SOUND, **note)
    titles(
        axes,
        "Campbell diagram: modes (blue), orders (grey, at the right end)",
        f"speed of {line.line.nodes[0].name}, r/min",
        "Hz",
        xlim=(low, high),
        ylim=(0.0, top),
    )


def _angles(axes: Any, line: DriveLine, modes: Modes, mode: int) -> None:
    """Angle of every node, joined as the line joins them."""
    angle = (line.matrices().expand @ modes.shapes[mode])[: len(line.numbers)]
    angle = angle / np.abs(angle).max()
    number, gears = np.array(line.numbers), line.line.gears
    for shaft in line.line.shafts:
        ends = [shaft.first, shaft.second]
        curve(axes, number[ends], angle[ends], SOUND, width=1.2)
    for mesh in line.line.meshes:
        ends = [gears[mesh.driving].node, gears[mesh.driven].node]
        curve(axes, number[ends], angle[ends], THIRD, style="--", width=0.8)
    axes.plot(number, angle, ".", color=SOUND, markersize=4)


def _energies(axes: Any, line: DriveLine, modes: Modes, mode: int) -> None:
    """Share of the kinetic energy of every coordinate, with the sign of its motion."""
    matrices = line.matrices()
    motion = matrices.expand @ modes.shapes[mode]
    height = np.sign(motion) * np.sqrt(modes.kinetic_share[mode])
    is_lateral = [name.endswith(LATERAL) for name in matrices.coordinate_names]
    index = np.arange(len(height))
    axes.bar(index, height, color=[(SOUND, THIRD)[lateral] for lateral in is_lateral])
    if len(height) <= MOST_BARS:
        names = zip(matrices.coordinate_names, is_lateral, strict=True)
        labels = [name + (" turns", "")[lateral] for name, lateral in names]
        axes.set_xticks(index, labels)
