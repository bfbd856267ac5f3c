"""Changes that each fault makes on its tooth, and no others."""

from itertools import pairwise

import numpy as np
import pytest
from fault_cases import FULL, GEARS, KINDS, one
from numpy.testing import assert_allclose

from gensig.faults.base import faulty_teeth
from gensig.faults.broken import tooth_height
from gensig.faults.flank_loss import flank_area
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.face import bearing_width
from gensig.mesh.tooth_sections import sections

HOLES, FORM = {"slice_edges", "material_loss"}, {"flank_deviation"}
CHANGES = {
    "crack": {"cracks"},
    "pitting": HOLES,
    "spalling": HOLES,
    "distributed_pitting": HOLES,
    "chipped": HOLES,
    "broken": {"material_loss"},
    "missing_tooth": {"present"},
    "wear": {"material_loss"},
    "pitch_error": FORM,
    "profile_error": FORM,
    "runout": FORM,
    "misalignment": FORM | {"slice_edges"},
    "tip_relief": FORM,
}


@pytest.fixture(scope="module")
def tooth_of(xiamen):
    """The pinion's tooth 3 with the given faults on it, one after the other."""

    def make(*faults):
        tooth = healthy_tooth(xiamen.pair.pinion)
        for fault in faults:
            tooth = fault.apply(tooth, 3)
        return tooth

    return make


def on_flank(tooth):
    """Abscissae of the nodes of the involute, (profile,) m."""
    return tooth.profile.flank_abscissa


def lost_area(tooth):
    """Flank that is gone deeper than wear, by height on the centreline and face, m2."""
    cell = np.outer(tooth.slice_width, np.gradient(on_flank(tooth)))
    return float(cell[tooth.material_loss > 0].sum())


class TestWhatChanges:
    @pytest.mark.parametrize("kind", KINDS)
    def test_that_and_nothing_else(self, tooth_of, kind):
        sound, tooth = tooth_of(), tooth_of(one(kind, tooth=3))
        differs = {
            "cracks": tooth.cracks != sound.cracks,
            "present": tooth.present != sound.present,
            "slice_edges": len(tooth.slice_edges) != len(sound.slice_edges),
            "material_loss": tooth.material_loss.any(),
            "flank_deviation": tooth.flank_deviation.any(),
            "profile": tooth.profile is not sound.profile,
        }
        assert {name for name in differs if differs[name]} == CHANGES[kind]

    def test_the_sound_tooth_is_read_only(self, tooth_of):
        sound = tooth_of()
        for values in (sound.material_loss, sound.flank_deviation, sound.slice_edges):
            assert not values.flags.writeable

    @pytest.mark.parametrize("kind", KINDS)
    def test_slices_cover_the_face(self, tooth_of, kind):
        tooth = tooth_of(one(kind, tooth=3))
        assert_allclose(tooth.slice_edges[[0, -1]], [0.0, 20e-3], rtol=0, atol=0)
        assert tooth.slice_width.min() > 0
        assert_allclose(tooth.slice_width.sum(), 20e-3, rtol=1e-12, atol=0)
        shape = (len(tooth.slice_width), len(tooth.profile.curvature_radius))
        for values in (tooth.material_loss, tooth.flank_deviation):
            assert np.broadcast_shapes(values.shape, shape) == shape
        assert tooth.material_loss.min() >= 0

    def test_neighbors_stay_sound(self, xiamen):
        for kind, teeth in (("crack", [3]), ("runout", range(23))):
            faulty = faulty_teeth(xiamen.pair, [one(kind, tooth=3)])
            assert set(faulty) == {("pinion", number) for number in teeth}


class TestThePapersSections:
    def test_a_crack_changes_sections_only(self, tooth_of):
        sound, tooth = tooth_of(), tooth_of(one("crack"))
        (area, moment), (sound_area, sound_moment) = (
            sections(t, papers_crack=True) for t in (tooth, sound)
        )
        assert np.all(area <= sound_area)
        assert area.min() > 0
        assert (moment < sound_moment).any()
        rc = tooth.profile.curvature_radius
        assert_allclose(
            bearing_width(tooth, rc), bearing_width(sound, rc), rtol=0, atol=0
        )
        for result, expected in zip(
            sections(tooth, papers_crack=False), (sound_area, sound_moment), strict=True
        ):
            assert_allclose(result, expected, rtol=0, atol=0)

    def test_a_crack_keeps_half_plus_h_q(self, tooth_of):
        """Spur paper eqs. (11), (12): sections thicker than h_q keep h_x + h_q, the others all."""
        tooth = tooth_of(one("crack"))
        half, width = tooth.cell_half_thickness, tooth.gear.face_width
        h_q = 1.28475e-3  # spur reference (docs/validation.md), section 2.3, arc mid
        height = np.where(half > h_q, half + h_q, 2 * half)
        area, moment = sections(tooth, papers_crack=True)
        assert_allclose(area, height * width, rtol=1e-5, atol=0)
        assert_allclose(moment, height**3 * width / 12, rtol=2e-5, atol=0)

    def test_a_pit_takes_an_eccentric_rectangle(self, tooth_of):
        """Eq. (15) as the parallel-axis theorem, section by section."""
        tooth, (sound_area, _) = (
            tooth_of(one("pitting")),
            sections(tooth_of(), papers_crack=True),
        )
        area, moment = sections(tooth, papers_crack=True)
        touched = np.flatnonzero(area < (1 - 1e-9) * sound_area)
        inside = touched[2:-2]
        half = tooth.cell_half_thickness[inside]
        width, pit_width, depth = tooth.gear.face_width, 10e-3, 0.5e-3
        expected = 2 * half * width - pit_width * depth
        centroid = -pit_width * depth * (half - depth / 2) / expected
        about_middle = (
            (2 * half) ** 3 * width / 12
            - pit_width * depth**3 / 12
            - pit_width * depth * (half - depth / 2) ** 2
        )
        assert_allclose(area[inside], expected, rtol=1e-12, atol=0)
        assert_allclose(
            moment[inside], about_middle - expected * centroid**2, rtol=1e-9, atol=0
        )
        x = tooth.cell_abscissa[touched]
        middle = 0.5 * (x.min() + x.max()) - tooth.profile.abscissa[0]
        assert_allclose([np.ptp(x), middle], [1e-3, 2.6220e-3], rtol=0, atol=2e-5)

    def test_a_pit_narrows_the_contact_where_it_lies(self, tooth_of):
        tooth = tooth_of(one("pitting"))
        rc = tooth.profile.curvature_radius
        width = bearing_width(tooth, rc)
        assert_allclose(np.unique(width), [10e-3, 20e-3], rtol=1e-12, atol=0)
        # spur reference (docs/validation.md), section 2.3: rc 6.2928 to 9.1975 mm
        narrow = rc[width < 20e-3]
        assert_allclose(
            [narrow[0], narrow[-1]], [6.2928e-3, 9.1975e-3], rtol=0, atol=0.03e-3
        )

    def test_even_wear_narrows_nothing(self, tooth_of):
        wear = one("wear", wear_profile=None, wear_depth_um=100)
        for faults, least in (([wear], 20e-3), ([one("pitting"), wear], 10e-3)):
            tooth = tooth_of(*faults)
            width = bearing_width(tooth, tooth.profile.curvature_radius)
            expected = [least, 20e-3]
            assert_allclose([width.min(), width.max()], expected, rtol=1e-12, atol=0)

    def test_loss_makes_sections_smaller(self, tooth_of):
        """Parallel axes over slices that differ: never more than what was there, by any fault."""
        sound = sections(tooth_of(), papers_crack=False)
        for kind in (kind for kind in KINDS if "material_loss" in CHANGES[kind]):
            weakened = sections(tooth_of(one(kind)), papers_crack=False)
            for result, whole in zip(weakened, sound, strict=True):
                assert np.all(result > 0)
                assert np.all(result <= whole * (1 + 1e-12))
                assert (result < whole).any()


class TestCrackFront:
    @staticmethod
    def crack(front, width):
        shape = {"crack_front": front, "crack_width_mm": width}
        return one("crack", crack_depth_mm=2.0, **shape)

    @pytest.mark.parametrize("width", [20.0, 13.7, 5.0])
    @pytest.mark.parametrize(
        ("front", "mean", "power"),
        [("straight", 1.0, 0), ("parabolic", 2 / 3, 0.5), ("linear", 1 / 2, 1)],
    )
    def test_depth_and_its_mean(self, xiamen, tooth_of, front, mean, power, width):
        fault = self.crack(front, width)
        depth = tooth_of(fault).cracks[0].depth
        assert_allclose(depth.mean(), 2e-3 * mean * width / FULL, rtol=1e-12, atol=0)
        severity = depth.mean() / fault.root_chord(xiamen.pair.pinion)
        result = fault.severity(xiamen.pair.pinion)
        assert_allclose(result, severity, rtol=1e-12, atol=0)
        edges = np.linspace(0.0, FULL, len(depth) + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        assert np.all(depth[edges[:-1] >= width] <= 0)
        # strips wholly in the crack; the end of a parabola is too steep for mid-strip values
        whole = edges[1:] <= 0.95 * width
        expected = 2e-3 * (1 - middle[whole] / width) ** power
        assert_allclose(depth[whole], expected, rtol=0.01, atol=0)
        assert depth.max() <= 2e-3 * (1 + 1e-12)

    def test_null_is_the_whole_face(self, tooth_of):
        for front in ("straight", "parabolic", "linear"):
            null, full = (
                tooth_of(self.crack(front, width)).cracks[0].depth
                for width in (None, FULL)
            )
            assert_allclose(null, full, rtol=1e-12, atol=0)

    def test_without_width_or_depth_there_is_none(self, tooth_of):
        for size in ({"crack_width_mm": 0.0}, {"crack_depth_mm": 0.0}):
            assert tooth_of(one("crack", **size)) is tooth_of()


class TestHoles:
    def test_a_pit_lies_where_it_is_put(self, tooth_of):
        position = {"pit_face_position_mm": 7, "pit_position_mm": 2}
        tooth = tooth_of(one("pitting", pit_width_mm=6, pit_length_mm=1, **position))
        deep = tooth.material_loss > 0
        assert_allclose(np.unique(tooth.material_loss), [0, 0.5e-3], rtol=1e-12, atol=0)
        assert_allclose(tooth.slice_edges, [0, 4e-3, 10e-3, 20e-3], rtol=1e-12, atol=0)
        assert deep.any(axis=1).tolist() == [False, True, False]
        height = on_flank(tooth)[deep.any(axis=0)] - tooth.profile.abscissa[0]
        assert_allclose([height[0], height[-1]], [1.5e-3, 2.5e-3], rtol=0, atol=2e-5)

    def test_an_elliptic_spall_has_its_area(self, tooth_of):
        tooth = tooth_of(one("spalling"))
        assert_allclose(
            lost_area(tooth), 0.25 * np.pi * 1.5e-3 * 8e-3, rtol=0.02, atol=0
        )
        longest = (tooth.material_loss > 0).sum(axis=1)
        assert longest.argmax() == pytest.approx(len(longest) // 2, abs=1)
        assert_allclose(longest, longest[::-1], rtol=0, atol=1)

    def test_holes_do_not_add_up_where_they_overlap(self, tooth_of):
        """The deeper one counts, in any order."""
        pit, spall = one("pitting"), one("spalling", spall_shape="rectangular")
        one_way, other = tooth_of(pit, spall), tooth_of(spall, pit)
        assert_allclose(one_way.slice_edges, other.slice_edges, rtol=0, atol=1e-15)
        assert_allclose(one_way.material_loss, other.material_loss, rtol=0, atol=0)
        assert one_way.material_loss.max() == pytest.approx(0.5e-3)

    def test_wear_takes_what_is_left_of_the_flank(self, tooth_of):
        worn = tooth_of(one("wear", wear_depth_um=30, wear_profile=[0, 1, 0.5]))
        share = np.linspace(0, 1, worn.material_loss.shape[1])
        expected = 30e-6 * np.interp(share, [0, 0.5, 1], [0, 1, 0.5])
        assert_allclose(worn.material_loss[0], expected, rtol=1e-9, atol=1e-18)
        wear = one("wear", wear_depth_um=30)
        once, twice = (
            tooth.material_loss for tooth in (tooth_of(wear), tooth_of(wear, wear))
        )
        assert_allclose(twice, 2 * once, rtol=1e-12)


@pytest.mark.parametrize("gear", GEARS)
class TestTips:
    def test_a_broken_tooth_ends_below_its_tip(self, xiamen, gear):
        body = getattr(xiamen.pair, gear)
        tooth = one("broken", gear=gear, broken_height_mm=1.5).apply(
            healthy_tooth(body), 0
        )
        gone = np.isinf(tooth.material_loss[0])
        cell = np.diff(on_flank(tooth)).max()
        assert_allclose(
            on_flank(tooth)[gone].min(), body.tip_radius - 1.5e-3, rtol=0, atol=cell
        )
        assert not gone[on_flank(tooth) < body.tip_radius - 1.5e-3].any()
        assert tooth.tip_curvature_radius == tooth.profile.curvature_radius[~gone].max()
        assert tooth.present

    def test_without_involute_there_is_no_tooth(self, xiamen, gear):
        body = getattr(xiamen.pair, gear)
        low = body.tip_radius - on_flank(healthy_tooth(body))[0]
        for height, present in (
            (low - 1e-4, True),
            (low + 1e-5, False),
            (tooth_height(body), False),
        ):
            tooth = one("broken", gear=gear, broken_height_mm=1e3 * height).apply(
                healthy_tooth(body), 0
            )
            assert tooth.present == present

    def test_a_triangular_chip_falls_off_along_the_face(self, xiamen, gear):
        body = getattr(xiamen.pair, gear)
        chip = one("chipped", gear=gear, chip_height_mm=2, chip_width_mm=8)
        tooth = chip.apply(healthy_tooth(body), 0)
        gone = np.isinf(tooth.material_loss)
        height = np.array(
            [
                body.tip_radius - on_flank(tooth)[row].min() if row.any() else 0.0
                for row in gone
            ]
        )
        expected = 2e-3 * np.maximum(1 - tooth.slice_middle / 8e-3, 0)
        # a node of the flank, and the arc of the tip, which is lower beside the centreline
        atol = np.diff(on_flank(tooth)).max() + body.tip_radius - on_flank(tooth)[-1]
        assert_allclose(height, expected, rtol=0, atol=atol)
        assert tooth.tip_curvature_radius == tooth.profile.curvature_radius[-1]

    def test_a_rectangular_chip_does_not(self, xiamen, gear):
        tooth = one("chipped", gear=gear, chip_shape="rectangular").apply(
            healthy_tooth(getattr(xiamen.pair, gear)), 0
        )
        assert_allclose(tooth.slice_edges, [0, 8e-3, 20e-3], rtol=1e-12, atol=0)
        assert np.isinf(tooth.material_loss).any(axis=1).tolist() == [True, False]


class TestDistributedPitting:
    @staticmethod
    def pits(xiamen, number=0, **changes):
        return one("distributed_pitting", **changes).apply(
            healthy_tooth(xiamen.pair.pinion), number
        )

    def test_the_seed_and_the_tooth_decide(self, xiamen):
        changes = ({}, {}, {"pit_seed": 1}, {"number": 1})
        losses = [self.pits(xiamen, **change).material_loss for change in changes]
        assert len({loss.tobytes() for loss in losses}) == 3
        assert_allclose(losses[0], losses[1], rtol=0, atol=0)

    def test_a_larger_share_has_all_pits_of_a_smaller(self, xiamen):
        series = [
            self.pits(xiamen, pitted_share=share).material_loss
            for share in (0.02, 0.05, 0.1, 0.3)
        ]
        for less, more in pairwise(series):
            assert np.all(more >= less)
            assert (more > less).any()

    @pytest.mark.parametrize(("number", "share"), [(0, 0.02), (7, 0.1), (0, 0.3)])
    def test_the_share_is_reached_within_one_pit(self, xiamen, share, number):
        tooth = self.pits(xiamen, number, pitted_share=share, diameter_scatter=0.2)
        pitted = lost_area(tooth) / flank_area(xiamen.pair.pinion)
        largest = tooth.material_loss.max() / 0.2  # diameters by the depth ratio
        a_pit = (largest + tooth.slice_width.max()) * (
            largest + np.diff(on_flank(tooth)).max()
        )
        assert share <= pitted < share + a_pit / flank_area(xiamen.pair.pinion)

    def test_pits_lie_in_their_region(self, xiamen):
        tooth = self.pits(xiamen, region_low=0.3, region_high=0.7, pitted_share=0.2)
        flank = on_flank(tooth)
        place = (flank - flank[0]) / np.ptp(flank)
        pitted = place[(tooth.material_loss > 0).any(axis=0)]
        reach = 0.5 * tooth.material_loss.max() / 0.2 / np.ptp(flank)
        assert 0.3 - reach <= pitted.min() < 0.4
        assert 0.6 < pitted.max() <= 0.7 + reach

    def test_sizes_are_log_normal_about_the_median(self, xiamen):
        even = self.pits(xiamen, diameter_scatter=0.0).material_loss
        assert_allclose(np.unique(even), [0, 0.1e-3], rtol=1e-12, atol=0)
        depths = np.unique(
            np.concatenate(
                [np.unique(self.pits(xiamen, k).material_loss) for k in range(12)]
            )
        )[1:]
        # deep pits cover shallow ones, so that the median seen lies a little above the one drawn
        assert 0.1e-3 < np.median(depths) < 0.13e-3
        assert 0.3 < np.log(depths).std() < 0.45
