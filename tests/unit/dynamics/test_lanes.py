"""A record has the same bits alone and beside others, whatever they are, in every lane and order."""

from dataclasses import fields, replace

import numpy as np
import pytest
from fault_cases import one

from gensig.dynamics._vector import LANES
from gensig.dynamics.backends.base import Integration, Motions
from gensig.dynamics.backends.runge_kutta import integrate_group, lane_groups
from gensig.dynamics.integrator import Solver, integrate
from gensig.dynamics.lanes import pack
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.sensing.manufacturing import Gearbox, Specimen
from gensig.systems.base import simulate_together
from gensig.systems.run import CleanRecord, Run, Start

LAWS = {
    "one_sided": {},
    "classical": {"mesh.roll_torque": "classical"},
    "paper": {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear"},
    "paper_classical": {"mesh.law": "paper", "mesh.pair_coupling": "sum", "mesh.contact": "linear",
                        "mesh.roll_torque": "classical"},
}  # fmt: skip
MISSING = (MissingTooth(gear="pinion", tooth=3),)
TWO_MISSING = (*MISSING, MissingTooth(gear="pinion", tooth=4))
# so many distinct teeth on both gears that they stand in the table by themselves
MANY_PITS = tuple(
    one("pitting", gear=gear, tooth=tooth, pit_width_mm=4.0 + tooth)
    for gear, teeth in (("pinion", range(5)), ("wheel", range(6)))
    for tooth in teeth
)
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
        return Run(
            system=machine({**QUICK, **(changes or {})}), faults=tuple(faults), **values
        )

    return make


@pytest.fixture(scope="module")
def mix(run):
    """Eight runs that share their law only."""

    def make(law):
        gaps = law.get("mesh.law") != "paper"
        pinion, wheel = np.random.default_rng(8).normal(0, 3e-6, (2, 84))
        return [
            run(
                {**law, "operating.speed_rpm": 1300},
                start=Start(tooth_pinion=5, tooth_wheel=60, phase=0.7),
            ),
            run(
                {
                    **law,
                    "operating.torque_nm": 2,
                    "operating.speed_rpm": 2500,
                    "gear.backlash_um": 4,
                },
                TWO_MISSING if gaps else MISSING,
                specimen=Specimen(
                    pinion_error=pinion[:23],
                    wheel_error=wheel,
                    pinion_tilt=100.0 * wheel[:23],
                    wheel_tilt=100.0 * pinion,
                ),
            ),
            run(
                {**law, **GEOMETRY},
                start=Start(tooth_pinion=30, tooth_wheel=2, phase=0.1),
            ),
            run(
                {**law, "operating.torque_nm": 60},
                [one("crack", tooth=4), one("pitch_error", gear="wheel", tooth=3)]
                if gaps
                else (),
                gearbox=Gearbox(
                    stiffness_factor=np.array([1.1, 0.9, 1.0, 1.2]),
                    damping_factor=np.full(4, 0.9),
                    gain=np.ones(4),
                ),
            ),
            run(
                {
                    **law,
                    "operating.torque_nm": 0.5,
                    "gear.backlash_um": 3,
                    "operating.speed_rpm": 3000,
                },
                MISSING,
            ),
            run(
                {**law, "operating.speed_rpm": 400},
                [one("crack", gear="wheel", tooth=k) for k in range(2)],
            ),
            run(
                {**law, **GEOMETRY, "mesh.points_per_pitch": 64},
                MANY_PITS,
                start=Start(tooth_pinion=2, tooth_wheel=1, phase=0.9),
            ),
            run(
                {
                    **law,
                    "mesh.friction_coefficient": 0,
                    "operating.speed_rpm": 6000,
                    "operating.torque_nm": 100,
                }
            ),
        ]

    return make


@pytest.fixture(scope="module")
def mixed(mix):
    """The eight runs of a law by its name, and the record of each alone, made once."""
    known = {}

    def make(name):
        if name not in known:
            runs = mix(LAWS[name])
            known[name] = runs, alone(runs)
        return [list(part) for part in known[name]]

    return make


def diverging(run):
    """A run in which every other tooth of the pinion stands 30 mm proud."""
    errors = np.where(np.arange(23) % 2, -PROUD, 0.0)
    return replace(
        run, specimen=Specimen(pinion_error=errors, wheel_error=np.zeros(84))
    )


def bits(record):
    assert isinstance(record, CleanRecord), record
    told = (
        record.mean_speed,
        record.contact_loss_fraction,
        record.integration_error,
        record.integration_check,
    )
    return record.acceleration.tobytes(), record.shaft_angle.tobytes(), repr(told)


def alone(runs):
    return [simulate_together([one_run])[0] for one_run in runs]


def different(found, expected):
    """Places at which records differ in any bit."""
    return [
        n
        for n, pair in enumerate(zip(found, expected, strict=True))
        if bits(pair[0]) != bits(pair[1])
    ]


class TestBitsAlone:
    @pytest.mark.parametrize("law", LAWS)
    def test_in_every_lane(self, mixed, law):
        runs, expected = mixed(law)
        assert len({bits(record) for record in expected}) == LANES
        for first in range(LANES):
            order = [(first + k) % LANES for k in range(LANES)]
            found = simulate_together([runs[k] for k in order])
            assert not different(found, [expected[k] for k in order])

    def test_in_any_order(self, mix):
        runs = mix({"operating.duration_s": 0.01})
        expected = alone(runs)
        rng = np.random.default_rng(1)
        for order in (
            range(LANES - 1, -1, -1),
            *(rng.permutation(LANES) for _ in range(6)),
        ):
            assert not different(
                simulate_together([runs[k] for k in order]),
                [expected[k] for k in order],
            )

    @pytest.mark.parametrize("n", [1, 2, 3, 7, 9])
    def test_in_groups_of(self, mixed, n):
        runs, expected = ([*part, part[1]][:n] for part in mixed("one_sided"))
        assert not different(simulate_together(runs), expected)

    def test_laws_and_rates_are_kept_apart(self, run):
        """What cannot be integrated together goes into groups of its own, and comes back in order."""
        runs = [run(LAWS["paper"]), run(), run({"solver.oversampling": 4}), run({"sensing.sampling_rate_hz": 40_000}),
                run(LAWS["classical"]), run({"operating.duration_s": 0.02}), run(LAWS["paper"], MISSING),
                run({"system.motor.inertia_kg_m2": 5e-4}), run({"system.load.inertia_kg_m2": 5e-3})]  # fmt: skip
        assert not different(simulate_together(runs), alone(runs))

    def test_nothing_is_nothing(self):
        assert simulate_together([]) == []

    def test_beside_others_that_settle_longer(self, run):
        slow = {"operating.drive_frequency_hz": 5}
        soft = {
            "gear.wheel.support.damping_y_ns_per_m": 400,
            "operating.drive_frequency_hz": 12,
        }
        runs = [
            run(),
            run(slow),
            run(soft),
            run({"operating.drive_frequency_hz": 9}, MISSING),
        ]
        expected = alone(runs)
        for order in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)):
            assert not different(
                simulate_together([runs[k] for k in order]),
                [expected[k] for k in order],
            )
        assert not different(simulate_together(runs[:2]), expected[:2])

    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    def test_beside_one_that_cannot_settle_in_coarse_steps(self, run):
        runs = [
            run(),
            run({"gear.pinion.support.stiffness_y_n_per_m": 2e10}),
            run({"operating.speed_rpm": 1200}),
        ]
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
    def test_diverging_leaves_its_neighbours(self, run, mixed, law, lane):
        runs, expected = mixed(law)
        runs[lane] = (
            diverging(run()) if law == "one_sided" else run({**LAWS[law], **OVERDAMPED})
        )
        found = simulate_together(runs)
        failed = found.pop(lane)
        assert isinstance(failed, SimulationError)
        assert "the motion stopped being finite" in str(failed)
        assert not different(found, expected[:lane] + expected[lane + 1 :])
        assert str(alone([runs[lane]])[0]) == str(failed)

    def test_all_but_one(self, run):
        runs = [diverging(run()), diverging(run()), run(), diverging(run())]
        found = simulate_together(runs)
        assert [isinstance(record, SimulationError) for record in found] == [
            True,
            True,
            False,
            True,
        ]
        assert not different(found[2:3], alone(runs[2:3]))

    def test_the_error_is_looked_for_all_the_same(self, run):
        runs = [
            run({"solver.max_error": 1e-3}),
            diverging(run({"solver.max_error": 1e-3})),
        ]
        found = simulate_together(runs)
        assert isinstance(found[1], SimulationError)
        assert not different(found[:1], alone(runs[:1]))

    @pytest.mark.parametrize("lane", [0, 2])
    def test_too_stiff_for_any_step(self, run, lane):
        """Refused before it is integrated: its own error, and its neighbours' records."""
        runs = [
            run(),
            run({"operating.speed_rpm": 1200}),
            run({"operating.torque_nm": 8}),
        ]
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
        with pytest.raises(
            SimulationError, match=r"raise solver\.oversampling to at least \d+$"
        ):
            run({"gear.pinion.support.stiffness_y_n_per_m": 1e13}).system.simulate()


LIMIT = 5e-4


class TestError:
    """Records whose measured error is too large are made again at half the step, by themselves.

    Not where teeth bounce: there levels that agree are enough.
    """

    COARSE, BOUNCING = (1, 3), 5

    @pytest.fixture(scope="class")
    @classmethod
    def runs(cls, run):
        fast = {"operating.speed_rpm": 6000, "operating.torque_nm": 60, "solver.oversampling": 5,
                "solver.max_error": LIMIT, "operating.duration_s": 0.1}  # fmt: skip
        calm, light = (
            {**fast, "operating.speed_rpm": 1200},
            {**fast, "operating.torque_nm": 5},
        )
        return [
            run(calm),
            run(fast, MISSING),
            run(calm, MISSING),
            run(fast),
            run(calm),
            run(light, TWO_MISSING),
        ]

    @pytest.fixture(scope="class")
    @classmethod
    def found(cls, runs):
        return simulate_together(runs)

    def test_bits_are_those_alone(self, runs, found):
        assert not different(found, alone(runs))

    def test_only_the_coarse_are_made_again(self, runs, found):
        for k, (one_run, record) in enumerate(zip(runs, found, strict=True)):
            (first,) = simulate_together(
                [with_solver(one_run, oversampling=5, max_error=1.0)]
            )
            assert first.integration_check == "error"
            assert (first.integration_error > LIMIT) == (
                k in (*self.COARSE, self.BOUNCING)
            )
            assert (bits(first)[0] == bits(record)[0]) == (k not in self.COARSE)

    def test_what_is_made_again_is_that_of_more_steps(self, runs, found):
        for k in self.COARSE:
            (finer,) = simulate_together(
                [with_solver(runs[k], oversampling=10, max_error=LIMIT)]
            )
            assert bits(finer) == bits(found[k])

    def test_errors_are_measured_and_end_below_the_limit(self, found):
        calm = [record for k, record in enumerate(found) if k != self.BOUNCING]
        assert all(0.0 < record.integration_error < LIMIT for record in calm)
        assert all(record.integration_check == "error" for record in calm)
        assert found[self.BOUNCING].contact_loss_fraction > 0.01
        assert found[self.BOUNCING].integration_check == "levels"

    def test_nobody_looks_where_none_is_asked_for(self, runs):
        (record,) = simulate_together(
            [with_solver(runs[1], oversampling=5, max_error=None)]
        )
        assert np.isnan(record.integration_error)
        assert record.integration_check == "none"


def with_solver(one_run, **changes):
    solver = replace(one_run.system.solver, **changes)
    return replace(one_run, system=replace(one_run.system, solver=solver))


BRIEF = Integration(
    sampling_rate=51200.0,
    duration=0.005,
    channels=("wheel_y", "pinion_rotation"),
    tell_mesh=False,
    oversampling=4,
    precision="float64",
    max_error=None,
)


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
            )

        return integrated

    def test_shapes(self, motions, xiamen, dynamics_of):
        found = motions([dynamics_of(xiamen), dynamics_of(xiamen, phase=0.8)])
        assert found.acceleration.shape == (2, 2, 256)
        assert found.shaft_angle.shape == (2, 256)
        assert found.check.shape == (2, 2, 0)
        assert (
            found.mean_speed.shape
            == found.contact_loss_fraction.shape
            == found.finite.shape
            == (2,)
        )
        assert found.finite.all()

    def test_lanes_without_a_machine_repeat_the_first(self, xiamen, dynamics_of):
        machines = [dynamics_of(xiamen), dynamics_of(xiamen, phase=0.8)]
        first, second, *rest = integrate_group(machines, BRIEF).acceleration
        assert first.tobytes() != second.tobytes()
        assert len(rest) == LANES - 2
        assert all(lane.tobytes() == first.tobytes() for lane in rest)

    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    def test_any_number_of_machines_comes_back_in_order(
        self, motions, machine, dynamics_of
    ):
        """More than a group takes, of two kinds of settling; every motion is that of the machine alone."""
        stiff = machine({"gear.pinion.support.stiffness_y_n_per_m": 2e9})
        machines = [
            dynamics_of(stiff if k % 3 == 1 else machine({}), phase=0.05 * k)
            for k in range(LANES + 3)
        ]
        groups = lane_groups(machines, BRIEF)
        assert [len(group) for group in groups] == [7, 4]
        together = motions(machines)
        for k, one_machine in enumerate(machines):
            single = motions([one_machine])
            for field in fields(Motions):
                of_all, of_one = (
                    getattr(together, field.name)[k],
                    getattr(single, field.name)[0],
                )
                assert of_all.tobytes() == of_one.tobytes(), field.name


def test_a_group_takes_teeth_of_different_numbers(machine, dynamics_of):
    """Every lane's places point at its own tables."""
    machines = [
        dynamics_of(machine(changes))
        for changes in ({}, GEOMETRY, {"mesh.points_per_pitch": 64})
    ]
    group = pack(machines, 1e-6)
    teeth = [23 + 84, 31 + 61, *[23 + 84] * (LANES - 2)]
    assert len(group.tooth_row) == len(group.tooth_error) == sum(teeth)
    nodes = [
        one.table.position.size for one in (*machines, *[machines[0]] * (LANES - 3))
    ]
    assert len(group.table) == sum(4 * n for n in nodes)
