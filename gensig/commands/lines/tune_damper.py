"""The verb tune-damper.

Torsional dampers that make the worst tooth force of an engine's mesh least.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from gensig.commands.lines.forced_response import MOST_SPEEDS
from gensig.commands.lines.results import DamperState
from gensig.commands.output import (
    check_outputs,
    option_file,
    write_option,
    write_outputs,
)
from gensig.commands.request import read_configuration
from gensig.driveline.engine_dampers import (
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
    seen_by_dampers,
    tooth_load,
    with_own_dampers,
)
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.linear.damper_tuning import tune_dampers
from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.errors import ConfigError
from gensig.life.root.strength import reliability
from gensig.systems.root_strength import RootStrength
from gensig.units import from_si, to_si

GROUP = "system"
DIGITS = 4  # of the sizes that are written, and judged


def tune_damper(arguments: Namespace) -> int:
    """Search, write the line with its dampers as an option of the group ``system``, print both
    states.
    """
    check_outputs(arguments)
    target = option_file(arguments.out, GROUP, force=arguments.force)
    config = read_configuration(arguments)
    line = read_engine_line(config)
    if line.engine.pressure_decides_torque:
        raise ConfigError(
            "excitation.pressure.file is of one operating point; tune-damper runs over a range of speeds"
        )
    mesh, nodes = (
        mesh_between(line, arguments.mesh),
        tuple(arguments.nodes or arguments.mesh),
    )
    speeds = _speeds(line, arguments.run)
    reference = line.engine.reference
    torque = reference.torque if arguments.torque is None else arguments.torque
    seen = seen_by_dampers(line, mesh, nodes, speeds, torque)
    own = {
        number: node.inertia
        for number, node in zip(line.drive.numbers, line.drive.line.nodes, strict=True)
    }
    most = [
        own[node] if arguments.most_inertia is None else arguments.most_inertia
        for node in nodes
    ]
    print(
        f"searching for dampers on nodes {', '.join(map(str, nodes))}; this takes a minute",
        file=sys.stderr,
    )
    found = tune_dampers(seen, most, viscous=arguments.viscous, seed=arguments.seed)
    dampers = tuple(_rounded(one) for one in found)
    strength = read_mesh_strength(config, line, mesh)
    states = {
        name: _state(one, mesh, strength, torque, seen.largest_force(added))
        for name, one, added in (
            ("before", line, ()),
            ("after", with_own_dampers(line, dampers), dampers),
        )
    }
    content = tuning_content(states, dampers, mesh, speeds, torque)

    def draw(path: Path) -> None:
        from gensig.commands.figures.damper_figure import plot_dampers

        plot_dampers(states, dampers, mesh, speeds, path)

    write_outputs(arguments, content, draw)
    _print(content)
    write_option(target, option_text(config[GROUP], dampers, content))
    return 0


def tuning_content(
    states: Mapping[str, DamperState],
    dampers: Sequence[TorsionalDamper],
    mesh: int,
    speeds: NDArray[np.float64],
    torque: float,
) -> dict[str, Any]:
    """The keys of ``gensig tune-damper --json``."""
    before = states["before"]
    return {
        "mesh": before.line.mesh_names[mesh],
        "torque_nm": torque,
        "dampers": [_keys(one) for one in dampers],
        "run_speeds_rpm": (from_si("speed_rpm", 1.0) * speeds).tolist(),
        "reference_speed_rpm": from_si("speed_rpm", before.load.speed),
        **{name: _state_content(state) for name, state in states.items()},
        "largest_force_drop": 1.0
        - float(states["after"].largest.max() / before.largest.max()),
        "root_stress_drop": 1.0 - states["after"].load.greatest / before.load.greatest,
    }


def option_text(
    machine: Mapping[str, Any],
    dampers: Sequence[TorsionalDamper],
    content: Mapping[str, Any],
) -> str:
    """The whole machine as YAML that the group ``system`` takes, the new dampers behind those
    that it had.
    """
    low, high = content["run_speeds_rpm"][0], content["run_speeds_rpm"][-1]
    head = (
        f"# Dampers by gensig tune-damper: worst force of mesh {content['mesh']} from {low:g} to {high:g} r/min at "
        f"{content['torque_nm']:g} N m\n# {content['before']['worst_force_n']:.0f} N without them, "
        f"{content['after']['worst_force_n']:.0f} N with them, of a mesh that never parts.\n"
    )
    values = {
        **machine,
        "dampers": [*machine["dampers"], *(_keys(one) for one in dampers)],
    }
    return head + yaml.safe_dump(
        values, sort_keys=False, default_flow_style=None, width=110
    )


def _speeds(line: EngineLine, run: Sequence[float] | None) -> NDArray[np.float64]:
    """Speeds of the crank, rad/s: as given, or the range of the Campbell diagram in 25 r/min."""
    campbell = line.drive.campbell
    given = run or (
        from_si("speed_rpm", campbell.low_speed),
        from_si("speed_rpm", campbell.high_speed),
        25.0,
    )
    low, high, step = given
    if not (0.0 < low < high and step > 0.0 and (high - low) / step < MOST_SPEEDS):
        text = " ".join(f"{value:g}" for value in given)
        raise ConfigError(
            f"--run {text}: give low, high and step in r/min, fewer than {MOST_SPEEDS} speeds"
        )
    return np.asarray(to_si("speed_rpm", 1.0) * np.arange(low, high + 0.5 * step, step))


def _rounded(damper: TorsionalDamper) -> TorsionalDamper:
    """Sizes as they are written."""
    sizes = (damper.ring_inertia, damper.damping, damper.stiffness)
    inertia, damping, stiffness = (float(f"{value:.{DIGITS}g}") for value in sizes)
    return TorsionalDamper(
        node=damper.node, ring_inertia=inertia, damping=damping, stiffness=stiffness
    )


def _keys(damper: TorsionalDamper) -> dict[str, Any]:
    return {
        "node": damper.node,
        "ring_inertia_kg_m2": damper.ring_inertia,
        "damping_nms_per_rad": damper.damping,
        "stiffness_nm_per_rad": damper.stiffness,
    }


def _state(
    line: EngineLine,
    mesh: int,
    strength: RootStrength,
    torque: float,
    largest: NDArray[np.float64],
) -> DamperState:
    response = line.response(line.engine.reference.speed, torque)
    load = tooth_load(line, mesh, response)
    root = dynamic_root_stress(strength, line, mesh, load)
    return DamperState(
        line=line, largest=largest, response=response, load=load, root=root
    )


def _state_content(state: DamperState) -> dict[str, Any]:
    root = state.root
    name = root.strength.decisive
    gear, driven = root.gears[name], state.line.drive.line.gears
    passes = root.passes[name]
    half = from_si("speed_rpm", 1.0) * state.response.fluctuation()
    numbers = state.line.drive.numbers
    return {
        "largest_force_n": state.largest.tolist(),
        "worst_force_n": float(state.largest.max()),
        "least_force_n": float(state.load.force.min()),
        "greatest_force_n": state.load.greatest,
        "decisive_gear": name,
        "iso_root_stress_mpa": from_si("stress_mpa", gear.stress),
        "largest_root_stress_mpa": from_si(
            "stress_mpa", float(root.history.stress[name].max())
        ),
        "roll_angle_deg": np.degrees(
            root.history.roll / root.strength.pair.pinion.base_radius
        ).tolist(),
        "root_stress_mpa": (
            from_si("stress_mpa", 1.0) * passes[int(passes.max(axis=1).argmax())]
        ).tolist(),
        "safety_factor_paper": gear.safety.paper,
        "reliability_paper": reliability(gear.safety.paper),
        "safety_factor_iso": gear.safety.iso,
        "speed_fluctuation_rpm": {
            str(numbers[one.node]): float(half[one.node]) for one in driven
        },
    }


def _print(content: Mapping[str, Any]) -> None:
    for one in content["dampers"]:
        print(
            f"node {one['node']:>3}: ring {one['ring_inertia_kg_m2']:g} kg m2, "
            f"{one['damping_nms_per_rad']:g} N m s/rad, {one['stiffness_nm_per_rad']:g} N m/rad"
        )
    head = f"mesh {content['mesh']}, {content['torque_nm']:g} N m at the crank"
    print(f"{head:<36}{'before':>12}{'after':>12}")
    rows = (
        ("worst force over the range, N", "worst_force_n", ".0f"),
        ("at the reference: least, N", "least_force_n", ".0f"),
        ("greatest, N", "greatest_force_n", ".0f"),
        ("root stress, ISO 6336-3, MPa", "iso_root_stress_mpa", ".2f"),
        ("largest over the mesh, MPa", "largest_root_stress_mpa", ".2f"),
        ("safety, paper", "safety_factor_paper", ".3f"),
        ("reliability, paper", "reliability_paper", ""),
        ("safety, ISO 6336-3", "safety_factor_iso", ".3f"),
    )
    for label, key, form in rows:
        cells = "".join(
            f"{content[name][key]:>12{form}}" for name in ("before", "after")
        )
        print(f"{label:<36}{cells:>24}")
