"""Interface of a backend: its input, one integration, and its output, the motions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from gensig.arrays import Array, Flags
from gensig.dynamics._layout import MOST_PAIRS as MOST_PAIRS
from gensig.dynamics._layout import N_SEEN as N_SEEN
from gensig.dynamics._layout import SEEN_FORCE as SEEN_FORCE
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import ConfigError

BOUNCING = 0.01  # share of the time without contact above which teeth bounce
# m, rad, m/s or rad/s: no machine moves so far; a motion that overflows may become finite again
OUT_OF_BOUNDS = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class Integration:
    """One integration: the record and its accuracy.

    Parameters
    ----------
    sampling_rate : Hz    of the record
    duration : s          of the record, from time 0 on
    channels : names of degrees of freedom
    with_mesh_state : also return the state of the mesh at every sample
    oversampling : internal steps per sample, or as fine as so many steps
    precision : a name in ``PRECISIONS``
    max_error : accepted relative error, None without a check
    """

    sampling_rate: float
    duration: float
    channels: tuple[str, ...]
    with_mesh_state: bool
    oversampling: int
    precision: str
    max_error: float | None

    def __post_init__(self) -> None:
        count_samples(
            self.duration, self.sampling_rate
        )  # refuses a record without samples

    @property
    def n_samples(self) -> int:
        """Samples of the record."""
        return count_samples(self.duration, self.sampling_rate)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motions:
    """Motions of machines, one row each, in the order of the machines.

    Parameters
    ----------
    acceleration : (channel, sample) m/s2 or rad/s2 of each machine
    check : (machine, channel, sample)    the beginning of the same at half the step; no sample
        without ``max_error``
    angle : (angle, sample) rad of each   since time 0, of the pinion or of what a line names
    seen : (row, sample) of each          the meshes, ``N_SEEN`` rows each; none
        without ``with_mesh_state``
    mean_speed : (machine,) rad/s         of the first angle
    contact_loss : (machine, mesh)        share of the time without contact
    finite : (machine,)                   the motion stayed within bounds

    The long series are views of the groups that were integrated together: a copy of all of them
    into one array took longer than the settling of a machine.
    """

    acceleration: Sequence[Array]
    check: Array
    angle: Sequence[Array]
    seen: Sequence[Array]
    mean_speed: Array
    contact_loss: Array
    finite: Flags


class Backend(ABC):
    """A method that integrates the equations of motion of machines."""

    @abstractmethod
    def check_step(
        self,
        machine: Dynamics,
        sampling_rate: float,
        oversampling: int,
    ) -> None:
        """Raise SimulationError for a machine that the method cannot integrate at this step."""

    @abstractmethod
    def records_together(self, precision: str) -> int:
        """Least number of records that are simulated at full speed."""

    @abstractmethod
    def integrate(
        self, machines: Sequence[Dynamics], integration: Integration
    ) -> Motions:
        """Settled motions of machines that have passed ``check_step``.

        The machines share their bodies, meshes and the options of their mesh law. The motion of a
        machine must not depend on the other machines of the call, nor on their number.
        """


def count_samples(duration: float, sampling_rate: float) -> int:
    """Samples of a record; ConfigError where there is none."""
    n_samples = round(duration * sampling_rate)
    if n_samples < 1:
        raise ConfigError(
            f"operating.duration_s = {duration:g} holds no sample at {sampling_rate:g} Hz"
        )
    return n_samples
