"""Machines side by side in the compiled core, step by step, in calls as long as a test likes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gensig.dynamics import _kernels
from gensig.dynamics._layout import CENTER
from gensig.dynamics.lanes import fill_lanes, pack
from gensig.dynamics.pair import PairDynamics


class CoreRun:
    """State and scratch of one group; the lanes start at rest in static equilibrium at ``first_step``."""

    def __init__(
        self,
        machines: Sequence[PairDynamics],
        step: float,
        *,
        channels: Sequence[int] = (1, 5),
        precision: str = "float64",
        first_step: int = 0,
        span: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.machines, self.step, self.now, self.precision = (
            fill_lanes(machines, precision),
            step,
            first_step,
            precision,
        )
        self.group = pack(machines, step, precision, span)
        self.channels = np.array(channels, dtype=np.int64)
        n = len(self.machines)
        self.state = np.zeros((2, len(machines[0].dofs), n), dtype=precision)
        self.lost, self.fresh = (
            np.zeros(n, dtype=precision),
            np.ones(n, dtype=precision),
        )
        self.now = first_step
        self.work, self.wide, self.near = _kernels.scratch(
            self.state.shape[1], len(channels), precision
        )
        for lane in range(n):
            self.begin(lane)

    @property
    def center(self) -> np.ndarray:
        """What the pinions have turned besides the state, (lane,) rad; a view."""
        return self.wide.reshape(-1, len(self.machines))[CENTER]

    @property
    def whole(self) -> np.ndarray:
        """q and v with the rest and what was taken out of the rotations, (2, dof, lane)."""
        turned = self.group.rotation.reshape(-1, len(self.machines)) * self.center
        return np.stack([self.state[0] + self.group.rest + turned, self.state[1]])

    def begin(self, lane: int) -> None:
        """Put one lane at rest where it would stand now."""
        self.state[:, :, lane] = 0.0
        self.state[0, :, lane] = (
            self.machines[lane].static_start(self.now * self.step)
            - self.group.rest[:, lane]
        )
        self.center[lane], self.fresh[lane] = 0.0, 1.0

    def advance(self, n_steps: int) -> np.ndarray:
        """Mean accelerations over each of some steps, (step, channel, lane)."""
        means = np.empty(
            (n_steps, len(self.channels), len(self.machines)), dtype=self.precision
        )
        _kernels.integrate(
            self.group, self.state.ravel(), self.lost, self.fresh, self.step, self.now, n_steps, self.channels,
            means.ravel(), 0, np.empty(0), -1, 1, np.empty(0), self.work, self.wide, self.near,
        )  # fmt: skip
        self.now, self.fresh[:] = self.now + n_steps, 0.0
        return means

    def record(self, low_pass, n_samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Samples (lane, channel, sample) and the angles (row, lane) that ``record`` of the core gives."""
        n, factor = len(self.machines), low_pass.oversampling
        out = np.full((n, len(self.channels), n_samples), np.nan)
        angle = np.full((n_samples + 2 * low_pass.margin, n), np.nan)
        taps = low_pass.padded(self.precision)
        n_rows = _kernels.mean_rows(len(taps), factor)
        means = np.full((n_rows, len(self.channels), n), np.nan, dtype=self.precision)
        _kernels.record(
            self.group, self.state.ravel(), self.lost, self.fresh, self.step, self.now, n_samples, factor,
            taps, self.channels, out.ravel(), angle.ravel(), np.empty(0), means.ravel(), self.work, self.wide,
            self.near,
        )  # fmt: skip
        return out, angle
