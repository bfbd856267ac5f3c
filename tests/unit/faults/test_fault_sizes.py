"""A fault of no size is healthy: it is known as such, and no record is labelled with its kind."""

import pytest
from fault_cases import CASES, KINDS, one
from refusals import refused

from gensig.errors import FaultError
from gensig.faults.base import zero_size
from gensig.faults.registry import FAULTS
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

SHORT = ("operating.duration_s=0.02", "plan.n_records=2", "plan.n_units=1")
ZEROED = [(kind, group) for kind, fault in FAULTS.items() for group in fault.sizes]


def planned(kind, group, *words):
    """The plan of a kind with every key of a group at 0."""
    zero = [f"fault.{key}=0" for key in group]
    return make_plan(read_request([f"fault={kind}", *SHORT, *zero, *words]).config)


@pytest.mark.parametrize("name", CASES)
def test_what_does_nothing_has_no_size_and_what_does_something_has_one(name):
    case = CASES[name]
    assert case.key in zero_size(case.fault(case.nothing, "pinion"))
    assert {zero_size(case.fault(value, "pinion")) for value in case.rising} == {()}


@pytest.mark.parametrize("kind", KINDS)
def test_every_option_has_a_size(kind):
    assert zero_size(one(kind)) == ()


@pytest.mark.parametrize(("kind", "group"), ZEROED)
def test_no_record_of_a_plan_is_labelled_with_a_fault_of_no_size(kind, group):
    with pytest.raises(FaultError) as refused:
        planned(kind, group)
    (line,) = str(refused.value).splitlines()
    assert line.startswith(" and ".join(f"fault.{key} = 0" for key in group))
    assert f"labelled {kind}" in line
    assert "fault=healthy" in line


def test_a_level_of_a_grid_that_is_0_is_refused_too():
    levels = "fault.vary={crack_depth_mm:{distribution:uniform,low:0,high:1,levels:3}}"
    grid = ("plan.design=grid", "plan.n_records=null", levels)
    with refused("crack_depth_mm = 0", FaultError):
        planned("crack", (), *grid)


def test_the_control_keeps_its_labels():
    plan = planned("crack", ("crack_depth_mm",), "plan.sham=true")
    assert set(plan.columns["label_name"].tolist()) == {"crack"}
