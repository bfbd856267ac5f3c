"""From a lumped system and its mesh to accelerations at the output rate."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _kernels
from gensig.dynamics.pair import DOFS, PairDynamics
from gensig.dynamics.system import eigenvalues, slowest_decay
from gensig.errors import ConfigError, SimulationError

Array = NDArray[np.float64]

LONGEST_SETTLING = 0.45  # s
# the slow transient of the drive takes nearly all of the settling; coarse steps carry it, fine ones end it
COARSE_OVERSAMPLING = 4
FINE_SETTLING = 0.02  # s
SETTLED = 1e-4  # what is left of the start's transient, as a share
STABILITY_LIMIT = 2.6  # |lambda| h of the classical RK4 on the imaginary axis is 2.83, on the real axis 2.79


class CoarseStepWarning(UserWarning):
    """A step that is stable but too long for the stated error."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """How finely to integrate: ``oversampling`` internal steps per output sample."""

    oversampling: int
    precision: str

    def __post_init__(self) -> None:
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(f"solver.oversampling = {self.oversampling} must lie in 2..256")
        if self.precision != "float64":
            raise ConfigError(f"solver.precision = {self.precision!r}; allowed: float64")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Mean accelerations over the internal steps, (channel, step) m/s2 or rad/s2, and what the run tells about itself.

    The first step ends where the first sample of the margin lies.
    """

    acceleration: Array
    step: float
    mean_speed: float
    contact_loss_fraction: float


def settling_time(dynamics: PairDynamics) -> float:
    """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
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
    check_channels(channels)
    step = 1.0 / (sampling_rate * solver.oversampling)
    check_step(dynamics, step)
    mesh, arrays = dynamics.arrays(step), system.arrays()
    index = np.array([system.names.index(name) for name in channels], dtype=np.int64)
    n_samples = count_samples(dynamics.operating.duration, sampling_rate)
    fine = solver.oversampling
    coarse = COARSE_OVERSAMPLING if fine > COARSE_OVERSAMPLING and _stable(dynamics, step * fine / 4) else fine
    n_settle = math.ceil(settling_time(dynamics) * sampling_rate)
    n_fine = min(n_settle, math.ceil(FINE_SETTLING * sampling_rate))
    n_record = (n_samples + 2 * margin) * fine + 1
    begin = -margin - n_fine  # output samples; time 0 is the first recorded one
    coarse_step = step * fine / coarse
    q = dynamics.static_start((begin - n_settle + n_fine) / sampling_rate)
    v = np.zeros_like(q)
    scratch = _kernels.work_arrays(len(q))
    nothing = np.empty((len(index), 0))
    out = np.empty((len(index), n_record))
    angle, n_lost, broken = 0.0, 0, -1
    for width, first, n_steps, target in (
        (coarse_step, (begin - n_settle + n_fine) * coarse, (n_settle - n_fine) * coarse, nothing),
        (step, begin * fine, n_fine * fine - 1, nothing),
        (step, -margin * fine - 1, n_record, out),
    ):
        angle = q[2]
        n_lost, broken = _kernels.integrate(arrays, mesh, q, v, width, first, n_steps, index, target, *scratch)
        if broken >= 0:
            break
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


def _stable(dynamics: PairDynamics, step: float) -> bool:
    return float(np.abs(_rates(dynamics)).max()) * step < 0.5 * STABILITY_LIMIT


def _rates(dynamics: PairDynamics) -> NDArray[np.complex128]:
    """Eigenvalues with the mesh held somewhat above its mean stiffness, 1/s."""
    return eigenvalues(dynamics.system(), dynamics.approach_direction(), 1.2 * dynamics.mean_mesh_stiffness())


def count_samples(duration: float, sampling_rate: float) -> int:
    """Samples of a record; ConfigError where there is none."""
    n_samples = round(duration * sampling_rate)
    if n_samples < 1:
        raise ConfigError(f"operating.duration_s = {duration:g} holds no sample at {sampling_rate:g} Hz")
    return n_samples


def check_channels(channels: tuple[str, ...]) -> None:
    """Raise ConfigError for a channel that a gear pair has not."""
    unknown = [name for name in channels if name not in DOFS]
    if unknown:
        raise ConfigError(f"sensing.channels: no channel {', '.join(unknown)}; allowed: {', '.join(DOFS)}")


def check_step(dynamics: PairDynamics, step: float) -> None:
    """Raise SimulationError for a step that RK4 cannot take, warn of one that is too long to be accurate."""
    rates = _rates(dynamics)
    fastest = float(np.abs(rates).max())
    if fastest * step > STABILITY_LIMIT:
        raise SimulationError(
            f"the internal step {step:.3g} s is too long for the stiffest motion at {fastest / (2 * math.pi):.4g} Hz; "
            f"raise solver.oversampling by at least {fastest * step / STABILITY_LIMIT:.2g} times"
        )
    oscillating = float(np.abs(np.imag(rates)).max())
    if oscillating * step > 0.5:
        warnings.warn(
            f"{2 * math.pi / (oscillating * step):.1f} internal steps to a period of the mesh mode at "
            f"{oscillating / (2 * math.pi):.4g} Hz: the error exceeds 1e-3; raise solver.oversampling",
            CoarseStepWarning,
            stacklevel=2,
        )
