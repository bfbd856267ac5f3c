"""The verb forced-response: what an engine's torques do to its drive line, steadily, at one speed and over a run."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.console import replaced_file
from gensig.config import read_request
from gensig.dynamics.engine_torques import EngineTorques
from gensig.dynamics.forced import SteadyResponse, Waterfall, disturbance_response, over_cycle, run_of_speeds
from gensig.errors import ConfigError
from gensig.mesh.options import read_mesh_options, read_slice_options
from gensig.systems.engine_line import EngineLine, read_engine_line
from gensig.systems.line_time import TimeResponse, own_meshes, time_response
from gensig.systems.registry import read_material
from gensig.units import from_si, to_si

FIGURE_TYPES = (".png", ".svg", ".pdf")
CYCLE_POINTS = 5760
MOST_SPEEDS = 2000
RUN_ORDERS = 80  # half orders of a run: up to order 40
LONGEST_TIME = 60.0  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What the verb writes: the operating point, the steady vibration, the nodes looked at, and the run of speeds.

    ``seen`` is half the peak to peak of the speed that each toothed wheel shows, rad/s; ``in_time`` lets teeth part.
    """

    torques: EngineTorques
    response: SteadyResponse
    seen: dict[str, float]
    nodes: tuple[int, ...]
    run: tuple[Waterfall, ...]
    in_time: TimeResponse | None = None


def forced_response(arguments: Namespace) -> int:
    """Speed fluctuation, spectra and tooth forces: JSON, a figure, or a summary."""
    if arguments.plot is not None and Path(arguments.plot).suffix not in FIGURE_TYPES:
        raise ConfigError(f"--plot {arguments.plot}: the name must end in {', '.join(FIGURE_TYPES)}")
    config = read_request(arguments.overrides, config_dir=arguments.config_dir).config
    line = read_engine_line(config)
    found = _find(line, arguments, config["seed"])
    if arguments.time is not None:
        found = replace(found, in_time=_in_time(line, config, found, arguments.time))
    content = response_content(line, found)
    if arguments.json:
        with replaced_file(arguments.json) as path:
            path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    if arguments.plot:
        from gensig.commands.engine_figures import plot_response

        with replaced_file(arguments.plot) as path:
            plot_response(line, found, path)
    _print(content)
    return 0


def response_content(line: EngineLine, found: Found) -> dict[str, Any]:
    """The keys of ``gensig forced-response --json``."""
    response, torques = found.response, found.torques
    numbers = line.drive.numbers
    places = [numbers.index(node) for node in found.nodes]
    linear, meshes = line.linear()
    mean, amplitudes = response.element_forces(meshes)
    forces = mean[:, None] + over_cycle(amplitudes, CYCLE_POINTS)
    content: dict[str, Any] = {
        "speed_rpm": from_si("speed_rpm", response.speed),
        "torque_nm": torques.brake_torque,
        "indicated_torque_nm": torques.indicated_torque,
        "peak_pressure_mpa": from_si("pressure_mpa", float(torques.pressure.max())),
        "node_numbers": list(numbers),
        "nodes": [node.name for node in line.drive.line.nodes],
        "mean_speed_rpm": [line.ratios[number] * from_si("speed_rpm", response.speed) for number in numbers],
        "speed_fluctuation_rpm": from_si("speed_rpm", 1.0) * response.fluctuation()[: len(numbers)],
        "toothed_wheel_fluctuation_rpm": {name: from_si("speed_rpm", value) for name, value in found.seen.items()},
        "orders": response.orders,
        "shown_nodes": list(found.nodes),
        "angle_deg": np.degrees(np.abs(response.angle[places])),
        "meshes": list(line.mesh_names),
        "mean_tooth_force_n": mean,
        "least_tooth_force_n": forces.min(axis=1),
        "greatest_tooth_force_n": forces.max(axis=1),
    }
    if torques.disturbance_torque:
        place = numbers.index(torques.disturbance_node)
        moved = disturbance_response(
            linear, place, torques.disturbance_torque, 2.0 * np.pi * torques.disturbance_frequency
        )
        content["disturbance_frequency_hz"] = torques.disturbance_frequency
        content["disturbance_angle_deg"] = np.degrees(np.abs(moved[places]))
    if found.in_time is not None:
        content |= _time_content(found.in_time)
    if found.run:
        content["run_speeds_rpm"] = from_si("speed_rpm", 1.0) * found.run[0].speeds
        content["run_speed_fluctuation_rpm"] = [from_si("speed_rpm", 1.0) * one.fluctuation for one in found.run]
        content["run_angle_deg"] = [np.degrees(one.angle) for one in found.run]
    return {key: _plain(value) for key, value in content.items()}


def _in_time(line: EngineLine, config: Mapping[str, Any], found: Found, duration: float) -> TimeResponse:
    """The same operating point integrated in time, its spur meshes by tables of their teeth."""
    if not 0.0 < duration <= LONGEST_TIME:
        raise ConfigError(f"--time {duration:g}: give seconds above 0, at most {LONGEST_TIME:g}")
    speed, torque = found.torques.speed, found.torques.brake_torque
    if line.engine.pressure_decides_torque:
        raise ConfigError("--time: excitation.pressure.file decides the torque; leave --time out")
    own = own_meshes(
        line,
        read_material(config),
        read_mesh_options(config["mesh"]),
        read_slice_options(config["mesh"]),
        speed,
        torque,
    )
    return time_response(line, speed, torque, own=own, nodes=found.nodes, duration=duration)


def _time_content(found: TimeResponse) -> dict[str, Any]:
    """What ``--time`` adds."""
    rpm = from_si("speed_rpm", 1.0)
    return {
        "time_speed_fluctuation_rpm": rpm * found.fluctuation,
        "time_mean_cycle_fluctuation_rpm": rpm * found.cycle_fluctuation,
        "time_contact_loss_fraction": found.contact_loss,
        "time_back_contact_fraction": found.back_contact,
        "time_least_tooth_force_n": found.least_force,
        "time_greatest_tooth_force_n": found.greatest_force,
        "time_energy_residual": found.energy_residual,
    }


def _find(line: EngineLine, arguments: Namespace, seed: int) -> Found:
    reference, ratios = line.engine.reference, line.ratios
    speed = reference.speed if arguments.speed is None else to_si("speed_rpm", arguments.speed)
    measured = line.engine.pressure_decides_torque
    torque = None if measured else reference.torque if arguments.torque is None else arguments.torque
    if measured and (arguments.torque is not None or arguments.run is not None):
        raise ConfigError("excitation.pressure.file decides the torque; leave --torque and --run out")
    measured_nodes = tuple(wheel.node for wheel in line.wheels.values())
    nodes = tuple(arguments.nodes or measured_nodes or (line.engine.throw_nodes[0], line.engine.dynamometer.node))
    for node in nodes:
        if node not in ratios:
            raise ConfigError(f"--nodes {node}: the shaft line has no such node; it has {min(ratios)} to {max(ratios)}")
    torques = line.torques(speed, torque)
    linear, _ = line.linear()
    places = [line.drive.numbers.index(node) for node in nodes]
    run: list[Waterfall] = []
    if arguments.run is not None:
        low, high, step = (to_si("speed_rpm", value) for value in arguments.run)
        if not (0.0 < low < high and step > 0.0 and (high - low) / step < MOST_SPEEDS):
            given = " ".join(f"{value:g}" for value in arguments.run)
            raise ConfigError(f"--run {given}: give low, high and step in r/min, fewer than {MOST_SPEEDS} speeds")
        speeds = np.arange(low, high + 0.5 * step, step)
        run = run_of_speeds(
            linear,
            lambda one: line.on_line(line.torques(one, arguments.run_torque)),
            speeds,
            places,
            n_orders=RUN_ORDERS,
        )
    response, rng = line.response(speed, torque), np.random.default_rng(seed)
    seen = {name: 0.5 * float(np.ptp(line.seen_by(wheel, response, rng))) for name, wheel in line.wheels.items()}
    return Found(torques=torques, response=response, seen=seen, nodes=nodes, run=tuple(run))


def _print(content: dict[str, Any]) -> None:
    print(
        f"{content['speed_rpm']:g} r/min, {content['torque_nm']:.6g} N m at the crank, "
        f"{content['indicated_torque_nm']:.5g} N m indicated, peak {content['peak_pressure_mpa']:.4g} MPa"
    )
    by_number = dict(zip(content["node_numbers"], range(len(content["nodes"])), strict=True))
    for node in content["shown_nodes"]:
        place = by_number[node]
        print(
            f"  node {node:>3} {content['nodes'][place]:<34} {content['mean_speed_rpm'][place]:8.1f} r/min "
            f"+- {content['speed_fluctuation_rpm'][place]:.2f}"
        )
    for name, value in content["toothed_wheel_fluctuation_rpm"].items():
        print(f"  toothed wheel {name} shows +- {value:.2f} r/min")
    for name, low, mean, high in zip(
        content["meshes"],
        content["least_tooth_force_n"],
        content["mean_tooth_force_n"],
        content["greatest_tooth_force_n"],
        strict=True,
    ):
        parts = " (would part)" if min(low * mean, high * mean) < 0.0 else ""
        print(f"  mesh {name:>6} {low:9.0f} .. {high:.0f} N, mean {mean:.0f} N{parts}")
    if "time_energy_residual" in content:
        _print_time(content)


def _print_time(content: dict[str, Any]) -> None:
    print(f"in time, teeth free to part (energy residual {content['time_energy_residual']:.1g}):")
    shown = zip(
        content["shown_nodes"],
        content["time_speed_fluctuation_rpm"],
        content["time_mean_cycle_fluctuation_rpm"],
        strict=True,
    )
    for node, whole, cycle in shown:
        print(f"  node {node:>3} +- {whole:.2f} r/min, +- {cycle:.2f} of the mean cycle")
    keys = ("least_tooth_force_n", "greatest_tooth_force_n", "contact_loss_fraction", "back_contact_fraction")
    for name, low, high, apart, back in zip(content["meshes"], *(content[f"time_{key}"] for key in keys), strict=True):
        print(f"  mesh {name:>6} {low:9.0f} .. {high:.0f} N, apart {apart:.1%}, on the back flanks {back:.1%}")


def _plain(value: Any) -> Any:
    """Arrays as lists."""
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray) else value
