"""Figure of natural modes: Campbell diagram and the shapes of the lowest ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.machine_figures import (
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    pyplot,
    save,
)
from gensig.driveline.drive_line import DriveLine
from gensig.driveline.linear.modal import Modes
from gensig.units import from_si

N_SHAPES = 6
MOST_BARS = 12  # degrees of freedom up to which each gets a bar with its name


def plot_modes(line: DriveLine, found: Modes, path: Path) -> None:
    """Campbell diagram on the left, the lowest modes that deform something on the right."""
    figure = pyplot.figure(figsize=(13, 8.4), layout="constrained")
    elastic = _shown(found)
    grid = figure.add_gridspec(max(1, len(elastic)), 2, width_ratios=(1.0, 1.15))
    _campbell(figure.add_subplot(grid[:, 0]), line, found)
    for row, mode in enumerate(elastic):
        axes = figure.add_subplot(grid[row, 1])
        draw = _energies if line.lateral else _angles
        draw(axes, line, found, mode)
        axes.set_title(
            f"mode {mode}: {found.frequency[mode]:.2f} Hz, damping {found.damping_ratio[mode]:.3f}",
            fontsize=9,
        )
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.set_ylim(-1.15, 1.15)
        axes.tick_params(labelsize=7)
        if mode < elastic[-1]:
            axes.set_xticklabels([])
    what = (
        "signed root of the kinetic energy share"
        if line.lateral
        else "angle on the own shaft, largest 1"
    )
    dashed = "" if line.lateral else " (dashed: gear meshes)"
    size = f"inertias {len(line.line.nodes)}, gear meshes {len(line.line.meshes)}"
    figure.suptitle(f"{line.name}: {size}; shapes: {what}{dashed}")
    save(figure, path)


def _shown(found: Modes) -> range:
    """The lowest modes that deform something."""
    return range(found.n_rigid, min(found.n_rigid + N_SHAPES, len(found.frequency)))


def _campbell(axes: Any, line: DriveLine, found: Modes) -> None:
    """Natural frequencies across the speeds, rays of the orders, dots where they meet."""
    low, high = (
        from_si("speed_rpm", speed)
        for speed in (line.campbell.low_speed, line.campbell.high_speed)
    )
    top = 1.08 * max(line.campbell_orders) * high / 60.0
    shown = [(mode, hz) for mode, hz in enumerate(found.frequency) if 0.0 < hz < top]
    speeds = np.array([low, high])
    for order in line.campbell_orders:
        axes.plot(speeds, order * speeds / 60.0, color=GREY, linewidth=0.8)
        axes.annotate(
            f"{order:.4g}",
            (high, order * high / 60.0),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
        )
        for _, hz in shown:
            if low <= 60.0 * hz / order <= high:
                axes.plot(60.0 * hz / order, hz, "o", color=FAULTY, markersize=4)
    for mode, hz in shown:
        axes.axhline(hz, color=SOUND, linewidth=1.2)
        axes.annotate(
            f"{mode}",
            (low, hz),
            xytext=(3, 2 if mode % 2 else -9),
            textcoords="offset points",
            color=SOUND,
            fontsize=8,
        )
    axes.set(
        title="Campbell diagram: modes (blue), orders (grey, at the right end)",
        xlabel=f"speed of {line.line.nodes[0].name}, r/min",
        ylabel="Hz",
        xlim=(low, high),
        ylim=(0.0, top),
    )


def _angles(axes: Any, line: DriveLine, found: Modes, mode: int) -> None:
    """Angle of every node, joined as the line joins them."""
    matrices = line.matrices()
    angle = (matrices.expand @ found.shapes[mode])[: len(line.numbers)]
    angle = angle / np.abs(angle).max()
    number, gears = line.numbers, line.line.gears
    for shaft in line.line.shafts:
        ends = [shaft.first, shaft.second]
        axes.plot(
            [number[end] for end in ends], angle[ends], "-", color=SOUND, linewidth=1.2
        )
    for mesh in line.line.meshes:
        ends = [gears[mesh.driving].node, gears[mesh.driven].node]
        axes.plot(
            [number[end] for end in ends], angle[ends], "--", color=THIRD, linewidth=0.8
        )
    axes.plot(number, angle, ".", color=SOUND, markersize=4)
    if mode == _shown(found)[-1]:
        axes.set_xlabel("node")


def _energies(axes: Any, line: DriveLine, found: Modes, mode: int) -> None:
    """Share of the kinetic energy of every coordinate, with the sign of its motion."""
    matrices = line.matrices()
    motion = matrices.expand @ found.shapes[mode]
    height = np.sign(motion) * np.sqrt(found.kinetic_share[mode])
    place = np.arange(len(height))
    axes.bar(
        place,
        height,
        color=[
            THIRD if name[-2:] in (" x", " y") else SOUND
            for name in matrices.coordinate_names
        ],
    )
    if len(height) <= MOST_BARS:
        names = [
            name if name[-2:] in (" x", " y") else f"{name} turns"
            for name in matrices.coordinate_names
        ]
        axes.set_xticks(place, names)
    if mode == _shown(found)[-1]:
        axes.set_xlabel(
            "degree of freedom: rotations (blue), then x and y of every gear (green)"
        )
