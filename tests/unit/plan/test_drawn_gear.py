"""``plan.fault_gear``: faults on any gear, with the teeth and sizes of that gear."""

import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dataset.plan import plan_text
from gensig.driveline import loads
from gensig.errors import FaultError
from gensig.plan.draws import drawn_gears
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine

CLASSES = ("crack", "pitting", "missing_tooth", "compound")
WORDS = (
    f"plan.classes=[healthy,{','.join(CLASSES)}]",
    "plan.n_records=1000",
    "operating.duration_s=0.02",
    # The wheel is wider here, so that sizes in shares of the width tell the gears apart.
    "gear.pinion.face_width_mm=20",
    "gear.wheel.face_width_mm=30",
)
DRAWN = "plan.fault_gear=drawn"
GEARS = ("pinion", "wheel")
# Gears of another width weigh otherwise.
pytestmark = [
    pytest.mark.filterwarnings("ignore::gensig.plan.request.DerivedValueWarning"),
    pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning"),
]


def planned(*words):
    plan = make_plan(read_request([*WORDS, *words]).config)
    return {name: np.asarray(values) for name, values in plan.columns.items()}


def on(gear):
    """Words that give every fault, parts of the compound included, to one gear."""
    parts = (f"{{kind: {kind}, gear: {gear}}}" for kind in ("crack", "pitting"))
    return (f"fault.gear={gear}", f"fault.parts=[{', '.join(parts)}]")


@pytest.fixture(scope="module")
def drawn():
    return planned(*on("pinion"), DRAWN)


@pytest.fixture(scope="module")
def given():
    return {gear: planned(*on(gear)) for gear in GEARS}


def equal(ours, theirs):
    return (ours == theirs) | ((ours != ours) & (theirs != theirs))


@pytest.mark.parametrize("name", CLASSES)
def test_either_gear_is_as_likely(drawn, name):
    gear = drawn["fault_gear"][drawn["label_name"] == name]
    share = np.mean(gear == "wheel")
    assert abs(share - 0.5) < 4 * 0.5 / np.sqrt(len(gear))


def test_classes_draw_their_gears_apart(drawn):
    """Of two classes the gear agrees in about half of the conditions."""
    of_class = {
        name: drawn["fault_gear"][
            np.flatnonzero(drawn["label_name"] == name)[
                np.argsort(drawn["condition_id"][drawn["label_name"] == name])
            ]
        ]
        for name in CLASSES
    }
    agree = np.mean(of_class["crack"] == of_class["pitting"])
    assert abs(agree - 0.5) < 4 * 0.5 / np.sqrt(len(of_class["crack"]))


def test_a_fault_is_that_of_the_option_on_the_gear_drawn(drawn, given):
    """Its sizes, its teeth, its severity: all is as if the gear drawn were given."""
    sound = drawn["fault_gear"] == ""
    assert_array_equal(sound, drawn["label_name"] == "healthy")
    for gear in GEARS:
        mine = drawn["fault_gear"] == gear
        assert mine.any()
        for name, values in drawn.items():
            assert equal(values[mine], given[gear][name][mine]).all(), name
    width = "params/fault.pit_width_mm"
    pits = drawn["label_name"] == "pitting"
    on_wheel = pits & (drawn["fault_gear"] == "wheel")
    assert drawn[width][on_wheel].max() > 1.2 * drawn[width][pits & ~on_wheel].max()
    teeth = drawn["fault_tooth"]
    assert teeth[on_wheel].max() >= 23 > teeth[pits & ~on_wheel].max()


def test_parts_of_a_compound_fault_share_the_gear(drawn):
    for text in drawn["faults_json"][drawn["label_name"] == "compound"]:
        assert len({part["gear"] for part in json.loads(text)}) == 1


def test_nothing_else_changes(drawn, given):
    """Ids, conditions, order and starts are those of a plan of given gears."""
    for name, values in drawn.items():
        of_fault = name.startswith(("params/fault.", "fault", "severity"))
        assert of_fault or equal(values, given["pinion"][name]).all(), name


def test_a_set_without_faults_is_as_before():
    words = ("plan.classes=[healthy]", "plan.n_records=4", "operating.duration_s=0.02")
    plain, other = (
        make_plan(read_request([*words, *more]).config) for more in ((), (DRAWN,))
    )
    assert plan_text(plain) == plan_text(other)


def gears_of(*words):
    plan = make_plan(read_request(list(words)).config)
    return set(plan.columns["fault_gear"].tolist()) - {""}


LIFE_OF_A_LINE = (
    "experiment=two_stage",
    "life=crack_growth",
    "plan.classes=[healthy,crack]",
    "plan.n_records=null",
    "plan.n_repeats=1",
    "plan.n_units=8",
    "plan.vary={}",
    "life.snapshot_count=3",
    "life.n_setpoints=1",
    "operating.torque_nm=150",
)


def test_lives_and_drive_lines_draw_the_gear_too():
    assert gears_of("experiment=run_to_failure", DRAWN) == set(GEARS)
    assert gears_of("experiment=two_stage", DRAWN) == {
        *GEARS,
        "idler_gear_2",
        "output_gear",
    }


def test_a_list_limits_the_gears():
    two = ("idler_gear_2", "output_gear")
    words = ("experiment=two_stage", f"plan.fault_gear=[{','.join(two)}]")
    assert gears_of(*words) == set(two)
    plan = make_plan(read_request(list(words)).config).columns
    teeth = {gear: plan["fault_tooth"][plan["fault_gear"] == gear] for gear in two}
    # 48 and 80 teeth
    assert teeth["idler_gear_2"].max() < 48 <= teeth["output_gear"].max() < 80


def test_lives_of_a_line_grow_on_any_gear(monkeypatch):
    monkeypatch.setattr(loads, "SECONDS", 0.1)
    every = {*GEARS, "idler_gear_2", "output_gear"}
    grown = gears_of(*LIFE_OF_A_LINE, "plan.n_units=12", DRAWN)
    assert len(grown) > 2
    assert grown <= every
    given = "plan.fault_gear=as_given"
    output = gears_of(*LIFE_OF_A_LINE, given, "fault.gear=output_gear")
    assert output == {"output_gear"}


def test_lives_of_an_engine_grow_on_its_spur_gears():
    words = ("experiment=engine_broken_tooth", "life=crack_growth", DRAWN)
    config = read_request(list(words)).config
    gears = read_machine(config).gears
    assert all(
        gears[name].helix_angle == 0.0 for name in drawn_gears(InputReader(config))
    )
    assert set(GEARS) <= set(drawn_gears(InputReader(config))) < set(gears)


def test_turns_of_the_faulted_gear_are_those_of_the_slower_one():
    turns = ("operating.turns=20", "fault=crack")

    def duration(*words):
        return read_request([*turns, *words]).config["operating"]["duration_s"]

    assert duration(DRAWN) == duration("fault.gear=wheel") > duration()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            "plan.fault_gear=any",
            "= 'any'; allowed: as_given, drawn, or a list of gears",
        ),
        ("plan.fault_gear=[]", "= [] must name one gear or more, each once"),
        ("plan.fault_gear=[wheel,wheel]", "must name one gear or more, each once"),
        ("plan.fault_gear=[wheel,sun]", "lists 'sun'; allowed: pinion, wheel"),
        (
            "fault.vary={gear: {distribution: choice, values: [1]}}",
            "fault.vary.gear: plans draw gears by plan.fault_gear: drawn, or a list",
        ),
    ],
)
def test_other_words_are_refused(words, text):
    with refused(text):
        planned(words)


def test_the_gears_of_a_line_are_named_where_one_is_not_there():
    words = "experiment=two_stage", "plan.fault_gear=as_given"
    text = "fault.gear = 'sun'; allowed: pinion, wheel, idler_gear_2, output_gear"
    with refused(text, FaultError):
        gears_of(*words, "fault.gear=sun")
    assert gears_of(*words, "fault.gear=output_gear") == {"output_gear"}


def test_a_typed_gear_is_kept_where_an_option_draws_it():
    words = ("experiment=two_stage", "fault.gear=output_gear")
    request = read_request(list(words))
    assert "fault.gear is given: plan.fault_gear = as_given" in request.notes
    assert gears_of(*words) == {"output_gear"}
    assert len(gears_of(*words, DRAWN)) == 4


def test_a_compound_fault_has_several_gears():
    parts = "{kind: crack, gear: pinion}, {kind: missing_tooth, gear: output_gear}"
    words = (
        "experiment=two_stage",
        "fault=compound",
        f"fault.parts=[{parts}]",
    )
    plan = make_plan(read_request(list(words)).config).columns
    for text in plan["faults_json"]:
        assert [part["gear"] for part in json.loads(text)] == ["pinion", "output_gear"]
