"""Plans that make no sense are told so, once, and shipped ones are not."""

import warnings

import pytest

import gensig
from gensig.options.compose import options
from gensig.plan.doubts import plan_doubts
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

SMALL = ("plan.n_records=4",)


def doubts(*words):
    config = read_request([*SMALL, *words]).config
    return plan_doubts(InputReader(config), make_plan(config))


DOUBTED = {
    "operating.torque_nm=400": "has 1,247 MPa, and strength=18cr2ni4w bears 1,050",
    "operating.speed_rpm=150000": "at 150,000 r/min the mesh frequency is 57,500 Hz",
    "sensing.snr_db=-200": "sensing.snr_db = -200: usual are 0 to 40; below -40 nothing",
    "sensing.snr_db=200": "and above 140 a float32 holds none of the noise",
}


@pytest.mark.parametrize("word", DOUBTED)
def test_a_value_without_sense_is_doubted(word):
    (text,) = doubts(word)
    assert DOUBTED[word] in text
    assert "\n" not in text


@pytest.mark.parametrize(
    "word",
    ["operating.torque_nm=300", "operating.speed_rpm=50000", "sensing.snr_db=null"],
)
def test_a_value_within_the_limits_is_not(word):
    assert doubts(word) == []


def test_the_worst_of_drawn_values_is_named():
    drawn = (
        "plan.vary={operating.torque_nm: {distribution: choice, values: [20, 900, 60]}}"
    )
    (text,) = doubts(drawn, "plan.n_records=12")
    assert "at 900 N m" in text


def test_a_stage_of_a_drive_line_counts_in_full():
    """Its fastest mesh is the second one, whose gear turns with a shaft of the first."""
    system = ("system=two_stage_gearbox", "solver.oversampling=40")
    assert doubts(*system) == []
    rate = "sensing.sampling_rate_hz=1600"
    (text,) = doubts(*system, rate)
    assert "above the usable band of 625 Hz" in text


# Their teeth break off so low that what is left of the lowest never touches.
LOW_BREAKS = ("engine_broken_tooth", "engine_test_point", "two_stage")


@pytest.mark.parametrize("name", options("experiment"))
def test_no_shipped_experiment_is_doubted(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        config = read_request([f"experiment={name}"]).config
        texts = plan_doubts(InputReader(config), make_plan(config))
    assert len(texts) == (name in LOW_BREAKS)
    assert all("fault=broken: its tooth touches nothing" in text for text in texts)


def test_a_speed_that_is_not_held_fails_the_record():
    words = ("operating.torque_nm=800", "operating.speed_rpm=100")
    record = gensig.stream(*SMALL, *words, "operating.duration_s=0.1")[0]
    assert record.values["status"] == "failed"
    reason = record.values["status_reason"]
    assert "not 100 (operating.speed_tolerance = 0.02)" in reason


def test_the_mean_of_a_course_is_held():
    """A run-up from half the speed does not have the mean speed of its set-point."""
    words = ("operating=ramp", "operating.duration_s=0.5")
    record = gensig.stream(*SMALL, *words)[0]
    assert record.values["status"] == "ok"
    assert record.values["speed_rpm"] == pytest.approx(0.75 * 1800.0, rel=1e-2)
