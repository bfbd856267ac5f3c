"""Input and result of one simulation: a run of a machine, and its clean record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, TypeVar

from gensig.arrays import Array
from gensig.dynamics.mesh_state import MeshState
from gensig.faults.base import Fault
from gensig.geometry.contact import SIDES, GearPair
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import Gearbox, Specimen

MachineT_co = TypeVar("MachineT_co", covariant=True)

# Results of the check of an integration:
#   error       the error found with half the step is below the limit
#   levels      teeth bounce and point values differ, but band levels and indicators agree
#   unresolved  neither of the two
#   none        no check was asked for
#   energy      the residual of the energy balance, for drive lines
CHECKS = ("error", "levels", "unresolved", "none", "energy")


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Start of a record: the teeth that enter contact at roll 0, and the roll in base pitches.

    ``line_angle`` rad is the angle of the shaft that turns a drive line, from which its other
    meshes follow. None: it follows from the teeth, as in every record; a lead-in sets it, so that
    all meshes begin as much earlier.
    """

    tooth_pinion: int = 0
    tooth_wheel: int = 0
    phase: float = 0.0
    line_angle: float | None = None

    @property
    def teeth(self) -> dict[str, int]:
        """The tooth of each gear, by its side of the pair."""
        return dict(zip(SIDES, (self.tooth_pinion, self.tooth_wheel), strict=True))


def angle_from_tooth_0(
    pair: GearPair, side: str, start: Start, shaft_angle: Array
) -> Array:
    """Angle of a gear of a pair, 0 where its tooth 0 enters contact, (sample,) rad.

    ``shaft_angle`` (sample,) rad is that of the pinion since the start.
    """
    turned = shaft_angle * pair.pinion.n_teeth
    turned = turned + 2.0 * math.pi * (start.teeth[side] + start.phase)
    return turned / pair.gears[side].n_teeth


@dataclass(frozen=True, slots=True, kw_only=True)
class Run(Generic[MachineT_co]):
    """One record to be simulated.

    Without faults its gears are healthy; None means a perfect specimen, a nominal gearbox, a start
    with teeth 0 at A.
    ``with_mesh_state`` asks for the loads of the teeth at every sample.
    ``discs`` are the toothed wheels of a drive line.
    """

    system: MachineT_co
    faults: tuple[Fault, ...] = ()
    start: Start | None = None
    specimen: Specimen | None = None
    gearbox: Gearbox | None = None
    with_mesh_state: bool = False
    discs: tuple[Disc, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CleanRecord:
    """A record before noise, with the accuracy of its simulation.

    Parameters
    ----------
    acceleration : (channel, sample) m/s2; rad/s2 for rotations
    shaft_angle : (sample,) rad    of the pinion, from its nominal angle at the first sample on
    mean_speed : rad/s
    integration_check : one of ``CHECKS``
    mesh : loads of the teeth of the followed mesh, if the run asks for them
    further_meshes : the same of the other meshes, in the order of ``Machine.meshes``
    """

    acceleration: Array
    shaft_angle: Array
    mean_speed: float
    contact_loss_fraction: float
    integration_error: float
    integration_check: str
    mesh: MeshState | None = None
    further_meshes: tuple[MeshState, ...] = ()
