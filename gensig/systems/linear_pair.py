"""A gear pair as nuisances meet it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.pair import PairDynamics
from gensig.dynamics.response import accelerations
from gensig.sensing.linear_machine import GEAR_AXES, GearShaft, LinearMachine
from gensig.units import check_choice

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# From x to y is +1. The pinion turns the other way: its friction moment is -rho F_f for a force
# +F_f along its x.
SENSE = {"pinion": -1.0, "wheel": 1.0}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LinearPair(LinearMachine):
    """A gear pair whose mesh is held at its mean stiffness and damping."""

    dynamics: PairDynamics

    def shaft(self, gear: str) -> GearShaft:
        """As ``LinearMachine.shaft``, of the pinion or the wheel."""
        check_choice("gear", gear, SENSE)
        dynamics, operating, ratio = self.dynamics, self.dynamics.operating, 1.0
        if gear != "pinion":
            ratio = 1.0 / dynamics.table.pair.ratio
        return GearShaft(
            speed=ratio * operating.speed,
            speed_ratio=ratio,
            set_ratio=ratio,
            torque=operating.torque / ratio,
            mesh_force=dynamics.mesh_force,
            sense=SENSE[gear],
            drives=gear == "pinion",
            body={"pinion": dynamics.pinion, "wheel": dynamics.wheel}[gear],
        )

    def accelerations(
        self, gear: str, frequency: Array, force: Complex, channels: Sequence[str]
    ) -> Complex:
        """As ``LinearMachine.accelerations``; ``gensig.dynamics.response`` has the equation."""
        dofs = self.dynamics.dofs
        on_dofs = np.zeros((len(frequency), len(dofs)), dtype=np.complex128)
        on_dofs[:, [dofs.index(f"{gear}_{axis}") for axis in GEAR_AXES]] = force
        answer = accelerations(self.dynamics, frequency, on_dofs)
        return answer[:, [dofs.index(name) for name in channels]]
