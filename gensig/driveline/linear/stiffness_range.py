"""Check that the joints of a drive line are near enough in stiffness to be computed together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.driveline.drive_line import DriveLine
from gensig.driveline.linear.forced import RIGID, closed_line
from gensig.driveline.linear.modal import natural_modes
from gensig.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class _Joint:
    """A shaft or a mesh: the names of its ends and its stiffness about the first, N m/rad."""

    ends: tuple[str, str]
    stiffness: float
    location: str

    def __str__(self) -> str:
        return f"{self.ends[0]} - {self.ends[1]} with {self.stiffness:.3g} N m/rad"


@lru_cache(maxsize=16)
def check_stiffness_range(drive: DriveLine) -> None:
    """Raise for joints so unlike in stiffness that rounding hides the softer ones.

    A static twist follows from the eigenvalues of the stiffness. Those below ``forced.RIGID`` of
    the largest cannot be told from the rigid motions of the line.

    Raises
    ------
    SimulationError    for inertias and joints that natural modes cannot be computed from
    ConfigError        with both joints, for stiffnesses that are too far apart
    """
    matrices = drive.matrices()
    values = np.linalg.eigvalsh(closed_line(matrices)[0].stiffness)
    unheld = np.count_nonzero(values <= RIGID * values[-1])
    joints = sorted(_joints(drive), key=lambda joint: joint.stiffness)
    if unheld <= len(matrices.rigid) or not joints:
        natural_modes(matrices)
        return
    softest, stiffest = joints[0], joints[-1]
    location = stiffest.location or drive.name
    raise ConfigError(
        f"{location}: {stiffest} and {softest} are too unlike to be computed together: "
        f"stiffnesses of the line may span about {1.0 / RIGID:g}; check the units of both, "
        "or join the stiff nodes by a rigid edge"
    )


def _joints(drive: DriveLine) -> list[_Joint]:
    """Shafts and meshes that twist."""
    line = drive.line
    joints = []
    for shaft in line.shafts:
        if shaft.stiffness:
            joints.append(
                _Joint(
                    ends=(line.nodes[shaft.first].name, line.nodes[shaft.second].name),
                    stiffness=shaft.stiffness,
                    location=shaft.location,
                )
            )
    for mesh in line.meshes:
        driving, driven = line.gears[mesh.driving], line.gears[mesh.driven]
        joints.append(
            _Joint(
                ends=(driving.name, driven.name),
                stiffness=mesh.stiffness * driving.base_radius * driven.base_radius,
                location=mesh.location,
            )
        )
    return joints
