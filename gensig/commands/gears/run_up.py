"""Run-ups of ``gensig simulate``: levels of orders over speed beside the natural frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.commands.figures.machine_figures import shown_channel
from gensig.commands.lines.results import turner
from gensig.driveline.machine import LineMachine
from gensig.dynamics.response import natural_frequencies
from gensig.errors import ConfigError
from gensig.record.inputs import InputReader
from gensig.record.simulate import Record
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.run_up.level_map import LevelMap, decibels, peaks_over_speed
from gensig.signals.run_up.speed_maps import (
    LEAST_CHANGE,
    frequency_map,
    order_map,
    speed_change,
)
from gensig.systems.base import Machine
from gensig.systems.pair_machine import GearPairMachine, running_pair
from gensig.systems.run import Run
from gensig.terminal.printing import show
from gensig.text.csv_tables import header_line
from gensig.units import SPEED, channel_unit, from_si

ACCELERATION_REFERENCE = 1e-6  # m/s2, ISO 1683
HARMONICS = 3  # of the followed mesh
MOST_CUTS = 5
MARGIN = 1.1  # of the highest order and frequency in the figure
# Of a mode. Above it a resonance, 1 / (2 damping), magnifies nothing.
MOST_DAMPING = 0.5
LEAST_STANDING = 10.0  # dB of a peak over the median of the orders around it; assumed
REACH = 4.0  # orders on either side of it
RPM = from_si("speed_rpm", 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mode:
    """A natural frequency, Hz, with its damping ratio and its name in the figure."""

    name: str
    frequency: float
    damping_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunUp:
    """Levels of one channel of a record whose speed changes.

    Attributes
    ----------
    channel : its name
    shaft : name of the gear or the node whose speed and orders are shown
    orders : over the orders of that shaft
    waterfall : over frequency, Hz
    cuts : orders of the meshes or of the engine, by their labels
    modes : natural frequencies in the band that can resonate, lowest first
    """

    channel: str
    shaft: str
    orders: LevelMap
    waterfall: LevelMap
    cuts: Mapping[str, float]
    modes: tuple[Mode, ...]

    @property
    def unit(self) -> str:
        """Unit of the channel."""
        return channel_unit(self.channel)

    @property
    def reference(self) -> float:
        """Reference of the levels in dB, in the unit of the channel."""
        if self.unit == "m/s^2":
            return ACCELERATION_REFERENCE
        return 1.0

    def level(self, rms: NDArray[Any]) -> NDArray[Any]:
        """Level of RMS values, dB."""
        return decibels(rms, self.reference)

    def peaks(self, order: float) -> NDArray[np.intp]:
        """Indices of the speeds at which an order peaks, `LEAST_STANDING` over its floor."""
        level = self.level(self.orders.at(order))
        floor = self.level(self.orders.around(order, REACH))
        found = peaks_over_speed(level)
        return found[level[found] > floor[found] + LEAST_STANDING]

    def crossings(self, order: float) -> dict[str, float]:
        """Speeds, r/min, at which an order meets a natural frequency, by its name."""
        low, high = RPM * self.orders.speed[[0, -1]]
        met = {mode.name: 60.0 * mode.frequency / order for mode in self.modes}
        return {name: rpm for name, rpm in met.items() if low <= rpm <= high}


def with_traces(reader: InputReader) -> InputReader:
    """The reader of a record whose shaft speed is stored where its course is not constant.

    Samples stay the same.
    """
    config = reader.config
    if config.section("operating").get("speed_profile") is None:
        return reader
    return InputReader(config.with_keys("dataset", store_operating=True))


def shaft_angle(machine: Machine, record: Record) -> Array:
    """Angle of the pinion from its stored speed, (sample,) rad."""
    speed = record.signals["shaft_speed"].astype(np.float64)
    return np.cumsum(speed) / machine.sensing.sampling_rate


def is_steady(angle: Array) -> bool:
    """True where a shaft turns on, and its speed changes by `LEAST_CHANGE` or less."""
    return bool(np.all(np.diff(angle) > 0.0)) and speed_change(angle) <= LEAST_CHANGE


@contextmanager
def refusals() -> Iterator[None]:
    """Turn what an order map cannot use into a ConfigError with a remedy."""
    try:
        yield
    except ValueError as error:
        raise ConfigError(
            f"no levels over speed: {error}; give a slower course of operating.speed_profile, or "
            "a longer operating.duration_s"
        ) from None


def read_run_up(machine: Machine, record: Record) -> RunUp | None:
    """Levels over the speed of a record; None where the speed changes by `LEAST_CHANGE` or less.

    Raises
    ------
    ConfigError    for a record that is too short, or whose speed changes too fast
    """
    if "shaft_speed" not in record.signals:
        return None
    rate, names = machine.sensing.sampling_rate, machine.sensing.channel_names
    channel = shown_channel(names)
    shaft, ratio = _shaft(machine, channel)
    angle = shaft_angle(machine, record) / ratio
    signal = record.signals["acceleration"][names.index(channel)].astype(np.float64)
    if is_steady(angle):
        return None
    with refusals():
        orders = order_map(signal, angle, rate)
        frame = _frame_time(orders)
        waterfall = frequency_map(signal, angle, rate, frame=frame)
    usable = PASS_SHARE * rate
    modes = [mode for mode in _modes(machine) if mode.frequency < usable]
    if _is_torsion(machine, channel):
        cuts, highest = _torsion_cuts(machine, orders)
        tops = [0.0]
    else:
        cuts = _mesh_cuts(machine)
        highest = MARGIN * max(cuts.values())
        tops = [0.0, *(MARGIN * mode.frequency for mode in modes)]
    fastest = float(orders.speed.max()) / (2.0 * math.pi)
    band = min(max(highest * fastest, *tops), usable)
    return RunUp(
        channel=channel,
        shaft=shaft,
        orders=orders.up_to(highest).by_speed(),
        waterfall=waterfall.up_to(band).by_speed(),
        cuts={name: order for name, order in cuts.items() if order < orders.axis[-1]},
        modes=tuple(mode for mode in modes if mode.frequency < band),
    )


def _frame_time(orders: LevelMap) -> float:
    """Median length of the frames of an order map, s."""
    turns = round(1.0 / float(orders.axis[1]))
    return 2.0 * math.pi * turns / float(np.median(orders.speed))


def _is_torsion(machine: Machine, channel: str) -> TypeGuard[LineMachine]:
    """True for the speed of a shaft of a drive line, which shows the orders of its engine."""
    return isinstance(machine, LineMachine) and channel.endswith(SPEED)


def _shaft(machine: Machine, channel: str) -> tuple[str, float]:
    """Name of the shaft whose orders are shown, and turns of the pinion during one of it.

    It is the crank or the motor for the speed of a shaft, else that of the followed driving gear.
    """
    if _is_torsion(machine, channel):
        return turner(machine.engine), machine.ratio
    return next(mesh.driving for mesh in machine.meshes if mesh.followed), 1.0


def _mesh_cuts(machine: Machine) -> dict[str, float]:
    """Orders of the followed mesh, of its harmonics, and of other meshes, by their labels."""
    n_teeth = float(machine.pair.pinion.n_teeth)
    cuts = {f"order {n_teeth:g}, mesh": n_teeth}
    for harmonic in range(2, HARMONICS + 1):
        order = harmonic * n_teeth
        cuts[f"order {order:g}, {harmonic} x mesh"] = order
    for mesh in machine.meshes:
        teeth = machine.gears[mesh.driving].n_teeth
        order = teeth / machine.pinion_turns[mesh.driving]
        is_new = all(abs(order - other) > 1e-6 * order for other in cuts.values())
        if is_new and len(cuts) < MOST_CUTS:
            cuts[f"order {order:.4g}, {mesh.driving} / {mesh.driven}"] = order
    return cuts


def _torsion_cuts(
    machine: LineMachine, orders: LevelMap
) -> tuple[dict[str, float], float]:
    """The strongest orders of the Campbell diagram by their labels, and the highest order shown."""
    given = [
        order
        for order in machine.engine.drive.campbell_orders
        if MARGIN * order < orders.axis[-1]
    ]
    power = [float(np.nanmean(np.square(orders.at(order)))) for order in given]
    strongest = np.argsort(power)[::-1][:MOST_CUTS]
    shown = sorted(given[index] for index in strongest)
    return {f"order {order:g}": order for order in shown}, MARGIN * max(given)


def _modes(machine: Machine) -> list[Mode]:
    """Natural frequencies of the nominal healthy machine that can resonate, lowest first."""
    if isinstance(machine, LineMachine):
        modes = machine.engine.drive.modes()
        frequency, damping = modes.frequency, modes.damping_ratio
    else:
        assert isinstance(machine, GearPairMachine)
        dynamics = running_pair(Run(system=machine, faults=())).dynamics
        frequency, damping = natural_frequencies(dynamics)
    shown = np.flatnonzero((frequency > 0.0) & (damping < MOST_DAMPING))
    return [
        Mode(
            name=f"f{number}",
            frequency=float(frequency[index]),
            damping_ratio=float(damping[index]),
        )
        for number, index in enumerate(shown, start=1)
    ]


def write_levels(run_up: RunUp, path: Path) -> None:
    """Write RMS values of all orders of the map as a table, a row for each speed."""
    unit = run_up.unit.replace("/", "_per_").replace("^", "")
    orders = run_up.orders
    header = ["speed_rpm", "time_s", f"total_{unit}"]
    header += [f"order_{order:g}_{unit}" for order in orders.axis]
    rpm = RPM * orders.speed
    table = np.column_stack([rpm, orders.time, orders.total, orders.rms])
    np.savetxt(path, table, "%.6g", ",", header=header_line(header), comments="")


def print_run_up(run_up: RunUp) -> None:
    """Print the range of the speed and the peaks of every mesh order."""
    orders = run_up.orders
    rpm = RPM * orders.speed
    turns = 1.0 / orders.axis[1]
    show(
        f"run-up of the {run_up.shaft}, {rpm[0]:.0f} to {rpm[-1]:.0f} r/min, "
        f"frames of {turns:.0f} turn(s); peaks of {run_up.channel}:"
    )
    for name, order in run_up.cuts.items():
        level = run_up.level(orders.at(order))
        peaks = [
            f"{level[index]:.1f} dB at {rpm[index]:.0f} r/min ({order * rpm[index] / 60.0:.0f} Hz)"
            for index in run_up.peaks(order)
        ]
        show(f"  {name}: {', '.join(peaks) or 'none'}")
    listed = ", ".join(f"{mode.name} {mode.frequency:.0f}" for mode in run_up.modes)
    show(f"  natural frequencies, Hz: {listed or 'none'}")
