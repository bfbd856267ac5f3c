"""Safety factors: every factor where it belongs, life, notch and size of ISO 6336-3, reliability
classes."""

from dataclasses import replace

import pytest

from gensig.errors import ConfigError
from gensig.life.root.strength import (
    Strength,
    life_factor,
    relative_notch_sensitivity,
    reliability,
    safety,
    size_factor,
)
from gensig.options.compose import compose, options
from gensig.units import read


@pytest.fixture(scope="module")
def strength():
    return read(Strength, compose("generate", [])["strength"], "strength")


def safe(strength, stress=349.39e6, **changes):
    return safety(
        replace(strength, **changes), stress, notch_parameter=2.5, normal_module=3e-3
    )


def test_the_papers_safety_factors(strength):
    assert safe(strength).paper == pytest.approx(1.353, abs=5e-4)
    assert safe(strength, 292.88e6).paper == pytest.approx(1.614, abs=5e-4)
    assert [
        reliability(safe(strength, stress).paper) for stress in (349.39e6, 292.88e6)
    ] == [
        "general",
        "higher",
    ]


def test_iso_counts_the_test_gears_own_notch(strength):
    found = safe(strength)
    assert found.iso / found.paper == pytest.approx(2.0 * life_factor(3.6e8) / 0.9)
    assert found.iso == pytest.approx(2.7, rel=0.02)
    assert safe(strength, mean_stress_factor=0.7).iso == pytest.approx(1.9, rel=0.02)
    assert safe(strength, mean_stress_factor=0.7).paper == found.paper


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
    assert safe(strength, **{key: 0.8}).iso == pytest.approx(0.8 * base.iso, rel=1e-12)
    assert safe(strength, **{key: 0.8}).paper == base.paper


def test_life_factor():
    cycles = (1e2, 1e3, 3e6, 1e10, 1e12)
    assert [life_factor(n) for n in cycles] == pytest.approx(
        [2.5, 2.5, 1.0, 0.85, 0.85]
    )
    # its lines as the standard writes them
    assert life_factor(1e5) == pytest.approx((3e6 / 1e5) ** 0.115, rel=5e-3)
    assert life_factor(3.6e8) == pytest.approx((3e6 / 3.6e8) ** 0.02, rel=5e-3)
    assert life_factor(3.6e8) == pytest.approx(0.9, rel=0.02)  # the paper's K_FN there


def test_notch_and_size():
    assert relative_notch_sensitivity(2.5) == 1.0
    assert (
        0.98
        < relative_notch_sensitivity(1.5)
        < 1.0
        < relative_notch_sensitivity(4.0)
        < 1.02
    )
    assert [
        size_factor(module) for module in (1e-3, 5e-3, 12e-3, 25e-3, 40e-3)
    ] == pytest.approx([1.0, 1.0, 0.93, 0.8, 0.8])


def test_reliability_classes():
    assert [reliability(value) for value in (2.4, 2.0, 1.6, 1.59, 1.25, 1.0, 0.99)] == [
        "high",
        "high",
        "higher",
        "general",
        "general",
        "low",
        "below low",
    ]


def test_load_factors(strength):
    loaded = replace(
        strength, application_factor=1.25, dynamic_factor=1.1, face_load_factor=1.3
    )
    assert strength.load_factor == strength.force_factor == 1.0
    assert loaded.force_factor == pytest.approx(1.375)
    assert loaded.load_factor == pytest.approx(1.7875)


def test_every_option_is_a_strength():
    assert {"18cr2ni4w", "case_hardened_mq"} <= set(options("strength"))
    for name in options("strength"):
        found = read(
            Strength, compose("generate", [f"strength={name}"])["strength"], "strength"
        )
        assert found.name == name


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bending_limit_mpa": 0}, "strength.bending_limit_mpa = 0 must be positive"),
        ({"life_factor": -1}, "strength.life_factor = -1 must be positive"),
        ({"n_load_cycles": 0}, "strength.n_load_cycles = 0 must be positive"),
        (
            {"load_point": "middle"},
            "strength.load_point = 'middle'; allowed: outer_single_pair, tip",
        ),
        ({"edition": 1996}, "strength.edition = 1996; allowed: 2019, 2006"),
        ({"bending_limit": 5}, "write it as 'bending_limit_mpa'"),
        (
            {"dynamic_factor": "high"},
            "strength.dynamic_factor = 'high' is not a number",
        ),
    ],
)
def test_mistakes(change, message):
    values = {**compose("generate", [])["strength"], **change}
    with pytest.raises(ConfigError, match=message):
        read(Strength, values, "strength")


def test_a_stress_that_is_none(strength):
    with pytest.raises(ConfigError, match="must be positive"):
        safe(strength, 0.0)
