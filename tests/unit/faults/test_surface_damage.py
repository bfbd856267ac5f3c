"""Surface damage: which teeth, nested holes, edges, roughness and dents."""

from itertools import pairwise

import numpy as np
import pytest
from fault_cases import GEARS, one
from numpy.testing import assert_array_equal

from gensig.faults.base import faulty_teeth
from gensig.geometry.tooth import healthy_tooth

UM = 1e-6
BARE = {"roughness_um": 0, "edge_height_um": 0, "dent_shoulder_um": 0}


def damaged(**changes):
    return one("surface_damage", **changes)


@pytest.fixture(scope="module")
def tooth_of(xiamen):
    """First spalled or first dented tooth of the pinion."""

    def make(what="spalled", **changes):
        fault = damaged(**changes)
        pinion = xiamen.pair.pinion
        spalled, dented = fault.damaged_teeth(pinion)
        number = (spalled if what == "spalled" else dented)[0]
        return fault.apply(healthy_tooth(pinion), number)

    return make


class TestWhichTeeth:
    @pytest.mark.parametrize("gear", GEARS)
    def test_about_a_third_of_the_teeth(self, xiamen, gear):
        body = getattr(xiamen.pair, gear)
        spalled, dented = damaged(gear=gear).damaged_teeth(body)
        assert len(spalled) == len(dented) == round(0.33 * body.n_teeth)
        assert not set(spalled) & set(dented)

    def test_the_rest_stays_sound(self, xiamen):
        fault, sound = damaged(), healthy_tooth(xiamen.pair.pinion)
        teeth = faulty_teeth(xiamen.pair, [fault])
        changed = {number for (_, number), tooth in teeth.items() if tooth is not sound}
        spalled, dented = fault.damaged_teeth(xiamen.pair.pinion)
        assert changed == {*spalled, *dented}

    def test_a_larger_share_has_the_teeth_of_a_smaller(self, xiamen):
        shares = (0.0, 0.05, 0.2, 0.6)
        for key, which in (("spalled_share", 0), ("dented_share", 1)):
            fixed = {"spalled_share": 0.1, "dented_share": 0.1}
            series = [
                set(
                    damaged(**{**fixed, key: share}).damaged_teeth(xiamen.pair.pinion)[
                        which
                    ]
                )
                for share in shares
            ]
            for less, more in pairwise(series):
                assert less < more

    def test_one_tooth_is_spalled(self, xiamen):
        fault = damaged(tooth=7)
        assert fault.damaged_teeth(xiamen.pair.pinion) == ((7,), ())

    def test_the_seed_decides(self, xiamen):
        pinion = xiamen.pair.pinion
        drawn = {damaged(damage_seed=seed).damaged_teeth(pinion) for seed in range(5)}
        assert len(drawn) == 5
        assert damaged().damaged_teeth(pinion) == damaged(damage=1).damaged_teeth(
            pinion
        )


class TestShape:
    def test_equal_seeds_are_equal_to_the_bit(self, tooth_of):
        for name in ("material_loss", "flank_deviation"):
            first, second = (getattr(tooth_of(), name) for _ in range(2))
            assert_array_equal(first, second)
            other = getattr(tooth_of(damage_seed=1), name)
            assert np.any(other != first)

    @pytest.mark.parametrize("what", ["spalled", "dented"])
    def test_holes_of_a_larger_damage_have_those_of_a_smaller(self, tooth_of, what):
        series = [tooth_of(what, damage=d).material_loss for d in (0.1, 0.4, 0.7, 1.0)]
        for less, more in pairwise(series):
            assert np.all(more >= less)
            assert (more > 0.0).sum() > (less > 0.0).sum()

    def test_the_spall_of_full_damage_is_extended(self, tooth_of):
        lost = tooth_of(damage=1.0).material_loss > 0.0
        width, height = lost.any(axis=1).mean(), lost.any(axis=0).mean()
        assert 0.3 <= width <= 0.6 + 1 / 40
        assert 0.15 <= height <= 0.5

    def test_nothing_stands_proud_without_edges_and_roughness(self, tooth_of):
        for what in ("spalled", "dented"):
            assert not tooth_of(what, **BARE).flank_deviation.any()

    def test_edges_and_shoulders_have_their_heights(self, tooth_of):
        bare = {"roughness_um": 0}
        rim = -tooth_of(damage=1.0, **bare).flank_deviation.min()
        shoulder = -tooth_of("dented", **bare).flank_deviation.min()
        assert 0.5 * 0.9 * 20 * UM < rim <= 20 * UM
        assert 0.9 * 5 * UM < shoulder <= 5 * UM

    def test_roughness_has_its_deviation_and_goes_with_the_damage(self, tooth_of):
        only = {"edge_height_um": 0, "spall_depth_mm": 0}
        full, half = (
            tooth_of(damage=damage, **only).flank_deviation for damage in (1.0, 0.5)
        )
        # straight between knots, which takes a third of the variance
        assert 0.75 * 3 * UM < full.std() < 0.9 * 3 * UM
        np.testing.assert_allclose(half, 0.5 * full)

    def test_every_dent_is_there(self, tooth_of):
        for n_dents in (1, 5):
            tooth = tooth_of(
                "dented", damage=1.0, n_dents=n_dents, dent_diameter_mm=0.3
            )
            assert 1 <= (tooth.material_loss > 0.0).any(axis=1).sum() <= n_dents
            assert tooth.material_loss.max() == pytest.approx(20 * UM)
