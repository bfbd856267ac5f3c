"""Safety factors: every factor where it belongs, life, notch and size of ISO 6336-3, reliability
classes."""

from dataclasses import replace

import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.life.root.strength import (
    Strength,
    life_factor,
    relative_notch_sensitivity,
    reliability,
    safety,
    size_factor,
)
from gensig.options.compose import compose
from gensig.options.groups import options
from gensig.units import read


@pytest.fixture(scope="module")
def strength():
    return read(
        Strength,
        compose("generate", [])["strength"],
        "strength",
    )


def safe(strength, stress=349.39e6, **changes):
    return safety(
        replace(strength, **changes), stress, notch_parameter=2.5, normal_module=3e-3
    )


@pytest.mark.parametrize(
    "key",
    [
        "test_gear_stress_correction",
        "life_factor",
        "relative_notch_sensitivity",
        "relative_surface_factor",
        "size_factor",
        "mean_stress_factor",
    ],
)
def test_every_factor_is_a_factor(strength, key):
    base = safe(strength, **{key: 1.0})
    assert_allclose(
        safe(strength, **{key: 0.8}).iso,
        0.8 * base.iso,
    )
    assert safe(strength, **{key: 0.8}).paper == base.paper


def test_life_factor():
    ends = [life_factor(n) for n in (1e2, 1e3, 3e6, 1e10, 1e12)]
    assert_allclose(ends, [2.5, 2.5, 1.0, 0.85, 0.85])
    # its lines as the standard writes them
    assert_allclose(
        life_factor(1e5),
        (3e6 / 1e5) ** 0.115,
        rtol=5e-3,
    )
    assert_allclose(
        life_factor(3.6e8),
        (3e6 / 3.6e8) ** 0.02,
        rtol=5e-3,
    )
    assert_allclose(life_factor(3.6e8), 0.9, rtol=0.02)  # the paper's K_FN there


def test_notch_and_size():
    sharp, reference, blunt = map(
        relative_notch_sensitivity,
        (1.5, 2.5, 4.0),
    )
    assert 0.98 < sharp < reference == 1.0 < blunt < 1.02
    factors = [size_factor(module) for module in (1e-3, 5e-3, 12e-3, 25e-3, 40e-3)]
    assert_allclose(factors, [1.0, 1.0, 0.93, 0.8, 0.8])


def test_reliability_classes():
    classes = {
        2.0: "high",
        1.6: "higher",
        1.25: "general",
        1.0: "low",
    }
    assert {least: reliability(least) for least in classes} == classes
    assert [reliability(value) for value in (1.59, 0.99)] == ["general", "below low"]


def test_load_factors(strength):
    loaded = replace(
        strength, application_factor=1.25, dynamic_factor=1.1, face_load_factor=1.3
    )
    assert strength.load_factor == strength.force_factor == 1.0
    assert_allclose(loaded.force_factor, 1.375)
    assert_allclose(loaded.load_factor, 1.7875)


def test_every_option_is_a_strength():
    assert {"18cr2ni4w", "case_hardened_mq"} <= set(options("strength"))
    for name in options("strength"):
        values = compose("generate", [f"strength={name}"])["strength"]
        assert read(Strength, values, "strength").name == name


def test_factors_and_stresses_must_be_positive(strength):
    with refused("life_factor = -1 must be positive"):
        replace(strength, life_factor=-1)
    with refused("must be positive"):
        safe(strength, 0.0)
