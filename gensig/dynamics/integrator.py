"""From a lumped system and its mesh to accelerations at the output rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _kernels
from gensig.dynamics.pair import PairDynamics
from gensig.dynamics.system import slowest_decay
from gensig.errors import ConfigError, SimulationError
from gensig.mesh.pair_table import N_PAIRS

Array = NDArray[np.float64]

LONGEST_SETTLING = 0.3  # s
SETTLED = 1e-4  # what is left of the start's transient, as a share
STABILITY_LIMIT = 2.6  # |lambda| h of the classical RK4 on the imaginary axis is 2.83, on the real axis 2.79


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """How finely to integrate: ``oversampling`` internal steps per output sample."""

    oversampling: int
    precision: str

    def __post_init__(self) -> None:
        if not 1 <= self.oversampling <= 256:
            raise ConfigError(f"solver.oversampling = {self.oversampling} must lie in 1..256")
        if self.precision != "float64":
            raise ConfigError(f"solver.precision = {self.precision!r}; allowed: float64")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Accelerations at the internal rate, (step, channel) m/s2 or rad/s2, and what the run tells about itself."""

    acceleration: Array
    step: float
    mean_speed: float
    contact_loss_fraction: float


def settling_time(dynamics: PairDynamics) -> float:
    """Time after which the start's transient has fallen to 1e-4 (longest 0.3 s), s."""
    rate = slowest_decay(dynamics.system(), dynamics.approach_direction(), dynamics.mean_mesh_stiffness())
    return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / rate)


def integrate(
    dynamics: PairDynamics, solver: Solver, *, sampling_rate: float, channels: tuple[str, ...], margin: int
) -> Motion:
    """Settle, then record ``duration`` plus ``margin`` output samples on either side for the filter.

    Raises
    ------
    ConfigError        for a channel the system has not
    SimulationError    where the step is too long for the stiffest motion, or a value stops being finite
    """
    system = dynamics.system()
    unknown = [name for name in channels if name not in system.names]
    if unknown:
        raise ConfigError(f"sensing.channels: no channel {', '.join(unknown)}; allowed: {', '.join(system.names)}")
    step = 1.0 / (sampling_rate * solver.oversampling)
    _check_step(dynamics, step)
    mesh, arrays = dynamics.arrays(step), system.arrays()
    index = np.array([system.names.index(name) for name in channels], dtype=np.int64)
    n_samples = round(dynamics.operating.duration * sampling_rate)
    if n_samples < 1:
        raise ConfigError(
            f"operating.duration_s = {dynamics.operating.duration:g} holds no sample at {sampling_rate:g} Hz"
        )
    n_settle = math.ceil(settling_time(dynamics) * sampling_rate) * solver.oversampling
    n_record = (n_samples + 2 * margin) * solver.oversampling
    start = -n_settle - margin * solver.oversampling  # time 0 is the first recorded sample
    q = dynamics.static_start(start * step)
    v = np.zeros_like(q)
    scratch, work = np.empty((5, len(q))), np.empty((6, N_PAIRS))
    out = np.empty((n_record, len(index)))
    n_lost = 0
    _, broken = _kernels.integrate(arrays, mesh, q, v, step, start, n_settle, index, out[:0], scratch, work)
    angle = q[2]
    if broken < 0:
        n_lost, broken = _kernels.integrate(
            arrays, mesh, q, v, step, start + n_settle, n_record, index, out, scratch, work
        )
    if broken >= 0:
        raise SimulationError(
            f"the motion stopped being finite (speed {dynamics.operating.speed * 30 / math.pi:g} r/min, torque "
            f"{dynamics.operating.torque:g} N m); raise solver.oversampling above {solver.oversampling}"
        )
    return Motion(
        acceleration=out,
        step=step,
        mean_speed=dynamics.operating.speed + (q[2] - angle) / (n_record * step),
        contact_loss_fraction=n_lost / n_record,
    )


def _check_step(dynamics: PairDynamics, step: float) -> None:
    """Refuse a step that RK4 cannot take, before anything runs."""
    system = dynamics.system()
    direction = dynamics.approach_direction()
    n = len(system.mass)
    k = (system.stiffness + 1.2 * dynamics.mean_mesh_stiffness() * np.outer(direction, direction)) / system.mass[
        :, None
    ]
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -system.damping / system.mass[:, None]]])
    fastest = float(np.abs(np.linalg.eigvals(state)).max())
    if fastest * step > STABILITY_LIMIT:
        raise SimulationError(
            f"the internal step {step:.3g} s is too long for the stiffest motion at {fastest / (2 * math.pi):.4g} Hz; "
            f"raise solver.oversampling by at least {fastest * step / STABILITY_LIMIT:.2g} times"
        )
