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
    return one(
        kind,
        **{**FEW.get(kind, {}), **changes},
    )


@pytest.fixture(scope="module")
def table_of(xiamen):
    """Function that returns the mesh table of faults."""
    return lambda *faults: xiamen.mesh_table(faults)


def rows(table, gear, tooth):
    side = side_of(table, gear)
    return [getattr(side, key)[side.kind[tooth]] for key in KEYS]


def assert_same_tooth(table, other, gear, tooth):
    pairs = zip(
        rows(table, gear, tooth),
        rows(other, gear, tooth),
        strict=True,
    )
    for key, (result, expected) in zip(KEYS, pairs, strict=True):
        name = f"{key} of tooth {tooth}"
        assert_allclose(result, expected, rtol=1e-12, atol=1e-18, err_msg=name)


def changed(side):
    """Numbers of the teeth that are not sound."""
    return np.flatnonzero(side.kind).tolist()


class TestSeveralTeeth:
    @pytest.mark.parametrize("kind", ALIKE)
    def test_teeth_alike_share_a_row(self, table_of, kind):
        table = table_of(one(kind, gear="wheel", tooth=[1, 5]))
        assert changed(table.wheel) == [1, 5]
        assert len(side_of(table, "wheel").compliance) == 2

        alone = table_of(one(kind, gear="wheel", tooth=5))
        assert_same_tooth(table, alone, "wheel", 5)
        assert not table.pinion.kind.any()

    @pytest.mark.parametrize("kind", ALIKE)
    def test_all_is_every_tooth(self, xiamen, table_of, kind):
        fault = one(kind, tooth="all")
        assert table_of(fault).pinion.kind.tolist() == [1] * 23
        assert fault.teeth(xiamen.pair.wheel) == tuple(range(84))

    @pytest.mark.parametrize("gear", GEARS)
    def test_pits_are_drawn_for_each_tooth(self, table_of, gear):
        both, alone = (
            table_of(some("distributed_pitting", gear=gear, tooth=teeth))
            for teeth in ([1, 5], 5)
        )
        assert np.unique(side_of(both, gear).kind).tolist() == [0, 1, 2]
        assert_same_tooth(both, alone, gear, 5)

        first, fifth = (rows(both, gear, tooth)[0] for tooth in (1, 5))
        assert np.abs(first - fifth).max() > 1e-12

    def test_runout_moves_every_tooth_differently(self, xiamen, table_of):
        table = table_of(one("runout", tooth=4))
        assert sorted(table.pinion.kind.tolist()) == list(range(1, 24))

        nothing = one("runout", tooth=4, eccentricity_um=0)
        tooth = faulty_teeth(xiamen.pair, [nothing])["pinion", 0]
        assert tooth is healthy_tooth(xiamen.pair.pinion)

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
    def test_on_different_teeth_each_is_itself(self, table_of, kind):
        crack, other = one("crack", tooth=2), some(kind, tooth=9)
        both = table_of(crack, other)
        assert_same_tooth(both, table_of(other), "pinion", 9)
        if kind != "runout":  # which is on tooth 2 as well
            assert_same_tooth(both, table_of(crack), "pinion", 2)
            assert changed(both.pinion) == [2, 9]

    @pytest.mark.parametrize("kind", KINDS)
    def test_on_both_gears_each_is_itself(self, table_of, kind):
        here, there = one("spalling", tooth=2), some(kind, gear="wheel", tooth=30)
        both = table_of(here, there)
        assert_same_tooth(both, table_of(here), "pinion", 2)
        assert_same_tooth(both, table_of(there), "wheel", 30)
        assert changed(both.pinion) == [2]

    def test_order_on_different_teeth_is_nothing(self, table_of):
        worn = one("wear", gear="wheel", tooth="all")
        faults = one("crack", tooth=2), one("pitting", tooth=9), worn
        one_way, other = table_of(*faults), table_of(*faults[::-1])
        for gear, tooth in (("pinion", 2), ("pinion", 9), ("pinion", 0), ("wheel", 3)):
            assert_same_tooth(one_way, other, gear, tooth)

    def test_a_fault_on_some_of_the_worn_teeth(self, table_of):
        """Teeth to which the same has happened stay one object, whatever came before."""
        table = table_of(
            one("wear", tooth="all"),
            one("crack", tooth=[3, 4]),
            one("wear", tooth=[4, 5], wear_depth_um=3),
        )
        kinds = table.pinion.kind.tolist()
        assert len(set(kinds)) == 4

        worn, *others = kinds[2:6]
        assert len({worn, *others}) == 4
        assert kinds == [worn] * 3 + others + [worn] * 17
        assert min(kinds) > 0

    def test_loss_and_deviation_add_to_one_gap(self, xiamen, table_of):
        """Even wear of a misplaced tooth: the gaps add."""
        wear = one("wear", tooth=2, wear_profile=None, wear_depth_um=10)
        table = table_of(wear, one("pitch_error", tooth=2))
        gap = rows(table, "pinion", 2)[1]
        result = np.interp(
            xiamen.pair.pitch_point,
            table.position,
            gap,
        )

        assert_allclose(result, 30e-6)

    @pytest.mark.parametrize(
        "kinds",
        [("missing_tooth", "crack"), ("pitting", "missing_tooth")],
    )
    def test_a_cracked_missing_tooth_is_missing(self, table_of, kinds):
        pinion = table_of(*map(one, kinds)).pinion
        assert not pinion.present[pinion.kind[0]]

    def test_two_cracks_on_one_tooth(self, xiamen, machine):
        cracks = tuple(
            one("crack", crack_depth_mm=0.8, crack_side=side)
            for side in ("tension", "compression")
        )
        both = faulty_teeth(xiamen.pair, cracks)["pinion", 0]
        assert [crack.side for crack in both.cracks] == ["tension", "compression"]
        for system in (xiamen, machine({"mesh.crack": "paper"})):
            two, single = (
                rows(system.mesh_table(faults), "pinion", 0)[0]
                for faults in (cracks, cracks[:1])
            )
            assert np.all(two > single)

    def test_the_configuration_says_the_same(self, table_of):
        missing = {
            "kind": "missing_tooth",
            "gear": "wheel",
            "tooth": [7],
        }
        parts = [
            {**option("crack"), "tooth": 2},
            missing,
        ]
        table = table_of(*read_faults({"kind": "compound", "parts": parts}))

        assert changed(table.pinion) == [2]
        assert changed(table.wheel) == [7]
        assert table.wheel.present.tolist() == [True, False]
