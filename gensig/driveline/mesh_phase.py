"""Phases of the meshes of a line when it starts.

A gear has one set of teeth, so that the phases of its meshes follow from each other by the
directions of its mates. Angles are those of tooth centres in the common plane, counted against
the clock; ``docs/theory/drive_lines.md``.
"""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.driveline.drive_line import DriveLine
from gensig.driveline.linear.shaft_line import GearMesh
from gensig.errors import GeometryError
from gensig.geometry.contact import GearPair
from gensig.systems.run import Start


def tooth_angles(line: DriveLine, turned: float = 0.0) -> Array:
    """Angle of a tooth's centre of every gear, (gear,) rad, when the first node has turned by
    ``turned`` rad.

    At 0 the gears of the first node, or those nearest to it, have a tooth at angle 0. Mates take
    up all backlash on the driving side. Gears on one shaft have a tooth at one angle (assumed:
    how they are keyed is not in the tables), and so has a gear that closes a loop, whatever the
    loop says.
    """
    gears, ratio = line.line.gears, line.line.speed_ratio
    by_node: list[float | None] = [None] * len(line.line.nodes)
    by_node[0] = 0.0
    meshes = list(zip(line.line.meshes, line.pairs, strict=True))
    while any(angle is None for angle in by_node):
        before = list(by_node)
        for shaft in line.line.shafts:  # gears on one shaft have a tooth at one angle
            ends = shaft.first, shaft.second
            placed = [by_node[end] for end in ends if by_node[end] is not None]
            if len(placed) == 1:
                by_node[shaft.first] = by_node[shaft.second] = placed[0]
        for mesh, pair in meshes:
            driving, driven = gears[mesh.driving].node, gears[mesh.driven].node
            sense = math.copysign(1.0, ratio[driving])
            known, sought = by_node[driving], by_node[driven]
            if known is not None and sought is None:
                by_node[driven] = _driven_angle(
                    mesh, pair, sense, _past_pitch_point(mesh, pair, sense, known)
                )
            elif sought is not None and known is None:
                by_node[driving] = _driving_angle(mesh, pair, sense, sought)
        if by_node == before:
            break  # the rest belongs to no part that holds the first node
    angles = [angle or 0.0 for angle in by_node]
    return np.array([angles[gear.node] + turned * ratio[gear.node] for gear in gears])


def driving_angle(
    line: DriveLine, number: int, start: Start, *, ratio: float, has_cycle: bool
) -> float:
    """Angle of the crank in its cycle, or of the motor, when given teeth of a mesh are at a phase,
    rad.

    ``ratio`` is the speed of the driving gear over the crank's. Its teeth are tied to the crank:
    the same tooth meets the same cylinder's firing in every record. Where its shaft turns more than
    once a cycle, the driven gear's tooth chooses the turn. A motor has no cycle: its turns are
    counted on, so that the other meshes stand as the teeth allow.
    """
    pitches = start.tooth_pinion + start.phase - start_phases(line)[number]
    turns = pitches / line.pairs[number].pinion.n_teeth
    if not has_cycle:
        return 2.0 * math.pi * (turns + start.tooth_wheel) / ratio
    turns += start.tooth_wheel % max(1, round(2.0 * ratio))
    return 2.0 * math.pi * turns / ratio % (4.0 * math.pi)


def start_rolls(line: DriveLine, turned: float = 0.0) -> Array:
    """Distance of a pair of every mesh from A along the line of action, (mesh,) m, within one
    base pitch from A on.

    In the middle of the face, when the first node has turned by ``turned`` rad. Gears on one
    shaft have the middles of their faces in one plane (assumed: the tables have no place along
    the shaft).
    """
    angles = tooth_angles(line, turned)
    rolls = []
    for mesh, pair in zip(line.line.meshes, line.pairs, strict=True):
        sense = math.copysign(
            1.0, line.line.speed_ratio[line.line.gears[mesh.driving].node]
        )
        past = _past_pitch_point(mesh, pair, sense, float(angles[mesh.driving]))
        rolls.append((pair.pitch_point + past * pair.base_pitch) % pair.base_pitch)
    return np.array(rolls)


def first_slice_lead(pair: GearPair) -> float:
    """Lead of the slice that enters first over the middle of the face, m; spur: 0."""
    return 0.5 * pair.face_width * math.tan(pair.base_helix_angle)


def start_phases(line: DriveLine, turned: float = 0.0) -> list[float]:
    """Pitches that the first slice of a pair of every mesh is past A: starts of ``MeshTeeth``."""
    rolls = start_rolls(line, turned).tolist()
    return [
        (roll + first_slice_lead(pair)) / pair.base_pitch
        for roll, pair in zip(rolls, line.pairs, strict=True)
    ]


def _half_teeth(pair: GearPair) -> tuple[float, float]:
    """Half tooth angles on the working pitch circles.

    Together with the other's they fill a pitch.
    """
    cosine = math.cos(pair.working_pressure_angle)
    first, second = (
        gear.half_tooth_angle_at(gear.base_radius / cosine)
        for gear in (pair.pinion, pair.wheel)
    )
    return first, second


def _past_pitch_point(
    mesh: GearMesh, pair: GearPair, sense: float, angle: float
) -> float:
    """Base pitches by which the driving flank of the tooth at ``angle`` has passed the pitch
    point.
    """
    flank = angle + sense * _half_teeth(pair)[0]
    return sense * (flank - mesh.center_line) * pair.pinion.n_teeth / (2.0 * math.pi)


def _driven_angle(mesh: GearMesh, pair: GearPair, sense: float, past: float) -> float:
    """Tooth of the driven gear whose rear flank, as it turns, the driving flank touches."""
    turned = _half_teeth(pair)[1] + past * 2.0 * math.pi / pair.wheel.n_teeth
    return mesh.center_line + math.pi - sense * turned


def _driving_angle(
    mesh: GearMesh, pair: GearPair, sense: float, driven_angle: float
) -> float:
    """The reverse of the two above."""
    turned = sense * (mesh.center_line + math.pi - driven_angle) - _half_teeth(pair)[1]
    past = turned * pair.wheel.n_teeth / (2.0 * math.pi)
    return mesh.center_line + sense * (
        past * 2.0 * math.pi / pair.pinion.n_teeth - _half_teeth(pair)[0]
    )


def mesh_start(
    n_teeth: int,
    *,
    mate_angle: float,
    drives: bool,
    tooth_angle: float = 0.0,
    pitch_point: float = 0.0,
) -> tuple[int, float]:
    """Start tooth and start phase of a gear's mesh with a mate at an angle, so that its meshes
    agree with each other.

    Parameters
    ----------
    mate_angle : rad    from the gear's center to the mate's, counted in the sense in which the
        gear turns
    drives : whether the gear drives there (its leading flanks touch) or is driven (its trailing
        flanks)
    tooth_angle : rad   where the middle of the gear's tooth 0 stands when all angles are 0
    pitch_point : position of the pitch point in the tables of the mesh, pitches

    Returns
    -------
    the tooth of pair 0, and the phase in pitches

    Tooth 0's middle passes the mate at mate_angle, its flank a quarter pitch before (leading) or
    behind (trailing); the tooth that enters next stands one pitch back. Standard teeth: tooth and
    space are equal on the pitch circle. Source: the phases of Parker & Lin, Mesh Phasing
    Relationships in Planetary and Epicyclic Gears (ASME DETC2003/PTG-48067), written for one
    gear.
    """
    if n_teeth < 1:
        raise GeometryError(f"a gear of {n_teeth} teeth has no phase")
    passed = (
        (tooth_angle - mate_angle) * n_teeth / (2.0 * math.pi)
        + _quarter(drives)
        + pitch_point
    )
    pair = math.floor(passed)
    # the phase is taken within a pitch, so what was pair ``pair`` becomes pair 0
    return pair % n_teeth, passed - pair


def tooth_angle(
    n_teeth: int,
    *,
    mate_angle: float,
    drives: bool,
    start: tuple[int, float],
    pitch_point: float = 0.0,
) -> float:
    """Angle of the middle of a gear's tooth 0 if one of its meshes begins at ``start``, rad.

    The inverse of ``mesh_start``, for the other meshes of a gear whose phase in one is known.
    """
    tooth, phase = start
    return (
        mate_angle
        + (tooth + phase - _quarter(drives) - pitch_point) * 2.0 * math.pi / n_teeth
    )


def _quarter(drives: bool) -> float:
    """Lead of the flank that touches over the middle of its tooth, pitches."""
    return 0.5 * drives - 0.25
