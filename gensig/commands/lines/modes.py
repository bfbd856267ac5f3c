"""``gensig modes``: natural modes of a single pair or of a drive line."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gensig.commands.figures.mode_figures import mode_figure
from gensig.commands.output import Answer, answered
from gensig.driveline.drive_line import DriveLine, drive_line_of_pair, read_drive_line
from gensig.driveline.linear.modal import Modes
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.options.configuration import Configuration
from gensig.systems.registry import LINE, read_system

SHOWN = 12  # modes in the summary
MOST_MOTIONS = 3  # of a mode in the summary
LEAST_SHARE = 0.05  # of the kinetic energy of a motion in the summary


@answered()
def modes(config: Configuration, _: Namespace) -> Answer:
    """Frequencies, damping, shapes and energy shares."""
    line = read_line(config)
    result = line.modes()
    content = modes_content(line, result)
    lines = _lines(line, result, content)
    return Answer(content, lines, lambda: mode_figure(line, result))


def read_line(config: Configuration) -> DriveLine:
    """The drive line of a configuration; a single pair becomes one of two nodes and more."""
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: modes are those of healthy teeth at mean "
            "stiffness; take fault=healthy"
        )
    kind = config.section("system").get("kind")
    if kind == LINE:
        return read_drive_line(config)
    return drive_line_of_pair(read_system(config), str(kind))


def modes_content(line: DriveLine, modes: Modes) -> dict[str, Any]:
    """The keys of ``gensig modes --json``."""
    matrices, tables = line.matrices(), line.line
    by_node = np.zeros((len(modes.frequency), len(tables.nodes)))
    np.add.at(by_node.T, matrices.coordinate_node, modes.kinetic_share.T)
    gears = tables.gears
    return {
        "system": line.name,
        "lateral": line.lateral,
        "nodes": [node.name for node in tables.nodes],
        "node_numbers": line.numbers,
        "speed_ratio": tables.speed_ratio,
        "degrees_of_freedom": matrices.names,
        "meshes": [
            f"{gears[mesh.driving].name} / {gears[mesh.driven].name}"
            for mesh in tables.meshes
        ],
        "mesh_stiffness_n_per_m": matrices.mesh_stiffness,
        "mesh_orders": line.mesh_orders,
        "n_rigid_modes": modes.n_rigid,
        "n_loops": tables.n_loops,
        "natural_frequencies_hz": modes.frequency,
        "damping_ratio": modes.damping_ratio,
        "shapes": modes.shapes / np.abs(modes.shapes).max(axis=1, keepdims=True),
        "kinetic_energy_share": by_node,
        "mesh_strain_energy_share": modes.mesh_strain_share,
    }


def _sizes(line: DriveLine, content: Mapping[str, Any]) -> str:
    n_nodes = len(line.line.nodes)
    n_lateral = len(line.matrices().coordinate_names) - n_nodes
    counts = {
        "inertias": n_nodes,
        "lateral motions of gears (y along the line of action, x across it)": n_lateral,
        "shafts": len(line.line.shafts),
        "mesh(es)": len(line.line.meshes),
        "loops": content["n_loops"],
        "rigid mode(s)": content["n_rigid_modes"],
    }
    sizes = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    return f"{content['system']}: {sizes}"


def _lines(line: DriveLine, modes: Modes, content: Mapping[str, Any]) -> Iterator[str]:
    """Sizes, and the lowest modes with the motions that have most of the kinetic energy."""
    yield _sizes(line, content)
    motions, n_nodes = list(line.matrices().coordinate_names), len(line.line.nodes)
    if len(motions) > n_nodes:
        motions[:n_nodes] = [f"{name} rotation" for name in motions[:n_nodes]]
    frequencies = content["natural_frequencies_hz"]
    yield f"{'mode':>4} {'Hz':>10} {'damping':>8}  kinetic energy"
    for mode, frequency in enumerate(frequencies[:SHOWN]):
        share = modes.kinetic_share[mode]
        largest = np.argsort(-share, kind="stable")[:MOST_MOTIONS]
        text = ", ".join(
            f"{share[index]:.0%} {motions[index]}"
            for index in largest
            if share[index] > LEAST_SHARE
        )
        strain = max(content["mesh_strain_energy_share"][mode], default=0.0)
        if frequency == 0.0:
            text += "; turns freely"
        elif strain > 0.5:
            text += f"; {strain:.0%} of the strain in a mesh"
        damping = content["damping_ratio"][mode]
        yield f"{mode:>4} {frequency:>10.2f} {damping:>8.4f}  {text}"
    n_more = len(frequencies) - SHOWN
    if n_more > 0:
        yield (
            f"and {n_more} more, up to {frequencies[-1]:.0f} Hz; --json FILE has them all"
        )
