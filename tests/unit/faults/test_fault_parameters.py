"""Faults from boundary keys, and faults that do not fit their tooth."""

import math
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError, FaultError
from gensig.faults.base import faulty_teeth
from gensig.faults.crack import Crack
from gensig.faults.missing_tooth import MissingTooth
from gensig.faults.pitting import Pitting
from gensig.faults.registry import FAULTS, read_fault
from gensig.geometry.tooth import healthy_tooth
from gensig.systems.spur_pair import severity

CRACK = {
    "kind": "crack",
    "gear": "pinion",
    "tooth": 3,
    "crack_depth_mm": 1.0,
    "crack_angle_deg": 45,
    "crack_start": "arc_mid",
}
PIT = {"kind": "pitting", "gear": "pinion", "tooth": 3, "pit_length_mm": 1.0, "pit_width_mm": 10, "pit_depth_mm": 0.5,
       "pit_position_mm": None}  # fmt: skip
MISSING = {"kind": "missing_tooth", "gear": "wheel", "tooth": 3}


def applied(xiamen, values):
    return faulty_teeth(xiamen.pair, [read_fault(values)])


class TestReading:
    def test_units_are_converted(self):
        crack = read_fault(CRACK)
        assert isinstance(crack, Crack)
        assert_allclose([crack.crack_depth, crack.crack_angle], [1e-3, math.pi / 4], rtol=1e-12, atol=0)
        pit = read_fault(PIT)
        assert isinstance(pit, Pitting)
        assert pit.pit_position is None
        assert isinstance(read_fault(MISSING), MissingTooth)

    def test_healthy_is_no_fault(self):
        assert read_fault({"kind": "healthy"}) is None

    @pytest.mark.parametrize("kind", ["crak", None, 3])
    def test_unknown_kinds_list_the_known(self, kind):
        with pytest.raises(FaultError) as caught:
            read_fault({"kind": kind})
        assert str(caught.value) == f"fault.kind = {kind!r}; allowed: healthy, {', '.join(FAULTS)}"

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            ({"crack_depht_mm": 1.0}, "unknown key 'crack_depht_mm'; did you mean 'crack_depth_mm'?"),
            ({"crack_depth_deg": 1.0}, "'crack_depth_deg' has the wrong unit; write it as 'crack_depth_mm'"),
            ({"crack_depth_mm": "deep"}, "fault.crack_depth_mm = 'deep' is not a number"),
        ],
    )
    def test_mistakes_in_keys(self, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            read_fault({**CRACK, **changes})


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({**CRACK, "crack_depth_mm": -0.1}, "fault.crack_depth_mm = -0.1 must not be negative"),
        (
            {**CRACK, "crack_depth_mm": 4.2},
            "crack_depth 4.2 mm reaches through the root chord 3.984 mm of the pinion tooth",
        ),
        ({**CRACK, "crack_angle_deg": 0}, "fault.crack_angle_deg = 0 must lie in 0..90"),
        ({**CRACK, "crack_angle_deg": 91}, "fault.crack_angle_deg = 91 must lie in 0..90"),
        ({**CRACK, "crack_start": "tip"}, "fault.crack_start = 'tip'; allowed: arc_mid, gamma_mid"),
        ({**CRACK, "crack_depth_mm": 3.9, "crack_angle_deg": 90}, "leaves no section near the tip"),
        ({**CRACK, "tooth": 23}, "fault.tooth = 23 is not on the pinion, whose teeth are 0..22"),
        ({**CRACK, "tooth": -1}, "fault.tooth = -1 must be at least 0"),
        ({**CRACK, "gear": "gear1"}, "fault.gear = 'gear1'; allowed: pinion, wheel"),
        ({**MISSING, "tooth": 84}, "fault.tooth = 84 is not on the wheel, whose teeth are 0..83"),
        ({**PIT, "pit_width_mm": -1}, "fault.pit_width_mm = -1 must not be negative"),
        ({**PIT, "pit_length_mm": -1}, "fault.pit_length_mm = -1 must not be negative"),
        ({**PIT, "pit_depth_mm": -1}, "fault.pit_depth_mm = -1 must not be negative"),
        ({**PIT, "pit_width_mm": 20}, "pit_width 20 mm must be below the face width 20 mm"),
        ({**PIT, "pit_length_mm": 9}, "above the root chord leaves the flank of the pinion tooth"),
        ({**PIT, "pit_position_mm": 0.1}, "above the root chord leaves the flank of the pinion tooth"),
        ({**PIT, "pit_depth_mm": 3}, "pit_depth 3 mm reaches the centreline"),
    ],
)
def test_faults_that_do_not_fit(xiamen, values, text):
    with pytest.raises(FaultError, match=re.escape(text)):
        applied(xiamen, values)


class TestWhatChanges:
    def test_a_crack_changes_sections_only(self, xiamen):
        sound, tooth = healthy_tooth(xiamen.pair.pinion), applied(xiamen, CRACK)["pinion", 3]
        assert np.all(tooth.area <= sound.area)
        assert tooth.area.min() > 0
        assert (tooth.second_moment < sound.second_moment).any()
        assert_allclose(tooth.contact_width, sound.contact_width, rtol=0, atol=0)
        assert_allclose(tooth.flank_deviation, 0.0, rtol=0, atol=0)
        assert tooth.present

    def test_a_crack_keeps_half_plus_h_q(self, xiamen):
        """Spur paper eqs. (11) and (12): sections thicker than h_q keep h_x + h_q, the others all."""
        tooth = applied(xiamen, CRACK)["pinion", 3]
        half = tooth.cell_half_thickness
        h_q = 1.28475e-3  # spur reference (docs/validation.md), section 2.3, arc mid
        height = np.where(half > h_q, half + h_q, 2 * half)
        width = xiamen.pair.pinion.face_width
        assert_allclose(tooth.area, height * width, rtol=1e-5, atol=0)
        assert_allclose(tooth.second_moment, height**3 * width / 12, rtol=2e-5, atol=0)

    def test_a_pit_takes_an_eccentric_rectangle(self, xiamen):
        """Eq. (15) as the parallel-axis theorem, section by section."""
        sound, tooth = healthy_tooth(xiamen.pair.pinion), applied(xiamen, PIT)["pinion", 3]
        inside = np.flatnonzero(tooth.area < sound.area)[2:-2]
        half = tooth.cell_half_thickness[inside]
        width, pit_width, depth = xiamen.pair.pinion.face_width, 10e-3, 0.5e-3
        area = 2 * half * width - pit_width * depth
        centroid = -pit_width * depth * (half - depth / 2) / area
        about_middle = (
            (2 * half) ** 3 * width / 12 - pit_width * depth**3 / 12 - pit_width * depth * (half - depth / 2) ** 2
        )
        assert_allclose(tooth.area[inside], area, rtol=1e-12, atol=0)
        assert_allclose(tooth.second_moment[inside], about_middle - area * centroid**2, rtol=1e-9, atol=0)
        x = tooth.cell_abscissa[tooth.area < sound.area]
        middle = 0.5 * (x.min() + x.max()) - tooth.profile.abscissa[0]
        assert_allclose([np.ptp(x), middle], [1e-3, 2.6220e-3], rtol=0, atol=2e-5)

    def test_a_pit_narrows_the_contact_where_it_lies(self, xiamen):
        tooth = applied(xiamen, PIT)["pinion", 3]
        narrow = tooth.profile.curvature_radius[tooth.contact_width < 20e-3]
        assert_allclose(np.unique(tooth.contact_width), [10e-3, 20e-3], rtol=1e-12, atol=0)
        # spur reference (docs/validation.md), section 2.3: rc 6.2928 to 9.1975 mm
        assert_allclose([narrow[0], narrow[-1]], [6.2928e-3, 9.1975e-3], rtol=0, atol=0.03e-3)

    def test_a_missing_tooth_is_absent(self, xiamen):
        assert not applied(xiamen, MISSING)["wheel", 3].present

    def test_neighbors_stay_sound(self, xiamen):
        assert set(applied(xiamen, CRACK)) == {("pinion", 3)}


class TestSeverity:
    def test_values(self, xiamen):
        pair = xiamen.pair
        assert_allclose(severity([read_fault(CRACK)], pair), 1.0 / (2 * 1.99186), rtol=1e-5, atol=0)
        assert_allclose(severity([read_fault(MISSING)], pair), 1.0, rtol=1e-12, atol=0)
        assert_allclose(severity([], pair), 0.0, rtol=0, atol=0)
        height = (np.hypot(21.61293, 12.56508) - np.hypot(21.61293, 2.019)) * 1e-3
        assert_allclose(severity([read_fault(PIT)], pair), 1e-5 / (height * 20e-3), rtol=1e-3, atol=0)

    def test_largest_counts(self, xiamen):
        assert severity([read_fault(CRACK), read_fault(MISSING)], xiamen.pair) == pytest.approx(1.0)

    def test_larger_than_the_tooth_is_refused(self, xiamen):
        with pytest.raises(FaultError, match="above 1"):
            severity([read_fault({**PIT, "pit_length_mm": 90})], xiamen.pair)
