"""The Nystroem method with two evaluations of the mesh law a step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._vector import aligned, n_lanes
from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.group_motions import integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.nystroem import _kernels
from gensig.dynamics.backends.nystroem._layout import (
    FOLLOWED,
    NystroemGroup,
    scratch,
)
from gensig.dynamics.backends.nystroem._pairs import (
    MISSING_COMPLIANCE,
    MISSING_GAP,
)
from gensig.dynamics.backends.nystroem.stability import stable_rate
from gensig.dynamics.backends.step_limits import (
    COARSE_STABILITY,
    settling_time,
    warn_of_coarse_step,
)
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import PairDynamics
from gensig.errors import SimulationError

OTHER_BACKEND = "take solver.backend=runge_kutta"
# beyond it a pair may carry outside of the path that the core follows
MOST_CONTACT_RATIO = 2.5


def pack_pairs(
    dynamics: Sequence[PairDynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
) -> NystroemGroup:
    """Gear pairs as one group; its table ends with a missing pair and a cell of zeros."""
    group = pack(dynamics, step, precision, span)
    table = np.concatenate([group.table, missing_cells().astype(precision)])
    fields = group._replace(table=table)._asdict()
    for name, values in fields.items():
        if isinstance(values, np.ndarray):
            fields[name] = aligned(values)
    return NystroemGroup(**fields)


def missing_cells() -> NDArray[np.float64]:
    """The end of a table: a cell of a missing pair, and a cell of zeros."""
    node = MISSING_COMPLIANCE, 0.0, MISSING_GAP, 0.0
    return np.array([*node, *node, *np.zeros(2 * len(node))])


def coarsest_oversampling(
    dynamics: PairDynamics, oversampling: int, sampling_rate: float
) -> int:
    """Least stable number of steps per sample of the settling, at most that of the record."""
    least = stable_rate(dynamics.stiff_rates) / (COARSE_STABILITY * sampling_rate)
    return min(oversampling, math.ceil(least))


CORE = Core(
    pack=pack_pairs,
    scratch=scratch,
    integrate=_kernels.integrate,
    coarsest_oversampling=coarsest_oversampling,
    settling_time=settling_time,
)


@final
class Nystroem(Backend):
    """Two evaluations of the mesh law a step, for spur pairs with one-sided contact."""

    def check_step(
        self,
        machine: PairDynamics,
        sampling_rate: float,
        oversampling: int,
        max_error: float | None,
    ) -> None:
        """Raise SimulationError for an unstable step or what the method does not cover."""
        refuse(machine)
        needed = math.ceil(stable_rate(machine.stiff_rates) / sampling_rate)
        if needed > oversampling:
            raise SimulationError(
                f"solver.oversampling = {oversampling} makes too long steps for "
                f"solver.backend=nystroem; raise solver.oversampling to at least {needed}"
            )
        if max_error is None:
            warn_of_coarse_step(machine, sampling_rate, oversampling)

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[PairDynamics], integration: Integration
    ) -> Motions:
        """Motions of machines, integrated in groups that settle in the same stages."""
        return integrate_machines(machines, integration, CORE)


def refuse(machine: PairDynamics) -> None:
    """Raise SimulationError for a machine that the method does not cover."""
    if machine.is_helical:
        raise SimulationError(
            "solver.backend = nystroem takes spur gears; for gear.helix_angle_deg other than 0 "
            f"{OTHER_BACKEND}"
        )
    law = machine.table.options.law
    if law != "one_sided":
        raise SimulationError(
            f"mesh.law = {law} is not covered by solver.backend = nystroem; {OTHER_BACKEND}"
        )
    pair = machine.table.pair
    contact_ratio = pair.path_of_contact / pair.base_pitch
    if contact_ratio > MOST_CONTACT_RATIO:
        raise SimulationError(
            f"solver.backend = nystroem follows {FOLLOWED} pairs of teeth, too few for a contact "
            f"ratio of {contact_ratio:.3g} (at most {MOST_CONTACT_RATIO}); {OTHER_BACKEND}"
        )
