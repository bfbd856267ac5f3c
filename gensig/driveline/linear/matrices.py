"""The matrices of a shaft line, torsion alone or with the lateral motion of its gears, the gear
meshes apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.linear.shaft_line import GearMesh, ShaftLine
from gensig.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class LineMatrices:
    """M q'' + C q' + K q + sum over meshes of direction x mesh force = f: plain arrays, the
    meshes apart.

    Parameters
    ----------
    names : of the degrees of freedom: a node or a compound (rotation, rad), ``<gear> x``, ``<gear> y`` (m)
    mass, damping, stiffness : (dof, dof) SI, without the meshes; damping is the viscous one only
    loss_stiffness : (dof, dof) N m/rad, loss factor times stiffness of the shafts
    directions : (mesh, dof) gradient of the approach of a mesh along its transverse line of action, m per unit
    mesh_stiffness, mesh_damping, mesh_loss_factor, backlash : (mesh,) N/m, N s/m, 1, m
    rigid : (part, dof) the motion of each elastic part that deforms no spring, in the ratios of its speeds
    coordinate_names, coordinate_mass : (coordinate,) every node and every gear's x and y before merging
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
    coordinate_node: NDArray[np.int64]

    @property
    def whole_stiffness(self) -> Array:
        """Stiffness with every mesh held at its own, (dof, dof)."""
        return (
            self.stiffness + (self.directions.T * self.mesh_stiffness) @ self.directions
        )

    @property
    def mesh_mass(self) -> Array:
        """What each mesh has to accelerate along its line of action if all else is let go,
        (mesh,) kg.
        """
        return 1.0 / np.sum(self.directions**2 / np.diag(self.mass), axis=1)


def line_matrices(
    line: ShaftLine, *, merge_rigid: bool = True, lateral: bool = False
) -> LineMatrices:
    """Matrices of a line, with its rigid compounds as one disc each or as the stiff springs that
    they are given as.

    Raises
    ------
    ConfigError    for lateral motion of a gear whose mass or support is not known
    """
    compounds = line.compounds(merge_rigid=merge_rigid)
    n_nodes, n_rotations = len(line.nodes), len(compounds)
    moving = list(range(len(line.gears))) if lateral else []
    n_coordinates, n_dofs = n_nodes + 2 * len(moving), n_rotations + 2 * len(moving)
    expand = np.zeros((n_coordinates, n_dofs))
    for dof, nodes in enumerate(compounds):
        expand[list(nodes), dof] = 1.0
    expand[n_nodes:, n_rotations:] = np.eye(2 * len(moving))

    own_mass = np.zeros(n_coordinates)
    own_mass[:n_nodes] = [node.inertia for node in line.nodes]
    stiffness, damping, loss = np.zeros((3, n_coordinates, n_coordinates))
    for shaft in line.shafts:
        if shaft.stiffness is not None:
            spring = shaft.stiffness
            for matrix, value in (
                (stiffness, spring),
                (loss, shaft.loss_factor * spring),
                (damping, shaft.damping),
            ):
                _join(matrix, shaft.first, shaft.second, value)
    frames = _frames(line)
    for place in moving:
        gear, x = line.gears[place], n_nodes + 2 * place
        if gear.mass is None or gear.support is None:
            raise ConfigError(
                f"{gear.name}: its lateral motion needs a mass and a support"
            )
        if min(gear.support.stiffness_x, gear.support.stiffness_y) <= 0.0:
            raise ConfigError(
                f"{gear.name}: its support needs stiffness along both axes, else it floats away"
            )
        own_mass[x : x + 2] = gear.mass
        for axis, (spring, damper) in enumerate(
            (
                (gear.support.stiffness_x, gear.support.damping_x),
                (gear.support.stiffness_y, gear.support.damping_y),
            )
        ):
            stiffness[x + axis, x + axis], damping[x + axis, x + axis] = spring, damper

    directions = np.zeros((len(line.meshes), n_coordinates))
    for row, mesh in enumerate(line.meshes):
        one, other = line.gears[mesh.driving], line.gears[mesh.driven]
        directions[row, one.node], directions[row, other.node] = (
            one.base_radius,
            -other.base_radius,
        )
        if lateral:
            along = _line_of_action(line, mesh)
            for gear_place, sign in ((mesh.driving, 1.0), (mesh.driven, -1.0)):
                turn, x = along - frames[gear_place], n_nodes + 2 * gear_place
                directions[row, x : x + 2] += (
                    sign * math.sin(turn),
                    -sign * math.cos(turn),
                )
    elastic_parts = line.elastic_parts
    rotation = np.zeros((len(elastic_parts), n_coordinates))
    for part, nodes in enumerate(elastic_parts):
        rotation[part, list(nodes)] = np.abs(line.speed_ratio[list(nodes)])
    gear_names = [
        f"{line.gears[place].name} {axis}" for place in moving for axis in "xy"
    ]
    return LineMatrices(
        names=(
            *(" + ".join(line.nodes[n].name for n in nodes) for nodes in compounds),
            *gear_names,
        ),
        mass=expand.T @ np.diag(own_mass) @ expand,
        damping=expand.T @ damping @ expand,
        stiffness=expand.T @ stiffness @ expand,
        loss_stiffness=expand.T @ loss @ expand,
        directions=directions @ expand,
        mesh_stiffness=np.array([mesh.stiffness for mesh in line.meshes]),
        mesh_damping=np.array([mesh.damping for mesh in line.meshes]),
        mesh_loss_factor=np.array([mesh.loss_factor for mesh in line.meshes]),
        backlash=np.array([mesh.backlash for mesh in line.meshes]),
        rigid=rotation @ expand / expand.sum(axis=0),
        coordinate_names=(*(node.name for node in line.nodes), *gear_names),
        coordinate_mass=own_mass,
        expand=expand,
        coordinate_node=np.array(
            [
                *range(n_nodes),
                *(line.gears[place].node for place in moving for _ in "xy"),
            ],
            dtype=np.int64,
        ),
    )


def _join(matrix: Array, one: int, other: int, value: float) -> None:
    matrix[[one, other], [one, other]] += value
    matrix[one, other] -= value
    matrix[other, one] -= value


def _line_of_action(line: ShaftLine, mesh: GearMesh) -> float:
    """Angle of the direction in which the driving tooth pushes.

    Off the common tangent by the pressure angle, rad.
    """
    sense = math.copysign(1.0, line.speed_ratio[line.gears[mesh.driving].node])
    return mesh.center_line + sense * (0.5 * math.pi - mesh.pressure_angle)


def _frames(line: ShaftLine) -> list[float]:
    """Direction of each gear's own frame: that in which the driving tooth of its first mesh
    pushes, rad.

    Its y points against it and its x is across, y turned back by a right angle, as in the
    equations of the single pair.
    """
    frames: list[float | None] = [None] * len(line.gears)
    for mesh in line.meshes:
        for place in (mesh.driving, mesh.driven):
            if frames[place] is None:
                frames[place] = _line_of_action(line, mesh)
    return [0.0 if angle is None else angle for angle in frames]
