"""Forces over the angle of a shaft: an unbalance in the core, beside the linear answer."""

from dataclasses import replace

import numpy as np
import pytest
from lane_tools import motions

from gensig.dynamics.motion.course import ShaftTorque
from gensig.dynamics.pair import PINION_ROTATION, PINION_X, PINION_Y
from gensig.dynamics.response import accelerations

RATE, DURATION = 51200.0, 0.2
CHANNELS = ("pinion_x", "pinion_y")
FORCE, N_NODES = 50.0, 512
# smooth teeth without friction, so that the answer is linear; the drive is quick to settle
SMOOTH = {
    "operating.drive_frequency_hz": 20,
    "operating.duration_s": DURATION,
    "mesh.friction_coefficient": 0.0,
}


@pytest.fixture(scope="module")
def pair(machine, dynamics_of):
    return dynamics_of(machine(SMOOTH))


def unbalanced(pair):
    """The pair with a force that turns with the pinion, from x to y against its rotation."""
    angle = 2.0 * np.pi * np.arange(N_NODES) / N_NODES
    forces = tuple(
        ShaftTorque(dof=dof, table=FORCE * wave(angle), turned_by=PINION_ROTATION)
        for dof, wave in ((PINION_X, np.cos), (PINION_Y, np.sin))
    )
    changed = replace(pair, torques=(*pair.torques, *forces))
    assert not changed.equations.is_gear_pair
    return changed


def test_an_unbalance_moves_the_gears_as_the_linear_machine(pair):
    """At the order 1 of its shaft, in size and phase."""
    record = {"channels": CHANNELS, "duration": DURATION, "oversampling": 5}
    plain, turned = (motions(each, **record)[0] for each in (pair, unbalanced(pair)))
    speed, n_samples = pair.nominal.at(0.0).speed, plain.shape[1]
    turning = np.exp(-1j * speed * np.arange(n_samples) / RATE)
    found = 2.0 * np.mean((turned - plain) * turning, axis=1)

    force = np.zeros((1, len(pair.dofs)), dtype=np.complex128)
    force[0, [PINION_X, PINION_Y]] = FORCE, -1j * FORCE
    answer = accelerations(pair, np.array([speed]), force)[0]
    expected = answer[[PINION_X, PINION_Y]]
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max()
