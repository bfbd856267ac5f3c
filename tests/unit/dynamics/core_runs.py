"""Settings of quick records, and machines side by side in the compiled core, step by step."""

from __future__ import annotations

import numpy as np

from gensig.dynamics.backends.group_run import GroupRun
from gensig.dynamics.backends.nystroem import method
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind
from gensig.dynamics.lanes import fill_lanes
from gensig.faults.broken import MissingTooth
from gensig.systems.base import simulate_together
from gensig.systems.run import CleanRecord

# one well-damped drive for all: the same short settling
QUICK = {
    "solver.max_error": None,
    "operating.drive_frequency_hz": 20,
    "gear.pinion.support.damping_x_ns_per_m": 100,
    "gear.wheel.support.damping_x_ns_per_m": 500,
}
PAPER = {
    "mesh.law": "paper",
    "mesh.pair_coupling": "sum",
    "mesh.contact": "linear",
}
CLASSICAL = {"mesh.roll_torque": "classical"}
ROTORS = {
    "system.motor.inertia_kg_m2": 5e-4,
    "system.load.inertia_kg_m2": 5e-3,
}
MISSING = (MissingTooth(gear="pinion", tooth=3),)


def bits(record):
    """Every bit of the signals of a record, and its numbers."""
    assert isinstance(record, CleanRecord), record
    numbers = (
        record.mean_speed,
        record.contact_loss_fraction,
        record.integration_error,
        record.integration_check,
    )
    return (
        record.acceleration.tobytes(),
        record.shaft_angle.tobytes(),
        repr(numbers),
    )


def alone(runs):
    """Records of runs, each simulated on its own."""
    return [simulate_together([single])[0] for single in runs]


def assert_same(records, expected):
    """Raise AssertionError unless all records have the same bits."""
    assert list(map(bits, records)) == list(map(bits, expected))


def assert_independent(runs, orders):
    """Raise AssertionError unless runs in any order have the bits of each alone."""
    expected = alone(runs)
    for order in orders:
        together = simulate_together([runs[k] for k in order])
        assert_same(together, [expected[k] for k in order])


def core_of(machine):
    """The core that integrates a machine."""
    return method.core_of(group_kind(machine.equations))


class CoreRun(GroupRun):
    """Runs one group; the lanes start at rest in static equilibrium at ``first_step``."""

    def __init__(
        self,
        machines,
        step,
        *,
        channels=(1, 5),
        precision="float64",
        first_step=0,
        span=(0.0, 0.0),
        core=None,
    ):
        core = core or core_of(machines[0])
        self.machines = fill_lanes(machines, precision)
        self.step = step
        self.now = first_step
        self.group = core.pack(machines, step, precision, span)
        super().__init__(self.machines, np.array(channels), precision, core)
        for lane in range(self.n_lanes):
            self.restart(lane)

    @property
    def whole(self) -> np.ndarray:
        """q and v with the rest and the rotation of ``center``, (2, dof, lane)."""
        turned = self.group.rotation.reshape(-1, self.n_lanes) * self.center
        return np.stack(
            [
                self.state[0] + self.group.rest + turned,
                self.state[1],
            ]
        )

    def restart(self, lane: int) -> None:
        """Put one lane at rest in its equilibrium at the current time."""
        lost = self.lost[:, lane].copy()
        start = self.machines[lane].start(self.now * self.step)
        self.begin(self.group, lane, *start)
        self.lost[:, lane] = lost

    def means(self, n_steps: int) -> np.ndarray:
        """Mean accelerations over each of the next steps, (step, channel, lane)."""
        shape = n_steps, len(self.channels), self.n_lanes
        means = np.empty(shape, dtype=self.precision)
        nothing = np.empty(0)
        self.core.integrate(
            self.group,
            self.state.ravel(),
            self.lost.ravel(),
            self.fresh,
            self.step,
            self.now,
            n_steps,
            self.channels,
            means.ravel(),
            0,
            nothing,
            -1,
            1,
            nothing,
            self.work,
            self.wide,
            self.near,
        )
        self.now, self.fresh[:] = self.now + n_steps, 0.0
        return means
