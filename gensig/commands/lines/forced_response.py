"""The verb forced-response.

What an engine's torques do to its drive line, steadily, at one speed and over a run.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.lines.engine_in_time import (
    print_in_time,
    print_roots,
    print_sweep,
    root_content,
    simulate_sweep,
    simulate_time,
    sweep_content,
    time_content,
    without_dampers,
)
from gensig.commands.lines.results import ResponseResult
from gensig.commands.output import check_outputs, plain, write_outputs
from gensig.commands.request import read_configuration
from gensig.driveline.engine_dampers import (
    DynamicRootStress,
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
    tooth_load,
)
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.excitation.engine_torques import EngineTorques
from gensig.driveline.excitation.motor_torques import MotorDrive
from gensig.driveline.linear.forced import (
    Waterfall,
    disturbance_response,
    over_cycle,
    run_of_speeds,
)
from gensig.driveline.time_root_stress import root_stress_in_time
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.units import from_si, to_si

CYCLE_POINTS = 5760
MOST_SPEEDS = 2000
RUN_ORDERS = 80  # half orders of a run: up to order 40


def forced_response(arguments: Namespace) -> int:
    """Speed fluctuation, spectra and tooth forces: JSON, a figure, or a summary."""
    check_outputs(arguments)
    config = read_configuration(arguments)
    line = read_engine_line(config)
    found = _find(line, arguments, config["seed"])
    if (arguments.time, arguments.sweep) != (
        None,
        None,
    ) and line.engine.pressure_decides_torque:
        raise ConfigError(
            "excitation.pressure.file decides the torque; leave --time and --sweep out"
        )
    if arguments.time is not None:
        found = replace(
            found,
            in_time=simulate_time(
                line, config, found.torques, found.nodes, arguments.time
            ),
        )
    if arguments.mesh is not None:
        found = replace(found, mesh=mesh_between(line, arguments.mesh))
        found = replace(found, roots=_roots(line, config, found, arguments.time))
    if arguments.sweep is not None:
        sweep = simulate_sweep(
            line, config, found.nodes, arguments.sweep, arguments.run_torque, RUN_ORDERS
        )
        found = replace(found, sweep=sweep)
    content = response_content(line, found)

    def draw(path: Path) -> None:
        from gensig.commands.figures.engine_figures import plot_response

        plot_response(line, found, path)

    write_outputs(arguments, content, draw)
    _print(content)
    return 0


def response_content(line: EngineLine, found: ResponseResult) -> dict[str, Any]:
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
        "node_numbers": list(numbers),
        "nodes": [node.name for node in line.drive.line.nodes],
        "mean_speed_rpm": [
            line.ratios[number] * from_si("speed_rpm", response.speed)
            for number in numbers
        ],
        "speed_fluctuation_rpm": from_si("speed_rpm", 1.0)
        * response.fluctuation()[: len(numbers)],
        "toothed_wheel_fluctuation_rpm": {
            name: from_si("speed_rpm", value) for name, value in found.seen.items()
        },
        "orders": response.orders,
        "shown_nodes": list(found.nodes),
        "angle_deg": np.degrees(np.abs(response.angle[places])),
        "meshes": list(line.mesh_names),
        "mean_tooth_force_n": mean,
        "least_tooth_force_n": forces.min(axis=1),
        "greatest_tooth_force_n": forces.max(axis=1),
    }
    if isinstance(torques, EngineTorques):
        content["indicated_torque_nm"] = torques.indicated_torque
        content["peak_pressure_mpa"] = from_si(
            "pressure_mpa", float(torques.pressure.max())
        )
    if isinstance(torques, EngineTorques) and torques.disturbance_torque:
        place = numbers.index(torques.disturbance_node)
        moved = disturbance_response(
            linear,
            place,
            torques.disturbance_torque,
            2.0 * np.pi * torques.disturbance_frequency,
        )
        content["disturbance_frequency_hz"] = torques.disturbance_frequency
        content["disturbance_angle_deg"] = np.degrees(np.abs(moved[places]))
    if found.in_time is not None:
        content |= time_content(found.in_time)
    if found.sweep is not None:
        content |= sweep_content(found.sweep)
    if found.mesh is not None:
        content["root_stress_mesh"] = line.mesh_names[found.mesh]
        content["root_stress"] = {
            name: root_content(line, found.mesh, root)
            for name, root in found.roots.items()
        }
    if found.run:
        content["run_speeds_rpm"] = from_si("speed_rpm", 1.0) * found.run[0].speeds
        content["run_speed_fluctuation_rpm"] = [
            from_si("speed_rpm", 1.0) * one.fluctuation for one in found.run
        ]
        content["run_angle_deg"] = [np.degrees(one.angle) for one in found.run]
    return {key: plain(value) for key, value in content.items()}


def _roots(
    line: EngineLine,
    config: Configuration,
    found: ResponseResult,
    duration: float | None,
) -> dict[str, DynamicRootStress]:
    """Root stress of the mesh asked for, without the dampers too where there are any."""
    mesh = found.mesh
    assert mesh is not None
    strength = read_mesh_strength(config, line, mesh)
    roots = {
        "linear": dynamic_root_stress(
            strength, line, mesh, tooth_load(line, mesh, found.response)
        )
    }
    if found.in_time is not None:
        roots["in_time"] = root_stress_in_time(strength, line, mesh, found.in_time)
    if not config["system"]["dampers"]:
        return roots
    bare, torques = without_dampers(config), found.torques
    response = bare.response(torques.speed, torques.brake_torque)
    roots["linear_without_dampers"] = dynamic_root_stress(
        strength, bare, mesh, tooth_load(bare, mesh, response)
    )
    if duration is not None:
        undamped = simulate_time(bare, config, torques, found.nodes, duration)
        roots["in_time_without_dampers"] = root_stress_in_time(
            strength, bare, mesh, undamped
        )
    return roots


def _find(line: EngineLine, arguments: Namespace, seed: int) -> ResponseResult:
    reference, ratios = line.engine.reference, line.ratios
    speed = (
        reference.speed
        if arguments.speed is None
        else to_si("speed_rpm", arguments.speed)
    )
    measured = line.engine.pressure_decides_torque
    torque = (
        None
        if measured
        else reference.torque
        if arguments.torque is None
        else arguments.torque
    )
    if measured and (arguments.torque is not None or arguments.run is not None):
        raise ConfigError(
            "excitation.pressure.file decides the torque; leave --torque and --run out"
        )
    measured_nodes = tuple(wheel.node for wheel in line.wheels.values())
    nodes = tuple(
        arguments.nodes
        or measured_nodes
        or (line.engine.driving_nodes[0], line.engine.load_node)
    )
    for node in nodes:
        if node not in ratios:
            raise ConfigError(
                f"--nodes {node}: the shaft line has no such node; it has {min(ratios)} to {max(ratios)}"
            )
    torques = line.torques(speed, torque)
    linear, _ = line.linear()
    places = [line.drive.numbers.index(node) for node in nodes]
    run: list[Waterfall] = []
    if arguments.run is not None:
        if isinstance(line.engine, MotorDrive) and line.engine.ripple is None:
            raise ConfigError(
                "--run: a line whose meshes never part turns evenly without excitation.motor.torque_ripple; give one, "
                "or take --sweep"
            )
        low, high, step = (to_si("speed_rpm", value) for value in arguments.run)
        if not (0.0 < low < high and step > 0.0 and (high - low) / step < MOST_SPEEDS):
            given = " ".join(f"{value:g}" for value in arguments.run)
            raise ConfigError(
                f"--run {given}: give low, high and step in r/min, fewer than {MOST_SPEEDS} speeds"
            )
        speeds = np.arange(low, high + 0.5 * step, step)
        run = run_of_speeds(
            linear,
            lambda one: line.on_line(
                line.torques(
                    one, line.load_at(arguments.run_torque, one / reference.speed)
                )
            ),
            speeds,
            places,
            n_orders=RUN_ORDERS,
        )
    response, rng = line.response(speed, torque), np.random.default_rng(seed)
    seen = {
        name: 0.5 * float(np.ptp(line.seen_by(wheel, response, rng)))
        for name, wheel in line.wheels.items()
    }
    return ResponseResult(
        torques=torques, response=response, seen=seen, nodes=nodes, run=tuple(run)
    )


def _print(content: dict[str, Any]) -> None:
    if "indicated_torque_nm" in content:
        print(
            f"{content['speed_rpm']:g} r/min, {content['torque_nm']:.6g} N m at the crank, "
            f"{content['indicated_torque_nm']:.5g} N m indicated, peak {content['peak_pressure_mpa']:.4g} MPa"
        )
    else:
        print(
            f"{content['speed_rpm']:g} r/min, {content['torque_nm']:.6g} N m of the load at the motor"
        )
    by_number = dict(
        zip(content["node_numbers"], range(len(content["nodes"])), strict=True)
    )
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
        print_in_time(content)
    if "root_stress" in content:
        print_roots(content)
    if "sweep_energy_residual" in content:
        print_sweep(content)
