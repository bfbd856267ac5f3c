"""CPU time of ``gensig generate`` by stage.

The functions of the product run with a clock around each.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

import numpy as np

from benchmarks._measure import least
from gensig.dataset.storage.shard import ShardWriter
from gensig.dynamics import _record_kernels
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.backends import group_motions
from gensig.dynamics.backends.group_run import GroupRun
from gensig.dynamics.decimation import Decimator, decimator
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.production import folder as generation
from gensig.production import shard_writing
from gensig.record import simulate as records
from gensig.record.inputs import InputReader
from gensig.systems import pair_machine, side_by_side

PLAN, TABLES, EQUATIONS = "machine and plan row", "mesh tables", "equations and packing"
SETTLING, RECORDING, CHECKING = (
    "integration: settling",
    "integration: recording",
    "integration: error check",
)
LOW_PASS, NOISE, WRITING, OTHER = (
    "low-pass",
    "noise and labels",
    "HDF5 writing",
    "other",
)
INTEGRATION = (SETTLING, RECORDING, CHECKING)
CLOSING = (
    "closing the folder"  # index, card and pictures: once a data set, whatever its size
)
STAGES = (PLAN, TABLES, EQUATIONS, *INTEGRATION, LOW_PASS, NOISE, WRITING, OTHER)
CLOCKED: tuple[tuple[Any, str, str], ...] = (
    (shard_writing, "_folder_inputs", PLAN),
    (InputReader, "inputs", PLAN),
    (pair_machine, "_mesh_table", TABLES),
    (pair_machine, "running_pair", EQUATIONS),
    (pair_machine, "check_machine", EQUATIONS),
    (group_motions, "settling_time", EQUATIONS),
    (group_motions, "pack_group", EQUATIONS),
    (Dynamics, "static_start", EQUATIONS),
    (GroupRun, "advance", SETTLING),
    (GroupRun, "record", RECORDING),
    (side_by_side, "checks", CHECKING),
    (records, "_record", NOISE),
    (shard_writing, "open_shard", WRITING),
    (ShardWriter, "__enter__", WRITING),
    (ShardWriter, "write", WRITING),
    (ShardWriter, "__exit__", WRITING),
    (generation, "finalize", CLOSING),
)


class Stages:
    """CPU seconds by stage, each without the stages that it calls, and the amount of work.

    ``n_samples`` counts rows of output samples by oversampling; ``n_runs`` the records, twins
    and repetitions.
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys((*STAGES, CLOSING), 0.0)
        self.n_samples: dict[tuple[int, str], int] = {}
        self.n_runs = self.n_repeated = 0
        self._open: list[str] = []
        self._since = time.process_time()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Counts the time of the block for a stage."""
        self._turn()
        self._open.append(name)
        try:
            yield
        finally:
            self._turn()
            self._open.pop()

    def _turn(self) -> None:
        now = time.process_time()
        self.seconds[self._open[-1] if self._open else OTHER] += now - self._since
        self._since = now

    @contextmanager
    def watching(self, n_whole: int) -> Iterator[None]:
        """Clock the product's functions.

        Recordings of fewer samples than ``n_whole`` are those of the error check.
        """
        counted = self._counted(side_by_side.simulate_side_by_side)
        with ExitStack() as patches:
            for owner in (pair_machine, side_by_side):
                patches.enter_context(
                    mock.patch.object(owner, "simulate_side_by_side", counted)
                )
            for owner, name, stage in CLOCKED:
                clocked = self._clocked(getattr(owner, name), stage, n_whole)
                patches.enter_context(mock.patch.object(owner, name, clocked))
            with self.stage(OTHER):
                yield

    def _counted(self, simulate: Callable[..., Any]) -> Callable[..., Any]:
        depth = [0]

        @functools.wraps(simulate)
        def counted(runs: Any) -> Any:
            if depth[0]:
                self.n_repeated += len(runs)
            else:
                self.n_runs += len(runs)
            depth[0] += 1
            try:
                return simulate(runs)
            finally:
                depth[0] -= 1

        return counted

    def _clocked(
        self, function: Callable[..., Any], stage: str, n_whole: int
    ) -> Callable[..., Any]:
        @functools.wraps(function)
        def clocked(*given: Any, **named: Any) -> Any:
            name = stage
            if stage == RECORDING:
                low_pass, n_samples = _low_pass_of(*given, **named)
                name = RECORDING if n_samples == n_whole else CHECKING
                key = low_pass.oversampling, name
                self.n_samples[key] = self.n_samples.get(key, 0) + n_samples
            with self.stage(name):
                return function(*given, **named)

        return clocked

    def separate_low_pass(self, precision: str, n_channels: int, runs: int) -> None:
        """Move what the low-pass costs from the integration, in which it is compiled, to its own
        stage.
        """
        for (oversampling, stage), n_samples in self.n_samples.items():
            spent = n_samples * low_pass_seconds(
                oversampling, precision, n_channels, runs
            )
            self.seconds[stage] -= spent
            self.seconds[LOW_PASS] += spent


def _low_pass_of(
    _run: Any, _group: Any, _step: float, low_pass: Decimator, n_samples: int, **_: Any
) -> tuple[Decimator, int]:
    return low_pass, n_samples


def low_pass_seconds(
    oversampling: int, precision: str, n_channels: int, runs: int
) -> float:
    """CPU seconds of the low-pass for one output sample of a whole group, block by block as in the
    product.
    """
    low_pass, block = decimator(oversampling), _record_kernels.BLOCK
    kind = _record_kernels.LOW_PASS_PRECISION
    taps, width = low_pass.padded(kind), n_lanes(kind)
    n_rows = _record_kernels.step_rows(n_channels * n_lanes(precision), width)
    n_steps = _record_kernels.narrow_steps(len(taps), oversampling)
    means = np.zeros(n_steps * n_rows * width, dtype=kind)
    out, again = np.empty(block * n_rows * width, dtype=kind), 50

    def work() -> None:
        for _ in range(again):
            _record_kernels.low_pass(
                means, 0, taps, oversampling, n_rows, block, out, 0
            )

    work()
    return least(work, runs) / (again * block)
