"""Motions of machines from a compiled core: groups, settling, record and its check."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.backends.base import OUT_OF_BOUNDS, Integration, Motions
from gensig.dynamics.backends.group_run import Core, GroupRun
from gensig.dynamics.backends.step_limits import FINE_TIME, SETTLING_STEPS
from gensig.dynamics.decimation import decimator
from gensig.dynamics.lanes import at_step, fill_lanes
from gensig.dynamics.motion.dynamics import Dynamics

SHORT_ROWS = "check", "mean_speed", "contact_loss", "finite"  # of ``Motions``
CHECKED = 0.03  # s at the beginning of a record, integrated again at half the step


def integrate_machines(
    machines: Sequence[Dynamics], integration: Integration, core: Core
) -> Motions:
    """Motions of machines, integrated in groups that settle in the same steps."""
    groups = lane_groups(machines, integration, core)
    motions = (
        (group, integrate_group([machines[i] for i in group], integration, core))
        for group in groups
    )
    return in_order(motions, len(machines))


def lane_groups(
    machines: Sequence[Dynamics], integration: Integration, core: Core
) -> list[list[int]]:
    """Indices of the machines of each group; machines of one group settle in the same steps."""
    by_steps: dict[int, list[int]] = {}
    for index, machine in enumerate(machines):
        by_steps.setdefault(settling_steps(machine, integration, core), []).append(
            index
        )
    n = n_lanes(integration.precision)
    return [
        same[first : first + n]
        for same in by_steps.values()
        for first in range(0, len(same), n)
    ]


def settling_steps(machine: Dynamics, integration: Integration, core: Core) -> int:
    """Steps per sample in which a machine settles."""
    fine = integration.oversampling
    stable = core.coarsest_oversampling(machine, fine, integration.sampling_rate)
    return max(stable, min(SETTLING_STEPS, fine))


def in_order(groups: Iterable[tuple[list[int], Motions]], n_machines: int) -> Motions:
    """Motions of all machines, from the motions of groups and the indices of their machines."""
    rows: dict[str, Any] = {
        field.name: [None] * n_machines for field in dataclasses.fields(Motions)
    }
    for indices, motions in groups:
        for name, of_machine in rows.items():
            values = getattr(motions, name)
            if len(indices) < len(values):  # do not keep the lanes without a machine
                values = np.array(values[: len(indices)])
            for lane, index in enumerate(indices):
                of_machine[index] = values[lane]
    for name in SHORT_ROWS:
        rows[name] = np.array(rows[name])
    return Motions(**rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupSteps:
    """The numbers of a group of machines at any number of steps per sample.

    ``packed`` is ``group`` as it was packed, for a step of ``packed_step`` s.
    """

    packed: Any
    packed_step: float
    sampling_rate: float

    def at(self, oversampling: int) -> tuple[Any, float]:
        """The group at so many steps per sample, and the step in s."""
        step = 1.0 / (self.sampling_rate * oversampling)
        return at_step(self.packed, self.packed_step, step), step


def integrate_group(
    machines: Sequence[Dynamics], integration: Integration, core: Core
) -> Motions:
    """Motions of machines in one group, from time 0 on, after they have settled.

    One row a lane: lanes without a machine repeat the first.
    """
    rate, oversampling = integration.sampling_rate, integration.oversampling
    precision = integration.precision
    low_pass, lanes = decimator(oversampling), fill_lanes(machines, precision)
    # output samples; time 0 is the first recorded one
    end = -low_pass.margin - math.ceil(FINE_TIME * rate)
    # every lane begins at a time of its own; its motion before is not used
    durations = [math.ceil(settling_time(machine) * rate) for machine in lanes]
    begins = [min(end - 1, -low_pass.margin - n) for n in durations]
    span = min(begins) / rate, integration.duration + low_pass.margin / rate
    packed_step = 1.0 / (rate * oversampling)
    steps = GroupSteps(
        packed=pack_group(machines, packed_step, precision, span, core),
        packed_step=packed_step,
        sampling_rate=rate,
    )
    channels = [machines[0].dofs.index(name) for name in integration.channels]
    run = GroupRun(lanes, np.array(channels, dtype=np.int64), precision, core)
    coarse = settling_steps(machines[0], integration, core)
    run = settled(run, lanes, begins, end, steps, (coarse, oversampling))
    return recorded(run, steps, integration, end)


def settling_time(machine: Dynamics) -> float:
    """Time after which a machine's start from rest has settled, s."""
    return machine.settling_time


def pack_group(
    machines: Sequence[Dynamics],
    step: float,
    precision: str,
    span: tuple[float, float],
    core: Core,
) -> Any:
    """Machines as a group of a compiled core."""
    return core.pack(machines, step, precision, span)


def settled(
    run: GroupRun,
    lanes: Sequence[Dynamics],
    begins: Sequence[int],
    end: int,
    steps: GroupSteps,
    per_sample: tuple[int, int],
) -> GroupRun:
    """Machines at output sample ``end``, which have settled in coarse steps.

    Those that went out of bounds have settled in the steps of the record: the stiffness of a hard
    landing has no bound, so that no step can be known to be stable in it.

    Parameters
    ----------
    begins : output sample at which each lane begins, at rest
    per_sample : coarse steps and steps of the record per sample
    """
    coarse, fine = per_sample
    run = run_until(run, lanes, begins, end, steps, coarse)
    diverged = ~run.is_within(OUT_OF_BOUNDS)
    if diverged.any() and coarse != fine:
        run.take(run_until(run, lanes, begins, end, steps, fine), diverged)
    return run.restarted()


def run_until(
    run: GroupRun,
    lanes: Sequence[Dynamics],
    begins: Sequence[int],
    end: int,
    steps: GroupSteps,
    n_steps: int,
) -> GroupRun:
    """Machines at output sample ``end`` after so many steps per sample."""
    run, (group, step) = run.restarted(), steps.at(n_steps)
    now = min(begins)
    for begin in sorted(set(begins)):
        run.advance(group, step, now * n_steps, (begin - now) * n_steps)
        for lane, dynamics in enumerate(lanes):
            if begins[lane] == begin:
                start = dynamics.start(begin * n_steps * step)
                run.begin(group, lane, *start)
        now = begin
    run.advance(group, step, now * n_steps, (end - now) * n_steps)
    return run


def recorded(
    run: GroupRun, steps: GroupSteps, integration: Integration, end: int
) -> Motions:
    """Motions of settled machines, which are at output sample ``end``."""
    fine, n_samples = integration.oversampling, integration.n_samples
    low_pass, (group, step) = decimator(fine), steps.at(fine)
    run.advance(group, step, end * fine, (-low_pass.margin - end) * fine - 1)
    checking = run.restarted()
    run.lost[:] = 0.0
    acceleration, angle, seen = run.record(
        group, step, low_pass, n_samples, with_mesh_state=integration.with_mesh_state
    )
    check = np.empty((*acceleration.shape[:2], 0))
    if integration.max_error is not None:
        check = half_step(checking, steps, integration)
    turned = angle[:, 0, -1] - angle[:, 0, 0]
    angle += group.rest[group.angles].T[:, :, None]
    n_steps = (n_samples + 2 * low_pass.margin - 1) * fine + 1
    return Motions(
        acceleration=list(acceleration),
        check=check,
        angle=list(angle[:, :, :-1]),
        seen=list(seen),
        mean_speed=turned * integration.sampling_rate / n_samples,
        contact_loss=run.lost.T / n_steps,
        finite=run.is_within(OUT_OF_BOUNDS),
    )


def half_step(run: GroupRun, steps: GroupSteps, integration: Integration) -> Array:
    """The beginning of the record at half the step, (lane, channel, sample)."""
    fine = integration.oversampling
    low_pass, finer_low_pass = decimator(fine), decimator(2 * fine)
    group, step = steps.at(2 * fine)
    # the settled state is before the step that is the first here; the finer low-pass may be shorter
    first = -2 * (low_pass.margin * fine + 1)
    wait = -2 * finer_low_pass.margin * fine - 1 - first
    run.advance(group, step, first, wait)
    n_check = min(integration.n_samples, math.ceil(CHECKED * integration.sampling_rate))
    return run.record(group, step, finer_low_pass, n_check)[0]
