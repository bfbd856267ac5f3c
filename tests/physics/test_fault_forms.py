"""Faults whose effect is known in closed form, and faults that are each other's limits."""

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import (
    FULL,
    GEARS,
    heavy_table,
    on_path,
    one,
    side_of,
)

from gensig.faults.base import faulty_teeth
from gensig.faults.broken import tooth_height
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.load_distribution import pair_states
from gensig.mesh.local_contact import relative_radius
from gensig.mesh.pair_table import flank_sides, slice_bending

UM = 1e-6


def rows(system, fault, tooth=0):
    """Gap beyond the sound tooth's, and compliance, of the faulty tooth at every node, (node,)."""
    side = side_of(system.mesh_table((fault,)), fault.gear)
    row = side.kind[tooth]
    return side.gap[row] - side.gap[0], side.compliance[row]


def path(system):
    """Nodes on the path of contact with their positions, (node,)."""
    table = system.mesh_table()
    return on_path(table), table.position[on_path(table)]


def curvature(system, gear):
    """Curvature radius of one gear's flank at the nodes on the path, (node,) m."""
    return getattr(system.pair, f"{gear}_curvature")(path(system)[1])


def along_flank(system, gear):
    """Position on the flank at the nodes on the path: 0 at the lower end, 1 at the tip."""
    flank = healthy_tooth(getattr(system.pair, gear)).profile.curvature_radius
    return (curvature(system, gear) - flank[0]) / (flank[-1] - flank[0])


@pytest.mark.parametrize("gear", GEARS)
class TestOneIsTheOther:
    def test_broken_at_full_height_is_missing(self, xiamen, gear):
        height_mm = 1e3 * tooth_height(getattr(xiamen.pair, gear))
        broken = one(
            "broken",
            gear=gear,
            tooth=2,
            broken_height_mm=height_mm,
        )
        missing = one("missing_tooth", gear=gear, tooth=2)
        roll = xiamen.pair.base_pitch * np.linspace(0.0, 6.0, 601)
        result, expected = (
            pair_states(xiamen.mesh_table((fault,)), roll)
            for fault in (broken, missing)
        )

        assert_close(result.gap, expected.gap)

        there = np.isfinite(expected.gap)
        assert not there.all()

        compliance = expected.compliance[there]
        assert_close(result.compliance[there], compliance, 1e-12)

    @pytest.mark.parametrize("height_mm", [0.5, 2.0])
    def test_chipped_over_the_whole_face_is_broken(self, xiamen, gear, height_mm):
        whole = {
            "chip_width_mm": FULL,
            "chip_shape": "rectangular",
        }
        on = {"gear": gear, "tooth": 0}
        chip = one("chipped", **on, chip_height_mm=height_mm, **whole)
        broken = one("broken", **on, broken_height_mm=height_mm)
        expected = rows(xiamen, broken)

        assert_close(rows(xiamen, chip), expected, 1e-12)

        body = getattr(xiamen.pair, gear)
        assert_close(chip.severity(body), broken.severity(body), 1e-6)

    def test_a_rectangular_spall_is_a_pit(self, xiamen, gear):
        pit = patch("pitting", "pit", gear)
        spall = patch("spalling", "spall", gear, spall_shape="rectangular")
        assert_close(rows(xiamen, spall), rows(xiamen, pit))

        body = getattr(xiamen.pair, gear)
        assert_close(spall.severity(body), pit.severity(body), 1e-6)

        ellipse = patch("spalling", "spall", gear).severity(body)
        assert_close(ellipse, 0.25 * np.pi * pit.severity(body), 1e-6)


PATCH = {
    "length_mm": 1.2,
    "width_mm": 9.0,
    "depth_mm": 0.4,
    "position_mm": 2.4,
    "face_position_mm": 6.0,
}


def patch(kind, prefix, gear, **changes):
    """One hole of the same size and position, as a pit or as a spall."""
    size = {f"{prefix}_{key}": value for key, value in PATCH.items()}
    return one(kind, gear=gear, tooth=0, **size, **changes)


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("height_mm", [0.5, 2.0])
def test_a_broken_tooth_bends_as_the_sound_one_up_to_its_corner(
    xiamen, gear, height_mm
):
    """The lost part carried nothing of a load below it; a load above it is on the corner."""
    fault = one("broken", gear=gear, tooth=0, broken_height_mm=height_mm)
    corner = faulty_teeth(xiamen.pair, (fault,))[gear, 0].tip_curvature_radius
    side = side_of(heavy_table(xiamen, fault), gear)
    sound, broken = (row[path(xiamen)[0]] for row in side.compliance)
    below = curvature(xiamen, gear) <= corner

    assert_close(broken[below], sound[below], 1e-3)

    at_corner = sound[below][{"pinion": -1, "wheel": 0}[gear]]
    # the contact term varies with the position
    assert_close(broken[~below], at_corner, 0.05)
    assert (sound[~below] / at_corner).max() > 1.05


@pytest.mark.parametrize("gear", GEARS)
class TestGapsInClosedForm:
    @pytest.mark.parametrize("depth_um", [5.0, 80.0])
    def test_uniform_wear_is_a_gap_of_its_depth(self, xiamen, gear, depth_um):
        wear = {
            "gear": gear,
            "tooth": 0,
            "wear_depth_um": depth_um,
        }
        even, uneven = (
            rows(xiamen, one("wear", **wear, **shape))[0][path(xiamen)[0]]
            for shape in ({"wear_profile": None}, {})
        )
        assert_close(even, depth_um * UM, 1e-12)
        assert np.ptp(uneven) > 0.5 * depth_um * UM

    @pytest.mark.parametrize("error_um", [20.0, -20.0, 0.5])
    def test_a_pitch_error_is_its_value_everywhere(self, xiamen, gear, error_um):
        error = one(
            "pitch_error",
            gear=gear,
            tooth=0,
            pitch_error_um=error_um,
        )
        gap, compliance = rows(xiamen, error)
        # far off the path the corner gap is millimetres, whose rounding remains
        assert_close(gap, error_um * UM, 1e-9, atol=1e-16)

        sound = side_of(xiamen.mesh_table(), gear).compliance[0]
        assert_close(compliance, sound, 1e-12)

    @pytest.mark.parametrize("slope_um", [20.0, -20.0])
    def test_a_profile_slope_is_straight_in_roll(self, xiamen, gear, slope_um):
        slope = {
            "profile_slope_um": slope_um,
            "profile_form_um": 0,
        }
        gap, _ = rows(
            xiamen,
            one("profile_error", gear=gear, tooth=0, **slope),
        )
        expected = slope_um * UM * (along_flank(xiamen, gear) - 0.5)
        within_second_order(xiamen, gear, gap, expected)
        # half of it stands back at one end of the flank, as much stands proud at the other
        tip, low = {"pinion": (-1, 0), "wheel": (0, -1)}[gear]
        ends = gap[path(xiamen)[0]] * np.sign(slope_um)

        assert ends[low] < 0 < ends[tip]

    @pytest.mark.parametrize("waves", [1.0, 2.0])
    def test_a_profile_form_is_waves(self, xiamen, gear, waves):
        form = {
            "profile_form_um": 2,
            "profile_waves": waves,
            "profile_slope_um": 0,
        }
        fault = one("profile_error", gear=gear, tooth=0, **form)
        expected = 2 * UM * np.sin(np.pi * waves * along_flank(xiamen, gear)) ** 2
        within_second_order(xiamen, gear, rows(xiamen, fault)[0], expected)

    @pytest.mark.parametrize(("curve", "power"), [("linear", 1), ("parabolic", 2)])
    def test_tip_relief_falls_off_from_the_tip(self, xiamen, gear, curve, power):
        relief = {
            "relief_um": 10,
            "relief_length_mm": 3,
            "relief_curve": curve,
        }
        fault = one("tip_relief", gear=gear, tooth=0, **relief)
        tip = {
            "pinion": xiamen.pair.path_of_contact,
            "wheel": 0.0,
        }[gear]
        from_tip = np.abs(path(xiamen)[1] - tip)
        expected = 10 * UM * np.maximum(1 - from_tip / 3e-3, 0.0) ** power

        assert expected.max() > 9.9 * UM

        within_second_order(xiamen, gear, rows(xiamen, fault)[0], expected)


def within_second_order(system, gear, gap, expected):
    """A mate of relative radius rho finds a deviation less at most slope^2 rho / 2, slope along the
    flank.
    """
    on, _ = path(system)
    largest = second_order(system, gear, expected).max()
    assert largest < 0.1 * np.ptp(expected)
    short = expected - gap[on]
    # a thousandth for kinks between the nodes, a quarter for the third order
    assert short.min() > -1e-3 * np.ptp(expected)
    assert short.max() < 1.25 * largest + 1e-3 * np.ptp(expected)


def second_order(system, gear, deviation):
    """slope^2 rho / 2 of a deviation given on the path, (node,) m."""
    arc = curvature(system, gear) ** 2 / (2 * getattr(system.pair, gear).base_radius)
    radius = relative_radius(system.pair, path(system)[1])
    return np.gradient(deviation, arc) ** 2 * radius / 2


@pytest.mark.parametrize("gear", GEARS)
class TestRunout:
    @staticmethod
    def gaps(system, gear, position):
        """Gap of every tooth beyond the sound tooth's, (tooth, position) m."""
        runout = one("runout", gear=gear, tooth=5, eccentricity_um=40)
        table = system.mesh_table((runout,))
        side = side_of(table, gear)
        gap = (side.gap - side_of(system.mesh_table(), gear).gap[0])[side.kind]
        return np.array([np.interp(position, table.position, row) for row in gap])

    def test_consecutive_teeth_agree_at_the_same_roll(self, xiamen, gear):
        """Tooth k + 1 is one base pitch behind tooth k; the eccentricity moves both."""
        pitch = xiamen.pair.base_pitch
        both = np.linspace(pitch, xiamen.pair.path_of_contact, 50)
        here = self.gaps(xiamen, gear, both)
        behind = self.gaps(xiamen, gear, both - pitch)
        next_tooth = np.roll(behind, -1, axis=0)
        tooth_before = np.roll(behind, 1, axis=0)
        # slope of the deviation along the flank, at most
        slope = 40 * UM / curvature(xiamen, gear)
        radius = relative_radius(xiamen.pair, path(xiamen)[1])
        least = (slope**2 * radius / 2).max()

        assert np.abs(here - next_tooth).max() < 1.25 * least
        assert np.abs(here - tooth_before).max() > 2 * UM

    def test_the_amplitude_is_the_eccentricity(self, xiamen, gear):
        gap = self.gaps(xiamen, gear, xiamen.pair.pitch_point)
        turn = 2 * np.pi * (np.arange(len(gap)) - 5) / len(gap)
        assert_close(
            gap,
            40 * UM * np.cos(turn),
            atol=0.1 * UM,
        )
        assert gap.argmax() == 5


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("bending", ["whole", "by_slice"])
@pytest.mark.parametrize("ratio", [0.2, 1.9, 2.1, 50.0])
def test_misalignment_is_a_tilted_winkler_strip(machine, gear, bending, ratio):
    """A strip of compliance c over the whole width, tilted by d, pressed by F, at C."""
    system = machine({"mesh.contact": "linear", "mesh.bending": bending})
    at = np.array([system.pair.pitch_point])
    force = system.mesh_force
    mesh = system.pair, at, system.material, system.mesh
    share = {"pinion": 1.0, "wheel": 0.0}[gear]
    side = flank_sides(*mesh, force, pinion_share=share)[gear]
    bending_compliance = slice_bending(*mesh)
    even = (side.law.compliance(FULL * 1e-3, force) + bending_compliance).item() * force
    tilt = ratio * even
    expected = np.sqrt(2 * even * tilt)  # part of the face bears
    if ratio < 2:
        expected = even + tilt / 2

    for misalignment in (tilt / UM, -tilt / UM):
        size = {"misalignment_um": misalignment}
        fault = one("misalignment", gear=gear, tooth=0, **size)
        tooth = faulty_teeth(system.pair, (fault,))[gear, 0]
        gap, compliance = side.contact(tooth, bending_compliance, system.mesh)
        approach = gap + (compliance + bending_compliance) * force
        assert_close(approach, expected, 1e-3)
