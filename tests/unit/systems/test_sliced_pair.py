"""Transmission error of a sliced pair, and modifications that are best for it."""

from dataclasses import replace

import numpy as np
import pytest

from gensig.errors import ConfigError
from gensig.mesh.modification import FlankModification
from gensig.plan.request import read_request
from gensig.systems.flank_optimum import N_VARIABLES, Cases, judge, optimise, unpacked
from gensig.systems.registry import read_sliced_pair, read_system

FAST = ["mesh.n_slices=12", "mesh.contact=linear", "mesh.slice_coupling=independent"]
ALIGNED = Cases(torques=(178.0,), misalignments=(0.0,))


@pytest.fixture(scope="module")
def helical():
    return read_sliced_pair(read_request(["system=helical_pair", *FAST]).config)


@pytest.fixture(scope="module")
def schemes():
    """The paper's three modifications."""
    names = ("beihang_least_ripple", "beihang_even_load", "beihang_both")
    return {
        name: read_sliced_pair(
            read_request(["system=helical_pair", f"modification={name}"]).config
        )
        for name in names
    }


def test_harmonics_and_shares_are_of_the_curve(helical):
    result = helical.transmission_error()
    phase = np.arange(64) / 64
    first = 2 * np.abs(np.mean(result.error * np.exp(-2j * np.pi * phase)))
    assert result.harmonics[0] == pytest.approx(first, rel=1e-9)
    np.testing.assert_allclose(result.load_share.sum(axis=1), 1.0, rtol=1e-9)
    assert 0.9 < result.bearing <= 1.0


def test_a_relief_deeper_than_the_deflection_loses_contact(helical):
    deep = replace(
        helical.modification,
        pinion=FlankModification(tip_relief=100e-6, tip_relief_height=1e-3),
    )
    assert replace(helical, modification=deep).transmission_error().bearing < 0.85


def test_the_paper_s_modifications_lower_the_ripple(schemes):
    """Independent model of the reference, aligned: 182.5, 171.2, 172.1 N/mm; ripple down by 48, 11 and 16 %."""
    keys = [
        "mesh.law=paper",
        "mesh.pair_coupling=sum",
        "mesh.contact=linear",
        "mesh.slice_coupling=independent",
    ]
    system = read_sliced_pair(
        read_request(
            [
                "system=helical_pair",
                *keys,
                "mesh.allow_extrapolation=true",
                "mesh.n_slices=84",
            ]
        ).config
    )
    plain = judge(system, system.modification, ALIGNED)
    expected = {
        "beihang_least_ripple": (182.5e3, 0.52),
        "beihang_even_load": (171.2e3, 0.89),
        "beihang_both": (172.1e3, 0.84),
    }
    for name, (line_load, ratio) in expected.items():
        found = judge(system, schemes[name].modification, ALIGNED)
        assert found.line_load == pytest.approx(line_load, rel=0.01)
        assert found.ripple / plain.ripple == pytest.approx(ratio, abs=0.06)


def test_the_worst_case_counts(helical):
    wide = Cases(torques=(60.0, 178.0), misalignments=(-5e-6, 0.0, 5e-6))
    each = [
        judge(
            helical,
            helical.modification,
            Cases(torques=(torque,), misalignments=(askew,)),
        )
        for torque in wide.torques
        for askew in wide.misalignments
    ]
    worst = judge(helical, helical.modification, wide)
    assert worst.ripple == max(one.ripple for one in each)
    assert worst.line_load == max(one.line_load for one in each)


def test_a_short_search_beats_plain_flanks_and_repeats(helical):
    plain = judge(helical, helical.modification, ALIGNED)
    first, again = (
        optimise(helical, ALIGNED, n_front=1, seed=3, generations=4) for _ in range(2)
    )
    assert first == again
    assert len(first) == 1
    assert first[0].ripple < 0.95 * plain.ripple


def test_a_front_trades_one_for_the_other(helical):
    askew = Cases(torques=(178.0,), misalignments=(5.2e-6,))
    front = optimise(helical, askew, n_front=3, seed=0, generations=3)
    ripple, load = [one.ripple for one in front], [one.line_load for one in front]
    assert len(front) >= 2
    assert ripple == sorted(ripple)
    assert load == sorted(load, reverse=True)


def test_points_of_the_box_are_modifications(helical):
    none = unpacked(np.zeros(N_VARIABLES), helical)
    assert not none.is_any
    all_of_it = unpacked(np.ones(N_VARIABLES), helical)
    assert all_of_it.pinion.tip_relief == pytest.approx(26e-6)
    assert all_of_it.wheel.root_relief_height == pytest.approx(0.845e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["gear.helix_angle_deg=10"], "system=spur_pair takes spur gears"),
        (
            [
                "modification.wheel.tip_relief_um=3",
                "operating.torque_nm=0",
                "gear.helix_angle_deg=10",
            ],
            r"^modification.wheel.tip_relief_height_mm = 0: a relief of 3 um needs a length",
        ),
        (
            [
                "modification.pinion.tip_relief_um=3",
                "modification.pinion.tip_relief_height_mm=9",
            ],
            "tip_relief_height_mm = 9 and root_relief_height_mm = 0 overlap",
        ),
        (
            ["modification=beihang_both", "mesh.law=paper"],
            "modification opens gaps, which mesh.law=paper does not know",
        ),
    ],
)
def test_what_a_spur_pair_cannot_have_is_refused(words, message):
    with pytest.raises(ConfigError, match=message):
        read_system(read_request(words).config)
    with pytest.raises(ConfigError, match="must be positive"):
        Cases(torques=(0.0,), misalignments=(0.0,))
