"""Default lengths of windows: turns of the faulty gear, at most a record, explained in one line."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import plan_of, settings_of

from diagnose.data.protocols import choose_protocols
from diagnose.data.window_choice import LEAST, TURNS, chosen_window
from diagnose.studies.network_choice import settings_for
from diagnose.studies.study import task_from
from gensig.errors import ConfigError

DEFAULTS = ["window_samples=null", "stride_samples=null"]


def at_speed(rpm, *, gear="wheel", **options):
    dataset = FakeDataset(**options)
    dataset.columns["speed_rpm"] = np.full(dataset.n_records, float(rpm))
    dataset.columns["fault_gear"] = np.where(dataset.columns["label"] > 0, gear, "")
    return dataset


@pytest.mark.parametrize("rate", [51200.0, 12800.0])
def test_fast_gears_keep_an_eighth_of_a_second_at_every_rate(rate):
    dataset = at_speed(1800, gear="pinion", sampling_rate=rate, duration=1.0)
    assert chosen_window(dataset) == (round(LEAST * rate), None)
    assert LEAST == 1 / 8


@pytest.mark.parametrize(("gear", "ratio"), [("pinion", 1.0), ("wheel", 84 / 23)])
def test_slow_gears_get_turns_of_the_one_with_the_fault(gear, ratio):
    dataset = at_speed(300, gear=gear, duration=2.0)
    window, why = chosen_window(dataset)
    expected = TURNS * ratio * 60 / 300 * dataset.sampling_rate
    assert window == pytest.approx(expected, rel=1e-3)
    assert gear in why
    assert "\n" not in why


def test_a_further_gear_of_a_drive_line_counts_as_slow_as_it_turns():
    dataset = at_speed(300, gear="output_gear", duration=5.0)
    names = {"gear_names": ["pinion", "wheel", "output_gear"]}
    dataset.attributes |= {**names, "gear_pinion_turns": [1.0, 3.0, 5.0]}
    window, why = chosen_window(dataset)
    assert window == pytest.approx(TURNS * 5.0 * 0.2 * dataset.sampling_rate, rel=1e-3)
    assert "output_gear" in why
    sound = at_speed(300, gear="", duration=5.0)
    sound.attributes |= dataset.attributes
    assert chosen_window(sound)[0] == round(TURNS * 0.2 * sound.sampling_rate)


def test_the_slowest_wheel_of_different_pairs_counts():
    dataset = at_speed(300, gear="wheel", duration=5.0)
    wheel = np.full(dataset.n_records, 30)
    wheel[3] = 92
    dataset.n_teeth = {"pinion": np.full(dataset.n_records, 23), "wheel": wheel}.get
    window, _ = chosen_window(dataset)
    expected = TURNS * 92 / 23 * 60 / 300 * dataset.sampling_rate
    assert window == pytest.approx(expected, rel=1e-3)


def test_the_slowest_usable_record_counts():
    dataset = at_speed(1800, gear="pinion", duration=2.0)
    dataset.columns["speed_rpm"][3] = 300.0
    slow = chosen_window(dataset)[0]
    dataset.usable[3] = False
    assert slow == round(TURNS * 0.2 * dataset.sampling_rate)
    assert chosen_window(dataset)[0] == round(LEAST * dataset.sampling_rate)


def test_a_window_is_never_longer_than_a_record():
    dataset = at_speed(300, duration=0.5)
    window, why = chosen_window(dataset)
    assert window == dataset.n_samples
    assert "whole records" in why


@pytest.mark.parametrize(
    ("window", "words"),
    [
        (chosen_window(at_speed(300, gear="pinion", duration=1.0))[0], []),
        (2000, ["window_samples=2000"]),
    ],
)
def test_task_and_settings_agree_and_a_given_length_stays(window, words):
    dataset = at_speed(300, gear="pinion", duration=1.0)
    settings = settings_of(*DEFAULTS, *words)
    task = task_from(dataset, settings)
    for made in (task, settings_for(task, settings)[0]):
        assert (made.window_samples, made.stride_samples) == (window, window)


def test_a_lower_rate_has_the_same_turns():
    dataset = at_speed(300, gear="pinion", duration=1.0)
    slower = task_from(dataset, settings_of(*DEFAULTS, "sampling_rate_hz=6400"))
    assert slower.window_samples == chosen_window(dataset)[0] // 2


def test_a_split_that_cuts_records_shorter_is_left_out_with_the_reason():
    dataset = at_speed(300, gear="pinion", duration=0.45)
    settings = settings_of(*DEFAULTS, "protocols=[by_unit,random_window_leaky]")
    task = task_from(dataset, settings)
    protocols, left_out = choose_protocols(task, settings.protocols)
    assert protocols == ("by_unit",)
    assert "hold no window of" in left_out["random_window_leaky"]
    assert plan_of(task, settings_for(task, settings)[0]).protocols == ("by_unit",)
    with pytest.raises(ConfigError, match="hold no window of"):
        choose_protocols(task, ("random_window_leaky",))
