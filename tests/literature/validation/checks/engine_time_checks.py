"""Quantities of an engine's line in time, teeth free to part, by the names that the rows use.

The drive rattles and is chaotic: on one machine the numbers come out bit for bit, on another they
scatter by some per cent. So all are medians over the cycles or shares of the time, and
``docs/validation.md`` has two digits of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.engine_dampers import (
    DynamicRootStress,
    mesh_between,
    passes_of_a_cycle,
    read_mesh_strength,
)
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.excitation.cycle_statistics import (
    fluctuations,
    order_amplitudes,
    typical_extremes,
)
from gensig.driveline.in_time import (
    TimeResponse,
    read_tooth_law,
    tabulated_meshes,
    time_response,
)
from gensig.driveline.time_root_stress import root_stress_in_time, typical_largest
from gensig.options.compose import compose
from gensig.options.configuration import Configuration

Array = NDArray[np.float64]
TimeCheck = Callable[["TimeCase", str], float]

NODES = (14, 45, 65)  # flywheel, pump gear, free end of its shaft
DURATION = 2.0  # s, 28 cycles at 1688 r/min
N_ORDERS = 80


@lru_cache(maxsize=8)
def read_time_case(overrides: tuple[str, ...]) -> TimeCase:
    """Compose the engine and its line of a row."""
    config = compose("generate", overrides)
    return TimeCase(config=config, line=read_engine_line(config), overrides=overrides)


@dataclass(frozen=True, eq=False)
class TimeCase:
    """An engine on its line in time at the reference point of its excitation."""

    config: Configuration
    line: EngineLine
    overrides: tuple[str, ...]

    @cached_property
    def response(self) -> TimeResponse:
        """Its motion over `DURATION`."""
        speed, torque = (
            self.line.engine.reference.speed,
            self.line.engine.reference.torque,
        )
        own = tabulated_meshes(self.line, read_tooth_law(self.config), speed, torque)
        return time_response(
            self.line, speed, torque, teeth=own, nodes=NODES, duration=DURATION
        )

    @property
    def without(self) -> TimeCase:
        """The same without the dampers."""
        return read_time_case(
            tuple(
                word
                for word in self.overrides
                if not word.startswith("system.dampers=")
            )
        )

    def fluctuation(self, node: str) -> float:
        """Half the peak to peak of a node's speed in a cycle, rad/s."""
        speed = self.response.speed[NODES.index(int(node))]
        return float(np.median(fluctuations(speed[None], self.response.crank_angle)))

    @cached_property
    def _angles(self) -> Array:
        return order_amplitudes(
            self.response.angle, self.response.crank_angle, N_ORDERS
        )

    def angles(self, node: str) -> Array:
        """Amplitudes of a node's angular displacement at the orders 0.5, 1, ..., (order,) rad."""
        return np.asarray(self._angles[NODES.index(int(node))])

    def mesh(self, name: str) -> int:
        """Place of a mesh, the numbers of its two nodes with a slash."""
        first, second = (int(word) for word in name.split("/"))
        return mesh_between(self.line, (first, second))

    def tooth_force(self, mesh: str) -> tuple[float, float]:
        """Least and greatest force of a mesh in a cycle, N."""
        force = self.response.mesh_force[self.mesh(mesh)]
        least, greatest = typical_extremes(force[None], self.response.crank_angle)
        return float(least[0]), float(greatest[0])

    @lru_cache(maxsize=4)  # noqa: B019 - cases live as long as the rows
    def root(self, mesh: str) -> DynamicRootStress:
        """Root stress of a mesh."""
        place = self.mesh(mesh)
        return root_stress_in_time(
            read_mesh_strength(self.config, self.line, place),
            self.line,
            place,
            self.response,
        )


def _wheel(case: TimeCase, at: str) -> Any:
    root = case.root(at)
    return root.gears[root.strength.decisive]


def _largest(case: TimeCase, at: str) -> float:
    """Of the pairs of a cycle, over the mesh, Pa."""
    root = case.root(at)
    return typical_largest(
        root.passes[root.strength.decisive], passes_of_a_cycle(case.line, case.mesh(at))
    )


def _fluctuation_ratio(case: TimeCase, at: str) -> float:
    first, second = at.split("/")
    return case.fluctuation(first) / case.fluctuation(second)


def _energy_ratio(case: TimeCase, at: str) -> float:
    """Of the largest lines of two nodes' angular displacements, squared."""
    first, second = at.split("/")
    return float(case.angles(first).max() / case.angles(second).max()) ** 2


def _half_order_share(case: TimeCase, at: str) -> float:
    """Largest line at an odd multiple of order 0.5 over the largest at a whole order."""
    lines = case.angles(at)
    return float(lines[0::2].max() / lines[1::2].max())


def _spectrum_ratio(case: TimeCase, at: str) -> float:
    """Root of the summed squares of all lines of one node's angular displacement over another's."""
    first, second = at.split("/")
    return math.sqrt(
        float(np.sum(case.angles(first) ** 2) / np.sum(case.angles(second) ** 2))
    )


TIMES: dict[str, TimeCheck] = {
    "time.speed_fluctuation": lambda case, at: case.fluctuation(at),
    "time.fluctuation_ratio": _fluctuation_ratio,
    "time.energy_ratio": _energy_ratio,
    "time.spectrum_ratio": _spectrum_ratio,
    "time.half_order_share": _half_order_share,
    "time.order_of_the_largest_line": lambda case, at: (
        0.5 * float(case.angles(at).argmax() + 1)
    ),
    "time.contact_loss": lambda case, at: float(
        case.response.contact_loss[case.mesh(at)]
    ),
    "time.least_tooth_force": lambda case, at: case.tooth_force(at)[0],
    "time.greatest_tooth_force": lambda case, at: case.tooth_force(at)[1],
    "time.root_stress": lambda case, at: float(_wheel(case, at).stress),
    "time.largest_root_stress": _largest,
    "time.stress_ratio": lambda case, at: float(
        _wheel(case, at).stress / _wheel(case.without, at).stress
    ),
    "time.safety_paper": lambda case, at: float(_wheel(case, at).safety.paper),
    "time.safety_iso": lambda case, at: float(_wheel(case, at).safety.iso),
}
