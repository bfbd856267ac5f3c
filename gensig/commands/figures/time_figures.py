"""Panels of a drive line integrated in time: tooth loads, root stress, spectra, sweeps."""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.commands.figures.panels import (
    ANGLE_AMPLITUDE,
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    SOUND,
    WITH_MODES,
    Mark,
    Panel,
    across,
    band,
    bars,
    curve,
    modes_across,
    upright,
    waterfall,
)
from gensig.commands.lines.results import (
    RPM,
    ResponseResult,
    natural_hz,
    node_name,
    roll_degrees,
    turner,
)
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
    line: EngineLine, result: ResponseResult, response: TimeResponse
) -> list[list[Panel | None]]:
    """Speeds and spectra, loads of all meshes and the force of one."""
    mean, amplitudes = result.response.element_forces(line.linear()[1])
    linear = mean[:, None] + over_cycle(amplitudes, CYCLE_POINTS)
    mesh = result.mesh
    if mesh is None:
        mesh = int(linear.max(axis=1).argmax())
    return [
        [_speeds(line, result, response), _spectra(line, result, response)],
        [_loads(line, linear, response), _force(line, mesh, linear[mesh], response)],
    ]


def root_row(line: EngineLine, result: ResponseResult) -> list[Panel | None]:
    """Root stress over the roll, and the largest of each pair of a cycle."""
    assert result.mesh is not None
    over_roll, over_pairs = [], []
    in_cycle = passes_of_a_cycle(line, result.mesh)
    for name, root in result.roots.items():
        look = name.replace("_", " "), *ROOT_LOOKS[name]
        passes = root.passes[root.strength.decisive] * 1e-6
        largest = passes.max(axis=1)
        heaviest = passes[int(largest.argmax())]
        over_roll.append(curve(roll_degrees(root), heaviest, *look))
        whole = len(largest) // in_cycle
        by_pair = largest[: whole * in_cycle].reshape(whole, in_cycle)
        pairs, median = range(in_cycle), np.median(by_pair, axis=0)
        over_pairs.append(curve(pairs, median, *look))
        if whole > 1:
            ends = by_pair.min(axis=0), by_pair.max(axis=0)
            over_pairs.append(band(pairs, *ends, ROOT_LOOKS[name][0]))
    axes: Any = {"legend": "upper right", "margin": 0.25, "ylim": (0.0, None)}
    bearing = f"Root stress of the pair that bears most, {line.mesh_names[result.mesh]}"
    largest = "Largest of each pair: median of the cycles, range"
    return [
        Panel(bearing, "roll of the pinion, deg", "MPa", over_roll, **axes),
        Panel(largest, "pair of the cycle", "MPa", over_pairs, **axes),
    ]


def sweep_rows(
    line: EngineLine, result: ResponseResult, sweep: Sweep
) -> list[list[Panel | None]]:
    """A sweep up, down and the difference at the first two nodes."""
    speed = f"speed of the {turner(line)}, r/min"
    ways = {"up": sweep.up, "down": sweep.down}
    modes = natural_hz(line)
    columns: list[list[Panel | None]] = []
    for column, node in enumerate(result.nodes[:2]):
        name = node_name(line, node)
        top = float(max(way.spectra[column].max() for way in ways.values()))
        maps = [
            Panel(
                f"In time, {word}, {name}",
                WITH_MODES,
                speed,
                [
                    *_way_map(way, column, top),
                    *modes_across(modes, way.frequencies[-1]),
                ],
                above=modes,
            )
            for word, way in ways.items()
        ]
        difference = Panel(
            f"Speed fluctuation in a cycle, {name}",
            speed,
            "plus or minus, r/min",
            _both_ways(result, sweep, column),
            ylim=(0.0, None),
        )
        columns.append([*maps, difference])
    if len(columns) == 1:
        columns.append([None] * 3)
    return [list(row) for row in zip(*columns, strict=True)]


def _speeds(line: EngineLine, result: ResponseResult, response: TimeResponse) -> Panel:
    angle = np.degrees(response.crank_angle)
    shown = angle < TRACE_CYCLES * 720.0
    linear = RPM * result.response.speed_over_cycle(SPEED_POINTS)
    n_points = SPEED_POINTS * TRACE_CYCLES
    cycle = np.linspace(0.0, 720.0 * TRACE_CYCLES, n_points, endpoint=False)
    marks: list[Mark] = []
    for node, speed, color in zip(result.nodes, response.speed, COLORS, strict=False):
        repeated = np.tile(linear[line.drive.numbers.index(node)], TRACE_CYCLES)
        name = node_name(line, node)
        marks += [
            curve(cycle, repeated, None, color, ":", 0.7),
            curve(angle[shown], RPM * speed[shown], name, color, width=0.9),
        ]
    return Panel(
        "Speed less its mean, in time (dotted: linear)",
        f"angle of the {turner(line)}, degrees",
        "r/min",
        marks,
        legend="upper right",
        margin=0.25,
    )


def _spectra(line: EngineLine, result: ResponseResult, response: TimeResponse) -> Panel:
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
    amplitudes = np.degrees(spectra[:, shown])
    marks = [
        upright(order * rate, linewidth=0.3, linestyle=":" if order % 1.0 else "-")
        for order in orders[orders * rate < highest]
    ]
    marks += [
        curve(frequencies[shown], amplitude, node_name(line, node), width=0.8)
        for node, amplitude in zip(result.nodes, amplitudes, strict=False)
    ]
    return Panel(
        f"Angular displacement in time ({marked})",
        FREQUENCY,
        ANGLE_AMPLITUDE,
        marks,
        legend="upper right",
        log="y",
        xlim=(0.0, highest),
        ylim=(None, 10.0 * amplitudes.max()),
    )


def _loads(line: EngineLine, linear: Any, response: TimeResponse) -> Panel:
    """Bars from the least to the greatest tooth force of each mesh."""
    least, greatest = typical_extremes(response.mesh_force, response.crank_angle)
    meshes = np.arange(len(least))
    low, high = linear.min(axis=1), linear.max(axis=1)
    ranges = (
        ("linear", low, high, SOUND, -0.2),
        ("in time, a cycle's", least, greatest, FAULTY, 0.2),
    )
    marks = [
        bars(
            meshes + shift,
            (top - bottom) / 1e3,
            bottom=bottom / 1e3,
            width=0.36,
            color=color,
            label=label,
        )
        for label, bottom, top, color, shift in ranges
    ]
    mean = linear.mean(axis=1) / 1e3
    names = zip(line.mesh_names, response.contact_loss, strict=True)
    bottom = min(least.min(), low.min(), 0.0)
    top = max(greatest.max(), high.max(), 0.0)
    return Panel(
        "Tooth force of the meshes, least to greatest",
        "mesh, share of time apart",
        "kN",
        [*marks, curve(meshes, mean, "mean", "k", "_", markersize=18), across()],
        ticks={
            place: f"{name}\n{apart:.0%}" for place, (name, apart) in enumerate(names)
        },
        ylim=(1.1 * bottom / 1e3, 1.3 * top / 1e3),
    )


def _force(line: EngineLine, mesh: int, linear: Any, response: TimeResponse) -> Panel:
    """Tooth force of one mesh over the first cycles."""
    shown = response.crank_angle < TRACE_CYCLES * CYCLE
    n_points = TRACE_CYCLES * len(linear)
    cycle = np.linspace(0.0, 720.0 * TRACE_CYCLES, n_points, endpoint=False)
    angle = np.degrees(response.crank_angle[shown])
    force = response.mesh_force[mesh][shown] / 1e3
    repeated = np.tile(linear, TRACE_CYCLES) / 1e3
    return Panel(
        f"Tooth force of mesh {line.mesh_names[mesh]}",
        f"angle of the {turner(line)}, degrees",
        "kN",
        [
            curve(angle, force, "in time", FAULTY, width=0.7),
            curve(cycle, repeated, "linear", SOUND, width=0.9),
            across(),
        ],
        legend="upper right",
        margin=0.2,
    )


def _way_map(way: SweepWay, column: int, top: float) -> list[Mark]:
    """Angular displacement over frequency and speed; ``top``, rad, is the brightest."""
    level = np.log10(np.degrees(np.maximum(way.spectra[column], 1e-4 * top)))
    high = np.log10(np.degrees(top))
    ends = {"vmin": high - 4.0, "vmax": high}
    rpm = RPM * way.speeds
    return waterfall(way.frequencies, rpm, level, MARKED_ORDERS, rays=True, **ends)


def _both_ways(result: ResponseResult, sweep: Sweep, column: int) -> list[Mark]:
    """Fluctuation up and down with three standard errors, and the linear one of a run."""
    marks: list[Mark] = []
    for way, color, label in ((sweep.up, SOUND, "up"), (sweep.down, FAULTY, "down")):
        rpm, mean = RPM * way.speeds, RPM * way.fluctuation[column]
        error = 3.0 * (RPM * way.scatter[column])
        marks += [
            curve(rpm, mean, f"{label}, in {sweep.seconds:g} s", color),
            band(rpm, mean - error, mean + error, color),
        ]
    if result.run:
        run = result.run[column]
        rpm, steady = RPM * run.speeds, RPM * run.fluctuation
        marks.append(curve(rpm, steady, "linear, steady", GREY, width=0.9))
    return marks
