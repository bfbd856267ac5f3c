"""Checks of a drive line before its records are made: sensing, solver, supports."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.dynamics.backends.registry import EXPLICIT_BACKEND, IMPLICIT_BACKEND
from gensig.dynamics.integrator import Solver
from gensig.errors import ConfigError
from gensig.faults.base import Fault
from gensig.geometry.contact import SIDES
from gensig.mesh.options import MeshOptions
from gensig.mesh.tooth_table import ToothTable
from gensig.systems.base import Machine

LINE_BACKENDS = (EXPLICIT_BACKEND, IMPLICIT_BACKEND)

# times the force of the supports; the stiffness of a ball bearing follows its third root
FAR_ABOVE = 3.0


def check_solver(mesh: MeshOptions, solver: Solver) -> None:
    """Raise for mesh laws and solver options that a drive line does not have."""
    if mesh.law != "one_sided":
        raise ConfigError(
            f"mesh.law = {mesh.law}: the meshes of a drive line are one-sided; "
            "take mesh.law=one_sided"
        )
    if solver.backend not in LINE_BACKENDS:
        raise ConfigError(
            f"solver.backend = {solver.backend}: a drive line has integrators of "
            f"its own; take solver.backend={' or '.join(LINE_BACKENDS)}"
        )
    if solver.backend != EXPLICIT_BACKEND and solver.precision != "float64":
        raise ConfigError(
            f"solver.precision = {solver.precision}: a drive line is integrated in "
            "float64; take solver.precision=float64, or "
            f"solver.backend={EXPLICIT_BACKEND}"
        )


def check_sensing(machine: Machine, *, lateral: bool) -> None:
    """Raise for channels and gears that a drive line does not have, and files that do not fit.

    ``lateral`` says whether its gears move on their bearings.
    """
    sensing, channels = machine.sensing, machine.channels
    if unknown := [name for name in sensing.channels if name not in channels]:
        more = ""
        if not lateral:
            more = "; with system.lateral=true also pinion_x and the like"
        raise ConfigError(
            f"sensing.channels: no channel {', '.join(unknown)}; "
            f"allowed: {', '.join(channels)}{more}"
        )
    for name in machine.gears:
        if name.endswith("tilt"):
            raise ConfigError(
                f"system.gears_csv: a gear named {name} makes channels that read as tilts; "
                "give it another name"
            )
    sensing.check_gears(machine.gears)
    if sensing.nuisances and not lateral:
        raise ConfigError(
            "sensing.nuisances push gears on their bearings, which system.lateral = false holds "
            "still; take system.lateral=true"
        )
    sensing.check(machine.operating.duration)


def require_followed(name: str, faults: Iterable[Fault]) -> None:
    """Raise for faults on gears that the followed mesh, named by its nodes, has not."""
    for fault in faults:
        if fault.gear not in SIDES:
            raise ConfigError(
                f"fault.gear = {fault.gear!r}: the stiffness is that of the mesh "
                f"system.record_mesh {name}; choose a mesh of that gear, where it is pinion or "
                "wheel"
            )


def require_spur(name: str, table: ToothTable) -> None:
    """Raise ConfigError for helical gears of the followed mesh, named by its nodes."""
    if table.is_separable:
        return
    raise ConfigError(
        f"system.record_mesh {name} is of helical gears, which have their stiffness slice by "
        "slice; choose a spur mesh, or take its gears with gensig stiffness system=helical_pair"
    )


def warn_of_supports(engine: EngineLine, mesh_forces: Array) -> None:
    """Warn of mesh forces far above those for which the supports of their gears are taken."""
    rated, line = engine.drive.support_forces, engine.drive.line
    if not rated:
        return
    heavy = []
    meshes = zip(engine.mesh_names, line.meshes, np.abs(mesh_forces), strict=True)
    for name, mesh, force in meshes:
        least = min(rated[mesh.driving], rated[mesh.driven])
        if force > FAR_ABOVE * least:
            heavy.append(f"{name} {force:.0f} N for {least:.0f} N")
    if heavy:
        warnings.warn(
            f"{engine.drive.name}: mean tooth forces of meshes, and those for which the supports "
            f"of their gears are taken: {', '.join(heavy)}. Such supports are less stiff than "
            "bearings so loaded; set excitation.reference.torque_nm to the rated torque, or "
            "system.support.force_n",
            UserWarning,
            stacklevel=3,
        )
