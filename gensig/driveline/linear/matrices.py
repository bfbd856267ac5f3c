"""Matrices of a shaft line with its gear meshes apart.

Torsion alone, or with the lateral motion of the gears.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Integers
from gensig.driveline.linear.shaft_line import GearMesh, LineGear, ShaftLine
from gensig.dynamics.bodies import HOUSING, Bodies, Motion, Spring
from gensig.dynamics.pair import Support
from gensig.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class LineMatrices:
    """M q'' + C q' + K q + sum over meshes of direction x mesh force = f.

    Parameters
    ----------
    names : (dof,) a node or a compound (rotation, rad), ``<gear> x``, ``<gear> y`` (m)
    mass, damping, stiffness : (dof, dof) SI, without the meshes; damping is the viscous one only
    loss_stiffness : (dof, dof) N m/rad, loss factor times stiffness of the shafts
    directions : (mesh, dof) m per unit; gradient of a mesh's approach along its transverse line
        of action
    mesh_stiffness, mesh_damping, mesh_loss_factor, backlash : (mesh,) N/m, N s/m, 1, m
    rigid : (part, dof) motion of each elastic part that deforms no spring, in its speed ratios
    coordinate_names, coordinate_mass : (coordinate,) nodes and x and y of gears before merging
    expand : (coordinate, dof) coordinates = expand @ dof
    coordinate_node : (coordinate,) the node that each belongs to
    """

    names: tuple[str, ...]
    mass: Array
    damping: Array
    stiffness: Array
    loss_stiffness: Array
    directions: Array
    mesh_stiffness: Array
    mesh_damping: Array
    mesh_loss_factor: Array
    backlash: Array
    rigid: Array
    coordinate_names: tuple[str, ...]
    coordinate_mass: Array
    expand: Array
    coordinate_node: Integers

    @property
    def whole_stiffness(self) -> Array:
        """Stiffness with every mesh held at its own, (dof, dof)."""
        return (
            self.stiffness + (self.directions.T * self.mesh_stiffness) @ self.directions
        )

    @property
    def mesh_mass(self) -> Array:
        """Mass that each mesh accelerates along its line of action if all else is let go,
        (mesh,) kg.
        """
        return 1.0 / np.sum(self.directions**2 / np.diag(self.mass), axis=1)


@lru_cache(maxsize=32)
def line_matrices(
    line: ShaftLine, *, merge_rigid: bool = True, lateral: bool = False
) -> LineMatrices:
    """Matrices of a line, the same object for equal lines: its arrays must not be changed.

    Rigid compounds are one disc each, or the stiff springs that they are given as.

    Raises
    ------
    ConfigError    for lateral motion of a gear whose mass or support is not known
    """
    compounds = line.compounds(merge_rigid=merge_rigid)
    n_nodes, n_rotations = len(line.nodes), len(compounds)
    moving: tuple[LineGear, ...] = ()
    if lateral:
        moving = line.gears
    n_coordinates, n_dofs = n_nodes + 2 * len(moving), n_rotations + 2 * len(moving)
    expand = np.zeros((n_coordinates, n_dofs))
    for dof, nodes in enumerate(compounds):
        expand[list(nodes), dof] = 1.0
    expand[n_nodes:, n_rotations:] = np.eye(2 * len(moving))
    bodies = _bodies(line, moving)
    rotation = np.zeros((len(line.elastic_parts), n_coordinates))
    for row, nodes in zip(rotation, line.elastic_parts, strict=True):
        row[list(nodes)] = np.abs(line.speed_ratio[list(nodes)])
    gear_names = bodies.names[n_nodes:]
    compound_names = [
        " + ".join(line.nodes[n].name for n in nodes) for nodes in compounds
    ]
    return LineMatrices(
        names=(*compound_names, *gear_names),
        mass=expand.T @ np.diag(bodies.mass) @ expand,
        damping=expand.T @ bodies.damping @ expand,
        stiffness=expand.T @ bodies.stiffness @ expand,
        loss_stiffness=expand.T @ bodies.loss @ expand,
        directions=_directions(line, n_coordinates, lateral=lateral) @ expand,
        mesh_stiffness=np.array([mesh.stiffness for mesh in line.meshes]),
        mesh_damping=np.array([mesh.damping for mesh in line.meshes]),
        mesh_loss_factor=np.array([mesh.loss_factor for mesh in line.meshes]),
        backlash=np.array([mesh.backlash for mesh in line.meshes]),
        rigid=rotation @ expand / expand.sum(axis=0),
        coordinate_names=bodies.names,
        coordinate_mass=bodies.mass,
        expand=expand,
        coordinate_node=np.array(
            [*range(n_nodes), *(gear.node for gear in moving for _ in "xy")],
            dtype=np.int64,
        ),
    )


def _bodies(line: ShaftLine, moving: Sequence[LineGear]) -> Bodies:
    """Rotations of all nodes, then x and y of the moving gears, with shafts and supports."""
    motions = [Motion(node.name, node.inertia) for node in line.nodes]
    springs = [
        Spring(
            shaft.first,
            shaft.second,
            shaft.stiffness,
            shaft.damping,
            shaft.loss_factor * shaft.stiffness,
        )
        for shaft in line.shafts
        if shaft.stiffness is not None
    ]
    for gear in moving:
        held, x = _support(gear), len(motions)
        mass = gear.mass or 0.0
        motions += [Motion(f"{gear.name} {axis}", mass) for axis in "xy"]
        springs += [
            Spring(x, HOUSING, held.stiffness_x, held.damping_x),
            Spring(x + 1, HOUSING, held.stiffness_y, held.damping_y),
        ]
    return Bodies(motions=tuple(motions), springs=tuple(springs))


def _support(gear: LineGear) -> Support:
    """Support of a gear with lateral motion."""
    if gear.mass is None or gear.support is None:
        raise ConfigError(f"{gear.name}: its lateral motion needs a mass and a support")
    if min(gear.support.stiffness_x, gear.support.stiffness_y) <= 0.0:
        raise ConfigError(
            f"{gear.name}: its support needs stiffness along both axes, else it floats away"
        )
    return gear.support


def _directions(line: ShaftLine, n_coordinates: int, *, lateral: bool) -> Array:
    """Gradient of the approach of every mesh, (mesh, coordinate)."""
    frames = _frames(line)
    directions = np.zeros((len(line.meshes), n_coordinates))
    for row, mesh in zip(directions, line.meshes, strict=True):
        for number, sign in ((mesh.driving, 1.0), (mesh.driven, -1.0)):
            gear = line.gears[number]
            row[gear.node] = sign * gear.base_radius
            if lateral:
                turn = _line_of_action(line, mesh) - frames[number]
                x = len(line.nodes) + 2 * number
                row[x : x + 2] += sign * math.sin(turn), -sign * math.cos(turn)
    return directions


def _line_of_action(line: ShaftLine, mesh: GearMesh) -> float:
    """Angle of the direction in which the driving tooth pushes.

    Off the common tangent by the pressure angle, rad.
    """
    sense = math.copysign(1.0, line.speed_ratio[line.gears[mesh.driving].node])
    return mesh.center_line + sense * (0.5 * math.pi - mesh.pressure_angle)


def _frames(line: ShaftLine) -> dict[int, float]:
    """Direction of each gear's frame, in which the driving tooth of its first mesh pushes, rad.

    Its y points against it and its x is across, y turned back by a right angle, as in the
    equations of the single pair.
    """
    frames = dict.fromkeys(range(len(line.gears)), 0.0)
    for mesh in reversed(line.meshes):
        frames[mesh.driving] = frames[mesh.driven] = _line_of_action(line, mesh)
    return frames
