"""Motion of an engine's drive line in time at one operating point, its teeth free to part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.running import (
    Governor,
    mesh_forces,
    running_line,
    steady_course,
)
from gensig.driveline.teeth import ToothLaw, sound_meshes
from gensig.driveline.time.newmark import LineSolver
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.mesh.options import refuse_papers_heat
from gensig.options.configuration import Configuration
from gensig.systems.registry import PairParts

RATE = 10240.0  # Hz, of the signals: flat to 4 kHz
SETTLING = 0.5  # s
# ten steps to a sample: 9.8 us
SOLVER = LineSolver(sampling_rate=RATE, oversampling=10, max_energy_residual=1e-3)
# assumed; it holds the mean speed and feels no vibration
GOVERNOR = Governor(frequency=1.0, damping_ratio=0.7)


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


def read_tooth_law(config: Configuration) -> ToothLaw:
    """Material, conventions and slices of a drive line's teeth, which are not modified."""
    parts = PairParts(config)
    return ToothLaw(
        material=parts.material,
        options=refuse_papers_heat(parts.mesh, "a drive line"),
        slices=parts.slices,
    )


def tabulated_meshes(
    machine: EngineLine, law: ToothLaw, speed: float, torque: float
) -> dict[int, MeshTeeth]:
    """Tables of healthy teeth by the index of their mesh, each under its mean force."""
    return sound_meshes(machine, law, mesh_forces(machine, speed, torque))


def time_response(
    machine: EngineLine,
    speed: float,
    torque: float,
    *,
    teeth: dict[int, MeshTeeth],
    nodes: Sequence[int],
    duration: float,
) -> TimeResponse:
    """Integrate at a speed of the crank (rad/s) and a brake torque (N m) for ``duration`` s.

    Raises
    ------
    SimulationError    where the energies do not balance to 1e-3
    """
    line = running_line(
        machine, steady_course(speed, torque), governor=GOVERNOR, teeth=teeth
    )
    speeds = [("speed", line.dof(node)) for node in nodes]
    angles = [("angle", line.dof(node)) for node in nodes]
    forces = [("mesh_force", number) for number in range(len(machine.mesh_names))]
    motion = line.run(
        SOLVER,
        duration=duration,
        channels=list(dict.fromkeys([*speeds, *angles, *forces])),
        settling=SETTLING,
    )
    speed_of_nodes, angle, force = (
        np.array([motion.signals[channel] for channel in channels])
        for channels in (speeds, angles, forces)
    )
    mean_cycle = _mean_cycle(speed_of_nodes, motion.nominal_angle)
    # teeth that never meet on their back flanks cannot pull: below 0 is what the low-pass rings
    force = np.where(motion.back_contact[:, None] > 0.0, force, np.maximum(force, 0.0))
    return TimeResponse(
        time=np.arange(len(motion.nominal_angle)) / RATE,
        crank_angle=motion.nominal_angle,
        speed=speed_of_nodes,
        angle=angle,
        mesh_force=force,
        fluctuation=0.5 * np.ptp(speed_of_nodes, axis=1),
        cycle_fluctuation=0.5 * np.ptp(mean_cycle, axis=1),
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
    cycles = [
        np.interp(at, angle, signal).reshape(n_cycles, n_points) for signal in signals
    ]
    return np.array([cycle.mean(axis=0) for cycle in cycles])
