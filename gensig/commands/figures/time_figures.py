"""Panels of a drive line integrated in time: tooth loads, root stress, spectra, sweeps."""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.commands.figures.motor_figures import natural_hz, node_name, turner
from gensig.commands.figures.style import (
    ANGLE_AMPLITUDE,
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    SMALL,
    SOUND,
    WITH_MODES,
    band,
    curve,
    mark_modes,
    mark_orders,
    titles,
    waterfall,
    zero_line,
)
from gensig.commands.lines.results import RPM, ResponseResult, roll_degrees
from gensig.driveline.engine_dampers import passes_of_a_cycle
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.excitation.cycle_statistics import typical_extremes
from gensig.driveline.in_time import TimeResponse
from gensig.driveline.linear.forced import over_cycle
from gensig.driveline.sweep import Sweep, SweepWay, amplitude_spectra

CYCLE_POINTS = 5760
SPEED_POINTS = 2880
TRACE_CYCLES = 2
SHOWN_HZ = 400.0
FLAT_HZ = 4000.0  # highest frequency at which output in time is flat
MARKED_ORDERS = (0.5, 1.0, 2.5, 5.0, 10.0, 20.0)
ROOT_LOOKS = {
    "linear": (SOUND, "-"),
    "in_time": (FAULTY, "-"),
    "linear_without_dampers": (SOUND, ":"),
    "in_time_without_dampers": (FAULTY, ":"),
}


def time_rows(
    axes: Any, line: EngineLine, result: ResponseResult, response: TimeResponse
) -> None:
    """Draw speeds, spectra, loads of all meshes and the force of one, (2, 2) axes."""
    _speeds(axes[0, 0], line, result, response)
    _spectra(axes[0, 1], line, result, response)
    mean, amplitudes = result.response.element_forces(line.linear()[1])
    linear = mean[:, None] + over_cycle(amplitudes, CYCLE_POINTS)
    _loads(axes[1, 0], line, linear, response)
    mesh = result.mesh
    if mesh is None:
        mesh = int(linear.max(axis=1).argmax())
    _force(axes[1, 1], line, mesh, linear[mesh], response)


def root_row(axes: Any, line: EngineLine, result: ResponseResult) -> None:
    """Draw root stress over the roll, and the largest of each pair of a cycle, (2,) axes."""
    assert result.mesh is not None
    over_roll, over_pairs = axes
    in_cycle = passes_of_a_cycle(line, result.mesh)
    for name, root in result.roots.items():
        color, style = ROOT_LOOKS[name]
        label = name.replace("_", " ")
        passes = root.passes[root.strength.decisive] * 1e-6
        largest = passes.max(axis=1)
        heaviest = passes[int(largest.argmax())]
        curve(over_roll, roll_degrees(root), heaviest, color, label, style=style)
        whole = len(largest) // in_cycle
        by_pair = largest[: whole * in_cycle].reshape(whole, in_cycle)
        pairs, median = range(in_cycle), np.median(by_pair, axis=0)
        curve(over_pairs, pairs, median, color, label, style=style)
        if whole > 1:
            low, high = by_pair.min(axis=0), by_pair.max(axis=0)
            band(over_pairs, pairs, low, high, color)
    title = f"Root stress of the pair that bears most, {line.mesh_names[result.mesh]}"
    titles(over_roll, title, "roll of the pinion, deg", "MPa")
    title = "Largest of each pair: median of the cycles, range"
    titles(over_pairs, title, "pair of the cycle", "MPa")
    for panel in axes:
        panel.set_ylim(0.0, None)
        panel.margins(y=0.25)
        panel.legend(fontsize=SMALL, loc="upper right")


def sweep_rows(
    figure: Any, axes: Any, line: EngineLine, result: ResponseResult, sweep: Sweep
) -> None:
    """Draw a sweep up, down and the difference at the first two nodes, (3, 2) axes."""
    ways = {"up": sweep.up, "down": sweep.down}
    speed = f"speed of the {turner(line)}, r/min"
    for column, node in enumerate(result.nodes[:2]):
        name = node_name(line, node)
        top = float(max(way.spectra[column].max() for way in ways.values()))
        for panel, (word, way) in zip(axes[:2, column], ways.items(), strict=True):
            _waterfall(figure, panel, way, column, top)
            mark_modes(panel, natural_hz(line), way.frequencies[-1])
            title = f"In time, {word}, {name}"
            titles(panel, title, WITH_MODES, speed)
        _both_ways(axes[2, column], result, sweep, column)
        title = f"Speed fluctuation in a cycle, {name}"
        titles(axes[2, column], title, speed, "plus or minus, r/min")
    for panel in axes[:, len(result.nodes) :].flat:
        panel.set_axis_off()


def _speeds(
    axes: Any, line: EngineLine, result: ResponseResult, response: TimeResponse
) -> None:
    angle = np.degrees(response.crank_angle)
    shown = angle < TRACE_CYCLES * 720.0
    linear = RPM * result.response.speed_over_cycle(SPEED_POINTS)
    n_points = SPEED_POINTS * TRACE_CYCLES
    cycle = np.linspace(0.0, 720.0 * TRACE_CYCLES, n_points, endpoint=False)
    nodes = zip(result.nodes, response.speed, COLORS, strict=False)
    for node, speed, color in nodes:
        repeated = np.tile(linear[line.drive.numbers.index(node)], TRACE_CYCLES)
        curve(axes, cycle, repeated, color, style=":", width=0.7)
        name = node_name(line, node)
        curve(axes, angle[shown], RPM * speed[shown], color, name, width=0.9)
    title = "Speed less its mean, in time (dotted: linear)"
    titles(axes, title, f"angle of the {turner(line)}, degrees", "r/min")
    axes.margins(y=0.25)
    axes.legend(fontsize=SMALL, loc="upper right")


def _spectra(
    axes: Any, line: EngineLine, result: ResponseResult, response: TimeResponse
) -> None:
    """Angular displacement by frequency.

    Grey lines mark the half orders of an engine, or the mesh frequencies of a motor's line.
    """
    rate = result.response.speed / (2.0 * np.pi)
    if turner(line) == "motor":
        orders = np.multiply.outer((1.0, 2.0), line.drive.mesh_orders).ravel()
        highest = min(1.1 * rate * float(orders.max()), FLAT_HZ)
        marked = "grey: meshes, doubles"
    else:
        orders = np.arange(0.5, 1e3, 0.5)
        highest = SHOWN_HZ
        marked = "dotted: half orders"
    frequencies, spectra = amplitude_spectra(response.angle, highest)
    shown = frequencies <= highest
    for order in orders[orders * rate < highest]:
        style = ":" if order % 1.0 else "-"
        axes.axvline(order * rate, color=GREY, linewidth=0.3, linestyle=style)
    for node, spectrum, color in zip(result.nodes, spectra, COLORS, strict=False):
        amplitude = np.degrees(spectrum[shown])
        name = node_name(line, node)
        curve(axes, frequencies[shown], amplitude, color, name, width=0.8)
    title = f"Angular displacement in time ({marked})"
    titles(axes, title, FREQUENCY, ANGLE_AMPLITUDE, yscale="log", xlim=(0.0, highest))
    axes.set_ylim(None, 10.0 * np.degrees(spectra[:, shown].max()))
    axes.legend(fontsize=SMALL, loc="upper right")


def _loads(axes: Any, line: EngineLine, linear: Any, response: TimeResponse) -> None:
    """Bars from the least to the greatest tooth force of each mesh."""
    least, greatest = typical_extremes(response.mesh_force, response.crank_angle)
    meshes = np.arange(len(least))
    low, high = linear.min(axis=1), linear.max(axis=1)
    ranges = (
        ("linear", low, high, SOUND, -0.2),
        ("in time, a cycle's", least, greatest, FAULTY, 0.2),
    )
    for label, bottom, top, color, shift in ranges:
        axes.bar(
            meshes + shift,
            (top - bottom) / 1e3,
            bottom=bottom / 1e3,
            width=0.36,
            color=color,
            label=label,
        )
    axes.plot(meshes, linear.mean(axis=1) / 1e3, "k_", markersize=18, label="mean")
    zero_line(axes)
    names = zip(line.mesh_names, response.contact_loss, strict=True)
    axes.set_xticks(meshes, [f"{name}\n{apart:.0%}" for name, apart in names])
    title = "Tooth force of the meshes, least to greatest"
    titles(axes, title, "mesh, share of time apart", "kN")
    bottom = min(least.min(), low.min(), 0.0)
    top = max(greatest.max(), high.max(), 0.0)
    axes.set_ylim(1.1 * bottom / 1e3, 1.3 * top / 1e3)
    axes.legend(fontsize=SMALL)


def _force(
    axes: Any, line: EngineLine, mesh: int, linear: Any, response: TimeResponse
) -> None:
    """Tooth force of one mesh over the first cycles."""
    shown = response.crank_angle < TRACE_CYCLES * CYCLE
    n_points = TRACE_CYCLES * len(linear)
    cycle = np.linspace(0.0, 720.0 * TRACE_CYCLES, n_points, endpoint=False)
    angle = np.degrees(response.crank_angle[shown])
    force = response.mesh_force[mesh][shown] / 1e3
    curve(axes, angle, force, FAULTY, "in time", width=0.7)
    repeated = np.tile(linear, TRACE_CYCLES) / 1e3
    curve(axes, cycle, repeated, SOUND, "linear", width=0.9)
    zero_line(axes)
    title = f"Tooth force of mesh {line.mesh_names[mesh]}"
    titles(axes, title, f"angle of the {turner(line)}, degrees", "kN")
    axes.margins(y=0.2)
    axes.legend(fontsize=SMALL, loc="upper right")


def _waterfall(figure: Any, axes: Any, way: SweepWay, column: int, top: float) -> None:
    """Angular displacement over frequency and speed; ``top``, rad, is the brightest."""
    rpm = RPM * way.speeds
    level = np.log10(np.degrees(np.maximum(way.spectra[column], 1e-4 * top)))
    high = np.log10(np.degrees(top))
    ends = {"vmin": high - 4.0, "vmax": high}
    waterfall(figure, axes, way.frequencies, rpm, level, **ends)
    mark_orders(axes, MARKED_ORDERS, rpm, way.frequencies[-1], lines=True)


def _both_ways(axes: Any, result: ResponseResult, sweep: Sweep, column: int) -> None:
    """Fluctuation up and down with three standard errors, and the linear one of a run."""
    for way, color, label in ((sweep.up, SOUND, "up"), (sweep.down, FAULTY, "down")):
        rpm, mean = RPM * way.speeds, RPM * way.fluctuation[column]
        error = 3.0 * (RPM * way.scatter[column])
        curve(axes, rpm, mean, color, f"{label}, in {sweep.seconds:g} s")
        band(axes, rpm, mean - error, mean + error, color)
    if result.run:
        run = result.run[column]
        steady = RPM * run.fluctuation
        curve(axes, RPM * run.speeds, steady, GREY, "linear, steady", width=0.9)
    axes.set_ylim(0.0, None)
    axes.legend(fontsize=SMALL)
