"""Steady temperature of a gear: its equation, its heat balance, its limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.errors import ConfigError
from gensig.geometry.tooth_profile import tooth_profile
from gensig.mesh.thermal.body_heat import (
    face_surface,
    solved_body,
    tooth_surface,
    uniform_body,
)
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

WORDS = [
    "system=helical_pair",
    "gear=chongqing_40_162",
    "heat=chongqing_rated",
]


@pytest.fixture(scope="module")
def gear():
    return PairParts(compose("generate", WORDS)).pair.pinion


@pytest.fixture(scope="module")
def heat():
    return PairParts(compose("generate", WORDS)).heat


@pytest.mark.parametrize("bore", [None, 65.0, 90.0])
@pytest.mark.parametrize("convection", [0.0, 40.0, 300.0, 1e5])
def test_heat_in_is_heat_out(gear, heat, bore, convection):
    cooled = replace(heat, face_convection=convection)
    body = solved_body(gear, 6000.0, cooled, bore_temperature=bore)
    rise = body.temperature - cooled.oil_temperature
    # the faces cool steeply near hot rims: integrate finely
    fine = np.linspace(body.radius[0], body.radius[-1], 20001)
    surface_rise = np.trapezoid(np.interp(fine, body.radius, rise) * fine, fine)
    faces = 4.0 * math.pi * convection * surface_rise
    teeth = cooled.tooth_convection * tooth_surface(gear) * rise[-1]
    # with the largest, the fin's length is 6 mm, and points are 0.6 mm apart
    tolerance = 0.01 if convection > 1e4 else 2e-4

    assert_close(faces + teeth + body.to_bore, 6000.0, tolerance)
    assert_close(body.to_oil, 6000.0 - body.to_bore, 1e-6)

    if bore is None:
        assert_close(body.to_bore, 0.0, atol=1e-6)
    else:
        assert_close(body.temperature[0], bore, 1e-6)


def test_the_disc_obeys_its_equation(gear, heat):
    body = solved_body(gear, 6000.0, heat, bore_temperature=70.0)
    step = body.radius[1] - body.radius[0]
    between = 0.5 * (body.radius[1:] + body.radius[:-1])
    flow = (
        np.diff(between * np.diff(body.temperature) / step) / step / body.radius[1:-1]
    )
    cooling = 2.0 * heat.face_convection / (heat.conductivity * gear.face_width)
    lost = cooling * (body.temperature[1:-1] - heat.oil_temperature)

    assert_close(flow, lost, 1e-4, atol=1e-4 * lost.max())


def test_without_convection_at_the_faces_it_is_the_paper_s_equation_4(gear, heat):
    insulated = replace(heat, face_convection=0.0)
    body = solved_body(gear, 6000.0, insulated, bore_temperature=50.0)
    inner, outer = body.temperature[[0, -1]]
    share = np.log(body.radius / body.radius[0])
    expected = inner + (outer - inner) * share / share[-1]

    assert_close(body.temperature, expected, 1e-10)
    assert outer > inner + 5.0


def test_a_good_conductor_is_evenly_warm(gear, heat):
    """Then the rise is heat over convection times surface."""
    body = solved_body(
        gear,
        6000.0,
        replace(
            heat,
            conductivity=500.0,
            face_convection=3.0,
            tooth_convection=3.0,
        ),
        bore_temperature=None,
    )
    expected = 6000.0 / (3.0 * (face_surface(gear) + tooth_surface(gear)))
    assert_close(body.mean - heat.oil_temperature, expected, 2e-3)
    assert np.ptp(body.temperature) < 0.003 * expected


def test_surfaces_are_of_the_right_size(gear):
    """Against the length of the outline with its root curve, point by point; the reference has 0.73
    m2 in all.
    """
    profile = tooth_profile(gear)
    side = np.sum(
        np.hypot(
            np.diff(profile.abscissa),
            np.diff(profile.half_thickness),
        )
    )
    lands = 2.0 * (gear.half_tooth_angle_at(gear.tip_radius) * gear.tip_radius)
    lands += 2.0 * (math.pi / gear.n_teeth - gear.root_half_angle) * gear.root_radius
    outline = (2.0 * side + lands) * gear.face_width / math.cos(gear.helix_angle)
    ends = 4.0 * np.trapezoid(profile.half_thickness, profile.abscissa)
    expected = gear.n_teeth * (outline + ends)

    assert_close(tooth_surface(gear), expected, 0.04)
    assert_close(face_surface(gear) + tooth_surface(gear), 0.73, 0.2)

    wide = replace(gear, face_width=2.0 * gear.face_width)
    ends = 2.0 * tooth_surface(gear) - tooth_surface(wide)
    assert 0.0 < ends < 2.0 * math.pi * (gear.tip_radius**2 - gear.root_radius**2)


def test_a_known_temperature_is_the_same_all_over(gear):
    body = uniform_body(gear, 87.0)
    assert_close([body.tooth, body.mean], [87.0, 87.0], 1e-6)


def test_a_gear_that_nothing_cools_is_refused(gear, heat):
    closed = replace(heat, face_convection=0.0, tooth_convection=0.0)
    with pytest.raises(
        ConfigError,
        match=r"^pinion: nothing cools it; give heat.face_convection_w_per_m2k",
    ):
        solved_body(gear, 6000.0, closed, bore_temperature=None)

    held = solved_body(gear, 6000.0, closed, bore_temperature=60.0)
    assert_close(held.to_bore, 6000.0, 1e-6)
