"""Sensors whose noise is louder than the ratio says."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.sensing.noise import read_noise

PARTS = [{"kind": "white", "share": 1.0}]


def test_factor(machine):
    sensing = machine(
        {
            "sensing.channels": ["pinion_x", "pinion_y"],
            "sensing.noise.offsets_db": [3.0, -7.0],
        }
    ).sensing
    assert_allclose(
        10.0 * np.log10(sensing.noise_factor(20.0)), [-17.0, -27.0], rtol=0, atol=1e-9
    )


def test_without_offsets_the_bits_are_those_of_the_ratio(xiamen):
    for snr in (20.0, 13.7, -3.3):
        assert np.all(xiamen.sensing.noise_factor(snr) == 10.0 ** (-snr / 10.0))


def test_refused(machine):
    with pytest.raises(ConfigError, match=re.escape("has 1 values for 4 sensors")):
        machine({"sensing.noise.offsets_db": [1.0]})
    for value in ("loud", ["x"], [True], [float("nan")]):
        with pytest.raises(
            ConfigError,
            match=r"offsets_db = .* must be a list of numbers, one a sensor, or null",
        ):
            read_noise({"parts": PARTS, "band_hz": None, "offsets_db": value})
