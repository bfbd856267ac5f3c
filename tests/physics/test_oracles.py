"""Other ways to the same motion: another method, periodic motions that nobody settled, other steps
where teeth bounce.

Equations of motion and mesh law are ours, written out in ``test_mesh_reference.py``; the methods
are scipy's.
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import one
from lane_tools import trajectory
from plain_motion import at_rest, equations, solved
from scipy.linalg import expm

from gensig.dynamics.backends.group_run import GroupRun
from gensig.dynamics.backends.nystroem.method import THREE_PAIRS
from gensig.dynamics.lanes import fill_lanes
from gensig.faults.broken import MissingTooth
from gensig.sensing.agreement import agreement
from gensig.systems.base import simulate_together
from gensig.systems.run import Run, Start

SAMPLING_RATE = 51200.0
PHASE = 0.3
NO_CHANNELS = np.empty(0, dtype=np.int64)
RECORDED = [0, 1, 3, 4]  # the channels' degrees of freedom


class TestFourMilliseconds:
    """From rest, at every sample: three meshes, six of whose contacts come or go."""

    N_SAMPLES = 204

    @pytest.fixture(scope="class")
    @classmethod
    def exact(cls, xiamen, running_of):
        """Velocities, (sample, dof)."""
        running = running_of(xiamen, phase=PHASE)
        slope, _ = equations(running.dynamics)
        times = np.arange(cls.N_SAMPLES + 1) / SAMPLING_RATE
        states = solved(slope, at_rest(running.dynamics), times, "DOP853", 1e-11)
        return states[:, 6:]

    @pytest.fixture(scope="class")
    @classmethod
    def error(cls, xiamen, exact, running_of):
        """Largest relative error of a velocity over degrees of freedom, RMS over the samples."""
        running = running_of(xiamen, phase=PHASE)

        def measured(velocities, oversampling):
            step = 1 / (SAMPLING_RATE * oversampling)
            off = velocities(running, step, oversampling, cls.N_SAMPLES) - exact
            lengths = np.linalg.norm(off, axis=0) / np.linalg.norm(exact, axis=0)
            return lengths.max()

        return measured

    @pytest.mark.parametrize(
        ("oversampling", "limit"), [(5, 2e-4), (10, 4e-5), (20, 1e-5)]
    )
    def test_error(self, error, oversampling, limit):
        assert error(velocities_of_the_core, oversampling) < limit

    def test_order(self, error):
        """Above two: what a contact that comes or goes inside a step misses is added after it."""
        coarse, fine = (error(velocities_of_the_core, steps) for steps in (5, 20))
        assert math.log2(coarse / fine) / 2 > 1.7

    def test_the_classical_scheme_that_other_tests_refer_to(self, error):
        assert error(velocities_of_the_reference, 64) < 2e-5


def velocities_of_the_core(running, step, oversampling, n_samples):
    """Velocities from rest at every sample, (sample, dof)."""
    group = THREE_PAIRS.pack([running.dynamics], step, "float64", (0.0, 0.0))
    run = GroupRun(
        fill_lanes([running.dynamics], "float64"), NO_CHANNELS, "float64", THREE_PAIRS
    )
    for lane in range(run.n_lanes):
        run.begin(group, lane, *running.dynamics.start(0.0))
    velocities = [run.state[1, :, 0].copy()]
    for sample in range(n_samples):
        run.advance(group, step, sample * oversampling, oversampling)
        velocities.append(run.state[1, :, 0].copy())
    return np.array(velocities)


def velocities_of_the_reference(running, step, oversampling, n_samples):
    """The same by ``benchmarks._classical_scheme``."""
    start = running.dynamics.start(0.0)
    _, v = trajectory(running, *start, step, n_samples * oversampling)
    return v[::oversampling]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A periodic motion: its period is a mesh period, or a turn of the pinion where a tooth of it
    is faulty.
    """

    speed_rpm: float
    faults: tuple
    period: float  # s
    n_periods: int  # of a record, a whole number of samples

    @property
    def changes(self):
        return {
            "operating.speed_rpm": self.speed_rpm,
            "operating.duration_s": self.n_periods * self.period,
        }

    @property
    def mesh_frequency(self):
        return 23 * self.speed_rpm / 60

    @property
    def lines(self):
        """Harmonics of the period from 20 Hz to 20 kHz."""
        lines = np.arange(1, math.floor(20e3 * self.period) + 1)
        return lines[lines >= 20 * self.period]


CASES = {
    "healthy": Case(
        speed_rpm=1800,
        faults=(),
        period=60 / 1800 / 23,
        n_periods=69,
    ),
    "crack": Case(
        speed_rpm=6000,
        faults=(one("crack", tooth=3),),
        period=60 / 6000,
        n_periods=10,
    ),
}


def periodic_motion(running, period, n_points):
    """States over one period that ends where it began, (n_points + 1, 12): Newton's method on the
    map of the start.

    The map's slope is that of the machine with its mesh held at mean stiffness. The drive holds the
    pinion's angle, so that what is periodic turns at the set speed, and the period is known.
    """
    slope, free = equations(running.dynamics)
    direction = running.approach_direction()
    stiffness = running.mean_mesh_stiffness
    ratio = running.table.options.damping_ratio
    damping = 2 * ratio * math.sqrt(stiffness * running.equivalent_mass)
    mesh = np.concatenate([stiffness * direction, damping * direction])
    held = free.copy()
    held[6:] -= np.outer(direction / running.equations.mass, mesh)
    returns = expm(held * period) - np.eye(12)

    start = at_rest(running.dynamics)
    times = np.linspace(0.0, period, n_points + 1)
    for rtol in (1e-5, 1e-5, 1e-6, 1e-8):
        end = solved(slope, start, times, "LSODA", rtol)[-1]
        start = start - np.linalg.solve(returns, end - start)
    return solved(slope, start, times, "LSODA", 1e-8)


class TestPeriodicMotion:
    @pytest.fixture(scope="class", params=CASES)
    @classmethod
    def case(cls, request):
        return CASES[request.param]

    @pytest.fixture(scope="class")
    @classmethod
    def tile(cls, case, machine, running_of):
        running = running_of(machine(case.changes), case.faults, phase=PHASE)
        return periodic_motion(running, case.period, n_points=8192)

    @pytest.fixture
    def default(self, composed_config):
        """Steps a sample."""
        return composed_config["solver"]["oversampling"]

    @pytest.fixture
    def spectrum(self, case, machine):
        """Complex amplitudes of a record's whole spectrum, (channel, line)."""

        def amplitudes(oversampling, phase=PHASE):
            steps = {
                "solver.oversampling": oversampling,
                "solver.max_error": None,
            }
            system = machine({**case.changes, **steps})
            start = Start(tooth_pinion=0, tooth_wheel=0, phase=phase)
            record = system.simulate(case.faults, start=start)
            return np.fft.rfft(record.acceleration, norm="forward")

        return amplitudes

    @pytest.fixture
    def compared(self, case, tile, spectrum):
        """Delay of a record against the tile, s, and the largest relative error of a channel's
        lines without it.

        The drive is soft: a torque of 1e-7 of the set one turns the pinion on by what 1e-8 s do.
        """
        velocity = np.fft.rfft(
            tile[:-1, 6:],
            axis=0,
            norm="forward",
        )
        turn = 2j * np.pi * case.lines / case.period
        exact = turn * velocity[case.lines][:, RECORDED].T
        jerk = turn * exact

        def measured(*record):
            result = spectrum(*record)[:, case.n_periods * case.lines]
            late = -np.vdot(jerk, result).real / np.linalg.norm(jerk) ** 2
            off = result * np.exp(turn * late) - exact
            error = np.linalg.norm(off, axis=1) / np.linalg.norm(exact, axis=1)
            return late, error.max()

        return measured

    def test_the_tile_closes(self, tile):
        moved = np.ptp(tile, axis=0)
        assert_close(
            (tile[-1] - tile[0]) / moved,
            0.0,
            atol=5e-4,
        )

    def test_it_turns_at_the_set_speed(self, case, tile):
        assert abs(tile[:-1, 8].mean()) < 1e-8 * 2 * np.pi * case.speed_rpm / 60

    def test_a_record_holds_nothing_else(self, case, spectrum, default):
        highest = math.floor(20e3 * case.period * case.n_periods)
        result = spectrum(default)[:, 1:highest]
        between = result.copy()
        between[:, case.n_periods - 1 :: case.n_periods] = 0
        level = np.linalg.norm(result, axis=1)

        assert np.all(np.linalg.norm(between, axis=1) < 5e-4 * level)

    def test_a_record_at_the_default_oversampling(self, case, compared, default):
        late, error = compared(default)
        assert abs(late) * case.mesh_frequency < 1e-4
        assert error < 1e-3

    def test_ten_steps_and_a_later_start(self, case, compared):
        """A start 5e-4 mesh periods further on is early by as much, and nothing else changes."""
        late, error = compared(10, PHASE + 5e-4)
        assert_close(late * case.mesh_frequency, -5e-4, atol=1e-4)
        assert error < 2e-4


class TestOutOfContact:
    """Two teeth missing under 1 N m at 3600 r/min: out of contact for 8 % of the time."""

    @pytest.fixture(scope="class")
    @classmethod
    def records(cls, machine):
        """At ten steps a sample and at twenty."""
        missing = tuple(MissingTooth(gear="pinion", tooth=tooth) for tooth in (3, 4))
        bouncing = {
            "operating.torque_nm": 1.0,
            "operating.speed_rpm": 3600,
            "operating.duration_s": 0.2,
            "solver.max_error": None,
        }
        systems = [machine({**bouncing, "solver.oversampling": n}) for n in (10, 20)]
        return simulate_together([Run(system=each, faults=missing) for each in systems])

    def test_ten_steps_agree_with_twenty(self, records):
        assert min(record.contact_loss_fraction for record in records) > 0.05
        coarse, fine = (record.acceleration[None] for record in records)
        assert agreement(coarse, fine, SAMPLING_RATE).agrees[0]
