"""Simulated seconds per second of one core.

The compiled core, and scipy on the same equations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks import _classical_scheme
from benchmarks._measure import in_turn
from gensig.dynamics._layout import N_LAW
from gensig.dynamics._vector import LANES, n_lanes
from gensig.dynamics.backends.group_run import Core, GroupRun
from gensig.dynamics.backends.nystroem.machine_lanes import pack
from gensig.dynamics.backends.nystroem.method import THREE_PAIRS
from gensig.dynamics.lanes import fill_lanes
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import RunningPair
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run, Start

Array = NDArray[np.float64]
Work = tuple[
    Callable[[], Any], float
]  # what to time, and the seconds that it simulates
RightHandSide = Callable[[float, Array], Array]

SAMPLING_RATE = 51200.0
CHANNELS = np.arange(4)  # x and y of both gears
SETTLING, TIMED = 0.02, 0.1  # s
PER_CALL = 1280  # steps, so that what is stored stays in the cache
SCIPY_SECONDS, SCIPY_RTOL, SCIPY_ATOL = 0.01, 1e-6, 1e-12


def quickstart(
    n_records: int, *words: str
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Configuration and first rows of the quickstart experiment.

    Four classes, each record its own fault and load.
    """
    config = read_request(
        ["experiment=quickstart", f"plan.n_records={n_records}", *words]
    ).config
    plan = make_plan(config)
    return config, [plan.record(place) for place in range(n_records)]


def machines(*words: str, n: int = n_lanes("float32")) -> list[RunningPair]:
    """The machines of as many quickstart records."""
    config, rows = quickstart(n, *words)
    reader = InputReader(config)
    return [running_pair(reader.inputs(row).run) for row in rows]


def two_stage_boxes(n: int = n_lanes("float32")) -> list[Dynamics]:
    """Two-stage gearboxes of ``experiment=two_stage`` that begin at other teeth each."""
    config = read_request(["experiment=two_stage"]).config
    machine = read_machine(config)
    starts = (Start(tooth_pinion=k, tooth_wheel=2 * k, phase=0.3) for k in range(n))
    runs = [Run(system=machine, faults=(), start=start) for start in starts]
    return [machine.ready(run).dynamics for run in runs]


def rates(works: dict[str, Work], runs: int) -> dict[str, float]:
    """Simulated seconds per CPU second of each work, which take turns."""
    spent = in_turn({name: work for name, (work, _) in works.items()}, runs)
    return {name: seconds / spent[name] for name, (_, seconds) in works.items()}


def kernel(
    lanes: Sequence[Dynamics],
    oversampling: int,
    precision: str = "float64",
    core: Core = THREE_PAIRS,
) -> Work:
    """The product's integrator with the mean accelerations of four channels, tables already
    packed.
    """
    step = 1.0 / (SAMPLING_RATE * oversampling)
    group = core.pack(lanes, step, precision, (0.0, 0.0))
    n_settling = round(SETTLING / step)
    settled = GroupRun(fill_lanes(lanes, precision), CHANNELS, precision, core)
    for lane, dynamics in enumerate(fill_lanes(lanes, precision)):
        settled.begin(group, lane, *dynamics.start(0.0))
    settled.advance(group, step, 0, n_settling)
    n_calls = round(TIMED / step / PER_CALL)
    means, nothing = (
        np.empty(PER_CALL * len(CHANNELS) * settled.n_lanes, dtype=precision),
        np.empty(0),
    )

    def work() -> None:
        run = settled.restarted()
        state = run.state.ravel()
        for call in range(n_calls):
            core.integrate(
                group,
                state,
                run.lost.ravel(),
                run.fresh,
                step,
                n_settling + call * PER_CALL,
                PER_CALL,
                CHANNELS,
                means,
                0,
                nothing,
                -1,
                1,
                nothing,
                run.work,
                run.wide,
                run.near,
            )
            run.fresh[:] = 0.0

    return work, len(lanes) * n_calls * PER_CALL * step


def scipy_work(running: RunningPair) -> Work:
    """``solve_ivp`` RK45 at rtol 1e-6 from the static deflection on.

    The right-hand side is NumPy around the product's own compiled law.
    """
    start = np.concatenate(running.dynamics.start(0.0))
    slope = _right_hand_side(running)

    def work() -> None:
        solve_ivp(slope, (0.0, SCIPY_SECONDS), start, rtol=SCIPY_RTOL, atol=SCIPY_ATOL)

    return work, SCIPY_SECONDS


def _right_hand_side(running: RunningPair) -> RightHandSide:
    group, system, direction = (
        pack([running.dynamics], 1e-6),
        running.equations,
        running.approach_direction(),
    )
    n_dof, scratch = (
        len(system.mass),
        _classical_scheme.scratch(1, len(system.mass), "float64"),
    )
    motion, result = np.empty((4, LANES)), np.empty((N_LAW, LANES))
    radius, speed = running.table.pair.pinion.base_radius, running.operating.speed

    def slope(time: float, state: Array) -> Array:
        q, v = state[:n_dof], state[n_dof:]
        roll = running.teeth.start_roll + radius * (speed * time + q[2])
        motion[:] = np.array(
            [roll, direction @ q, direction @ v, radius * (speed + v[2])]
        )[:, None]
        _classical_scheme.law_at(group, motion.ravel(), *scratch, result.ravel())
        normal, friction, moment_p, moment_w, along = result[:5, 0]
        force = (
            running.dynamics.forces(np.zeros(1))[0]
            - system.governed_stiffness @ q
            - system.governed_damping @ v
            - normal * direction
        )
        force[:6] += friction, 0.0, moment_p + radius * along, -friction, 0.0, moment_w
        return np.concatenate([v, force / system.mass])

    return slope
