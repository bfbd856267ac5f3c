"""Run-up and run-down of an engine's drive line in time, its teeth free to part.

Orders, spectra and tooth forces by the speed of the crank.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.excitation.cycle_statistics import (
    fluctuations,
    order_amplitudes,
    typical_extremes,
    without_trend,
)
from gensig.driveline.in_time import (
    GOVERNOR,
    RATE,
    SETTLING,
    SOLVER,
)
from gensig.driveline.running import EngineCourse, running_line
from gensig.driveline.time.newmark import LineMotion
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.errors import ConfigError

KNOT = 0.02  # s between the knots of the course
MOST_BINS = 44  # of speed: 25 r/min over 650 to 1750 r/min
# of the crank at its lowest speed in a bin: two whole ones wherever they begin
LEAST_CYCLES = 2.2
SPECTRUM_WINDOW = 0.5  # s, Hann: 4 Hz wide at half height
SPECTRUM_HZ = 700.0
# standard errors of the difference, beyond which up and down differ
APART = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SweepWay:
    """One way of a sweep by ascending speed of the crank, in bins.

    ``speeds`` (bin,) rad/s; ``angle`` (node, bin, order) rad at the orders 0.5, 1, ...;
    ``fluctuation`` (node, bin) rad/s half the peak to peak in a cycle, the mean of the bin's
    cycles, ``scatter`` its standard error; ``greatest_force`` (mesh, bin) N typical of a cycle.
    ``spectra`` (node, bin, frequency) rad at ``frequencies`` Hz.
    """

    speeds: Array
    orders: Array
    angle: Array
    fluctuation: Array
    scatter: Array
    greatest_force: Array
    frequencies: Array
    spectra: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweep:
    """Up and down again; ``seconds`` each way."""

    seconds: float
    up: SweepWay
    down: SweepWay
    energy_residual: float

    @property
    def difference(self) -> Array:
        """Fluctuation up less down over their mean, (node, bin)."""
        up, down = self.up.fluctuation, self.down.fluctuation
        return 2.0 * (up - down) / (up + down)

    @property
    def is_distinct(self) -> Array:
        """True where up and down differ by more than their cycles scatter, (node, bin)."""
        error = np.hypot(self.up.scatter, self.down.scatter)
        return np.asarray(
            np.abs(self.up.fluctuation - self.down.fluctuation) > APART * error
        )


def sweep_course(
    low: float, high: float, seconds: float, torque: float
) -> EngineCourse:
    """From ``low`` rad/s straight to ``high`` in ``seconds`` and straight back, under one brake
    torque in N m.
    """
    n_steps = 2 * math.ceil(0.5 * seconds / KNOT)  # the turn is a knot
    way: Array = seconds / n_steps * np.arange(-1.0, 2 * n_steps + 2)
    speed = np.interp(way, [0.0, seconds, 2.0 * seconds], [low, high, low])
    return EngineCourse(time=way, speed=speed, torque=np.full(len(way), torque))


def sweep_response(
    machine: EngineLine,
    low: float,
    high: float,
    seconds: float,
    torque: float,
    *,
    teeth: dict[int, MeshTeeth],
    nodes: Sequence[int],
    n_orders: int,
) -> Sweep:
    """Integrate a sweep of the crank's speed, ``low`` to ``high`` rad/s and back, ``seconds``
    each way.

    Raises
    ------
    ConfigError        for speeds that make no sweep, or too few seconds for two bins
    SimulationError    where the energies do not balance
    """
    if not (0.0 < low < high and math.isfinite(high)):
        raise ConfigError("a sweep goes from a positive speed up to a higher one")
    n_bins = min(MOST_BINS, int(seconds * low / (CYCLE * LEAST_CYCLES)))
    if n_bins < 2:
        least = 2.0 * CYCLE * LEAST_CYCLES / low
        raise ConfigError(
            f"a sweep in {seconds:g} s passes too few cycles at its low end; give "
            f"{least:.2g} s or more"
        )
    course = sweep_course(low, high, seconds, torque)
    share = course.speed / machine.engine.reference.speed
    course = replace(course, torque=machine.load_at(torque, share))
    line = running_line(machine, course, governor=GOVERNOR, teeth=teeth)
    names = [(kind, line.dof(node)) for kind in ("angle", "speed") for node in nodes]
    names += [("mesh_force", number) for number in range(len(machine.mesh_names))]
    motion = line.run(
        SOLVER,
        duration=2.0 * seconds,
        channels=list(dict.fromkeys(names)),
        settling=SETTLING,
    )
    signals = np.array([motion.signals[name] for name in names])
    edges = seconds * np.arange(n_bins + 1) / n_bins
    gained = 0.5 * ((high - low) / seconds) * (edges[1:] + edges[:-1])
    back = (2.0 * seconds - edges)[::-1]
    way = partial(_way, motion, signals, len(nodes), n_orders)
    return Sweep(
        seconds=seconds,
        up=way(edges, low + gained),
        down=way(back, high - gained),
        energy_residual=motion.energy_residual,
    )


def _way(
    motion: LineMotion,
    signals: Array,
    n_nodes: int,
    n_orders: int,
    edges: Array,
    speeds: Array,
) -> SweepWay:
    """One way: ``edges`` (bin + 1,) s of its bins, ``speeds`` (bin,) in their middles."""
    result: dict[str, list[Array]] = {
        key: [] for key in ("angle", "mean", "scatter", "force", "spectra")
    }
    frequencies = np.zeros(0)
    n_window = min(round(SPECTRUM_WINDOW * RATE), signals.shape[1])
    for begin, end in pairwise(edges):
        inside = slice(math.ceil(begin * RATE), math.floor(end * RATE))
        crank, part = motion.nominal_angle[inside], signals[:, inside]
        cycles = fluctuations(part[n_nodes : 2 * n_nodes], crank)
        result["angle"].append(order_amplitudes(part[:n_nodes], crank, n_orders))
        result["mean"].append(cycles.mean(axis=1))
        result["scatter"].append(
            cycles.std(axis=1, ddof=1) / math.sqrt(cycles.shape[1])
        )
        result["force"].append(typical_extremes(part[2 * n_nodes :], crank)[1])
        first = round(0.5 * (begin + end) * RATE) - n_window // 2
        first = min(max(first, 0), signals.shape[1] - n_window)
        frequencies, spectra = amplitude_spectra(
            signals[:n_nodes, first : first + n_window]
        )
        result["spectra"].append(spectra)
    order = np.argsort(speeds)
    by_bin = {
        key: np.moveaxis(np.array(values)[order], 0, 1)
        for key, values in result.items()
    }
    return SweepWay(
        speeds=speeds[order],
        orders=np.arange(1, n_orders + 1) / 2.0,
        angle=by_bin["angle"],
        fluctuation=by_bin["mean"],
        scatter=by_bin["scatter"],
        greatest_force=by_bin["force"],
        frequencies=frequencies,
        spectra=by_bin["spectra"],
    )


def amplitude_spectra(
    signals: Array, highest: float = SPECTRUM_HZ
) -> tuple[Array, Array]:
    """Frequencies (frequency,) Hz up to the highest and amplitudes (signal, frequency) of signals
    (signal, sample).

    Under Hann's window, straight trends taken off; a steady line has its amplitude.
    """
    n_samples = signals.shape[1]
    rest = without_trend(signals, np.linspace(-1.0, 1.0, n_samples))
    window = np.hanning(n_samples)
    frequencies = np.asarray(np.fft.rfftfreq(n_samples, 1.0 / RATE), dtype=np.float64)
    shown = frequencies <= highest
    amplitudes = 2.0 / window.sum() * np.abs(np.fft.rfft(rest * window))
    return frequencies[shown], amplitudes[:, shown]
