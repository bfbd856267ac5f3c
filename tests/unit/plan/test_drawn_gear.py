"""``plan.fault_gear=drawn``: faults on either gear, with the teeth and sizes of that gear."""

import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gensig.dataset.plan import plan_text
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

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
pytestmark = pytest.mark.filterwarnings(
    "ignore::gensig.plan.request.DerivedValueWarning"
)


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


def test_lives_and_drive_lines_draw_the_gear_too():
    for experiment in ("run_to_failure", "two_stage"):
        words = [f"experiment={experiment}", DRAWN]
        plan = make_plan(read_request(words).config)
        gears = set(plan.columns["fault_gear"].tolist())
        assert gears - {""} == set(GEARS), experiment


def test_turns_of_the_faulted_gear_are_those_of_the_slower_one():
    turns = ("operating.turns=20", "fault=crack")

    def duration(*words):
        return read_request([*turns, *words]).config["operating"]["duration_s"]

    assert duration(DRAWN) == duration("fault.gear=wheel") > duration()


def test_another_word_is_refused():
    text = "plan.fault_gear = 'any'; allowed: as_given, drawn"
    with pytest.raises(ConfigError, match=text):
        planned("plan.fault_gear=any")
