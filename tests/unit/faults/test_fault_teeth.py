"""Teeth that carry a fault, and several faults at once: rows of the mesh tables."""

import numpy as np
import pytest
from fault_cases import GEARS, KINDS, one, option, side_of
from numpy.testing import assert_allclose

from gensig.faults.base import faulty_teeth
from gensig.faults.registry import FAULTS, read_faults
from gensig.geometry.tooth import healthy_tooth

ALIKE = sorted(kind for kind in KINDS if FAULTS[kind].alike)
# distributed pits are drawn tooth by tooth, which takes seconds for 84 of them
FEW = {"distributed_pitting": {"pitted_share": 0.01}}
KEYS = ("compliance", "gap", "compliance_slope", "gap_slope", "present")


def some(kind, **changes):
    return one(kind, **{**FEW.get(kind, {}), **changes})


def rows(table, gear, tooth):
    side = side_of(table, gear)
    return [getattr(side, key)[side.kind[tooth]] for key in KEYS]


def assert_same_tooth(table, other, gear, tooth):
    for key, result, expected in zip(
        KEYS, rows(table, gear, tooth), rows(other, gear, tooth), strict=True
    ):
        assert_allclose(result, expected, atol=1e-18, err_msg=f"{key} of tooth {tooth}")


class TestSeveralTeeth:
    @pytest.mark.parametrize("kind", ALIKE)
    def test_teeth_alike_share_a_row(self, xiamen, kind):
        table = xiamen.mesh_table((one(kind, gear="wheel", tooth=[1, 5]),))
        assert np.flatnonzero(table.wheel.kind).tolist() == [1, 5]
        assert len(table.wheel.compliance) == 2
        assert_same_tooth(
            table, xiamen.mesh_table((one(kind, gear="wheel", tooth=5),)), "wheel", 5
        )
        assert not table.pinion.kind.any()

    @pytest.mark.parametrize("kind", ALIKE)
    def test_all_is_every_tooth(self, xiamen, kind):
        table = xiamen.mesh_table((one(kind, tooth="all"),))
        assert table.pinion.kind.tolist() == [1] * 23
        assert one(kind, tooth="all").teeth(xiamen.pair.wheel) == tuple(range(84))

    @pytest.mark.parametrize("gear", GEARS)
    def test_pits_are_drawn_for_each_tooth(self, xiamen, gear):
        table = xiamen.mesh_table(
            (some("distributed_pitting", gear=gear, tooth=[1, 5]),)
        )
        assert np.unique(side_of(table, gear).kind).tolist() == [0, 1, 2]
        alone = xiamen.mesh_table((some("distributed_pitting", gear=gear, tooth=5),))
        assert_same_tooth(table, alone, gear, 5)
        assert np.abs(rows(table, gear, 1)[0] - rows(table, gear, 5)[0]).max() > 1e-12

    def test_runout_moves_every_tooth_differently(self, xiamen):
        table = xiamen.mesh_table((one("runout", tooth=4),))
        assert sorted(table.pinion.kind.tolist()) == list(range(1, 24))
        assert faulty_teeth(xiamen.pair, [one("runout", tooth=4, eccentricity_um=0)])[
            "pinion", 0
        ] is healthy_tooth(xiamen.pair.pinion)

    @pytest.mark.parametrize(
        ("tooth", "first", "teeth"),
        [
            (3, 3, (3,)),
            ([5, 1], 1, (5, 1)),
            ("all", -1, tuple(range(23))),
            ([22], 22, (22,)),
        ],
    )
    def test_the_first_tooth_stands_for_them(self, xiamen, tooth, first, teeth):
        fault = one("crack", tooth=tooth)
        assert fault.first_tooth == first
        assert fault.teeth(xiamen.pair.pinion) == teeth

    def test_a_fault_can_be_a_key(self):
        """Tables are kept by their faults."""
        faults = {one("wear", tooth=teeth) for teeth in ([1, 5], [1, 5], "all")}
        assert len(faults) == 2


class TestCompound:
    @pytest.mark.parametrize("kind", KINDS)
    def test_on_different_teeth_each_is_itself(self, xiamen, kind):
        crack, other = one("crack", tooth=2), some(kind, tooth=9)
        both = xiamen.mesh_table((crack, other))
        assert_same_tooth(both, xiamen.mesh_table((other,)), "pinion", 9)
        if kind != "runout":  # which is on tooth 2 as well
            assert_same_tooth(both, xiamen.mesh_table((crack,)), "pinion", 2)
            assert np.flatnonzero(both.pinion.kind).tolist() == [2, 9]

    @pytest.mark.parametrize("kind", KINDS)
    def test_on_both_gears_each_is_itself(self, xiamen, kind):
        here, there = one("spalling", tooth=2), some(kind, gear="wheel", tooth=30)
        both = xiamen.mesh_table((here, there))
        assert_same_tooth(both, xiamen.mesh_table((here,)), "pinion", 2)
        assert_same_tooth(both, xiamen.mesh_table((there,)), "wheel", 30)
        assert np.flatnonzero(both.pinion.kind).tolist() == [2]

    def test_order_on_different_teeth_is_nothing(self, xiamen):
        faults = (
            one("crack", tooth=2),
            one("pitting", tooth=9),
            one("wear", gear="wheel", tooth="all"),
        )
        one_way, other = xiamen.mesh_table(faults), xiamen.mesh_table(faults[::-1])
        for gear, tooth in (("pinion", 2), ("pinion", 9), ("pinion", 0), ("wheel", 3)):
            assert_same_tooth(one_way, other, gear, tooth)

    def test_a_fault_on_some_of_the_worn_teeth(self, xiamen):
        """Teeth to which the same has happened stay one object, whatever came before."""
        faults = (
            one("wear", tooth="all"),
            one("crack", tooth=[3, 4]),
            one("wear", tooth=[4, 5], wear_depth_um=3),
        )
        table = xiamen.mesh_table(faults)
        kind = table.pinion.kind
        assert len(set(kind.tolist())) == 4
        assert kind[3] != kind[4] != kind[5]
        assert len({int(kind[k]) for k in range(23) if k not in (3, 4, 5)}) == 1
        assert (kind > 0).all()

    def test_loss_and_deviation_add_to_one_gap(self, xiamen):
        """Even wear of a misplaced tooth: the gaps add."""
        wear = one("wear", tooth=2, wear_profile=None, wear_depth_um=10)
        table = xiamen.mesh_table((wear, one("pitch_error", tooth=2)))
        gap = rows(table, "pinion", 2)[1]
        result = np.interp(xiamen.pair.pitch_point, table.position, gap)
        assert result == pytest.approx(30e-6)

    def test_a_cracked_missing_tooth_is_missing(self, xiamen):
        for faults in (
            (one("missing_tooth"), one("crack")),
            (one("pitting"), one("missing_tooth")),
        ):
            table = xiamen.mesh_table(faults)
            assert not table.pinion.present[table.pinion.kind[0]]

    def test_two_cracks_on_one_tooth(self, xiamen, machine):
        tension, compression = (
            one("crack", crack_depth_mm=0.8),
            one("crack", crack_depth_mm=0.8, crack_side="compression"),
        )
        both = faulty_teeth(xiamen.pair, (tension, compression))["pinion", 0]
        assert [crack.side for crack in both.cracks] == ["tension", "compression"]
        for system in (xiamen, machine({"mesh.crack": "paper"})):
            two, single = (
                system.mesh_table(own) for own in ((tension, compression), (tension,))
            )
            assert np.all(rows(two, "pinion", 0)[0] > rows(single, "pinion", 0)[0])

    def test_the_configuration_says_the_same(self, xiamen):
        missing = {"kind": "missing_tooth", "gear": "wheel", "tooth": [7]}
        parts = [{**option("crack"), "tooth": 2}, missing]
        table = xiamen.mesh_table(read_faults({"kind": "compound", "parts": parts}))
        assert np.flatnonzero(table.pinion.kind).tolist() == [2]
        assert np.flatnonzero(table.wheel.kind).tolist() == [7]
        assert table.wheel.present.tolist() == [True, False]
