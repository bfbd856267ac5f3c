"""``gensig forced-response``: vibration of a drive line under its engine or motor."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.commands.figures.line_figures import response_figure
from gensig.commands.lines.engine_in_time import (
    WITHOUT,
    root_content,
    root_lines,
    simulate_sweep,
    simulate_time,
    sweep_content,
    sweep_lines,
    time_content,
    time_lines,
)
from gensig.commands.lines.results import RPM, ResponseResult, spaced, speed_steps
from gensig.commands.output import Answer, answered, columns, plain
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
from gensig.driveline.in_time import read_tooth_law
from gensig.driveline.linear.forced import (
    Waterfall,
    disturbance_response,
    over_cycle,
    run_of_speeds,
)
from gensig.driveline.teeth import ToothLaw
from gensig.driveline.time_root_stress import root_stress_in_time
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.systems.root_strength import RootStrength
from gensig.units import from_si, to_si

CYCLE_POINTS = 5760
RUN_ORDERS = 80  # half orders of a run: up to order 40


@answered()
def forced_response(config: Configuration, arguments: Namespace) -> Answer:
    """Speed fluctuation, spectra and tooth forces."""
    line = read_engine_line(config)
    result = _steady(line, arguments, config.seed)
    in_time = arguments.time is not None or arguments.sweep is not None
    if in_time and line.engine.pressure_decides_torque:
        raise ConfigError(
            "excitation.pressure.file decides the torque; leave --time and --sweep out"
        )
    if arguments.time is not None:
        result = _with_time(result, line, read_tooth_law(config), arguments.time)
    if arguments.mesh is not None:
        mesh = mesh_between(line, arguments.mesh)
        strength = read_mesh_strength(config, line, mesh)
        roots = _roots(strength, line, mesh, result)
        if config["system"]["dampers"]:
            bare = read_engine_line(config.with_keys("system", dampers=[]))
            torques = result.torques
            response = bare.response(torques.speed, torques.brake_torque)
            undamped = replace(result, response=response, in_time=None)
            if arguments.time is not None:
                undamped = _with_time(
                    undamped, bare, read_tooth_law(config), arguments.time
                )
            of_bare = _roots(strength, bare, mesh, undamped)
            roots |= {f"{name}{WITHOUT}": root for name, root in of_bare.items()}
        result = replace(result, mesh=mesh, roots=roots)
    if arguments.sweep is not None:
        sweep = simulate_sweep(
            line,
            read_tooth_law(config),
            result.nodes,
            arguments.sweep,
            arguments.run_torque,
            RUN_ORDERS,
        )
        result = replace(result, sweep=sweep)
    content = response_content(line, result)
    return Answer(content, _lines(content), lambda: response_figure(line, result))


def response_content(line: EngineLine, result: ResponseResult) -> dict[str, Any]:
    """The keys of ``gensig forced-response --json``."""
    response, torques = result.response, result.torques
    numbers = line.drive.numbers
    shown = [numbers.index(node) for node in result.nodes]
    linear, meshes = line.linear()
    mean, amplitudes = response.element_forces(meshes)
    forces = mean[:, None] + over_cycle(amplitudes, CYCLE_POINTS)
    rpm = from_si("speed_rpm", response.speed)
    content: dict[str, Any] = {
        "speed_rpm": rpm,
        "torque_nm": torques.brake_torque,
        "node_numbers": numbers,
        "nodes": [node.name for node in line.drive.line.nodes],
        "mean_speed_rpm": [line.ratios[number] * rpm for number in numbers],
        "speed_fluctuation_rpm": RPM * response.fluctuation()[: len(numbers)],
        "toothed_wheel_fluctuation_rpm": {
            name: from_si("speed_rpm", value) for name, value in result.seen.items()
        },
        "orders": response.orders,
        "shown_nodes": result.nodes,
        "angle_deg": np.degrees(np.abs(response.angle[shown])),
        "meshes": line.mesh_names,
        "mean_tooth_force_n": mean,
        "least_tooth_force_n": forces.min(axis=1),
        "greatest_tooth_force_n": forces.max(axis=1),
    }
    if isinstance(torques, EngineTorques):
        peak = from_si("pressure_mpa", float(torques.pressure.max()))
        content["indicated_torque_nm"] = torques.indicated_torque
        content["peak_pressure_mpa"] = peak
        if torques.disturbance_torque:
            hz = torques.disturbance_frequency
            moved = disturbance_response(
                linear,
                numbers.index(torques.disturbance_node),
                torques.disturbance_torque,
                2.0 * np.pi * hz,
            )
            content["disturbance_frequency_hz"] = hz
            content["disturbance_angle_deg"] = np.degrees(np.abs(moved[shown]))
    if result.in_time is not None:
        content |= time_content(result.in_time)
    if result.sweep is not None:
        content |= sweep_content(result.sweep)
    if result.mesh is not None:
        content["root_stress_mesh"] = line.mesh_names[result.mesh]
        content["root_stress"] = {
            name: root_content(line, result.mesh, root)
            for name, root in result.roots.items()
        }
    if result.run:
        content["run_speeds_rpm"] = RPM * result.run[0].speeds
        content["run_speed_fluctuation_rpm"] = [
            RPM * run.fluctuation for run in result.run
        ]
        content["run_angle_deg"] = [np.degrees(run.angle) for run in result.run]
    return {key: plain(value) for key, value in content.items()}


def _with_time(
    result: ResponseResult, line: EngineLine, law: ToothLaw, duration: float
) -> ResponseResult:
    """The result with its operating point integrated in time."""
    response = simulate_time(line, law, result.torques, result.nodes, duration)
    return replace(result, in_time=response)


def _roots(
    strength: RootStrength, line: EngineLine, mesh: int, result: ResponseResult
) -> dict[str, DynamicRootStress]:
    """Root stress of a mesh, by the method that its forces are of."""
    load = tooth_load(line, mesh, result.response)
    roots = {"linear": dynamic_root_stress(strength, line, mesh, load)}
    if result.in_time is not None:
        roots["in_time"] = root_stress_in_time(strength, line, mesh, result.in_time)
    return roots


def _steady(line: EngineLine, arguments: Namespace, seed: int) -> ResponseResult:
    """Steady vibration at the operating point, and the run of speeds that is asked for."""
    speed, torque = _operating_point(line, arguments)
    nodes = _shown_nodes(line, arguments.nodes)
    torques = line.torques(speed, torque)
    run: Sequence[Waterfall] = ()
    if arguments.run is not None:
        run = _run(line, nodes, arguments.run, arguments.run_torque)
    response, rng = line.response(speed, torque), np.random.default_rng(seed)
    seen = {
        name: 0.5 * float(np.ptp(line.seen_by(wheel, response, rng)))
        for name, wheel in line.wheels.items()
    }
    return ResponseResult(
        torques=torques, response=response, seen=seen, nodes=nodes, run=tuple(run)
    )


def _operating_point(
    line: EngineLine, arguments: Namespace
) -> tuple[float, float | None]:
    """Speed in rad/s and brake torque; no torque where a measured pressure decides it."""
    reference = line.engine.reference
    speed, torque = reference.speed, reference.torque
    if arguments.speed is not None:
        speed = to_si("speed_rpm", arguments.speed)
    if not line.engine.pressure_decides_torque:
        if arguments.torque is not None:
            torque = arguments.torque
        return speed, torque
    if arguments.torque is not None or arguments.run is not None:
        raise ConfigError(
            "excitation.pressure.file decides the torque; leave --torque and --run out"
        )
    return speed, None


def _shown_nodes(line: EngineLine, given: Sequence[int] | None) -> tuple[int, ...]:
    """The nodes that are asked for, else those with toothed wheels, else both ends."""
    with_wheels = [wheel.node for wheel in line.wheels.values()]
    ends = (line.engine.driving_nodes[0], line.engine.load_node)
    nodes = tuple(given or with_wheels or ends)
    for node in nodes:
        if node not in line.ratios:
            first, last = min(line.ratios), max(line.ratios)
            raise ConfigError(
                f"--nodes {node}: the shaft line has no such node; it has {first} to {last}"
            )
    return nodes


def _run(
    line: EngineLine, nodes: Sequence[int], given: Sequence[float], run_torque: float
) -> list[Waterfall]:
    """Waterfalls of the nodes over a run of speeds."""
    if isinstance(line.engine, MotorDrive) and line.engine.ripple is None:
        raise ConfigError(
            "--run: a line whose meshes never part turns evenly without "
            "excitation.motor.torque_ripple; give one, or take --sweep"
        )
    low, high, step = (to_si("speed_rpm", value) for value in speed_steps(given))
    linear, _ = line.linear()
    indices = [line.drive.numbers.index(node) for node in nodes]

    def torques_at(speed: float) -> Array:
        load = line.load_at(run_torque, speed / line.engine.reference.speed)
        return line.on_line(line.torques(speed, load))

    speeds = spaced(low, high, step)
    return run_of_speeds(linear, torques_at, speeds, indices, n_orders=RUN_ORDERS)


def _lines(content: dict[str, Any]) -> Iterator[str]:
    point = f"{content['speed_rpm']:g} r/min, {content['torque_nm']:.6g} N m"
    if "indicated_torque_nm" in content:
        indicated, peak = content["indicated_torque_nm"], content["peak_pressure_mpa"]
        yield (
            f"{point} at the crank, {indicated:.5g} N m indicated, peak {peak:.4g} MPa"
        )
    else:
        yield f"{point} of the load at the motor"
    keys = "node_numbers", "nodes", "mean_speed_rpm", "speed_fluctuation_rpm"
    nodes = columns(content, *keys)
    rows = {number: row for number, *row in nodes}
    for number in content["shown_nodes"]:
        name, mean, half = rows[number]
        yield f"  node {number:>3} {name:<34} {mean:8.1f} r/min +- {half:.2f}"
    for name, value in content["toothed_wheel_fluctuation_rpm"].items():
        yield f"  toothed wheel {name} shows +- {value:.2f} r/min"
    ends = "least_tooth_force_n", "mean_tooth_force_n", "greatest_tooth_force_n"
    forces = columns(content, "meshes", *ends)
    for name, low, mean, high in forces:
        line = f"  mesh {name:>6} {low:9.0f} .. {high:.0f} N, mean {mean:.0f} N"
        if min(low * mean, high * mean) < 0.0:
            line += " (would part)"
        yield line
    if "time_energy_residual" in content:
        yield from time_lines(content)
    if "root_stress" in content:
        yield from root_lines(content)
    if "sweep_energy_residual" in content:
        yield from sweep_lines(content)
