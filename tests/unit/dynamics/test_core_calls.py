"""Where the compiled core is called, ends, takes rotations together and low-passes leaves no trace."""

from dataclasses import replace

import numpy as np
import pytest
from core_runs import CoreRun
from numpy.testing import assert_allclose

from gensig.dynamics._kernels import BLOCK, RECENTER
from gensig.dynamics._vector import LANES
from gensig.dynamics.decimation import decimator
from gensig.faults.broken import MissingTooth

STEP, N_STEPS = 1 / (51200 * 5), 3000
PAPER = {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear"}
CUTS = [
    (1, 2, 997, 2000),
    (0, 1500, 0, 1500),
    (7,) * 428 + (4,),
    (255, 1, 1, 254, 1, 1, 1, 254, 2232),
]
PINION_TURN, WHEEL_TURN = 2, 5


@pytest.fixture(scope="module", params=["one_sided", "paper"])
def machines(request, machine, dynamics_of):
    """Eight machines of one law: sound and with a missing tooth, light and loaded, fast and slow."""
    law = {} if request.param == "one_sided" else PAPER
    conditions = [
        (1800, 20),
        (2500, 2),
        (1300, 5),
        (900, 60),
        (3600, 20),
        (1800, 1),
        (600, 30),
        (5000, 8),
    ]
    return [
        dynamics_of(
            machine(
                {**law, "operating.speed_rpm": speed, "operating.torque_nm": torque}
            ),
            [MissingTooth(gear="pinion", tooth=1)] if k % 2 else [],
            phase=0.1 * k,
        )
        for k, (speed, torque) in enumerate(conditions)
    ]


def motion(machines, pieces, begins=(0,) * LANES, anew=False):
    """State, means over the steps, lost steps; ``begins`` are steps at which lanes begin."""
    run, means = CoreRun(machines, STEP), []
    for n_steps in pieces:
        for lane, begin in enumerate(begins):
            if begin == run.now:
                run.begin(lane)
        means.append(run.advance(n_steps))
        run.fresh[:] = float(anew)
    return run.whole, np.concatenate(means), run.lost


class TestPieces:
    """Where a call ends leaves no trace; a lane that is new begins anew, the others go on."""

    @pytest.fixture(scope="class")
    @classmethod
    def whole(cls, machines):
        return motion(machines, (N_STEPS,))

    @pytest.mark.parametrize("pieces", CUTS)
    def test_together_make_the_whole(self, machines, whole, pieces):
        assert sum(pieces) == N_STEPS > 10 * RECENTER
        assert [one.tobytes() for one in motion(machines, pieces)] == [
            one.tobytes() for one in whole
        ]

    def test_a_lane_begins_anew_beside_others_that_go_on(self, machines, whole):
        state, means, _ = motion(
            machines, (801, 1199, 1000), begins=(0, 801, 0, 2000, 0, 0, 801, 0)
        )
        others = [0, 2, 4, 5, 7]
        assert state[..., others].tobytes() == whole[0][..., others].tobytes()
        assert means[..., others].tobytes() == whole[1][..., others].tobytes()
        for lane, begin in ((1, 801), (3, 2000), (6, 801)):
            alone = motion(
                [machines[lane]] * LANES,
                (begin, N_STEPS - begin),
                begins=(begin,) * LANES,
            )
            assert state[..., lane].tobytes() == alone[0][..., 0].tobytes()
            assert means[begin:, :, lane].tobytes() == alone[1][begin:, :, 0].tobytes()

    def test_reading_the_tables_anew_would_show(self, machines, whole):
        """All lanes fresh in the middle, from the same states: the last bits differ."""
        halves = motion(machines, (1500, 1500), anew=True)
        assert halves[1][:1500].tobytes() == whole[1][:1500].tobytes()
        assert halves[1].tobytes() != whole[1].tobytes()
        level = whole[1].std(axis=0, keepdims=True)
        assert_allclose(halves[1] / level, whole[1] / level, rtol=0, atol=1e-5)


class TestRecentring:
    """Every 256 steps the pinion's turn is taken out of all rotations: nothing but the numbers' size tells."""

    SHIFT = (
        100  # steps: the same motion, its rotations taken together at other instants
    )

    @pytest.fixture(scope="class")
    @classmethod
    def twins(cls, xiamen, dynamics_of):
        """One machine, and the same whose time began ``SHIFT`` steps earlier, from where the first stands."""
        one = dynamics_of(xiamen, phase=0.3)
        ahead = (
            one.operating.speed
            * cls.SHIFT
            * STEP
            * one.table.pair.pinion.base_radius
            / one.table.pair.base_pitch
        )
        return one, replace(one, start_phase=0.3 - ahead)

    @staticmethod
    def walk(dynamics, first_step, turn=1e-3, n_steps=700):
        """Whole states after every step, (step, 2, dof), and the bare turn, (step,); all begins ``turn`` ahead."""
        run = CoreRun([dynamics], STEP, first_step=first_step)
        run.state[0] += turn * run.group.rotation.reshape(-1, LANES)
        whole, bare = [], []
        for _ in range(n_steps):
            run.advance(1)
            whole.append(run.whole[..., 0])
            bare.append(run.state[0, PINION_TURN, 0])
        return np.array(whole), np.array(bare)

    def test_the_motion_goes_on(self, twins):
        here, there = (
            self.walk(one, first)
            for one, first in zip(twins, (0, self.SHIFT), strict=True)
        )
        level = np.abs(here[0]).max(axis=0)
        assert_allclose(here[0] / level, there[0] / level, rtol=0, atol=1e-11)
        # the same instants: a state that was taken together, and one that was not
        assert here[1].tolist() != there[1].tolist()

    def test_the_state_itself_jumps_where_the_whole_does_not(self, twins):
        whole, bare = self.walk(twins[1], self.SHIFT)
        place = RECENTER - self.SHIFT
        assert_allclose(
            bare[: place - 1], whole[: place - 1, 0, PINION_TURN], rtol=0, atol=0
        )
        assert abs(bare[place] - bare[place - 1]) > 0.5e-3
        assert np.abs(np.diff(whole[:, 0, PINION_TURN], 2)).max() < 1e-6

    @pytest.mark.parametrize("first_step", [0, 1, 255, -256])
    def test_the_turn_is_small_afterwards(self, twins, first_step):
        """At whichever step the core is called first; what is left is what turns between two such instants."""
        whole, bare = self.walk(twins[0], first_step, turn=1e-2, n_steps=600)
        last = max(n for n in range(600) if (first_step + n) % RECENTER == 0)
        assert np.abs(bare[last:]).max() < 2e-4
        assert whole[:, 0, PINION_TURN].min() > 0.9e-2


class TestBlocks:
    """Integrated and low-passed block by block as if all at once."""

    N_FACTOR = 5

    @pytest.mark.parametrize("n_samples", [1, BLOCK - 1, BLOCK, BLOCK + 1, 200])
    def test_samples_are_those_of_one_low_pass_over_all_means(
        self, machines, n_samples
    ):
        low_pass = decimator(self.N_FACTOR)
        first = -low_pass.margin * self.N_FACTOR - 1
        run, whole = (
            CoreRun(machines, STEP, first_step=first, channels=(0, 1, 5))
            for _ in range(2)
        )
        found, _ = run.record(low_pass, n_samples)
        means = whole.advance((n_samples + 2 * low_pass.margin) * self.N_FACTOR + 1)
        assert found.tobytes() == low_pass.apply(means).tobytes()
        assert np.isfinite(found).all()

    def test_a_channel_does_not_depend_on_which_others_are_asked_for(self, machines):
        low_pass = decimator(self.N_FACTOR)
        first = -low_pass.margin * self.N_FACTOR - 1
        three, one = (
            CoreRun(machines, STEP, first_step=first, channels=names).record(
                low_pass, 70
            )[0]
            for names in ((0, 1, 5), (5,))
        )
        assert three[:, 2].tobytes() == one[:, 0].tobytes()

    def test_angles_stand_at_the_begin_of_every_sample(self, machines):
        """Row ``margin`` at time 0: set speed times time, and what the pinion deviates there."""
        low_pass, n_samples = decimator(self.N_FACTOR), 70
        first = -low_pass.margin * self.N_FACTOR - 1
        run, walk = (CoreRun(machines, STEP, first_step=first) for _ in range(2))
        _, angle = run.record(low_pass, n_samples)
        times = np.arange(-low_pass.margin, n_samples + 1) / 51200
        expected = np.empty((len(times), LANES))
        walk.advance(1)
        for row in range(len(times)):
            expected[row] = walk.whole[0, PINION_TURN] + times[row] * speeds(machines)
            walk.advance(self.N_FACTOR)
        assert_allclose(angle[: len(times)], expected, rtol=0, atol=1e-14)
        # a sample earlier or later would be a whole sample's turn
        assert (np.abs(angle[low_pass.margin]) < 0.5 * speeds(machines) / 51200).all()


def speeds(machines):
    return np.array([one.operating.speed for one in machines])
