"""Gears, bodies, meshes and channels of a drive line by name, for its machine.

The two gears of the mesh that records follow are named by their side of it. All others have their
names of the tables, in small letters with underscores.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gensig.driveline.drive_line import DriveLine
from gensig.driveline.running import RunningLine, named_by_side
from gensig.dynamics.pair import Body, Support
from gensig.geometry.contact import SIDES
from gensig.geometry.gear import Gear
from gensig.systems.base import MachineMesh

AXES = ("x", "y")
ROTATION = "rotation"
STILL = Support(stiffness_x=0.0, stiffness_y=0.0, damping_x=0.0, damping_y=0.0)


def slug(name: str) -> str:
    """A name of a table as configurations write it: ``Idler gear 2`` is ``idler_gear_2``."""
    return re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")


def gear_names(drive: DriveLine, followed: int) -> tuple[str, ...]:
    """Name of every gear of a line, (gear,), each once; ``followed`` is the number of the mesh.

    A name that is taken, or has no letter and no digit, ends in the gear's number in the table.
    """
    mesh = drive.line.meshes[followed]
    sides = dict(zip((mesh.driving, mesh.driven), SIDES, strict=True))
    names: list[str] = []
    for number, gear in enumerate(drive.line.gears):
        name = sides.get(number, slug(gear.name))
        if number not in sides and name in ("", *SIDES, *names):
            name = slug(f"{name} gear {number + 1}")
        names.append(name)
    return tuple(names)


def line_gears(drive: DriveLine, followed: int) -> dict[str, Gear]:
    """Geometry of every gear by its name; pinion and wheel of the followed mesh first."""
    names = gear_names(drive, followed)
    gears = named_by_side(drive.pairs[followed]).gears
    for mesh, pair in zip(drive.line.meshes, drive.pairs, strict=True):
        for number, gear in ((mesh.driving, pair.pinion), (mesh.driven, pair.wheel)):
            gears.setdefault(names[number], replace(gear, name=names[number]))
    return gears


def line_bodies(drive: DriveLine, followed: int) -> dict[str, Body]:
    """Mass and support of every gear, and the inertia of its node, by its name.

    In the order of ``line_gears``.
    """
    names, nodes = gear_names(drive, followed), drive.line.nodes
    bodies = {
        name: Body(
            mass=gear.mass or 0.0,
            inertia=nodes[gear.node].inertia,
            support=gear.support or STILL,
        )
        for name, gear in zip(names, drive.line.gears, strict=True)
    }
    return {name: bodies[name] for name in line_gears(drive, followed)}


def with_supports(
    drive: DriveLine, followed: int, supports: Mapping[str, Support]
) -> DriveLine:
    """The line with other supports of its gears, by their names.

    Gears without lateral motion stay without a support.
    """
    gears = list(drive.line.gears)
    for number, name in enumerate(gear_names(drive, followed)):
        if gears[number].support is not None:
            gears[number] = replace(gears[number], support=supports[name])
    return replace(drive, line=replace(drive.line, gears=tuple(gears)))


def pinion_turns(drive: DriveLine, followed: int) -> dict[str, float]:
    """Turns of the pinion of the followed mesh during one turn of each gear, by its name."""
    names, gears = gear_names(drive, followed), drive.line.gears
    speed = np.abs(drive.line.speed_ratio)
    of_pinion = speed[gears[drive.line.meshes[followed].driving].node]
    return {
        name: float(of_pinion / speed[gear.node])
        for name, gear in zip(names, gears, strict=True)
    }


def line_meshes(drive: DriveLine, followed: int) -> tuple[MachineMesh, ...]:
    """All meshes of a line, in the order of the table."""
    names = gear_names(drive, followed)
    pairs = list(drive.pairs)
    pairs[followed] = named_by_side(pairs[followed])
    return tuple(
        MachineMesh(
            driving=names[mesh.driving],
            driven=names[mesh.driven],
            pair=pair,
            followed=number == followed,
        )
        for number, (mesh, pair) in enumerate(
            zip(drive.line.meshes, pairs, strict=True)
        )
    )


def gear_channels(drive: DriveLine, followed: int) -> tuple[str, ...]:
    """Rotations of all gears, then x and y of all gears that move; the followed mesh's first."""
    names = list(line_gears(drive, followed))
    rotations = [f"{name}_{ROTATION}" for name in names]
    if not drive.lateral:
        return tuple(rotations)
    return (*rotations, *(f"{name}_{axis}" for name in names for axis in AXES))


def gear_dof(line: RunningLine, followed: int, channel: str) -> int:
    """Degree of freedom of a gear's channel, such as ``idler_gear_2_y``."""
    name, _, motion = channel.rpartition("_")
    drive = line.machine.drive
    number = gear_names(drive, followed).index(name)
    gears = drive.line.gears
    if motion == ROTATION:
        return line.dof(drive.numbers[gears[number].node])
    # x and y of all gears follow the rotations
    first = len(line.matrices.names) - len(AXES) * len(gears)
    return first + len(AXES) * number + AXES.index(motion)


def meshes_of(drive: DriveLine, number: int) -> Sequence[int]:
    """Numbers of the meshes of a gear."""
    meshes = enumerate(drive.line.meshes)
    return [m for m, mesh in meshes if number in (mesh.driving, mesh.driven)]
