"""The clamped elastic ring: check numbers of the reference derivation, finite-element rows,
reciprocity.
"""

import math

import numpy as np
import pytest
from closeness import assert_close

from gensig.geometry.tooth_profile import load_angle
from gensig.mesh.body_coupling import (
    arc_flexibility,
    cross_compliance,
    ring_harmonic,
    shared_body_compliance,
)

# 1e-15 m/Pa, upper triangles (11, 12, 22); independently derived
HARMONICS = {
    ("pinion", 0): (50.9463, 0.0, 541.8322),
    ("pinion", 1): (60.4124, -37.2777, 254.3192),
    ("pinion", 2): (61.6698, -15.5399, 107.886),
    ("pinion", 10): (19.4000, 5.0258, 19.4002),
    ("wheel", 0): (262.7678, 0.0, 14668.9889),
    ("wheel", 1): (513.6413, -477.1375, 1505.0751),
    ("wheel", 2): (388.2007, -78.3363, 435.1589),
    ("wheel", 10): (77.1281, 19.9814, 77.1281),
}
SELF = {
    "pinion": (
        3.092345e-10,
        2.369060e-8,
        -1.163667e-6,
        5.880031e-5,
    ),
    "wheel": (
        6.006637e-10,
        3.235829e-7,
        -3.990314e-6,
        4.953859e-5,
    ),
}
NEIGHBOR = {
    "pinion": (
        1.032968e-10,
        5.560972e-10,
        -2.711023e-8,
        -2.972583e-9,
        1.532582e-7,
        -6.750071e-6,
    ),
    "wheel": (
        3.812153e-10,
        2.354808e-9,
        -2.941305e-8,
        -3.713858e-8,
        4.609247e-7,
        -5.420136e-6,
    ),
}
# finite elements, 1e-12 m/N, at s = 0 ... 4.203 mm from A; ring reference
# (docs/theory/spur_mesh.md), table 4.3
S_MM = (0.0, 0.700, 1.401, 2.101, 2.802, 3.502, 4.203)
CROSS_FE = {
    "pinion": (477.8, 475.7, 472.9, 469.4, 465.1, 460.0, 454.0),
    "wheel": (
        1862.8,
        1869.0,
        1875.0,
        1880.7,
        1886.4,
        1892.1,
        1898.1,
    ),
}
SIDES = ("pinion", "wheel")
MIRROR = np.diag([1.0, -1.0, -1.0])


@pytest.fixture(params=SIDES)
def side(request):
    return request.param


@pytest.fixture
def gear(xiamen, side):
    return getattr(xiamen.pair, side)


def neighbor(gear, k=1):
    return 2 * math.pi * k / gear.n_teeth


@pytest.mark.parametrize(("side", "n"), HARMONICS)
def test_ring_harmonics(xiamen, side, n):
    result = ring_harmonic(getattr(xiamen.pair, side), xiamen.material, n)
    expected = np.array(HARMONICS[side, n]) * 1e-15
    assert_close(
        result[[0, 0, 1], [0, 1, 1]],
        expected,
        5e-6,
        atol=6e-20,
    )


@pytest.mark.parametrize("n", [1, 2, 7, 60, 300])
def test_ring_harmonics_are_symmetric_and_positive(gear, xiamen, n):
    h = ring_harmonic(gear, xiamen.material, n)
    assert_close(
        h[0, 1],
        h[1, 0],
        1e-9,
        atol=1e-12 * np.abs(h).max(),
    )
    assert np.linalg.eigvalsh(0.5 * (h + h.T)).min() > 0


def test_own_flexibility(gear, side, xiamen):
    c = arc_flexibility(gear, xiamen.material, 0.0)
    assert_close(
        [c[0, 0], c[1, 1], c[1, 2], c[2, 2]],
        SELF[side],
        1e-6,
    )
    assert_close(
        c[0, 1:],
        0.0,
        atol=1e-9 * np.abs(c[1, 1:]).max(),
    )


def test_flexibility_of_the_neighbor(gear, side, xiamen):
    c = arc_flexibility(gear, xiamen.material, neighbor(gear))
    assert_close(
        c[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]],
        NEIGHBOR[side],
        1e-6,
    )
    assert_close(
        [c[1, 0], c[2, 0], c[2, 1]],
        [-c[0, 1], -c[0, 2], c[1, 2]],
        1e-8,
    )


@pytest.mark.parametrize("k", [1, 2, 5])
def test_reciprocity_and_mirror_symmetry(gear, xiamen, k):
    below, ahead, behind = (
        arc_flexibility(gear, xiamen.material, neighbor(gear, pitches))
        for pitches in (0, k, -k)
    )
    size = np.sqrt(np.diag(below))
    scale = np.outer(size, size)

    assert_close(behind / scale, ahead.T / scale, atol=1e-10)
    assert_close(
        behind / scale,
        MIRROR @ ahead @ MIRROR / scale,
        atol=1e-10,
    )
    # symmetric by itself, reciprocity would show nothing
    assert np.abs((ahead - ahead.T) / scale).max() > 1e-5


def test_body_under_the_loaded_tooth_at_the_pitch_point(gear, side, xiamen):
    rho = xiamen.pair.pinion_curvature(xiamen.pair.pitch_point)
    angle = load_angle(
        gear,
        np.array([rho if side == "pinion" else xiamen.pair.tangent_length - rho]),
    )
    result = cross_compliance(gear, xiamen.material, angle, angle, pitches=0)

    assert_close(
        result,
        {"pinion": 1031.22e-12, "wheel": 2372.06e-12}[side],
        1e-5,
    )


def cross_over_the_zone(pair, material, side, pitches):
    s = np.array(S_MM) * 1e-3
    gear = getattr(pair, side)
    curvature = getattr(pair, f"{side}_curvature")
    loaded, probed = (
        load_angle(gear, np.asarray(curvature(s + k * pair.base_pitch))) for k in (0, 1)
    )
    return cross_compliance(gear, material, loaded, probed, pitches=pitches)


def test_cross_compliance_against_finite_elements(side, xiamen):
    result = cross_over_the_zone(
        xiamen.pair,
        xiamen.material,
        side,
        1 if side == "pinion" else -1,
    )
    assert_close(result, np.array(CROSS_FE[side]) * 1e-12, 0.01)


def test_shared_compliance_is_the_mean_of_both_gears_over_the_double_zone(xiamen):
    expected = sum(np.mean(CROSS_FE[side]) for side in SIDES) * 1e-12
    assert_close(
        shared_body_compliance(xiamen.pair, xiamen.material),
        expected,
        1e-3,
    )
