"""One machine in the compiled core: its mesh law at many instants, its motion step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks import _classical_scheme
from gensig.dynamics import _layout as layout
from gensig.dynamics._vector import LANES
from gensig.dynamics.backends.base import Integration
from gensig.dynamics.backends.nystroem.machine_lanes import pack
from gensig.dynamics.backends.nystroem.method import Nystroem
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import Body, RunningPair, Support

LAW = layout.Law._fields
BRIEF = 1e-11  # s; the square of a change over such a step is 0, the slope of a gap over it is not
NO_MEANS = np.empty(0), -1, 1, np.empty(0)


def laws(running: RunningPair, motions: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """The mesh law at many instants, (instant, 8), columns as ``LAW`` names them.

    ``motions`` (instant, 4) holds roll, approach, its rate and the rate of the roll, or four
    such columns that broadcast.
    """
    return group_laws(pack([running.dynamics], step), motions)


def group_laws(group: layout.Group, motions: np.ndarray) -> np.ndarray:
    """The same for a group: instant k is computed in lane k % LANES."""
    if isinstance(motions, tuple):
        motions = np.stack(np.broadcast_arrays(*motions), axis=-1)
    motions = np.atleast_2d(np.asarray(motions, dtype=np.float64))
    n = len(motions)
    padded = np.concatenate([motions, np.repeat(motions[-1:], -n % LANES, axis=0)])
    padded = padded.reshape(-1, LANES, 4)
    laws = np.empty((len(padded), layout.N_LAW, LANES))
    scratch = scratch_of(group)
    for motion, law in zip(padded, laws, strict=True):
        _classical_scheme.law_at(
            group, np.ascontiguousarray(motion.T).ravel(), *scratch, law.ravel()
        )
    return laws.transpose(0, 2, 1).reshape(-1, layout.N_LAW)[:n]


def scratch_of(group):
    """Scratch of the reference for a group."""
    n_dof = len(group.force) // LANES
    return _classical_scheme.scratch(group.n_meshes, n_dof, "float64")


def law_of(dynamics: Dynamics, step: float = 1e-6) -> Callable[..., np.ndarray]:
    """The mesh law (8,) as a function of roll, approach, its rate and the rate of the roll.

    The next call overwrites the result.
    """
    group = pack([dynamics], step)
    scratch = scratch_of(group)
    motion, result = np.empty((4, LANES)), np.empty((layout.N_LAW, LANES))

    def law(*state: float) -> np.ndarray:
        motion[:] = np.array(state)[:, None]
        _classical_scheme.law_at(group, motion.ravel(), *scratch, result.ravel())
        return result[:, 0]

    return law


def with_teeth(running: RunningPair, **changes) -> RunningPair:
    """The pair with some of its teeth's values changed."""
    return replace(running, teeth=replace(running.teeth, **changes))


def on_any_bodies(teeth, force: float, operating) -> RunningPair:
    """A gear pair of some teeth under a mean force in N, on bodies of 1 kg."""
    support = Support(
        stiffness_x=1.0,
        stiffness_y=1.0,
        damping_x=1.0,
        damping_y=1.0,
        stiffness_z=1.0,
        stiffness_tilt=1.0,
    )
    body = Body(mass=1.0, inertia=1.0, support=support, tilt_inertia=1.0)
    torque = force * teeth.pair.pinion.base_radius
    return RunningPair(
        teeth=teeth,
        pinion=body,
        wheel=body,
        operating=replace(operating, torque=torque),
    )


def motion_of(running, times, q, v):
    """Roll, approach, its rate and the rate of the roll at states (time, dof), for ``laws``."""
    radius, speed = running.table.pair.pinion.base_radius, running.operating.speed
    direction = running.approach_direction()
    roll = running.teeth.start_roll + radius * (speed * times + q[..., 2])
    return roll, q @ direction, v @ direction, radius * (speed + v[..., 2])


def advance(running, q, v, step, first_step, n_steps, channels=()):
    """q and v (dof,) after some steps, and mean accelerations over each, (channel, step)."""
    return _advance(
        pack([running.dynamics], step), q, v, step, first_step, n_steps, channels
    )


def _advance(group, q, v, step, first_step, n_steps, channels=()):
    index = np.array(channels, dtype=np.int64)
    start = np.array([q - group.rest[:, 0], v], dtype=np.float64)
    state = np.repeat(start[:, :, None], LANES, axis=2)
    means = np.empty((n_steps, len(index), LANES))
    work, wide, near = scratch_of(group)
    _classical_scheme.integrate(
        group,
        state.ravel(),
        np.zeros(LANES),
        np.ones(LANES),
        step,
        first_step,
        n_steps,
        index,
        means.ravel(),
        0,
        *NO_MEANS,
        work,
        wide,
        near,
    )
    center = wide.reshape(-1, LANES)[layout.CENTER, 0]
    rotation = group.rotation.reshape(-1, LANES)[:, 0]
    whole = state[0, :, 0] + group.rest[:, 0] + center * rotation
    return whole, state[1, :, 0].copy(), means[:, :, 0].T.copy()


def trajectory(running, q, v, step, n_steps):
    """q and v at time 0 and at the end of every internal step, (1 + n_steps, dof) each."""
    group, states = pack([running.dynamics], step), [(q, v)]
    for n in range(n_steps):
        q, v, _ = _advance(group, q, v, step, n, 1)
        states.append((q, v))
    return tuple(np.array(part) for part in zip(*states, strict=True))


def right_hand_side(running, time, q, v):
    """q'' at one instant, (dof,): mean accelerations over two brief steps, extrapolated to 0."""
    channels = tuple(range(len(running.dofs)))
    short, long = (
        advance(running, q, v, step, round(time / step), 1, channels)[2][:, 0]
        for step in (BRIEF, 2 * BRIEF)
    )
    return 2 * short - long


def motions(*machines, channels, duration=0.02, oversampling=8):
    """Accelerations (channel, sample) of machines side by side, in float64 at 51.2 kHz."""
    integration = Integration(
        sampling_rate=51200.0,
        duration=duration,
        channels=channels,
        with_mesh_state=False,
        oversampling=oversampling,
        precision="float64",
        max_error=None,
    )
    return Nystroem().integrate(machines, integration).acceleration
