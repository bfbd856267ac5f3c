"""Checks of a drive line before its records are made: sensing, solver, supports."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from gensig.dynamics.backends.registry import DEFAULT_BACKEND
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.driveline.machine import LineMachine

# times the force of the supports; the stiffness of a ball bearing follows its third root
FAR_ABOVE = 3.0


def check_settings(machine: LineMachine) -> None:
    """Raise for channels, sensors and solver options that a drive line does not have."""
    _check_sensing(machine)
    solver = machine.solver
    if machine.mesh.law != "one_sided":
        raise ConfigError(
            f"mesh.law = {machine.mesh.law}: the meshes of a drive line are one-sided; "
            "take mesh.law=one_sided"
        )
    if solver.precision != "float64":
        raise ConfigError(
            f"solver.precision = {solver.precision}: a drive line is integrated in "
            "float64; take solver.precision=float64"
        )
    if solver.backend != DEFAULT_BACKEND:
        raise ConfigError(
            f"solver.backend = {solver.backend}: a drive line has an integrator of "
            f"its own; take solver.backend={DEFAULT_BACKEND}"
        )


def _check_sensing(machine: LineMachine) -> None:
    sensing = machine.sensing
    allowed = machine.channels
    if unknown := [name for name in sensing.channels if name not in allowed]:
        more = ""
        if not machine.engine.drive.lateral:
            more = "; with system.lateral=true also pinion_x and the like"
        raise ConfigError(
            f"sensing.channels: no channel {', '.join(unknown)}; "
            f"allowed: {', '.join(allowed)}{more}"
        )
    if sensing.path is not None or sensing.n_lead or sensing.nuisances:
        option = "geared_line"
        if machine.engine.wheels:
            option = "shaft_line"
        raise ConfigError(
            "sensing: records of a drive line have no transfer path, nuisances or sensor "
            f"dynamics; take sensing={option}"
        )


def warn_of_supports(machine: LineMachine) -> None:
    """Warn of mesh forces far above the force for which the support of all gears is taken."""
    rated = machine.engine.drive.support_force
    if rated is None:
        return
    forces = zip(machine.engine.mesh_names, abs(machine.mesh_forces), strict=True)
    heavy = [
        f"{name} {force:.0f} N" for name, force in forces if force > FAR_ABOVE * rated
    ]
    if heavy:
        warnings.warn(
            f"{machine.engine.drive.name}: mean tooth forces of meshes {', '.join(heavy)}, "
            f"but every gear is on a support for system.support.force_n = {rated:g} N, "
            "less stiff than bearings so loaded; set it, and bearing and shaft, to those of "
            "the gears of system.record_mesh",
            UserWarning,
            stacklevel=3,
        )
