"""``gensig tune-damper``: torsional dampers that make the worst tooth force of a mesh least."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import yaml

from gensig.arrays import Array
from gensig.commands.console import step
from gensig.commands.figures.damper_figure import damper_figure
from gensig.commands.lines.results import (
    RPM,
    DamperState,
    spaced,
    speed_steps,
    strength_content,
)
from gensig.commands.output import Answer, answered
from gensig.driveline.engine_dampers import (
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
    response_for_dampers,
    tooth_load,
    with_further_dampers,
)
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.linear.damper_tuning import tune_dampers
from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration
from gensig.systems.root_strength import RootStrength
from gensig.units import from_si, to_si

GROUP = "system"
DIGITS = 4  # of the sizes that are written, and judged
DEFAULT_STEP = 25.0  # r/min
# label, JSON key of a state, format
ROWS = (
    ("worst force over the range, N", "worst_force_n", ".0f"),
    ("at the reference: least, N", "least_force_n", ".0f"),
    ("greatest, N", "greatest_force_n", ".0f"),
    ("root stress, ISO 6336-3, MPa", "iso_root_stress_mpa", ".2f"),
    ("largest over the mesh, MPa", "largest_root_stress_mpa", ".2f"),
    ("safety, paper", "safety_factor_paper", ".3f"),
    ("reliability, paper", "reliability_paper", ""),
    ("safety, ISO 6336-3", "safety_factor_iso", ".3f"),
)


@answered(group=GROUP)
def tune_damper(config: Configuration, arguments: Namespace) -> Answer:
    """The best dampers, forces and stress before and after, and the line with them as an option."""
    line = read_engine_line(config)
    if line.engine.pressure_decides_torque:
        raise ConfigError(
            "excitation.pressure.file is of one operating point; "
            "tune-damper runs over a range of speeds"
        )
    mesh = mesh_between(line, arguments.mesh)
    nodes = tuple(arguments.nodes or arguments.mesh)
    speeds = _speeds(line, arguments.run)
    torque = arguments.torque
    if torque is None:
        torque = line.engine.reference.torque
    seen = response_for_dampers(line, mesh, nodes, speeds, torque)
    most = [arguments.most_inertia] * len(nodes)
    if arguments.most_inertia is None:
        drive = line.drive
        most = [drive.line.nodes[drive.numbers.index(node)].inertia for node in nodes]
    names = ", ".join(map(str, nodes))
    step(f"searching for dampers on nodes {names}; this takes a minute")
    result = tune_dampers(seen, most, viscous=arguments.viscous, seed=arguments.seed)
    dampers = tuple(_rounded(damper) for damper in result)
    strength = read_mesh_strength(config, line, mesh)
    damped = with_further_dampers(line, dampers)
    states = {
        "before": _state(line, mesh, strength, torque, seen.largest_force(())),
        "after": _state(damped, mesh, strength, torque, seen.largest_force(dampers)),
    }
    content = tuning_content(states, dampers, mesh, speeds, torque)
    return Answer(
        content,
        _lines(content),
        lambda: damper_figure(states, dampers, mesh, speeds),
        lambda: option_text(config[GROUP], dampers, content),
    )


def tuning_content(
    states: Mapping[str, DamperState],
    dampers: Sequence[TorsionalDamper],
    mesh: int,
    speeds: Array,
    torque: float,
) -> dict[str, Any]:
    """The keys of ``gensig tune-damper --json``."""
    before, after = states["before"], states["after"]
    return {
        "mesh": before.line.mesh_names[mesh],
        "torque_nm": torque,
        "dampers": [_keys(damper) for damper in dampers],
        "run_speeds_rpm": RPM * speeds,
        "reference_speed_rpm": from_si("speed_rpm", before.load.speed),
        **{name: _state_content(state) for name, state in states.items()},
        "largest_force_drop": 1.0 - after.largest.max() / before.largest.max(),
        "root_stress_drop": 1.0 - after.load.greatest / before.load.greatest,
    }


def option_text(
    machine: Mapping[str, Any],
    dampers: Sequence[TorsionalDamper],
    content: Mapping[str, Any],
) -> str:
    """The whole machine as YAML for the group ``system``, new dampers behind its own."""
    speeds = content["run_speeds_rpm"]
    worst = {name: content[name]["worst_force_n"] for name in ("before", "after")}
    head = (
        f"# Dampers by gensig tune-damper: worst force of mesh {content['mesh']} "
        f"from {speeds[0]:g} to {speeds[-1]:g} r/min at {content['torque_nm']:g} N m\n"
        f"# {worst['before']:.0f} N without them, {worst['after']:.0f} N with them, "
        "of a mesh that never parts.\n"
    )
    all_dampers = [*machine["dampers"], *(_keys(damper) for damper in dampers)]
    values = {**machine, "dampers": all_dampers}
    return head + yaml.safe_dump(
        values, sort_keys=False, default_flow_style=None, width=110
    )


def _speeds(line: EngineLine, run: Sequence[float] | None) -> Array:
    """Speeds of the crank, rad/s: as given, or the range of the Campbell diagram."""
    campbell = line.drive.campbell
    low = from_si("speed_rpm", campbell.low_speed)
    high = from_si("speed_rpm", campbell.high_speed)
    steps = speed_steps(run or (low, high, DEFAULT_STEP))
    return np.asarray(to_si("speed_rpm", 1.0) * spaced(*steps))


def _rounded(damper: TorsionalDamper) -> TorsionalDamper:
    """The damper with its sizes as they are written."""
    sizes: dict[str, Any] = {
        name: float(f"{getattr(damper, name):.{DIGITS}g}")
        for name in ("ring_inertia", "damping", "stiffness")
    }
    return replace(damper, **sizes)


def _keys(damper: TorsionalDamper) -> dict[str, Any]:
    return {
        "node": damper.node,
        "ring_inertia_kg_m2": damper.ring_inertia,
        "damping_nms_per_rad": damper.damping,
        "stiffness_nm_per_rad": damper.stiffness,
    }


def _state(
    line: EngineLine, mesh: int, strength: RootStrength, torque: float, largest: Array
) -> DamperState:
    response = line.response(line.engine.reference.speed, torque)
    load = tooth_load(line, mesh, response)
    root = dynamic_root_stress(strength, line, mesh, load)
    return DamperState(
        line=line, largest=largest, response=response, load=load, root=root
    )


def _state_content(state: DamperState) -> dict[str, Any]:
    root, drive = state.root, state.line.drive
    largest = float(root.history.stress[root.strength.decisive].max())
    half = RPM * state.response.fluctuation()
    return {
        "largest_force_n": state.largest,
        "worst_force_n": state.largest.max(),
        "least_force_n": state.load.force.min(),
        "greatest_force_n": state.load.greatest,
        **strength_content(root),
        "largest_root_stress_mpa": from_si("stress_mpa", largest),
        "speed_fluctuation_rpm": {
            str(drive.numbers[gear.node]): half[gear.node] for gear in drive.line.gears
        },
    }


def _lines(content: Mapping[str, Any]) -> Iterator[str]:
    for damper in content["dampers"]:
        yield (
            f"node {damper['node']:>3}: ring {damper['ring_inertia_kg_m2']:g} kg m2, "
            f"{damper['damping_nms_per_rad']:g} N m s/rad, "
            f"{damper['stiffness_nm_per_rad']:g} N m/rad"
        )
    head = f"mesh {content['mesh']}, {content['torque_nm']:g} N m at the crank"
    before, after = content["before"], content["after"]
    yield f"{head:<36}{'before':>12}{'after':>12}"
    for label, key, form in ROWS:
        yield f"{label:<36}{before[key]:>12{form}}{after[key]:>12{form}}"
