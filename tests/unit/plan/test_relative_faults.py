"""Lengths of faults that are drawn as shares of the gear that has them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.geometry.tooth_profile import root_curve_point
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.systems.registry import PairParts

PLAN = ("plan.n_records=48", "plan.n_units=4", "plan.classes=[healthy,crack,pitting]")


def drawn(*overrides):
    plan = make_plan(read_request([*PLAN, *overrides]).config)
    return {key: np.asarray(values) for key, values in plan.columns.items()}


def test_a_larger_gear_has_as_much_larger_faults():
    plain = drawn()
    larger = drawn("gear.normal_module_mm=4", "gear.pinion.face_width_mm=30")
    for name, size, factor in (
        ("crack", "crack_depth_mm", 2.0),
        ("pitting", "pit_length_mm", 2.0),
        ("pitting", "pit_width_mm", 1.5),
    ):
        mine = plain["label_name"] == name
        assert_allclose(
            larger[f"params/fault.{size}"][mine],
            factor * plain[f"params/fault.{size}"][mine],
            rtol=1e-12,
            atol=0,
        )


def test_a_length_in_millimetres_is_taken_as_it_is():
    spec = "{crack_depth_mm: {distribution: uniform, low: 1, high: 2}}"
    plan = make_plan(
        read_request(
            ["fault=crack", f"fault.vary={spec}", "gear.normal_module_mm=4"]
        ).config
    )
    depth = np.asarray(plan.columns["params/fault.crack_depth_mm"])
    assert 1.0 <= depth.min() <= depth.max() <= 2.0


@pytest.mark.parametrize(
    ("vary", "complaint"),
    [
        (
            "{crack_depth_mm: {distribution: uniform, low: 0, high: 1, of: tooth}}",
            "fault.vary.crack_depth_mm: of = 'tooth'; a length may be drawn as a share of "
            "normal_module, face_width",
        ),
        (
            "{crack_angle_deg: {distribution: uniform, low: 0, high: 1, of: face_width}}",
            "fault.vary.crack_angle_deg: of = 'face_width'; a length may",
        ),
        (
            "{crack_depth_mm: {distribution: uniform, low: a, high: 1, of: face_width}}",
            "fault.vary.crack_depth_mm: low, high, mean, std, values must be numbers",
        ),
    ],
)
def test_what_is_no_share_is_refused(vary, complaint):
    with refused(complaint):
        make_plan(read_request(["fault=crack", f"fault.vary={vary}"]).config)


def test_cracks_of_teeth_that_are_thin_at_the_root_stay_in_the_checked_range():
    config = read_request(
        ["gear.pinion.n_teeth=18", "plan.classes=[crack]", "plan.n_records=96"]
    ).config
    gear = PairParts(config).pair.pinion
    chord = 2e3 * root_curve_point(gear, "arc_mid")[1]
    depth = np.asarray(make_plan(config).columns["params/fault.crack_depth_mm"])
    assert 0.75 * chord < depth.max() <= 0.8 * chord < 1.59 * 2.0
