"""Distinct teeth in the compiled core's table: summed pair by pair where they are few, by themselves where many."""

import numpy as np
import pytest
from core_runs import CoreRun
from fault_cases import one
from lane_tools import LAW, laws
from numpy.testing import assert_allclose

from gensig.dynamics import lanes
from gensig.dynamics._vector import LANES
from gensig.dynamics.lanes import pack
from gensig.faults.broken import MissingTooth

LAWS = {
    "one_sided": {},
    "classical": {"mesh.roll_torque": "classical"},
    "paper": {
        "mesh.law": "paper",
        "mesh.pair_coupling": "sum",
        "mesh.contact": "linear",
    },
}
PITS = tuple(
    one("pitting", gear=gear, tooth=tooth, pit_width_mm=3.0 + 2.0 * tooth)
    for gear, n_teeth in (("pinion", 5), ("wheel", 6))
    for tooth in range(n_teeth)
)
FAULTS = (*PITS, MissingTooth(gear="wheel", tooth=20))
N_PINION, N_WHEEL = 6, 8  # distinct teeth, the sound ones too


@pytest.fixture(scope="module", params=LAWS)
def dynamics(request, machine, dynamics_of):
    errors = np.random.default_rng(3).normal(0, 2e-6, 84)
    system = machine({**LAWS[request.param], "gear.backlash_um": 10})
    return dynamics_of(system, FAULTS, pinion_error=errors[:23], wheel_error=errors)


@pytest.fixture(scope="module")
def motions(dynamics):
    """Instants over more turns than a wheel has, driven and coasting, (instant, 4)."""
    rng, n = np.random.default_rng(9), 4000
    roll = dynamics.table.pair.base_pitch * rng.uniform(-200, 200, n)
    return np.column_stack(
        [
            roll,
            rng.uniform(-4e-5, 4e-5, n),
            1e-3 * rng.standard_normal(n),
            rng.uniform(2, 6, n),
        ]
    )


@pytest.fixture
def laid_out(monkeypatch):
    """Runs something with the teeth summed pair by pair (False), or by themselves (True)."""

    def made(many, make):
        with monkeypatch.context() as patch:
            patch.setattr(lanes, "_are_many", lambda table: many)
            return make()

    return made


def test_many_products_stand_by_themselves(xiamen, dynamics_of, dynamics):
    n_nodes = dynamics.table.position.size
    few, many = dynamics_of(xiamen, PITS[:5]), dynamics
    assert len(pack([few], 1e-6).table) == LANES * 4 * n_nodes * 6
    assert len(pack([many], 1e-6).table) == LANES * 4 * n_nodes * (N_PINION + N_WHEEL)
    assert N_PINION + N_WHEEL < N_PINION * N_WHEEL / 2


def test_both_layouts_give_one_law(dynamics, motions, laid_out):
    by_pair, by_tooth = (
        laid_out(many, lambda: laws(dynamics, motions)) for many in (False, True)
    )
    for name, found, expected in zip(LAW, by_tooth.T, by_pair.T, strict=True):
        assert_allclose(
            found,
            expected,
            rtol=1e-12,
            atol=1e-12 * np.abs(expected).max(),
            err_msg=name,
        )
    assert (by_pair[:, 0] > 0).mean() > 0.2
    assert (by_pair[:, 0] < 0).mean() > 0.2


def test_teeth_differ_in_that_law(dynamics, motions, xiamen, dynamics_of):
    """What a table that forgot the pits or the wheel's rows would give is far off."""
    found = laws(dynamics, motions)[:, 0]
    for some in (PITS[:5], PITS[5:], ()):
        sound = dynamics_of(
            xiamen,
            some,
            pinion_error=dynamics.pinion_error,
            wheel_error=dynamics.wheel_error,
        )
        other = laws(sound, motions)[:, 0]
        assert np.abs(other - found).max() > 0.05 * np.abs(found).max()


def test_both_layouts_give_one_motion(dynamics, laid_out):
    def walk(machines):
        run = CoreRun(machines, 1 / (51200 * 5))
        return run.advance(3000), run.whole

    by_pair, by_tooth = (
        laid_out(many, lambda: walk([dynamics])) for many in (False, True)
    )
    assert_allclose(
        by_tooth[0], by_pair[0], rtol=0, atol=1e-9 * np.abs(by_pair[0]).max()
    )
    assert_allclose(
        by_tooth[1], by_pair[1], rtol=0, atol=1e-9 * np.abs(by_pair[1]).max()
    )
