"""Changes that each fault makes on its tooth, and no others."""

from itertools import pairwise

import numpy as np
import pytest
from fault_cases import FULL, GEARS, KINDS, one
from numpy.testing import assert_allclose, assert_array_equal

from gensig.faults.base import faulty_teeth
from gensig.faults.broken import tooth_height
from gensig.faults.flank_loss import flank_area
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh.face import bearing_width
from gensig.mesh.tooth_sections import sections

FACE = 20e-3
HOLES, FORM = {"slice_edges", "material_loss"}, {"flank_deviation"}
CHANGES = {
    "crack": {"cracks"},
    "pitting": HOLES,
    "spalling": HOLES,
    "distributed_pitting": HOLES,
    "surface_damage": HOLES | FORM,
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
    """A tooth with the given faults on it, one after the other."""

    def make(*faults, gear="pinion", number=3):
        tooth = healthy_tooth(getattr(xiamen.pair, gear))
        for fault in faults:
            tooth = fault.apply(tooth, number)
        return tooth

    return make


def on_flank(tooth):
    """Abscissae of the nodes of the involute, (profile,) m."""
    return tooth.profile.flank_abscissa


def lost_area(tooth):
    """Flank that is gone deeper than wear, by height on the centreline and face, m2."""
    cell = np.outer(
        tooth.slice_width,
        np.gradient(on_flank(tooth)),
    )
    return float(cell[tooth.material_loss > 0].sum())


def width_along(tooth):
    """Bearing width at every node of the profile, m."""
    return bearing_width(tooth, tooth.profile.curvature_radius)


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
        for name in ("material_loss", "flank_deviation", "slice_edges"):
            assert not getattr(tooth_of(), name).flags.writeable

    @pytest.mark.parametrize("kind", KINDS)
    def test_slices_cover_the_face(self, tooth_of, kind):
        tooth = tooth_of(one(kind, tooth=3))
        assert_array_equal(
            tooth.slice_edges[[0, -1]],
            [0.0, FACE],
        )
        assert tooth.slice_width.min() > 0
        assert_allclose(tooth.slice_width.sum(), FACE)

        shape = (len(tooth.slice_width), len(tooth.profile.curvature_radius))
        for values in (tooth.material_loss, tooth.flank_deviation):
            assert np.broadcast_shapes(values.shape, shape) == shape
        assert tooth.material_loss.min() >= 0

    def test_neighbors_stay_sound(self, xiamen):
        for kind, teeth in (("crack", [3]), ("runout", range(23))):
            faulty = faulty_teeth(
                xiamen.pair,
                [one(kind, tooth=3)],
            )
            assert set(faulty) == {("pinion", number) for number in teeth}


class TestThePapersSections:
    def test_a_crack_changes_nothing_but_the_papers_sections(self, tooth_of):
        sound, tooth = tooth_of(), tooth_of(one("crack"))
        assert_array_equal(width_along(tooth), width_along(sound))
        result, expected = (sections(t, papers_crack=False) for t in (tooth, sound))
        assert_array_equal(result, expected)

    def test_a_crack_keeps_half_plus_h_q(self, tooth_of):
        """Spur paper eqs. (11), (12): sections thicker than h_q keep h_x + h_q, the others all."""
        tooth = tooth_of(one("crack"))
        half = tooth.cell_half_thickness
        h_q = 1.28475e-3  # spur reference (docs/validation.md), section 2.3, arc mid
        height = np.where(
            half > h_q,
            half + h_q,
            2 * half,
        )
        area, moment = sections(tooth, papers_crack=True)

        assert_allclose(area, height * FACE, rtol=1e-5)
        assert_allclose(moment, height**3 * FACE / 12, rtol=2e-5)

    def test_a_pit_takes_an_eccentric_rectangle(self, tooth_of):
        """Eq. (15) as the parallel-axis theorem, section by section."""
        tooth = tooth_of(one("pitting"))
        sound_area, _ = sections(tooth_of(), papers_crack=True)
        area, moment = sections(tooth, papers_crack=True)
        touched = np.flatnonzero(area < (1 - 1e-9) * sound_area)
        inside = touched[2:-2]
        half = tooth.cell_half_thickness[inside]
        pit_width, depth = 10e-3, 0.5e-3
        pit = pit_width * depth
        arm = half - depth / 2
        left = 2 * half * FACE - pit
        whole_moment = (2 * half) ** 3 * FACE / 12
        pit_moment = pit * depth**2 / 12 + pit * arm**2
        expected = whole_moment - pit_moment - (pit * arm) ** 2 / left

        assert_allclose(area[inside], left)
        assert_allclose(moment[inside], expected)

        x = tooth.cell_abscissa[touched]
        middle = 0.5 * (x.min() + x.max()) - tooth.profile.abscissa[0]
        assert_allclose(
            [np.ptp(x), middle],
            [1e-3, 2.6220e-3],
            atol=2e-5,
        )

    def test_a_pit_narrows_the_contact_where_it_lies(self, tooth_of):
        tooth = tooth_of(one("pitting"))
        width = width_along(tooth)
        assert_allclose(np.unique(width), [10e-3, FACE])

        # spur reference (docs/validation.md), section 2.3
        narrow = tooth.profile.curvature_radius[width < FACE]
        expected = [6.2928e-3, 9.1975e-3]
        assert_allclose(
            narrow[[0, -1]],
            expected,
            atol=0.03e-3,
        )

    def test_even_wear_narrows_nothing(self, tooth_of):
        wear = one("wear", wear_profile=None, wear_depth_um=100)
        for faults, least in (([wear], FACE), ([one("pitting"), wear], 10e-3)):
            width = width_along(tooth_of(*faults))
            assert_allclose(
                [width.min(), width.max()],
                [least, FACE],
            )

    def test_loss_makes_sections_smaller(self, tooth_of):
        """Parallel axes over slices that differ: never more than what was there, by any fault."""
        sound = np.array(sections(tooth_of(), papers_crack=False))
        for kind in KINDS:
            if "material_loss" in CHANGES[kind]:
                left = np.array(
                    sections(tooth_of(one(kind, tooth=3)), papers_crack=False)
                )
                assert np.all(left > 0)
                assert np.all(left <= sound * (1 + 1e-12))
                assert (left < sound).any(axis=1).all()


class TestCrackFront:
    @staticmethod
    def crack(front, width):
        shape = {"crack_front": front, "crack_width_mm": width}
        return one("crack", crack_depth_mm=2.0, **shape)

    @pytest.mark.parametrize(
        "width",
        [20.0, 13.7, 5.0],
    )
    @pytest.mark.parametrize(
        ("front", "mean", "power"),
        [("straight", 1.0, 0), ("parabolic", 2 / 3, 0.5), ("linear", 1 / 2, 1)],
    )
    def test_depth_and_its_mean(self, xiamen, tooth_of, front, mean, power, width):
        fault = self.crack(front, width)
        depth = tooth_of(fault).cracks[0].depth
        assert_allclose(depth.mean(), 2e-3 * mean * width / FULL)

        pinion = xiamen.pair.pinion
        severity = depth.mean() / fault.root_chord(pinion)
        assert_allclose(fault.severity(pinion), severity)

        edges = np.linspace(
            0.0,
            FULL,
            len(depth) + 1,
        )
        middle = 0.5 * (edges[1:] + edges[:-1])
        assert np.all(depth[edges[:-1] >= width] <= 0)

        # strips wholly in the crack; the end of a parabola is too steep for mid-strip values
        whole = edges[1:] <= 0.95 * width
        expected = 2e-3 * (1 - middle[whole] / width) ** power
        assert_allclose(depth[whole], expected, rtol=0.01)
        assert depth.max() <= 2e-3 * (1 + 1e-12)

    @pytest.mark.parametrize(
        "front",
        ["straight", "parabolic", "linear"],
    )
    def test_null_is_the_whole_face(self, tooth_of, front):
        null, full = (tooth_of(self.crack(front, width)) for width in (None, FULL))
        assert_allclose(
            null.cracks[0].depth,
            full.cracks[0].depth,
        )

    @pytest.mark.parametrize("key", ["crack_width_mm", "crack_depth_mm"])
    def test_without_width_or_depth_there_is_none(self, tooth_of, key):
        assert tooth_of(one("crack", **{key: 0.0})) is tooth_of()


class TestHoles:
    def test_a_pit_lies_where_it_is_put(self, tooth_of):
        position = {"pit_face_position_mm": 7, "pit_position_mm": 2}
        tooth = tooth_of(one("pitting", pit_width_mm=6, pit_length_mm=1, **position))
        deep = tooth.material_loss > 0

        assert_allclose(
            np.unique(tooth.material_loss),
            [0, 0.5e-3],
        )
        assert_allclose(tooth.slice_edges, [0, 4e-3, 10e-3, FACE])
        assert deep.any(axis=1).tolist() == [False, True, False]

        height = on_flank(tooth)[deep.any(axis=0)] - tooth.profile.abscissa[0]
        assert_allclose(
            height[[0, -1]],
            [1.5e-3, 2.5e-3],
            atol=2e-5,
        )

    def test_an_elliptic_spall_has_its_area(self, tooth_of):
        tooth = tooth_of(one("spalling"))
        area = 0.25 * np.pi * 1.5e-3 * 8e-3
        assert_allclose(lost_area(tooth), area, rtol=0.02)

        longest = (tooth.material_loss > 0).sum(axis=1)
        assert_allclose(
            longest.argmax(),
            len(longest) // 2,
            atol=1,
        )
        assert_allclose(longest, longest[::-1], atol=1)

    def test_holes_do_not_add_up_where_they_overlap(self, tooth_of):
        """The deeper one counts, in any order."""
        pit, spall = one("pitting"), one("spalling", spall_shape="rectangular")
        one_way, other = tooth_of(pit, spall), tooth_of(spall, pit)
        assert_allclose(one_way.slice_edges, other.slice_edges, atol=1e-15)
        assert_array_equal(one_way.material_loss, other.material_loss)
        assert_allclose(one_way.material_loss.max(), 0.5e-3)

    def test_wear_takes_what_is_left_of_the_flank(self, tooth_of):
        wear = one(
            "wear",
            wear_depth_um=30,
            wear_profile=[0, 1, 0.5],
        )
        once, twice = (tooth_of(*[wear] * n).material_loss[0] for n in (1, 2))
        share = np.linspace(0, 1, once.size)
        expected = 30e-6 * np.interp(share, [0, 0.5, 1], [0, 1, 0.5])

        assert_allclose(once, expected, atol=1e-18)
        assert_allclose(twice, 2 * once)


@pytest.mark.parametrize("gear", GEARS)
class TestTips:
    @pytest.fixture
    def body(self, xiamen, gear):
        return getattr(xiamen.pair, gear)

    @pytest.fixture
    def tooth(self, tooth_of, gear):
        return lambda kind, **size: tooth_of(one(kind, gear=gear, **size), gear=gear)

    def test_a_broken_tooth_ends_below_its_tip(self, body, tooth):
        broken = tooth("broken", broken_height_mm=1.5)
        gone = np.isinf(broken.material_loss[0])
        flank, end = on_flank(broken), body.tip_radius - 1.5e-3

        assert end <= flank[gone].min() < end + np.diff(flank).max()

        radius = broken.profile.curvature_radius
        assert broken.tip_curvature_radius == radius[~gone].max()
        assert broken.present

    def test_without_involute_there_is_no_tooth(self, body, tooth):
        low = body.tip_radius - on_flank(healthy_tooth(body))[0]
        for height in (low - 1e-4, low + 1e-5, tooth_height(body)):
            broken = tooth("broken", broken_height_mm=1e3 * height)
            assert broken.present == (height < low)

    def test_a_triangular_chip_falls_off_along_the_face(self, body, tooth):
        chipped = tooth("chipped", chip_height_mm=2, chip_width_mm=8)
        gone, flank = np.isinf(chipped.material_loss), on_flank(chipped)
        lowest = np.where(gone, flank, body.tip_radius).min(axis=1)
        expected = 2e-3 * np.maximum(1 - chipped.slice_middle / 8e-3, 0)
        # a node of the flank, and the arc of the tip, which is lower beside the centreline
        atol = np.diff(flank).max() + body.tip_radius - flank[-1]

        assert_allclose(body.tip_radius - lowest, expected, atol=atol)
        assert chipped.tip_curvature_radius == chipped.profile.curvature_radius[-1]

    def test_a_rectangular_chip_does_not(self, tooth):
        chipped = tooth("chipped", chip_shape="rectangular")
        assert_allclose(chipped.slice_edges, [0, 8e-3, FACE])
        gone = np.isinf(chipped.material_loss)
        assert gone.any(axis=1).tolist() == [True, False]


class TestDistributedPitting:
    @pytest.fixture
    def pits(self, tooth_of):
        def make(number=0, **changes):
            return tooth_of(one("distributed_pitting", **changes), number=number)

        return make

    def test_the_seed_and_the_tooth_decide(self, pits):
        changes = ({}, {}, {"pit_seed": 1}, {"number": 1})
        losses = [pits(**change).material_loss for change in changes]
        assert len({loss.tobytes() for loss in losses}) == 3
        assert_array_equal(losses[0], losses[1])

    def test_a_larger_share_has_all_pits_of_a_smaller(self, pits):
        shares = (0.02, 0.05, 0.1, 0.3)
        series = [pits(pitted_share=share).material_loss for share in shares]
        for less, more in pairwise(series):
            assert np.all(more >= less)
            assert (more > less).any()

    @pytest.mark.parametrize(
        ("number", "share"),
        [(0, 0.02), (7, 0.1), (0, 0.3)],
    )
    def test_the_share_is_reached_within_one_pit(self, xiamen, pits, share, number):
        tooth = pits(number, pitted_share=share, diameter_scatter=0.2)
        largest = tooth.material_loss.max() / 0.2  # diameters by the depth ratio
        width = largest + tooth.slice_width.max()
        height = largest + np.diff(on_flank(tooth)).max()
        area = flank_area(xiamen.pair.pinion)

        assert share <= lost_area(tooth) / area < share + width * height / area

    def test_pits_lie_in_their_region(self, pits):
        tooth = pits(region_low=0.3, region_high=0.7, pitted_share=0.2)
        flank = on_flank(tooth)
        place = (flank - flank[0]) / np.ptp(flank)
        pitted = place[(tooth.material_loss > 0).any(axis=0)]
        reach = 0.5 * tooth.material_loss.max() / 0.2 / np.ptp(flank)

        assert 0.3 - reach <= pitted.min() < 0.4
        assert 0.6 < pitted.max() <= 0.7 + reach

    def test_sizes_are_log_normal_about_the_median(self, pits):
        even = pits(diameter_scatter=0.0).material_loss
        assert_allclose(np.unique(even), [0, 0.1e-3])

        losses = [np.unique(pits(number).material_loss) for number in range(12)]
        depths = np.unique(np.concatenate(losses))[1:]
        # deep pits cover shallow ones, so that the median seen lies a little above the one drawn
        assert 0.1e-3 < np.median(depths) < 0.13e-3
        assert 0.3 < np.log(depths).std() < 0.45
