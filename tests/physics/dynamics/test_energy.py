"""Power in = stored + dissipated, at every internal step of the compiled integrator."""

import numpy as np
import pytest
from energy_balance import balance
from fault_cases import one

from gensig.faults.broken import MissingTooth

STEP = 1 / (51200.0 * 32)
N_STEPS = round(0.008 / STEP)
# the missing tooth would enter 2.5 ms after the start: its whole passage is in the record
FAULTS = {
    "healthy": (),
    "missing_pinion": (MissingTooth(gear="pinion", tooth=2),),
    "missing_wheel": (MissingTooth(gear="wheel", tooth=2),),
    "flanks": (
        one("chipped", tooth=2, chip_width_mm=15),
        one("pitch_error", gear="wheel", tooth=2),
    ),
}


@pytest.fixture(scope="module", params=FAULTS)
def faulty(request, machine, running_of):
    return {
        law: running_of(
            machine({"mesh.roll_torque": law}),
            FAULTS[request.param],
        )
        for law in ("consistent", "classical")
    }


@pytest.fixture(scope="module")
def case(faulty):
    return {law: balance(running, STEP, N_STEPS) for law, running in faulty.items()}


def test_power_is_stored_and_dissipated(case):
    consistent = case["consistent"]
    assert consistent.residual < 2e-4
    assert case["classical"].residual > 0.1  # its equations do not balance
    undamped = np.zeros_like(consistent.mesh_damping)
    assert consistent._replace(mesh_damping=undamped).residual > 0.02


def test_damping_and_friction_dissipate(case):
    """Only the motion of the bearings across can turn friction, near the pitch point."""
    for motion in case.values():
        assert 0 <= motion.mesh_damping.min() < motion.mesh_damping.max()
        assert motion.friction.mean() < -10
        assert motion.friction.max() < 0.05 * -motion.friction.mean()


def test_coarse_tables_balance_too(machine, running_of):
    coarse = running_of(machine({"mesh.points_per_pitch": 128}))
    assert balance(coarse, STEP, N_STEPS).residual < 2e-4
