"""ISO 6336-1 Method B against the values worked out by hand in the spur reference
(docs/validation.md), section 4.
"""

import math
from dataclasses import replace

import pytest
from closeness import assert_close
from refusals import refused

from gensig.errors import ExtrapolationError
from gensig.geometry.contact import GearPair
from gensig.mesh import iso6336

N_PER_MM_UM = 1e9  # in N/m/m


@pytest.fixture(scope="module")
def pair(xiamen) -> GearPair:
    return xiamen.pair


def shifted(pair: GearPair, pinion: float, wheel: float) -> GearPair:
    return GearPair(
        pinion=replace(pair.pinion, profile_shift=pinion),
        wheel=replace(pair.wheel, profile_shift=wheel),
        backlash=pair.backlash,
    )


def test_load_matters_below_100_n_per_mm_only(pair):
    stiff = iso6336.single_stiffness(pair)
    loads = (1e3, 5e4, 0.999e5, 1e5, 5e5)
    result = [iso6336.single_stiffness(pair, line_load=load) / stiff for load in loads]

    assert result == sorted(result)
    assert result[2] < 1.0
    assert_close(result[3:], 1.0, 1e-12)
    assert_close(result[1], 0.5**0.25, 1e-12)


def test_profile_shift_follows_the_series(pair):
    """q' of x1 = 0.4, x2 = -0.2 term by term; the wheel's coefficients on the wheel's shift, not
    the pinion's.
    """
    expected = 0.04723 + (0.15551 - 0.11654 * 0.4) / 23 + (0.25791 + 0.24188 * 0.2) / 84
    expected += -0.00635 * 0.4 + 0.00193 * 0.2 + 0.00529 * 0.16 + 0.00182 * 0.04
    result = iso6336.flexibility(shifted(pair, 0.4, -0.2)) * N_PER_MM_UM
    assert_close(result, expected, 1e-12)
    assert abs(result / 0.057062 - 1.0) > 0.02


def test_basic_rack_factor_is_the_mean_of_both_gears(pair):
    flat = replace(
        pair.wheel,
        clearance_coefficient=0.2,
        cutter_tip_radius_coefficient=0.3,
    )
    mixed = GearPair(pinion=pair.pinion, wheel=flat, backlash=0.0)
    ratio = iso6336.single_stiffness(mixed) / iso6336.single_stiffness(pair)

    assert_close(ratio, 0.5 * (0.975 + 1.0) / 0.975, 1e-12)


def test_a_larger_pressure_angle_stiffens_by_2_percent_a_degree(pair):
    steep = replace(
        pair.pinion,
        pressure_angle=math.radians(25.0),
        cutter_tip_radius_coefficient=0.3,
    )
    assert_close(iso6336.basic_rack_factor(steep), 0.975 * 1.1, 1e-12)


def test_stiffness_scales_with_the_modulus(pair):
    soft = iso6336.single_stiffness(pair, youngs_modulus=103e9)
    assert_close(soft, 0.5 * iso6336.single_stiffness(pair), 1e-12)


@pytest.mark.parametrize(("pinion", "wheel"), [(0.0, 0.1), (-0.25, -0.3), (1.2, 0.9)])
def test_shifts_outside_the_series_are_refused(pair, pinion, wheel):
    # many teeth and a low wheel, so that such shifts exist without interference
    low = replace(
        pair.wheel,
        addendum_coefficient=0.9,
        clearance_coefficient=0.35,
    )
    teeth = replace(pair, pinion=replace(pair.pinion, n_teeth=80), wheel=low)
    outside = shifted(teeth, pinion, wheel)

    with refused("x1 >= x2", ExtrapolationError):
        iso6336.single_stiffness(outside)
    assert iso6336.single_stiffness(outside, allow_extrapolation=True) > 0.0


def test_small_contact_ratio_is_refused(pair):
    short = [
        replace(gear, addendum_coefficient=0.6) for gear in (pair.pinion, pair.wheel)
    ]
    few = GearPair(pinion=short[0], wheel=short[1], backlash=0.0)
    assert few.transverse_contact_ratio < 1.2
    with refused("contact ratio", ExtrapolationError):
        iso6336.mesh_stiffness(few)
    assert iso6336.single_stiffness(few) > 0.0
    assert iso6336.mesh_stiffness(few, allow_extrapolation=True) > 0.0


@pytest.mark.parametrize(
    "argument",
    ["line_load", "correction_factor", "youngs_modulus"],
)
def test_values_that_are_not_positive_are_refused(pair, argument):
    with refused(argument):
        iso6336.single_stiffness(pair, **{argument: 0.0})
