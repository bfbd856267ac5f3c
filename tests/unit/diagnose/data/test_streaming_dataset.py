"""Windows of a stream: those of the stored set, shared between workers, other draws every epoch."""

import itertools
import pickle
from collections import Counter

import numpy as np
import pytest
from fake_stream import FakeStream
from torch.utils.data import DataLoader

from diagnose.data import ReplayStream, StreamingDataset, VibrationDataset
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}
# kind -> what two passes with the same windows share: their order, or the windows alone
SHARED = {StreamingDataset: list, ReplayStream: Counter}
FEW = {StreamingDataset: {}, ReplayStream: {"reuse": 2, "buffer_records": 5}}


def streamed(stream=None, *part, kind=StreamingDataset, **changes):
    if stream is None:
        stream = FakeStream()
    return kind(stream, *part, **{**WINDOW, **FEW[kind], **changes})


def stored(*part, **changes):
    return VibrationDataset(FakeStream().dataset, *part, **WINDOW, **changes)


def bits(items):
    return [(window.numpy().tobytes(), int(label)) for window, label in items]


def stored_bits(windows):
    return bits(windows[index] for index in range(len(windows)))


def places(stream, **changes):
    """Record and first sample of each window."""
    items = streamed(stream, return_metadata=True, **changes)
    return [(facts["record_id"], facts["start_sample"]) for *_, facts in items]


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


@pytest.mark.parametrize("kind", SHARED)
def test_set_epoch_reaches_workers_that_stay_alive(kind):
    windows = pickle.loads(pickle.dumps(streamed(kind=kind)))
    batches = loader(windows, 2, persistent_workers=True)
    passes = []
    for epoch in (0, 1, 1, 0):
        windows.set_epoch(epoch)
        assert windows.epoch == epoch
        passes.append(bits(batches))
    assert passes[0] == passes[3] != passes[1] == passes[2]
    fresh = streamed(FakeStream(epoch=1), kind=kind)
    assert Counter(passes[1]) == Counter(bits(fresh))


@pytest.mark.parametrize("kind", SHARED)
def test_epochs_follow_one_another_in_one_pass(kind):
    def windows_of(epoch, **changes):
        return streamed(FakeStream(epoch=epoch), kind=kind, **changes)

    shared = SHARED[kind]
    both = shared(bits(windows_of(1, n_epochs=2)))
    assert both == shared(bits(windows_of(1))) + shared(bits(windows_of(2)))
    endless = windows_of(1, n_epochs=None)
    n_both = 2 * endless.n_windows
    first = bits(itertools.islice(endless, n_both))
    assert len(first) == n_both
    if kind is StreamingDataset:
        assert first == both


@pytest.mark.parametrize("kind", SHARED)
def test_an_endless_worker_without_records_stops(kind):
    one_condition = streamed(None, "by_unit", "test", kind=kind, n_epochs=None)
    items = itertools.islice(loader(one_condition, 2), 50)
    assert len(bits(items)) == 50


def test_the_shuffle_buffer_keeps_the_items_and_mixes_them():
    plain, windows = bits(streamed()), streamed(shuffle_buffer=60)
    mixed = bits(windows)
    assert Counter(mixed) == Counter(plain)
    assert bits(windows) == mixed != plain
    n_mixed, n_plain = (
        len({label for _, label in items[:16]}) for items in (mixed, plain)
    )
    assert n_mixed > n_plain


@pytest.mark.parametrize("kind", SHARED)
def test_failed_records_are_left_out(kind):
    stream = FakeStream(failed=(3, 5))
    ids = [record for record, _ in places(stream, kind=kind)]
    every = [record for record, _ in places(FakeStream(), kind=kind)]
    shared, failed = SHARED[kind], {"r00003", "r00005"}
    assert shared(ids) == shared(record for record in every if record not in failed)


@pytest.mark.parametrize("kind", SHARED)
@pytest.mark.parametrize("n_workers", [0, 1])
def test_the_error_of_a_record_reaches_the_loop(kind, n_workers):
    windows = streamed(FakeStream(noise=np.nan), kind=kind)
    with pytest.raises(DatasetError, match=r"record r00000: .* not finite"):
        next(iter(loader(windows, n_workers)))


@pytest.mark.parametrize("kind", SHARED)
@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        (("by_unit", "training"), {}, "no subset 'training'; did you mean train"),
        (("by_unit",), {}, "give protocol and subset, or neither"),
        ((), {"window_samples": 5000}, "window_samples=5000 is too long"),
        ((), {"n_epochs": 0}, "n_epochs must be at least 1 or None, not 0"),
    ],
)
def test_mistakes_are_refused_at_once(kind, part, changes, message):
    with pytest.raises(ConfigError, match=message):
        streamed(None, *part, kind=kind, **changes)


@pytest.mark.parametrize(
    ("kind", "changes", "message"),
    [
        (StreamingDataset, {"shuffle_buffer": -1}, "shuffle_buffer = -1 must be"),
        (ReplayStream, {"reuse": 0}, "reuse = 0 must be at least 1"),
        (ReplayStream, {"buffer_records": 0}, "buffer_records = 0 must be at least 1"),
        (ReplayStream, {"batch_size": 0}, "batch_size = 0 must be at least 1"),
        (ReplayStream, {"reuse": None}, "reuse=None never ends"),
    ],
)
def test_numbers_that_cannot_be_are_refused(kind, changes, message):
    with pytest.raises(ConfigError, match=message):
        streamed(kind=kind, **changes)


def test_negative_epochs_and_empty_streams_are_refused():
    with pytest.raises(ConfigError, match="epoch = -1"):
        streamed().set_epoch(-1)
    with pytest.raises(ConfigError, match="no record of healthy, crack"):
        streamed(FakeStream().take([]), classes=["healthy", "crack"])
