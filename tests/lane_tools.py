"""One machine through the compiled core: its mesh law at many instants, its motion step by step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gensig.dynamics import _kernels
from gensig.dynamics._kernels import law_at
from gensig.dynamics._layout import CENTER, N_LAW, Group
from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.dynamics.pair import PairDynamics

LAW = (
    "normal",
    "friction",
    "moment_p",
    "moment_w",
    "along",
    "stored",
    "lost",
    "loaded",
)
BRIEF = 1e-11  # s; the square of what changes over such a step is nothing, the slopes of gaps over it are not


def laws(dynamics: PairDynamics, motions: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """The mesh law at many instants, (instant, 8), columns as ``LAW`` names them.

    ``motions`` (instant, 4) holds roll, approach, its rate and the roll's rate; they go through the lanes in turn.
    """
    return group_laws(pack([dynamics], step), motions)


def group_laws(group: Group, motions: np.ndarray) -> np.ndarray:
    """The same for a group: instant k is asked of lane k % LANES."""
    motions = np.atleast_2d(np.asarray(motions, dtype=np.float64))
    n = len(motions)
    padded = np.concatenate(
        [motions, np.repeat(motions[-1:], -n % LANES, axis=0)]
    ).reshape(-1, LANES, 4)
    found = np.empty((len(padded), N_LAW, LANES))
    scratch = _kernels.scratch(len(group.force) // LANES, 0)
    for some, law in zip(padded, found, strict=True):
        law_at(group, np.ascontiguousarray(some.T).ravel(), *scratch, law.ravel())
    return found.transpose(0, 2, 1).reshape(-1, N_LAW)[:n]


def law_of(dynamics: PairDynamics, step: float = 1e-6) -> Callable[..., np.ndarray]:
    """The mesh law (8,) as a function of roll, approach, its rate and the roll's rate; the next call overwrites it."""
    group, scratch = pack([dynamics], step), _kernels.scratch(len(dynamics.dofs), 0)
    motion, found = np.empty((4, LANES)), np.empty((N_LAW, LANES))

    def law(*state: float) -> np.ndarray:
        motion[:] = np.array(state)[:, None]
        law_at(group, motion.ravel(), *scratch, found.ravel())
        return found[:, 0]

    return law


def advance(
    dynamics: PairDynamics,
    q: np.ndarray,
    v: np.ndarray,
    step: float,
    first_step: int,
    n_steps: int,
    channels: tuple[int, ...] = (),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q and v (dof,) after some steps, and the mean accelerations over each of them, (channel, step)."""
    return _advance(pack([dynamics], step), q, v, step, first_step, n_steps, channels)


def _advance(group, q, v, step, first_step, n_steps, channels=()):
    index = np.array(channels, dtype=np.int64)
    state = np.repeat(
        np.array([q - group.rest[:, 0], v], dtype=np.float64)[:, :, None], LANES, axis=2
    )
    means = np.empty((n_steps, len(index), LANES))
    work, wide, near = _kernels.scratch(len(q), len(index))
    _kernels.integrate(
        group, state.ravel(), np.zeros(LANES), np.ones(LANES), step, first_step, n_steps, index, means.ravel(), 0,
        np.empty(0), -1, 1, np.empty(0), work, wide, near,
    )  # fmt: skip
    center = (
        wide.reshape(-1, LANES)[CENTER, 0] * group.rotation.reshape(-1, LANES)[:, 0]
    )
    return (
        state[0, :, 0] + group.rest[:, 0] + center,
        state[1, :, 0].copy(),
        means[:, :, 0].T.copy(),
    )


def trajectory(
    dynamics: PairDynamics, q: np.ndarray, v: np.ndarray, step: float, n_steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """q and v at time 0 and at the end of every internal step, (1 + n_steps, dof) each."""
    group, states = pack([dynamics], step), [(q, v)]
    for n in range(n_steps):
        q, v, _ = _advance(group, q, v, step, n, 1)
        states.append((q, v))
    return tuple(np.array(part) for part in zip(*states, strict=True))


def right_hand_side(
    dynamics: PairDynamics, time: float, q: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """q'' at one instant, (dof,): the mean accelerations over two brief steps, led back to their begin."""
    channels = tuple(range(len(dynamics.dofs)))
    short, long = (
        advance(dynamics, q, v, step, round(time / step), 1, channels)[2][:, 0]
        for step in (BRIEF, 2 * BRIEF)
    )
    return 2 * short - long
