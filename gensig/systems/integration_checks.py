"""Checks of an integration, and the finer steps of records that need them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import (
    BOUNCING,
    FINEST,
    Motions,
    Solver,
    check_machine,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import SimulationError, StepError
from gensig.sensing.agreement import agreement
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord, Run
from gensig.units import from_si

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
    signal = np.stack([rows[:, : exact.shape[2]] for rows in motions.acceleration])
    errors[finite] = in_band_error(signal[finite], exact[finite], sampling_rate)
    verdicts = np.where(errors <= solver.max_error, "error", "unresolved").tolist()
    bouncing = motions.contact_loss.max(axis=1) > BOUNCING
    for index in np.flatnonzero(finite & bouncing & ~(errors <= solver.max_error)):
        row = slice(index, index + 1)
        if agreement(signal[row], exact[row], sampling_rate).agrees[0]:
            verdicts[index] = "levels"
    return errors, verdicts


def check_steps(machine: Dynamics, solver: Solver, sampling_rate: float) -> None:
    """Raise SimulationError for a machine that none of the steps can follow that are tried.

    Without ``max_error`` one length is tried, else also the shorter ones of ``finer``.
    """
    while True:
        try:
            return check_machine(machine, solver, sampling_rate)
        except StepError:
            if solver.max_error is None or 2 * solver.oversampling > FINEST:
                raise
        solver = replace(solver, oversampling=2 * solver.oversampling)


def is_too_coarse(run: Run[MachineT], record: CleanRecord | SimulationError) -> bool:
    """True if a record should be made again by ``finer``; never without ``max_error``."""
    solver = run.system.solver
    if solver.max_error is None:
        return False
    finest = FINEST
    if isinstance(record, CleanRecord):
        if record.integration_check != "unresolved":
            return False
        if record.contact_loss_fraction > BOUNCING:
            finest = FINEST_BOUNCING
    elif not isinstance(record, StepError):
        return False
    return solver.precision == "float32" or 2 * solver.oversampling <= finest


def finer(run: Run[MachineT]) -> Run[MachineT]:
    """The same run at half the step, or first in float64: shorter steps are rounded more often."""
    solver = run.system.solver
    if solver.precision == "float32":
        better = replace(solver, precision="float64")
    else:
        better = replace(solver, oversampling=2 * solver.oversampling)
    return replace(run, system=replace(run.system, solver=better))


def not_finite(run: Run[MachineT], meshes: Sequence[MeshTeeth]) -> StepError:
    """The error of a motion that left all bounds: what may have driven it there, and a remedy."""
    operating, solver = run.system.operating, run.system.solver
    speed_rpm = from_si("speed_rpm", operating.speed)
    step = 1.0 / (run.system.sensing.sampling_rate * solver.oversampling)
    failed = (
        f"the motion stopped being finite (speed {speed_rpm:g} r/min, torque "
        f"{operating.torque:g} N m, steps of {step:.3g} s)"
    )
    remedy = f"raise solver.oversampling above {solver.oversampling}"
    if solver.max_error is None:
        remedy += ", or give solver.max_error=1e-3, which tries finer steps by itself"
    if run.system.mesh.law != "one_sided":
        return StepError(f"{failed}; {remedy}")
    for mesh in meshes:
        backlash_um = from_si("backlash_um", mesh.pair.backlash)
        overlap_um = -from_si("gap_um", float(mesh.nearest_gaps.min()))
        if overlap_um > backlash_um:
            return StepError(
                f"{failed}: teeth stand out by up to {overlap_um:.3g} um along the line of "
                f"action, more than the backlash of {backlash_um:.3g} um, and jam; make the "
                "errors of the gears (quality, fault) smaller or gear.backlash_um larger"
            )
    if solver.max_error is not None:
        remedy = (
            "bring operating.torque_nm nearer to gear.rated_torque_nm, or make the errors of the "
            "gears (quality, fault) smaller"
        )
    return StepError(
        f"{failed}: teeth lose contact, and these steps are too long for their impacts; {remedy}"
    )
