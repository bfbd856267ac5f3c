"""A record has the same bits alone and beside others, whatever they are, in every lane and order."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from fault_cases import one
from numpy.testing import assert_allclose

from gensig.dynamics import _kernels
from gensig.dynamics._vector import LANES
from gensig.dynamics.integrator import Solver, integrate
from gensig.dynamics.lanes import pack
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.sensing.manufacturing import Gearbox, Specimen
from gensig.systems.spur_pair import CleanRecord, Run, Start, simulate_together

LAWS = {
    "one_sided": {},
    "classical": {"mesh.roll_torque": "classical"},
    "paper": {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear"},
    "paper_classical": {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear",
                        "mesh.roll_torque": "classical"},
}  # fmt: skip
MISSING = (MissingTooth(gear="pinion", tooth=3),)
TWO_MISSING = (*MISSING, MissingTooth(gear="pinion", tooth=4))
# one drive for all, damped well: what settles in the same time and in half of it
QUICK = {"operating.duration_s": 0.03, "solver.max_error": None, "solver.oversampling": 8,
         "operating.drive_frequency_hz": 20, "gear.pinion.support.damping_x_ns_per_m": 100,
         "gear.wheel.support.damping_x_ns_per_m": 500}  # fmt: skip
GEOMETRY = {"gear.pinion.n_teeth": 31, "gear.pinion.bore_radius_mm": 12, "gear.wheel.n_teeth": 61,
            "gear.backlash_um": 10, "mesh.points_per_pitch": 256, "mesh.damping_ratio": 0.03}  # fmt: skip
PROUD = 0.03  # m, of an error at which a tooth throws the motion out of all bounds
# a damper across the mesh that the light pinion overshoots in a step; where teeth have gaps it would only bounce
OVERDAMPED = {"mesh.damping_ratio": 1.0, "gear.pinion.mass_kg": 0.006}


@pytest.fixture(scope="module")
def run(machine):
    """A run of the quick machine with keys replaced."""

    def make(changes=None, faults=(), **values):
        return Run(system=machine({**QUICK, **(changes or {})}), faults=tuple(faults), **values)

    return make


@pytest.fixture(scope="module")
def mix(run):
    """Four runs that share their law only."""

    def make(law):
        pinion, wheel = np.random.default_rng(8).normal(0, 3e-6, (2, 84))
        return [
            run({**law, "operating.speed_rpm": 1300}, start=Start(tooth_pinion=5, tooth_wheel=60, phase=0.7)),
            run(
                {**law, "operating.torque_nm": 2, "operating.speed_rpm": 2500, "gear.backlash_um": 4},
                TWO_MISSING if law.get("mesh.law") != "paper" else MISSING,
                specimen=Specimen(pinion_error=pinion[:23], wheel_error=wheel),
            ),
            run({**law, **GEOMETRY}, start=Start(tooth_pinion=30, tooth_wheel=2, phase=0.1)),
            run(
                {**law, "operating.torque_nm": 60},
                [one("crack", tooth=4), one("pitch_error", gear="wheel", tooth=3)] if "mesh.law" not in law else (),
                gearbox=Gearbox(
                    stiffness_factor=np.array([1.1, 0.9, 1.0, 1.2]), damping_factor=np.full(4, 0.9), gain=np.ones(4)
                ),
            ),
        ]

    return make


def diverging(run):
    """A run in which every other tooth of the pinion stands 30 mm proud."""
    errors = np.where(np.arange(23) % 2, -PROUD, 0.0)
    return replace(run, specimen=Specimen(pinion_error=errors, wheel_error=np.zeros(84)))


def bits(record):
    assert isinstance(record, CleanRecord), record
    return record.acceleration.tobytes(), record.mean_speed, record.contact_loss_fraction, str(record.integration_error)


def alone(runs):
    return [simulate_together([one_run])[0] for one_run in runs]


def different(found, expected):
    """Places at which records differ in any bit."""
    return [n for n, pair in enumerate(zip(found, expected, strict=True)) if bits(pair[0]) != bits(pair[1])]


class TestBitsAlone:
    @pytest.mark.parametrize("law", LAWS)
    def test_in_every_lane(self, mix, law):
        runs = mix(LAWS[law])
        expected = alone(runs)
        assert len({bits(record) for record in expected}) == LANES
        for first in range(LANES):
            order = [(first + k) % LANES for k in range(LANES)]
            found = simulate_together([runs[k] for k in order])
            assert not different(found, [expected[k] for k in order])

    def test_in_any_order(self, mix):
        runs = mix({"operating.duration_s": 0.01})
        expected = alone(runs)
        for order in list(permutations(range(LANES)))[1::3]:
            assert not different(simulate_together([runs[k] for k in order]), [expected[k] for k in order])

    @pytest.mark.parametrize("n", [1, 2, 3, 5])
    def test_in_groups_of(self, mix, n):
        runs = [*mix({}), mix({})[1]][:n]
        assert not different(simulate_together(runs), alone(runs))

    def test_laws_and_rates_are_kept_apart(self, run):
        """What cannot be integrated together goes into groups of its own, and comes back in order."""
        runs = [run(LAWS["paper"]), run(), run({"solver.oversampling": 4}), run({"sensing.sampling_rate_hz": 40_000}),
                run(LAWS["classical"]), run({"operating.duration_s": 0.02}), run(LAWS["paper"], MISSING)]  # fmt: skip
        assert not different(simulate_together(runs), alone(runs))

    def test_nothing_is_nothing(self):
        assert simulate_together([]) == []

    def test_beside_others_that_settle_longer(self, run):
        slow = {"operating.drive_frequency_hz": 5}
        soft = {"gear.wheel.support.damping_y_ns_per_m": 400, "operating.drive_frequency_hz": 12}
        runs = [run(), run(slow), run(soft), run({"operating.drive_frequency_hz": 9}, MISSING)]
        expected = alone(runs)
        for order in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)):
            assert not different(simulate_together([runs[k] for k in order]), [expected[k] for k in order])
        assert not different(simulate_together(runs[:2]), expected[:2])

    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    def test_beside_one_that_cannot_settle_in_coarse_steps(self, run):
        runs = [run(), run({"gear.pinion.support.stiffness_y_n_per_m": 2e10}), run({"operating.speed_rpm": 1200})]
        assert not different(simulate_together(runs), alone(runs))

    @pytest.mark.parametrize("seed", range(4))
    def test_where_contact_comes_and_goes(self, run, seed):
        """Pairs that bounce are integrated in parts, in some lanes and not in others."""
        rng = np.random.default_rng(seed)
        runs = [
            run(
                {"operating.torque_nm": float(rng.choice([1, 5, 60])), "operating.duration_s": 0.15,
                 "operating.speed_rpm": float(rng.uniform(800, 4000)), "solver.oversampling": 4,
                 "gear.backlash_um": float(rng.choice([5, 80]))},
                (MISSING, TWO_MISSING)[rng.integers(2)],
                start=Start(tooth_pinion=int(rng.integers(23)), tooth_wheel=0, phase=float(rng.random())),
            )
            for _ in range(LANES)
        ]  # fmt: skip
        expected = alone(runs)
        assert max(record.contact_loss_fraction for record in expected) > 0.005
        assert not different(simulate_together(runs), expected)


class TestOneThatFails:
    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    @pytest.mark.parametrize("lane", range(LANES))
    @pytest.mark.parametrize("law", ["one_sided", "paper"])
    def test_diverging_leaves_its_neighbours(self, run, mix, law, lane):
        runs = mix(LAWS[law])
        expected = alone(runs)
        runs[lane] = diverging(run()) if law == "one_sided" else run({**LAWS[law], **OVERDAMPED})
        found = simulate_together(runs)
        failed = found.pop(lane)
        assert isinstance(failed, SimulationError)
        assert "the motion stopped being finite" in str(failed)
        assert not different(found, expected[:lane] + expected[lane + 1 :])
        assert str(alone([runs[lane]])[0]) == str(failed)

    def test_all_but_one(self, run):
        runs = [diverging(run()), diverging(run()), run(), diverging(run())]
        found = simulate_together(runs)
        assert [isinstance(record, SimulationError) for record in found] == [True, True, False, True]
        assert not different(found[2:3], alone(runs[2:3]))

    def test_the_error_is_looked_for_all_the_same(self, run):
        runs = [run({"solver.max_error": 1e-3}), diverging(run({"solver.max_error": 1e-3}))]
        found = simulate_together(runs)
        assert isinstance(found[1], SimulationError)
        assert not different(found[:1], alone(runs[:1]))

    @pytest.mark.parametrize("lane", [0, 2])
    def test_too_stiff_for_any_step(self, run, lane):
        """Refused before it is integrated: its own error, and its neighbours' records."""
        runs = [run(), run({"operating.speed_rpm": 1200}), run({"operating.torque_nm": 8})]
        expected = alone(runs)
        runs.insert(lane, run({"gear.pinion.support.stiffness_y_n_per_m": 1e13}))
        found = simulate_together(runs)
        failed = found.pop(lane)
        assert isinstance(failed, SimulationError)
        assert "raise solver.oversampling" in str(failed)
        assert not different(found, expected)

    def test_one_by_itself_raises(self, run):
        with pytest.raises(SimulationError, match="the motion stopped being finite"):
            diverging(run()).system.simulate(specimen=diverging(run()).specimen)
        with pytest.raises(SimulationError, match=r"raise solver\.oversampling by at least"):
            run({"gear.pinion.support.stiffness_y_n_per_m": 1e13}).system.simulate()


LIMIT = 5e-4


class TestError:
    """Records whose measured error is too large are made again at half the step, by themselves."""

    @pytest.fixture(scope="class")
    @classmethod
    def runs(cls, run):
        fast = {"operating.speed_rpm": 6000, "operating.torque_nm": 5, "solver.oversampling": 5,
                "solver.max_error": LIMIT, "operating.duration_s": 0.1}  # fmt: skip
        calm = {**fast, "operating.speed_rpm": 1200, "operating.torque_nm": 20}
        return [run(calm), run(fast, MISSING), run(calm, MISSING), run(fast, TWO_MISSING), run(calm)]

    @pytest.fixture(scope="class")
    @classmethod
    def found(cls, runs):
        return simulate_together(runs)

    def test_bits_are_those_alone(self, runs, found):
        assert not different(found, alone(runs))

    def test_only_the_coarse_are_made_again(self, runs, found):
        for k, (one_run, record) in enumerate(zip(runs, found, strict=True)):
            (first,) = simulate_together([with_solver(one_run, oversampling=5, max_error=1.0)])
            assert (first.integration_error > LIMIT) == (k in (1, 3))
            assert (bits(first) == bits(record)) == (k not in (1, 3))

    def test_what_is_made_again_is_that_of_more_steps(self, runs, found):
        (finer,) = simulate_together([with_solver(runs[1], oversampling=10, max_error=LIMIT)])
        assert bits(finer) == bits(found[1])

    def test_errors_are_measured_and_end_below_the_limit(self, runs, found):
        assert all(0.0 < record.integration_error < LIMIT for record in found)

    def test_nobody_looks_where_none_is_asked_for(self, runs):
        (record,) = simulate_together([with_solver(runs[1], oversampling=5, max_error=None)])
        assert np.isnan(record.integration_error)


def with_solver(one_run, **changes):
    solver = replace(one_run.system.solver, **changes)
    return replace(one_run, system=replace(one_run.system, solver=solver))


class TestMotions:
    @pytest.fixture
    def motions(self, xiamen, dynamics_of):
        def integrated(machines):
            return integrate(
                machines,
                Solver(oversampling=4, precision="float64"),
                sampling_rate=51200.0,
                duration=0.005,
                channels=("wheel_y", "pinion_rotation"),
                margin=3,
            )

        return integrated

    def test_shapes(self, motions, xiamen, dynamics_of):
        found = motions([dynamics_of(xiamen), dynamics_of(xiamen, phase=0.8)])
        assert found.acceleration.shape == (2, (256 + 2 * 3) * 4 + 1, LANES)
        assert found.mean_speed.shape == found.contact_loss_fraction.shape == found.finite.shape == (LANES,)
        assert found.finite.all()

    def test_lanes_without_a_machine_repeat_the_first(self, motions, xiamen, dynamics_of):
        found = motions([dynamics_of(xiamen), dynamics_of(xiamen, phase=0.8)])
        first, second, *rest = np.moveaxis(found.acceleration, -1, 0)
        assert first.tobytes() != second.tobytes()
        assert all(lane.tobytes() == first.tobytes() for lane in rest)


class TestPieces:
    """Where a call of the compiled core ends leaves no trace; a lane that is new begins anew, the others go on."""

    STEP, N_STEPS = 1 / (51200 * 5), 3000

    @pytest.fixture(scope="class", params=["one_sided", "paper"])
    @classmethod
    def machines(cls, request, mix):
        return [one_run.dynamics() for one_run in mix(LAWS[request.param])]

    def motion(self, machines, pieces, begins=(0, 0, 0, 0), anew=False):
        """State, means over the steps and lost steps; ``begins`` are steps at which lanes begin."""
        group, channels = pack(machines, self.STEP), np.array([1, 5])
        state, lost, means = np.zeros((2, 6, LANES)), np.zeros(LANES), []
        scratch, fresh, now = _kernels.scratch(6, len(channels)), np.ones(LANES), 0
        for n_steps in pieces:
            for lane, begin in enumerate(begins):
                if begin == now:
                    state[:, :, lane], fresh[lane] = 0.0, 1.0
                    state[0, :, lane] = machines[lane].static_start(now * self.STEP)
            out = np.empty((len(channels), n_steps, LANES))
            _kernels.integrate(
                group, state.ravel(), lost, fresh, self.STEP, now, n_steps, channels, out.ravel(), *scratch
            )
            means.append(out)
            now, fresh[:] = now + n_steps, float(anew)
        return state, np.concatenate(means, axis=1), lost

    @pytest.mark.parametrize("pieces", [(1, 2, 997, 2000), (0, 1500, 0, 1500), (7,) * 428 + (4,)])
    def test_together_make_the_whole(self, machines, pieces):
        whole, found = (self.motion(machines, one) for one in ((self.N_STEPS,), pieces))
        assert [one.tobytes() for one in found] == [one.tobytes() for one in whole]

    def test_a_lane_begins_anew_beside_others_that_go_on(self, machines):
        whole = self.motion(machines, (self.N_STEPS,))
        state, means, _ = self.motion(machines, (801, 1199, 1000), begins=(0, 801, 0, 2000))
        assert state[..., [0, 2]].tobytes() == whole[0][..., [0, 2]].tobytes()
        assert means[..., [0, 2]].tobytes() == whole[1][..., [0, 2]].tobytes()
        for lane, begin in ((1, 801), (3, 2000)):
            alone = self.motion([machines[lane]] * LANES, (begin, self.N_STEPS - begin), begins=(begin,) * LANES)
            assert state[..., lane].tobytes() == alone[0][..., 0].tobytes()
            assert means[:, begin:, lane].tobytes() == alone[1][:, begin:, 0].tobytes()

    def test_reading_the_tables_anew_would_show(self, machines):
        """All lanes fresh in the middle, from the same states: the last bits differ."""
        whole, halves = self.motion(machines, (self.N_STEPS,)), self.motion(machines, (1500, 1500), anew=True)
        assert halves[1][:, :1500].tobytes() == whole[1][:, :1500].tobytes()
        assert halves[1].tobytes() != whole[1].tobytes()
        level = whole[1].std(axis=1, keepdims=True)
        assert_allclose(halves[1] / level, whole[1] / level, rtol=0, atol=1e-5)


def test_a_group_takes_teeth_of_different_numbers(machine, dynamics_of):
    """Every lane's places point at its own tables."""
    machines = [dynamics_of(machine(changes)) for changes in ({}, GEOMETRY, {"mesh.points_per_pitch": 64})]
    group = pack(machines, 1e-6)
    teeth = [23 + 84, 31 + 61, 23 + 84, 23 + 84]
    assert len(group.tooth_row) == len(group.tooth_error) == sum(teeth)
    nodes = [one.table.position.size for one in (*machines, machines[0])]
    assert len(group.table) == sum(4 * 2 * n for n in nodes)
