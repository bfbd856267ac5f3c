"""Quantities of an engine's tooth load, its dampers, spectra and waterfalls, by the names that
the rows use.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from gensig.driveline.engine_dampers import (
    DynamicRootStress,
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
    tooth_load,
)
from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.excitation.engine_torques import EngineTorques
from gensig.driveline.linear.forced import (
    SteadyResponse,
    Waterfall,
    disturbance_response,
    run_of_speeds,
)
from gensig.options.compose import compose
from gensig.options.configuration import Configuration

DamperCheck = Callable[["DamperCase", str], float]

WITHOUT = "system.dampers=[]"
RUN_STEP = 10.0 * math.pi / 30.0  # rad/s
RUN_ORDERS = 80  # half orders, as gensig forced-response has them
WATERFALL_NODES = (14, 45, 65)


@lru_cache(maxsize=8)
def read_damper_case(overrides: tuple[str, ...]) -> DamperCase:
    """Compose the engine and its line of a row."""
    config = compose("generate", overrides)
    return DamperCase(config=config, line=read_engine_line(config), overrides=overrides)


@dataclass(frozen=True, eq=False)
class DamperCase:
    """An engine on its line with what dampers it has, at the reference point of its excitation."""

    config: Configuration
    line: EngineLine
    overrides: tuple[str, ...]

    @cached_property
    def response(self) -> SteadyResponse:
        """Its steady vibration."""
        reference = self.line.engine.reference
        return self.line.response(reference.speed, reference.torque)

    @property
    def without(self) -> DamperCase:
        """The same without the dampers."""
        return read_damper_case((*self.overrides, WITHOUT))

    def root(self, mesh: str) -> DynamicRootStress:
        """Root stress of a mesh, the numbers of its two nodes with a slash."""
        first, second = (int(word) for word in mesh.split("/"))
        place = mesh_between(self.line, (first, second))
        strength = read_mesh_strength(self.config, self.line, place)
        return dynamic_root_stress(
            strength, self.line, place, tooth_load(self.line, place, self.response)
        )

    @cached_property
    def waterfalls(self) -> dict[int, Waterfall]:
        """Steady response over the speeds of the Campbell diagram without load, by node."""
        campbell, numbers = self.line.drive.campbell, self.line.drive.numbers
        result = run_of_speeds(
            self.line.linear()[0],
            lambda speed: self.line.on_line(self.line.torques(speed, 0.0)),
            np.arange(
                campbell.low_speed, campbell.high_speed + 0.5 * RUN_STEP, RUN_STEP
            ),
            [numbers.index(node) for node in WATERFALL_NODES],
            n_orders=RUN_ORDERS,
        )
        return dict(zip(WATERFALL_NODES, result, strict=True))

    def peak_on_order(self, at: str) -> float:
        """Frequency in Hz at which an order is largest over the run.

        ``at`` is node and order with a slash.
        """
        node, order = at.split("/")
        run = self.waterfalls[int(node)]
        column = int(np.flatnonzero(run.orders == float(order))[0])
        return float(
            run.speeds[int(run.angle[:, column].argmax())]
            * float(order)
            / (2.0 * math.pi)
        )

    def order(self, node: str, order: float) -> float:
        """Amplitude of an order of a node's angular displacement, rad."""
        line = self.response.angle[self.line.drive.numbers.index(int(node))]
        return float(
            np.abs(line[int(np.flatnonzero(self.response.orders == order)[0])])
        )

    def half_order_share(self, node: str) -> float:
        """Largest line at an odd multiple of order 0.5 over the largest at a whole order."""
        line = np.abs(self.response.angle[self.line.drive.numbers.index(int(node))])
        return float(line[0::2].max() / line[1::2].max())

    def disturbance(self, node: str) -> float:
        """Amplitude of a node's angle at the frequency of the dynamometer's disturbance, rad."""
        numbers, engine = self.line.drive.numbers, self.line.engine
        torques = self.line.torques(engine.reference.speed, engine.reference.torque)
        assert isinstance(torques, EngineTorques)
        moved = disturbance_response(
            self.line.linear()[0],
            numbers.index(torques.disturbance_node),
            torques.disturbance_torque,
            2.0 * math.pi * torques.disturbance_frequency,
        )
        return float(np.abs(moved[numbers.index(int(node))]))


def _wheel(root: DynamicRootStress) -> Any:
    return root.gears[root.strength.decisive]


DAMPERS: dict[str, DamperCheck] = {
    "dampers.root_stress": lambda case, at: float(_wheel(case.root(at)).stress),
    "dampers.largest_root_stress": lambda case, at: _largest(case.root(at)),
    "dampers.safety_paper": lambda case, at: float(_wheel(case.root(at)).safety.paper),
    "dampers.safety_iso": lambda case, at: float(_wheel(case.root(at)).safety.iso),
    "dampers.stress_drop": lambda case, at: (
        1.0 - _stress(case, at) / _stress(case.without, at)
    ),
    "spectrum.half_order_share": lambda case, at: case.half_order_share(at),
    "spectrum.disturbance_over_order_1": lambda case, at: (
        case.disturbance(at) / case.order(at, 1.0)
    ),
    "waterfall.peak_frequency": lambda case, at: case.peak_on_order(at),
}


def _stress(case: DamperCase, at: str) -> float:
    return float(_wheel(case.root(at)).stress)


def _largest(root: DynamicRootStress) -> float:
    """Of all pairs that meet in a cycle, Pa."""
    return float(root.passes[root.strength.decisive].max())
