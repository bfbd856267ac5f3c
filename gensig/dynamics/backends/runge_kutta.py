"""The classical Runge-Kutta method with a fixed step, several records in vector lanes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from gensig.dynamics import _kernels
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.group_motions import integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.step_limits import (
    check_step,
    coarsest_oversampling,
    settling_time,
)
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import PairDynamics

CORE = Core(
    pack=pack,
    scratch=_kernels.scratch,
    integrate=_kernels.integrate,
    coarsest_oversampling=coarsest_oversampling,
    settling_time=settling_time,
    settling_steps=1,
)


@final
class RungeKutta(Backend):
    """The compiled core of gensig: as many records at a time as a vector holds."""

    def check_step(
        self,
        machine: PairDynamics,
        sampling_rate: float,
        oversampling: int,
        max_error: float | None,
    ) -> None:
        """Raise SimulationError for an unstable step; warn of a coarse unchecked one."""
        check_step(machine, sampling_rate, oversampling, max_error)

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[PairDynamics], integration: Integration
    ) -> Motions:
        """Motions of machines, integrated in groups that settle in the same stages."""
        return integrate_machines(machines, integration, CORE)
