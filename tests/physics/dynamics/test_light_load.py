"""A missing tooth in light load: the law of damping decides how loud it is, the phase does not."""

from functools import cache

import numpy as np
import pytest
from plain_motion import at_rest, equations, solved
from scipy.signal import decimate

from gensig import load_system
from gensig.faults.broken import MissingTooth
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run, Start

RATE, PER_SAMPLE = 51200, 4
DURATION, SETTLING = 0.1, 0.03  # s: three turns
PINION_Y_SPEED = 7  # in the state
PAPERS = (
    "mesh.pair_coupling=sum",
    "mesh.contact=linear",
    "mesh.elasticity=plane_stress",
    "mesh.body=sainsot",
    "mesh.tooth=to_contact",
    "mesh.bending=whole",
    "mesh.roll_torque=classical",
    "operating.speed_rpm=1800",
    "operating.torque_nm=5",
)


@cache
def level(prescribed, by_stiffness):
    """RMS of pinion_y, m/s2."""
    system = load_system(*PAPERS)
    missing = MissingTooth(gear="pinion", tooth=3)
    start = Start(tooth_pinion=3, tooth_wheel=5, phase=0.3)
    running = running_pair(Run(system=system, faults=(missing,), start=start))
    ratio = running.mesh_damping / running.mean_mesh_stiffness
    slope, _ = equations(
        running.dynamics,
        prescribed=prescribed,
        damped_by_stiffness=ratio if by_stiffness else None,
    )
    times = np.arange(int(DURATION * RATE * PER_SAMPLE)) / (RATE * PER_SAMPLE)
    states = solved(slope, at_rest(running.dynamics), times, "RK45", 1e-6)
    gained = [slope(t, y)[PINION_Y_SPEED] for t, y in zip(times, states, strict=True)]
    signal = decimate(np.array(gained), PER_SAMPLE, ftype="fir")
    return signal[int(SETTLING * RATE) :].std()


@pytest.mark.parametrize("by_stiffness", [False, True], ids=["load", "stiffness"])
def test_the_phase_decides_nothing(by_stiffness):
    own, set_speed = (level(each, by_stiffness) for each in (False, True))
    assert 0.0 < abs(own / set_speed - 1.0) < 0.03


def test_damping_by_stiffness_is_a_third_louder():
    assert 1.2 < level(False, True) / level(False, False) < 1.5
