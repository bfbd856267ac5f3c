"""Windows of a stream: those of the stored set, shared out between workers, another draw every epoch."""

import itertools
import pickle
from collections import Counter

import numpy as np
import pytest
from fake_stream import FakeStream
from torch.utils.data import DataLoader

from diagnose.data.torch_sets import StreamingDataset, VibrationDataset
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}


def bits(items):
    return [(window.numpy().tobytes(), int(label)) for window, label in items]


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
    stream = FakeStream()
    stored = VibrationDataset(stream.dataset, protocol, "train", **WINDOW, **changes)
    windows = StreamingDataset(stream, protocol, "train", **WINDOW, **changes)
    assert windows.class_names == stored.class_names
    assert windows.n_windows == len(stored)
    assert bits(windows) == bits(stored[index] for index in range(len(stored)))


def test_without_a_protocol_every_record_is_cut_whole():
    windows = StreamingDataset(FakeStream(), **WINDOW)
    stored = [
        VibrationDataset(FakeStream().dataset, "by_unit", subset, **WINDOW)
        for subset in ("train", "validation")
    ]
    assert windows.n_windows == 16 * 9
    assert bits(windows)[: 12 * 9] == [
        item for part in stored for item in bits(part[i] for i in range(len(part)))
    ]


def test_workers_share_the_records_out_in_a_fixed_order():
    windows = StreamingDataset(FakeStream(), **WINDOW)
    alone, shared = bits(windows), bits(loader(windows, 2))
    assert shared != alone
    assert Counter(shared) == Counter(alone)
    assert bits(loader(windows, 2)) == shared
    first, second = (
        [alone[i] for i in range(16 * 9) if i // 36 % 2 == worker] for worker in (0, 1)
    )
    assert shared == [item for pair in zip(first, second, strict=True) for item in pair]


def test_machines_and_workers_share_the_records_out():
    parts = [StreamingDataset(FakeStream().shard(rank, 2), **WINDOW) for rank in (0, 1)]
    shared = [item for part in parts for item in bits(loader(part, 2))]
    assert Counter(shared) == Counter(bits(StreamingDataset(FakeStream(), **WINDOW)))


def test_set_epoch_reaches_workers_that_stay_alive():
    windows = pickle.loads(pickle.dumps(StreamingDataset(FakeStream(), **WINDOW)))
    batches = loader(windows, 2, persistent_workers=True)
    passes = []
    for epoch in (0, 1, 1, 0):
        windows.set_epoch(epoch)
        assert windows.epoch == epoch
        passes.append(bits(batches))
    assert passes[0] == passes[3] != passes[1] == passes[2]
    assert Counter(passes[1]) == Counter(
        bits(StreamingDataset(FakeStream(epoch=1), **WINDOW))
    )


def test_epochs_follow_one_another_in_one_pass():
    one = [
        bits(StreamingDataset(FakeStream(epoch=epoch), **WINDOW)) for epoch in (1, 2)
    ]
    two = bits(StreamingDataset(FakeStream(epoch=1), **WINDOW, n_epochs=2))
    endless = StreamingDataset(FakeStream(epoch=1), **WINDOW, n_epochs=None)
    assert two == one[0] + one[1] == bits(itertools.islice(endless, len(two)))


def test_endless_worker_that_gets_nothing_stops():
    windows = StreamingDataset(
        FakeStream(), "by_unit", "test", **WINDOW, n_epochs=None
    )  # one condition
    assert len(bits(itertools.islice(loader(windows, 2), 50))) == 50


def test_shuffle_buffer_keeps_the_items_and_mixes_them():
    plain = bits(StreamingDataset(FakeStream(), **WINDOW))
    windows = StreamingDataset(FakeStream(), **WINDOW, shuffle_buffer=60)
    mixed = bits(windows)
    assert Counter(mixed) == Counter(plain)
    assert mixed != plain
    assert bits(windows) == mixed
    assert len({label for _, label in mixed[:16]}) > len(
        {label for _, label in plain[:16]}
    )


def test_failed_records_are_left_out_and_others_must_be_finite():
    whole, less = FakeStream(), FakeStream(failed=(3, 5))
    alone = bits(StreamingDataset(whole, **WINDOW))
    kept = [item for place, item in enumerate(alone) if place // 9 not in (3, 5)]
    assert bits(StreamingDataset(less, **WINDOW)) == kept
    with pytest.raises(
        DatasetError, match="record r00000: its signal holds values that are not finite"
    ):
        next(iter(StreamingDataset(FakeStream(noise=np.nan), **WINDOW)))


@pytest.mark.parametrize(
    ("words", "changes", "message"),
    [
        (
            (),
            {"classes": ["helthy", "crack"]},
            "no class 'helthy'; did you mean healthy",
        ),
        (("by_units", "train"), {}, "no protocol 'by_units'; did you mean by_unit"),
        (("by_unit", "training"), {}, "no subset 'training'; did you mean train"),
        (("by_unit",), {}, "give protocol and subset, or neither"),
        ((), {"window_samples": 5000}, "window_samples=5000 is too long"),
        ((), {"n_epochs": 0}, "n_epochs must be at least 1"),
    ],
)
def test_mistakes_are_refused_at_once(words, changes, message):
    with pytest.raises(ConfigError, match=message):
        StreamingDataset(FakeStream(), *words, **{**WINDOW, **changes})
    with pytest.raises(ConfigError, match="epoch = -1"):
        StreamingDataset(FakeStream(), **WINDOW).set_epoch(-1)
    with pytest.raises(ConfigError, match="no record of healthy, crack"):
        StreamingDataset(FakeStream().take([]), **WINDOW, classes=["healthy", "crack"])
