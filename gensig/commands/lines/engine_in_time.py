"""What ``gensig forced-response`` finds with teeth free to part.

An operating point, a sweep, root stress.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gensig.driveline.cycle_statistics import (
    fluctuations,
    order_amplitudes,
    typical_extremes,
)
from gensig.driveline.engine_dampers import DynamicRootStress, passes_of_a_cycle
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.excitation.line_torques import LineTorques
from gensig.driveline.in_time import TimeResponse, own_meshes, time_response
from gensig.driveline.sweep import Sweep, SweepWay, sweep_response
from gensig.driveline.time_root_stress import typical_largest
from gensig.errors import ConfigError
from gensig.life.root.strength import RELIABILITY, reliability
from gensig.options.configuration import Configuration
from gensig.units import from_si, to_si

LONGEST_TIME = 60.0  # s
TIME_ORDERS = 80  # half orders: up to order 40
WITHOUT = "_without_dampers"


def simulate_time(
    line: EngineLine,
    config: Configuration,
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
    own = own_meshes(line, config, speed, torque)
    return time_response(line, speed, torque, own=own, nodes=nodes, duration=duration)


def simulate_sweep(
    line: EngineLine,
    config: Configuration,
    nodes: Sequence[int],
    given: Sequence[float],
    torque: float,
    n_orders: int,
) -> Sweep:
    """A run-up and a run-down in time; the teeth's tables are those of the middle speed."""
    low, high = (to_si("speed_rpm", value) for value in given[:2])
    seconds = given[2]
    if not (0.0 < low < high < np.inf and 0.0 < seconds <= LONGEST_TIME):
        text = " ".join(f"{value:g}" for value in given)
        raise ConfigError(
            f"--sweep {text}: give low and high speed in r/min and the seconds from one to the other, at most "
            f"{LONGEST_TIME:g}"
        )
    own = own_meshes(line, config, 0.5 * (low + high), torque)
    return sweep_response(
        line, low, high, seconds, torque, own=own, nodes=nodes, n_orders=n_orders
    )


def without_dampers(config: Configuration) -> EngineLine:
    """The engine of a configuration without its ``system.dampers``."""
    return read_engine_line(config.with_keys("system", dampers=[]))


def time_content(response: TimeResponse) -> dict[str, Any]:
    """What ``--time`` adds; typical is the median over the cycles."""
    rpm = from_si("speed_rpm", 1.0)
    least, greatest = typical_extremes(response.mesh_force, response.crank_angle)
    return {
        "time_speed_fluctuation_rpm": rpm * response.fluctuation,
        "time_typical_fluctuation_rpm": rpm
        * np.median(fluctuations(response.speed, response.crank_angle), axis=1),
        "time_mean_cycle_fluctuation_rpm": rpm * response.cycle_fluctuation,
        "time_orders": 0.5 * np.arange(1, TIME_ORDERS + 1),
        "time_angle_deg": np.degrees(
            order_amplitudes(response.angle, response.crank_angle, TIME_ORDERS)
        ),
        "time_contact_loss_fraction": response.contact_loss,
        "time_back_contact_fraction": response.back_contact,
        "time_least_tooth_force_n": response.least_force,
        "time_greatest_tooth_force_n": response.greatest_force,
        "time_typical_least_tooth_force_n": least,
        "time_typical_greatest_tooth_force_n": greatest,
        "time_energy_residual": response.energy_residual,
    }


def sweep_content(sweep: Sweep) -> dict[str, Any]:
    """What ``--sweep`` adds."""
    speeds = from_si("speed_rpm", 1.0) * sweep.up.speeds
    difference, apart = sweep.difference, sweep.told_apart
    most = np.abs(difference).argmax(axis=1)
    return {
        "sweep_seconds_each_way": sweep.seconds,
        "sweep_speeds_rpm": speeds,
        "sweep_orders": sweep.up.orders,
        "sweep_up": _way_content(sweep.up),
        "sweep_down": _way_content(sweep.down),
        "sweep_up_less_down": difference,
        "sweep_told_apart": apart.tolist(),
        "sweep_largest_difference": difference[np.arange(len(most)), most],
        "sweep_largest_difference_at_rpm": speeds[most],
        "sweep_energy_residual": sweep.energy_residual,
    }


def _way_content(way: SweepWay) -> dict[str, Any]:
    rpm = from_si("speed_rpm", 1.0)
    return {
        "speed_fluctuation_rpm": (rpm * way.fluctuation).tolist(),
        "standard_error_rpm": (rpm * way.scatter).tolist(),
        "angle_deg": np.degrees(way.angle).tolist(),
        "typical_greatest_tooth_force_n": way.greatest_force.tolist(),
    }


def root_content(
    line: EngineLine, mesh: int, root: DynamicRootStress
) -> dict[str, Any]:
    """Root stress of the decisive gear of a mesh under one dynamic load."""
    name = root.strength.decisive
    gear, passes = root.gears[name], root.passes[name]
    in_cycle = passes_of_a_cycle(line, mesh)
    return {
        "decisive_gear": name,
        "greatest_tooth_force_n": root.strength.flanks.mesh_force,
        "iso_root_stress_mpa": from_si("stress_mpa", gear.stress),
        "largest_root_stress_mpa": from_si(
            "stress_mpa", typical_largest(passes, in_cycle)
        ),
        "roll_angle_deg": np.degrees(
            root.history.roll / root.strength.pair.pinion.base_radius
        ).tolist(),
        "root_stress_mpa": (
            from_si("stress_mpa", 1.0) * passes[int(passes.max(axis=1).argmax())]
        ).tolist(),
        "largest_root_stress_of_passes_mpa": (
            from_si("stress_mpa", 1.0) * passes.max(axis=1)
        ).tolist(),
        "safety_factor_paper": gear.safety.paper,
        "reliability_paper": reliability(gear.safety.paper),
        "safety_factor_iso": gear.safety.iso,
        "reliability_iso": reliability(gear.safety.iso),
    }


def print_in_time(content: Mapping[str, Any]) -> None:
    """A summary of ``--time``."""
    print(
        f"in time, teeth free to part (energy residual {content['time_energy_residual']:.1g}):"
    )
    kinds = (
        "typical_fluctuation_rpm",
        "speed_fluctuation_rpm",
        "mean_cycle_fluctuation_rpm",
    )
    nodes = zip(
        content["shown_nodes"],
        *(content[f"time_{kind}"] for kind in kinds),
        strict=True,
    )
    for node, typical, whole, cycle in nodes:
        print(
            f"  node {node:>3} +- {typical:.2f} r/min in a cycle, {whole:.2f} in all, {cycle:.2f} of the mean cycle"
        )
    ends = ("typical_least", "typical_greatest", "least", "greatest")
    keys = (
        *(f"{end}_tooth_force_n" for end in ends),
        "contact_loss_fraction",
        "back_contact_fraction",
    )
    rows = zip(
        content["meshes"], *(content[f"time_{key}"] for key in keys), strict=True
    )
    for name, least, greatest, low, high, apart, back in rows:
        print(
            f"  mesh {name:>6} {least:7.0f} .. {greatest:.0f} N in a cycle, {low:.0f} .. {high:.0f} in all, "
            f"apart {apart:.1%}, on the back flanks {back:.1%}"
        )


def print_roots(content: Mapping[str, Any]) -> None:
    """A summary of ``--mesh``."""
    roots = content["root_stress"]
    print(
        f"root stress of mesh {content['root_stress_mesh']}, {roots['linear']['decisive_gear']}:"
    )
    for name, root in roots.items():
        change = ""
        if name + WITHOUT in roots:
            before = roots[name + WITHOUT]["iso_root_stress_mpa"]
            change = (
                f", {root['iso_root_stress_mpa'] / before - 1.0:+.1%} by the dampers"
            )
        print(
            f"  {name.replace('_', ' '):<24} {root['greatest_tooth_force_n']:7.0f} N, "
            f"{root['iso_root_stress_mpa']:.1f} MPa by ISO 6336-3, "
            f"{root['largest_root_stress_mpa']:.1f} over the mesh{change}"
        )
        print(
            f"  {'':<24} safety {root['safety_factor_paper']:.3f} ({root['reliability_paper']}) by the paper, "
            f"{root['safety_factor_iso']:.3f} ({root['reliability_iso']}) by ISO 6336-3"
        )
    classes = ", ".join(
        f"{one.name} from {one.least_safety:.2f} on" for one in RELIABILITY
    )
    print(f"  reliability: {classes}")


def print_sweep(content: Mapping[str, Any]) -> None:
    """A summary of ``--sweep``."""
    speeds = content["sweep_speeds_rpm"]
    print(
        f"sweep up and down, {content['sweep_seconds_each_way']:g} s each way (energy residual "
        f"{content['sweep_energy_residual']:.1g}):"
    )
    shown = zip(
        content["shown_nodes"],
        content["sweep_up"]["speed_fluctuation_rpm"],
        content["sweep_down"]["speed_fluctuation_rpm"],
        content["sweep_told_apart"],
        content["sweep_largest_difference"],
        content["sweep_largest_difference_at_rpm"],
        strict=True,
    )
    for node, up, down, apart, most, at in shown:
        print(
            f"  node {node:>3} +- up to {max(up):.1f} r/min going up, {max(down):.1f} going down; up less down at most "
            f"{most:+.0%}, at {at:.0f} r/min; told apart at {sum(apart)} of {len(speeds)} speeds"
        )
