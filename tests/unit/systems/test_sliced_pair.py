"""Transmission error of a sliced pair, and optimal modifications."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.mesh.modification import FlankModification, PairModification
from gensig.plan.request import read_request
from gensig.systems import flank_optimum
from gensig.systems.flank_optimum import (
    N_VARIABLES,
    Cases,
    Optimum,
    _not_dominated,
    judge,
    optimise,
    unpacked,
)
from gensig.systems.registry import read_sliced_pair, read_system

COUPLING = ["mesh.contact=linear", "mesh.slice_coupling=independent"]
ALIGNED = Cases(
    torques=(178.0,),
    misalignments=(0.0,),
)


def pair_of(*words):
    return read_sliced_pair(read_request(["system=helical_pair", *words]).config)


@pytest.fixture(scope="module")
def helical():
    return pair_of("mesh.n_slices=8", *COUPLING)


def test_harmonics_and_shares_are_those_of_the_curve(helical):
    result = helical.transmission_error()
    phase = np.arange(64) / 64
    first = 2 * np.abs(np.mean(result.error * np.exp(-2j * np.pi * phase)))

    assert_close(result.harmonics[0], first, 1e-9)
    assert_close(
        result.load_share.sum(axis=1),
        1.0,
        1e-9,
    )
    assert 0.9 < result.bearing <= 1.0


def test_coupled_slices_leave_a_ripple_at_an_overlap_of_one():
    """The slices at the ends of the face are softer; independent ones are all alike."""
    pair = pair_of().pair
    width = 1e3 * min(gear.face_width for gear in pair.gears.values())
    words = [
        f"gear.{name}.face_width_mm={width / pair.overlap_ratio}" for name in pair.gears
    ]
    ripple = {}
    for coupling in ("coupled", "independent"):
        one = pair_of(*words, f"mesh.slice_coupling={coupling}")
        assert_close(one.pair.overlap_ratio, 1.0, 1e-9)
        ripple[coupling] = np.ptp(one.transmission_error().error)
    assert ripple["independent"] < 2e-9 < 30e-9 < ripple["coupled"]


def test_the_error_of_the_largest_pressure_is_estimated():
    """At the corners of plain flanks it is large; inside of modified ones it is small."""
    exact = pair_of("mesh.n_slices=320").transmission_error().pressure.max()
    plain = pair_of("mesh.n_slices=40")
    result = plain.transmission_error()
    missing = 1.0 - result.pressure.max() / exact
    assert missing > 0.05
    assert missing < plain.pressure_error(result) < 2.0 * missing
    modified = pair_of("mesh.n_slices=20", "modification=beihang_both")
    assert modified.pressure_error(modified.transmission_error()) < 0.002
    single = pair_of("mesh.n_slices=1")
    assert np.isnan(single.pressure_error(single.transmission_error()))


def test_a_relief_deeper_than_the_deflection_loses_contact(helical):
    relief = FlankModification(tip_relief=100e-6, tip_relief_height=1e-3)
    deep = replace(helical.modification, pinion=relief)
    assert replace(helical, modification=deep).transmission_error().bearing < 0.85


def test_the_modifications_of_the_paper_lower_the_ripple():
    """Independent model of the reference, aligned: line load in N/m, ripple over that of plain."""
    law = "mesh.law=paper", "mesh.pair_coupling=sum", "mesh.allow_extrapolation=true"
    system = pair_of(*law, *COUPLING, "mesh.n_slices=84")
    plain = judge(system, system.modification, ALIGNED)
    expected = {
        "beihang_least_ripple": (182.5e3, 0.52),
        "beihang_even_load": (171.2e3, 0.89),
        "beihang_both": (172.1e3, 0.84),
    }

    for name, (line_load, ratio) in expected.items():
        modification = pair_of(f"modification={name}").modification
        judged = judge(system, modification, ALIGNED)
        assert_close(judged.line_load, line_load, 0.01)
        assert_close(judged.ripple / plain.ripple, ratio, atol=0.06)


def test_the_worst_case_counts(helical):
    wide = Cases(
        torques=(60.0, 178.0),
        misalignments=(-5e-6, 0.0, 5e-6),
    )
    cases = [
        Cases(torques=(torque,), misalignments=(askew,))
        for torque in wide.torques
        for askew in wide.misalignments
    ]
    single = [judge(helical, helical.modification, case) for case in cases]
    worst = judge(helical, helical.modification, wide)

    assert worst.ripple == max(each.ripple for each in single)
    assert worst.line_load == max(each.line_load for each in single)


def test_a_short_search_beats_plain_flanks_and_repeats(helical):
    plain = judge(helical, helical.modification, ALIGNED)
    first, second = (
        optimise(helical, ALIGNED, n_front=1, seed=3, generations=2) for _ in range(2)
    )
    assert first == second
    assert len(first) == 1
    assert first[0].ripple < 0.95 * plain.ripple


@pytest.mark.parametrize("generations", [1, 4])
def test_the_generations_bound_the_work(helical, monkeypatch, generations):
    judged = []

    def of_relief(_, modification, *__, **___):
        judged.append(modification)
        ripple = 1.0 + 1e6 * modification.pinion.tip_relief
        return Optimum(modification=modification, ripple=ripple, line_load=1.0)

    monkeypatch.setattr(flank_optimum, "judge", of_relief)
    optimise(helical, ALIGNED, n_front=1, seed=3, generations=generations)
    of_each = flank_optimum.POPULATION * N_VARIABLES
    assert len(judged) <= (generations + 1) * of_each + 2
    assert len(judged) > 0.8 * generations * of_each


def test_a_front_trades_ripple_for_load(helical):
    askew = Cases(
        torques=(178.0,),
        misalignments=(5.2e-6,),
    )
    front = optimise(helical, askew, n_front=3, seed=0, generations=2)
    values = np.array([(each.ripple, each.line_load) for each in front])

    assert len(front) >= 2
    assert np.all(np.diff(values[:, 0]) > 0)
    assert np.all(np.diff(values[:, 1]) < 0)


def test_dominated_optima_are_left_out():
    plain = PairModification(pinion=FlankModification(), wheel=FlankModification())
    points = [(2.0, 5.0), (1.0, 6.0), (3.0, 5.5), (1.0, 7.0), (4.0, 4.0)]
    optima = [Optimum(modification=plain, ripple=a, line_load=b) for a, b in points]
    assert _not_dominated(optima) == [optima[1], optima[0], optima[4]]


def test_points_of_the_box_are_modifications(helical):
    assert not unpacked(np.zeros(N_VARIABLES), helical).is_any
    largest = unpacked(np.ones(N_VARIABLES), helical)
    assert_close(largest.pinion.tip_relief, 26e-6, 1e-9)
    assert_close(largest.wheel.root_relief_height, 0.845e-3, 1e-9)


RELIEF, HEIGHT = "tip_relief_um=3", "tip_relief_height_mm"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["gear.helix_angle_deg=10"], "system=spur_pair takes spur gears"),
        (
            [
                f"modification.wheel.{RELIEF}",
                "operating.torque_nm=0",
                "gear.helix_angle_deg=10",
            ],
            f"modification.wheel.{HEIGHT} = 0: a relief of 3 um needs a length",
        ),
        (
            [f"modification.pinion.{RELIEF}", f"modification.pinion.{HEIGHT}=9"],
            f"{HEIGHT} = 9 and root_relief_height_mm = 0 overlap",
        ),
        (
            ["modification=beihang_both", "mesh.law=paper"],
            "modification opens gaps, which mesh.law=paper does not know",
        ),
    ],
)
def test_refusals_of_a_spur_pair(words, message):
    with refused(message):
        read_system(read_request(words).config)


@pytest.mark.parametrize(
    ("torques", "misalignments", "message"),
    [
        ((0.0,), (0.0,), "must be positive"),
        ((1.0,), (), "misalignments: give at least"),
    ],
)
def test_cases_that_are_refused(torques, misalignments, message):
    with refused(message):
        Cases(torques=torques, misalignments=misalignments)
