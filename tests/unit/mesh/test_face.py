"""Contact over the face: the compiled envelope and load sharing against brute force, and rigid
flanks against both.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import GEARS, on_path, one, side_of
from refusals import refused
from scipy.optimize import brentq

from gensig.faults.base import faulty_teeth
from gensig.geometry.contact import corner_gap_by_pinion
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh import face
from gensig.mesh._kernels import lower_envelope, share_over_slices
from gensig.mesh.face import bearing_width, flank_contacts, is_nominal, slice_gaps
from gensig.mesh.local_contact import ContactLaw, linear_contact, weber_contact

UM = 1e-6


def gap_rows(system, *faults):
    """Gap beyond the sound tooth's of the first fault's tooth 0 at the table's nodes, and the
    table.
    """
    table = system.mesh_table(faults)
    side = side_of(table, faults[0].gear)
    return side.gap[side.kind[0]] - side.gap[0], table


def gaps_at(tooth, curvature, radius=5e-3):
    """Gaps (slice, phase) of a tooth at curvature radii of contact, for a mate's flank."""
    radius = np.zeros_like(curvature) + radius
    return slice_gaps(tooth, flank_contacts(tooth.gear, curvature, radius))


class TestLowerEnvelope:
    @pytest.fixture(
        scope="class",
        params=["rough", "smooth", "steps", "broken", "pitted"],
    )
    @classmethod
    def flank(cls, request):
        """Random deviations (slice, profile) on uneven nodes; contacts and their radii."""
        name = request.param
        rng = np.random.default_rng(3)
        arc = np.sort(rng.uniform(0.0, 6e-3, 80))
        height = {
            "rough": 60,
            "smooth": 5,
            "steps": 0.1,
            "broken": 30,
            "pitted": 0.01,
        }[name] * UM
        back = rng.uniform(0.0, height, (5, len(arc)))
        if name == "smooth":
            back = np.cumsum(back - back.mean(axis=1, keepdims=True), axis=1)
        if name == "steps":
            back += 500 * UM * (rng.random(back.shape) < 0.3)
        if name == "pitted":  # floors of many nodes, which no mate reaches
            back[:, 20:47] += 300 * UM
            back[2:, 55:] -= 2 * UM
        if name == "broken":
            back[:, 60:] = np.inf
            back[:2, :15] = np.inf
        center = np.sort(rng.uniform(-0.5e-3, 6.5e-3, 60))
        return (
            back,
            arc,
            center,
            rng.uniform(2e-3, 12e-3, len(center)),
        )

    @staticmethod
    def compiled(back, arc, center, radius):
        gap = np.empty((len(back), len(center)))
        lower_envelope(back, arc, center, radius, gap)
        return gap

    @staticmethod
    def brute(back, arc, center, radius, n_between):
        """The least over ``n_between`` points of every cell whose ends are both there."""
        share = np.linspace(0.0, 1.0, n_between)
        at = (arc[:-1, None] + np.diff(arc)[:, None] * share).ravel()
        with np.errstate(invalid="ignore"):
            height = back[:, :-1, None] + np.diff(back, axis=1)[..., None] * share
        flat = np.nan_to_num(
            height.reshape(len(back), -1),
            nan=np.inf,
            posinf=np.inf,
        )
        rise = (at - center[:, None]) ** 2 / (2 * radius[:, None])
        return (flat[:, None] + rise).min(axis=2)

    def test_it_is_the_minimum(self, flank):
        exact = self.compiled(*flank)
        # a parabola between two of the fine points rises by (step / 2)^2 / (2 rho) at most
        coarsest = np.diff(flank[1]).max() / 400
        atol = coarsest**2 / (8 * flank[3].min())
        result = self.brute(*flank, 401)

        assert np.all(exact <= result + 1e-18)
        assert_close(exact, result, atol=atol + 1e-15)

    @staticmethod
    def everywhere(back, arc, center, radius):
        """The least of all nodes and of all cells, for one slice and one contact."""
        slope = np.diff(back) / np.diff(arc)
        x, away = -radius * slope, arc - center
        cells = back[:-1] + slope * (x - arc[:-1] + center) + x * x / (2.0 * radius)
        inside = (x > away[:-1]) & (x < away[1:])
        nodes = back + away * away / (2.0 * radius)
        return min(nodes.min(), cells[inside].min(initial=np.inf))

    def test_what_is_passed_over_would_not_have_touched(self):
        """Waves, and holes with an edge at every place of the nodes: equal to the bit."""
        rng = np.random.default_rng(5)
        arc = np.cumsum(rng.uniform(10.0, 14.0, 300)) * UM
        back = np.cumsum(rng.normal(0.0, 0.05, (40, 300)), axis=1) * UM
        for row, first in enumerate(rng.integers(0, 200, 40)):
            back[row, first : first + 60] += 5 * UM
        center = np.sort(rng.uniform(arc[0] - 50 * UM, arc[-1] + 50 * UM, 90))
        radius = rng.uniform(2e-3, 12e-3, 90)
        expected = [
            [self.everywhere(row, arc, *at) for at in zip(center, radius, strict=True)]
            for row in back
        ]
        np.testing.assert_array_equal(
            self.compiled(back, arc, center, radius), expected
        )

    def test_a_whole_flank_touches_where_it_should(self, flank):
        _, arc, center, radius = flank
        gap = self.compiled(np.zeros((1, len(arc))), arc, center, radius)[0]
        beyond = np.maximum(np.maximum(arc[0] - center, center - arc[-1]), 0.0)
        assert_close(gap, beyond**2 / (2 * radius), 1e-12, atol=1e-18)

    def test_nothing_left_touches_nowhere(self, flank):
        _, arc, center, radius = flank
        assert np.isinf(
            self.compiled(
                np.full((1, len(arc)), np.inf),
                arc,
                center,
                radius,
            )
        ).all()


class TestRigidFlanks:
    @pytest.mark.parametrize(
        ("depth_mm", "gap_um", "atol_um"),
        [(0.01, 10, 1e-8), (0.05, 22, 2), (0.5, 22, 2)],
    )
    def test_a_short_pit_opens_its_depth_or_22_um(
        self, xiamen, depth_mm, gap_um, atol_um
    ):
        """The mate rides on its edges, 0.52 mm to either side: x^2 / (2 rho), rho 6.2 mm at C."""
        pit = one(
            "pitting",
            tooth=0,
            pit_width_mm=20,
            pit_depth_mm=depth_mm,
        )
        gap, table = gap_rows(xiamen, pit)
        largest = gap[on_path(table)].max()

        assert_close(largest, gap_um * UM, atol=atol_um * UM)

        middle = table.position[gap > (1 - 1e-9) * largest].mean()
        assert_close(middle, xiamen.pair.pitch_point, atol=0.1e-3)

    @pytest.mark.parametrize(
        ("gear", "height_mm"),
        [
            ("pinion", 0.2),
            ("pinion", 0.5),
            ("pinion", 1.0),
            ("wheel", 0.5),
            ("wheel", 1.4),
        ],
    )
    def test_a_broken_tooth_touches_at_its_new_corner(self, xiamen, gear, height_mm):
        """The second-order envelope against exact involutes of a gear with a smaller addendum.

        The wheel's corner meets the pinion's flank near the base circle, whose radius changes
        fast: third order counts.
        """
        result, exact = self.corner(xiamen, gear, height_mm)
        most, rtol = {
            "pinion": (np.inf, 0.02),
            "wheel": (5 * UM, 0.07),
        }[gear]
        seen = (exact > 0.5 * UM) & (exact < most)

        assert seen.any()
        assert_close(result[seen], exact[seen], rtol)

    @staticmethod
    def corner(system, gear, height_mm):
        """Gap of the broken tooth on the path, and that of a gear whose teeth all end there."""
        fault = one(
            "broken",
            gear=gear,
            tooth=0,
            broken_height_mm=height_mm,
        )
        tooth = faulty_teeth(system.pair, [fault])[gear, 0]
        body = tooth.gear
        tip = np.hypot(body.base_radius, tooth.tip_curvature_radius)
        addendum = (tip - body.pitch_radius) / body.normal_module - body.profile_shift
        clearance = body.clearance_coefficient + body.addendum_coefficient - addendum
        heights = {
            "addendum_coefficient": addendum,
            "clearance_coefficient": clearance,
        }
        pair = replace(system.pair, **{gear: replace(body, **heights)})
        gap, table = gap_rows(system, fault)
        later = system.pair.start_curvature_radius - pair.start_curvature_radius
        exact = corner_gap_by_pinion(pair, table.position + later)
        return gap[on_path(table)], exact[on_path(table)]

    @pytest.mark.parametrize("gear", GEARS)
    def test_a_tooth_without_deviation_has_no_gap(self, xiamen, gear):
        """More slices alone change nothing, on the path or beyond it."""
        body = getattr(xiamen.pair, gear)
        tooth = healthy_tooth(body).split(np.linspace(0, 20e-3, 8))
        assert is_nominal(tooth)

        tip = tooth.profile.curvature_radius[-1]
        at = np.linspace(0.5 * tip, 1.2 * tip, 50)
        assert_close(gaps_at(tooth, at), 0.0)

    def test_a_gap_everywhere_is_that_gap_beyond_the_tip_too(self, xiamen):
        tooth = healthy_tooth(xiamen.pair.pinion).with_deviation(np.array([-7 * UM]))
        assert not is_nominal(tooth)
        at = tooth.profile.curvature_radius[-1] * np.linspace(0.5, 1.2, 50)
        gaps = gaps_at(tooth, at)
        assert_close(gaps, -7 * UM, 1e-12)


class TestKeptEnvelopes:
    """Envelopes kept by content: the bits of those computed anew, in bounded memory."""

    @pytest.fixture
    def at(self, xiamen):
        """Curvature radii of contact, on the flank and beyond its tip."""
        tip = healthy_tooth(xiamen.pair.pinion).profile.curvature_radius[-1]
        return tip * np.linspace(0.5, 1.2, 50)

    @pytest.fixture
    def teeth(self, xiamen):
        """A tooth with a wavy flank for each seed."""
        sound = healthy_tooth(xiamen.pair.pinion)
        n_profile = len(sound.profile.curvature_radius)

        def wavy(seed):
            waves = np.random.default_rng(seed).uniform(0.0, 20 * UM, (2, n_profile))
            return sound.split(np.array([8e-3])).with_deviation(waves)

        return wavy

    @staticmethod
    def anew(tooth, at, radius):
        """Gaps with an empty store."""
        face._envelope.cache_clear()
        return gaps_at(tooth, at, radius)

    def test_kept_and_computed_anew_are_equal_bits(self, teeth, at):
        radius = np.full(len(at), 5e-3)
        computed = self.anew(teeth(1), at, radius)
        n_computed = face._envelope.cache_info().misses
        np.testing.assert_array_equal(gaps_at(teeth(1), at, radius), computed)
        assert face._envelope.cache_info().misses == n_computed == 2

    @pytest.mark.parametrize("changed", ["deviation", "curvature", "radius", "outline"])
    def test_what_was_kept_of_other_flanks_is_not_served(self, teeth, at, changed):
        """One number of one input is another by a thousandth: in place, so that no object is.

        It is at the node of the flank that stands out furthest, or at a contact.
        """
        tooth, radius = teeth(1), np.full(len(at), 5e-3)
        curvature = tooth.profile.curvature_radius.copy()
        tooth = replace(
            tooth, profile=replace(tooth.profile, curvature_radius=curvature)
        )
        before = self.anew(tooth, at, radius)
        inputs = {
            "deviation": tooth.flank_deviation[1],
            "curvature": at,
            "radius": radius,
            "outline": curvature,
        }
        half = len(curvature) // 2
        node = half + np.argmin(tooth.flank_deviation[1, half:])
        place = {"deviation": node, "outline": node}.get(changed, len(at) // 2)
        inputs[changed][place] *= 1.001
        served = gaps_at(tooth, at, radius)
        np.testing.assert_array_equal(served, self.anew(tooth, at, radius))
        assert (served != before).any()

    def test_writing_into_a_result_changes_no_later_one(self, teeth, at):
        radius = np.full(len(at), 5e-3)
        first = self.anew(teeth(1), at, radius)
        expected = first.copy()
        first[:] = 0.0
        np.testing.assert_array_equal(gaps_at(teeth(1), at, radius), expected)

    def test_contacts_keep_the_content_that_they_are_known_by(self, xiamen, at):
        radius = np.full(len(at), 5e-3)
        contacts = flank_contacts(xiamen.pair.pinion, at, radius)
        for values in (contacts.center, contacts.relative_radius):
            with refused("read-only", ValueError):
                values[0] = 0.0
        at[0], radius[0] = at[1], 6e-3
        kept = [np.frombuffer(values) for values in contacts.content]
        np.testing.assert_array_equal(kept, [contacts.center, contacts.relative_radius])

    def test_threads_share_a_bounded_store(self, teeth, at):
        most = face._envelope.cache_info().maxsize
        radius, seeds = np.full(len(at), 5e-3), np.arange(most) % (most * 2 // 3)
        expected = [self.anew(teeth(seed), at, radius) for seed in seeds]
        face._envelope.cache_clear()
        with ThreadPoolExecutor(4) as pool:
            gaps = pool.map(lambda seed: gaps_at(teeth(seed), at, radius), seeds)
        np.testing.assert_array_equal(list(gaps), expected)
        assert face._envelope.cache_info().currsize == most


def shared(law: ContactLaw, slice_gap, width, load, bending):
    """Gap and compliance of the compiled sharing, (node,) each."""
    gap = np.empty_like(load)
    compliance = np.empty_like(load)
    terms = (
        law.factor,
        law.constant,
        law.log_weight,
        np.full_like(load, bending),
    )
    share_over_slices(slice_gap, width, load, *terms, gap, compliance)
    return gap, compliance


def approach_of(law, slice_gap, width, load, bending):
    gap, compliance = shared(law, slice_gap, width, load, bending)
    return gap + (compliance + bending / width.sum()) * load


def test_a_repeated_node_is_shared_as_one_that_stands_alone(xiamen):
    """Nodes beyond the path have the inputs of its end, and the answer too, to the bit."""
    at = np.array([0.3, 0.3, 0.3, 0.6, 0.6]) * xiamen.pair.path_of_contact
    law = weber_contact(xiamen.pair, at, xiamen.material)
    rng = np.random.default_rng(3)
    gaps = np.repeat(rng.uniform(0, 2e-6, (4, 2)), [3, 2], axis=1)
    gaps[2, 2] *= 0.5  # the third node is another one
    load = np.array([500.0, 500.0, 500.0, 800.0, 900.0])
    width = np.full(4, 4e-3)
    together = np.array(shared(law, gaps, width, load, 0.0))
    for node in range(len(at)):
        alone = weber_contact(xiamen.pair, at[[node]], xiamen.material)
        expected = shared(alone, gaps[:, [node]], width, load[[node]], 0.0)
        np.testing.assert_array_equal(together[:, [node]], expected)
    assert together[1, 0] == together[1, 1] != together[1, 2]


@pytest.fixture(scope="module", params=["linear", "weber"])
def law(request, xiamen):
    """The two contact laws at ten positions of the path."""
    at = np.linspace(0, xiamen.pair.path_of_contact, 10)
    if request.param == "linear":
        return linear_contact(at, xiamen.material)
    return weber_contact(xiamen.pair, at, xiamen.material)


@pytest.fixture(scope="module", params=[0.0, 4e-11], ids=["whole", "by_slice"])
def bending(request):
    """Compliance of unit width that is the slice's own, m2/N: none, or about that of two teeth."""
    return request.param


@pytest.fixture(scope="module")
def random_face():
    """Gaps (slice, node), widths (slice,), loads (node,): all slices in contact to only one."""
    rng = np.random.default_rng(8)
    gap = rng.uniform(-10 * UM, 10 * UM, (12, 10)) * np.geomspace(0.01, 3, 10)
    gap[rng.random(gap.shape) < 0.1] = np.inf
    return (
        gap,
        rng.uniform(0.5e-3, 2.5e-3, 12),
        rng.uniform(200.0, 3000.0, 10),
    )


def approach_by_root_finding(law, bending, node, slice_gap, width, load):
    """Approach at which slices that follow the contact law carry the whole load, m."""

    def line_load(pressed):
        """Load per width q under which contact and slice deflect by ``pressed``."""
        if pressed <= 0.0:
            return 0.0
        if law.log_weight == 0.0:
            return pressed / (law.factor * law.constant[node] + bending)

        def excess(log_q):
            unit = law.factor * (law.constant[node] - log_q) + bending
            return np.exp(log_q) * unit - pressed

        # beyond it the law would soften as the load falls
        highest = law.constant[node] + bending / law.factor - 1.0
        if excess(highest) < 0:
            return np.exp(highest)
        return np.exp(brentq(excess, -60.0, highest, xtol=1e-14, rtol=1e-14))

    def missing(approach):
        return width @ [line_load(approach - gap) for gap in slice_gap] - load

    first = slice_gap.min()
    return brentq(missing, first, first + 300 * UM, xtol=1e-18, rtol=1e-12)


class TestShareOverSlices:
    def test_an_even_face_is_the_law(self, law, bending, random_face):
        """The bending of the slices is then that of the whole tooth, which is not counted here."""
        _, width, load = random_face
        for even in (0.0, 3 * UM, -4 * UM):
            gap, compliance = shared(law, np.full((12, 10), even), width, load, bending)
            assert_close(gap, even)
            expected = law.compliance(width.sum(), load)
            assert_close(compliance, expected, 1e-9)

    def test_half_a_face_is_the_law_of_half_the_width(self, law, bending):
        width = np.full(8, 2.5e-3)
        load = np.full(10, 925.0)
        expected = law.compliance(10e-3, load) + bending * (1 / 10e-3 - 1 / 20e-3)
        for lost in (np.inf, 1e-3):
            slice_gap = np.tile([[UM], [lost]], (4, 10))
            gap, compliance = shared(law, slice_gap, width, load, bending)
            assert_close(gap, UM)
            assert_close(compliance, expected, 1e-9)
            assert np.abs(compliance / law.compliance(20e-3, load) - 1).min() > 0.5

    def test_random_gaps_by_root_finding(self, law, bending, random_face):
        slice_gap, width, load = random_face
        gap, _ = shared(law, slice_gap, width, load, bending)
        assert_close(gap, slice_gap.min(axis=0))

        approach = approach_of(law, slice_gap, width, load, bending)
        expected = [
            approach_by_root_finding(law, bending, k, slice_gap[:, k], width, load[k])
            for k in range(10)
        ]
        rtol = {0.0: 1e-9, 1.0: 1e-6}[law.log_weight]

        assert_close(approach, expected, rtol)

        lifted = (np.isfinite(slice_gap) & (slice_gap >= approach)).sum(axis=0)
        assert lifted.min() == 0
        assert lifted.max() >= 3

    def test_a_node_does_not_depend_on_the_nodes_before_it(
        self, law, bending, random_face
    ):
        """The slices are sorted from the last node's order, equal gaps by their index."""
        slice_gap, width, load = random_face
        equal = np.round(slice_gap / UM) * UM
        assert min(len(np.unique(column)) for column in equal.T) < len(equal)

        together = shared(law, equal, width, load, bending)
        for k in range(len(load)):
            alone = ContactLaw(
                factor=law.factor,
                constant=law.constant[k : k + 1],
                log_weight=law.log_weight,
            )
            here = slice(k, k + 1)
            result = shared(alone, equal[:, here], width, load[here], bending)
            np.testing.assert_array_equal(result, np.array(together)[:, here])

    def test_the_order_of_slices_across_the_face_does_not_matter(
        self, law, bending, random_face
    ):
        slice_gap, width, load = random_face
        gap, compliance = shared(law, slice_gap, width, load, bending)
        for order in (np.arange(12)[::-1], np.random.default_rng(5).permutation(12)):
            faces = slice_gap[order], width[order]
            moved_gap, moved = shared(law, *faces, load, bending)
            np.testing.assert_array_equal(moved_gap, gap)
            assert_close(moved, compliance, 1e-11)


def test_bearing_width_narrows_as_the_paper_has_it(xiamen):
    fault = one("pitting", tooth=0, pit_width_mm=6)
    tooth = faulty_teeth(xiamen.pair, [fault])["pinion", 0]
    pair = xiamen.pair
    at = pair.pinion_curvature(np.array([0.0, pair.pitch_point, pair.path_of_contact]))
    assert_close(bearing_width(tooth, at), [20e-3, 14e-3, 20e-3], 1e-12)
