"""Gears that differ between the units of a plan."""

import json

import numpy as np
import pytest
from refusals import refused

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

MANY = [
    "experiment=many_machines",
    "plan.n_records=64",
    "plan.n_units=8",
    "operating.duration_s=0.05",
]
DESIGN = (
    "params/gear.pinion.n_teeth",
    "params/gear.wheel.n_teeth",
    "params/gear.normal_module_mm",
    "params/quality.iso1328_grade",
)
UNIT_LOADS = (10.0, 50.0)  # N/mm2, of experiment=many_machines


def planned(*words):
    return make_plan(read_request([*MANY, *words]).config)


def designs(plan):
    return np.stack([plan.columns[name] for name in DESIGN], axis=1)


def machines(*words):
    """Rows of a plan, each with its machine."""
    config = read_request([*MANY, *words]).config
    plan, reader = make_plan(config), InputReader(config)
    rows = [plan.record(k) for k in range(plan.n_records)]
    return [(row, reader.inputs(row).machine) for row in rows]


def test_every_unit_has_one_design_of_its_own():
    plan = planned("plan.n_reference=1")
    units, designs_of = plan.columns["unit_id"], designs(plan)
    assert plan.is_reference.sum() == 8
    distinct = [np.unique(designs_of[units == unit], axis=0) for unit in set(units)]
    assert all(len(design) == 1 for design in distinct)
    assert len(np.unique(designs_of, axis=0)) == 8


def test_designs_follow_the_seed_and_the_unit_alone():
    plan, larger = planned(), planned("plan.n_records=200", "plan.n_units=25")
    for unit in set(plan.columns["unit_id"]):
        same = [designs(p)[p.columns["unit_id"] == unit][0] for p in (plan, larger)]
        np.testing.assert_array_equal(*same)
    assert not np.array_equal(designs(plan), designs(planned("seed=1")))


def test_shards_decide_no_row():
    plan, other = planned(), planned("dataset.records_per_shard=7")
    for name in plan.columns:
        if name not in ("shard", "row"):
            np.testing.assert_array_equal(plan.columns[name], other.columns[name])


def test_the_torque_of_a_unit_load():
    drawn = []
    for row, machine in machines():
        pinion, wheel = machine.pair.pinion, machine.pair.wheel
        width = min(pinion.face_width, wheel.face_width)
        force = row["torque_nm"] / pinion.pitch_radius
        drawn.append(1e-6 * force / (width * pinion.normal_module))
        assert row["torque_nm"] == row["params/operating.torque_nm"]
    assert UNIT_LOADS[0] <= min(drawn) < 15.0
    assert 30.0 < max(drawn) <= UNIT_LOADS[1]


def test_faults_have_the_sizes_of_the_gears_of_their_unit():
    teeth = set()
    for row, machine in machines():
        for fault in json.loads(row["faults_json"]):
            gear = machine.pair.gears[fault["gear"]]
            module, width = 1e3 * gear.normal_module, 1e3 * gear.face_width
            assert 0 <= fault["tooth"] < gear.n_teeth
            teeth.add(fault["tooth"])
            if fault["kind"] == "crack":
                assert 0.4 <= fault["crack_depth_mm"] / module <= 1.59
            if fault["kind"] == "pitting":
                assert 0.2 <= fault["pit_length_mm"] / module <= 0.7
                assert 0.2 <= fault["pit_width_mm"] / width <= 0.7
    assert max(teeth) > 23  # more than the gears of the option have


def test_sizes_that_are_not_drawn_follow_from_the_design():
    for row, machine in machines():
        module = row["params/gear.normal_module_mm"]
        gears = machine.pair.gears
        assert gears["pinion"].n_teeth == row["params/gear.pinion.n_teeth"]
        for gear in gears.values():
            assert 1e3 * gear.face_width == pytest.approx(10.0 * module)
        smaller = min(gears.values(), key=lambda gear: gear.n_teeth)
        assert smaller.bore_radius == pytest.approx(
            0.4 * smaller.pitch_radius, rel=0.01
        )


def test_gears_that_cannot_be_made_are_drawn_again():
    few = "{distribution: integers, low: 8, high: 22}"
    plan = planned(f"plan.vary={{gear.pinion.n_teeth: {few}}}")
    assert plan.columns["params/gear.pinion.n_teeth"].min() >= 18


SPUR_GEAR = (
    "plan.vary={gear.pinion.n_teeth: {distribution: integers, low: 18, high: 30}}"
)
SEPARATE = ["plan.machines=separate", "plan.n_gearboxes=null"]
LOAD = "{distribution: uniform, low: 2, high: 5, of: unit_load}"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            [SPUR_GEAR],
            "'gear.pinion.n_teeth' is drawn once a machine, but with plan.machines=crossed",
        ),
        (
            [SPUR_GEAR, *SEPARATE, "experiment=two_stage"],
            "a drive line has",
        ),
        (
            [SPUR_GEAR, *SEPARATE, "experiment=run_to_failure"],
            "'gear.pinion.n_teeth': every life has the gears of the configuration",
        ),
        (
            [
                "plan.vary={gear.rated_speed_rpm: {distribution: uniform, low: 1, high: 2}}"
            ],
            "'gear.rated_speed_rpm' is one value for a whole data set",
        ),
        (
            [f"plan.vary={{operating.speed_rpm: {LOAD}}}"],
            "plan.vary.operating.speed_rpm: of = 'unit_load'; only operating.torque_nm",
        ),
        (
            [f"plan.vary={{operating.torque_nm: {LOAD}}}", "experiment=two_stage"],
            "of = 'unit_load' is the load of one gear pair",
        ),
        (
            [
                *SEPARATE,
                "plan.vary={gear.pinion.n_teeth: {distribution: integers, low: 5, high: 9}}",
            ],
            "none of 100 designs drawn for machine 0 can be made",
        ),
        (
            [SPUR_GEAR, *SEPARATE, "operating.turns=5", "plan.fault_gear=drawn"],
            "operating.turns_of=pinion",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::gensig.plan.request.DerivedValueWarning")
def test_refusals(words, text):
    with refused(text):
        make_plan(read_request(["plan.classes=[healthy, crack]", *words]).config)
