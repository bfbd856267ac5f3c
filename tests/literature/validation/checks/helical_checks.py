"""Quantities of sliced pairs, by the names that the rows use."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from gensig.mesh.iso6336 import single_stiffness
from gensig.options.compose import compose
from gensig.systems.registry import read_sliced_pair
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

SlicedCheck = Callable[["SlicedCase", str], float]

PAIR_PROPERTIES = (
    "center_distance",
    "overlap_ratio",
    "transverse_contact_ratio",
    "total_contact_ratio",
    "working_pressure_angle",
)


@dataclass(frozen=True, eq=False)
class SlicedCase:
    """One pair at rest; the same overrides always give the same object."""

    system: SlicedPair

    @cached_property
    def result(self) -> TransmissionError:
        """Loaded contact over one mesh period."""
        return self.system.transmission_error()


@lru_cache(maxsize=64)
def read_sliced_case(overrides: tuple[str, ...]) -> SlicedCase:
    """Compose the pair of a row."""
    return SlicedCase(system=read_sliced_pair(compose("generate", overrides)))


def _of_pair(name: str) -> SlicedCheck:
    """A property of the pair."""
    return lambda case, at: float(getattr(case.system.pair, name))


def _tangential_force(case: SlicedCase, at: str) -> float:
    return case.system.torque / case.system.pair.pinion.pitch_radius


def _single_per_width(case: SlicedCase, at: str) -> float:
    """Largest stiffness of one slice of a pair per width: c'."""
    mesh = case.system.sliced_mesh()
    on_path = (mesh.position >= 0.0) & (
        mesh.position <= case.system.pair.path_of_contact
    )
    load = math.log(case.system.mesh_force / case.system.pair.face_width)
    contact = mesh.contact_factor * (mesh.contact_constant - mesh.log_weight * load)
    return float(np.max(1.0 / (mesh.structure + contact)[on_path]))


def _depth_of_all(case: SlicedCase, at: str) -> float:
    """The most that a modification can move the transmission error: the sum of its depths."""
    both = (case.system.modification.pinion, case.system.modification.wheel)
    return sum(max(side.tip_relief, side.root_relief) + side.crowning for side in both)


SLICED: dict[str, SlicedCheck] = {
    **{f"sliced.{name}": _of_pair(name) for name in PAIR_PROPERTIES},
    "sliced.mesh_period": lambda case, at: (
        2.0 * math.pi / case.system.pair.wheel.n_teeth
    ),
    "sliced.tangential_force": _tangential_force,
    "sliced.mesh_force": lambda case, at: case.system.mesh_force,
    "sliced.mean_error": lambda case, at: float(case.result.error.mean()),
    "sliced.peak_to_peak": lambda case, at: float(np.ptp(case.result.error)),
    "sliced.line_load": lambda case, at: float(case.result.contact.line_load.max()),
    "sliced.contact_pressure": lambda case, at: float(case.result.pressure.max()),
    "sliced.single_pair_stiffness": lambda case, at: float(
        case.system.single_pair()[1].max()
    ),
    "sliced.mesh_stiffness": lambda case, at: float(
        case.result.contact.stiffness.mean()
    ),
    "sliced.stiffness_per_width": _single_per_width,
    "sliced.iso6336_stiffness_per_width": lambda case, at: single_stiffness(
        case.system.pair, allow_extrapolation=True
    ),
    "sliced.depth_of_modification": _depth_of_all,
}
