"""Figure of an engine's forced response: cycle, torques, speeds, spectra, waterfalls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.motor_figures import (
    motor_rows,
    natural_hz,
    node_name,
    turner,
    turns_evenly,
)
from gensig.commands.figures.style import (
    ANGLE_AMPLITUDE,
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    SMALL,
    SOUND,
    WITH_MODES,
    curve,
    cycle_ticks,
    mark_modes,
    mark_orders,
    panels,
    save,
    titles,
    waterfall,
)
from gensig.commands.figures.time_figures import root_row, sweep_rows, time_rows
from gensig.commands.lines.results import RPM, ResponseResult
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import cycle_angles, gas_torque, inertia_torque
from gensig.driveline.excitation.engine_torques import Engine, EngineTorques
from gensig.driveline.linear.forced import Waterfall, cycle_orders
from gensig.units import from_si

SHOWN_ORDERS = 48  # half orders, up to 24
WATERFALL_HZ = 400.0
MARKED_ORDERS = (0.5, 1.0, 2.5, 5.0, 10.0)
CYCLE_POINTS = 2880


def plot_response(line: EngineLine, result: ResponseResult, path: Path) -> None:
    """Draw torques, speeds and spectra, and below them each result that was asked for."""
    n_linear = 0 if turns_evenly(line) else 1
    n_rows = 1 + n_linear + bool(result.run) + bool(result.roots)
    n_rows += 2 * (result.in_time is not None) + 3 * (result.sweep is not None)
    figure, axes = panels(n_rows, 2, 12, 3.7 * n_rows)
    if isinstance(line.engine, Engine):
        _cycle(axes[0, 0], line.engine, result)
        _orders(axes[0, 1], line, line.engine, result)
    else:
        motor_rows(axes[0], line, result)
    if n_linear:
        _speeds(axes[1, 0], line, result)
        _spectra(axes[1, 1], line, result)
    row = 1 + n_linear
    if result.run:
        _waterfalls(figure, axes[row], line, result)
        row += 1
    if result.in_time is not None:
        time_rows(axes[row : row + 2], line, result, result.in_time)
        row += 2
    if result.roots:
        root_row(axes[row], line, result)
        row += 1
    if result.sweep is not None:
        sweep_rows(figure, axes[row:], line, result, result.sweep)
    speed, torque = RPM * result.response.speed, result.torques.brake_torque
    figure.suptitle(f"{line.drive.name}: {speed:g} r/min, {torque:.5g} N m")
    save(figure, path)


def _cycle(axes: Any, engine: Engine, result: ResponseResult) -> None:
    """Pressure and torques of one cylinder from its own firing top dead center on."""
    assert isinstance(result.torques, EngineTorques)
    cylinder, pressure = engine.cylinder, result.torques.pressure
    angle = cycle_angles(len(pressure))
    degrees = np.degrees(angle)
    gas = gas_torque(cylinder, angle, pressure, engine.crankcase_pressure)
    mass = inertia_torque(cylinder, angle, result.response.speed)
    curve(axes, degrees, gas / 1e3, SOUND, "gas")
    curve(axes, degrees, mass / 1e3, FAULTY, "reciprocating mass", style="--")
    abscissa = "crank angle after firing top dead center, degrees"
    titles(axes, "One cylinder", abscissa, "torque, kN m")
    cycle_ticks(axes)
    second = axes.twinx()
    curve(second, degrees, from_si("pressure_mpa", 1.0) * pressure, GREY, width=0.9)
    second.set_ylabel("pressure (grey), MPa")
    axes.legend(loc="upper center")


def _orders(
    axes: Any, line: EngineLine, engine: Engine, result: ResponseResult
) -> None:
    """Torques by orders: one throw, all throws, all plungers."""
    torque = result.torques.on(line.drive.numbers)
    index = line.drive.numbers.index
    throws = [torque[index(node)] for node in engine.throw_nodes]
    plungers = [torque[index(node)] for node in engine.plunger_nodes.values()]
    rows = [("one throw", throws[0]), ("all throws together", sum(throws))]
    if plungers:
        rows.append(("all plungers together", sum(plungers)))
    orders = np.arange(1, SHOWN_ORDERS + 1) / 2.0
    for (name, row), color, width in zip(rows, COLORS, (0.4, 0.22, 0.1), strict=False):
        _, amplitude = cycle_orders(row, SHOWN_ORDERS)
        height = np.abs(amplitude)
        shown = height > 1e-6 * height.max()
        axes.bar(orders[shown], height[shown], width=width, color=color, label=name)
    title = "Torques by orders of the crank"
    titles(axes, title, "order", "amplitude, N m", yscale="log")
    axes.set_ylim(1.0, None)
    axes.legend()


def _speeds(axes: Any, line: EngineLine, result: ResponseResult) -> None:
    """Deviation of the speeds over one cycle."""
    speeds = result.response.speed_over_cycle(CYCLE_POINTS)
    angle = np.linspace(0.0, 720.0, CYCLE_POINTS, endpoint=False)
    half = result.response.fluctuation()
    for node, color in zip(result.nodes, COLORS, strict=False):
        index = line.drive.numbers.index(node)
        label = f"{node_name(line, node)}: +- {RPM * half[index]:.1f}"
        curve(axes, angle, RPM * speeds[index], color, label, width=1.1)
    abscissa = f"angle of the {turner(line)}, degrees"
    titles(axes, "Speed less its mean", abscissa, "r/min")
    cycle_ticks(axes)
    axes.margins(y=0.25)
    axes.legend(loc="upper right", fontsize=SMALL)


def _spectra(axes: Any, line: EngineLine, result: ResponseResult) -> None:
    """Angular displacement by frequency, with the half orders as they fall."""
    hz = result.response.orders * result.response.speed / (2.0 * np.pi)
    shown = hz <= 2.0 * WATERFALL_HZ
    for node, color, marker in zip(result.nodes, COLORS, "osD^v<", strict=False):
        angle = result.response.angle[line.drive.numbers.index(node)]
        amplitude = np.degrees(np.abs(angle))[shown]
        axes.vlines(hz[shown], 1e-7, amplitude, color=color, linewidth=0.7)
        name = node_name(line, node)
        axes.plot(hz[shown], amplitude, marker, color=color, markersize=3, label=name)
    title = "Angular displacement"
    titles(axes, title, FREQUENCY, ANGLE_AMPLITUDE, yscale="log")
    top = np.degrees(np.abs(result.response.angle[:, shown]).max())
    axes.set_ylim(1e-5 * top, 30.0 * top)
    axes.legend(fontsize=SMALL)


def _waterfalls(
    figure: Any, axes: Any, line: EngineLine, result: ResponseResult
) -> None:
    """Angular displacement over frequency and speed at the first two nodes, (2,) axes."""
    runs = zip(axes, result.nodes, result.run, strict=False)
    for panel, node, run in runs:
        _waterfall(figure, panel, run)
        mark_modes(panel, natural_hz(line), WATERFALL_HZ)
        title = f"Run of speeds, {node_name(line, node)}"
        titles(panel, title, WITH_MODES, f"speed of the {turner(line)}, r/min")
    for panel in axes[len(result.run) :]:
        panel.set_axis_off()


def _waterfall(figure: Any, axes: Any, run: Waterfall) -> None:
    hz = np.arange(0.0, WATERFALL_HZ + 0.1, 1.0)
    rpm = RPM * run.speeds
    spectra = np.degrees(run.spectra(hz))
    # A spectral line is one bin wide. It is spread so that it shows in print.
    neighbours = np.maximum(np.roll(spectra, 1, axis=1), np.roll(spectra, -1, axis=1))
    spread = np.maximum(spectra, neighbours)
    waterfall(figure, axes, hz, rpm, np.log10(np.maximum(spread, 1e-4 * spread.max())))
    mark_orders(axes, MARKED_ORDERS, rpm, WATERFALL_HZ)
