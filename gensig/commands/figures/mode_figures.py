"""Figure of natural modes: Campbell diagram and the shapes of the lowest ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.commands.figures.panels import (
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    Figure,
    Mark,
    Panel,
    across,
    bars,
    curve,
    note,
)
from gensig.driveline.drive_line import DriveLine
from gensig.driveline.linear.modal import Modes
from gensig.units import from_si

N_SHAPES = 6
MOST_BARS = 12  # degrees of freedom up to which each gets a bar with its name
LATERAL = (" x", " y")  # ends of the names of lateral motions
ENERGIES = "signed root of the kinetic energy share"
ANGLES = "angle on the own shaft, largest 1 (dashed: gear meshes)"
MOTIONS = "degree of freedom: rotations (blue), then x and y of every gear (green)"


def mode_figure(line: DriveLine, modes: Modes) -> Figure:
    """The Campbell diagram and the lowest modes that deform something."""
    last = min(modes.n_rigid + N_SHAPES, len(modes.frequency))
    campbell = _campbell(line, modes)
    elastic = range(modes.n_rigid, last)
    rows = [
        [campbell, _shape(line, modes, mode, is_last=mode == last - 1)]
        for mode in elastic
    ]
    size = f"inertias {len(line.line.nodes)}, gear meshes {len(line.line.meshes)}"
    shown = (ANGLES, ENERGIES)[line.lateral]
    return Figure(
        rows or [[campbell, None]],
        (13, 8.4),
        f"{line.name}: {size}; shapes: {shown}",
        ratios={"width_ratios": (1.0, 1.15)},
    )


def _campbell(line: DriveLine, modes: Modes) -> Panel:
    """Natural frequencies across the speeds, rays of the orders, dots where they meet."""
    low = from_si("speed_rpm", line.campbell.low_speed)
    high = from_si("speed_rpm", line.campbell.high_speed)
    top = 1.08 * max(line.campbell_orders) * high / 60.0
    shown = [(mode, hz) for mode, hz in enumerate(modes.frequency) if 0.0 < hz < top]
    speeds = np.array([low, high])
    marks = []
    for order in line.campbell_orders:
        end = (high, order * high / 60.0)
        marks.append(curve(speeds, order * speeds / 60.0, None, GREY, width=0.8))
        marks.append(note(f"{order:.4g}", end, xytext=(3, 0), va="center"))
        met = np.array([60.0 * hz / order for _, hz in shown])
        met = met[(low <= met) & (met <= high)]
        dots = order * met / 60.0
        marks.append(curve(met, dots, None, FAULTY, "o", markersize=4))
    for mode, hz in shown:
        offset = (3, (-9, 2)[mode % 2])
        marks.append(across(hz, color=SOUND, linewidth=1.2))
        marks.append(note(f"{mode}", (low, hz), xytext=offset, color=SOUND))
    return Panel(
        "Campbell diagram: modes (blue), orders (grey, at the right end)",
        f"speed of {line.line.nodes[0].name}, r/min",
        "Hz",
        marks,
        xlim=(low, high),
        ylim=(0.0, top),
    )


def _shape(line: DriveLine, modes: Modes, mode: int, *, is_last: bool) -> Panel:
    """One mode; the last one has the labels of the abscissa."""
    hz, damping = modes.frequency[mode], modes.damping_ratio[mode]
    draw, abscissa = _angles, "node"
    if line.lateral:
        draw, abscissa = _energies, MOTIONS
    marks, look = draw(line, modes, mode)
    if not is_last:
        abscissa, look = "", {"ticks": {}}
    return Panel(
        f"mode {mode}: {hz:.2f} Hz, damping {damping:.3f}",
        abscissa,
        "",
        [*marks, across(linewidth=0.6)],
        dense=True,
        ylim=(-1.15, 1.15),
        **look,
    )


def _angles(
    line: DriveLine, modes: Modes, mode: int
) -> tuple[list[Mark], dict[str, Any]]:
    """Angle of every node, joined as the line joins them."""
    angle = (line.matrices().expand @ modes.shapes[mode])[: len(line.numbers)]
    angle = angle / np.abs(angle).max()
    number, gears = np.array(line.numbers), line.line.gears
    marks = []
    for shaft in line.line.shafts:
        ends = [shaft.first, shaft.second]
        marks.append(curve(number[ends], angle[ends], None, SOUND, width=1.2))
    for mesh in line.line.meshes:
        ends = [gears[mesh.driving].node, gears[mesh.driven].node]
        marks.append(curve(number[ends], angle[ends], None, THIRD, "--", 0.8))
    return [*marks, curve(number, angle, None, SOUND, ".", markersize=4)], {}


def _energies(
    line: DriveLine, modes: Modes, mode: int
) -> tuple[list[Mark], dict[str, Any]]:
    """Share of the kinetic energy of every coordinate, with the sign of its motion."""
    matrices = line.matrices()
    motion = matrices.expand @ modes.shapes[mode]
    height = np.sign(motion) * np.sqrt(modes.kinetic_share[mode])
    is_lateral = [name.endswith(LATERAL) for name in matrices.coordinate_names]
    index = np.arange(len(height))
    colors = [(SOUND, THIRD)[lateral] for lateral in is_lateral]
    look: dict[str, Any] = {}
    if len(height) <= MOST_BARS:
        names = zip(matrices.coordinate_names, is_lateral, strict=True)
        labels = [name + (" turns", "")[lateral] for name, lateral in names]
        look = {"ticks": dict(enumerate(labels))}
    return [bars(index, height, color=colors)], look
