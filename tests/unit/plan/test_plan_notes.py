"""Notes on a plan: units without records, impossible splits, and replaced settings."""

import pytest

from gensig.plan.make import make_plan
from gensig.plan.notes import plan_notes
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

FOUR = "plan.classes=[healthy,crack,pitting,missing_tooth]"
THREE = "plan.classes=[healthy,crack,missing_tooth]"
SPEEDS = "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}"


def said(*words):
    config = read_request([*words, "operating.duration_s=0.02"]).config
    return plan_notes(InputReader(config), make_plan(config))


def test_units_without_a_record_are_told():
    (line,) = said(
        THREE,
        "plan.n_units=4",
        "plan.n_gearboxes=2",
        "plan.n_records=12",
        "plan.n_repeats=2",
    )
    assert line == (
        "12 records are 2 conditions of 3 classes and 2 repeats: 2 of 4 machines are "
        "used; no split by machine is possible (the plan has 2 machines, and at least 3 are needed)"
    )


def test_a_split_by_machine_that_cannot_be_made_is_told():
    (line,) = said(FOUR, "plan.n_records=80", "plan.n_units=8", "plan.n_gearboxes=2")
    assert (
        line
        == "no split by gearbox is possible (the plan has 2 gearboxes, and at least 3 are needed)"
    )


def test_many_records_of_few_machines_are_told():
    (line,) = said("experiment=quickstart", "plan.n_records=820", "plan.n_units=20")
    assert line == (
        "820 records of 20 machines: 41 each; a model for machines never seen gains more from "
        "more machines: plan.n_units=205 has 4 each"
    )
    assert said("experiment=quickstart", "plan.n_records=800", "plan.n_units=20") == []


@pytest.mark.parametrize(
    "words", [("experiment=quickstart",), ("experiment=run_to_failure",)]
)
def test_a_plan_with_all_of_it_has_no_note(words):
    assert said(*words) == []


def test_what_overrides_undo_is_told():
    words = [
        "experiment=quickstart",
        "fault=crack",
        "operating.torque_nm=20",
        "fault.crack_depth_mm=1",
    ]
    assert read_request(words).notes == (
        "fault=crack replaces plan.classes [healthy, crack, pitting, missing_tooth]",
        "pinned, no longer varied: fault.crack_depth_mm = 1, operating.torque_nm = 20",
    )
    assert read_request(["experiment=quickstart", "operating.duration_s=1"]).notes == ()
    assert read_request(["experiment=quickstart", SPEEDS]).notes == ()
