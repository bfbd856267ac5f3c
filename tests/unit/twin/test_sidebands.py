"""Sidebands of a mesh in the order spectrum of a recording."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.signals.mesh_motion import Teeth
from gensig.signals.transfer.order_lines import find_lines
from gensig.twin.grade import sideband_ratios

TEETH = Teeth(driving=20, driven=31)
RATE, MESH_HZ = 12800.0, 400.0
CYCLES = MESH_HZ / RATE * np.arange(4 * 12800)


def ratio(*offsets):
    """Ratio in dB for sidebands of 0.1 of the mesh at some mesh orders from the harmonic."""
    orders = {1.0: 1.0} | {1.0 + offset: 0.1 for offset in offsets}
    waves = [size * np.cos(2 * np.pi * k * CYCLES) for k, size in orders.items()]
    noise = 1e-4 * np.random.default_rng(0).standard_normal(CYCLES.size)
    lines = find_lines((sum(waves) + noise)[None], CYCLES, RATE, TEETH)
    return sideband_ratios(lines, TEETH)[0, 0]


@pytest.mark.parametrize("n_teeth", [20, 31])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("step", [1, 3])
def test_every_sideband_counts_on_either_side(n_teeth, side, step):
    assert_allclose(ratio(side * step / n_teeth), -20.0, atol=0.02)


def test_powers_of_sidebands_add_up():
    assert_allclose(ratio(-1 / 20, 1 / 31, 2 / 31), -20 + 10 * np.log10(3), atol=0.02)


def test_the_fourth_sideband_belongs_to_none():
    assert np.isnan(ratio(4 / 31)) or ratio(4 / 31) < -40.0
