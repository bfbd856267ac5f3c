"""The verb modes: natural modes of a single pair or of a drive line."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.output import check_outputs, write_outputs
from gensig.commands.request import read_configuration
from gensig.driveline.drive_line import DriveLine, drive_line_of_pair, read_drive_line
from gensig.driveline.linear.modal import Modes
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.options.configuration import Configuration
from gensig.systems.registry import LINE, read_system

SHOWN = 12  # modes in the summary


def modes(arguments: Namespace) -> int:
    """Natural frequencies, damping ratios, shapes and energy shares.

    JSON, a figure, or a summary.
    """
    check_outputs(arguments)
    config = read_configuration(arguments)
    line = read_line(config)
    found = line.modes()
    content = modes_content(line, found)

    def draw(path: Path) -> None:
        from gensig.commands.figures.mode_figures import plot_modes

        plot_modes(line, found, path)

    write_outputs(arguments, content, draw)
    _print_modes(line, found, content)
    return 0


def read_line(config: Configuration) -> DriveLine:
    """The drive line of a configuration.

    A single pair is one of two nodes, or more with a motor and a load.
    """
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: modes are those of sound teeth at mean stiffness; take fault=healthy"
        )
    kind = config.section("system").get("kind")
    if kind == LINE:
        return read_drive_line(config)
    return drive_line_of_pair(read_system(config), str(kind))


def modes_content(line: DriveLine, found: Modes) -> dict[str, Any]:
    """The keys of ``gensig modes --json``."""
    matrices, nodes = line.matrices(), line.line.nodes
    by_node = np.zeros((len(found.frequency), len(nodes)))
    np.add.at(by_node.T, matrices.coordinate_node, found.kinetic_share.T)
    shapes = found.shapes / np.abs(found.shapes).max(axis=1, keepdims=True)
    return {
        "system": line.name,
        "lateral": line.lateral,
        "nodes": [node.name for node in nodes],
        "node_numbers": list(line.numbers),
        "speed_ratio": line.line.speed_ratio.tolist(),
        "degrees_of_freedom": list(matrices.names),
        "meshes": mesh_names(line),
        "mesh_stiffness_n_per_m": matrices.mesh_stiffness.tolist(),
        "mesh_orders": list(line.mesh_orders),
        "n_rigid_modes": found.n_rigid,
        "n_loops": line.line.n_loops,
        "natural_frequencies_hz": found.frequency.tolist(),
        "damping_ratio": found.damping_ratio.tolist(),
        "shapes": shapes.tolist(),
        "kinetic_energy_share": by_node.tolist(),
        "mesh_strain_energy_share": found.mesh_strain_share.tolist(),
    }


def mesh_names(line: DriveLine) -> list[str]:
    """Names of the two gears of every mesh."""
    gears = line.line.gears
    return [
        f"{gears[mesh.driving].name} / {gears[mesh.driven].name}"
        for mesh in line.line.meshes
    ]


def _print_modes(line: DriveLine, found: Modes, content: Mapping[str, Any]) -> None:
    """The lowest modes, each with the motions that have most of the kinetic energy, and where a
    mesh is the spring.
    """
    matrices, n_nodes = line.matrices(), len(line.line.nodes)
    n_lateral = len(matrices.coordinate_names) - n_nodes
    counts = {
        "inertias": n_nodes,
        "lateral motions of gears (y along the line of action, x across it)": n_lateral,
        "shafts": len(line.line.shafts),
        "mesh(es)": len(line.line.meshes),
        "loops": content["n_loops"],
        "rigid mode(s)": content["n_rigid_modes"],
    }
    print(
        f"{content['system']}: "
        + ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    )
    motions = [
        f"{name} rotation" if n_lateral and k < n_nodes else name
        for k, name in enumerate(matrices.coordinate_names)
    ]
    print(f"{'mode':>4} {'Hz':>10} {'damping':>8}  kinetic energy")
    for mode, frequency in enumerate(content["natural_frequencies_hz"][:SHOWN]):
        share = found.kinetic_share[mode]
        most = [
            place
            for place in np.argsort(-share, kind="stable")[:3]
            if share[place] > 0.05
        ]
        where = ", ".join(f"{share[place]:.0%} {motions[place]}" for place in most)
        strain = max(content["mesh_strain_energy_share"][mode], default=0.0)
        where += (
            "; turns freely"
            if frequency == 0.0
            else f"; {strain:.0%} of the strain in a mesh"
            if strain > 0.5
            else ""
        )
        print(
            f"{mode:>4} {frequency:>10.2f} {content['damping_ratio'][mode]:>8.4f}  {where}"
        )
    if len(content["natural_frequencies_hz"]) > SHOWN:
        last = content["natural_frequencies_hz"][-1]
        print(
            f"and {len(content['natural_frequencies_hz']) - SHOWN} more, up to {last:.0f} Hz; --json FILE has them all"
        )
