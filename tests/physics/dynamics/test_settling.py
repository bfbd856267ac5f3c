"""A record begins settled, after settling in coarse steps."""

import re
from dataclasses import replace

import numpy as np
import pytest
from fault_cases import one

from gensig.dynamics.backends import group_motions
from gensig.dynamics.backends.base import BOUNCING, Integration
from gensig.dynamics.backends.nystroem.method import THREE_PAIRS
from gensig.dynamics.decimation import in_band_error
from gensig.errors import SimulationError, StepError
from gensig.faults.broken import MissingTooth
from gensig.sensing.manufacturing import draw_gearbox, draw_specimen
from gensig.systems.base import simulate_together
from gensig.systems.integration_checks import not_finite
from gensig.systems.run import Run

RATE = 51200.0
LEFT = 5e-4  # of a spectrum; measured 4e-4 at 600 r/min, 3e-4 at other speeds
SPEED = "operating.speed_rpm"
LINE = {
    "system.motor.inertia_kg_m2": 2e-3,
    "system.load.inertia_kg_m2": 0.05,
    SPEED: 1500,
}


@pytest.fixture(scope="module")
def run(machine):
    """One record of gears with errors, in a gearbox of its own."""

    def make(changes, faults=()):
        options = {
            "operating.duration_s": 0.1,
            "solver.max_error": None,
            **changes,
        }
        system = machine(options)
        rng = np.random.default_rng(1)
        pair = system.pair
        quality = system.quality
        sensing = system.sensing
        specimen = draw_specimen(rng, pair.pinion, pair.wheel, quality)
        gearbox = draw_gearbox(
            rng,
            len(sensing.channels),
            quality,
            sensing.gain_scatter,
        )
        return Run(
            system=system,
            faults=tuple(faults),
            specimen=specimen,
            gearbox=gearbox,
        )

    return make


@pytest.fixture(scope="module")
def runs(run):
    """Slow, usual with a fault, fast, and with motor and load."""
    crack = one("crack", tooth=3, crack_depth_mm=1)
    return [
        run({SPEED: 600}),
        run({}, [crack]),
        run({SPEED: 6000}),
        run(LINE),
    ]


@pytest.fixture(scope="module")
def steady(runs):
    """The same after 1.2 s of settling in fine steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(group_motions, "SETTLING_STEPS", 5)
        patch.setattr(group_motions, "settling_time", lambda *_: 1.2)
        return simulate_together(runs)


def left(runs, steady):
    """Relative difference from the steady records, (run,)."""
    signals = (
        np.array([record.acceleration for record in records])
        for records in (simulate_together(runs), steady)
    )
    return in_band_error(*signals, RATE)


def test_nothing_of_the_start_is_left(runs, steady):
    assert np.all(left(runs, steady) < LEFT)


def assert_independent(runs):
    together = simulate_together(runs)
    for run, record in zip(runs, together, strict=True):
        (alone,) = simulate_together([run])
        assert alone.acceleration.tobytes() == record.acceleration.tobytes()
        assert alone.shaft_angle.tobytes() == record.shaft_angle.tobytes()
    return together


def test_machines_that_begin_in_different_stages_are_independent(run, runs):
    """A quick drive begins when the steps of the others have changed already."""
    quick = [run({"operating.drive_frequency_hz": rate}) for rate in (9, 14, 300)]
    assert_independent([*quick, *runs[:2]])


def settling_steps(run, monkeypatch):
    """Steps per sample in which a machine settled, in the order in which they were tried."""
    tried = []
    run_until = group_motions.run_until

    def noted(*arguments):
        tried.append(arguments[-1])
        return run_until(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(group_motions, "run_until", noted)
        (record,) = simulate_together([run])
    assert not isinstance(record, SimulationError)
    return tried


@pytest.fixture(scope="module")
def landing(run):
    """Three teeth missing under 0.1 N m at 3600 r/min, recorded at 5120 Hz, without noise."""
    missing = [MissingTooth(gear="pinion", tooth=tooth) for tooth in (3, 4, 5)]

    def make(oversampling, max_error=None):
        changes = {
            "operating.torque_nm": 0.1,
            SPEED: 3600,
            "sensing.sampling_rate_hz": 5120,
            "solver.oversampling": oversampling,
            "solver.max_error": max_error,
        }
        single = run(changes, missing)
        return replace(single, specimen=None, gearbox=None)

    return make


@pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
class TestLandingsTooHardForTheSettling:
    """A landing is as stiff as it is hard; the least stable step is that of the mean force."""

    def test_they_settle_in_the_steps_of_the_record(self, landing, monkeypatch):
        single = landing(40)
        (record,) = simulate_together([single])
        assert settling_steps(single, monkeypatch) == [20, 40]
        assert record.contact_loss_fraction > BOUNCING

        monkeypatch.setattr(group_motions, "SETTLING_STEPS", 40)
        assert settling_steps(single, monkeypatch) == [40]
        (finer,) = simulate_together([single])
        assert record.acceleration.tobytes() == finer.acceleration.tobytes()

    def test_neighbours_keep_their_bits(self, landing, run):
        rate = {"sensing.sampling_rate_hz": 5120, "solver.oversampling": 40}
        assert_independent([run(rate), landing(40), run({**rate, SPEED: 900})])

    def test_too_long_steps_of_the_record_are_halved(self, landing):
        """With a limit of the error; without one the error says what to raise."""
        (failed,) = simulate_together([landing(20)])
        assert isinstance(failed, StepError)
        told = "too long for their impacts; raise solver.oversampling above 20"
        assert re.search(told, str(failed))

        remedy = str(not_finite(landing(20, max_error=1.0), []))
        assert "operating.torque_nm nearer to gear.rated_torque_nm" in remedy
        assert not re.search("(raise|lower) operating.torque_nm", remedy)

        (record,) = simulate_together([landing(20, max_error=1.0)])
        (finer,) = simulate_together([landing(40, max_error=1.0)])
        assert record.acceleration.tobytes() == finer.acceleration.tobytes()


@pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
@pytest.mark.parametrize(
    ("limit", "rate", "steps"), [(5, RATE, 3), (2, RATE, 2), (8, RATE / 4, 8)]
)
def test_the_settling_takes_coarse_steps_within_stability(
    dynamics_of, xiamen, limit, rate, steps
):
    integration = Integration(
        sampling_rate=rate,
        duration=0.01,
        channels=("pinion_y",),
        with_mesh_state=False,
        oversampling=limit,
        precision="float64",
        max_error=None,
    )
    machine = dynamics_of(xiamen)
    found = group_motions.settling_steps(machine, integration, THREE_PAIRS)
    assert found == steps
