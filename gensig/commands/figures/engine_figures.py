"""Figure of an engine's forced response: cycle, torques, speeds, spectra, waterfalls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.machine_figures import (
    COLOURS,
    FAULTY,
    GREY,
    SOUND,
    pyplot,
    save,
)
from gensig.commands.figures.motor_figures import motor_rows, turner, turns_evenly
from gensig.commands.figures.time_figures import root_row, sweep_rows, time_rows
from gensig.commands.lines.results import ResponseResult
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import cycle_angles, gas_torque, inertia_torque
from gensig.driveline.excitation.engine_torques import Engine, EngineTorques
from gensig.driveline.linear.forced import Waterfall, cycle_orders
from gensig.units import from_si

SHOWN_ORDERS = 48  # half orders, up to 24
WATERFALL_HZ = 400.0


def plot_response(line: EngineLine, found: ResponseResult, path: Path) -> None:
    """Cycle, torques, speeds and angular displacement spectra.

    Below these what else was asked for, row by row.
    """
    blocks = {"run": 1 if found.run else 0, "time": 2 if found.in_time else 0}
    blocks |= {"roots": 1 if found.roots else 0, "sweep": 3 if found.sweep else 0}
    blocks |= {"linear": 0 if turns_evenly(line) else 1}
    n_rows = 1 + sum(blocks.values())
    figure, axes = pyplot.subplots(
        n_rows, 2, figsize=(12, 3.7 * n_rows), layout="constrained", squeeze=False
    )
    if isinstance(line.engine, Engine):
        _cycle(axes[0, 0], line.engine, found)
        _orders(axes[0, 1], line, line.engine, found)
    else:
        motor_rows(axes[0], line, found)
    if blocks["linear"]:
        _speeds(axes[1, 0], line, found)
        _spectra(axes[1, 1], line, found)
    row = 1 + blocks["linear"]
    if found.run:
        _waterfall(figure, axes[row, 0], line, found.nodes[0], found.run[0])
        if len(found.run) > 1:
            _waterfall(figure, axes[row, 1], line, found.nodes[1], found.run[1])
        else:
            axes[row, 1].set_axis_off()
        row += blocks["run"]
    if found.in_time is not None:
        time_rows(axes[row : row + 2], line, found, found.in_time)
        row += blocks["time"]
    if found.roots:
        root_row(axes[row], line, found)
        row += blocks["roots"]
    if found.sweep is not None:
        sweep_rows(figure, axes[row:], line, found, found.sweep)
    figure.suptitle(
        f"{line.drive.name}: {from_si('speed_rpm', found.response.speed):g} r/min, {found.torques.brake_torque:.5g} N m"
    )
    save(figure, path)


def _cycle(axes: Any, engine: Engine, found: ResponseResult) -> None:
    """Pressure and torques of one cylinder from its own firing top dead center on."""
    assert isinstance(found.torques, EngineTorques)
    cylinder, pressure = engine.cylinder, found.torques.pressure
    angle = cycle_angles(len(pressure))
    degrees = np.degrees(angle)
    gas = gas_torque(cylinder, angle, pressure, engine.crankcase_pressure)
    mass = inertia_torque(cylinder, angle, found.response.speed)
    axes.plot(degrees, gas / 1e3, color=SOUND, label="gas")
    axes.plot(degrees, mass / 1e3, "--", color=FAULTY, label="reciprocating mass")
    axes.set(
        title="One cylinder",
        xlabel="crank angle after firing top dead center, degrees",
        ylabel="torque, kN m",
        xlim=(0, 720),
        xticks=range(0, 721, 90),
    )
    late = axes.twinx()
    late.plot(
        degrees, from_si("pressure_mpa", 1.0) * pressure, color=GREY, linewidth=0.9
    )
    late.set_ylabel("pressure (grey), MPa")
    axes.legend(loc="upper center")


def _orders(axes: Any, line: EngineLine, engine: Engine, found: ResponseResult) -> None:
    """Torques by orders: one throw, all throws, all plungers."""
    on = found.torques.on(line.drive.numbers)
    numbers, throws = line.drive.numbers, list(engine.throw_nodes)
    plungers = list(engine.plunger_nodes.values())
    rows = [
        ("one throw", on[numbers.index(throws[0])]),
        ("all throws together", _sum(on, numbers, throws)),
    ]
    if plungers:
        rows.append(("all plungers together", _sum(on, numbers, plungers)))
    for (name, row), colour, width in zip(
        rows, COLOURS, (0.4, 0.22, 0.1), strict=False
    ):
        _, amplitude = cycle_orders(row, SHOWN_ORDERS)
        orders = np.arange(1, SHOWN_ORDERS + 1) / 2.0
        shown = np.abs(amplitude) > 1e-6 * np.abs(amplitude).max()
        axes.bar(
            orders[shown],
            np.abs(amplitude)[shown],
            width=width,
            color=colour,
            label=name,
        )
    axes.set(
        title="Torques by orders of the crank",
        xlabel="order",
        ylabel="amplitude, N m",
        yscale="log",
    )
    axes.set_ylim(1.0, None)
    axes.legend()


def _sum(on: Any, numbers: tuple[int, ...], nodes: list[int]) -> Any:
    return sum(on[numbers.index(node)] for node in nodes)


def _speeds(axes: Any, line: EngineLine, found: ResponseResult) -> None:
    """Deviation of the speeds over two cycles."""
    speeds = found.response.speed_over_cycle(2880)
    angle = np.linspace(0.0, 720.0, 2880, endpoint=False)
    half = found.response.fluctuation()
    for node, colour in zip(found.nodes, COLOURS, strict=False):
        place = line.drive.numbers.index(node)
        rpm = from_si("speed_rpm", 1.0)
        axes.plot(
            angle,
            rpm * speeds[place],
            color=colour,
            linewidth=1.1,
            label=f"{_name(line, node)}: +- {rpm * half[place]:.1f}",
        )
    axes.set(
        title="Speed less its mean",
        xlabel=f"angle of the {turner(line)}, degrees",
        ylabel="r/min",
        xlim=(0, 720),
    )
    axes.set_xticks(range(0, 721, 90))
    axes.margins(y=0.25)
    axes.legend(loc="upper right", fontsize=8)


def _spectra(axes: Any, line: EngineLine, found: ResponseResult) -> None:
    """Angular displacement by frequency, with the half orders as they fall."""
    hz = found.response.orders * found.response.speed / (2.0 * np.pi)
    shown = hz <= 2.0 * WATERFALL_HZ
    for node, colour, marker in zip(found.nodes, COLOURS, "osD^v<", strict=False):
        amplitude = np.degrees(
            np.abs(found.response.angle[line.drive.numbers.index(node)])
        )
        axes.vlines(hz[shown], 1e-7, amplitude[shown], color=colour, linewidth=0.7)
        axes.plot(
            hz[shown],
            amplitude[shown],
            marker,
            color=colour,
            markersize=3,
            label=_name(line, node),
        )
    axes.set(
        title="Angular displacement",
        xlabel="frequency, Hz",
        ylabel="amplitude, degrees",
        yscale="log",
    )
    top = np.degrees(np.abs(found.response.angle[:, shown]).max())
    axes.set_ylim(1e-5 * top, 30.0 * top)
    axes.legend(fontsize=8)


def _waterfall(
    figure: Any, axes: Any, line: EngineLine, node: int, run: Waterfall
) -> None:
    """Angular displacement over frequency and speed."""
    hz = np.arange(0.0, WATERFALL_HZ + 0.1, 1.0)
    rpm = from_si("speed_rpm", 1.0) * run.speeds
    spectra = np.degrees(run.spectra(hz))
    # a line is one bin wide: spread it so that it shows in print
    spread = np.maximum(
        spectra, np.maximum(np.roll(spectra, 1, axis=1), np.roll(spectra, -1, axis=1))
    )
    top = spread.max()
    level = np.log10(np.maximum(spread, 1e-4 * top))
    image = axes.pcolormesh(
        hz, rpm, level, cmap="magma", shading="nearest", rasterized=True
    )
    figure.colorbar(image, ax=axes, label="log10 of the amplitude in degrees")
    for order in (0.5, 1.0, 2.5, 5.0, 10.0):
        if order * rpm[-1] / 60.0 < WATERFALL_HZ:
            axes.annotate(
                f"{order:g}",
                (order * rpm[-1] / 60.0, rpm[-1]),
                color="white",
                fontsize=8,
                ha="center",
                va="top",
            )
    axes.set(
        title=f"Run of speeds, {_name(line, node)}",
        xlabel="frequency, Hz",
        ylabel=f"speed of the {turner(line)}, r/min",
    )


def _name(line: EngineLine, node: int) -> str:
    return f"{line.drive.line.nodes[line.drive.numbers.index(node)].name} ({node})"
