"""Quantities of an engine's forced response, by the names that the rows use."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.excitation.engine_torques import (
    Engine,
    EngineTorques,
    engine_torques,
)
from gensig.driveline.linear.forced import (
    Elements,
    SteadyResponse,
    over_cycle,
    steady_response,
)
from gensig.dynamics.linear_system import LinearSystem
from gensig.options.compose import compose

ForcedCheck = Callable[["ForcedCase", str], float]

POINTS = 5760  # of a cycle, over which forces are looked at


@lru_cache(maxsize=16)
def read_forced_case(overrides: tuple[str, ...]) -> ForcedCase:
    """Compose the engine and its line of a row."""
    whole = read_engine_line(compose("generate", overrides))
    assert isinstance(whole.engine, Engine)
    line, meshes = whole.linear()
    return ForcedCase(
        line=line,
        meshes=meshes,
        mesh_names=whole.mesh_names,
        nodes=whole.drive.numbers,
        ratios=whole.ratios,
        engine=whole.engine,
    )


@dataclass(frozen=True, eq=False)
class ForcedCase:
    """An engine on its shaft line at the reference point of its excitation.

    ``nodes`` (dof,) are the node numbers of the degrees of freedom, ``ratios`` their speeds over
    the crank's; ``meshes`` the gear meshes, along their lines of action, by the names
    ``mesh_names``: the two nodes with a slash.
    """

    line: LinearSystem
    meshes: Elements
    mesh_names: tuple[str, ...]
    nodes: tuple[int, ...]
    ratios: Mapping[int, float]
    engine: Engine

    @cached_property
    def torques(self) -> EngineTorques:
        """Torques on the line."""
        reference = self.engine.reference
        return engine_torques(
            self.engine, reference.speed, reference.torque, self.ratios
        )

    @cached_property
    def response(self) -> SteadyResponse:
        """Its steady vibration."""
        return steady_response(
            self.line, self.torques.on(self.nodes), self.engine.reference.speed
        )

    def fluctuation(self, node: str) -> float:
        """Half the peak to peak of a node's speed, rad/s."""
        return float(self.response.fluctuation()[self.nodes.index(int(node))])

    def angle_peak(self, node: str) -> float:
        """Largest line of a node's angular displacement spectrum, rad."""
        return float(np.max(np.abs(self.response.angle[self.nodes.index(int(node))])))

    def tooth_force(self, mesh: str) -> tuple[float, float]:
        """Least and greatest force of a mesh that never loses contact, N."""
        mean, amplitudes = self.response.element_forces(self.meshes)
        row = self.mesh_names.index(mesh)
        force = mean[row] + over_cycle(amplitudes[row], POINTS)
        return float(force.min()), float(force.max())


def _fluctuation_ratio(case: ForcedCase, at: str) -> float:
    """Of two nodes' speeds in r/min, as the paper divides those of shafts that turn at different
    speeds.
    """
    first, second = at.split("/")
    return case.fluctuation(first) / case.fluctuation(second)


def _relative_fluctuation(case: ForcedCase, at: str) -> float:
    """A node's fluctuation over its own mean speed."""
    return case.fluctuation(at) / (case.ratios[int(at)] * case.engine.reference.speed)


def _energy_ratio(case: ForcedCase, at: str) -> float:
    """Of the largest lines of two nodes' angular displacements, squared."""
    first, second = at.split("/")
    return (case.angle_peak(first) / case.angle_peak(second)) ** 2


FORCED: dict[str, ForcedCheck] = {
    "engine.speed_fluctuation": lambda case, at: case.fluctuation(at),
    "engine.fluctuation_ratio": _fluctuation_ratio,
    "engine.relative_fluctuation": _relative_fluctuation,
    "engine.energy_ratio": _energy_ratio,
    "engine.least_tooth_force": lambda case, at: case.tooth_force(at)[0],
    "engine.greatest_tooth_force": lambda case, at: case.tooth_force(at)[1],
    "engine.peak_pressure": lambda case, at: float(case.torques.pressure.max()),
    "engine.firing_gap": lambda case, at: _largest_gap(case.engine),
    "engine.order_of_the_largest_line": lambda case, at: _largest_order(case, at),
}


def _largest_gap(engine: Engine) -> float:
    """Largest crank angle between two firings, rad."""
    angles = np.array(list(engine.layout.firing_angles().values()))
    return float(np.max(np.mod(np.diff(np.append(angles, angles[0])), 4.0 * math.pi)))


def _largest_order(case: ForcedCase, at: str) -> float:
    """Order of the largest line of a node's speed."""
    lines = np.abs(case.response.speed_deviation[case.nodes.index(int(at))])
    return float(case.response.orders[np.argmax(lines)])
