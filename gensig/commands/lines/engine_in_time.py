"""Results of ``gensig forced-response`` with teeth free to part: point, sweep, root stress."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gensig.commands.lines.results import MPA, RPM, strength_content
from gensig.commands.output import columns
from gensig.driveline.engine_dampers import DynamicRootStress, passes_of_a_cycle
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle_statistics import (
    fluctuations,
    order_amplitudes,
    typical_extremes,
)
from gensig.driveline.excitation.line_torques import LineTorques
from gensig.driveline.in_time import TimeResponse, tabulated_meshes, time_response
from gensig.driveline.sweep import Sweep, SweepWay, sweep_response
from gensig.driveline.teeth import ToothLaw
from gensig.driveline.time_root_stress import typical_largest
from gensig.errors import ConfigError
from gensig.life.root.strength import RELIABILITY, reliability
from gensig.units import from_si, to_si

LONGEST_TIME = 60.0  # s
TIME_ORDERS = 80  # half orders: up to order 40
WITHOUT = "_without_dampers"


def simulate_time(
    line: EngineLine,
    law: ToothLaw,
    torques: LineTorques,
    nodes: Sequence[int],
    duration: float,
) -> TimeResponse:
    """An operating point integrated in time, its spur meshes by tables of their teeth."""
    if not 0.0 < duration <= LONGEST_TIME:
        raise ConfigError(
            f"--time {duration:g}: give seconds above 0, at most {LONGEST_TIME:g}"
        )
    speed, torque = torques.speed, torques.brake_torque
    teeth = tabulated_meshes(line, law, speed, torque)
    return time_response(
        line, speed, torque, teeth=teeth, nodes=nodes, duration=duration
    )


def simulate_sweep(
    line: EngineLine,
    law: ToothLaw,
    nodes: Sequence[int],
    given: Sequence[float],
    torque: float,
    n_orders: int,
) -> Sweep:
    """A run-up and a run-down in time; the tables of teeth are those of the middle speed."""
    low, high = (to_si("speed_rpm", value) for value in given[:2])
    seconds = given[2]
    if not (0.0 < low < high < np.inf and 0.0 < seconds <= LONGEST_TIME):
        text = " ".join(f"{value:g}" for value in given)
        raise ConfigError(
            f"--sweep {text}: give low and high speed in r/min "
            f"and the seconds from one to the other, at most {LONGEST_TIME:g}"
        )
    teeth = tabulated_meshes(line, law, 0.5 * (low + high), torque)
    return sweep_response(
        line,
        low,
        high,
        seconds,
        torque,
        teeth=teeth,
        nodes=nodes,
        n_orders=n_orders,
    )


def time_content(response: TimeResponse) -> dict[str, Any]:
    """JSON keys of ``--time``; typical is the median over the cycles."""
    crank = response.crank_angle
    least, greatest = typical_extremes(response.mesh_force, crank)
    by_cycle = fluctuations(response.speed, crank)
    angle = order_amplitudes(response.angle, crank, TIME_ORDERS)
    return {
        "time_speed_fluctuation_rpm": RPM * response.fluctuation,
        "time_typical_fluctuation_rpm": RPM * np.median(by_cycle, axis=1),
        "time_mean_cycle_fluctuation_rpm": RPM * response.cycle_fluctuation,
        "time_orders": 0.5 * np.arange(1, TIME_ORDERS + 1),
        "time_angle_deg": np.degrees(angle),
        "time_contact_loss_fraction": response.contact_loss,
        "time_back_contact_fraction": response.back_contact,
        "time_least_tooth_force_n": response.least_force,
        "time_greatest_tooth_force_n": response.greatest_force,
        "time_typical_least_tooth_force_n": least,
        "time_typical_greatest_tooth_force_n": greatest,
        "time_energy_residual": response.energy_residual,
    }


def sweep_content(sweep: Sweep) -> dict[str, Any]:
    """JSON keys of ``--sweep``."""
    speeds = RPM * sweep.up.speeds
    difference = sweep.difference
    most = np.abs(difference).argmax(axis=1)
    return {
        "sweep_seconds_each_way": sweep.seconds,
        "sweep_speeds_rpm": speeds,
        "sweep_orders": sweep.up.orders,
        "sweep_up": _way_content(sweep.up),
        "sweep_down": _way_content(sweep.down),
        "sweep_up_less_down": difference,
        "sweep_told_apart": sweep.is_distinct,
        "sweep_largest_difference": difference[np.arange(len(most)), most],
        "sweep_largest_difference_at_rpm": speeds[most],
        "sweep_energy_residual": sweep.energy_residual,
    }


def _way_content(way: SweepWay) -> dict[str, Any]:
    return {
        "speed_fluctuation_rpm": RPM * way.fluctuation,
        "standard_error_rpm": RPM * way.scatter,
        "angle_deg": np.degrees(way.angle),
        "typical_greatest_tooth_force_n": way.greatest_force,
    }


def root_content(
    line: EngineLine, mesh: int, root: DynamicRootStress
) -> dict[str, Any]:
    """Root stress of the decisive gear of a mesh under one dynamic load."""
    name = root.strength.decisive
    passes, safety = root.passes[name], root.gears[name].safety
    largest = typical_largest(passes, passes_of_a_cycle(line, mesh))
    return {
        **strength_content(root),
        "greatest_tooth_force_n": root.strength.flanks.mesh_force,
        "largest_root_stress_mpa": from_si("stress_mpa", largest),
        "largest_root_stress_of_passes_mpa": MPA * passes.max(axis=1),
        "reliability_iso": reliability(safety.iso),
    }


def time_lines(content: Mapping[str, Any]) -> Iterator[str]:
    """Summary of ``--time``."""
    residual = content["time_energy_residual"]
    yield f"in time, teeth free to part (energy residual {residual:.1g}):"
    nodes = columns(
        content,
        "shown_nodes",
        "time_typical_fluctuation_rpm",
        "time_speed_fluctuation_rpm",
        "time_mean_cycle_fluctuation_rpm",
    )
    for node, typical, whole, cycle in nodes:
        yield (
            f"  node {node:>3} +- {typical:.2f} r/min in a cycle, {whole:.2f} in all, "
            f"{cycle:.2f} of the mean cycle"
        )
    meshes = columns(
        content,
        "meshes",
        "time_typical_least_tooth_force_n",
        "time_typical_greatest_tooth_force_n",
        "time_least_tooth_force_n",
        "time_greatest_tooth_force_n",
        "time_contact_loss_fraction",
        "time_back_contact_fraction",
    )
    for name, least, greatest, low, high, apart, back in meshes:
        yield (
            f"  mesh {name:>6} {least:7.0f} .. {greatest:.0f} N in a cycle, "
            f"{low:.0f} .. {high:.0f} in all, "
            f"apart {apart:.1%}, on the back flanks {back:.1%}"
        )


def root_lines(content: Mapping[str, Any]) -> Iterator[str]:
    """Summary of ``--mesh``."""
    roots, mesh = content["root_stress"], content["root_stress_mesh"]
    yield f"root stress of mesh {mesh}, {roots['linear']['decisive_gear']}:"
    for name, root in roots.items():
        change, stress = "", root["iso_root_stress_mpa"]
        if name + WITHOUT in roots:
            before = roots[name + WITHOUT]["iso_root_stress_mpa"]
            change = f", {stress / before - 1.0:+.1%} by the dampers"
        yield (
            f"  {name.replace('_', ' '):<24} {root['greatest_tooth_force_n']:7.0f} N, "
            f"{stress:.1f} MPa by ISO 6336-3, "
            f"{root['largest_root_stress_mpa']:.1f} over the mesh{change}"
        )
        paper, iso = root["safety_factor_paper"], root["safety_factor_iso"]
        yield (
            f"  {'':<24} safety {paper:.3f} ({root['reliability_paper']}) by the paper, "
            f"{iso:.3f} ({root['reliability_iso']}) by ISO 6336-3"
        )
    classes = [f"{rank.name} from {rank.least_safety:.2f} on" for rank in RELIABILITY]
    yield f"  reliability: {', '.join(classes)}"


def sweep_lines(content: Mapping[str, Any]) -> Iterator[str]:
    """Summary of ``--sweep``."""
    n_speeds = len(content["sweep_speeds_rpm"])
    seconds, residual = (
        content["sweep_seconds_each_way"],
        content["sweep_energy_residual"],
    )
    yield f"sweep up and down, {seconds:g} s each way (energy residual {residual:.1g}):"
    nodes = zip(
        content["shown_nodes"],
        content["sweep_up"]["speed_fluctuation_rpm"],
        content["sweep_down"]["speed_fluctuation_rpm"],
        content["sweep_told_apart"],
        content["sweep_largest_difference"],
        content["sweep_largest_difference_at_rpm"],
        strict=True,
    )
    for node, up, down, apart, most, speed in nodes:
        yield (
            f"  node {node:>3} +- up to {max(up):.1f} r/min going up, "
            f"{max(down):.1f} going down; up less down at most {most:+.0%}, "
            f"at {speed:.0f} r/min; told apart at {sum(apart)} of {n_speeds} speeds"
        )
