"""Input and result of one simulation: a run of a machine, and its clean record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.mesh_state import MeshState
from gensig.faults.base import Fault
from gensig.geometry.contact import SIDES
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import Gearbox, Specimen

Array = NDArray[np.float64]
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

    ``turned_back`` counts the teeth by which a lead-in has turned back both gears, 0 or less. The
    other gears of a drive line turn back from where the record itself begins.
    """

    tooth_pinion: int = 0
    tooth_wheel: int = 0
    phase: float = 0.0
    turned_back: int = 0

    @property
    def teeth(self) -> dict[str, int]:
        """The tooth of each gear, by its side of the pair."""
        return dict(zip(SIDES, (self.tooth_pinion, self.tooth_wheel), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Run(Generic[MachineT_co]):
    """One record to be simulated.

    None means a perfect specimen, a nominal gearbox, a start with teeth 0 at A.
    ``with_mesh_state`` asks for the loads of the teeth at every sample.
    ``discs`` are the toothed wheels of a drive line.
    """

    system: MachineT_co
    faults: tuple[Fault, ...]
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
    mesh : loads of the teeth, if the run asks for them
    """

    acceleration: Array
    shaft_angle: Array
    mean_speed: float
    contact_loss_fraction: float
    integration_error: float
    integration_check: str
    mesh: MeshState | None = None
