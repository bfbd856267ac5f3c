"""Root stress of pairs: scale laws, limits, symmetry, the mesh's own load sharing, and what is
refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import GeometryError
from gensig.life.root.root_stress import (
    deep_tooth_factor,
    helix_factor,
    load_distribution_factor,
    normal_contact_ratio,
    rim_thickness_factor,
    root_factors,
    root_width,
    spread_along_face,
)
from gensig.options.compose import compose
from gensig.options.groups import options
from gensig.systems.registry import PairParts
from gensig.systems.root_strength import read_root_strength

PUMP = "gear=engine_pump_drive"
EQUAL = (PUMP, "gear.pinion.face_width_mm=20", "gear.pinion.bore_radius_mm=31.5")
BORES_63 = ("gear.pinion.bore_radius_mm=63", "gear.wheel.bore_radius_mm=63")
ON_BEARINGS = (
    "system.supports=bearings",
    "quality.support_damping_ratio_low=0.01",
    "quality.support_damping_ratio_high=0.1",
)
PAPER_LAW = ("mesh.law=paper", "mesh.pair_coupling=sum", "mesh.contact=linear")


def case(*words):
    return read_root_strength(compose("generate", list(words)))


def pair(*words):
    return PairParts(compose("generate", list(words))).pair


def test_a_force_gives_the_stress_it_was_asked_for():
    factors = "strength.application_factor=1.25", "strength.face_load_factor=1.2"
    loaded = case(PUMP, *factors).with_root_stress(349.39e6)
    result = loaded.gears()["wheel"]

    assert_allclose(result.stress, 349.39e6)
    assert_allclose(result.nominal, 349.39e6 / 1.5)
    assert_allclose(result.safety.paper, 1.353, atol=5e-4)

    force = case(PUMP).force_for(349.39e6)
    assert_allclose(loaded.tangential_force, force / 1.5)


@pytest.mark.parametrize(
    ("words", "share"),
    [
        (["operating.torque_nm=260"], 2.0),
        (["gear.pinion.face_width_mm=40", "gear.wheel.face_width_mm=40"], 0.5),
        # at the same torque the force is half too
        (["gear.normal_module_mm=6", *BORES_63], 0.25),
    ],
)
def test_stress_goes_with_force_and_against_width_and_module_squared(words, share):
    base, other = (case(*EQUAL, *more).gears()["wheel"] for more in ((), words))
    assert_allclose(other.nominal, share * base.nominal)


def test_a_wider_gear_is_helped_by_a_module_at_either_end():
    result = pair(PUMP)
    assert_allclose(root_width(result, result.wheel), 20e-3)
    assert_allclose(root_width(result, result.pinion), 26e-3)

    result = pair(PUMP, "gear.pinion.face_width_mm=22")
    assert_allclose(root_width(result, result.pinion), 22e-3)


@pytest.mark.parametrize("edition", [2019, 2006])
def test_no_helix_is_a_spur_gear(edition):
    helical = ("system=helical_pair", "gear.helix_angle_deg=0.01")
    spur, sliced = (
        case(PUMP, *words, f"strength.edition={edition}").factors["wheel"]
        for words in ((), helical)
    )
    assert_allclose(sliced.stress_per_force, spur.stress_per_force, rtol=2e-3)


def with_width(pair, width):
    pinion, wheel = (
        replace(gear, face_width=width) for gear in (pair.pinion, pair.wheel)
    )
    return replace(pair, pinion=pinion, wheel=wheel)


def test_load_distribution_goes_on_at_its_bounds():
    short, long = "gear.addendum_coefficient=0.9", "gear.addendum_coefficient=1"
    few, many = (pair("system=helical_pair", words) for words in (short, long))
    assert normal_contact_ratio(few) < 2.0 < normal_contact_ratio(many)
    for result, without_overlap in ((few, 1.0), (many, math.sqrt(0.5))):
        width = result.face_width / result.overlap_ratio
        none, half, most, more = (
            load_distribution_factor(with_width(result, share * width))
            for share in (1e-9, 0.5, 0.999999, 1.5)
        )
        assert_allclose(none, without_overlap)
        assert_allclose(more, normal_contact_ratio(result) ** -0.5)
        assert_allclose(most, more, rtol=1e-5)
        assert none > half > most
    assert load_distribution_factor(pair(PUMP)) == 1.0

    teeth = ("gear.addendum_coefficient=1.25", "gear.cutter_tip_radius_coefficient=0.2")
    deep = pair(PUMP, *teeth)
    assert normal_contact_ratio(deep) > 2.0
    assert load_distribution_factor(deep) == 0.7


def test_helix_factor():
    helical, spur = pair("system=helical_pair"), pair(PUMP)
    steep = pair("system=helical_pair", "gear.helix_angle_deg=38")
    # 18 degrees, overlap above 1
    of_2019 = 0.85 / math.cos(math.radians(18.0)) ** 3

    for gears, edition, expected in (
        (helical, 2006, 1.0 - 18.0 / 120.0),
        (helical, 2019, of_2019),
        (steep, 2006, 0.75),
        (spur, 2019, 1.0),
    ):
        assert_allclose(helix_factor(gears, edition=edition), expected)


def test_rim_and_deep_teeth():
    wheel = pair(PUMP).wheel
    height = wheel.tip_radius - wheel.root_radius

    def factor(rim):
        bore_radius = wheel.root_radius - rim * height
        return rim_thickness_factor(replace(wheel, bore_radius=bore_radius))

    assert factor(3.0) == factor(1.2) == 1.0
    assert_allclose(
        factor(0.8),
        1.6 * math.log(2.242 / 0.8),
    )
    assert factor(0.51) > factor(0.8) > 1.6
    with refused("reduce bore_radius_mm", GeometryError):
        factor(0.4)
    assert_allclose(
        [deep_tooth_factor(ratio, 4) for ratio in (2.0, 2.3, 2.6)], [1.0, 0.8342, 0.7]
    )
    assert deep_tooth_factor(2.3, 5) == 1.0
    assert deep_tooth_factor(2.6, None) == 0.7


def test_light_loads_come_near_it_and_heavy_ones_share_more():
    shares = []
    for torque in (1.0, 130.0, 680.0):
        loaded = case(PUMP, f"operating.torque_nm={torque}")
        largest = loaded.history().stress["wheel"].max()
        shares.append(largest / loaded.gears()["wheel"].stress)
    assert 1.0 >= shares[0] > shares[1] > shares[2]
    assert_allclose(shares[0], 1.0, atol=0.01)


def test_equal_gears_see_the_same_from_either_end():
    history = case(*EQUAL, *PAPER_LAW).history(n_phases=400)
    pinion, wheel = history.stress["pinion"], history.stress["wheel"]
    path = case(*EQUAL).pair.path_of_contact
    inside = np.linspace(0.01, 0.99, 60) * path
    seen = np.interp(inside, history.roll, pinion)
    mirrored = np.interp(path - inside, history.roll, wheel)

    assert_allclose(seen, mirrored, rtol=5e-3)
    assert_allclose(pinion.max(), wheel.max())


@pytest.mark.parametrize("coupling", ["coupled", "independent"])
@pytest.mark.parametrize("law", ["paper", "one_sided"])
def test_slices_of_a_spur_pair_are_the_pair_itself(coupling, law):
    words = (*EQUAL, f"mesh.law={law}", "operating.torque_nm=400")
    slices = (f"mesh.slice_coupling={coupling}", "mesh.n_slices=8")
    whole = case(*words).history()
    sliced = case(*words, "system=helical_pair", PUMP, *slices).history()
    inside = np.linspace(0.02, 0.98, 200) * whole.roll[-2]

    for name in ("pinion", "wheel"):
        exact, result = (
            np.interp(inside, history.roll, history.stress[name])
            for history in (whole, sliced)
        )
        assert_allclose(
            result,
            exact,
            rtol=2e-3,
            atol=2e-3 * exact.max(),
        )


def test_spreading_keeps_the_sum_and_evens_out():
    rng = np.random.default_rng(1)
    shape = (3, 2, 40)
    load = rng.random(shape) * (rng.random(shape) > 0.5)
    structure = 1.0 + rng.random(shape)
    spread = spread_along_face(load, structure, 9.0)

    assert_allclose(
        spread.sum(axis=2),
        load.sum(axis=2),
    )
    assert spread.min() > 0.0
    assert spread.max() < load.max()
    assert_allclose(spread_along_face(load, structure, 0.0), load)

    even = np.ones((1, 401))
    assert_allclose(spread_along_face(even, 2 * even, 9.0), even)

    # one loaded slice: exponential to either side, over the root of the coupling
    single = np.eye(401)[200:201]
    tail = spread_along_face(single, even, 100.0)[0]
    assert_allclose(
        tail[230] / tail[220],
        math.exp(-1.0),
        rtol=2e-3,
    )


def test_misalignment_raises_the_stress():
    words = ("system=helical_pair", "mesh.n_slices=12")
    straight, crooked = (
        case(*words, f"modification.misalignment_um={error}").history().stress["wheel"]
        for error in (0, 10)
    )
    assert crooked.max() > 1.1 * straight.max()


@pytest.mark.parametrize(
    "name",
    sorted(options("gear")),
)
def test_every_gear_option_has_a_root_stress(name):
    words = [f"gear={name}"]
    config = compose("generate", words)["gear"]
    if config["pinion"]["support"]["stiffness_x_n_per_m"] is None:
        words += ON_BEARINGS
    if config["helix_angle_deg"]:
        words = ["system=helical_pair", *words]
    loaded = case(*words)
    history = loaded.history(n_phases=40)

    for gear, result in loaded.gears().items():
        assert 5e6 < result.stress < 2e9
        assert 0.4 * result.stress < history.stress[gear].max() < 1.5 * result.stress

    shares_throughout = loaded.pair.total_contact_ratio > 1.2
    assert shares_throughout or 0.99 < history.share.max() <= 1.0 + 1e-9


def test_the_force_over_the_mesh_gives_its_stress():
    loaded, exact = case(PUMP), case(PUMP, *PAPER_LAW)
    force = loaded.force_over_mesh_for(200e6)
    assert force > loaded.force_for(200e6)

    torque = force * loaded.pair.pinion.pitch_radius
    result = case(PUMP, f"operating.torque_nm={torque!r}").history().stress
    largest = max(values.max() for values in result.values())
    assert_allclose(largest, 200e6, rtol=1e-5)

    force = exact.force_for(200e6)
    assert_allclose(exact.force_over_mesh_for(200e6), force, rtol=1e-5)


def test_the_force_over_a_misaligned_mesh_is_below_that_of_the_standard():
    words = (
        "system=helical_pair",
        "mesh.n_slices=6",
        "modification.misalignment_um=10",
    )
    loaded = case(*words)
    force = loaded.force_over_mesh_for(100e6)
    assert force < 0.9 * loaded.force_for(100e6)

    torque = force * loaded.pair.pinion.pitch_radius
    result = case(*words, f"operating.torque_nm={torque!r}").history().stress
    largest = max(values.max() for values in result.values())
    assert_allclose(largest, 100e6, rtol=1e-5)


def test_mistakes():
    """Those that are typed are in tests/pipeline/commands/test_refusals.py."""
    with refused("strength.load_point"):
        root_factors(pair(PUMP), load_point="root")
    with refused("strength.edition"):
        root_factors(pair(PUMP), edition=1996)
