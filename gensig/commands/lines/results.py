"""Results of the verbs on drive lines, for their JSON files, summaries and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_dampers import DynamicRootStress, ToothLoad
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.engine_torques import Engine
from gensig.driveline.excitation.line_torques import LineTorques
from gensig.driveline.in_time import TimeResponse
from gensig.driveline.linear.forced import SteadyResponse, Waterfall
from gensig.driveline.sweep import Sweep
from gensig.errors import ConfigError
from gensig.life.root.strength import reliability
from gensig.units import from_si

MOST_SPEEDS = 2000
RPM = from_si("speed_rpm", 1.0)
MPA = from_si("stress_mpa", 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseResult:
    """Forced response of a drive line: operating point, steady vibration and a run of speeds.

    Attributes
    ----------
    seen : toothed wheel -> half the peak to peak of the speed that it shows, rad/s
    nodes : numbers of the nodes that are shown
    run : one waterfall for each shown node
    in_time, sweep : motions whose teeth may part
    mesh : mesh whose root stress was asked for
    roots : root stresses by name: linear or in time, with dampers or without
    """

    torques: LineTorques
    response: SteadyResponse
    seen: dict[str, float]
    nodes: tuple[int, ...]
    run: tuple[Waterfall, ...]
    in_time: TimeResponse | None = None
    sweep: Sweep | None = None
    mesh: int | None = None
    roots: dict[str, DynamicRootStress] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DamperState:
    """A drive line before or after tuning its dampers.

    ``largest`` (speed,) N is the greatest tooth force over the range of speeds. The rest holds at
    the reference speed.
    """

    line: EngineLine
    largest: Array
    response: SteadyResponse
    load: ToothLoad
    root: DynamicRootStress


def turner(line: EngineLine) -> str:
    """Name of the shaft that the speeds and angles of a line are given for."""
    if isinstance(line.engine, Engine):
        return "crank"
    return "motor"


def natural_hz(line: EngineLine) -> dict[str, float]:
    """Natural frequencies of a line, Hz, by their rounded values."""
    frequencies = line.drive.modes().frequency
    return {f"{hz:.0f}": float(hz) for hz in frequencies if hz > 0.0}


def turns_evenly(line: EngineLine) -> bool:
    """True when nothing excites the line while its meshes never part."""
    return not isinstance(line.engine, Engine) and line.engine.ripple is None


def node_name(line: EngineLine, node: int) -> str:
    """Name and number of a node."""
    return f"{line.drive.line.nodes[line.drive.numbers.index(node)].name} ({node})"


def roll_degrees(root: DynamicRootStress) -> Array:
    """Roll of the pinion since contact begins, degrees."""
    pinion = root.strength.pair.pinion
    return np.asarray(np.degrees(root.history.roll / pinion.base_radius))


def heaviest_pass(root: DynamicRootStress) -> Array:
    """Root stress of the decisive gear over the roll of the tooth pair that bears most, Pa."""
    passes = root.passes[root.strength.decisive]
    return np.asarray(passes[int(passes.max(axis=1).argmax())])


def strength_content(root: DynamicRootStress) -> dict[str, Any]:
    """JSON keys of root stress and safety that forced-response and tune-damper share."""
    gear = root.gears[root.strength.decisive]
    return {
        "decisive_gear": root.strength.decisive,
        "iso_root_stress_mpa": from_si("stress_mpa", gear.stress),
        "roll_angle_deg": roll_degrees(root),
        "root_stress_mpa": MPA * heaviest_pass(root),
        "safety_factor_paper": gear.safety.paper,
        "reliability_paper": reliability(gear.safety.paper),
        "safety_factor_iso": gear.safety.iso,
    }


def speed_steps(values: Sequence[float]) -> tuple[float, float, float]:
    """Lowest speed, highest speed and step of ``--run`` in r/min, checked."""
    low, high, step = values
    if not (0.0 < low < high and step > 0.0 and (high - low) / step < MOST_SPEEDS):
        text = " ".join(f"{value:g}" for value in values)
        raise ConfigError(
            f"--run {text}: give low, high and step in r/min, "
            f"fewer than {MOST_SPEEDS} speeds"
        )
    return low, high, step


def spaced(low: float, high: float, step: float) -> Array:
    """Values from the lowest to the highest, both included where the step allows it."""
    return np.arange(low, high + 0.5 * step, step)
