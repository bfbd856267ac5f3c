"""Records of the compiled core: recentred rotations, and blocks of any length."""

import numpy as np
import pytest
from closeness import assert_close
from core_runs import CoreRun
from lane_tools import with_teeth

from gensig.dynamics._record_kernels import BLOCK
from gensig.dynamics._vector import LANES, n_lanes
from gensig.dynamics.backends.nystroem._kernels import RECENTER
from gensig.dynamics.decimation import decimator
from gensig.faults.broken import MissingTooth

STEP = 1 / (51200 * 5)
FACTOR = 5
SPEEDS = 1800, 2500, 1300, 900, 3600, 1800, 600, 5000
TORQUES = 20, 2, 5, 60, 20, 1, 30, 8
PINION_TURN = 2


@pytest.fixture(scope="module")
def machines(machine, dynamics_of):
    """Eight machines, sound and with a missing tooth, of many speeds and torques."""
    made = []
    for k, (speed, torque) in enumerate(zip(SPEEDS, TORQUES, strict=True)):
        condition = {
            "operating.speed_rpm": speed,
            "operating.torque_nm": torque,
        }
        faults = [MissingTooth(gear="pinion", tooth=1)] * (k % 2)
        system = machine(condition)
        made.append(dynamics_of(system, faults, phase=0.1 * k))
    return made


class TestRecentring:
    """Every 256 steps the pinion's rotation is moved out of all rotations of the state."""

    SHIFT = 100  # steps: the same motion, recentred at other instants

    @pytest.fixture(scope="class")
    @classmethod
    def twins(cls, xiamen, running_of):
        """One machine, and the same whose time began ``SHIFT`` steps earlier."""
        one = running_of(xiamen, phase=0.3)
        pair = one.table.pair
        roll = one.operating.speed * cls.SHIFT * STEP * pair.pinion.base_radius
        return one, with_teeth(one, start_phase=0.3 - roll / pair.base_pitch)

    @staticmethod
    def walk(running, first_step, turn=1e-3, n_steps=700):
        """Whole states (step, 2, dof) and rotations in the state (step,), from ``turn`` on."""
        run = CoreRun([running.dynamics], STEP, first_step=first_step)
        run.state[0] += turn * run.group.rotation.reshape(-1, LANES)
        whole = []
        bare = []
        for _ in range(n_steps):
            run.means(1)
            whole.append(run.whole[..., 0])
            bare.append(run.state[0, PINION_TURN, 0])
        return np.array(whole), np.array(bare)

    def test_the_motion_is_continuous(self, twins):
        here, bare_here = self.walk(twins[0], 0)
        there, bare_there = self.walk(twins[1], self.SHIFT)
        level = np.abs(here).max(axis=0)

        assert_close(here / level, there / level, atol=1e-11)
        assert bare_here.tolist() != bare_there.tolist()

        jump = RECENTER - self.SHIFT
        turns = there[:, 0, PINION_TURN]
        assert_close(bare_there[: jump - 1], turns[: jump - 1])
        assert abs(bare_there[jump] - bare_there[jump - 1]) > 0.5e-3
        assert np.abs(np.diff(turns, 2)).max() < 1e-6

    @pytest.mark.parametrize("first_step", [1, -256])
    def test_the_rotation_is_small_afterwards(self, twins, first_step):
        whole, bare = self.walk(twins[0], first_step, turn=1e-2, n_steps=600)
        last = max(n for n in range(600) if (first_step + n) % RECENTER == 0)
        assert np.abs(bare[last:]).max() < 2e-4
        assert whole[:, 0, PINION_TURN].min() > 0.9e-2


class TestRecord:
    """Integrated and low-passed block by block as if all at once."""

    LOW_PASS = decimator(FACTOR)
    FIRST = -LOW_PASS.margin * FACTOR - 1

    def run(self, machines, channels=(0, 1, 5)):
        return CoreRun(
            machines,
            STEP,
            first_step=self.FIRST,
            channels=channels,
        )

    def record(self, machines, n_samples, channels=(0, 1, 5)):
        run = self.run(machines, channels)
        return run.record(run.group, STEP, self.LOW_PASS, n_samples)

    def low_passed(self, means):
        """Means (step, channel, lane) to samples as one low-pass of float32 gives them."""
        n_steps, n_channels, n = means.shape
        rows = np.zeros((n_steps, n_channels + n_channels % 2, n), dtype=np.float32)
        rows[:, :n_channels] = means
        samples = self.LOW_PASS.apply(rows.reshape(n_steps, -1, n_lanes("float32")))
        by_channel = samples.transpose(2, 1, 0).reshape(samples.shape[2], -1, n)
        return np.ascontiguousarray(by_channel.transpose(2, 1, 0)[:, :n_channels])

    @pytest.mark.parametrize("n_samples", [1, BLOCK - 1, BLOCK, BLOCK + 1, 200])
    def test_samples_are_those_of_one_low_pass(self, machines, n_samples):
        n_steps = (n_samples + 2 * self.LOW_PASS.margin) * FACTOR + 1
        samples = self.record(machines, n_samples)[0]
        expected = self.low_passed(self.run(machines).means(n_steps))

        assert samples.tobytes() == expected.tobytes()
        assert np.isfinite(samples).all()

        if n_samples == BLOCK + 1:
            alone = self.record(machines, n_samples, (5,))[0]
            assert alone[:, 0].tobytes() == samples[:, 2].tobytes()

    def test_angles_are_those_at_the_begin_of_every_sample(self, machines):
        """The first at time 0: set speed times time, and the deviation of the pinion."""
        n_samples = 70
        walk = self.run(machines)
        angle = self.record(machines, n_samples)[1]
        speed = np.array([machine.nominal.at(0.0).speed for machine in machines])
        walk.means(1 + self.LOW_PASS.margin * FACTOR)
        for sample in range(n_samples + 1):
            turned = walk.whole[0, PINION_TURN] + sample / 51200 * speed
            assert_close(angle[:, 0, sample], turned, atol=1e-14)
            walk.means(FACTOR)

        assert (np.abs(angle[:, 0, 0]) < 0.5 * speed / 51200).all()
