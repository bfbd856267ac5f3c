"""Single precision: agreement with double, and sixteen independent records."""

import numpy as np
import pytest
from closeness import assert_close
from core_runs import (
    MISSING,
    PAPER,
    QUICK,
    ROTORS,
    alone,
    assert_same,
    bits,
)
from fault_cases import one

from gensig.dynamics._vector import n_lanes
from gensig.dynamics.decimation import in_band_error
from gensig.errors import SimulationError
from gensig.sensing.manufacturing import Specimen
from gensig.systems.base import simulate_together
from gensig.systems.run import Run, Start

LANES = n_lanes("float32")
RATE = 51200.0
BRIEF = {"operating.duration_s": 0.01}
LIGHT = {
    "operating.torque_nm": 2,
    "operating.speed_rpm": 2500,
    "gear.backlash_um": 4,
}
CASES = {
    "crack": ({}, (one("crack"),)),
    "missing": ({"operating.torque_nm": 5}, MISSING),
    "slow": ({"operating.speed_rpm": 600}, ()),
    "fast": (
        {
            "operating.speed_rpm": 6000,
            "operating.torque_nm": 60,
        },
        (),
    ),
    "ramp": (
        {"operating.speed_profile": [[-0.4, 0.4], [0.4, 1.6]]},
        (),
    ),
    "rotors": (ROTORS, ()),
    "paper": (PAPER, ()),
}


@pytest.fixture(scope="module")
def run(machine):
    def make(changes=None, faults=(), precision="float32", **values):
        usual = {
            **QUICK,
            "operating.duration_s": 0.05,
            "solver.precision": precision,
        }
        system = machine({**usual, **(changes or {})})
        return Run(system=system, faults=tuple(faults), **values)

    return make


@pytest.mark.parametrize("name", CASES)
def test_records_agree_with_double(run, name):
    """Measured: 1e-6 to 7e-6 of a channel's level by rounding; 1.2e-5 at 600 r/min."""
    single, double = (
        simulate_together([run(*CASES[name], precision)])[0]
        for precision in ("float32", "float64")
    )
    signals = (
        single.acceleration[None],
        double.acceleration[None],
    )
    assert 1e-8 < in_band_error(*signals, RATE)[0] < 2.5e-5
    assert single.acceleration.dtype == double.acceleration.dtype == np.float64
    assert_close(single.mean_speed, double.mean_speed, 1e-8)
    assert_close(
        single.contact_loss_fraction,
        double.contact_loss_fraction,
        1e-3,
    )
    assert_close(single.shaft_angle, double.shaft_angle, atol=1e-7)


def test_the_shaft_does_not_drift(run):
    """Positions of the pairs are float64: after 20 turns the difference is as small as before."""
    long = {"operating.duration_s": 0.7}
    single, double = (
        simulate_together([run(long, (), name)])[0].shaft_angle
        for name in ("float32", "float64")
    )
    off = np.abs(single - double).reshape(10, -1)

    assert double[-1] > 20 * 2 * np.pi
    assert off.max() < 1e-7
    assert off[-1].max() < 10 * off[0].max()


class TestBits:
    @pytest.fixture(scope="class")
    @classmethod
    def runs(cls, run):
        errors = np.random.default_rng(8).normal(0, 3e-6, (2, 84))
        specimen = Specimen(pinion_error=errors[0, :23], wheel_error=errors[1])
        start = Start(tooth_pinion=5, tooth_wheel=60, phase=0.7)
        coarse = {
            "mesh.points_per_pitch": 64,
            "operating.drive_frequency_hz": 9,
        }
        return [
            run(BRIEF, start=start),
            run({**BRIEF, **LIGHT}, MISSING),
            run({**BRIEF, **coarse}),
            run(
                BRIEF,
                [one("crack", tooth=4)],
                specimen=specimen,
            ),
        ]

    @pytest.fixture(scope="class")
    @classmethod
    def expected(cls, runs):
        return alone(runs)

    @pytest.mark.parametrize("first", [0, 3])
    def test_in_many_lanes_and_groups(self, runs, expected, first):
        """Seventeen: one more than a group."""
        order = [(first + k) % len(runs) for k in range(LANES + 1)]
        together = simulate_together([runs[k] for k in order])
        assert_same(together, [expected[k] for k in order])
        assert len(set(map(bits, expected))) == len(runs)

    def test_next_to_a_failure_and_to_records_in_double(self, run, runs, expected):
        proud = np.where(np.arange(23) % 2, -0.03, 0.0)
        specimen = Specimen(pinion_error=proud, wheel_error=np.zeros(84))
        double = run(BRIEF, (), "float64")
        mixed = [
            runs[0],
            run(BRIEF, specimen=specimen),
            double,
            *runs[1:],
        ]
        together = simulate_together(mixed)

        assert isinstance(together.pop(1), SimulationError)
        assert_same([together.pop(1)], alone([double]))
        assert_same(together, expected)
