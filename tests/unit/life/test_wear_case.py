"""Parts of the wear life: curvature of what is worn off, limits, fitted laws, the way into a
fault, what is refused."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import ExtrapolationError, SimulationError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import read_faults
from gensig.life.life_laws import fitted_laws, life_map, torque_exponent
from gensig.life.options import read_wear_options
from gensig.life.wear.archard import (
    LEAST_CURVATURE_SHARE,
    flank_radii,
    hertz_pressure,
    hunting_turns,
    worn_curvature,
)
from gensig.life.wear.wear_growth import WearGrowth, WearTable
from gensig.life.wear.wear_life import wear_life
from gensig.options.compose import compose
from gensig.systems.wear import read_wear_case, wear_fault

FULL = ("gear=harbin_38_55", "gear.addendum_coefficient=1", "wear.threshold_um=20")


def case_of(*words):
    return read_wear_case(compose("generate", list(words)))


@pytest.fixture(scope="module")
def full():
    return case_of(*FULL)


@pytest.fixture(scope="module")
def worn_out(full):
    return wear_life(full)


def test_curvature_of_a_parabola_and_of_a_straight_wear(full):
    arc = full.path.arc
    middle = arc.mean(axis=1, keepdims=True)
    reach = np.full(arc.shape[1], 1.5e-4)
    depth = 4.0 * (arc - middle) ** 2

    assert_allclose(
        worn_curvature(full.path, depth, reach)[:, 8:-8],
        8.0,
        rtol=0.1,
    )
    assert_allclose(
        worn_curvature(full.path, 3e-3 * arc, reach),
        0.0,
        atol=1e-6,
    )

    # a wave as long as the half width, to which its second difference over the half width alone is
    # blind
    wave = 1e-6 * np.cos(tau * (arc - arc[:, :1]) / 6e-4)
    felt = worn_curvature(full.path, wave, np.full(arc.shape[1], 6e-4))[:, 20:-20]
    largest = 1e-6 * (tau / 6e-4) ** 2
    assert np.all(np.abs(felt).max(axis=1) > 0.1 * largest)


def test_hollow_flanks_press_no_less_than_nearly_flat_ones(full):
    load = full.line_load(full.new_flanks())
    arc = full.path.arc
    hollow = -1e3 * (arc - arc.mean(axis=1, keepdims=True))[:, None] ** 2
    new = hertz_pressure(full.path, load, full.material)
    worn = hertz_pressure(
        full.path,
        load,
        full.material,
        hollow - hollow.min(),
    )

    assert_allclose(
        worn[0, 10:-10],
        new[0, 10:-10] * LEAST_CURVATURE_SHARE**0.5,
    )


def test_radii_of_new_and_worn_flanks(full, worn_out):
    load = full.line_load(full.new_flanks())[0]
    depth = worn_out.depth[-1][:, 0]
    new, worn = (
        flank_radii(full.path, loss, load, full.material) for loss in (0 * depth, depth)
    )

    for key in ("worn", "by_eq_22"):
        assert_allclose(new[key], new["new"])
    # a shift of some um on radii of mm; the profile itself does more
    assert_allclose(worn["by_eq_22"], new["new"], rtol=3e-3)
    assert np.abs(worn["worn"] / new["new"] - 1.0).max() > 0.2


def test_a_limit_of_the_transmission_error_finds_the_threshold(full):
    limit = full.error_range(full.new_flanks()) + 5e-6
    words = (*FULL, f"wear.transmission_error_limit_um={limit * 1e6}")
    life, by_depth = (
        wear_life(case_of(*words, *more)) for more in ((), ["wear.threshold_um=1"])
    )

    assert (life.ended_by, by_depth.ended_by) == ("transmission_error", "depth")
    assert life.threshold < full.options.threshold
    assert_allclose(
        full.error_range(life.depth[-1]),
        limit,
        rtol=1e-3,
    )
    assert_allclose(by_depth.threshold, 1e-6)
    with refused("is reached by new flanks already"):
        wear_life(case_of(*FULL, "wear.transmission_error_limit_um=0.5"))


def test_sum_adds_both_flanks_and_the_local_exponent_is_near_one(full, worn_out):
    life = wear_life(case_of(*FULL, "wear.criterion=sum"))
    assert_allclose(
        life.depth[-1].sum(axis=0).max(),
        20e-6,
    )
    assert life.life < 0.8 * worn_out.life
    assert_allclose(torque_exponent(full), 1.0, atol=0.15)


@pytest.mark.parametrize(
    ("words", "shares"),
    [
        (["gear=harbin_38_55"], False),
        (["gear=harbin_38_55", "wear.sharing=mesh"], True),
        ([], True),
        (["wear.sharing=one_pair"], False),
    ],
)
def test_sharing_follows_the_contact_ratio(words, shares):
    assert (case_of(*words).loads is not None) == shares


@pytest.fixture(scope="module")
def lives():
    case = case_of("gear=harbin_38_55")
    return life_map(
        case,
        [50.0, 100.0, 200.0, 400.0],
        [3.0, 6.0, 12.0],
    )


@pytest.fixture(scope="module")
def laws(lives):
    return fitted_laws(lives, 200.0, 12.0)


class TestLaws:
    def test_laws_know_their_range(self, laws):
        power, logarithm, _ = laws
        outside = ((power, 500, 6), (power, 100, 2), (logarithm, 100, 3))
        for law, torque, speed in outside:
            with refused("was fitted for a", ExtrapolationError):
                law.life(float(torque), float(speed))
        assert power.life(500.0, 6.0, allow_extrapolation=True) > 0.0

    def test_a_negative_life_is_refused(self, laws):
        power, logarithm, _ = laws
        with refused("gives a life of -", SimulationError):
            logarithm.life(900.0, 12.0, allow_extrapolation=True)

        printed = replace(
            logarithm,
            a=709.3,
            b=127.3,
            torque=(10.0, 300.0),
        )
        with refused("gives a life of -", SimulationError):
            printed.life(265.0, 12.0)  # inside its range
        assert_allclose(printed.no_life_from, 263.0, atol=0.5)
        assert printed.formula(0.999 * printed.no_life_from, 12.0) > 0.0
        assert power.no_life_from is None


@pytest.mark.parametrize(
    "words", [FULL, ("system=helical_pair", "mesh.n_slices=8", "wear.threshold_um=5")]
)
def test_what_is_worn_off_is_a_fault(words):
    case = case_of(*words)
    depth = wear_life(case).depth[-1]
    teeth = faulty_teeth(
        case.pair,
        read_faults(wear_fault(case, depth)),
    )

    assert len(teeth) == case.pair.pinion.n_teeth + case.pair.wheel.n_teeth
    for side, name in enumerate(("pinion", "wheel")):
        tooth = teeth[name, 0]
        radius, loss = tooth.profile.curvature_radius, tooth.material_loss[0]
        curvature = case.path.curvature[side]
        low, high = curvature.min(), curvature.max()
        mean = depth[side].mean(axis=0) / np.cos(case.pair.base_helix_angle)
        inside = (curvature > low + 4e-4) & (curvature < high - 4e-4)
        lost = np.interp(curvature, radius, loss)
        assert_allclose(
            lost[inside],
            mean[inside],
            atol=0.05 * mean.max(),
        )
        assert not loss[radius < low - 4e-4].any()


def test_turns_until_the_same_teeth_meet(full):
    assert hunting_turns(full.pair) == 55
    assert hunting_turns(case_of("gear.pinion.n_teeth=42").pair) == 2


REFUSED = {
    "wear.sharing=none": "wear.sharing = 'none'; allowed: mesh, one_pair",
    "wear.n_intervals=0": "wear.n_intervals = 0 must lie in 1..1e+06",
    "wear.pinion.hardness_hbs=0": "pinion.hardness_hbs = 0 must be positive",
    "wear.wheel=3": "wear.wheel = 3 must be a group of keys",
    "wear.transmission_error_limit_um=9 wear.geometry=unworn": "needs wear.geometry=worn",
    "wear.transmission_error_limit_um=9 wear.sharing=one_pair": "wear.sharing=mesh",
    "wear.transmission_error_limit_um=9 gear=harbin_38_55": "needs wear.sharing=mesh",
    "operating.torque_nm=0": "operating.torque_nm = 0 must be positive",
}


@pytest.mark.parametrize(("words", "message"), REFUSED.items())
def test_bad_input_is_one_line(words, message):
    with refused(message):
        case_of(*words.split())


def test_values_of_a_gear_override_those_of_both():
    words = ["wear.pinion.coefficient=1e-6", "wear.wheel.hardness_hbs=200"]
    options = read_wear_options(compose("generate", words)["wear"])
    hbs = 9.80665e6

    assert_allclose(
        options.wear_factor("pinion"),
        1e-6 / (187 * hbs),
    )
    assert_allclose(
        options.wear_factor("wheel"),
        6.25e-6 / (200 * hbs),
    )
    assert_allclose(options.hardness_of("pinion"), 187 * hbs)


def test_growth_at_a_torque_of_its_table_is_that_life():
    """At the first, the middle and the last torque, which no power of the torque joins."""
    sizes, torque = np.array([0.0, 1e-6, 3e-6]), np.array([10.0, 20.0, 80.0])
    turns = np.array([[0.0, 9e6, 2e7], [0.0, 1e6, 4e6], [0.0, 8e5, 1e6]])
    table = WearTable(torque=torque, lives=(), reached=(), sizes=sizes, turns=turns)
    law = WearGrowth(table=table, torque=20.0, as_fault=dict)
    inside = np.array([0.5e-6, 2e-6])
    for at, life in zip(torque, turns, strict=True):
        assert_allclose(law.rate(inside, at), np.diff(sizes) / np.diff(life))
