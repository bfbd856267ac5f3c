"""Two labels for one signal are told, and plans do not draw teeth that never touch."""

import numpy as np
import pytest
import yaml
from refusals import refused

from gensig import load_system
from gensig.faults.broken import MissingTooth
from gensig.faults.flank_form import PitchError
from gensig.plan.equal_classes import equal_classes
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.plan.tooth_reach import passage_approach, tooth_reach
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine
from gensig.record.simulate import simulate_records

SYSTEMS = ("spur_pair", "helical_pair", "two_stage_gearbox")
SMALL = ("plan.n_records=16", "plan.n_units=4", "operating.duration_s=0.05")
FREE = "its tooth touches nothing, so the signal is that of missing_tooth"


def told(*words):
    config = read_request([*SMALL, *words]).config
    return equal_classes(InputReader(config), make_plan(config))


def back(machine, gear, distance):
    return passage_approach(
        machine, [PitchError(gear=gear, tooth=3, pitch_error=distance, limit=50e-6)]
    )


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_tooth_touches_up_to_its_reach(system):
    machine = load_system(f"system={system}")
    for gear in machine.gears:
        reach = tooth_reach(machine, gear)
        (missing,) = passage_approach(machine, [MissingTooth(gear=gear, tooth=0)])
        (beyond,), (within,) = (back(machine, gear, k * reach) for k in (1.02, 0.98))
        np.testing.assert_allclose(beyond, missing, rtol=1e-12)
        assert np.max(missing - within) > 1e-9


def test_the_reach_grows_with_the_torque():
    words = [
        ["system=spur_pair", f"operating.torque_nm={torque}"] for torque in (10, 60)
    ]
    low, high = (tooth_reach(load_system(*w), "pinion") for w in words)
    assert low < 0.9 * high


def records(*words):
    base = ("plan.n_records=1", "operating.duration_s=0.1", "sensing.snr_db=null")
    config = read_request([*base, *words]).config
    plan = make_plan(config)
    (record,) = simulate_records(InputReader(config), [plan.record(0)])
    return record.signals["acceleration"]


def test_beyond_its_reach_a_record_is_that_of_a_missing_tooth():
    """Within it the two differ: the check would see a label too much."""
    fixed = ("fault.vary={}", "plan.vary={}", "quality.iso1328_grade=null")
    pitch = ("fault=pitch_error", *fixed)
    reach = 1e6 * tooth_reach(load_system(), "pinion")
    missing = records("fault=missing_tooth", *fixed)
    level = missing.std()
    differences = [
        np.abs(records(*pitch, f"fault.pitch_error_um={k * reach}") - missing).max()
        for k in (1.5, 0.5)
    ]
    assert differences[0] < 1e-4 * level
    assert differences[1] > 0.1 * level


@pytest.mark.parametrize("system", SYSTEMS)
def test_no_plan_draws_a_tooth_that_never_touches(system):
    words = (f"system={system}", "fault=pitch_error")
    config = read_request([*SMALL, *words, "plan.n_records=60"]).config
    plan = make_plan(config)
    assert equal_classes(InputReader(config), plan) == []
    drawn = plan.columns["params/fault.pitch_error_um"]
    reach = 1e6 * tooth_reach(read_machine(config), "pinion")
    assert drawn.min() < -40.0
    assert 0.7 * reach < drawn.max() <= 0.8 * reach


def test_the_least_torque_of_the_plan_counts():
    words = ("fault=pitch_error", "plan.n_records=60")
    vary = "plan.vary={operating.torque_nm:{distribution:uniform,low:10,high:60}}"
    config = read_request([*SMALL, *words, vary]).config
    plan = make_plan(config)
    reader = InputReader(config)
    drawn = [plan.record(k) for k in range(plan.n_records)]
    for row in drawn[::6]:
        size = 1e-6 * row["params/fault.pitch_error_um"]
        assert size <= tooth_reach(reader.inputs(row).machine, "pinion")


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (("fault=pitch_error", "fault.pitch_error_um=40"), [FREE]),
        (("fault=pitch_error", "fault.pitch_error_um=-40"), []),
        (("fault=wear", "fault.wear_profile=[0,0]"), ["changes nothing"]),
        (("fault=missing_tooth",), []),
        (("fault=crack",), []),
        (("fault=pitch_error", "fault.pitch_error_um=40", "plan.sham=true"), []),
        (
            (
                "plan.classes=[healthy,pitch_error,missing_tooth]",
                "fault.pitch_error_um=40",
            ),
            [FREE],
        ),
        (("plan.classes=[healthy,pitch_error,missing_tooth]",), []),
    ],
)
def test_what_has_the_signal_of_another_is_told(words, texts):
    lines = told(*words)
    assert len(lines) == len(texts)
    for line, text in zip(lines, texts, strict=True):
        assert text in line
        assert "\n" not in line


def test_two_classes_with_one_fault_are_told(tmp_path):
    (tmp_path / "fault").mkdir()
    option = read_request(["fault=pitting"]).config["fault"]
    text = yaml.safe_dump({**option, "vary": {}})
    (tmp_path / "fault" / "other.yaml").write_text(text, encoding="utf-8")
    classes = "plan.classes=[healthy,pitting,other]"
    config = read_request(
        [*SMALL, classes, "fault.vary={}"], config_dir=tmp_path
    ).config
    (line,) = equal_classes(InputReader(config), make_plan(config))
    assert "fault=other: its largest fault has the signal of pitting" in line


def test_a_limit_needs_a_highest_value():
    vary = "fault.vary={pitch_error_um:{distribution:choice,values:[1,2],at_most_of_reach:0.5}}"
    config = read_request([*SMALL, "fault=pitch_error", vary]).config
    with refused("at_most_of_reach must be numbers"):
        make_plan(config)


def test_a_class_that_no_life_has_is_passed_over():
    """Two lives, of fewer classes than the plan has."""
    config = read_request(["experiment=run_to_failure", "plan.n_units=2"]).config
    plan = make_plan(config)
    assert len(set(plan.columns["label_name"])) < len(config["plan"]["classes"])
    assert equal_classes(InputReader(config), plan) == []
