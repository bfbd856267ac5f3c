"""Zones of ISO 20816-3 and velocities from accelerations."""

import numpy as np
import pytest

from gensig.report.levels import velocity_rms, vibration_zone, zone_limits


@pytest.mark.parametrize(
    ("velocity", "power", "zone"),
    [
        (0.0, 8.5, "A"),
        (1.4e-3, 8.5, "A"),
        (1.41e-3, 8.5, "B"),
        (2.9e-3, 300.0, "C"),
        (4.6e-3, 300.0, "D"),
        (2.2e-3, 301.0, "A"),
        (7.2e-3, 301.0, "D"),
    ],
)
def test_zones_are_those_of_the_power(velocity, power, zone):
    assert vibration_zone(velocity, power) == zone


def test_the_words_name_the_range_of_the_standard():
    assert "for 15 kW and more" in zone_limits(8.5)
    assert "for 15 kW and more" not in zone_limits(55.0)
    assert "A to 1.4, B to 2.8, C to 4.5 mm/s" in zone_limits(55.0)


def test_velocity_of_a_tone():
    time = np.arange(51_200) / 51_200.0
    tones = 3.0 * np.cos(2.0 * np.pi * np.array([[200.0], [2000.0]]) * time)
    velocity = velocity_rms(tones, 51_200.0)
    expected = 3.0 / np.sqrt(2.0) / (2.0 * np.pi * 200.0)
    assert velocity[0] == pytest.approx(expected, rel=1e-3)
    assert velocity[1] < 1e-3 * velocity[0]  # above 1000 Hz
