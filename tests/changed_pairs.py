"""Gear pairs with other equations than their own, and their motions."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gensig.dynamics.backends.base import Integration
from gensig.dynamics.backends.nystroem.method import Nystroem
from gensig.dynamics.equations import Equations
from gensig.dynamics.pair import PairDynamics


@dataclass(frozen=True, eq=False)
class Changed:
    """A gear pair with other equations, and with a force ``push`` N beside its own, (dof,)."""

    pair: PairDynamics
    equations: Equations
    push: np.ndarray | float = 0.0

    def __getattr__(self, name):
        return getattr(self.pair, name)

    @cached_property
    def stiff_rates(self):
        return self.equations.stiff_rates(np.array([self.pair.mean_mesh_stiffness]))

    def forces(self, times):
        return self.pair.forces(times) + self.push

    def factors(self, times):
        return np.ones((len(times), len(self.equations.sources)))


def motion(*machines, channels, duration=0.02, oversampling=8):
    """Accelerations (channel, sample) of machines side by side, in float64 at 51.2 kHz."""
    integration = Integration(
        sampling_rate=51200.0,
        duration=duration,
        channels=channels,
        with_mesh_state=False,
        oversampling=oversampling,
        precision="float64",
        max_error=None,
    )
    return Nystroem().integrate(machines, integration).acceleration
