"""From a lumped system and its mesh to accelerations at the output rate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _kernels
from gensig.dynamics._mesh_kernels import Group
from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import DOFS, PairDynamics
from gensig.dynamics.system import eigenvalues, slowest_decay
from gensig.errors import ConfigError, SimulationError

Array = NDArray[np.float64]

LONGEST_SETTLING = 0.45  # s
# the slow transient of the drive takes nearly all of the settling; coarse steps carry it, fine ones end it
COARSE_OVERSAMPLING = 4
FINE_SETTLING = 0.02  # s
CHECKED = 0.05  # s at the beginning of a record, integrated again at half the step
FINEST = 64  # steps per sample that are tried where the error is too large
SETTLED = 1e-4  # what is left of the start's transient, as a share
STABILITY_LIMIT = 2.6  # |lambda| h of the classical RK4 on the imaginary axis is 2.83, on the real axis 2.79


class CoarseStepWarning(UserWarning):
    """A step that is stable but too long for the stated error."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """How finely to integrate: ``oversampling`` internal steps per output sample.

    A record whose error is found to be above ``max_error`` is integrated again with twice as many, up to 64; None
    does not look.
    """

    oversampling: int
    precision: str
    max_error: float | None = None

    def __post_init__(self) -> None:
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(f"solver.oversampling = {self.oversampling} must lie in 2..256")
        if self.precision != "float64":
            raise ConfigError(f"solver.precision = {self.precision!r}; allowed: float64")
        if self.max_error is not None and not 1e-6 <= self.max_error <= 1.0:
            raise ConfigError(f"solver.max_error = {self.max_error:g} must lie in 1e-6..1, or be null")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motions:
    """Mean accelerations of up to ``LANES`` machines over the internal steps and what the runs tell about themselves.

    ``acceleration`` (channel, step, lane) m/s2 or rad/s2; the first step ends where the first sample of the margin
    lies. ``check`` is the same at half the step, of the beginning only; empty where the error is not asked for.
    ``mean_speed`` (lane,) rad/s, ``contact_loss_fraction`` (lane,), ``finite`` (lane,) whether all stayed so.
    """

    acceleration: Array
    check: Array
    mean_speed: Array
    contact_loss_fraction: Array
    finite: NDArray[np.bool_]


def settling_time(dynamics: PairDynamics) -> float:
    """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
    rate = slowest_decay(dynamics.system(), dynamics.approach_direction(), dynamics.mean_mesh_stiffness())
    return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / rate)


class _Run:
    """A group on its way: the state (2, dof, lane), the lost steps (lane,), and the scratch of the compiled core."""

    def __init__(self, state: Array, index: NDArray[np.int64]) -> None:
        self.state, self.index = state, index
        self.lost, self.fresh = np.zeros(LANES), np.ones(LANES)
        self.scratch = _kernels.scratch(state.shape[1], len(index))

    def advance(self, group: Group, step: float, first_step: int, n_steps: int, out: Array) -> None:
        """Integrate, and go on from there at the next call unless lanes are marked as fresh."""
        state, flat = self.state.ravel(), out.ravel()
        _kernels.integrate(
            group, state, self.lost, self.fresh, step, first_step, n_steps, self.index, flat, *self.scratch
        )
        self.fresh[:] = 0.0


def integrate(
    machines: Sequence[PairDynamics],
    solver: Solver,
    *,
    sampling_rate: float,
    duration: float,
    channels: tuple[str, ...],
    margin: int,
) -> Motions:
    """Settle every machine by itself, then record ``duration`` plus ``margin`` output samples on either side.

    The machines share what ``settling_oversampling`` says of each.

    Raises
    ------
    ConfigError    for a channel the system has not
    """
    check_channels(channels)
    fine = solver.oversampling
    step = 1.0 / (sampling_rate * fine)
    coarse = settling_oversampling(machines[0], solver, sampling_rate)
    n_fine = math.ceil(FINE_SETTLING * sampling_rate)
    n_record = (count_samples(duration, sampling_rate) + 2 * margin) * fine + 1
    index = np.array([DOFS.index(name) for name in channels], dtype=np.int64)
    run = _Run(np.zeros((2, len(DOFS), LANES)), index)
    nothing = np.empty(0)
    end = -margin - n_fine  # output samples; time 0 is the first recorded one
    lanes = _lanes(machines)
    # every lane begins in its own time; until then it integrates what nobody looks at
    begins = [min(end, end + n_fine - math.ceil(settling_time(machine) * sampling_rate)) for machine in lanes]
    group, coarse_step = pack(machines, 1.0 / (sampling_rate * coarse)), 1.0 / (sampling_rate * coarse)
    now = min(begins)
    for begin in sorted(set(begins)):
        run.advance(group, coarse_step, now * coarse, (begin - now) * coarse, nothing)
        for lane, dynamics in enumerate(lanes):
            if begins[lane] == begin:
                run.state[:, :, lane] = 0.0
                run.state[0, :, lane] = dynamics.static_start(begin / sampling_rate)
                run.fresh[lane] = 1.0
        now = begin
    run.advance(group, coarse_step, now * coarse, (end - now) * coarse, nothing)
    group, run.fresh = pack(machines, step), np.ones(LANES)
    run.advance(group, step, end * fine, n_fine * fine - 1, nothing)
    settled = run.state.copy()
    angle, run.lost = run.state[0, DOFS.index("pinion_rotation")].copy(), np.zeros(LANES)
    out = np.empty((len(index), n_record, LANES))
    run.advance(group, step, -margin * fine - 1, n_record, out)
    turned = run.state[0, DOFS.index("pinion_rotation")] - angle
    speed = np.array([dynamics.operating.speed for dynamics in lanes])
    check = np.empty((len(index), 0, LANES))
    if solver.max_error is not None:
        n_check = min(count_samples(duration, sampling_rate), math.ceil(CHECKED * sampling_rate))
        check = np.empty((len(index), (n_check + 2 * margin) * 2 * fine + 1, LANES))
        again = _Run(settled, index)
        finer, first = pack(machines, 0.5 * step), -2 * (margin * fine + 1)
        again.advance(finer, 0.5 * step, first, 1, nothing)
        again.advance(finer, 0.5 * step, first + 1, check.shape[1], check)
    return Motions(
        acceleration=out,
        check=check,
        mean_speed=speed + turned / (n_record * step),
        contact_loss_fraction=run.lost / n_record,
        finite=np.asarray(np.isfinite(run.state).all(axis=(0, 1))),
    )


def settling_oversampling(dynamics: PairDynamics, solver: Solver, sampling_rate: float) -> int:
    """Steps per sample in which a machine settles: few where they are stable, else those of the record.

    Raises
    ------
    SimulationError    where even the record's step is too long for the stiffest motion
    """
    fine = solver.oversampling
    check_step(dynamics, 1.0 / (sampling_rate * fine))
    if fine > COARSE_OVERSAMPLING and _stable(dynamics, 1.0 / (sampling_rate * COARSE_OVERSAMPLING)):
        return COARSE_OVERSAMPLING
    return fine


def _lanes(machines: Sequence[PairDynamics]) -> list[PairDynamics]:
    """One machine a lane; lanes without one repeat the first."""
    return [*machines, *[machines[0]] * (LANES - len(machines))]


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
