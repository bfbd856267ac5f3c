"""Energy and power of a gear pair along trajectories of the compiled integrator."""

from typing import NamedTuple

import numpy as np
from lane_tools import laws, motion_of, trajectory


class Balance(NamedTuple):
    """Energy and power at every internal step, (step,)."""

    energy: np.ndarray  # J, kinetic with true speeds, springs, mesh
    supplied: np.ndarray  # W, drive and load
    supports: np.ndarray  # W lost
    mesh_damping: np.ndarray  # W lost
    friction: np.ndarray  # W, negative when lost
    stored: np.ndarray  # J, mesh only
    step: float

    @property
    def residual(self):
        """Largest imbalance of energy and work over the largest energy stored in the mesh."""
        power = self.supplied - self.supports - self.mesh_damping + self.friction
        gained = np.cumsum(0.5 * (power[1:] + power[:-1])) * self.step
        imbalance = self.energy - self.energy[0] - np.append(0.0, gained)
        return np.abs(imbalance).max() / self.stored.max()


def balance(running, step, n_steps):
    """Balance of a motion from static equilibrium."""
    start = running.dynamics.static_start(0.0)
    q, v = trajectory(
        running,
        start,
        np.zeros(len(start)),
        step,
        n_steps,
    )
    motions = motion_of(
        running,
        step * np.arange(len(q)),
        q,
        v,
    )
    law = laws(running, motions, step)
    _, friction, moment_p, moment_w, _, stored, lost, _ = law.T
    system = running.equations
    turning = np.isin(np.arange(len(start)), (2, 5))
    k = np.diag(system.governed_stiffness)
    c = np.diag(system.governed_damping)
    speeds = v + running.operating.speed * system.rotation
    kinetic = 0.5 * speeds**2 @ system.mass
    elastic = 0.5 * q**2 @ np.where(turning, 0.0, k)
    drive = running.dynamics.forces(np.zeros(1))[0][2] - k[2] * q[:, 2] - c[2] * v[:, 2]
    moments = moment_p * speeds[:, 2] + moment_w * speeds[:, 5]
    return Balance(
        energy=kinetic + elastic + stored,
        supplied=drive * speeds[:, 2]
        + running.dynamics.forces(np.zeros(1))[0][5] * speeds[:, 5],
        supports=v**2 @ np.where(turning, 0.0, c),
        mesh_damping=lost,
        friction=friction * (v[:, 0] - v[:, 3]) + moments,
        stored=stored,
        step=step,
    )
