"""Items of the data sets for torch: transform, target and metadata, stored and streamed."""

import numpy as np
import pytest
import torch
from fake_dataset import CompleteDataset, FakeDataset
from fake_lives import FakeLives
from fake_stream import FakeStream
from numpy.testing import assert_array_equal
from torch.utils.data import DataLoader

from diagnose.data import Gain, ReplayStream, StreamingDataset, VibrationDataset
from gensig.errors import ConfigError

WINDOW = {"window_samples": 700, "stride_samples": 300}


def stored(dataset, subset="train", protocol="by_unit", **changes):
    return VibrationDataset(dataset, protocol, subset, **{**WINDOW, **changes})


def targets(windows):
    return [windows[index][1] for index in range(len(windows))]


def doubled(window):
    return 2 * window


def test_a_transform_gets_the_normalised_window_and_changes_nothing_else():
    data = FakeDataset(n_units=4)
    plain, changed = stored(data), stored(data, transform=doubled)
    assert len(plain) == len(changed) > 0
    for index in range(0, len(plain), 7):
        assert torch.equal(changed[index][0], 2 * plain[index][0])
        assert changed[index][1] == plain[index][1]


def test_workers_draw_differently_and_repeat_with_the_seed_of_the_loader():
    windows = stored(FakeDataset(n_units=4), transform=Gain((-6, 6)))
    plain = stored(FakeDataset(n_units=4))
    passes = []
    for seed in (1, 1, 2):
        generator = torch.Generator().manual_seed(seed)
        loader = DataLoader(windows, 1, num_workers=2, generator=generator)
        passes.append([batch[0][0] for batch in loader])
    gains = [
        float((window / plain[index][0]).median())
        for index, window in enumerate(passes[0])
    ]
    assert np.unique(np.round(gains, 5)).size == len(plain)
    assert all(map(torch.equal, passes[0], passes[1]))
    assert not any(map(torch.equal, passes[0], passes[2]))


def test_class_targets_are_labels_as_ever():
    windows = stored(FakeDataset(), classes=["crack", "healthy"])
    assert targets(windows) == windows.label.tolist()
    assert {type(target) for target in targets(windows)} == {int}
    assert windows.target_names == windows.class_names == ("crack", "healthy")


def test_severity_is_the_column_of_the_record():
    data = FakeDataset()
    windows = stored(data, target="severity")
    result = torch.stack(targets(windows))
    assert result.dtype == torch.float32
    assert_array_equal(
        result.numpy(), data.column("severity")[windows.record].astype(np.float32)
    )
    assert result.min() == 0 < result.max()
    assert windows.target_names == ()


def test_gear_targets_name_the_column_of_the_record():
    data = CompleteDataset()
    windows = stored(data, target="gear")
    assert windows.target_names == ("none", "pinion", "wheel")
    names = [windows.target_names[target] for target in targets(windows)]
    expected = [name or "none" for name in data.column("fault_gear")[windows.record]]
    assert names == expected
    assert set(names) == {"none", "wheel"}


def test_gears_of_a_drive_line_are_those_that_it_names():
    data = CompleteDataset()
    data.gear_names = ["pinion", "wheel", "idler"]
    faulty = data.column("label") > 0
    data.columns["fault_gear"] = np.where(faulty, "idler", "")
    windows = stored(data, target="gear")
    assert set(targets(windows)) == {0, 3}
    data.gear_names = ["pinion", "wheel"]
    with pytest.raises(ConfigError, match="fault_gear 'idler' is no gear of the data"):
        stored(data, target="gear")


def test_life_targets_are_hours_of_lives_that_failed():
    data = FakeLives(n_lives=12, n_censored=4)
    subsets = [stored(data, name, target="life") for name in ("train", "test")]
    for windows in subsets:
        assert_array_equal(
            torch.stack(targets(windows)).numpy(),
            data.column("remaining_life_h")[windows.record].astype(np.float32),
        )
    used = np.concatenate([windows.record for windows in subsets])
    assert (data.column("life_failed")[used] == 1).all()
    both = [stored(data, name, target="severity") for name in ("train", "test")]
    censored = np.concatenate([windows.record for windows in both])
    assert (data.column("life_failed")[censored] == 0).any()


@pytest.mark.parametrize(
    ("data", "target", "message"),
    [
        (FakeDataset(), "gears", "no target 'gears'; did you mean gear"),
        (FakeDataset(), "gear", "target 'gear': the data set has no column fault_gear"),
        (FakeDataset(), "life", "no column life_id: its records are no snapshots"),
        (FakeLives(n_lives=8, n_censored=8), "life", "no life of the data set failed"),
        (FakeLives(n_lives=8), "class", "one class only"),
    ],
)
def test_a_target_that_the_data_lack_is_refused_with_the_reason(data, target, message):
    with pytest.raises(ConfigError, match=message):
        stored(data, target=target)


def test_a_part_without_the_target_is_refused():
    data = FakeLives(n_lives=8)
    data.columns["life_failed"][: data.n_records // 2] = 0
    with pytest.raises(
        ConfigError, match="no record of its train part has this target"
    ):
        stored(data, target="life")


@pytest.mark.parametrize("protocol", ["by_unit", "random_window_leaky"])
def test_metadata_are_the_columns_of_the_record(protocol):
    data = CompleteDataset()
    windows = stored(data, "test", protocol, return_metadata=True)
    (batch,) = DataLoader(windows, batch_size=len(windows))
    metadata = batch[2]
    shared = set(metadata) & set(data.column_names)
    assert {"record_id", "unit_id", "severity", "speed_rpm", "fault_gear"} <= shared
    for name in shared:
        expected = data.column(name)[windows.record].tolist()
        assert list(metadata[name]) == expected, name
    assert metadata["start_sample"].tolist() == windows.start.tolist()
    assert set(metadata["sampling_rate_hz"].tolist()) == {data.sampling_rate}
    first = windows[0][2]
    assert {type(value) for value in first.values()} <= {int, float, str}


def test_metadata_say_where_a_window_was_cut():
    data = FakeDataset(n_units=4)
    windows = stored(
        data, "test", "random_window_leaky", return_metadata=True, normalise="none"
    )
    ids = data.column("record_id").tolist()
    for index in range(0, len(windows), 5):
        window, _, metadata = windows[index]
        start = metadata["start_sample"]
        record = ids.index(metadata["record_id"])
        signal = data.signals(record, start, start + 700)
        centered = signal - signal.mean(axis=-1, keepdims=True)
        np.testing.assert_allclose(window.numpy(), centered, rtol=0, atol=1e-6)


@pytest.mark.parametrize("target", ["class", "severity"])
def test_streamed_items_are_those_of_the_stored_set(target):
    options = {
        **WINDOW,
        "target": target,
        "return_metadata": True,
        "transform": doubled,
    }
    part = ("random_window_leaky", "validation")
    expected = VibrationDataset(FakeStream().dataset, *part, **options)
    streamed = list(StreamingDataset(FakeStream(), *part, **options))
    assert len(streamed) == len(expected) > 0
    for index, (window, value, metadata) in enumerate(streamed):
        assert torch.equal(window, expected[index][0])
        assert value == expected[index][1]
        assert metadata == expected[index][2]


@pytest.mark.parametrize("kind", [StreamingDataset, ReplayStream])
def test_streams_refuse_a_target_that_they_lack(kind):
    with pytest.raises(ConfigError, match="no column fault_gear"):
        kind(FakeStream(), **WINDOW, target="gear")
