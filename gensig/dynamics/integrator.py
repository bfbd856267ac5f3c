"""Integration of machines: from their equations of motion to accelerations at the output rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gensig.dynamics._vector import PRECISIONS
from gensig.dynamics.backends.base import BOUNCING, Integration, Motions, count_samples
from gensig.dynamics.backends.registry import (
    BACKENDS,
    EXPLICIT_BACKEND,
    IMPLICIT_BACKEND,
    RETIRED_BACKEND,
    backend_names,
)
from gensig.dynamics.backends.step_limits import (
    CoarseStepWarning,
    warn_of_coarse_step,
)
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import DOFS
from gensig.errors import ConfigError, SimulationError

__all__ = [
    "BOUNCING",
    "FINEST",
    "CoarseStepWarning",
    "Motions",
    "Solver",
    "check_channels",
    "check_machine",
    "check_memory",
    "count_samples",
    "integrate",
    "records_together",
]

MOST_BYTES = 2**28  # of the samples of the records that are simulated side by side
FINEST = 64  # steps per sample that are tried where the error is too large


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """Options of the integration.

    Parameters
    ----------
    oversampling : internal steps per output sample
    precision : of the numbers, ``float64`` or ``float32``
    max_error : a record with a larger error is integrated again with twice as many steps, up to
        64; None does not compute the error
    backend : the method, a name of ``backend_names``
    """

    oversampling: int
    precision: str
    max_error: float | None = None
    backend: str = EXPLICIT_BACKEND

    def __post_init__(self) -> None:
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(
                f"solver.oversampling = {self.oversampling} must lie in 2..256"
            )
        if self.precision not in PRECISIONS:
            raise ConfigError(
                f"solver.precision = {self.precision!r}; allowed: {', '.join(PRECISIONS)}"
            )
        if self.max_error is not None and not 1e-6 <= self.max_error <= 1.0:
            raise ConfigError(
                f"solver.max_error = {self.max_error:g} must lie in 1e-6..1, or be null"
            )
        if self.backend == RETIRED_BACKEND:
            raise ConfigError(
                f"solver.backend = {RETIRED_BACKEND}, the method of data sets that name none, left "
                f"with version 0.19; take solver.backend={EXPLICIT_BACKEND}"
            )
        if self.backend not in backend_names():
            raise ConfigError(
                f"solver.backend = {self.backend!r}; allowed: {', '.join(backend_names())}"
            )


def integrate(
    machines: Sequence[Dynamics],
    solver: Solver,
    *,
    sampling_rate: float,
    duration: float,
    channels: tuple[str, ...],
    with_mesh_state: bool = False,
) -> Motions:
    """Motions of machines that have settled, from time 0 on for ``duration`` s, one row a machine.

    The backend is ``solver.backend``. The machines share their degrees of freedom and the kind of
    their mesh law. A motion does not depend on the other machines of the call.

    Raises
    ------
    ConfigError        for a channel that the machines do not have
    SimulationError    for a machine that ``require_step`` refuses
    """
    check_channels(channels, machines[0].dofs)
    for machine in machines:
        require_step(machine, solver, sampling_rate)
    integration = Integration(
        sampling_rate=sampling_rate,
        duration=duration,
        channels=channels,
        with_mesh_state=with_mesh_state,
        oversampling=solver.oversampling,
        precision=solver.precision,
        max_error=solver.max_error,
    )
    return BACKENDS[solver.backend].integrate(machines, integration)


def records_together(solver: Solver) -> int:
    """Least number of records that should be simulated in one call: fewer take as long."""
    if solver.backend == IMPLICIT_BACKEND:
        return 1
    return BACKENDS[solver.backend].records_together(solver.precision)


def check_machine(dynamics: Dynamics, solver: Solver, sampling_rate: float) -> None:
    """As ``require_step``; warns of a coarse step whose error is not looked at."""
    require_step(dynamics, solver, sampling_rate)
    if solver.backend == EXPLICIT_BACKEND and solver.max_error is None:
        warn_of_coarse_step(dynamics, sampling_rate, solver.oversampling)


def require_step(dynamics: Dynamics, solver: Solver, sampling_rate: float) -> None:
    """Raise SimulationError for a machine that the backend cannot integrate at this step."""
    if solver.backend == IMPLICIT_BACKEND:
        raise SimulationError(
            f"solver.backend = {IMPLICIT_BACKEND} integrates drive lines; for a gear pair take "
            f"solver.backend={' or '.join(BACKENDS)}"
        )
    per_sample = solver.oversampling
    BACKENDS[solver.backend].check_step(dynamics, sampling_rate, per_sample)


def check_memory(
    duration: float, sampling_rate: float, n_channels: int, solver: Solver
) -> None:
    """Raise ConfigError for records that would not fit into memory side by side."""
    together = records_together(solver)
    n_bytes = count_samples(duration, sampling_rate) * n_channels * together * 8
    if n_bytes > MOST_BYTES:
        longest = duration * MOST_BYTES / n_bytes
        raise ConfigError(
            f"operating.duration_s = {duration:g}: {together} records side by side with "
            f"{n_channels} channels at {sampling_rate:g} Hz take {n_bytes / 2**20:.0f} MiB, "
            f"more than {MOST_BYTES / 2**20:.0f}; record at most {longest:.3g} s at a time"
        )


def check_channels(channels: tuple[str, ...], dofs: tuple[str, ...] = DOFS) -> None:
    """Raise ConfigError for a channel that a machine does not have."""
    unknown = [name for name in channels if name not in dofs]
    if unknown:
        raise ConfigError(
            f"sensing.channels: no channel {', '.join(unknown)}; allowed: {', '.join(dofs)}"
        )
