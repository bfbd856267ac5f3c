"""A record has the same bits alone and next to any others, in every lane and order."""

from dataclasses import fields, replace

import numpy as np
import pytest
from core_runs import (
    CLASSICAL,
    MISSING,
    PAPER,
    QUICK,
    alone,
    assert_same,
    bits,
)
from fault_cases import one

from gensig.dynamics._vector import LANES
from gensig.dynamics.backends.base import Integration, Motions
from gensig.dynamics.backends.group_motions import lane_groups
from gensig.dynamics.backends.nystroem.method import THREE_PAIRS
from gensig.dynamics.integrator import Solver, integrate
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.sensing.manufacturing import Gearbox, Specimen
from gensig.systems.base import simulate_together
from gensig.systems.run import Run, Start

LAWS = {
    "one_sided": {},
    "classical": CLASSICAL,
    "paper": PAPER,
    "paper_classical": {**PAPER, **CLASSICAL},
}
SPEED = "operating.speed_rpm"
TORQUE = "operating.torque_nm"
BACKLASH = "gear.backlash_um"
PINION_STIFFNESS = "gear.pinion.support.stiffness_y_n_per_m"
TWO_MISSING = (*MISSING, MissingTooth(gear="pinion", tooth=4))
# so many distinct teeth on both gears that the table stores them one by one
MANY_PITS = tuple(
    one(
        "pitting",
        gear=gear,
        tooth=tooth,
        pit_width_mm=4.0 + tooth,
    )
    for gear, n_teeth in (("pinion", 5), ("wheel", 6))
    for tooth in range(n_teeth)
)
BRIEF = {
    **QUICK,
    "operating.duration_s": 0.02,
    "solver.oversampling": 8,
}
GEOMETRY = {
    "gear.pinion.n_teeth": 31,
    "gear.pinion.bore_radius_mm": 12,
    "gear.wheel.n_teeth": 61,
    BACKLASH: 10,
    "mesh.points_per_pitch": 256,
    "mesh.damping_ratio": 0.03,
}
# a damper across the mesh that the light pinion overshoots in a step
COARSE_STEP = pytest.mark.filterwarnings(
    "ignore::gensig.dynamics.integrator.CoarseStepWarning"
)


@pytest.fixture(scope="module")
def run(machine):
    """A run of the quick machine with keys replaced."""

    def make(changes=None, faults=(), **values):
        system = machine({**BRIEF, **(changes or {})})
        return Run(system=system, faults=tuple(faults), **values)

    return make


def mix(run, law):
    """Eight runs that share only their law."""
    gaps = law.get("mesh.law") != "paper"
    pinion, wheel = np.random.default_rng(8).normal(
        0,
        3e-6,
        (2, 84),
    )
    tilts = {
        "pinion_tilt": 100.0 * wheel[:23],
        "wheel_tilt": 100.0 * pinion,
    }
    specimen = Specimen(pinion_error=pinion[:23], wheel_error=wheel, **tilts)
    factors = np.array([1.1, 0.9, 1.0, 1.2])
    gearbox = Gearbox(
        stiffness_factor=factors,
        damping_factor=np.full(4, 0.9),
        gain=np.ones(4),
    )
    odd = (
        one("crack", tooth=4),
        one("pitch_error", gear="wheel", tooth=3),
    )
    cracks = [one("crack", gear="wheel", tooth=k) for k in range(2)]
    light = {TORQUE: 0.5, BACKLASH: 3, SPEED: 3000}
    coarse = {**GEOMETRY, "mesh.points_per_pitch": 64}
    smooth = {
        "mesh.friction_coefficient": 0,
        SPEED: 6000,
        TORQUE: 100,
    }

    def start(pinion_tooth, wheel_tooth, phase):
        return Start(
            tooth_pinion=pinion_tooth,
            tooth_wheel=wheel_tooth,
            phase=phase,
        )

    def made(changes, faults=(), **values):
        return run({**law, **changes}, faults, **values)

    return [
        made({SPEED: 1300}, start=start(5, 60, 0.7)),
        made(
            {TORQUE: 2, SPEED: 2500, BACKLASH: 4},
            TWO_MISSING if gaps else MISSING,
            specimen=specimen,
        ),
        made(GEOMETRY, start=start(30, 2, 0.1)),
        made({TORQUE: 60}, odd if gaps else (), gearbox=gearbox),
        made(light, MISSING),
        made({SPEED: 400}, cracks),
        made(coarse, MANY_PITS, start=start(2, 1, 0.9)),
        made(smooth),
    ]


@pytest.fixture(scope="module")
def mixed(run):
    """The eight runs of a law by its name, and the record of each alone, made once."""
    known = {}

    def make(name):
        if name not in known:
            runs = mix(run, LAWS[name])
            known[name] = runs, alone(runs)
        return [list(part) for part in known[name]]

    return make


def diverging(run):
    """A run in which every other tooth of the pinion is 30 mm proud."""
    errors = np.where(np.arange(23) % 2, -0.03, 0.0)
    specimen = Specimen(pinion_error=errors, wheel_error=np.zeros(84))
    return replace(run, specimen=specimen)


class TestBitsAlone:
    @pytest.mark.parametrize("law", LAWS)
    def test_in_every_lane(self, mixed, law):
        runs, expected = mixed(law)
        assert len({bits(record) for record in expected}) == LANES

        rng = np.random.default_rng(1)
        orders = [np.roll(range(LANES), -first) for first in range(LANES)]
        for order in (
            *orders,
            rng.permutation(LANES),
            rng.permutation(LANES),
        ):
            together = simulate_together([runs[k] for k in order])
            assert_same(together, [expected[k] for k in order])

    @pytest.mark.parametrize("n", [0, 1, 3, 9])
    def test_in_groups_of(self, mixed, n):
        runs, expected = ([*part, part[1]][:n] for part in mixed("one_sided"))
        assert_same(simulate_together(runs), expected)

    def test_laws_and_rates_are_integrated_apart(self, run):
        changes = [
            PAPER,
            {},
            {"solver.oversampling": 4},
            {"sensing.sampling_rate_hz": 40_000},
            CLASSICAL,
            {"operating.duration_s": 0.01},
            {"system.motor.inertia_kg_m2": 5e-4},
            {"system.load.inertia_kg_m2": 5e-3},
        ]
        runs = [*map(run, changes), run(PAPER, MISSING)]
        assert_same(simulate_together(runs), alone(runs))

    def test_while_contact_is_lost_and_regained(self, run):
        """Bouncing pairs are integrated in parts, in some lanes and not in others."""
        rng = np.random.default_rng(0)
        runs = []
        for _ in range(LANES):
            changes = {
                TORQUE: float(rng.choice([1, 5, 60])),
                "operating.duration_s": 0.1,
                SPEED: float(rng.uniform(800, 4000)),
                "solver.oversampling": 4,
                BACKLASH: float(rng.choice([5, 80])),
            }
            faults = (MISSING, TWO_MISSING)[rng.integers(2)]
            start = Start(
                tooth_pinion=int(rng.integers(23)),
                phase=float(rng.random()),
            )
            runs.append(run(changes, faults, start=start))
        expected = alone(runs)

        assert max(record.contact_loss_fraction for record in expected) > 0.005
        assert_same(simulate_together(runs), expected)


class TestFailures:
    @COARSE_STEP
    @pytest.mark.parametrize("lane", [0, 7])
    def test_divergence_leaves_the_neighbours(self, run, mixed, lane):
        runs, expected = mixed("one_sided")
        runs[lane] = diverging(run())
        together = simulate_together(runs)
        failed = together.pop(lane)

        assert isinstance(failed, SimulationError)
        assert "the motion stopped being finite" in str(failed)

        del expected[lane]
        assert_same(together, expected)
        assert str(alone([runs[lane]])[0]) == str(failed)

    @pytest.mark.parametrize("lane", [0, 2])
    def test_a_machine_too_stiff_for_its_step(self, run, lane):
        """Refused before the integration: its error, and the records of its neighbours."""
        runs = [run(), run({SPEED: 1200}), run({TORQUE: 8})]
        expected = alone(runs)
        runs.insert(lane, run({PINION_STIFFNESS: 1e13}))
        together = simulate_together(runs)

        assert "raise solver.oversampling" in str(together.pop(lane))
        assert_same(together, expected)

    def test_a_single_run_raises(self, run):
        single = diverging(run())
        jammed = "finite.*stand out by up to 3e.04 um.*backlash of.*um, and jam; make"
        with pytest.raises(SimulationError, match=jammed):
            single.system.simulate(specimen=single.specimen)

        text = r"raise solver\.oversampling to at least \d+"
        with pytest.raises(SimulationError, match=text):
            run({PINION_STIFFNESS: 1e13}).system.simulate()


LIMIT = 4e-4


class TestError:
    """Records with a too large measured error are integrated again at half the step.

    Not where teeth bounce: there, equal levels are enough.
    """

    COARSE = (1,)
    BOUNCING = 4

    @pytest.fixture(scope="class")
    @classmethod
    def runs(cls, run):
        fast = {
            SPEED: 6000,
            TORQUE: 60,
            "solver.oversampling": 5,
            "solver.max_error": LIMIT,
            "operating.duration_s": 0.1,
        }
        calm = {**fast, SPEED: 1200}
        light = {**fast, TORQUE: 5}
        changes = (
            (calm, ()),
            (fast, MISSING),
            (calm, MISSING),
            (fast, ()),
        )
        return [run(*each) for each in (*changes, (light, TWO_MISSING))]

    @pytest.fixture(scope="class")
    @classmethod
    def records(cls, runs):
        return simulate_together(runs)

    def test_bits_are_those_alone(self, runs, records):
        assert_same(records, alone(runs))

    def test_only_coarse_records_are_repeated_at_half_the_step(self, runs, records):
        loose = [with_solver(run, oversampling=5, max_error=1.0) for run in runs]
        for k, first in enumerate(simulate_together(loose)):
            assert first.integration_check == "error"
            is_large = first.integration_error > LIMIT
            assert is_large == (k in (*self.COARSE, self.BOUNCING))
            is_same = bits(first)[0] == bits(records[k])[0]
            assert is_same == (k not in (*self.COARSE, self.BOUNCING))
        finer = [with_solver(runs[k], oversampling=10) for k in self.COARSE]

        assert_same(
            simulate_together(finer),
            [records[k] for k in self.COARSE],
        )

    def test_errors_end_below_the_limit(self, records):
        calm = [record for k, record in enumerate(records) if k != self.BOUNCING]
        assert all(0.0 < record.integration_error < LIMIT for record in calm)
        assert all(record.integration_check == "error" for record in calm)
        assert records[self.BOUNCING].contact_loss_fraction > 0.01
        assert records[self.BOUNCING].integration_check == "levels"

    def test_without_a_limit_there_is_no_check(self, runs):
        (record,) = simulate_together([with_solver(runs[1], max_error=None)])
        assert np.isnan(record.integration_error)
        assert record.integration_check == "none"


def with_solver(run, **changes):
    solver = replace(run.system.solver, **changes)
    return replace(run, system=replace(run.system, solver=solver))


RECORD = {
    "sampling_rate": 51200.0,
    "duration": 0.005,
    "channels": ("wheel_y", "pinion_rotation"),
}
SOLVER = {
    "oversampling": 4,
    "precision": "float64",
    "max_error": None,
}
INTEGRATION = Integration(**RECORD, **SOLVER, with_mesh_state=False)


class TestMotions:
    @COARSE_STEP
    def test_any_number_of_machines_in_order(self, machine, dynamics_of):
        """More than a group, of two kinds of settling; motions are those of machines alone."""
        systems = [
            machine(),
            machine({PINION_STIFFNESS: 1e10}),
            machine(),
        ]
        machines = [
            dynamics_of(systems[k % 3], phase=0.05 * k) for k in range(LANES + 3)
        ]
        groups = lane_groups(machines, INTEGRATION, THREE_PAIRS)
        assert list(map(len, groups)) == [7, 4]

        together = integrate(machines, Solver(**SOLVER), **RECORD)
        shapes = [rows.shape for rows in together.acceleration]
        assert shapes == [(2, 256)] * (LANES + 3)
        assert together.check.shape == (LANES + 3, 2, 0)
        assert together.finite.all()

        for k in (0, 1, 2, LANES + 2):
            single = integrate([machines[k]], Solver(**SOLVER), **RECORD)
            for field in fields(Motions):
                of_all = getattr(together, field.name)[k]
                of_one = getattr(single, field.name)[0]
                assert of_all.tobytes() == of_one.tobytes(), field.name
