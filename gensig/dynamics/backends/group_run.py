"""Machines that the compiled core integrates side by side: their state and its scratch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics import _kernels
from gensig.dynamics._layout import CENTER, N_SEEN, Group
from gensig.dynamics.decimation import Decimator
from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]


class GroupRun:
    """State (2, dof, lane) of machines, their lost steps (lane,), and scratch of the compiled
    core.
    """

    def __init__(
        self, lanes: Sequence[PairDynamics], channels: NDArray[np.int64], precision: str
    ) -> None:
        n_dof = len(lanes[0].dofs)
        self.n_lanes, self.channels, self.precision = len(lanes), channels, precision
        self.state = np.zeros((2, n_dof, self.n_lanes), dtype=precision)
        self.lost = np.zeros(self.n_lanes, dtype=precision)
        self.fresh = np.ones(self.n_lanes, dtype=precision)
        self.work, self.wide, self.near = _kernels.scratch(
            n_dof, len(channels), precision
        )

    @property
    def center(self) -> Array:
        """What the pinions have turned besides ``state``, (lane,) rad; a view."""
        return self.wide.reshape(-1, self.n_lanes)[CENTER]

    def is_within(self, bound: float) -> NDArray[np.bool_]:
        """Whether the state of each lane is finite and below a bound, (lane,)."""
        return np.asarray((np.abs(self.state) < bound).all(axis=(0, 1)))

    def begin(self, group: Group, lane: int, deflection: Array) -> None:
        """Put one lane at rest at a deflection (dof,)."""
        self.state[:, :, lane] = 0.0
        self.state[0, :, lane] = deflection - group.rest[:, lane]
        self.center[lane], self.fresh[lane], self.lost[lane] = 0.0, 1.0, 0.0

    def take(self, other: GroupRun, lanes: NDArray[np.bool_]) -> None:
        """Take the state of some lanes, (lane,), from another run; ``again`` must follow."""
        self.state[:, :, lanes] = other.state[:, :, lanes]
        self.center[lanes] = other.center[lanes]
        self.fresh[lanes] = 1.0

    def again(self) -> GroupRun:
        """A copy of the run whose tables are read anew, to go on at another step."""
        other = object.__new__(GroupRun)
        other.n_lanes, other.channels, other.precision = (
            self.n_lanes,
            self.channels,
            self.precision,
        )
        other.state = self.state.copy()
        other.lost, other.fresh = np.zeros_like(self.lost), np.ones_like(self.fresh)
        other.work, other.wide, other.near = (
            self.work.copy(),
            self.wide.copy(),
            self.near.copy(),
        )
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
        self,
        group: Group,
        step: float,
        low_pass: Decimator,
        n_samples: int,
        *,
        tell_mesh: bool = False,
    ) -> tuple[Array, Array, Array]:
        """Integrate on, from ``low_pass.margin`` samples and a step before time 0, and decimate.

        Returns
        -------
        accelerations (lane, channel, sample), angles of the pinions (lane, sample + 1), and
        ``N_SEEN`` rows of the mesh (lane, row, sample); no row unless ``tell_mesh``
        """
        factor, margin = low_pass.oversampling, low_pass.margin
        out = np.empty((self.n_lanes, len(self.channels), n_samples))
        angle = np.empty((n_samples + 2 * margin, self.n_lanes))
        seen = np.empty((len(angle), N_SEEN if tell_mesh else 0, self.n_lanes))
        taps = low_pass.padded(self.precision)
        n_rows = _kernels.mean_rows(len(taps), factor)
        means = np.empty(
            (n_rows, len(self.channels), self.n_lanes), dtype=self.precision
        )
        _kernels.record(
            group, self.state.ravel(), self.lost, self.fresh, step, -margin * factor - 1, n_samples, factor,
            taps, self.channels, out.ravel(), angle.ravel(), seen.ravel(), means.ravel(), self.work, self.wide,
            self.near,
        )  # fmt: skip
        of_mesh = np.ascontiguousarray(
            seen[margin : margin + n_samples].transpose(2, 1, 0)
        )
        return (
            out,
            np.ascontiguousarray(angle[margin : margin + n_samples + 1].T),
            of_mesh,
        )
