"""Form and stress correction factors of ISO 6336-3: against our own tooth, handbooks, other
programs, and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from gensig.errors import ExtrapolationError
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import involute_point, root_curve
from gensig.geometry.tooth_profile import load_angle as flank_load_angle
from gensig.life.root.tooth_root import (
    TANGENT,
    root_loading,
    root_section,
    virtual_gear,
)


def gear(n_teeth, *, shift=0.0, module=3e-3, rounding=0.38, helix=0.0):
    return Gear(
        name="pinion",
        n_teeth=n_teeth,
        normal_module=module,
        pressure_angle=math.radians(20.0),
        addendum_coefficient=1.0,
        clearance_coefficient=0.25,
        cutter_tip_radius_coefficient=rounding,
        profile_shift=shift,
        face_width=20e-3,
        bore_radius=2e-3,
        helix_angle=math.radians(helix),
    )


def touching(found):
    """Parameter gamma at which our root curve makes 30 degrees with the centreline."""

    def slope(gamma):
        roll = (
            found.rounding_center_depth / math.tan(gamma) + found.rounding_center_offset
        ) / found.pitch_radius
        return gamma - roll - TANGENT

    return brentq(slope, found.pressure_angle, 0.5 * math.pi)


SHAPES = [
    (18, 0.0, 0.38),
    (23, 0.3, 0.25),
    (54, 0.0, 0.38),
    (84, -0.2, 0.3),
    (400, 0.0, 0.38),
]


@pytest.mark.parametrize(
    ("n_teeth", "shift", "rounding"),
    SHAPES,
)
def test_the_critical_section_lies_on_our_own_root_curve(n_teeth, shift, rounding):
    result = gear(n_teeth, shift=shift, rounding=rounding)
    section = root_section(result)
    at = touching(result)
    x, y = root_curve(
        result,
        np.array([at]),
    )

    assert_allclose(section.thickness, 2.0 * y[0])
    assert_allclose(section.height, x[0])

    around = at + np.linspace(-2e-2, 2e-2, 201)
    x, y = root_curve(result, around)
    dx, dy = np.gradient(x, around), np.gradient(y, around)
    turning = dx * np.gradient(dy, around) - dy * np.gradient(dx, around)
    curvature = np.abs(turning) / np.hypot(dx, dy) ** 3
    assert_allclose(
        section.fillet_radius,
        1.0 / curvature[100],
        rtol=1e-5,
    )


@pytest.mark.parametrize(
    ("n_teeth", "shift", "rounding"),
    SHAPES,
)
def test_the_lever_arm_is_that_of_our_own_flank(n_teeth, shift, rounding):
    result = gear(n_teeth, shift=shift, rounding=rounding)
    distance = np.linspace(0.0, 0.6 * result.base_pitch, 7)
    loading = root_loading(result, distance)
    radius = virtual_gear(result).tip_curvature_radius - distance
    x, y = involute_point(result, radius)
    angle = flank_load_angle(result, radius)
    arm = x - y * np.tan(angle) - root_section(result).height

    assert_allclose(loading.load_angle, angle, atol=1e-12)
    assert_allclose(loading.lever_arm, arm, atol=1e-12)


@pytest.mark.parametrize(
    ("n_teeth", "shift", "lengths", "factors"),
    [
        (19, 0.50, (8.748743, 8.174658, 1.316148), (2.246336, 1.914726)),
        (104, 0.15, (9.239505, 7.834246, 1.325999), (2.161657, 2.008782)),
    ],
)
def test_another_program(n_teeth, shift, lengths, factors):
    """din3990 (a DIN 3990-11 calculation, public on GitHub under hanslhansl), its test 1: load at
    the tip."""
    shape = gear(n_teeth, shift=shift, module=4e-3, rounding=0.25)
    section, loading = root_section(shape), root_loading(shape, 0.0)
    result = [
        section.thickness,
        loading.lever_arm[0],
        section.fillet_radius,
    ]

    assert_allclose(
        result,
        1e-3 * np.array(lengths),
        rtol=2e-4,
    )

    result = loading.form_factor[0], loading.stress_correction_factor[0]
    assert_allclose(result, factors, rtol=3e-4)


def test_many_teeth_are_a_rack():
    """The rack's own section: straight sides at 20 degrees down to a circle of the rounding's
    radius."""
    alpha, rounding, rack = math.radians(20.0), 0.38, gear(10**6, module=1e-3)
    # centre of the circle: b from the centreline, a below the pitch line; tangent at 30 degrees to
    # the centreline
    a = 1.25 - rounding
    b = math.pi / 4.0 + a * math.tan(alpha) + rounding / math.cos(alpha)
    section, loading = root_section(rack), root_loading(rack, 0.0)
    thickness = 2.0 * (b - rounding * math.cos(TANGENT))
    depth = a + rounding * math.sin(TANGENT)

    assert_allclose(section.thickness, 1e-3 * thickness, rtol=1e-5)
    assert_allclose(section.fillet_radius, 1e-3 * rounding, rtol=1e-4)

    half_tip = math.pi / 4.0 - math.tan(alpha)
    arm = 1.0 + depth - half_tip * math.tan(alpha)
    assert_allclose(
        loading.lever_arm[0],
        1e-3 * arm,
        rtol=1e-5,
    )

    form, correction = loading.form_factor[0], loading.stress_correction_factor[0]
    assert_allclose(form, 6.0 * arm / thickness**2, rtol=1e-4)
    assert_allclose(
        (form, correction),
        (2.06, 1.97),
        rtol=5e-3,
    )


def test_factors_do_not_depend_on_size_and_a_rounder_root_has_less_stress():
    small, large = (
        root_loading(gear(30, module=size), [0.0, 2.0 * size]) for size in (1e-3, 25e-3)
    )
    assert_allclose(small.stress_factor, large.stress_factor)

    higher, lower = small.stress_factor
    assert higher > lower

    sharp, rounded = (
        root_loading(gear(30, rounding=radius), 0.0).stress_factor[0]
        for radius in (0.2, 0.38)
    )
    assert sharp > 1.03 * rounded


def test_the_product_is_that_of_both_factors_and_goes_on_below_the_section():
    loading = root_loading(
        gear(54),
        np.linspace(0.0, 5e-3, 400),
    )
    product = loading.form_factor * loading.stress_correction_factor
    assert_allclose(loading.stress_factor, product)

    deep = root_loading(
        gear(54),
        np.linspace(0.0, 22e-3, 400),
    )
    assert deep.lever_arm[-1] < 0.0
    assert np.all(deep.stress_factor >= 0.0)
    assert np.abs(np.diff(deep.stress_factor)).max() < 0.05


def test_a_helical_gear_has_the_factors_of_its_virtual_gear():
    helical = gear(40, helix=20.0)
    n_teeth = virtual_gear(helical).n_teeth
    assert_allclose(
        n_teeth,
        40 / math.cos(helical.helix_angle) ** 3,
        rtol=0.02,
    )

    gears = gear(math.floor(n_teeth)), helical, gear(math.ceil(n_teeth))
    factors = [root_loading(each, 0.0).stress_factor[0] for each in gears]
    assert sorted(factors)[1] == factors[1]
    assert virtual_gear(gear(40)).tip_radius == gear(40).tip_radius


def test_a_notch_out_of_range_is_said():
    blunt = gear(400)
    sharp = replace(blunt, cutter_tip_radius_coefficient=0.02)
    with pytest.raises(ExtrapolationError, match=r"notch parameter .* outside 1\.\.8"):
        root_loading(sharp, 0.0)

    allowed = root_loading(sharp, 0.0, allow_extrapolation=True)
    assert allowed.stress_factor[0] > root_loading(blunt, 0.0).stress_factor[0]
