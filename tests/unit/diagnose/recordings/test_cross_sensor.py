"""Tests on channels that were never trained on: their choice, and that nothing else changes."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from runs import FAST, NETWORK_ONLY, metrics_of, refuses, serve, settings_of, train
from small_studies import plan_of

from diagnose.baselines.features import Cache, feature_table
from diagnose.cli import main
from diagnose.data.protocols import channels_to_cross
from diagnose.data.windows import load_windows, subset_segments
from diagnose.studies.study import task_from
from diagnose.training.store import data_fingerprint, load_model
from gensig.errors import ConfigError

FOUR = ("a", "b", "c", "d")


def four():
    return FakeDataset(n_channels=4, duration=0.5)


@pytest.mark.parametrize(
    ("available", "channels", "test_channels", "expected"),
    [
        (FOUR, None, None, (("a", "b"), ("c", "d"))),
        (FOUR[:3], None, None, (("a",), ("b",))),
        (FOUR, ("b",), None, (("b",), ("a",))),
        (FOUR, ("c", "a"), None, (("c", "a"), ("b", "d"))),
        (FOUR, ("a",), ("d",), (("a",), ("d",))),
        (FOUR[:1], None, None, "the data set has 1 channel, and 2 are needed"),
        (
            FOUR,
            FOUR[:3],
            None,
            "1 channel(s) are left beside channels=a,b,c; name fewer",
        ),
    ],
)
def test_channels_by_default_and_by_choice(
    available, channels, test_channels, expected
):
    assert channels_to_cross(available, channels, test_channels) == expected


@pytest.mark.parametrize(
    ("channels", "test_channels", "message"),
    [
        (None, ("a",), "test_channels needs channels beside it"),
        (("a", "b"), ("c",), "the same number"),
        (("a",), ("a",), "channel a is in channels and in test_channels"),
        (("a",), ("e",), "no channel 'e'"),
    ],
)
def test_test_channels_that_make_no_sense(channels, test_channels, message):
    with pytest.raises(ConfigError, match=message):
        channels_to_cross(FOUR, channels, test_channels)


@pytest.mark.parametrize(
    ("subset", "channels"),
    [("train", [0, 1]), ("validation", [0, 1]), ("test", [2, 3])],
)
def test_only_the_test_part_has_other_channels(subset, channels):
    dataset = four()
    task = task_from(dataset, settings_of(*FAST))
    segments = subset_segments(task, "cross_sensor", subset)
    by_unit = subset_segments(task, "by_unit", subset)
    np.testing.assert_array_equal(segments.record, by_unit.record)
    windows = load_windows(task.part("cross_sensor", subset), segments)
    expected = dataset.signals(int(segments.record[0]), channels=channels)
    np.testing.assert_array_equal(windows.signals[0], expected)
    assert task.part("by_unit", subset) is task


def test_indicators_of_one_channel_are_not_taken_for_those_of_another():
    task = task_from(FakeDataset(n_channels=2, duration=0.3), settings_of(*FAST))
    segments, cache = subset_segments(task, "cross_sensor", "test"), Cache()
    parts = [task.part("cross_sensor", name) for name in ("train", "test")]
    first, second = (
        feature_table(part, segments, cache=cache).values for part in parts
    )
    assert not np.isclose(first, second).all(axis=1).any()
    np.testing.assert_array_equal(second, feature_table(parts[1], segments).values)


def test_one_channel_is_left_out_beside_other_protocols():
    task = task_from(FakeDataset(duration=0.5), settings_of(*FAST))
    protocols = plan_of(task, settings_of(*FAST, "protocols=null")).protocols
    assert protocols == ("by_unit", "random_window_leaky")


@pytest.fixture(scope="module")
def crossed(tmp_path_factory):
    """Study of cross_sensor with chosen channels."""
    words = (*NETWORK_ONLY[1:], "protocols=[cross_sensor]", "channels=[channel_3]")
    out = tmp_path_factory.mktemp("crossed") / "out"
    return train(out, four(), *FAST, *words, "test_channels=[channel_1]")


def test_train_and_evaluate_know_the_channels(crossed, tmp_path, monkeypatch):
    serve(monkeypatch, {"four": four()})
    result = metrics_of(crossed)["protocols"]["cross_sensor"]
    assert result["channels"] == {"train": ["channel_3"], "test": ["channel_1"]}
    sentence = "never trained on: trained on channel_3, tested on channel_1."
    assert sentence in (crossed / "report.html").read_text()
    model = crossed / "models" / "cross_sensor-seed0"
    description = load_model(model)[1]
    assert description.channel_names == ("channel_3",)
    assert description.test_channel_names == ("channel_1",)

    def evaluated(*words):
        out = tmp_path / f"judged-{'-'.join(words)}"
        words = ["data=four", f"--model={model}", f"out={out}", *words]
        assert main(["evaluate", *words]) == 0
        return metrics_of(out)

    known = evaluated()
    assert known["channel_names"] == ["channel_1"]
    expected = result["methods"]["cnn"]["balanced_accuracy"]["mean"]
    assert known["balanced_accuracy"]["mean"] == pytest.approx(expected, abs=1e-12)
    assert evaluated("subset=train")["channel_names"] == ["channel_3"]
    assert evaluated("protocol=by_unit")["channel_names"] == ["channel_3"]
    assert evaluated("channels=channel_0")["channel_names"] == ["channel_0"]
    same = evaluated("protocol=by_unit", "channels=channel_1")
    assert same["confusion"] == known["confusion"]


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("channels=channel_0", "the model takes 2, in the order of channel_0"),
        ("channels=channel_7,channel_8", "no channel channel_7"),
        ("protocol=cross_sensor", "cross_sensor: no channels to test on are named"),
    ],
)
def test_evaluate_refuses_channels_that_do_not_fit(
    model, capsys, monkeypatch, word, message
):
    serve(monkeypatch, {"four": four()})
    refuses(capsys, ["evaluate", "data=four", f"--model={model}", word], message)


@pytest.mark.parametrize("name", ["record_id", "unit_id", "label", "speed_rpm"])
def test_a_set_with_another_value_is_another_set(name):
    """Else a model would be judged on other records as those it was trained on."""
    dataset, other = FakeDataset(), FakeDataset()
    assert data_fingerprint(dataset) == data_fingerprint(other)
    values = other.columns[name].copy()
    values[0] = values[-1]
    other.columns[name] = values
    assert data_fingerprint(dataset) != data_fingerprint(other)
