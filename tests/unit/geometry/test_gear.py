"""One gear: derived sizes and what cannot be cut."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import GeometryError
from gensig.geometry.tooth import healthy_tooth
from gensig.geometry.tooth_profile import load_angle, root_curve_point, tooth_profile

# spur reference (docs/validation.md), section 1, m = 2 mm, 20 deg, no shift
TABLE = {
    23: {
        "pitch_radius": 23.0,
        "base_radius": 21.61293,
        "tip_radius": 25.0,
        "root_radius": 20.5,
    },
    84: {
        "pitch_radius": 84.0,
        "base_radius": 78.93418,
        "tip_radius": 86.0,
        "root_radius": 81.5,
    },
}
ANGLES = {23: (0.083200, 0.130995), 84: (0.033604, 0.035868)}
MIDDLES = {
    (23, "gamma_mid"): (20.59182, 2.14886),
    (23, "arc_mid"): (20.79942, 1.99186),
    (84, "gamma_mid"): (81.61719, 2.45831),
    (84, "arc_mid"): (81.66345, 2.40388),
}


@pytest.mark.parametrize("n_teeth", [23, 84])
def test_radii_and_angles_of_the_reference_pair(gear_with, n_teeth):
    gear = gear_with(n_teeth=n_teeth)
    for key, value in TABLE[n_teeth].items():
        assert_allclose(getattr(gear, key), value * 1e-3, rtol=0, atol=6e-9)
    assert_allclose(
        [gear.half_tooth_angle_base, gear.root_half_angle],
        ANGLES[n_teeth],
        rtol=0,
        atol=6e-7,
    )


@pytest.mark.parametrize(("n_teeth", "where"), MIDDLES)
def test_middle_of_the_root_curve(gear_with, n_teeth, where):
    expected = np.array(MIDDLES[n_teeth, where]) * 1e-3
    assert_allclose(
        root_curve_point(gear_with(n_teeth=n_teeth), where), expected, rtol=0, atol=2e-8
    )


def test_profile_covers_root_to_tip(xiamen):
    gear = xiamen.pair.pinion
    profile = tooth_profile(gear)
    x, y = profile.abscissa, profile.half_thickness
    assert len(x) == profile.n_root_cells + len(profile.curvature_radius)
    assert_allclose(
        np.hypot(x[[0, -1]], y[[0, -1]]),
        [gear.root_radius, gear.tip_radius],
        rtol=1e-12,
        atol=0,
    )
    assert np.all(np.diff(x) > 0)


def test_load_angle_of_the_reference_pinion_at_the_pitch_point(xiamen):
    angle = load_angle(xiamen.pair.pinion, np.array([7.86646e-3]))
    assert_allclose(np.degrees(angle), 16.087, rtol=0, atol=1e-3)


def test_half_tooth_angle_falls_from_pitch_to_tip_and_shift_thickens(gear_with):
    gear = gear_with()
    on_pitch = gear.half_tooth_angle_at(gear.pitch_radius)
    assert_allclose(on_pitch, math.pi / (2 * 23), rtol=1e-12, atol=0)
    assert gear.half_tooth_angle_at(gear.tip_radius) < on_pitch
    assert (
        gear_with(profile_shift=0.2).half_tooth_angle_at(gear.pitch_radius) > on_pitch
    )


def test_twelve_teeth_are_undercut_and_a_shift_cures_them(gear_with):
    with refused("12 teeth with profile shift 0 are undercut", GeometryError):
        gear_with(n_teeth=12)
    assert gear_with(n_teeth=12, profile_shift=0.5).junction_curvature_radius > 0


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.25])
def test_the_undercut_message_names_the_smallest_sound_number_of_teeth(
    gear_with, shift
):
    with refused("undercut", GeometryError) as caught:
        gear_with(n_teeth=10, profile_shift=shift)
    limit = int(re.search(r"at least (\d+) teeth", str(caught.value)).group(1))
    assert gear_with(n_teeth=limit, profile_shift=shift).n_teeth == limit
    with refused("undercut", GeometryError):
        gear_with(n_teeth=limit - 1, profile_shift=shift)


def test_a_large_shift_makes_the_tooth_pointed(gear_with):
    with refused("pointed below the tip radius", GeometryError):
        gear_with(n_teeth=14, profile_shift=1.0)
    assert gear_with(n_teeth=14, profile_shift=0.4)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"n_teeth": 2}, "n_teeth = 2 must be at least 3"),
        ({"normal_module": 0.0}, "normal_module_mm = 0 must be positive"),
        ({"face_width": -1e-3}, "face_width_mm = -1 must be positive"),
        ({"addendum_coefficient": 0.0}, "addendum_coefficient = 0 must be positive"),
        (
            {"pressure_angle": math.radians(5)},
            "pressure_angle_deg = 5 must lie between 10 and 35",
        ),
        ({"clearance_coefficient": 1.5}, "clearance_coefficient = 1.5"),
        (
            {"cutter_tip_radius_coefficient": 0.5},
            "cutter_tip_radius_coefficient = 0.5 must be positive and at most 0.38",
        ),
        (
            {"bore_radius": 21e-3},
            "bore_radius_mm = 21 must lie between 0 and the root radius 20.5 mm",
        ),
        ({"bore_radius": 0.0}, "bore_radius_mm = 0 must lie between"),
    ],
)
def test_sizes_that_cannot_be(xiamen, changes, text):
    with pytest.raises(GeometryError, match=f"pinion: {re.escape(text)}"):
        replace(xiamen.pair.pinion, **changes)


def test_a_rack_tip_wider_than_the_space_is_refused(gear_with):
    with refused(
        "cutter_tip_radius_coefficient = 0.38 is wider than the space", GeometryError
    ):
        gear_with(n_teeth=40, pressure_angle=math.radians(25.0))
    assert gear_with(
        n_teeth=40, pressure_angle=math.radians(25.0), cutter_tip_radius_coefficient=0.3
    )


def test_a_sliced_tooth_is_split_on_its_whole_face(xiamen):
    """In two steps as in one; what is missing stays where it is."""
    sound = healthy_tooth(xiamen.pair.pinion)
    width = sound.slice_edges[-1]
    first, second = np.array([0.25]) * width, np.array([-0.1, 0.1, 0.75, 1.2]) * width
    lost = sound.split(first).with_loss(np.array([[0.0], [1e-4]]))
    tooth = lost.split(second)

    assert_allclose(tooth.slice_edges, np.array([0.0, 0.1, 0.25, 0.75, 1.0]) * width)
    assert_allclose(tooth.material_loss[:, 0], [0.0, 0.0, 1e-4, 1e-4])
