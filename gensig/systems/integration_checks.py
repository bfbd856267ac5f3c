"""Checks of an integration, and the finer steps of records that need them."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import BOUNCING, FINEST, Motions, Solver
from gensig.errors import SimulationError
from gensig.sensing.agreement import agreement
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord, Run
from gensig.units import from_si

Array = NDArray[np.float64]
MachineT = TypeVar("MachineT", bound=Machine)

# steps per sample above which bouncing records do not converge further
FINEST_BOUNCING = 20


def checks(
    motions: Motions, solver: Solver, sampling_rate: float
) -> tuple[Array, list[str]]:
    """Relative error in the band of every motion, and the result of its check."""
    exact, finite = motions.check, motions.finite
    errors = np.full(len(exact), np.nan)
    if solver.max_error is None:
        return errors, ["none"] * len(exact)
    signal = motions.acceleration[:, :, : exact.shape[2]]
    errors[finite] = in_band_error(signal[finite], exact[finite], sampling_rate)
    verdicts = np.where(errors <= solver.max_error, "error", "unresolved").tolist()
    bouncing = motions.contact_loss.max(axis=1) > BOUNCING
    for index in np.flatnonzero(finite & bouncing & ~(errors <= solver.max_error)):
        row = slice(index, index + 1)
        if agreement(signal[row], exact[row], sampling_rate).agrees[0]:
            verdicts[index] = "levels"
    return errors, verdicts


def is_too_coarse(run: Run[MachineT], record: CleanRecord | SimulationError) -> bool:
    """True for a record whose check failed and that can be made with twice the steps."""
    if isinstance(record, SimulationError) or record.integration_check != "unresolved":
        return False
    finest = FINEST
    if record.contact_loss_fraction > BOUNCING:
        finest = FINEST_BOUNCING
    return 2 * run.system.solver.oversampling <= finest


def finer(run: Run[MachineT]) -> Run[MachineT]:
    """The same run at half the step."""
    solver = run.system.solver
    halved = replace(solver, oversampling=2 * solver.oversampling)
    return replace(run, system=replace(run.system, solver=halved))


def not_finite(run: Run[MachineT]) -> SimulationError:
    """The error of a motion that did not stay finite."""
    operating = run.system.operating
    return SimulationError(
        f"the motion stopped being finite (speed {from_si('speed_rpm', operating.speed):g} "
        f"r/min, torque {operating.torque:g} N m); raise solver.oversampling above "
        f"{run.system.solver.oversampling}"
    )
