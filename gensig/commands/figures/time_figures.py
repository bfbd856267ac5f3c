"""Figures of an engine's line in time, teeth free to part.

Tooth loads, root stress, spectra, sweeps up and down.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gensig.commands.figures.machine_figures import COLOURS, FAULTY, GREY, SOUND
from gensig.commands.figures.motor_figures import turner
from gensig.commands.lines.results import ResponseResult
from gensig.driveline.cycle_statistics import typical_extremes
from gensig.driveline.engine_dampers import passes_of_a_cycle
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.in_time import TimeResponse
from gensig.driveline.linear.forced import over_cycle
from gensig.driveline.sweep import Sweep, SweepWay, amplitude_spectra
from gensig.units import from_si

CYCLE_POINTS = 5760
TRACE_CYCLES = 2
SHOWN_HZ = 400.0
FLAT_HZ = 4000.0  # to which what is given out in time is flat
MARKED_ORDERS = (0.5, 1.0, 2.5, 5.0, 10.0, 20.0)
ROOT_LOOKS = {
    "linear": (SOUND, "-"),
    "in_time": (FAULTY, "-"),
    "linear_without_dampers": (SOUND, ":"),
    "in_time_without_dampers": (FAULTY, ":"),
}


def time_rows(
    axes: Any, line: EngineLine, found: ResponseResult, response: TimeResponse
) -> None:
    """Two rows: speeds and spectra at the nodes.

    Tooth loads of all meshes and the course of one, (2, 2) axes.
    """
    _speeds(axes[0, 0], line, found, response)
    _spectra(axes[0, 1], line, found, response)
    mean, amplitudes = found.response.element_forces(line.linear()[1])
    linear = mean[:, None] + over_cycle(amplitudes, CYCLE_POINTS)
    _loads(axes[1, 0], line, linear, response)
    mesh = int(linear.max(axis=1).argmax()) if found.mesh is None else found.mesh
    _course(axes[1, 1], line, mesh, linear[mesh], response)


def root_row(axes: Any, line: EngineLine, found: ResponseResult) -> None:
    """Root stress over the roll of the pair that bears most, and the largest of each pair of a
    cycle, (2,) axes.
    """
    assert found.mesh is not None
    in_cycle = passes_of_a_cycle(line, found.mesh)
    for name, root in found.roots.items():
        colour, style = ROOT_LOOKS[name]
        gear = root.strength.decisive
        passes, label = root.passes[gear] * 1e-6, name.replace("_", " ")
        roll = np.degrees(root.history.roll / root.strength.pair.pinion.base_radius)
        largest = passes.max(axis=1)
        axes[0].plot(
            roll,
            passes[int(largest.argmax())],
            color=colour,
            linestyle=style,
            label=label,
        )
        whole = len(largest) // in_cycle
        by_pair = largest[: whole * in_cycle].reshape(whole, in_cycle)
        axes[1].plot(
            np.median(by_pair, axis=0), color=colour, linestyle=style, label=label
        )
        if whole > 1:
            axes[1].fill_between(
                range(in_cycle),
                by_pair.min(axis=0),
                by_pair.max(axis=0),
                color=colour,
                alpha=0.15,
                linewidth=0.0,
            )
    mesh = line.mesh_names[found.mesh]
    axes[0].set(
        title=f"Root stress of the pair that bears most, {mesh}",
        xlabel="roll of the pinion, deg",
        ylabel="MPa",
    )
    axes[1].set(
        title="Largest of each pair: median of the cycles, range",
        xlabel="pair of the cycle",
        ylabel="MPa",
    )
    for one in axes:
        one.set_ylim(0.0, None)
        one.margins(y=0.25)
        one.legend(fontsize=8, loc="upper right")


def sweep_rows(
    figure: Any, axes: Any, line: EngineLine, found: ResponseResult, sweep: Sweep
) -> None:
    """Three rows, up, down and how both differ, for the first two nodes, (3, 2) axes."""
    for column in range(2):
        if column >= len(found.nodes):
            for one in axes[:, column]:
                one.set_axis_off()
            continue
        name = _name(line, found.nodes[column])
        top = max(way.spectra[column].max() for way in (sweep.up, sweep.down))
        for row, (way, word) in enumerate(((sweep.up, "up"), (sweep.down, "down"))):
            _waterfall(figure, axes[row, column], way, column, float(top))
            axes[row, column].set_ylabel(f"speed of the {turner(line)}, r/min")
            axes[row, column].set_title(f"In time, {word}, {name}")
        _both_ways(axes[2, column], found, sweep, column)
        axes[2, column].set_title(f"Speed fluctuation in a cycle, {name}")
        axes[2, column].set_xlabel(f"speed of the {turner(line)}, r/min")


def _speeds(
    axes: Any, line: EngineLine, found: ResponseResult, response: TimeResponse
) -> None:
    rpm = from_si("speed_rpm", 1.0)
    angle = np.degrees(response.crank_angle)
    shown = angle < TRACE_CYCLES * 720.0
    linear = found.response.speed_over_cycle(2880)
    cycle = np.linspace(0.0, 720.0 * TRACE_CYCLES, 2880 * TRACE_CYCLES, endpoint=False)
    for row, node in enumerate(found.nodes[: len(COLOURS)]):
        place, colour = line.drive.numbers.index(node), COLOURS[row]
        axes.plot(
            cycle,
            np.tile(rpm * linear[place], TRACE_CYCLES),
            color=colour,
            linewidth=0.7,
            linestyle=":",
        )
        axes.plot(
            angle[shown],
            rpm * response.speed[row, shown],
            color=colour,
            linewidth=0.9,
            label=_name(line, node),
        )
    axes.set(
        title="Speed less its mean, in time (dotted: linear)",
        xlabel=f"angle of the {turner(line)}, degrees",
        ylabel="r/min",
    )
    axes.margins(y=0.25)
    axes.legend(fontsize=8, loc="upper right")


def _spectra(
    axes: Any, line: EngineLine, found: ResponseResult, response: TimeResponse
) -> None:
    """Angular displacement by frequency.

    Grey lines at the half orders, or the mesh frequencies where none fires.
    """
    rate = found.response.speed / (2.0 * np.pi)
    of_motor = turner(line) == "motor"
    orders = (
        np.multiply.outer((1.0, 2.0), line.drive.mesh_orders).ravel()
        if of_motor
        else np.arange(0.5, 1e3, 0.5)
    )
    highest = min(1.1 * rate * float(orders.max()), FLAT_HZ) if of_motor else SHOWN_HZ
    frequencies, spectra = amplitude_spectra(response.angle, highest)
    shown = frequencies <= highest
    for order in orders[orders * rate < highest]:
        axes.axvline(
            order * rate,
            color=GREY,
            linewidth=0.3,
            linestyle="-" if order % 1.0 == 0.0 else ":",
        )
    for row, node in enumerate(found.nodes[: len(COLOURS)]):
        label = _name(line, node)
        axes.plot(
            frequencies[shown],
            np.degrees(spectra[row, shown]),
            color=COLOURS[row],
            linewidth=0.8,
            label=label,
        )
    axes.set(
        title=f"Angular displacement in time ({'grey: meshes, doubles' if of_motor else 'dotted: half orders'})",
        xlabel="frequency, Hz",
        ylabel="amplitude, degrees",
        yscale="log",
        xlim=(0.0, highest),
    )
    axes.set_ylim(None, 10.0 * np.degrees(spectra[:, shown].max()))
    axes.legend(fontsize=8, loc="upper right")


def _loads(axes: Any, line: EngineLine, linear: Any, response: TimeResponse) -> None:
    least, greatest = typical_extremes(response.mesh_force, response.crank_angle)
    places = np.arange(len(least))
    ranges = (
        ("linear", linear.min(axis=1), linear.max(axis=1), SOUND, -0.2),
        ("in time, a cycle's", least, greatest, FAULTY, 0.2),
    )
    for label, low, high, colour, aside in ranges:
        axes.bar(
            places + aside,
            (high - low) / 1e3,
            bottom=low / 1e3,
            width=0.36,
            color=colour,
            label=label,
        )
    axes.plot(places, linear.mean(axis=1) / 1e3, "k_", markersize=18, label="mean")
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xticks(
        places,
        [
            f"{name}\n{apart:.0%}"
            for name, apart in zip(line.mesh_names, response.contact_loss, strict=True)
        ],
    )
    axes.set(
        title="Tooth force of the meshes, least to greatest",
        xlabel="mesh, share of time apart",
        ylabel="kN",
    )
    lowest, highest = (
        float(end) / 1e3
        for end in (min(least.min(), linear.min()), max(greatest.max(), linear.max()))
    )
    axes.set_ylim(1.1 * min(lowest, 0.0), 1.3 * max(highest, 0.0))
    axes.legend(fontsize=8)


def _course(
    axes: Any, line: EngineLine, mesh: int, linear: Any, response: TimeResponse
) -> None:
    name, force = line.mesh_names[mesh], response.mesh_force[mesh]
    shown = response.crank_angle < TRACE_CYCLES * CYCLE
    cycle = np.linspace(
        0.0, 720.0 * TRACE_CYCLES, TRACE_CYCLES * len(linear), endpoint=False
    )
    axes.plot(
        np.degrees(response.crank_angle[shown]),
        force[shown] / 1e3,
        color=FAULTY,
        linewidth=0.7,
        label="in time",
    )
    axes.plot(
        cycle,
        np.tile(linear, TRACE_CYCLES) / 1e3,
        color=SOUND,
        linewidth=0.9,
        label="linear",
    )
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set(
        title=f"Tooth force of mesh {name}",
        xlabel=f"angle of the {turner(line)}, degrees",
        ylabel="kN",
    )
    axes.margins(y=0.2)
    axes.legend(fontsize=8, loc="upper right")


def _waterfall(figure: Any, axes: Any, way: SweepWay, column: int, top: float) -> None:
    """Angular displacement over frequency and speed, ``top`` rad the brightest."""
    rpm = from_si("speed_rpm", 1.0) * way.speeds
    level = np.log10(np.degrees(np.maximum(way.spectra[column], 1e-4 * top)))
    high = np.log10(np.degrees(top))
    image = axes.pcolormesh(
        way.frequencies,
        rpm,
        level,
        cmap="magma",
        shading="nearest",
        rasterized=True,
        vmin=high - 4.0,
        vmax=high,
    )
    figure.colorbar(image, ax=axes, label="log10 of the amplitude in degrees")
    for order in MARKED_ORDERS:
        if order * rpm[-1] / 60.0 < way.frequencies[-1]:
            axes.plot(
                order * rpm / 60.0, rpm, color="white", linewidth=0.4, linestyle=":"
            )
            axes.annotate(
                f"{order:g}",
                (order * rpm[-1] / 60.0, rpm[-1]),
                color="white",
                fontsize=8,
                ha="center",
                va="top",
            )
    axes.set_xlabel("frequency, Hz")


def _both_ways(axes: Any, found: ResponseResult, sweep: Sweep, column: int) -> None:
    """Fluctuation up and down with three standard errors, and the linear one where there is a
    run.
    """
    factor = from_si("speed_rpm", 1.0)
    for way, colour, label in ((sweep.up, SOUND, "up"), (sweep.down, FAULTY, "down")):
        rpm, mean, error = (
            factor * way.speeds,
            factor * way.fluctuation[column],
            factor * way.scatter[column],
        )
        axes.plot(rpm, mean, color=colour, label=f"{label}, in {sweep.seconds:g} s")
        axes.fill_between(
            rpm,
            mean - 3.0 * error,
            mean + 3.0 * error,
            color=colour,
            alpha=0.15,
            linewidth=0.0,
        )
    if found.run:
        run = found.run[column]
        axes.plot(
            factor * run.speeds,
            factor * run.fluctuation,
            color=GREY,
            linewidth=0.9,
            label="linear, steady",
        )
    axes.set_ylabel("plus or minus, r/min")
    axes.set_ylim(0.0, None)
    axes.legend(fontsize=8)


def _name(line: EngineLine, node: int) -> str:
    return f"{line.drive.line.nodes[line.drive.numbers.index(node)].name} ({node})"
