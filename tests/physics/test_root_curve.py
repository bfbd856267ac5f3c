"""The root transition curve: its two ends, and against cutting with a rack."""

import math

import numpy as np
import pytest
from closeness import assert_close

from gensig.geometry.tooth_profile import involute_point, root_curve

CASES = {
    "z23": {},
    "z84": {"n_teeth": 84},
    "z30_plus": {"n_teeth": 30, "profile_shift": 0.3},
    "z40_minus": {"n_teeth": 40, "profile_shift": -0.2},
    "z12_cured": {"n_teeth": 12, "profile_shift": 0.5},
}


@pytest.fixture(params=CASES.values(), ids=CASES.keys())
def gear(request, gear_with):
    return gear_with(**request.param)


def rack_clearance(gear, x, y):
    """Smallest distance of a tooth point from the rack while it rolls by; 0 on the cut outline,
    (point,) m.
    """
    m = gear.normal_module
    alpha = gear.pressure_angle
    rounding = gear.cutter_tip_radius_coefficient * m
    height = gear.addendum_coefficient + gear.clearance_coefficient
    below_datum = height * m - rounding
    center_depth = below_datum - gear.profile_shift * m
    center_offset = math.pi * m / 4 + below_datum * math.tan(alpha)
    center_offset += rounding / math.cos(alpha)
    pitch_radius = m * gear.n_teeth / 2
    radius = np.hypot(x, y)[:, None]
    polar = np.arctan2(y, x)[:, None]

    def distance(roll):
        """The rack's tooth is the wedge right of its flank and above its tip line, grown by the
        rounding.
        """
        along = radius * np.sin(polar - roll) + pitch_radius * roll - center_offset
        deep = pitch_radius - radius * np.cos(polar - roll) - center_depth
        from_flank = deep * math.sin(alpha) - along * math.cos(alpha)
        beyond = along * math.sin(alpha) + deep * math.cos(alpha)
        on_tip = (along > 0) & (deep > 0)
        on_flank = (beyond < 0) & (from_flank > 0)
        inside = (deep <= 0) & (from_flank <= 0)
        cases = [inside, on_tip, on_flank]
        values = [np.maximum(deep, from_flank), deep, from_flank]
        return np.select(cases, values, np.hypot(along, deep)) - rounding

    span = np.linspace(-1.0, 1.0, 801) * 6 * m / pitch_radius
    best = span[distance(span[None, :]).argmin(axis=1)][:, None]
    step = span[1] - span[0]
    for _ in range(3):
        fine = best + step * np.linspace(-1, 1, 101)
        nearest = distance(fine).argmin(axis=1)[:, None]
        best = np.take_along_axis(fine, nearest, axis=1)
        step = step / 50
    return distance(best)[:, 0]


def outline(gear):
    gamma = np.linspace(math.pi / 2, gear.pressure_angle, 32)
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    flank = involute_point(
        gear,
        np.linspace(gear.junction_curvature_radius, tip, 16),
    )
    return [
        np.concatenate(parts)
        for parts in zip(root_curve(gear, gamma), flank, strict=True)
    ]


def test_a_rolling_rack_cuts_this_outline(gear):
    assert_close(rack_clearance(gear, *outline(gear)), 0.0, atol=0.05e-6)


def test_root_end_lies_on_the_root_circle_at_theta_f(gear):
    x, y = (value[0] for value in root_curve(gear, np.array([math.pi / 2])))
    assert_close(math.hypot(x, y), gear.root_radius, 1e-12)
    assert_close(math.atan2(y, x), gear.root_half_angle, 1e-10)


def test_involute_end_joins_in_place_and_slope(gear):
    step = np.array([0.0, 1e-7])
    root = np.array(root_curve(gear, gear.pressure_angle + step))
    flank = np.array(involute_point(gear, gear.junction_curvature_radius + step))
    assert_close(root[:, 0], flank[:, 0], atol=1e-12)
    (x_root, y_root), (x_flank, y_flank) = np.diff(root), np.diff(flank)
    slopes = np.arctan2([y_root, y_flank], [x_root, x_flank]) % math.pi
    assert_close(slopes[0], slopes[1], atol=1e-4)


def test_the_outline_rises_from_root_to_tip(gear):
    assert np.all(np.diff(outline(gear)[0]) > -1e-12)
