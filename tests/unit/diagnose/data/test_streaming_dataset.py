"""Windows of a stream: those of the stored set, shared between workers, other draws every epoch."""

import itertools
import pickle
from collections import Counter

import numpy as np
import pytest
from fake_stream import FakeStream
from torch.utils.data import DataLoader

from diagnose.data import StreamingDataset, VibrationDataset
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}


def streamed(stream=None, *part, **changes):
    if stream is None:
        stream = FakeStream()
    return StreamingDataset(stream, *part, **{**WINDOW, **changes})


def stored(*part, **changes):
    return VibrationDataset(FakeStream().dataset, *part, **WINDOW, **changes)


def bits(items):
    return [(window.numpy().tobytes(), int(label)) for window, label in items]


def stored_bits(windows):
    return bits(windows[index] for index in range(len(windows)))


def loader(windows, n_workers, **options):
    return DataLoader(windows, batch_size=None, num_workers=n_workers, **options)


@pytest.mark.parametrize("protocol", ["by_unit", "random_window_leaky"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"normalise": "none", "channels": ["channel_1"]},
        {
            "classes": ["missing_tooth", "healthy"],
            "channels": ["channel_1", "channel_0"],
        },
    ],
)
def test_items_are_those_of_the_stored_set(protocol, changes):
    expected = stored(protocol, "train", **changes)
    windows = streamed(None, protocol, "train", **changes)
    assert windows.class_names == expected.class_names
    assert windows.n_windows == len(expected)
    assert bits(windows) == stored_bits(expected)


def test_without_a_protocol_every_record_is_cut_whole():
    windows = streamed()
    assert windows.n_windows == 16 * 9
    expected = [
        stored_bits(stored("by_unit", name)) for name in ("train", "validation")
    ]
    assert bits(windows)[: 12 * 9] == expected[0] + expected[1]


def test_computers_and_workers_share_the_records():
    parts = [streamed(FakeStream().shard(rank, 2)) for rank in (0, 1)]
    shared = [item for part in parts for item in bits(loader(part, 2))]
    assert Counter(shared) == Counter(bits(streamed()))


def test_set_epoch_reaches_workers_that_stay_alive():
    windows = pickle.loads(pickle.dumps(streamed()))
    batches = loader(windows, 2, persistent_workers=True)
    passes = []
    for epoch in (0, 1, 1, 0):
        windows.set_epoch(epoch)
        assert windows.epoch == epoch
        passes.append(bits(batches))
    assert passes[0] == passes[3] != passes[1] == passes[2]
    assert Counter(passes[1]) == Counter(bits(streamed(FakeStream(epoch=1))))


def test_epochs_follow_one_another_in_one_pass():
    first, second = (bits(streamed(FakeStream(epoch=epoch))) for epoch in (1, 2))
    both = bits(streamed(FakeStream(epoch=1), n_epochs=2))
    endless = streamed(FakeStream(epoch=1), n_epochs=None)
    assert both == first + second == bits(itertools.islice(endless, len(both)))


def test_an_endless_worker_without_records_stops():
    windows = streamed(None, "by_unit", "test", n_epochs=None)  # one condition
    assert len(bits(itertools.islice(loader(windows, 2), 50))) == 50


def test_the_shuffle_buffer_keeps_the_items_and_mixes_them():
    plain, windows = bits(streamed()), streamed(shuffle_buffer=60)
    mixed = bits(windows)
    assert Counter(mixed) == Counter(plain)
    assert bits(windows) == mixed != plain
    n_mixed, n_plain = (
        len({label for _, label in items[:16]}) for items in (mixed, plain)
    )
    assert n_mixed > n_plain


def test_failed_records_are_left_out_and_others_must_be_finite():
    kept = [item for i, item in enumerate(bits(streamed())) if i // 9 not in (3, 5)]
    assert bits(streamed(FakeStream(failed=(3, 5)))) == kept
    with pytest.raises(DatasetError, match=r"record r00000: .* not finite"):
        next(iter(streamed(FakeStream(noise=np.nan))))


@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        (("by_unit", "training"), {}, "no subset 'training'; did you mean train"),
        (("by_unit",), {}, "give protocol and subset, or neither"),
        ((), {"window_samples": 5000}, "window_samples=5000 is too long"),
        ((), {"n_epochs": 0}, "n_epochs must be at least 1"),
    ],
)
def test_mistakes_are_refused_at_once(part, changes, message):
    with pytest.raises(ConfigError, match=message):
        streamed(None, *part, **changes)


def test_negative_epochs_and_empty_streams_are_refused():
    with pytest.raises(ConfigError, match="epoch = -1"):
        streamed().set_epoch(-1)
    with pytest.raises(ConfigError, match="no record of healthy, crack"):
        streamed(FakeStream().take([]), classes=["healthy", "crack"])
