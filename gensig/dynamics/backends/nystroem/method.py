"""The Nystroem method with two evaluations of the mesh law a step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._layout import Group
from gensig.dynamics._vector import aligned, n_lanes
from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.group_motions import in_order, integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.nystroem import _any_law_pair, _spur_pair
from gensig.dynamics.backends.nystroem._layout import (
    AnyLawGroup,
    HelicalNystroemGroup,
    NystroemGroup,
    any_law_scratch,
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
    too_long_steps,
    warn_of_coarse_step,
)
from gensig.dynamics.lanes import pack
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.pair import PairDynamics
from gensig.mesh.pair_table import PairTable

# beyond it a pair may carry outside of the path that the core follows
MOST_CONTACT_RATIO = 2.5


def pack_pairs(
    dynamics: Sequence[PairDynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
) -> NystroemGroup:
    """Gear pairs as one group; its table ends with a missing pair and a cell of zeros."""
    group = pack(dynamics, step, precision, span, end=missing_cells())
    return NystroemGroup(**aligned_fields(group))


def pack_any_law(
    dynamics: Sequence[PairDynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
) -> AnyLawGroup | HelicalNystroemGroup:
    """Gear pairs of any mesh law as one group."""
    fields = aligned_fields(pack(dynamics, step, precision, span))
    if dynamics[0].is_helical:
        return HelicalNystroemGroup(**fields)
    return AnyLawGroup(**fields)


def aligned_fields(group: Group) -> dict[str, Any]:
    """Fields of a group, with arrays at bounds of the vectors."""
    fields = group._asdict()
    for name, values in fields.items():
        if isinstance(values, np.ndarray):
            fields[name] = aligned(values)
    return fields


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


THREE_PAIRS = Core(
    pack=pack_pairs,
    scratch=scratch,
    integrate=_spur_pair.integrate,
    coarsest_oversampling=coarsest_oversampling,
    settling_time=settling_time,
)
ANY_LAW = Core(
    pack=pack_any_law,
    scratch=any_law_scratch,
    integrate=_any_law_pair.integrate,
    coarsest_oversampling=coarsest_oversampling,
    settling_time=settling_time,
)


@final
class Nystroem(Backend):
    """Two evaluations of the mesh law a step."""

    def check_step(
        self,
        machine: PairDynamics,
        sampling_rate: float,
        oversampling: int,
        max_error: float | None,
    ) -> None:
        """Raise StepError for an unstable step; warn of a coarse unchecked one."""
        needed = math.ceil(stable_rate(machine.stiff_rates) / sampling_rate)
        if needed > oversampling:
            raise too_long_steps(machine, sampling_rate, oversampling, needed)
        if max_error is None:
            warn_of_coarse_step(machine, sampling_rate, oversampling)

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[PairDynamics], integration: Integration
    ) -> Motions:
        """Motions of machines, integrated in groups of the same core and settling stages."""
        by_core: dict[bool, list[int]] = {}
        for index, machine in enumerate(machines):
            by_core.setdefault(is_followed_by_three(machine.teeth), []).append(index)
        cores = {True: THREE_PAIRS, False: ANY_LAW}
        motions = (
            (
                indices,
                integrate_machines(
                    [machines[i] for i in indices], integration, cores[three]
                ),
            )
            for three, indices in by_core.items()
        )
        return in_order(motions, len(machines))


def is_followed_by_three(teeth: MeshTeeth) -> bool:
    """True for a mesh that the core of three pairs of teeth covers."""
    pair, options = teeth.pair, teeth.table.options
    contact_ratio = pair.path_of_contact / pair.base_pitch
    return (
        isinstance(teeth.table, PairTable)
        and options.law == "one_sided"
        and contact_ratio <= MOST_CONTACT_RATIO
    )
