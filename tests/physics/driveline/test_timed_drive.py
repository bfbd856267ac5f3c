"""A drive that turns once a cycle keeps its teeth: its marks of timing say which meet; other pairs
are put on anew.
"""

import pytest

from gensig import load_system
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import draw_start
from gensig.record.machines import read_machine
from gensig.record.streams import Stream, stream


@pytest.fixture(scope="module")
def engine():
    return read_request(["experiment=engine_broken_tooth"]).config


def test_the_pump_gear_meets_the_same_tooth_at_the_same_firing(engine):
    machine = read_machine(engine)
    assert [machine.driven_tooth(tooth, 30) for tooth in (0, 7, 53)] == [0, 7, 53]
    start = draw_start(machine, stream(engine.seed, Stream.TWIN, 3))
    assert start.tooth_pinion == start.tooth_wheel


def test_a_pair_without_timing_is_put_on_anew():
    machine = load_system()
    assert machine.driven_tooth(7, 30) == 30


def test_every_row_of_the_plan_starts_in_time_and_faults_sit_on_any_tooth(engine):
    columns = make_plan(engine).columns
    assert (columns["start_tooth_pinion"] == columns["start_tooth_wheel"]).all()
    assert len(set(columns["start_tooth_wheel"].tolist())) > 20
    faulty = columns["fault_tooth"][columns["fault_tooth"] >= 0]
    assert len(set(faulty.tolist())) > 10
