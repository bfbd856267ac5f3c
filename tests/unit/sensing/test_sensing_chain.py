import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.sensing.chain import add_noise, power


def test_noise_is_white():
    noise = add_noise(np.zeros((1, 65536)), np.array([2.0]), np.random.default_rng(2))[
        0
    ]
    assert_allclose(noise.var(), 2.0, rtol=0.02, atol=0)
    bands = (np.abs(np.fft.rfft(noise)[1:]) ** 2).reshape(8, -1).mean(axis=1)
    assert_allclose(bands / bands.mean(), 1.0, rtol=0, atol=0.08)


def test_no_power_no_noise():
    clean = np.random.default_rng(3).standard_normal((2, 50))
    assert_allclose(
        add_noise(clean, np.zeros(2), np.random.default_rng(4)), clean, rtol=0, atol=0
    )


def test_power_ignores_the_mean():
    assert_allclose(
        power(np.array([[1.0, -1.0], [6.0, 4.0]])), [1.0, 1.0], rtol=1e-12, atol=0
    )


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"sampling_rate": 10.0},
            "sensing.sampling_rate_hz = 10 must lie in 1000..1e+06",
        ),
        ({"channels": ()}, "sensing.channels = [] must name at least one channel"),
        (
            {"channels": ("pinion_y", "pinion_y")},
            "must name at least one channel, each once",
        ),
        (
            {"snr_reference": "me"},
            "sensing.snr_reference = 'me'; allowed: healthy_twin, record",
        ),
        ({"gain_scatter": 0.6}, "sensing.gain_scatter = 0.6 must lie in 0..0.5"),
    ],
)
def test_values_out_of_range(xiamen, changes, text):
    with pytest.raises(ConfigError, match=re.escape(text)):
        replace(xiamen.sensing, **changes)
