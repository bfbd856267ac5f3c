"""The Nystroem method with two evaluations of the mesh law a step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, final

from gensig.dynamics._record_kernels import recorder
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.backends.base import Backend, Integration, Motions
from gensig.dynamics.backends.group_motions import in_order, integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.nystroem._any_law_meshes import AnyLawMeshes
from gensig.dynamics.backends.nystroem._group import SpurGroup, scratch
from gensig.dynamics.backends.nystroem._kernels import Law, integrator
from gensig.dynamics.backends.nystroem._spur_meshes import SpurMeshes
from gensig.dynamics.backends.nystroem.force_law import ForceLaw
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind, pack
from gensig.dynamics.backends.nystroem.stability import stable_rate
from gensig.dynamics.backends.step_limits import (
    COARSE_STABILITY,
    too_long_steps,
)
from gensig.dynamics.motion.dynamics import Dynamics


def coarsest_oversampling(
    machine: Dynamics, oversampling: int, sampling_rate: float
) -> int:
    """Least stable number of steps per sample of the settling, at most that of the record."""
    least = stable_rate(machine.stiff_rates) / (COARSE_STABILITY * sampling_rate)
    return min(oversampling, math.ceil(least))


# laws of meshes: closed form of three pairs, and chords of up to eight pairs with the paper's law
MESH_LAWS: dict[str, Law] = {"three_pairs": SpurMeshes(), "any": AnyLawMeshes()}
# laws of other elements, by the name that an ``Element`` has
FORCE_LAWS: dict[str, ForceLaw] = {}


def _core(law: Law) -> Core:
    """The core of machines whose meshes have one law."""
    integrate = integrator(law, FORCE_LAWS)
    return Core(
        pack=partial(pack, forces=FORCE_LAWS),
        scratch=scratch,
        integrate=integrate,
        record=recorder(integrate),
        coarsest_oversampling=coarsest_oversampling,
    )


THREE_PAIRS, ANY_LAW = map(_core, MESH_LAWS.values())


def core_of(kind: type[Any]) -> Core:
    """The core of groups of a type."""
    return THREE_PAIRS if issubclass(kind, SpurGroup) else ANY_LAW


@final
class Nystroem(Backend):
    """Two evaluations of the mesh law a step."""

    def check_step(
        self,
        machine: Dynamics,
        sampling_rate: float,
        oversampling: int,
    ) -> None:
        """Raise StepError for an unstable step."""
        needed = math.ceil(stable_rate(machine.stiff_rates) / sampling_rate)
        if needed > oversampling:
            raise too_long_steps(machine, sampling_rate, oversampling, needed)

    def records_together(self, precision: str) -> int:
        """Number of vector lanes."""
        return n_lanes(precision)

    def integrate(
        self, machines: Sequence[Dynamics], integration: Integration
    ) -> Motions:
        """Motions of machines, integrated in groups of the same law and settling stages."""
        by_kind: dict[type[Any], list[int]] = {}
        for index, machine in enumerate(machines):
            by_kind.setdefault(group_kind(machine.equations), []).append(index)
        motions = (
            (
                indices,
                integrate_machines(
                    [machines[i] for i in indices], integration, core_of(kind)
                ),
            )
            for kind, indices in by_kind.items()
        )
        return in_order(motions, len(machines))
