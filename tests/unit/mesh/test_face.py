"""Contact over the face: the compiled envelope and load sharing against brute force, and rigid
flanks against both.
"""

from dataclasses import replace

import numpy as np
import pytest
from fault_cases import GEARS, on_path, one, side_of
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from gensig.faults.base import faulty_teeth
from gensig.geometry.contact import corner_gap_by_pinion
from gensig.geometry.tooth import healthy_tooth
from gensig.mesh._kernels import lower_envelope, share_over_slices
from gensig.mesh.face import bearing_width, is_nominal, slice_gaps
from gensig.mesh.local_contact import ContactLaw, linear_contact, weber_contact

UM = 1e-6


def gap_rows(system, *faults):
    """Gap beyond the sound tooth's of the first fault's tooth 0 at the table's nodes, and the
    table.
    """
    table = system.mesh_table(faults)
    side = side_of(table, faults[0].gear)
    return side.gap[side.kind[0]] - side.gap[0], table


class TestLowerEnvelope:
    @pytest.fixture(
        scope="class",
        params=[("rough", 1), ("smooth", 2), ("steps", 3), ("broken", 4)],
        ids=lambda own: own[0],
    )
    @classmethod
    def flank(cls, request):
        """Random deviations (slice, profile) on uneven nodes, contacts within and beyond them,
        their radii.
        """
        name, seed = request.param
        rng = np.random.default_rng(seed)
        arc = np.sort(rng.uniform(0.0, 6e-3, 80))
        back = rng.uniform(
            0.0,
            {"rough": 60, "smooth": 5, "steps": 0.1, "broken": 30}[name] * UM,
            (5, len(arc)),
        )
        if name == "smooth":
            back = np.cumsum(back - back.mean(axis=1, keepdims=True), axis=1)
        if name == "steps":
            back += 500 * UM * (rng.random(back.shape) < 0.3)
        if name == "broken":
            back[:, 60:] = np.inf
            back[:2, :15] = np.inf
        center = np.sort(rng.uniform(-0.5e-3, 6.5e-3, 60))
        return back, arc, center, rng.uniform(2e-3, 12e-3, len(center))

    @staticmethod
    def compiled(back, arc, center, radius):
        gap = np.empty((len(back), len(center)))
        lower_envelope(back, arc, center, radius, gap)
        return gap

    @staticmethod
    def brute(back, arc, center, radius, n_between):
        """The least over ``n_between`` points of every cell whose ends are both there."""
        share = np.linspace(0.0, 1.0, n_between)
        place = arc[:-1, None] + np.diff(arc)[:, None] * share
        with np.errstate(invalid="ignore"):
            height = back[:, :-1, None] + np.diff(back, axis=1)[..., None] * share
        height = np.where(
            np.isfinite(back[:, :-1, None]) & np.isfinite(back[:, 1:, None]),
            height,
            np.inf,
        )
        flat, where = height.reshape(len(back), -1), place.ravel()
        return np.stack(
            [
                (flat + (where - x) ** 2 / (2 * rho)).min(axis=1)
                for x, rho in zip(center, radius, strict=True)
            ],
            axis=1,
        )

    def test_it_is_the_minimum(self, flank):
        exact = self.compiled(*flank)
        # a parabola between two of the fine points rises by (step / 2)^2 / (2 rho) at most
        coarsest = np.diff(flank[1]).max() / 400
        atol = coarsest**2 / (8 * flank[3].min())
        found = self.brute(*flank, 401)
        assert np.all(exact <= found + 1e-18)
        assert_allclose(exact, found, rtol=0, atol=atol + 1e-15)

    def test_nodes_alone_are_not(self, flank):
        """What a minimum over the nodes would miss is far above the tolerance."""
        assert np.all(self.compiled(*flank) <= self.brute(*flank, 2) + 1e-18)
        missed = np.max(self.brute(*flank, 2) - self.compiled(*flank))
        assert missed > 1e-8

    def test_a_whole_flank_touches_where_it_should(self, flank):
        _, arc, center, radius = flank
        gap = self.compiled(np.zeros((1, len(arc))), arc, center, radius)[0]
        beyond = np.maximum(np.maximum(arc[0] - center, center - arc[-1]), 0.0)
        assert_allclose(gap, beyond**2 / (2 * radius), rtol=1e-12, atol=1e-18)

    def test_nothing_left_touches_nowhere(self, flank):
        _, arc, center, radius = flank
        assert np.isinf(
            self.compiled(np.full((1, len(arc)), np.inf), arc, center, radius)
        ).all()


class TestRigidFlanks:
    @pytest.mark.parametrize("depth_mm", [0.05, 0.5])
    def test_a_short_pit_over_the_whole_face_opens_22_um(self, xiamen, depth_mm):
        """The mate rides on its edges, 0.52 mm of flank to either side: x^2 / (2 rho) with rho 6.2
        mm at C.
        """
        gap, table = gap_rows(
            xiamen, one("pitting", tooth=0, pit_width_mm=20, pit_depth_mm=depth_mm)
        )
        assert_allclose(gap[on_path(table)].max(), 22 * UM, rtol=0, atol=2 * UM)
        assert_allclose(
            table.position[gap.argmax()], xiamen.pair.pitch_point, rtol=0, atol=0.1e-3
        )

    def test_a_shallow_one_no_more_than_its_depth(self, xiamen):
        gap, table = gap_rows(
            xiamen, one("pitting", tooth=0, pit_width_mm=20, pit_depth_mm=0.01)
        )
        assert_allclose(gap[on_path(table)].max(), 10 * UM, rtol=1e-9, atol=0)

    @pytest.mark.parametrize("height_mm", [0.2, 0.5, 1.0])
    def test_a_broken_pinion_tooth_touches_at_its_new_corner(self, xiamen, height_mm):
        """Rigid involutes of a pinion with a smaller addendum, exact, against the second-order
        envelope.
        """
        found, exact = self.corner(xiamen, "pinion", height_mm)
        seen = exact > 0.5 * UM
        assert seen.any()
        assert_allclose(found[seen], exact[seen], rtol=0.02, atol=0)

    @pytest.mark.parametrize("height_mm", [0.5, 1.0, 1.4])
    def test_a_broken_wheel_tooth_as_well(self, xiamen, height_mm):
        """Its corner meets the pinion's flank near the base circle, whose radius changes fast:
        third order counts.
        """
        found, exact = self.corner(xiamen, "wheel", height_mm)
        seen = (exact > 0.5 * UM) & (exact < 5 * UM)
        assert seen.any()
        assert_allclose(found[seen], exact[seen], rtol=0.07, atol=0)

    @staticmethod
    def corner(system, gear, height_mm):
        """Gap of the broken tooth on the path by the slices, and by a gear whose teeth all end
        where it does.
        """
        fault = one("broken", gear=gear, tooth=0, broken_height_mm=height_mm)
        tooth = faulty_teeth(system.pair, [fault])[gear, 0]
        body = tooth.gear
        tip = np.hypot(body.base_radius, tooth.tip_curvature_radius)
        addendum = (tip - body.pitch_radius) / body.normal_module - body.profile_shift
        clearance = body.clearance_coefficient + body.addendum_coefficient - addendum
        short = replace(
            body, addendum_coefficient=addendum, clearance_coefficient=clearance
        )
        pair = replace(system.pair, **{gear: short})
        gap, table = gap_rows(system, fault)
        from_its_own_start = (
            table.position
            + system.pair.start_curvature_radius
            - pair.start_curvature_radius
        )
        return gap[on_path(table)], corner_gap_by_pinion(pair, from_its_own_start)[
            on_path(table)
        ]

    @pytest.mark.parametrize("gear", GEARS)
    def test_a_tooth_without_deviation_has_no_gap(self, xiamen, gear):
        """More slices alone change nothing, on the path or beyond it."""
        body = getattr(xiamen.pair, gear)
        tooth = healthy_tooth(body).split(np.linspace(0, 20e-3, 8))
        assert is_nominal(tooth)
        tip = tooth.profile.curvature_radius[-1]
        at = np.linspace(0.5 * tip, 1.2 * tip, 50)
        assert_allclose(slice_gaps(tooth, at, np.full(50, 5e-3)), 0.0, rtol=0, atol=0)

    def test_a_gap_everywhere_is_that_gap_beyond_the_tip_too(self, xiamen):
        tooth = healthy_tooth(xiamen.pair.pinion).with_deviation(np.array([-7 * UM]))
        assert not is_nominal(tooth)
        at = tooth.profile.curvature_radius[-1] * np.linspace(0.5, 1.2, 50)
        assert_allclose(
            slice_gaps(tooth, at, np.full(50, 5e-3)), -7 * UM, rtol=1e-12, atol=0
        )


def shared(law: ContactLaw, slice_gap, width, load, bending):
    """Gap and compliance of the compiled sharing, (node,) each."""
    gap, compliance = np.empty_like(load), np.empty_like(load)
    unit = np.broadcast_to(bending, load.shape).copy()
    share_over_slices(
        slice_gap,
        width,
        load,
        law.factor,
        law.constant,
        law.log_weight,
        unit,
        gap,
        compliance,
    )
    return gap, compliance


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
    """Gaps (slice, node), widths (slice,) and loads (node,): from all slices in contact to the
    first alone.
    """
    rng = np.random.default_rng(8)
    gap = rng.uniform(-10 * UM, 10 * UM, (12, 10)) * np.geomspace(0.01, 3, 10)
    gap[rng.random(gap.shape) < 0.1] = np.inf
    return gap, rng.uniform(0.5e-3, 2.5e-3, 12), rng.uniform(200.0, 3000.0, 10)


def approach_by_root_finding(law, bending, node, slice_gap, width, load):
    """Approach at which slices that each follow the contact law with their own load carry it all,
    m.
    """

    def line_load(pressed):
        """Load per width q under which contact and slice give in by ``pressed``."""
        if pressed <= 0.0:
            return 0.0
        if law.log_weight == 0.0:
            return pressed / (law.factor * law.constant[node] + bending)

        def excess(log_q):
            return (
                np.exp(log_q) * (law.factor * (law.constant[node] - log_q) + bending)
                - pressed
            )

        # beyond it the law would give way under less load
        highest = law.constant[node] + bending / law.factor - 1.0
        return np.exp(
            highest
            if excess(highest) < 0
            else brentq(excess, -60.0, highest, xtol=1e-14, rtol=1e-14)
        )

    first = slice_gap.min()

    def missing(approach):
        return (
            sum(
                w * line_load(approach - g)
                for w, g in zip(width, slice_gap, strict=True)
            )
            - load
        )

    return brentq(missing, first, first + 300 * UM, xtol=1e-18, rtol=1e-12)


class TestShareOverSlices:
    def test_an_even_face_is_the_law(self, law, bending, random_face):
        """What bends with the slices is then what bends anyway, which is counted elsewhere."""
        _, width, load = random_face
        for even in (0.0, 3 * UM, -4 * UM):
            gap, compliance = shared(law, np.full((12, 10), even), width, load, bending)
            assert_allclose(gap, even, rtol=0, atol=0)
            assert_allclose(
                compliance, law.compliance(width.sum(), load), rtol=1e-9, atol=0
            )

    def test_half_a_face_is_the_law_of_half_the_width(self, law, bending):
        width, load = np.full(8, 2.5e-3), np.full(10, 925.0)
        expected = law.compliance(10e-3, load) + bending * (1 / 10e-3 - 1 / 20e-3)
        for lost in (np.inf, 1e-3):
            slice_gap = np.where(
                np.arange(8)[:, None] % 2 == 0, np.full((8, 10), UM), lost
            )
            gap, compliance = shared(law, slice_gap, width, load, bending)
            assert_allclose(gap, UM, rtol=0, atol=0)
            assert_allclose(compliance, expected, rtol=1e-9, atol=0)
            assert np.abs(compliance / law.compliance(20e-3, load) - 1).min() > 0.5

    def test_random_gaps_by_root_finding(self, law, bending, random_face):
        slice_gap, width, load = random_face
        gap, compliance = shared(law, slice_gap, width, load, bending)
        assert_allclose(gap, slice_gap.min(axis=0), rtol=0, atol=0)
        approach = gap + (compliance + bending / width.sum()) * load
        expected = [
            approach_by_root_finding(law, bending, k, slice_gap[:, k], width, load[k])
            for k in range(10)
        ]
        assert_allclose(
            approach, expected, rtol=1e-9 if law.log_weight == 0 else 1e-6, atol=0
        )
        touching = np.isfinite(slice_gap).sum(axis=0) - (slice_gap < approach).sum(
            axis=0
        )
        assert touching.min() == 0
        assert touching.max() >= 3

    def test_a_larger_gap_anywhere_never_lowers_the_approach(
        self, law, bending, random_face
    ):
        slice_gap, width, load = random_face
        rng = np.random.default_rng(2)
        for _ in range(200):
            more = slice_gap + rng.uniform(0, 3 * UM, slice_gap.shape) * (
                rng.random(slice_gap.shape) < 0.2
            )
            before, after = (
                gap + (c + bending / width.sum()) * load
                for gap, c in (
                    shared(law, g, width, load, bending) for g in (slice_gap, more)
                )
            )
            assert np.all(
                after
                >= before - (1e-9 if law.log_weight == 0 else 1e-8) * np.abs(before)
            )
            slice_gap = more

    def test_the_order_of_the_slices_is_nothing(self, law, bending, random_face):
        slice_gap, width, load = random_face
        order = np.random.default_rng(1).permutation(12)
        for found, expected in zip(
            shared(law, slice_gap[order], width[order], load, bending),
            shared(law, slice_gap, width, load, bending),
            strict=True,
        ):
            assert_allclose(found, expected, rtol=1e-9, atol=0)

    def test_more_load_brings_more_slices(self, law, bending, random_face):
        slice_gap, width, _ = random_face
        touching = [
            (slice_gap < gap + (compliance + bending / width.sum()) * load).sum()
            for load in (np.full(10, force) for force in (10.0, 300.0, 3000.0))
            for gap, compliance in [shared(law, slice_gap, width, load, bending)]
        ]
        assert touching[0] < touching[1] < touching[2]

    def test_slices_that_bend_by_themselves_share_more_evenly(self, law, random_face):
        """The softer the springs, the further they press in, and the more of them bear."""
        slice_gap, width, load = random_face
        touching = [
            (slice_gap < gap + (compliance + bending / width.sum()) * load).sum()
            for bending in (0.0, 4e-11, 4e-10)
            for gap, compliance in [shared(law, slice_gap, width, load, bending)]
        ]
        assert touching[0] < touching[1] < touching[2]


def test_bearing_width_narrows_as_the_paper_has_it(xiamen):
    fault = one("pitting", tooth=0, pit_width_mm=6)
    tooth = faulty_teeth(xiamen.pair, [fault])["pinion", 0]
    at = np.asarray(
        xiamen.pair.pinion_curvature(
            np.array([0.0, xiamen.pair.pitch_point, xiamen.pair.path_of_contact])
        )
    )
    assert_allclose(bearing_width(tooth, at), [20e-3, 14e-3, 20e-3], rtol=1e-12, atol=0)
