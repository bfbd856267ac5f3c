"""Figure of a drive line's forced response: torques, speeds, spectra, waterfalls."""

from __future__ import annotations

import numpy as np

from gensig.commands.figures.panels import (
    ANGLE_AMPLITUDE,
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    QUARTERS,
    SOUND,
    WITH_MODES,
    Figure,
    Mark,
    Panel,
    across,
    bars,
    curve,
    curves,
    modes_across,
    waterfall,
)
from gensig.commands.figures.time_figures import root_row, sweep_rows, time_rows
from gensig.commands.lines.results import (
    RPM,
    ResponseResult,
    natural_hz,
    node_name,
    turner,
    turns_evenly,
)
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import cycle_angles, gas_torque, inertia_torque
from gensig.driveline.excitation.engine_torques import Engine, EngineTorques
from gensig.driveline.linear.forced import Waterfall, cycle_orders
from gensig.units import from_si

SHOWN_ORDERS = 48  # half orders, up to 24
WATERFALL_HZ = 400.0
MARKED_ORDERS = (0.5, 1.0, 2.5, 5.0, 10.0)
CYCLE_POINTS = 2880


def response_figure(line: EngineLine, result: ResponseResult) -> Figure:
    """Torques, speeds and spectra, and below them each result that was asked for."""
    rows: list[list[Panel | None]] = [_motor_row(line, result)]
    if isinstance(line.engine, Engine):
        rows = [[_cycle(line.engine, result), _orders(line, line.engine, result)]]
    if not turns_evenly(line):
        rows.append([_speeds(line, result), _spectra(line, result)])
    if result.run:
        maps = [
            _waterfall(line, node, run)
            for node, run in zip(result.nodes[:2], result.run, strict=False)
        ]
        rows.append([*maps, None][:2])
    if result.in_time is not None:
        rows += time_rows(line, result, result.in_time)
    if result.roots:
        rows.append(root_row(line, result))
    if result.sweep is not None:
        rows += sweep_rows(line, result, result.sweep)
    speed, torque = RPM * result.response.speed, result.torques.brake_torque
    title = f"{line.drive.name}: {speed:g} r/min, {torque:.5g} N m"
    return Figure(rows, (12, 3.7 * len(rows)), title)


def _motor_row(line: EngineLine, result: ResponseResult) -> list[Panel | None]:
    """Mean torques on the nodes and mean tooth forces of the meshes of a motor's line."""
    mean = result.torques.on(line.drive.numbers).mean(axis=1)
    colors = np.where(mean < 0.0, FAULTY, SOUND).tolist()
    torques = bars([str(number) for number in line.drive.numbers], mean, color=colors)
    force = result.response.element_forces(line.linear()[1])[0] / 1e3
    forces = bars(list(line.mesh_names), force, color=SOUND, width=0.4)
    title = "Mean tooth force of the meshes"
    if turns_evenly(line):
        title += " (no torque ripple: even in the linear line)"
    return [
        Panel(
            "Mean torques: given (blue) and taken (red)",
            "node",
            "N m, on its own shaft",
            [torques, across()],
        ),
        Panel(title, "mesh", "kN", [forces]),
    ]


def _cycle(engine: Engine, result: ResponseResult) -> Panel:
    """Pressure and torques of one cylinder from its own firing top dead center on."""
    assert isinstance(result.torques, EngineTorques)
    cylinder, pressure = engine.cylinder, result.torques.pressure
    angle = cycle_angles(len(pressure))
    degrees = np.degrees(angle)
    gas = gas_torque(cylinder, angle, pressure, engine.crankcase_pressure)
    mass = inertia_torque(cylinder, angle, result.response.speed)
    megapascal = from_si("pressure_mpa", 1.0) * pressure
    shade = curve(degrees, megapascal, None, GREY, width=0.9)
    return Panel(
        "One cylinder",
        "crank angle after firing top dead center, degrees",
        "torque, kN m",
        [
            curve(degrees, gas / 1e3, "gas"),
            curve(degrees, mass / 1e3, "reciprocating mass", style="--"),
        ],
        legend="upper center",
        xlim=(0, 720),
        ticks=QUARTERS,
        second=Panel("", "", "pressure (grey), MPa", [shade]),
    )


def _orders(line: EngineLine, engine: Engine, result: ResponseResult) -> Panel:
    """Torques by orders: one throw, all throws, all plungers."""
    torque = result.torques.on(line.drive.numbers)
    index = line.drive.numbers.index
    throws = [torque[index(node)] for node in engine.throw_nodes]
    plungers = [torque[index(node)] for node in engine.plunger_nodes.values()]
    rows = [("one throw", throws[0], 0.4), ("all throws together", sum(throws), 0.22)]
    if plungers:
        rows.append(("all plungers together", sum(plungers), 0.1))
    orders, marks = np.arange(1, SHOWN_ORDERS + 1) / 2.0, []
    for (name, row, width), color in zip(rows, COLORS, strict=False):
        _, amplitude = cycle_orders(row, SHOWN_ORDERS)
        height = np.abs(amplitude)
        shown = height > 1e-6 * height.max()
        look = {"width": width, "color": color, "label": name}
        marks.append(bars(orders[shown], height[shown], **look))
    return Panel(
        "Torques by orders of the crank",
        "order",
        "amplitude, N m",
        marks,
        log="y",
        ylim=(1.0, None),
    )


def _speeds(line: EngineLine, result: ResponseResult) -> Panel:
    """Deviation of the speeds over one cycle."""
    speeds = RPM * result.response.speed_over_cycle(CYCLE_POINTS)
    angle = np.linspace(0.0, 720.0, CYCLE_POINTS, endpoint=False)
    half, index = RPM * result.response.fluctuation(), line.drive.numbers.index
    rows = {
        f"{node_name(line, node)}: +- {half[index(node)]:.1f}": speeds[index(node)]
        for node in result.nodes[: len(COLORS)]
    }
    return Panel(
        "Speed less its mean",
        f"angle of the {turner(line)}, degrees",
        "r/min",
        curves(angle, rows, width=1.1),
        legend="upper right",
        margin=0.25,
        xlim=(0, 720),
        ticks=QUARTERS,
    )


def _spectra(line: EngineLine, result: ResponseResult) -> Panel:
    """Angular displacement by frequency, with the half orders as they fall."""
    hz = result.response.orders * result.response.speed / (2.0 * np.pi)
    shown = hz <= 2.0 * WATERFALL_HZ
    amplitudes = np.degrees(np.abs(result.response.angle[:, shown]))
    marks: list[Mark] = []
    for node, color, marker in zip(result.nodes, COLORS, "osD^v<", strict=False):
        amplitude = amplitudes[line.drive.numbers.index(node)]
        stems = {"color": color, "linewidth": 0.7}
        name = node_name(line, node)
        marks += [
            Mark("vlines", (hz[shown], 1e-7, amplitude), stems),
            curve(hz[shown], amplitude, name, color, marker, markersize=3),
        ]
    top = amplitudes.max()
    return Panel(
        "Angular displacement",
        FREQUENCY,
        ANGLE_AMPLITUDE,
        marks,
        log="y",
        ylim=(1e-5 * top, 30.0 * top),
    )


def _waterfall(line: EngineLine, node: int, run: Waterfall) -> Panel:
    """Angular displacement of a node over frequency and speed."""
    hz = np.arange(0.0, WATERFALL_HZ + 0.1, 1.0)
    spectra = np.degrees(run.spectra(hz))
    # A spectral line is one bin wide. It is spread so that it shows in print.
    neighbours = np.maximum(np.roll(spectra, 1, axis=1), np.roll(spectra, -1, axis=1))
    spread = np.maximum(spectra, neighbours)
    level = np.log10(np.maximum(spread, 1e-4 * spread.max()))
    marks = waterfall(hz, RPM * run.speeds, level, MARKED_ORDERS)
    modes = natural_hz(line)
    return Panel(
        f"Run of speeds, {node_name(line, node)}",
        WITH_MODES,
        f"speed of the {turner(line)}, r/min",
        [*marks, *modes_across(modes, WATERFALL_HZ)],
        above=modes,
    )
