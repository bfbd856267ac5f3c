"""What an engine's drive line does in time at one operating point, its teeth free to part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.engine_line import EngineLine
from gensig.driveline.running import (
    Governor,
    OwnMesh,
    mesh_forces,
    running_line,
    steady_course,
)
from gensig.driveline.teeth import ToothLaw, sound_meshes
from gensig.driveline.time.newmark import LineSolver
from gensig.mesh.options import read_mesh_options, read_slice_options
from gensig.options.configuration import Configuration
from gensig.systems.registry import read_material

Array = NDArray[np.float64]

RATE = 10240.0  # Hz, of what is given out: flat to 4 kHz
STEPS = 10  # to a sample: 9.8 us
SETTLING = 0.5  # s
MOST_ENERGY_RESIDUAL = 1e-3
GOVERNOR = Governor(
    frequency=1.0, damping_ratio=0.7
)  # assumed; it holds the mean speed and feels no vibration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeResponse:
    """Motion over some time, teeth free to part.

    ``speed`` (node, sample) rad/s and ``angle`` (node, sample) rad, less the nominal ones, of the
    nodes asked for; ``fluctuation`` (node,) rad/s is half the peak to peak, ``cycle_fluctuation``
    (node,) that of the mean over the cycles, which what does not repeat leaves. ``mesh_force``
    (mesh, sample) N, flat to 4 kHz, with its extremes. ``contact_loss`` and ``back_contact``
    (mesh,) are shares of the time. ``crank_angle`` (sample,) rad is nominal.
    """

    time: Array
    crank_angle: Array
    speed: Array
    angle: Array
    mesh_force: Array
    fluctuation: Array
    cycle_fluctuation: Array
    contact_loss: Array
    back_contact: Array
    least_force: Array
    greatest_force: Array
    energy_residual: float


def own_meshes(
    machine: EngineLine, config: Configuration, speed: float, torque: float
) -> dict[int, OwnMesh]:
    """Tables of sound teeth of the meshes that have any, by their place, each under its mean
    force.
    """
    mesh = config["mesh"]
    law = ToothLaw(
        material=read_material(config),
        options=read_mesh_options(mesh),
        slices=read_slice_options(mesh),
    )
    return sound_meshes(machine, law, mesh_forces(machine, speed, torque))


def time_response(
    machine: EngineLine,
    speed: float,
    torque: float,
    *,
    own: dict[int, OwnMesh],
    nodes: Sequence[int],
    duration: float,
) -> TimeResponse:
    """Integrate at a speed of the crank (rad/s) and a brake torque (N m) for ``duration`` s.

    Raises
    ------
    SimulationError    where the energies do not balance to `MOST_ENERGY_RESIDUAL`
    """
    line = running_line(
        machine, steady_course(speed, torque), governor=GOVERNOR, own=own
    )
    speeds, angles = (
        [(kind, line.dof(node)) for node in nodes] for kind in ("speed", "angle")
    )
    forces = [("mesh_force", place) for place in range(len(machine.mesh_names))]
    solver = LineSolver(
        sampling_rate=RATE, oversampling=STEPS, max_energy_residual=MOST_ENERGY_RESIDUAL
    )
    motion = line.run(
        solver,
        duration=duration,
        channels=list(dict.fromkeys([*speeds, *angles, *forces])),
        settling=SETTLING,
    )
    found, angle, force = (
        np.array([motion.signals[one] for one in channels])
        for channels in (speeds, angles, forces)
    )
    # teeth that never meet on their back flanks cannot pull: below 0 is what the low-pass rings
    force = np.where(motion.back_contact[:, None] > 0.0, force, np.maximum(force, 0.0))
    return TimeResponse(
        time=np.arange(found.shape[1]) / RATE,
        crank_angle=motion.nominal_angle,
        speed=found,
        angle=angle,
        mesh_force=force,
        fluctuation=0.5 * np.ptp(found, axis=1),
        cycle_fluctuation=0.5
        * np.ptp(_mean_cycle(found, motion.nominal_angle), axis=1),
        contact_loss=motion.contact_loss,
        back_contact=motion.back_contact,
        least_force=force.min(axis=1),
        greatest_force=force.max(axis=1),
        energy_residual=motion.energy_residual,
    )


def _mean_cycle(signals: Array, angle: Array, n_points: int = 1440) -> Array:
    """Mean over whole cycles of the crank, (signal, point)."""
    period = 4.0 * np.pi
    n_cycles = max(1, int((angle[-1] - angle[0]) // period))
    at = angle[0] + period * (np.arange(n_cycles * n_points) / n_points)
    return np.array(
        [
            np.interp(at, angle, one).reshape(n_cycles, n_points).mean(axis=0)
            for one in signals
        ]
    )
