"""Integrate a geared shaft line in time: Newmark's average acceleration, contact converged in
every step.

Formulas and what is measured of them: ``docs/theory/motion.md``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Integers
from gensig.driveline.time import _layout as layout
from gensig.driveline.time import _newmark_kernels as kernels
from gensig.driveline.time._layout import Work
from gensig.driveline.time._scheme import NEWMARK
from gensig.driveline.time.line_arrays import (
    elimination_order,
    pack_course,
    pack_line,
    pack_meshes,
    pack_torques,
)
from gensig.dynamics.backends.base import N_SEEN
from gensig.dynamics.decimation import decimator
from gensig.dynamics.equations import Equations
from gensig.dynamics.motion.at_rest import OUT_OF_BOUNDS
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import ConfigError, SimulationError, StepError

KINDS = ("angle", "speed", "acceleration", "mesh_force")
BLOCK = 512  # output samples that are integrated between two passes of the low-pass
LONGEST_STEP = 0.25  # pitches that a mesh may roll in a step


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSolver:
    """Steps of an integration: ``oversampling`` per sample at ``sampling_rate``.

    A run whose energy residual exceeds ``max_energy_residual`` is an error.
    """

    sampling_rate: float
    oversampling: int
    max_energy_residual: float

    def __post_init__(self) -> None:
        if not 0.0 < self.sampling_rate < math.inf:
            raise ConfigError(
                f"line solver: sampling rate {self.sampling_rate:g} Hz must be positive"
            )
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(
                f"line solver: oversampling {self.oversampling} must lie in 2..256"
            )
        if not 0.0 < self.max_energy_residual <= 1.0:
            raise ConfigError(
                f"line solver: max_energy_residual {self.max_energy_residual:g} must lie in 0..1"
            )

    @property
    def step(self) -> float:
        """Internal step, s."""
        return 1.0 / (self.sampling_rate * self.oversampling)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineMotion:
    """Motion of a line.

    signals : by channel, (sample,)    deviations from nominal rotation in rad, rad/s, rad/s2 (m
        for a translation), and mesh forces in N; low-passed means, flat to 0.39 of the sampling
        rate
    nominal_angle, nominal_speed : (sample,)    of the reference, rad and rad/s
    energy_residual : input - dissipated - change of what is stored, over ``throughput`` in J,
        from the start of the integration to its end
    contact_loss, back_contact : (mesh,)    shares of the steps without contact, and on the back
        flanks
    largest_force, least_force : (mesh,) N  at the internal rate
    newton_rounds : mean of a step
    seen : (mesh, row, sample)    state of the pairs, as in ``Motions``; no sample where none was
        asked for
    end : (2, dof)    deviations and their rates where the integration ended
    """

    signals: dict[tuple[str, int], Array]
    nominal_angle: Array
    nominal_speed: Array
    energy_residual: float
    throughput: float
    contact_loss: Array
    back_contact: Array
    largest_force: Array
    least_force: Array
    newton_rounds: float
    seen: Array
    end: Array


def integrate_line(
    line: Dynamics,
    solver: LineSolver,
    *,
    duration: float,
    channels: Sequence[tuple[str, int]],
    lead_in: float = 0.0,
    start: tuple[Array, Array] | None = None,
    with_pairs: bool = False,
) -> LineMotion:
    """Integrate from ``lead_in`` s before time 0 or earlier, and give out ``duration`` s from
    time 0 on.

    Parameters
    ----------
    channels : ("angle" | "speed" | "acceleration", degree of freedom) or ("mesh_force", mesh)
    start : deviations and their rates, (dof,) each, where the integration begins; None is
        ``Dynamics.static_start``
    with_pairs : whether the state of the pairs of teeth is told at every sample

    The low-pass looks ahead and back: integration begins at least ``decimation.Decimator.margin``
    samples and one before time 0, and ends as many after the last.

    Raises
    ------
    ConfigError        for channels, torques or starts that the line has not
    StepError          where the contact does not converge, the energies do not balance, or a
        step passes a tooth
    SimulationError    where the motion leaves all bounds
    """
    n = len(line.dofs)
    _check_channels(line, channels)
    n_samples = round(duration * solver.sampling_rate)
    if n_samples < 1 or not 0.0 <= lead_in < math.inf:
        raise ConfigError(
            f"line: duration {duration:g} s and lead-in {lead_in:g} s hold no sample, or no start"
        )
    for part in start or ():
        if part.shape != (n,) or not np.isfinite(part).all():
            raise ConfigError(
                f"line: start must be finite deviations and rates, ({n},) each"
            )
    step, low_pass = solver.step, decimator(solver.oversampling)
    _check_step(line, step)
    first_sample = -max(low_pass.margin + 1, math.ceil(lead_in * solver.sampling_rate))
    if start is None:
        begin = first_sample / solver.sampling_rate
        start = line.static_start(begin), np.zeros(n)
    run = _Run(line, solver, start, channels)
    if with_pairs:
        run.seen = np.zeros((n_samples, len(line.system.meshes), N_SEEN))
    run.begin(first_sample * solver.oversampling)
    run.skip((-low_pass.margin - first_sample) * solver.oversampling - 1)
    signals = run.record(n_samples)
    angle, speed = line.nominal.over(np.arange(n_samples) / solver.sampling_rate)
    motion = run.motion(signals, angle, speed)
    _check_balance(motion.energy_residual, solver)
    return motion


def _check_balance(residual: float, solver: LineSolver) -> None:
    most = solver.max_energy_residual
    if not residual <= most:
        raise StepError(
            f"line: the energy balance misses {_rounded_above(residual, most)} of what goes "
            f"through, more than {most:g}; raise the oversampling above {solver.oversampling}"
        )


def _rounded_above(value: float, limit: float) -> str:
    """A value in three digits, or in as many as show that it is above a limit."""
    texts = (f"{value:.{digits}g}" for digits in range(3, 18))
    return next((text for text in texts if float(text) > limit), f"{value:.3g}")


class _Run:
    """A line on its way."""

    def __init__(
        self,
        line: Dynamics,
        solver: LineSolver,
        start: tuple[Array, Array],
        channels: Sequence[tuple[str, int]],
    ) -> None:
        self.line, self.course, self.solver = line, pack_course(line), solver
        self.channels = tuple(channels)
        self.order = elimination_order(line.system)
        n_meshes = len(line.system.meshes)
        at_of, step = np.argsort(self.order), solver.step
        self.packed = pack_line(
            line,
            self.order,
            NEWMARK.mass / step**2,
            NEWMARK.damping / step,
            f"with a step of {step:.3g} s",
        )
        self.meshes = pack_meshes(line.system, self.order)
        self.torques = pack_torques(line, self.order)
        self.law, self.work = np.zeros((n_meshes, layout.N_LAW)), _scratch(line.system)
        q, v = (np.array(part[self.order], dtype=np.float64) for part in start)
        mean, force = np.zeros((2, len(q)))
        approach, rate = np.zeros((2, n_meshes))
        self.state = q, v, mean, force, approach, rate, self.law
        self.tally = np.zeros((n_meshes, layout.N_TALLY))
        self.sums = np.zeros(layout.N_SUMS)
        self.chosen = np.empty((len(channels), 2), dtype=np.int64)
        for row, (kind, number) in zip(self.chosen, channels, strict=True):
            row[:] = KINDS.index(kind), number
            if kind != "mesh_force":
                row[1] = at_of[number]
        self.step_index, self.n_steps, self.energy = 0, 0, 0.0
        self.seen = np.zeros((0, n_meshes, N_SEEN))

    def begin(self, step_index: int) -> None:
        """Look at the start, ``step_index`` steps from time 0."""
        self.step_index = step_index
        time = step_index * self.solver.step
        kernels.look(
            self.packed,
            self.meshes,
            self.torques,
            self.course,
            time,
            self.state,
            self.work,
        )
        self.energy = self._energy()

    def _energy(self) -> float:
        q, v, *_ = self.state
        return float(kernels.energy(self.packed, q, v, self.law, self.work))

    def advance(self, n_steps: int, channels: Integers, out: Array) -> None:
        """Integrate on, and give out the means of channels over every step, (step, column)."""
        failed = kernels.advance(
            *(self.packed, self.meshes, self.torques, self.course, self.state),
            *(self.solver.step, self.step_index, n_steps, channels, out),
            *(self.seen, self.solver.oversampling),
            *(self.tally, self.sums, self.work),
        )
        q, v, *_ = self.state
        if failed >= 0:
            raise StepError(
                "line: the mesh forces do not converge at "
                f"{failed * self.solver.step:.6g} s; raise the oversampling"
            )
        self.step_index += n_steps
        self.n_steps += n_steps
        if not max(np.abs(q).max(), np.abs(v).max()) < OUT_OF_BOUNDS:
            worst = self.line.dofs[
                self.order[int(np.argmax(np.maximum(np.abs(q), np.abs(v))))]
            ]
            raise SimulationError(
                f"line: '{worst}' left all bounds before "
                f"{self.step_index * self.solver.step:.6g} s; the torques are not "
                f"balanced, or the step is too long"
            )

    def skip(self, n_steps: int) -> None:
        """Integrate on and give out nothing."""
        nothing = np.empty((0, 2), dtype=np.int64)
        n_block = BLOCK * self.solver.oversampling
        while n_steps > 0:
            self.advance(min(n_steps, n_block), nothing, np.empty((0, 0)))
            n_steps -= n_block

    def record(self, n_samples: int) -> Array:
        """Integrate on from a step before the low-pass's reach, and decimate block by block,
        (channel, sample).
        """
        factor, low_pass = self.solver.oversampling, decimator(self.solver.oversampling)
        n_kept = 2 * low_pass.margin * factor + 1
        means = np.zeros((n_kept + BLOCK * factor, len(self.channels)))
        self.advance(n_kept, self.chosen, means)
        samples = np.empty((n_samples, len(self.channels)))
        for done in range(0, n_samples, BLOCK):
            n_now = min(BLOCK, n_samples - done)
            self.advance(n_now * factor, self.chosen, means[n_kept:])
            filled = means[: n_kept + n_now * factor]
            samples[done : done + n_now] = low_pass.apply_to_columns(filled)
            means[:n_kept] = means[n_now * factor : n_now * factor + n_kept].copy()
        return samples.T

    def motion(self, signals: Array, angle: Array, speed: Array) -> LineMotion:
        """The motion, with the energy balance and the contact statistics of the run."""
        q, v, *_ = self.state
        into = self.sums[layout.INPUT] + self.sums[layout.PASSING]
        # a free vibration has no input: what it began with goes through it
        throughput = self.sums[layout.THROUGHPUT] + self.energy
        residual = into - self.sums[layout.DISSIPATED] - (self._energy() - self.energy)
        energy_residual = 0.0
        if throughput > 0.0:
            energy_residual = abs(residual) / throughput
        at_of = np.argsort(self.order)
        return LineMotion(
            signals={
                channel: np.ascontiguousarray(s)
                for channel, s in zip(self.channels, signals, strict=True)
            },
            nominal_angle=angle,
            nominal_speed=speed,
            energy_residual=energy_residual,
            throughput=float(throughput),
            contact_loss=self.tally[:, layout.APART] / self.n_steps,
            back_contact=self.tally[:, layout.BEHIND] / self.n_steps,
            largest_force=self.tally[:, layout.LARGEST].copy(),
            least_force=self.tally[:, layout.LEAST].copy(),
            newton_rounds=float(self.sums[layout.ROUNDS]) / self.n_steps,
            seen=np.moveaxis(self.seen, 0, -1),
            end=np.array([q[at_of], v[at_of]]),
        )


def _scratch(system: Equations) -> Work:
    n, m = len(system.mass), len(system.meshes)
    tables = [mesh.teeth.table for mesh in system.meshes]
    most = max([1, *[table.n_pairs for table in tables]])
    most_chords = max([1, *[len(table.depth) for table in tables]])
    n_columns = layout.PER_CHORD * most_chords + layout.N_BEHIND
    return Work._make(
        [
            *np.zeros((4, n)),
            *np.zeros((6, m)),
            np.zeros((m, m)),
            np.zeros((m, layout.N_LAW)),
            np.zeros((m, layout.N_FLANKS, most, n_columns)),
            np.full((m, layout.N_FLANKS), -math.inf),
        ]
    )


def _check_channels(line: Dynamics, channels: Sequence[tuple[str, int]]) -> None:
    if not channels:
        raise ConfigError("line: no channel to give out; name at least one")
    for kind, i in channels:
        n = len(line.dofs)
        if kind == "mesh_force":
            n = len(line.system.meshes)
        if kind not in KINDS or not 0 <= i < n:
            raise ConfigError(
                f"line: no channel ({kind!r}, {i}); allowed: {', '.join(KINDS)} of 0..{n - 1}"
            )


def _check_step(line: Dynamics, step: float) -> None:
    for mesh in line.system.meshes:
        turning = abs(float(line.system.rotation[mesh.turn]))
        pitches_per_rad = mesh.teeth.pair.pinion.n_teeth * turning / (2.0 * math.pi)
        rate = pitches_per_rad * line.nominal.with_knots().speed.max()
        if rate * step > LONGEST_STEP:
            raise StepError(
                f"mesh '{mesh.name}' rolls {rate * step:.2g} pitches in a step, its "
                f"teeth pass at {rate:.4g} Hz; raise "
                f"the oversampling {math.ceil(rate * step / LONGEST_STEP)} times"
            )
