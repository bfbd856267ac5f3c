"""Testing on channels that were never trained on: which they are, and that nothing else changes."""

import json

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from novelty_sets import CopiedChannels

import gensig.dataset.reader
from diagnose.baselines.features import Cache, feature_table
from diagnose.cli import main
from diagnose.data.protocols import channels_to_cross
from diagnose.data.windows import load_windows, subset_segments
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import plan_study, task_from
from gensig.errors import ConfigError
from gensig.options.compose import compose

FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=2", "seeds=[0]", "n_bootstrap=100", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "shuffle_control=false",
]  # fmt: skip
FOUR = ("a", "b", "c", "d")


def settings_of(*overrides):
    return settings_from(compose("train", ["data=x", "out=y", *FAST, *overrides]))


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
            ("a", "b", "c"),
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


def test_only_the_test_part_has_other_channels():
    dataset = FakeDataset(n_channels=4, duration=0.3)
    task = task_from(dataset, settings_of())
    for subset, channels in (
        ("train", [0, 1]),
        ("validation", [0, 1]),
        ("test", [2, 3]),
    ):
        segments = subset_segments(task, "cross_sensor", subset)
        np.testing.assert_array_equal(
            segments.record, subset_segments(task, "by_unit", subset).record
        )
        windows = load_windows(task.part("cross_sensor", subset), segments)
        np.testing.assert_array_equal(
            windows.signals[0],
            dataset.signals(int(segments.record[0]), channels=channels),
        )
        assert task.part("by_unit", subset) is task


def test_indicators_of_one_channel_are_not_taken_for_those_of_another():
    task = task_from(FakeDataset(n_channels=2, duration=0.3), settings_of())
    segments, cache = subset_segments(task, "cross_sensor", "test"), Cache()
    first, second = (
        feature_table(task.part("cross_sensor", name), segments, cache=cache).values
        for name in ("train", "test")
    )
    assert not np.isclose(first, second).all(axis=1).any()
    again = feature_table(task.part("cross_sensor", "test"), segments).values
    np.testing.assert_array_equal(second, again)


def test_sensors_that_hear_the_same_change_nothing():
    torch.set_num_threads(1)
    settings = settings_of("channels=[near_x,near_y]", "baselines=[indicators]")
    task = task_from(CopiedChannels(), settings)
    protocols = ("by_unit", "cross_sensor")
    jobs = [
        Job(protocols=protocols, seed=None),
        *(Job(protocols=(name,), seed=0) for name in protocols),
    ]
    found = run_jobs(task, settings, jobs, n_workers=1, on_done=lambda _: None)
    by_protocol = {
        name: [run for run in found if run.protocol == name] for name in protocols
    }
    for known, other in zip(*by_protocol.values(), strict=True):
        np.testing.assert_array_equal(known.predicted, other.predicted)


@pytest.fixture
def data(monkeypatch):
    offered = {
        "four": FakeDataset(n_channels=4, duration=0.5),
        "one": FakeDataset(duration=0.5),
    }
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: offered[str(path)]
    )
    return offered


def test_one_channel_is_refused_in_one_line_and_left_out_beside_others(
    data, tmp_path, capsys
):
    words = ["train", "data=one", f"out={tmp_path / 'out'}", *FAST]
    assert main([*words, "protocols=[cross_sensor]"]) == 2
    assert (
        "cross_sensor: the data set has 1 channel, and 2 are needed"
        in capsys.readouterr().err
    )
    assert plan_study(task_from(data["one"], settings_of()), settings_of("protocols=null"))[0] == (
        "by_unit", "random_window_leaky",
    )  # fmt: skip


def test_train_and_evaluate_know_the_channels(data, tmp_path, capsys):
    out = tmp_path / "out"
    choice = [
        "protocols=[cross_sensor]",
        "channels=[channel_3]",
        "test_channels=[channel_1]",
        "baselines=false",
    ]
    assert main(["train", "data=four", f"out={out}", *FAST, *choice]) == 0
    metrics = json.loads((out / "metrics.json").read_text())["protocols"][
        "cross_sensor"
    ]
    assert metrics["channels"] == {"train": ["channel_3"], "test": ["channel_1"]}
    assert (
        "never trained on: trained on channel_3, tested on channel_1."
        in (out / "report.html").read_text()
    )
    model = out / "models" / "cross_sensor-seed0"
    description = json.loads((model / "model.json").read_text())
    assert (description["channel_names"], description["test_channel_names"]) == (
        ["channel_3"],
        ["channel_1"],
    )
    expected = metrics["methods"]["cnn"]["balanced_accuracy"]["mean"]

    def evaluated(*words):
        capsys.readouterr()
        folder = tmp_path / f"judged-{'-'.join(words)}"
        assert (
            main(
                ["evaluate", "data=four", f"model_dir={model}", f"out={folder}", *words]
            )
            == 0
        )
        return json.loads((folder / "metrics.json").read_text())

    own = evaluated()
    assert own["channel_names"] == ["channel_1"]
    assert own["balanced_accuracy"]["mean"] == pytest.approx(expected, abs=1e-12)
    assert evaluated("subset=train")["channel_names"] == ["channel_3"]
    assert evaluated("protocol=by_unit")["channel_names"] == ["channel_3"]
    assert evaluated("channels=channel_0")["channel_names"] == ["channel_0"]
    same = evaluated("protocol=by_unit", "channels=channel_1")
    assert same["confusion"] == own["confusion"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["channels=channel_0,channel_1"],
            "the model takes 1, in the order of channel_0",
        ),
        (["channels=channel_7"], "no channel channel_7"),
        (
            ["protocol=cross_sensor"],
            "protocol cross_sensor: no channels to test on are named",
        ),
    ],
)
def test_evaluate_refuses_channels_that_do_not_fit(
    data, tmp_path, capsys, words, message
):
    out = tmp_path / "out"
    few = ["protocols=[by_unit]", "baselines=false", "channels=[channel_0]", "epochs=1"]
    assert main(["train", "data=four", f"out={out}", *FAST, *few]) == 0
    capsys.readouterr()
    assert (
        main(
            [
                "evaluate",
                "data=four",
                f"model_dir={out / 'models' / 'by_unit-seed0'}",
                *words,
            ]
        )
        == 2
    )
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert message in lines[0]
