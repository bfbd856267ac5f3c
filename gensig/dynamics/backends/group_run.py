"""State and scratch of machines that the compiled core integrates side by side."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Flags, Integers
from gensig.dynamics import _record_kernels
from gensig.dynamics._layout import CENTER, N_SEEN
from gensig.dynamics._record_kernels import LOW_PASS_PRECISION
from gensig.dynamics._vector import aligned, n_lanes
from gensig.dynamics.decimation import Decimator
from gensig.dynamics.motion.dynamics import Dynamics

NOTHING = np.empty(0)
NO_TAPS = np.empty(0, dtype=LOW_PASS_PRECISION)


@dataclass(frozen=True, slots=True, kw_only=True)
class Core:
    """A method in compiled functions.

    Parameters
    ----------
    pack : machines of one kind as one group, for a step in s, a precision, and a span in s
    scratch : work rows, float64 rows and integers for meshes, degrees of freedom and precision
    integrate : advances a group in the precision of its scratch
    record : integrates and decimates by it, see ``_record_kernels.recorder``
    coarsest_oversampling : the least stable number of steps per sample of a machine, at most a
        given one, at a sampling rate
    """

    pack: Callable[[Sequence[Dynamics], float, str, tuple[float, float]], Any]
    scratch: Callable[[int, int, str], tuple[NDArray[Any], Array, Integers]]
    integrate: Any
    record: Any
    coarsest_oversampling: Callable[[Dynamics, int, float], int]


class GroupRun:
    """State (2, dof, lane) of machines, their lost steps (mesh, lane), and scratch of the core."""

    def __init__(
        self,
        lanes: Sequence[Dynamics],
        channels: Integers,
        precision: str,
        core: Core,
    ) -> None:
        n_dof, equations = len(lanes[0].dofs), lanes[0].equations
        self.n_meshes, self.n_angles = len(equations.meshes), len(equations.angles)
        self.n_lanes, self.channels, self.precision = len(lanes), channels, precision
        self.core = core
        self.state = aligned(np.zeros((2, n_dof, self.n_lanes), dtype=precision))
        self.lost = aligned(np.zeros((self.n_meshes, self.n_lanes), dtype=precision))
        self.fresh = aligned(np.ones(self.n_lanes, dtype=precision))
        scratch = core.scratch(self.n_meshes, n_dof, precision)
        self.work, self.wide, self.near = map(aligned, scratch)

    @property
    def center(self) -> Array:
        """Rotation of the pinions that ``state`` does not contain, (lane,) rad; a view."""
        return self.wide.reshape(-1, self.n_lanes)[CENTER]

    def is_within(self, bound: float) -> Flags:
        """Lanes whose state is finite and below a bound, (lane,)."""
        return np.asarray((np.abs(self.state) < bound).all(axis=(0, 1)))

    def begin(self, group: Any, lane: int, deflection: Array, rate: Array) -> None:
        """Put one lane at a deflection and its rate, (dof,) each."""
        self.state[0, :, lane] = deflection - group.rest[:, lane]
        self.state[1, :, lane] = rate
        self.center[lane], self.fresh[lane], self.lost[:, lane] = 0.0, 1.0, 0.0

    def take(self, other: GroupRun, lanes: Flags) -> None:
        """Copy the state of some lanes, (lane,), from another run; ``restarted`` must follow."""
        self.state[:, :, lanes] = other.state[:, :, lanes]
        self.center[lanes] = other.center[lanes]
        self.fresh[lanes] = 1.0

    def restarted(self) -> GroupRun:
        """A copy of the run that reads its tables anew, to continue at another step."""
        other = copy.copy(self)
        for name in ("state", "lost", "fresh", "work", "wide", "near"):
            setattr(other, name, aligned(getattr(self, name)))
        other.lost[:], other.fresh[:] = 0.0, 1.0
        return other

    def advance(self, group: Any, step: float, first_step: int, n_steps: int) -> None:
        """Integrate; the next call continues from there unless lanes are marked as fresh."""
        self.core.record(
            group,
            self.state.ravel(),
            self.lost.ravel(),
            self.fresh,
            step,
            first_step,
            n_steps,
            0,
            1,
            NO_TAPS,
            self.channels,
            NOTHING,
            NOTHING,
            NOTHING,
            NOTHING.astype(self.precision),
            NO_TAPS,
            self.work,
            self.wide,
            self.near,
        )

    def record(
        self,
        group: Any,
        step: float,
        low_pass: Decimator,
        n_samples: int,
        *,
        with_mesh_state: bool = False,
    ) -> tuple[Array, Array, Array]:
        """Integrate on, from ``low_pass.margin`` samples and a step before time 0, and decimate.

        Returns
        -------
        accelerations (lane, channel, sample), angles (lane, angle, sample + 1), and ``N_SEEN``
        rows of every mesh (lane, row, sample); no row unless ``with_mesh_state``
        """
        factor, margin = low_pass.oversampling, low_pass.margin
        n_channels, n_seen = len(self.channels), 0
        if with_mesh_state:
            n_seen = N_SEEN * self.n_meshes
        out = np.empty((self.n_lanes, n_channels, n_samples))
        n_rows = n_samples + 2 * margin
        angle = np.empty((n_rows, self.n_angles, self.n_lanes))
        seen = np.empty((len(angle), n_seen, self.n_lanes))
        taps = low_pass.padded(LOW_PASS_PRECISION)
        per_step = n_channels * self.n_lanes
        n_means = _record_kernels.mean_steps(len(taps), factor) * per_step
        width = n_lanes(LOW_PASS_PRECISION)
        n_rows = _record_kernels.step_rows(per_step, width)
        n_narrow = _record_kernels.narrow_steps(len(taps), factor) * n_rows * width
        self.core.record(
            group,
            self.state.ravel(),
            self.lost.ravel(),
            self.fresh,
            step,
            -margin * factor - 1,
            1,
            n_samples,
            factor,
            taps,
            self.channels,
            out.ravel(),
            angle.ravel(),
            seen.ravel(),
            aligned(np.empty(n_means, dtype=self.precision)),
            aligned(np.zeros(n_narrow, dtype=LOW_PASS_PRECISION)),
            self.work,
            self.wide,
            self.near,
        )
        end = margin + n_samples
        angle = np.ascontiguousarray(angle[margin : end + 1].transpose(2, 1, 0))
        return out, angle, np.ascontiguousarray(seen[margin:end].transpose(2, 1, 0))
