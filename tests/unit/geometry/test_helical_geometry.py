"""Helical gears: the figures of both papers' pairs, and the laws that tie the transverse section to
the normal one.
"""

import dataclasses
import math

import numpy as np
import pytest
from refusals import refused

from gensig.errors import GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.involute import involute
from gensig.geometry.tooth_profile import involute_point, root_curve


def gear(name, n_teeth, shift, width, *, module, angle, helix, addendum=1.0):
    return Gear(
        name=name,
        n_teeth=n_teeth,
        normal_module=module * 1e-3,
        pressure_angle=math.radians(angle),
        helix_angle=math.radians(helix),
        addendum_coefficient=addendum,
        clearance_coefficient=0.25,
        cutter_tip_radius_coefficient=0.3,
        profile_shift=shift,
        face_width=width * 1e-3,
        bore_radius=0.2 * module * n_teeth * 1e-3,
    )


def beihang(addendum=1.0, helix=18.0):
    """Pair of the paper on transmission error."""
    rack = {"module": 1.3, "angle": 17.5, "addendum": addendum}
    pinion = gear("pinion", 61, -0.077, 15, helix=helix, **rack)
    return GearPair(
        pinion=pinion,
        wheel=gear("wheel", 132, 0.150, 14, helix=-helix, **rack),
        backlash=1e-4,
    )


def chongqing(pinion_shift, shift_sum):
    """Pair of the paper on temperature."""
    rack = {"module": 12, "angle": 20}
    pinion = gear("pinion", 40, pinion_shift, 180, helix=12, **rack)
    wheel = gear("wheel", 162, shift_sum - pinion_shift, 180, helix=-12, **rack)
    return GearPair(pinion=pinion, wheel=wheel, backlash=1e-4)


def test_figures_of_the_transmission_error_paper():
    pair = beihang()
    assert pair.center_distance == pytest.approx(132.0005e-3, rel=1e-6)
    assert pair.overlap_ratio == pytest.approx(1.0593, abs=5e-5)
    assert pair.transverse_contact_ratio == pytest.approx(1.856, abs=5e-4)
    assert beihang(addendum=1.2423).total_contact_ratio == pytest.approx(
        3.325, abs=5e-4
    )
    force = 178 / pair.pinion.pitch_radius
    assert force == pytest.approx(4269.6, rel=2e-5)
    assert force / math.cos(pair.pinion.transverse_pressure_angle) == pytest.approx(
        4498.1, rel=2e-5
    )


def test_figures_of_the_temperature_paper():
    standard = 0.5 * 12e-3 * 202 / math.cos(math.radians(12))
    assert standard == pytest.approx(1239.08e-3, rel=1e-5)
    for shift, ratio in ((0.0, 1.704), (0.469, 1.644), (0.938, 1.548)):
        pair = chongqing(shift, 0.938)
        assert pair.center_distance == pytest.approx(1.250, rel=2e-5)
        assert math.degrees(pair.working_pressure_angle) == pytest.approx(
            21.716, abs=2e-3
        )
        assert pair.transverse_contact_ratio == pytest.approx(ratio, abs=1e-3)
        assert pair.overlap_ratio == pytest.approx(0.9927, abs=5e-5)


def test_helix_zero_is_the_spur_gear_to_the_bit():
    helical, spur = (
        beihang(helix=0.0).pinion,
        dataclasses.replace(beihang(helix=0.0).pinion, helix_angle=-0.0),
    )
    assert helical.transverse_pressure_angle == helical.pressure_angle
    assert helical.transverse_module == helical.normal_module
    for name in (
        "pitch_radius",
        "base_radius",
        "half_tooth_angle_base",
        "junction_curvature_radius",
        "root_half_angle",
    ):
        assert getattr(helical, name) == getattr(spur, name)


@pytest.mark.parametrize("helix", [0.0, 8.0, 18.0, 35.0])
def test_normal_and_transverse_section_tell_the_same_tooth(helix):
    one = beihang(helix=helix).pinion
    beta, alpha_n, alpha_t = (
        one.helix_angle,
        one.pressure_angle,
        one.transverse_pressure_angle,
    )
    # the normal base pitch is that of the rack
    normal_base_pitch = math.pi * one.normal_module * math.cos(alpha_n)
    assert one.base_pitch * math.cos(one.base_helix_angle) == pytest.approx(
        normal_base_pitch, rel=1e-12
    )
    assert math.tan(one.base_helix_angle) == pytest.approx(
        math.tan(beta) * math.cos(alpha_t), rel=1e-12
    )
    # thickness on the reference cylinder, normal to the teeth, is the rack's: pi m / 2 + 2 x m
    # tan(alpha_n)
    thickness = (
        2
        * one.pitch_radius
        * one.half_tooth_angle_at(one.pitch_radius)
        * math.cos(beta)
    )
    rack = one.normal_module * (
        0.5 * math.pi + 2 * one.profile_shift * math.tan(alpha_n)
    )
    assert thickness == pytest.approx(rack, rel=1e-9)


@pytest.mark.parametrize("helix", [0.0, 18.0, 35.0])
def test_root_curve_ends_on_the_involute_with_its_direction(helix):
    one = beihang(helix=helix).wheel
    alpha = one.transverse_pressure_angle
    x, y = root_curve(one, np.array([alpha, alpha + 1e-6]))
    u, v = involute_point(one, one.junction_curvature_radius + np.array([0.0, 1e-9]))
    assert math.hypot(x[0] - u[0], y[0] - v[0]) < 1e-12
    assert (
        abs(
            math.remainder(
                math.atan2(y[1] - y[0], x[1] - x[0])
                - math.atan2(v[1] - v[0], u[1] - u[0]),
                math.pi,
            )
        )
        < 1e-4
    )


def test_working_angle_closes_the_backlash():
    """At the working centre distance both teeth fill the pitch on the working pitch circles."""
    pair = beihang()
    working = pair.working_pressure_angle
    share = sum(
        one.n_teeth * (one.half_tooth_angle_base - involute(working))
        for one in (pair.pinion, pair.wheel)
    )
    assert share == pytest.approx(math.pi, rel=1e-12)


def test_hands_that_do_not_match_are_refused():
    pair = beihang()
    for other in (18.0, -17.0, 0.0):
        with refused("equal and of opposite hand", GeometryError):
            dataclasses.replace(
                pair,
                wheel=dataclasses.replace(pair.wheel, helix_angle=math.radians(other)),
            )
    with refused("must lie between -45 and 45", GeometryError):
        dataclasses.replace(pair.pinion, helix_angle=math.radians(50))
