"""Loads of the teeth at every sample: balance, sequence of the teeth, and faults."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import one

from gensig.dynamics.mesh_state import NO_TOOTH
from gensig.faults.broken import MissingTooth
from gensig.mesh.pair_table import N_PAIRS
from gensig.sensing.chain import detectability
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run

RATE = 51200.0
DURATION = "operating.duration_s"
SPEED = "operating.speed_rpm"
QUICK = {DURATION: 0.1, "solver.max_error": None}
MISSING = (MissingTooth(gear="pinion", tooth=3),)
CRACK = (one("crack", gear="wheel", tooth=5),)


@pytest.fixture(scope="module")
def run(machine):
    def make(changes=None, faults=()):
        system = machine({**QUICK, **(changes or {})})
        return Run(system=system, faults=faults, with_mesh_state=True)

    return make


@pytest.fixture(scope="module")
def record(run):
    return lambda *changes: simulate_together([run(*changes)])[0]


@pytest.fixture(scope="module", params=["one_sided", "paper"])
def mesh(record, request):
    return record({"mesh.law": request.param}).mesh


def test_shares_of_the_loaded_teeth_sum_to_one(mesh, xiamen):
    shape = N_PAIRS, 5120
    assert (
        mesh.load_share.shape
        == mesh.pinion_tooth.shape
        == mesh.wheel_tooth.shape
        == shape
    )
    assert_close(mesh.load_share.sum(axis=0), 1.0, atol=1e-12)

    for teeth in (mesh.pinion_tooth, mesh.wheel_tooth):
        assert ((teeth == NO_TOOTH) == (mesh.load_share == 0.0)).all()
    assert not mesh.contact_lost.any()
    assert not mesh.fault_engaged.any()
    # 0.3 % more than the force of the drive, for friction
    assert_close(mesh.force.mean(), xiamen.mesh_force, 5e-3)


def test_teeth_follow_one_another_and_keep_their_row(mesh):
    for rows, n_teeth in (
        (mesh.pinion_tooth, 23),
        (mesh.wheel_tooth, 84),
    ):
        carries = rows != NO_TOOTH
        begins = carries[:, 1:] & ~carries[:, :-1]
        sample, row = np.nonzero(begins.T)
        teeth = rows[row, sample + 1]
        assert len(teeth) > 23
        assert (np.diff(teeth) % n_teeth == 1).all()
        assert (np.diff(row) % N_PAIRS == 1).all()
    sample = np.argmax(mesh.pinion_tooth[0] != NO_TOOTH)
    assert mesh.pinion_tooth[0, sample] == mesh.wheel_tooth[0, sample] % 23


def test_slow_gears_have_the_static_shares(run, record):
    slow = {SPEED: 60, DURATION: 0.05}
    result = record(slow)
    running = running_pair(run(slow))
    radius = running.table.pair.pinion.base_radius
    roll = running.teeth.start_roll + radius * result.shaft_angle
    load = running.teeth.static(running.teeth.states(roll), running.mesh_force).load
    expected = np.sort(load / running.mesh_force, axis=1).T
    shares = np.sort(result.mesh.load_share, axis=0)

    assert_close(
        shares.mean(axis=1),
        expected.mean(axis=1),
        atol=3e-3,
    )

    off = np.abs(shares - expected).max(axis=0)
    assert np.quantile(off, 0.95) < 0.03


def test_a_missing_tooth_carries_nothing_and_is_engaged(record, xiamen):
    mesh = record({}, MISSING).mesh
    assert 3 not in mesh.pinion_tooth

    begins = np.flatnonzero(np.diff(mesh.fault_engaged.astype(int)) == 1)
    assert_close(np.diff(begins) / RATE, 60 / 1800, 2e-3)

    # from A to E: the contact ratio in base pitches
    ratio = xiamen.pair.transverse_contact_ratio
    assert_close(mesh.fault_engaged.mean() * 23, ratio, 1e-3)


def test_a_fault_is_engaged_when_its_tooth_carries(record):
    mesh = record({DURATION: 0.4}, CRACK).mesh
    loaded = (mesh.wheel_tooth == 5).any(axis=0)
    assert mesh.fault_engaged[loaded].all()
    assert 0.8 < loaded.sum() / mesh.fault_engaged.sum() <= 1.0


def test_lost_contact_is_that_of_the_record(record):
    """Samples are one in five of the steps of the fraction."""
    result = record({SPEED: 6000, "operating.torque_nm": 2}, MISSING)
    lost = result.mesh.contact_lost
    assert result.contact_loss_fraction > 0.01
    assert_close(lost.mean(), result.contact_loss_fraction, atol=2e-3)
    assert (result.mesh.load_share[:, lost] == 0.0).all()


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_the_loads_do_not_change_the_record(run, precision):
    with_loads = run({"solver.precision": precision}, MISSING)
    plain = replace(with_loads, with_mesh_state=False)
    first, second = (simulate_together([each])[0] for each in (plain, with_loads))
    assert first.mesh is None
    assert first.acceleration.tobytes() == second.acceleration.tobytes()


def test_detectability_is_that_of_a_matched_filter():
    """Root of the energy of the residual over the noise of every channel."""
    residual = np.array([[3.0, 0.0, 4.0], [0.0, 2.0, 0.0]])
    assert_close(
        detectability(residual, np.array([25.0, 1.0])),
        math.sqrt(5.0),
        1e-12,
    )
    assert math.isnan(detectability(np.ones((1, 4)), np.zeros(1)))
