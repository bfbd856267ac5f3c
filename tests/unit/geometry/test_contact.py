"""The line of action of a pair, and pairs that cannot mesh."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import GeometryError
from gensig.geometry.contact import GearPair, corner_gap, corner_gap_by_pinion


@pytest.fixture(scope="module")
def pair(xiamen):
    return xiamen.pair


@pytest.fixture(scope="module")
def shifted(pair):
    def make(pinion, wheel):
        return replace(
            pair,
            pinion=replace(pair.pinion, profile_shift=pinion),
            wheel=replace(pair.wheel, profile_shift=wheel),
        )

    return make


def test_reference_line_of_action(pair):
    # spur reference (docs/validation.md), section 1
    assert_allclose(pair.transverse_contact_ratio, 1.71178, rtol=0, atol=6e-6)
    assert_allclose(pair.base_pitch, 5.90426e-3, rtol=0, atol=6e-9)
    assert_allclose(pair.tangent_length, 36.59616e-3, rtol=0, atol=6e-9)
    result = [
        pair.start_curvature_radius,
        pair.end_curvature_radius,
        pair.pinion_curvature(pair.pitch_point),
    ]
    assert_allclose(result, [2.45827e-3, 12.56508e-3, 7.86646e-3], rtol=0, atol=6e-9)


@pytest.mark.parametrize("shifts", [(0.0, 0.0), (0.3, -0.3), (0.3, 0.2), (-0.1, 0.4)])
class TestShifts:
    def test_curvatures_add_up_and_the_pitch_point_halves_by_ratio(
        self, shifted, shifts
    ):
        pair = shifted(*shifts)
        s = np.linspace(0, pair.path_of_contact, 7)
        assert_allclose(
            pair.pinion_curvature(s) + pair.wheel_curvature(s),
            pair.tangent_length,
            rtol=1e-12,
            atol=0,
        )
        at_pitch_point = pair.wheel_curvature(pair.pitch_point) / pair.pinion_curvature(
            pair.pitch_point
        )
        assert_allclose(at_pitch_point, pair.ratio, rtol=1e-12, atol=0)
        assert_allclose(
            pair.wheel.base_pitch, pair.pinion.base_pitch, rtol=1e-12, atol=0
        )

    def test_teeth_fill_the_working_pitch_circle(self, shifted, shifts):
        """No play at the working centre distance: both tooth thicknesses make one pitch (an
        independent reading).
        """
        pair = shifted(*shifts)
        radii = [
            gear.base_radius / math.cos(pair.working_pressure_angle)
            for gear in (pair.pinion, pair.wheel)
        ]
        thickness = sum(
            2 * radius * gear.half_tooth_angle_at(radius)
            for gear, radius in zip((pair.pinion, pair.wheel), radii, strict=True)
        )
        assert_allclose(sum(radii), pair.center_distance, rtol=1e-12, atol=0)
        assert_allclose(
            thickness, 2 * math.pi * radii[0] / pair.pinion.n_teeth, rtol=1e-9, atol=0
        )

    def test_reference_center_distance_only_when_the_shifts_cancel(
        self, shifted, shifts
    ):
        pair = shifted(*shifts)
        moved = pair.center_distance - 107e-3
        assert abs(moved) < 1e-12 if sum(shifts) == 0 else moved > 0.1e-3


def outline_distance(pair, pinion_position, wheel_position, corner_of):
    """Distance of a tip corner from the mating flank, both flanks placed by their own rotation, m.

    Drawn on the line of action N1 N2: the flank point of curvature rho sits on it when the rotation
    brings it there.
    """
    alpha = pair.working_pressure_angle
    along = np.array([math.sin(alpha), -math.cos(alpha)])
    normal = np.array([math.cos(alpha), math.sin(alpha)])
    center = np.array([pair.center_distance, 0.0])

    def turn(points, angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * points[0] - s * points[1], s * points[0] + c * points[1]])

    def pinion_flank(rho):
        start = pair.start_curvature_radius + pinion_position
        r = pair.pinion.base_radius
        return turn(r * normal[:, None] + along[:, None] * rho, (rho - start) / r)

    def wheel_flank(rho):
        start = pair.tangent_length - pair.start_curvature_radius - wheel_position
        r = pair.wheel.base_radius
        return center[:, None] + turn(
            -r * normal[:, None] - along[:, None] * rho, (rho - start) / r
        )

    gear, flank, mate = (
        (pair.pinion, pinion_flank, wheel_flank)
        if corner_of == "pinion"
        else (pair.wheel, wheel_flank, pinion_flank)
    )
    corner = flank(np.array([math.sqrt(gear.tip_radius**2 - gear.base_radius**2)]))
    rho = np.linspace(0, 40e-3, 4001)
    for _ in range(4):
        gap = np.hypot(*(mate(rho) - corner))
        middle, reach = rho[gap.argmin()], rho[1] - rho[0]
        rho = middle + reach * np.linspace(-1, 1, 201)
    return gap.min()


class TestCornerGap:
    def test_zero_on_the_path_and_continuous_beyond(self, pair):
        s = np.linspace(0, pair.path_of_contact, 100)
        assert_allclose(corner_gap(pair, s), 0.0, rtol=0, atol=0)
        near = np.array([-1e-7, pair.path_of_contact + 1e-7])
        assert_allclose(corner_gap(pair, near), 0.0, rtol=0, atol=1e-11)

    def test_it_opens_monotonically(self, pair):
        s = np.linspace(0, 5e-3, 200)
        for gap in (
            corner_gap(pair, pair.path_of_contact + s),
            corner_gap(pair, -s),
            corner_gap_by_pinion(pair, -s),
        ):
            assert np.all(np.diff(gap) > 0)

    @pytest.mark.parametrize(
        ("side", "expected"),
        [
            ("before", [1.61, 10.0, 28.8, 57.5, 115.9]),
            ("after", [0.83, 5.25, 15.4, 31.3, 64.2]),
        ],
    )
    def test_reference_numbers(self, pair, side, expected):
        # spur reference (docs/validation.md), section 5.3, point 6
        beyond = np.array([0.2, 0.5, 0.85, 1.2, 1.7]) * 1e-3
        position = -beyond if side == "before" else pair.path_of_contact + beyond
        assert_allclose(
            corner_gap(pair, position) * 1e6, expected, rtol=5e-3, atol=0.006
        )

    @pytest.mark.parametrize("beyond", [0.2e-3, 0.85e-3, 1.7e-3])
    @pytest.mark.parametrize("side", ["before", "after"])
    def test_the_corner_touches_the_mating_flank(self, pair, side, beyond):
        if side == "after":
            position = pair.path_of_contact + beyond
            gap = corner_gap(pair, np.array([position]))[0]
            touching, apart = (position, position - gap), (position, position)
        else:
            gap = corner_gap(pair, np.array([-beyond]))[0]
            touching, apart = (-beyond + gap, -beyond), (-beyond, -beyond)
        corner_of = "pinion" if side == "after" else "wheel"
        assert outline_distance(pair, *touching, corner_of) < 2e-9
        assert outline_distance(pair, *apart, corner_of) > 0.1 * gap

    def test_by_the_pinion_is_the_same_contact(self, pair):
        s = -np.linspace(0.1e-3, 2e-3, 8)
        by_pinion = corner_gap_by_pinion(pair, s)
        assert_allclose(by_pinion, corner_gap(pair, s - by_pinion), rtol=1e-9, atol=0)


class TestPairsThatCannotMesh:
    def test_interference(self, pair):
        with pytest.raises(
            GeometryError,
            match=r"pinion: contact would reach curvature radius .* \(interference\)",
        ):
            replace(
                pair,
                wheel=replace(
                    pair.wheel,
                    addendum_coefficient=1.2,
                    cutter_tip_radius_coefficient=0.3,
                ),
            )
        assert replace(pair, wheel=replace(pair.wheel, addendum_coefficient=1.02))

    def test_tip_in_the_root(self, pair):
        shallow = {
            "clearance_coefficient": 0.02,
            "cutter_tip_radius_coefficient": 0.01,
            "profile_shift": 0.6,
        }
        large = replace(pair.pinion, n_teeth=40)
        with pytest.raises(
            GeometryError,
            match=r"pinion: its tip cuts .* mm into the root of the wheel",
        ):
            replace(
                pair,
                pinion=replace(large, **shallow),
                wheel=replace(pair.wheel, **shallow),
            )
        assert replace(pair, pinion=large)

    def test_different_modules(self, pair):
        with refused("normal_module differs", GeometryError):
            replace(pair, wheel=replace(pair.wheel, normal_module=2.5e-3))

    def test_negative_backlash(self, pair):
        with refused("backlash_um = -1 must not be negative", GeometryError):
            replace(pair, backlash=-1e-6)

    def test_contact_ratio_below_one_is_refused_only_when_asked(self, pair):
        short = GearPair(
            pinion=replace(pair.pinion, addendum_coefficient=0.5),
            wheel=replace(pair.wheel, addendum_coefficient=0.5),
            backlash=0.0,
        )
        assert short.transverse_contact_ratio < 1
        with refused(
            f"contact ratio {short.transverse_contact_ratio:.4f} is below 1",
            GeometryError,
        ):
            short.require_continuous_drive()
        pair.require_continuous_drive()
