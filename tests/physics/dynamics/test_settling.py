"""A record begins settled, though it settles in coarse steps first."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from gensig.dynamics.backends import runge_kutta, step_limits
from gensig.dynamics.backends.base import BOUNCING
from gensig.dynamics.backends.step_limits import (
    COARSE,
    coarsest_oversampling,
    settling_stages,
)
from gensig.dynamics.decimation import in_band_error
from gensig.errors import SimulationError
from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack
from gensig.sensing.manufacturing import draw_gearbox, draw_specimen
from gensig.systems.base import simulate_together
from gensig.systems.run import Run

SAMPLING_RATE = 51200.0
LEFT = 5e-4  # of a spectrum; at 600 r/min, where drive and wheel are near each other, 4e-4, else up to 2e-4
LINE = {
    "system.motor.inertia_kg_m2": 2e-3,
    "system.load.inertia_kg_m2": 0.05,
    "operating.speed_rpm": 1500,
}


def made(machine, changes, faults=()):
    """One record of gears with errors, in a gearbox of its own."""
    system = machine({"operating.duration_s": 0.1, "solver.max_error": None, **changes})
    rng = np.random.default_rng(1)
    return Run(
        system=system,
        faults=tuple(faults),
        specimen=draw_specimen(
            rng, system.pair.pinion, system.pair.wheel, system.quality
        ),
        gearbox=draw_gearbox(
            rng,
            len(system.sensing.channels),
            system.quality,
            system.sensing.gain_scatter,
        ),
    )


@pytest.fixture(scope="module")
def runs(machine):
    """Slow, usual with a fault, fast, and with motor and load."""
    crack = Crack(
        gear="pinion",
        tooth=3,
        crack_depth=1e-3,
        crack_angle=np.pi / 4,
        crack_start="arc_mid",
    )
    return [
        made(machine, {"operating.speed_rpm": 600}),
        made(machine, {}, [crack]),
        made(machine, {"operating.speed_rpm": 6000}),
        made(machine, LINE),
    ]


@pytest.fixture(scope="module")
def steady(runs):
    """The same after 1.2 s of settling in fine steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step_limits, "COARSE", ((16, 0.02),))
        patch.setattr(runge_kutta, "settling_time", lambda _: 1.2)
        return accelerations(runs)


def accelerations(runs):
    return [record.acceleration[None] for record in simulate_together(runs)]


def left(runs, steady):
    """Relative difference from the steady records, (run,)."""
    pairs = zip(accelerations(runs), steady, strict=True)
    return np.array(
        [in_band_error(one, other, SAMPLING_RATE)[0] for one, other in pairs]
    )


def test_nothing_of_the_start_is_left(runs, steady):
    assert np.all(left(runs, steady) < LEFT)


def test_coarse_steps_to_the_end_would_leave_more(runs, steady, monkeypatch):
    monkeypatch.setattr(step_limits, "COARSE", ((1, 0.02),))
    assert left(runs, steady).max() > 10 * LEFT


def test_a_shorter_settling_would_leave_more(runs, steady, monkeypatch):
    monkeypatch.setattr(runge_kutta, "settling_time", lambda _: 0.2)
    assert left(runs, steady).max() > 10 * LEFT


def test_machines_that_begin_in_different_stages_keep_their_bits(runs, machine):
    """A quick drive begins when the others' steps have changed already; it does so alone too."""
    quick = [
        made(machine, {"operating.drive_frequency_hz": frequency})
        for frequency in (9, 14, 300)
    ]
    together = simulate_together([*quick, *runs[:2]])
    for one, other in zip(quick, together, strict=False):
        (alone,) = simulate_together([one])
        assert alone.acceleration.tobytes() == other.acceleration.tobytes()
        assert alone.shaft_angle.tobytes() == other.shaft_angle.tobytes()


class TestHardLandings:
    """Two teeth missing under 1.1 N m at 3600 r/min: landings are too stiff for one step a sample."""

    @pytest.fixture(scope="class")
    @classmethod
    def bouncing(cls, machine):
        missing = [MissingTooth(gear="pinion", tooth=tooth) for tooth in (3, 4)]
        run = made(
            machine, {"operating.torque_nm": 1.1, "operating.speed_rpm": 3600}, missing
        )
        return replace(run, specimen=None, gearbox=None)

    def test_they_are_settled_in_finer_steps_and_leave_their_neighbours_alone(
        self, runs, bouncing
    ):
        together = simulate_together([runs[0], bouncing, *runs[1:]])
        assert together[1].contact_loss_fraction > BOUNCING
        for one, other in zip([runs[0], bouncing, *runs[1:]], together, strict=True):
            (alone,) = simulate_together([one])
            assert alone.acceleration.tobytes() == other.acceleration.tobytes()

    def test_coarse_steps_would_lose_them(self, bouncing, monkeypatch):
        monkeypatch.setattr(runge_kutta, "CAREFUL", 1)
        (record,) = simulate_together([bouncing])
        assert isinstance(record, SimulationError)


def test_stages_become_finer_and_end_before_the_record(dynamics_of, xiamen):
    stages = settling_stages(
        dynamics_of(xiamen), xiamen.solver.oversampling, SAMPLING_RATE
    )
    assert [steps for steps, _ in stages] == [steps for steps, _ in COARSE]
    assert all(one > other > 0 for (_, one), (_, other) in pairwise(stages))


@pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
def test_no_stage_takes_longer_steps_than_are_stable_nor_shorter_than_the_record(
    dynamics_of, xiamen
):
    dynamics = dynamics_of(xiamen)
    oversampling = xiamen.solver.oversampling
    assert [steps for steps, _ in settling_stages(dynamics, 2, SAMPLING_RATE)] == [
        1,
        2,
        2,
    ]
    assert coarsest_oversampling(dynamics, oversampling, SAMPLING_RATE) == 1
    assert [
        steps for steps, _ in settling_stages(dynamics, oversampling, SAMPLING_RATE / 2)
    ] == [
        2,
        2,
        3,
    ]
