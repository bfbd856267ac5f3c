"""Replay: each record drawn as often as allowed, by seeds and counts, whatever the workers."""

import itertools
import threading
from collections import Counter

import numpy as np
import pytest
import torch
from fake_stream import FakeStream
from torch.utils.data import DataLoader

from diagnose.data import Gain, ReplayStream, StreamingDataset
from diagnose.data.loading.replay import RecordsAhead

WINDOW = {"window_samples": 700, "stride_samples": 300}
N_RECORDS, N_WINDOWS = 16, 9  # of the fake stream, and windows of a record


def replay(stream=None, *part, **changes):
    if stream is None:
        stream = FakeStream()
    options = {"reuse": 3, "buffer_records": 5, "return_metadata": True}
    return ReplayStream(stream, *part, **{**WINDOW, **options, **changes})


def loader(windows, n_workers, **options):
    return DataLoader(windows, batch_size=None, num_workers=n_workers, **options)


def places(items):
    """Record and first sample of each window."""
    return [(item[2]["record_id"], item[2]["start_sample"]) for item in items]


def bits(items):
    return [(item[0].numpy().tobytes(), item[1]) for item in items]


@pytest.mark.parametrize("n_workers", [0, 2])
def test_every_planned_window_is_drawn_as_often_as_allowed(n_workers):
    windows = replay(crop=False)
    drawn = Counter(places(loader(windows, n_workers)))
    assert set(drawn.values()) == {3}
    assert len(drawn) == N_RECORDS * N_WINDOWS
    assert sum(drawn.values()) == windows.n_windows
    assert {start for _, start in drawn} == set(range(0, 2401, 300))


@pytest.mark.parametrize("reuse", [1, 4])
def test_a_record_is_never_drawn_more_often_than_its_windows_allow(reuse):
    drawn = places(replay(reuse=reuse))
    assert set(Counter(record for record, _ in drawn).values()) == {reuse * N_WINDOWS}
    starts = [start for _, start in drawn]
    assert min(starts) >= 0
    assert max(starts) <= 3200 - 700
    assert len(set(starts)) > 100  # anywhere, not on the grid of nine


def test_a_replayed_window_is_cut_from_its_record_and_normalised():
    data = FakeStream().dataset
    ids = data.column("record_id").tolist()
    for window, label, metadata in itertools.islice(replay(), 20):
        record, start = ids.index(metadata["record_id"]), metadata["start_sample"]
        signal = data.signals(record, start, start + 700)
        signal = signal - signal.mean(axis=-1, keepdims=True)
        rms = np.sqrt(np.mean(signal**2, axis=-1, keepdims=True))
        np.testing.assert_allclose(window.numpy(), signal / rms, rtol=0, atol=1e-5)
        assert label == data.column("label")[record]
        assert metadata["label_name"] == data.column("label_name")[record]


def test_no_window_leaves_the_stretch_of_its_subset():
    """Half of each record is for training, then a quarter each."""
    bounds = {"train": (0, 1600), "validation": (1600, 2400), "test": (2400, 3200)}
    for subset, (first, last) in bounds.items():
        windows = replay(None, "random_window_leaky", subset, reuse=20)
        starts = [start for _, start in places(windows)]
        assert min(starts) >= first
        assert max(starts) + 700 <= last
        assert len(set(starts)) > 20


def test_only_records_of_the_subset_are_replayed():
    expected = StreamingDataset(
        FakeStream(), "by_unit", "test", **WINDOW, return_metadata=True
    )
    drawn = places(replay(None, "by_unit", "test"))
    assert {record for record, _ in drawn} == {r for r, _ in places(expected)}


@pytest.mark.parametrize("crop", [True, False])
def test_the_set_of_windows_does_not_depend_on_the_workers(crop):
    windows = replay(crop=crop)
    alone = list(windows)
    shared = list(loader(windows, 2))
    assert Counter(bits(alone)) == Counter(bits(shared))
    assert places(alone) != places(shared)


def test_the_buffer_decides_the_order_alone():
    small, large = places(replay(buffer_records=1)), places(replay())
    assert Counter(small) == Counter(large)
    assert small != large
    runs = [record for record, _ in itertools.groupby(record for record, _ in small)]
    assert len(runs) == N_RECORDS  # one record after the other


@pytest.mark.parametrize("n_workers", [0, 1, 2])
def test_a_pass_repeats_bit_for_bit_and_another_seed_differs(n_workers):
    def items(epoch):
        windows = replay(FakeStream(epoch=epoch), transform=Gain((-6, 6)))
        return bits(loader(windows, n_workers))

    first = items(0)
    assert items(0) == first
    assert not set(items(1)) & set(first)


def test_the_speed_of_simulation_does_not_change_what_is_drawn(monkeypatch):
    expected = bits(replay())
    released = threading.Event()
    plain = FakeStream.__iter__

    def slow(stream):
        for record in plain(stream):
            released.wait(0.01)
            yield record

    monkeypatch.setattr(FakeStream, "__iter__", slow)
    assert bits(replay()) == expected


def test_batches_are_the_single_windows_in_their_order():
    plain = replay(target="severity")
    single = list(plain)
    batches = list(replay(target="severity", batch_size=32))
    assert [len(batch[0]) for batch in batches[:-1]] == [32] * (len(batches) - 1)
    for part in (0, 1):
        expected = torch.stack([item[part] for item in single])
        assert torch.equal(torch.cat([batch[part] for batch in batches]), expected)
    ids = [name for batch in batches for name in batch[2]["record_id"]]
    assert ids == [item[2]["record_id"] for item in single]


def test_transforms_of_a_batch_draw_for_each_example():
    plain = list(replay(batch_size=32))
    changed = list(replay(batch_size=32, transform=Gain((-6, 6))))
    gains = torch.cat(
        [
            (after[0] / before[0]).flatten(1).median(1).values
            for before, after in zip(plain, changed, strict=True)
        ]
    )
    assert gains.round(decimals=5).unique().numel() > 0.99 * len(gains)


def test_without_reuse_windows_never_end_and_newer_records_come_in():
    windows = replay(reuse=None, n_epochs=None, buffer_records=4)
    assert windows.n_windows is None
    drawn = places(itertools.islice(windows, 3000))
    assert len(drawn) == 3000
    assert len({record for record, _ in drawn}) > 4


def test_a_loop_that_is_left_stops_its_thread():
    before = set(threading.enumerate())
    items = iter(replay(n_epochs=None))
    next(items)
    (ours,) = set(threading.enumerate()) - before
    assert ours.is_alive()
    items.close()
    assert not ours.is_alive()


def test_no_more_records_are_made_ahead_than_asked_for():
    made = []

    def records():
        for number in range(20):
            made.append(number)
            yield number

    ahead = RecordsAhead(records(), 3)
    taken = [ahead.take(), ahead.take()]
    ahead.close()
    assert taken == [0, 1]
    assert len(made) <= 2 + 3
