"""Motions of the gears of a drive line: their channels, and the degrees of freedom these are of."""

from __future__ import annotations

from collections.abc import Sequence

from gensig.driveline.drive_line import DriveLine
from gensig.driveline.line_gears import gear_names, line_gears
from gensig.driveline.running import RunningLine

AXES = ("x", "y")
ROTATION = "rotation"


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
