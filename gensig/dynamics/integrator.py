"""From a lumped system and its mesh to accelerations at the output rate."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _kernels
from gensig.dynamics._layout import CENTER, N_SEEN, Group
from gensig.dynamics._vector import PRECISIONS, n_lanes
from gensig.dynamics.decimation import Decimator, decimator
from gensig.dynamics.lanes import at_step, fill_lanes, pack
from gensig.dynamics.pair import DOFS, PairDynamics
from gensig.dynamics.system import slowest_decay
from gensig.errors import ConfigError, SimulationError

Array = NDArray[np.float64]

LONGEST_SETTLING = 0.45  # s
# steps per sample of the settling, and how long before the record the next ones take over, s: the slow transient of
# the drive takes nearly all of it; what coarse steps do to it wears off in finer ones, and the record's own end it
COARSE_STABILITY = 0.6  # of the limit: tables may be stiffer than their mean
COARSE = ((1, 0.2), (2, 0.1), (3, 0.02))
# of that time without contact above which it is settled anew in so many steps a sample: hard landings are stiff
BOUNCING, CAREFUL = 0.01, 3
CHECKED = 0.03  # s at the beginning of a record, integrated again at half the step
FINEST = 64  # steps per sample that are tried where the error is too large
SETTLED = 1e-4  # what is left of the start's transient, as a share
STABILITY_LIMIT = 2.6  # |lambda| h of the classical RK4 on the imaginary axis is 2.83, on the real axis 2.79
LONG_STEP = 0.5  # of the same, above which the error may exceed 1e-3
OUT_OF_BOUNDS = 1e6  # m, rad, m/s or rad/s: no machine; a motion that overflows may come back to finite numbers
MOST_BYTES = 2**28  # of the samples of the records that are simulated side by side


class CoarseStepWarning(UserWarning):
    """A step that is stable but too long for the stated error."""

    once = True  # each machine of a plan says it with other numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """How finely to integrate: ``oversampling`` internal steps per output sample, numbers of a ``precision``.

    A record whose error is found to be above ``max_error`` is integrated again with twice as many, up to 64; None
    does not look.
    """

    oversampling: int
    precision: str
    max_error: float | None = None

    def __post_init__(self) -> None:
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(f"solver.oversampling = {self.oversampling} must lie in 2..256")
        if self.precision not in PRECISIONS:
            raise ConfigError(f"solver.precision = {self.precision!r}; allowed: {', '.join(PRECISIONS)}")
        if self.max_error is not None and not 1e-6 <= self.max_error <= 1.0:
            raise ConfigError(f"solver.max_error = {self.max_error:g} must lie in 1e-6..1, or be null")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motions:
    """Accelerations of machines that were integrated side by side, and what the runs tell about themselves.

    ``acceleration`` (lane, channel, sample) m/s2 or rad/s2; ``check`` is the same at half the step, of the beginning
    only; empty where the error is not asked for. ``shaft_angle`` (lane, sample) rad of the pinion since time 0,
    ``seen`` (lane, row, sample) what the core tells of the mesh, empty unless asked for, ``mean_speed`` (lane,) rad/s,
    ``contact_loss_fraction`` (lane,), ``finite`` (lane,) whether all stayed so.
    """

    acceleration: Array
    check: Array
    shaft_angle: Array
    seen: Array
    mean_speed: Array
    contact_loss_fraction: Array
    finite: NDArray[np.bool_]


def settling_time(dynamics: PairDynamics) -> float:
    """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
    rate = slowest_decay(dynamics.system(), dynamics.approach_direction(), dynamics.mean_mesh_stiffness)
    return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / rate)


class _Run:
    """Machines on their way: the state (2, dof, lane), the lost steps (lane,), and the scratch of the compiled core."""

    def __init__(self, lanes: Sequence[PairDynamics], channels: NDArray[np.int64], precision: str) -> None:
        self.n_lanes, self.channels, self.precision = len(lanes), channels, precision
        self.state = np.zeros((2, len(lanes[0].dofs), len(lanes)), dtype=precision)
        self.lost, self.fresh = (np.full(len(lanes), value, dtype=precision) for value in (0.0, 1.0))
        self.work, self.wide, self.near = _kernels.scratch(self.state.shape[1], len(channels), precision)

    @property
    def center(self) -> Array:
        """What the pinions have turned besides ``state``, (lane,) rad; a view."""
        return self.wide.reshape(-1, self.n_lanes)[CENTER]

    def begin(self, group: Group, lane: int, deflection: Array) -> None:
        """Put one lane at rest at a deflection (dof,)."""
        self.state[:, :, lane] = 0.0
        self.state[0, :, lane] = deflection - group.rest[:, lane]
        self.center[lane], self.fresh[lane], self.lost[lane] = 0.0, 1.0, 0.0

    def take(self, other: _Run, lanes: NDArray[np.bool_]) -> None:
        """Go on from where another run has brought some lanes, (lane,); ``again`` must follow."""
        self.state[:, :, lanes], self.center[lanes], self.fresh[lanes] = (
            other.state[:, :, lanes],
            other.center[lanes],
            1.0,
        )

    def again(self) -> _Run:
        """The same state, to be integrated otherwise."""
        other = object.__new__(_Run)
        other.n_lanes, other.channels, other.precision = self.n_lanes, self.channels, self.precision
        other.state, other.lost, other.fresh = self.state.copy(), np.zeros_like(self.lost), np.ones_like(self.fresh)
        other.work, other.wide, other.near = self.work.copy(), self.wide.copy(), self.near.copy()
        return other

    def advance(self, group: Group, step: float, first_step: int, n_steps: int) -> None:
        """Integrate, and go on from there at the next call unless lanes are marked as fresh."""
        nothing = np.empty(0, dtype=self.precision)
        _kernels.integrate(
            group, self.state.ravel(), self.lost, self.fresh, step, first_step, n_steps, self.channels, nothing, -1,
            np.empty(0), -1, 1, np.empty(0), self.work, self.wide, self.near,
        )  # fmt: skip
        self.fresh[:] = 0.0

    def record(
        self, group: Group, step: float, low_pass: Decimator, n_samples: int, *, tell_mesh: bool = False
    ) -> tuple[Array, Array, Array]:
        """Integrate on, from ``low_pass.margin`` samples and a step before time 0, and decimate.

        Returns
        -------
        accelerations (lane, channel, sample), angles of the pinions (lane, sample + 1), and if the mesh shall be told
        of, ``N_SEEN`` rows of it (lane, row, sample), else (lane, 0, sample)
        """
        factor, margin = low_pass.oversampling, low_pass.margin
        out = np.empty((self.n_lanes, len(self.channels), n_samples))
        angle = np.empty((n_samples + 2 * margin, self.n_lanes))
        seen = np.empty((len(angle), N_SEEN if tell_mesh else 0, self.n_lanes))
        taps = low_pass.padded(self.precision)
        n_rows = _kernels.mean_rows(len(taps), factor)
        means = np.empty((n_rows, len(self.channels), self.n_lanes), dtype=self.precision)
        _kernels.record(
            group, self.state.ravel(), self.lost, self.fresh, step, -margin * factor - 1, n_samples, factor,
            taps, self.channels, out.ravel(), angle.ravel(), seen.ravel(), means.ravel(), self.work, self.wide,
            self.near,
        )  # fmt: skip
        told = np.ascontiguousarray(seen[margin : margin + n_samples].transpose(2, 1, 0))
        return out, np.ascontiguousarray(angle[margin : margin + n_samples + 1].T), told


def integrate(
    machines: Sequence[PairDynamics],
    solver: Solver,
    *,
    sampling_rate: float,
    duration: float,
    channels: tuple[str, ...],
    tell_mesh: bool = False,
) -> Motions:
    """Settle every machine by itself, then record ``duration`` from time 0 on.

    The machines share their degrees of freedom, the kind of their mesh law, and what ``settling_oversampling`` says.

    Raises
    ------
    ConfigError    for a channel the system has not
    """
    check_channels(channels, machines[0].dofs)
    precision, fine, low_pass = solver.precision, solver.oversampling, decimator(solver.oversampling)
    lanes = fill_lanes(machines, precision)
    n_samples = count_samples(duration, sampling_rate)
    stages = [
        (steps, -low_pass.margin - left)  # output samples; time 0 is the first recorded one
        for steps, left in settling_stages(machines[0], solver, sampling_rate)
    ]
    end = stages[-1][1]
    # every lane begins in its own time; until then it integrates what nobody looks at
    begins = [min(end - 1, -low_pass.margin - math.ceil(settling_time(machine) * sampling_rate)) for machine in lanes]
    span = min(begins) / sampling_rate, duration + low_pass.margin / sampling_rate
    packed = 1.0 / (sampling_rate * fine)
    group = pack(machines, packed, precision, span)

    def at(oversampling: int) -> tuple[Group, float]:
        step = 1.0 / (sampling_rate * oversampling)
        return at_step(group, packed, step), step

    run = _Run(lanes, np.array([machines[0].dofs.index(name) for name in channels], dtype=np.int64), precision)
    run, bounced = _settled(run, lanes, begins, stages, at)
    careful = [(min(fine, max(CAREFUL, steps)), until) for steps, until in stages]
    if bounced.any() and careful != stages:
        run.take(_settled(run, lanes, begins, careful, at)[0], bounced)
    recording = at(fine)
    run = run.again()
    run.advance(*recording, end * fine, (-low_pass.margin - end) * fine - 1)
    checking = run.again()
    run.lost[:] = 0.0
    acceleration, angle, seen = run.record(*recording, low_pass, n_samples, tell_mesh=tell_mesh)
    check = np.empty((len(lanes), len(channels), 0))
    if solver.max_error is not None:
        finer, finer_low_pass = at(2 * fine), decimator(2 * fine)
        # the settled state stands before the step that is the first here; the finer low-pass may reach less far
        first = -2 * (low_pass.margin * fine + 1)
        wait = -2 * finer_low_pass.margin * fine - 1 - first
        checking.advance(*finer, first, wait)
        n_check = min(n_samples, math.ceil(CHECKED * sampling_rate))
        check, _, _ = checking.record(*finer, finer_low_pass, n_check)
    return Motions(
        acceleration=acceleration,
        check=check,
        shaft_angle=angle[:, :-1],
        seen=seen,
        mean_speed=(angle[:, -1] - angle[:, 0]) * sampling_rate / n_samples,
        contact_loss_fraction=run.lost / ((n_samples + 2 * low_pass.margin - 1) * fine + 1),
        finite=np.asarray((np.abs(run.state) < OUT_OF_BOUNDS).all(axis=(0, 1))),
    )


def _settled(
    run: _Run,
    lanes: Sequence[PairDynamics],
    begins: Sequence[int],
    stages: Sequence[tuple[int, int]],
    at: Callable[[int], tuple[Group, float]],
) -> tuple[_Run, NDArray[np.bool_]]:
    """The machines at the end of the last stage, and which of them were out of contact or bounds on the way, (lane,).

    Each begins at rest at its own output sample; stages are steps per sample and the sample that they lead to.
    """
    now, lost = min(begins), np.zeros(len(lanes))
    for steps, until in stages:
        run, (group, step) = run.again(), at(steps)
        for begin in sorted({begin for begin in begins if now <= begin < until}):
            run.advance(group, step, now * steps, (begin - now) * steps)
            for lane, dynamics in enumerate(lanes):
                if begins[lane] == begin:
                    run.begin(group, lane, dynamics.static_start(begin * steps * step))
                    lost[lane] = 0.0
            now = begin
        if now < until:
            run.advance(group, step, now * steps, (until - now) * steps)
            now = until
        lost += run.lost / steps
    is_wild = ~(np.abs(run.state) < OUT_OF_BOUNDS).all(axis=(0, 1))
    return run, is_wild | (lost > BOUNCING * (now - np.array(begins)))


def settling_oversampling(dynamics: PairDynamics, solver: Solver, sampling_rate: float) -> int:
    """Steps per sample in which a machine begins to settle: as few as are stable, at most those of the record.

    Raises
    ------
    SimulationError    where even the record's step is too long for the stiffest motion
    """
    check_step(dynamics, sampling_rate, solver.oversampling, solver.max_error)
    fastest = float(np.abs(dynamics.stiff_rates).max()) / sampling_rate
    return min(solver.oversampling, math.ceil(fastest / (COARSE_STABILITY * STABILITY_LIMIT)))


def settling_stages(dynamics: PairDynamics, solver: Solver, sampling_rate: float) -> list[tuple[int, int]]:
    """Steps per sample, and how many samples before the record they end, of the stages of settling."""
    least = settling_oversampling(dynamics, solver, sampling_rate)
    return [
        (min(max(oversampling, least), solver.oversampling), math.ceil(left * sampling_rate))
        for oversampling, left in COARSE
    ]


def count_samples(duration: float, sampling_rate: float) -> int:
    """Samples of a record; ConfigError where there is none."""
    n_samples = round(duration * sampling_rate)
    if n_samples < 1:
        raise ConfigError(f"operating.duration_s = {duration:g} holds no sample at {sampling_rate:g} Hz")
    return n_samples


def check_memory(duration: float, sampling_rate: float, n_channels: int, precision: str) -> None:
    """Raise ConfigError for records that would not fit into memory side by side."""
    together = n_lanes(precision)
    n_bytes = count_samples(duration, sampling_rate) * n_channels * together * 8
    if n_bytes > MOST_BYTES:
        longest = duration * MOST_BYTES / n_bytes
        raise ConfigError(
            f"operating.duration_s = {duration:g}: {together} records side by side with {n_channels} channels at "
            f"{sampling_rate:g} Hz take {n_bytes / 2**20:.0f} MiB, more than {MOST_BYTES / 2**20:.0f}; record at most "
            f"{longest:.3g} s at a time"
        )


def check_channels(channels: tuple[str, ...], dofs: tuple[str, ...] = DOFS) -> None:
    """Raise ConfigError for a channel that a machine has not."""
    unknown = [name for name in channels if name not in dofs]
    if unknown:
        raise ConfigError(f"sensing.channels: no channel {', '.join(unknown)}; allowed: {', '.join(dofs)}")


def check_step(dynamics: PairDynamics, sampling_rate: float, oversampling: int, max_error: float | None = None) -> None:
    """Raise SimulationError for a step that RK4 cannot take, warn of a long one where nothing will look at its error.

    With a ``max_error`` records whose error is too large are made again at half the step.
    """
    rates, step = dynamics.stiff_rates, 1.0 / (sampling_rate * oversampling)
    fastest = float(np.abs(rates).max())
    if fastest * step > STABILITY_LIMIT:
        raise SimulationError(
            f"solver.oversampling = {oversampling} makes internal steps of {step:.3g} s, too long for the stiffest "
            f"motion at {fastest / (2 * math.pi):.4g} Hz; raise solver.oversampling to at least "
            f"{math.ceil(oversampling * fastest * step / STABILITY_LIMIT)}"
        )
    oscillating = float(np.abs(np.imag(rates)).max())
    if max_error is None and oscillating * step > LONG_STEP:
        warnings.warn(
            f"{2 * math.pi / (oscillating * step):.1f} internal steps to a period of the mesh mode at "
            f"{oscillating / (2 * math.pi):.4g} Hz, and solver.max_error = null looks at no error, which may exceed "
            f"1e-3: raise solver.oversampling to {math.ceil(oversampling * oscillating * step / LONG_STEP)}, or give "
            "solver.max_error=1e-3",
            CoarseStepWarning,
            stacklevel=2,
        )
