"""Thermal growth of gears: uniform heat keeps the involute, uneven heat does not."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.mesh.thermal.body_heat import solved_body
from gensig.mesh.thermal.thermal_growth import GearGrowth, PairGrowth
from gensig.options.compose import compose
from gensig.systems.registry import PairParts

WORDS = [
    "system=helical_pair",
    "gear=chongqing_40_162",
    "heat=chongqing_rated",
]


@pytest.fixture(scope="module")
def pair():
    return PairParts(compose("generate", WORDS)).pair


def flank(pair, gear):
    on_path = np.linspace(0.0, pair.path_of_contact, 51)
    return np.asarray(
        pair.pinion_curvature(on_path)
        if gear is pair.pinion
        else pair.wheel_curvature(on_path)
    )


@pytest.mark.parametrize("name", ["pinion", "wheel"])
def test_uniform_heat_moves_the_flank_to_the_grown_involute(pair, name):
    """The grown gear's involute at the same direction of the normal has a curvature radius longer
    by the strain.
    """
    gear = getattr(pair, name)
    strain = 1e-3
    curvature = flank(pair, gear)
    moved = GearGrowth(tooth=strain, body=strain).along_action(gear, curvature)

    assert_close(moved, strain * curvature, 1e-12)

    grown = replace(gear, normal_module=gear.normal_module * (1.0 + strain))
    x, y = involute_point(gear, curvature)
    x_grown, y_grown = involute_point(grown, curvature * (1.0 + strain))
    angle = load_angle(gear, curvature)

    assert_close(
        (x_grown - x) * np.sin(angle) + (y_grown - y) * np.cos(angle),
        moved,
        1e-9,
    )


@pytest.mark.parametrize(("tooth", "body"), [(1e-3, 4e-4), (0.0, 1e-3), (1e-3, 0.0)])
def test_uneven_heat_moves_every_point_of_the_flank(pair, tooth, body):
    """Root circle by the body's strain, the tooth on it by its own: projected on the flank's
    normal.
    """
    gear = pair.pinion
    curvature = flank(pair, gear)
    x, y = involute_point(gear, curvature)
    x_moved = gear.root_radius * body + (x - gear.root_radius) * tooth
    angle = load_angle(gear, curvature)
    expected = x_moved * np.sin(angle) + y * tooth * np.cos(angle)
    growth = GearGrowth(tooth=tooth, body=body)

    assert_close(growth.along_action(gear, curvature), expected, 1e-9)

    if body == 0.0:
        assert_close(
            growth.of_tooth_alone.along_action(gear, curvature),
            expected,
            1e-9,
        )


def test_the_rim_grows_as_the_paper_s_equations_5_and_9_say(pair):
    """Eq. (5) integrated numerically and eq. (9), its closed form for the logarithmic field."""
    gear = pair.pinion
    heat = PairParts(compose("generate", WORDS)).heat
    insulated = replace(heat, face_convection=0.0)
    body = solved_body(gear, 6000.0, insulated, bore_temperature=50.0)
    inner = gear.bore_radius
    outer = gear.root_radius
    ring = outer**2 - inner**2
    rise = body.temperature - 20.0
    nu = 0.3
    whole = np.trapezoid(rise * body.radius, body.radius)
    free = (outer**2 * (1 - nu) + (1 + nu) * inner**2) / ring
    equation_5 = whole / outer * (1 + nu + free)
    step = rise[-1] - rise[0]
    mean = outer**2 * step / ring - step / (2.0 * np.log(outer / inner))
    equation_9 = outer * (rise[0] + mean)

    growth = (body.mean - 20.0) * outer

    assert_close(growth, equation_5, 1e-12)
    assert_close(growth, equation_9, 1e-5)


def test_gears_equally_hot_stay_conjugate(pair):
    same = GearGrowth(tooth=1e-3, body=1e-3)
    growth = PairGrowth(pinion=same, wheel=same)
    position = np.linspace(-0.2, 1.2, 101) * pair.path_of_contact

    assert np.abs(growth.deviation(pair, position)).max() < 1e-15
    assert_close(growth.strain(pair), 1e-3, 1e-6)
    assert_close(growth.closing(pair, 1e-3), 0.0, atol=1e-15)
    assert_close(
        growth.closing(pair, 0.0),
        2e-3 * pair.tangent_length,
        1e-6,
    )


def test_a_hotter_pinion_makes_the_entering_pair_late(pair):
    """Its base pitch is longer: the gap falls along the path by the difference of the strains."""
    hot = GearGrowth(tooth=1e-3, body=1e-3)
    cold = GearGrowth(tooth=0.0, body=0.0)
    position = np.linspace(-0.2, 1.2, 141) * pair.path_of_contact
    gap = PairGrowth(pinion=hot, wheel=cold).deviation(pair, position)
    on_path = (position >= 0.0) & (position <= pair.path_of_contact)

    assert_close(
        np.diff(gap[on_path]),
        -1e-3 * np.diff(position[on_path]),
        1e-6,
    )
    assert_close(
        np.interp(pair.pitch_point, position, gap),
        0.0,
        atol=1e-12,
    )
    assert_close(gap[position < 0.0], 1e-3 * pair.pitch_point, 1e-9)

    other = PairGrowth(pinion=cold, wheel=hot).deviation(pair, position)
    assert_close(other, -gap, atol=1e-15)

    strains = PairGrowth(pinion=hot, wheel=cold).pitch_strains(pair)
    assert_close(strains, (1e-3, 0.0), atol=1e-12)


def test_hot_teeth_on_a_cold_body_hardly_lengthen_the_base_pitch(pair):
    """Pitches are angles times the body's radius: the teeth's own growth makes them thicker, not
    farther apart.
    """
    growth = PairGrowth(
        pinion=GearGrowth(tooth=1e-3, body=0.0),
        wheel=GearGrowth(tooth=0.0, body=0.0),
    )
    assert abs(growth.pitch_strains(pair)[0]) < 2e-4
    assert 0.1e-3 * pair.base_pitch < growth.teeth_alone(pair) < pair.base_pitch * 1e-3
