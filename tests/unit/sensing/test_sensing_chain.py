import numpy as np
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from gensig.sensing.chain import add_noise, power


def test_noise_is_white():
    clean, rng = np.zeros((1, 65536)), default_rng(2)
    (noise,) = add_noise(clean, np.array([2.0]), rng)
    assert_allclose(noise.var(), 2.0, rtol=0.02)
    bands = (np.abs(np.fft.rfft(noise)[1:]) ** 2).reshape(8, -1).mean(axis=1)
    assert_allclose(bands / bands.mean(), 1.0, atol=0.08)


def test_no_power_no_noise():
    clean = default_rng(3).standard_normal((2, 50))
    noisy = add_noise(clean, np.zeros(2), default_rng(4))
    assert_array_equal(noisy, clean)


def test_power_ignores_the_mean():
    signals = np.array([[1.0, -1.0], [6.0, 4.0]])
    assert_allclose(power(signals), [1.0, 1.0])
