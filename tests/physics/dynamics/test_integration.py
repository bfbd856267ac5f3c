"""Accuracy of records: error of the integration, settling, mean speed, and no false sidebands."""

import math

import numpy as np
import pytest
from closeness import assert_close

from gensig.faults.broken import MissingTooth

RATE = 51200.0
MISSING = MissingTooth(gear="pinion", tooth=3)
DURATION = "operating.duration_s"
SPEED = "operating.speed_rpm"


def in_band(acceleration):
    """Spectrum from 20 Hz to 20 kHz under a Hann window, (channel, line)."""
    n = acceleration.shape[-1]
    frequency = np.fft.rfftfreq(n, 1 / RATE)
    inside = (frequency >= 20) & (frequency <= 20e3)
    return np.fft.rfft(acceleration * np.hanning(n), axis=-1)[:, inside]


def test_the_error_falls_with_the_fourth_power_of_the_step(machine, composed_config):
    """As docs/theory/integration.csv tabulates it, against 64 steps a sample."""

    def spectrum(steps):
        options = {
            DURATION: 0.05,
            "solver.oversampling": steps,
            "solver.max_error": None,
        }
        return in_band(machine(options).simulate().acceleration)

    exact = spectrum(64)
    errors = {}
    for steps in (4, 5, 8, 16):
        off = np.linalg.norm(spectrum(steps) - exact, axis=1)
        errors[steps] = (off / np.linalg.norm(exact, axis=1)).max()

    assert 3.0 < math.log2(errors[4] / errors[16]) / 2 < 4.5
    assert 3e-4 < errors[4] < 1e-3
    assert errors[composed_config["solver"]["oversampling"]] < 3e-4
    assert errors[8] < 5e-5


@pytest.mark.parametrize(("speed_rpm", "torque_nm"), [(1800, 100), (900, 5)])
def test_the_mean_speed_is_the_set_speed_with_any_fault(machine, speed_rpm, torque_nm):
    condition = {
        SPEED: speed_rpm,
        "operating.torque_nm": torque_nm,
        DURATION: 0.4,
    }
    system = machine(condition)
    for faults in ((), (MISSING,)):
        assert_close(
            system.simulate(faults).mean_speed,
            system.operating.speed,
            1e-5,
        )
