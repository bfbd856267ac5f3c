"""Raised edges of pits, spalls, chips and breaks: nothing at height 0, a bump of their height."""

from itertools import pairwise

import numpy as np
import pytest
from fault_cases import deflection, on_path, one, side_of
from numpy.testing import assert_allclose, assert_array_equal

from gensig.dataset.plan import plan_text
from gensig.faults.flank_loss import N_STRIPS, Patch, patch_edge, patch_loss
from gensig.faults.registry import (
    FAULTS,
    LATER_KEYS,
    read_faults,
    with_later_keys,
    without_later_keys,
)
from gensig.geometry.tooth import healthy_tooth
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

UM = 1e-6
EDGES = {
    kind: dict(zip(keys, (20, 0.2), strict=True)) for kind, keys in LATER_KEYS.items()
}
SIZES = {"distributed_pitting": {"pitted_share": 0.02}}


def edged(kind, height=20.0, **changes):
    keys = LATER_KEYS[kind]
    edge = {keys[0]: height, keys[1]: 0.2}
    return one(kind, **{**SIZES.get(kind, {}), **edge, "tooth": 0, **changes})


@pytest.mark.parametrize("kind", LATER_KEYS)
class TestEveryEdge:
    def test_height_zero_is_the_fault_without_one(self, xiamen, kind):
        sound = healthy_tooth(xiamen.pair.pinion)
        plain = one(kind, **{**SIZES.get(kind, {}), "tooth": 0})
        flat = edged(kind, height=0.0)
        first, second = (fault.apply(sound, 0) for fault in (plain, flat))
        assert_array_equal(first.material_loss, second.material_loss)
        assert_array_equal(first.slice_edges, second.slice_edges)
        assert not second.flank_deviation.any()

    def test_it_is_as_high_as_it_is_said_and_no_hole_has_it(self, xiamen, kind):
        tooth = edged(kind).apply(healthy_tooth(xiamen.pair.pinion), 0)
        height = -tooth.flank_deviation
        assert height.min() == 0.0
        assert 0.8 * 20 * UM < height.max() <= 20 * UM
        assert not height[tooth.material_loss > 0.0].any()

    def test_it_takes_no_severity(self, xiamen, kind):
        pinion = xiamen.pair.pinion
        severity = edged(kind).severity(pinion)
        assert severity == edged(kind, height=0.0).severity(pinion)


@pytest.mark.parametrize("kind", sorted(LATER_KEYS.keys() - {"broken", "chipped"}))
def test_no_load_contact_is_made_earlier_by_its_height(xiamen, kind):
    gaps = []
    for height in (0.0, 5.0, 20.0):
        table = xiamen.mesh_table((edged(kind, height),))
        gaps.append(side_of(table, "pinion").gap[table.pinion.kind[0]])
    where = on_path(table)
    least = [gap[where].min() for gap in gaps]
    assert least[0] > -0.01 * UM
    assert_allclose(least[1:], [-5 * UM, -20 * UM], rtol=0.1)


@pytest.mark.parametrize("kind", ["broken", "chipped"])
def test_a_burr_at_the_break_touches_first(xiamen, kind):
    shape = (
        {"chip_shape": "rectangular", "chip_width_mm": 8} if kind == "chipped" else {}
    )
    with_burr, plain = (
        xiamen.mesh_table((edged(kind, height, **shape),)) for height in (20.0, 0.0)
    )
    row = with_burr.pinion.kind[0]
    earlier = side_of(plain, "pinion").gap[row] - side_of(with_burr, "pinion").gap[row]
    assert earlier.min() > -0.01 * UM
    assert 15 * UM < earlier.max() <= 20.1 * UM


@pytest.mark.parametrize("shape", ["rectangular", "elliptic"])
def test_an_edge_falls_evenly_from_the_rim(xiamen, shape):
    patch = Patch(
        shape=shape,
        length=1e-3,
        width=6e-3,
        depth=0.1e-3,
        abscissa=23e-3,
        face_position=10e-3,
        edge_height=10 * UM,
        edge_width=0.3e-3,
    )
    tooth = healthy_tooth(xiamen.pair.pinion).split(np.linspace(0.0, 20e-3, 401))
    edge = patch_edge(tooth, patch)
    assert not edge[patch_loss(tooth, patch) > 0.0].any()

    # in the middle of the face: distance along the height
    middle = int(np.abs(tooth.slice_middle - 10e-3).argmin())
    away = np.abs(tooth.profile.flank_abscissa - 23e-3) - 0.5e-3
    expected = np.where(away > 0.0, 10 * UM * np.clip(1 - away / 0.3e-3, 0, None), 0.0)
    assert_allclose(edge[middle], expected, atol=0.03 * UM)

    # at the height of the middle: distance along the face
    node = int(np.abs(tooth.profile.flank_abscissa - 23e-3).argmin())
    away = np.abs(tooth.slice_middle - 10e-3) - 3e-3
    expected = np.where(away > 0.0, 10 * UM * np.clip(1 - away / 0.3e-3, 0, None), 0.0)
    assert_allclose(edge[:, node], expected, atol=0.06 * UM)


def test_the_bump_survives_the_table(machine):
    """Height within 0.1 %, shape within 1 % of the height, at the usual number of nodes."""

    def gap(points):
        system = machine({"mesh.points_per_pitch": points})
        table = system.mesh_table((edged("pitting"),))
        return table.position, side_of(table, "pinion").gap[table.pinion.kind[0]]

    usual, fine = gap(512), gap(2048)
    inside = (fine[0] > 0.0) & (fine[0] < 10e-3)
    assert_allclose(usual[1].min(), fine[1].min(), rtol=1e-3)
    difference = np.interp(fine[0], *usual) - fine[1]
    assert np.abs(difference[inside]).max() < 0.01 * 20 * UM


def test_a_raised_edge_never_lets_the_pair_approach_further(xiamen):
    approaches = [
        deflection(xiamen, edged("pitting", h)) for h in (0.0, 5.0, 20.0, 50.0)
    ]
    for lower, higher in pairwise(approaches):
        assert np.all(higher <= lower + 0.01 * UM)


def test_round_holes_keep_their_strips(xiamen):
    tooth = edged("spalling").apply(healthy_tooth(xiamen.pair.pinion), 0)
    assert len(tooth.slice_edges) == N_STRIPS + 1 + 4


class TestLaterKeys:
    """At 0 they are no part of a configuration, so that sets of before stay the same."""

    def test_they_are_fields_with_default_zero(self):
        for kind, keys in LATER_KEYS.items():
            fault = one(kind)
            assert all(getattr(fault, key.rpartition("_")[0]) == 0.0 for key in keys)
            values = without_later_keys({**EDGES[kind], "kind": kind})
            assert with_later_keys({"kind": kind}).keys() == values.keys()
            assert FAULTS[kind] is type(fault)

    def test_zero_leaves_no_trace_in_a_plan(self):
        words = ["plan.n_records=3", "operating.duration_s=0.02"]
        request = read_request(["fault=pitting", *words])
        assert LATER_KEYS["pitting"][0] not in request.config["fault"]
        assert "edge" not in plan_text(make_plan(request.config))

    def test_a_height_that_is_typed_or_drawn_stays(self):
        typed = ["fault.pit_edge_height_um=20", "fault.pit_edge_width_mm=0.2"]
        fault = read_request(["fault=pitting", *typed]).config["fault"]
        assert (fault["pit_edge_height_um"], fault["pit_edge_width_mm"]) == (20, 0.2)
        drawn = {"kind": "pitting", "pit_edge_height_um": 0}
        drawn["vary"] = {"pit_edge_height_um": {}}
        assert without_later_keys(drawn) == drawn

    def test_parts_of_a_compound_are_faults_too(self):
        part = {"kind": "pitting", "pit_edge_height_um": 0, "tooth": 1}
        values = {"kind": "compound", "parts": [part, {"kind": "crack"}]}
        parts = without_later_keys(values)["parts"]
        assert parts == [{"kind": "pitting", "tooth": 1}, {"kind": "crack"}]

    def test_a_stored_fault_without_them_is_the_same_fault(self):
        fault = one("pitting")
        stored = without_later_keys(
            {"kind": "pitting", "gear": "pinion", "tooth": 0}
            | {"pit_length_mm": 1.0, "pit_width_mm": 10, "pit_depth_mm": 0.5}
            | dict.fromkeys(LATER_KEYS["pitting"], 0)
        )
        assert read_faults(stored) == (fault,)
