"""A stream makes the bits that generate stores: whole, by number, in parts, epoch by epoch."""

import itertools
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from torch.utils.data import DataLoader

import gensig
from diagnose.data import ReplayStream, StreamingDataset, VibrationDataset
from gensig.dataset.folder.verify import verify
from gensig.dataset.schema import SIGNALS
from gensig.errors import ConfigError, DatasetError
from gensig.production.shard_writing import root_attributes
from gensig.production.streaming import _as_stored, epoch_seed, open_stream
from gensig.record import simulate
from gensig.record.inputs import InputReader
from gensig.record.simulate import Record

SMALL = (
    "plan.n_records=6",
    "plan.n_units=3",
    "plan.classes=[healthy,missing_tooth]",
    "operating.duration_s=0.05",
    "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}",
    "dataset.store_clean=true",
)


def samples(records):
    return [record.signals["acceleration"].tobytes() for record in records]


def bits(items):
    return [(window.numpy().tobytes(), label) for window, label in items]


def ids(part):
    return part.column("record_id").tolist()


@pytest.fixture(scope="module")
def stream():
    return gensig.stream(*SMALL)


@pytest.fixture(scope="module")
def records(stream):
    return list(stream)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    out = tmp_path_factory.mktemp("stored") / "data"
    words = (*SMALL, "executor.n_workers=1", "dataset.records_per_shard=4")
    with gensig.generate(*words, out=out) as data:
        yield data


def test_records_are_those_of_generate_bit_for_bit(stream, records, stored):
    assert verify(stored.folder).complete
    assert len(stream) == stored.n_records == len(records)
    assert stream.class_names == stored.class_names
    assert stream.channels == stored.channel_names
    assert stream.sampling_rate_hz == stored.sampling_rate
    assert stream.n_samples == stored.n_samples
    assert stream.seed == stored.manifest.seed
    for name in stored.column_names:
        part = {True: "signals", False: "values"}[name in SIGNALS]
        streamed = np.array([getattr(record, part)[name] for record in records])
        assert_array_equal(
            streamed, stored.column(name), err_msg=name, strict=name in SIGNALS
        )
    for index, record in enumerate(records):
        assert set(record.values) == set(stored.column_names) - set(SIGNALS)
        for name in ("acceleration", "acceleration_clean"):
            streamed, written = record.signals[name], stored.signals(index, name=name)
            assert streamed.dtype == np.float32
            assert streamed.tobytes() == written.tobytes()
    for name, values in stored.plan.columns.items():
        if name not in ("shard", "row"):
            assert_array_equal(stream.column(name), values, err_msg=name)
    assert stream.protocols == stored.protocols
    for protocol in stream.protocols:
        assert stream.split(protocol) == stored.split(protocol)


def test_random_access_is_iteration(stream, records):
    result = [stream[4], stream[-1]]
    expected = [records[4], records[-1]]
    assert samples(result) == samples(expected)
    assert [record.values["record_id"] for record in result] == [
        record.values["record_id"] for record in expected
    ]
    with pytest.raises(IndexError):
        stream[6]


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_shards_are_disjoint_complete_and_keep_a_condition_whole(stream, count):
    parts = [stream.shard(index, count) for index in range(count)]
    assert sorted(itertools.chain(*map(ids, parts))) == ids(stream)
    conditions = [set(part.column("condition_id")) for part in parts]
    assert sum(len(part) for part in conditions) == 3
    assert all(ids(part) == sorted(ids(part)) for part in parts)


def test_shard_of_a_shard_and_its_records(stream, records):
    part = stream.shard(0, 2)
    assert samples(part) == samples(records[number] for number in part.numbers)
    inner = [part.shard(index, 2) for index in range(2)]
    assert sorted(itertools.chain(*map(ids, inner))) == ids(part)
    assert part.split("random_window_leaky")["train"][0][0] == 0
    faulty = part.column("label") == 1
    assert ids(part.take(faulty)) == list(itertools.compress(ids(part), faulty))


def test_a_later_epoch_is_a_data_set_of_its_own_and_can_be_stored(
    stream, records, tmp_path
):
    words = ("plan.n_records=1", "operating.duration_s=0.02", "executor.n_workers=1")
    later = gensig.stream(*words, epoch=1)
    with gensig.generate(*words, f"seed={later.seed}", out=tmp_path / "data") as data:
        assert data.n_records == 1
        assert samples(later) == [data.signals(0).tobytes()]
    assert samples(stream.at_epoch(1).take([0])) != samples(records[:1])
    seeds = {epoch_seed(*each) for each in itertools.product(range(3), range(50))}
    assert len(seeds) == 150


def test_epochs_follow_one_another_and_keep_the_part(stream):
    part, later = stream.shard(1, 2), stream.at_epoch(1)
    assert [epoch.epoch for epoch in part.at_epoch(1).epochs(3)] == [1, 2, 3]
    endless = itertools.islice(part.epochs(), 5)
    assert [epoch.epoch for epoch in endless] == [0, 1, 2, 3, 4]
    assert ids(part.at_epoch(1)) == ids(later.shard(1, 2)) == ids(part)
    for name, values in part.at_epoch(1).plan.columns.items():
        assert_array_equal(values, later.plan.columns[name])
    speeds = [each.column("speed_set_rpm") for each in (later, stream)]
    assert not np.array_equal(*speeds)


def test_windows_are_those_of_the_stored_set_also_from_workers_and_a_fresh_process(
    stream, stored
):
    subset = ("random_window_leaky", "train")
    options = {
        "window_samples": 300,
        "stride_samples": 100,
        "channels": ["wheel_y", "pinion_x"],
    }
    windows = StreamingDataset(stream, *subset, **options)
    reference = VibrationDataset(stored, *subset, **options)
    expected = bits(reference[index] for index in range(len(reference)))
    assert windows.n_windows == len(expected) > 6
    assert bits(windows) == expected
    # A loader asks its workers in turn. Each has every other condition.
    number = np.unique(stored.column("condition_id"), return_inverse=True)[1]
    worker = number[reference.record] % 2
    shares = [itertools.compress(expected, worker == index) for index in (0, 1)]
    in_turn = [item for pair in itertools.zip_longest(*shares) for item in pair if item]
    for start, n_workers, order in (("fork", 2, in_turn), ("spawn", 1, expected)):
        loader = DataLoader(
            windows,
            batch_size=None,
            num_workers=n_workers,
            multiprocessing_context=start,
        )
        assert bits(loader) == order


def test_two_threads_make_the_records_of_one(stream, monkeypatch):
    """Both are in the midst of their records at the same time."""
    streams = [stream.take([0, 1, 2]), stream.at_epoch(1).take([0, 1, 2])]
    expected = [samples(each) for each in streams]
    barrier, plain = threading.Barrier(2), simulate._record

    def together(*arguments):
        barrier.wait(30)
        return plain(*arguments)

    monkeypatch.setattr(simulate, "_record", together)
    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(samples, streams)) == expected


def test_items_with_metadata_are_those_of_the_stored_set(stream, stored):
    options = {
        "window_samples": 300,
        "stride_samples": 300,
        "target": "gear",
        "return_metadata": True,
    }
    subset = ("random_window_leaky", "train")
    streamed = list(StreamingDataset(stream, *subset, **options))
    expected = VibrationDataset(stored, *subset, **options)
    assert expected.target_names == ("none", "pinion", "wheel")
    assert len(streamed) == len(expected)
    assert {target for _, target, _ in streamed} > {0}
    for index, (window, target, metadata) in enumerate(streamed):
        assert bits([(window, target)]) == bits([expected[index][:2]])
        assert metadata == expected[index][2]
    assert {"speed_rpm", "unit_id", "torque_nm", "severity"} <= set(streamed[0][2])


def test_replayed_windows_are_parts_of_the_stored_records(stream, stored):
    options = {"window_samples": 300, "stride_samples": 300, "normalise": "none"}
    windows = ReplayStream(
        stream, **options, reuse=2, buffer_records=3, return_metadata=True
    )
    items = list(DataLoader(windows, batch_size=None, num_workers=2))
    assert len(items) == windows.n_windows == 2 * 6 * (stored.n_samples // 300)
    for window, label, metadata in items:
        record = stored.column("record_id").tolist().index(metadata["record_id"])
        start = metadata["start_sample"]
        signal = stored.signals(record, start, start + 300)
        signal = signal - signal.mean(axis=-1, keepdims=True)
        assert window.numpy().tobytes() == signal.tobytes()
        assert label == stored.column("label")[record]


def test_a_stream_names_the_gears_of_the_stored_set(stream, stored):
    assert stream.gear_names == stored.gear_names == ["pinion", "wheel"]
    line = gensig.stream("experiment=two_stage", "plan.n_records=5")
    attributes = root_attributes(InputReader(line.config))
    assert line.gear_names == attributes["gear_names"]
    assert len(line.gear_names) == 4


def test_a_failed_record_has_the_values_of_a_stored_one():
    reason = "x" + "\u00e9" * 200
    failed = {"record_id": "r0", "status": "failed", "status_reason": reason}
    values = _as_stored(Record(signals={}, values=failed)).values
    assert values["status_reason"] == ("x" + "\\xe9" * 200)[:256]
    assert np.isnan(values["contact_loss_fraction"])
    assert _as_stored(Record(signals={}, values={})).values["status"] == "ok"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["operating.sped_rpm=1"], "did you mean 'operating.speed_rpm'"),
        (["fault=healthy,crack"], "a stream is one data set: give one value a key"),
        (["-m", "fault=crack"], "cannot read the override"),
        ([["seed=1", "fault=crack"]], "an override is a text such as 'seed=1', not"),
    ],
)
def test_mistakes_are_one_line(words, message):
    with pytest.raises(ConfigError, match=message) as caught:
        gensig.stream(*words)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("plan.n_records", 0, "= 0 must be a whole number of at least 1"),
        ("dataset.store_clean", "maybe", "= 'maybe' must be true or false"),
        ("seed", -1, "= -1 must be a whole number"),
    ],
)
def test_values_that_generate_refuses_are_refused(config_with, key, value, message):
    config = config_with({key: value}).with_entries(classes={})
    with pytest.raises(ConfigError, match=f"{key} {message}"):
        open_stream(config)


def test_parts_and_epochs_that_do_not_exist_are_refused(stream):
    for index, count in ((2, 2), (-1, 2), (0, 0)):
        with pytest.raises(ConfigError):
            stream.shard(index, count)
    with pytest.raises(ConfigError, match="epoch = -1 must be"):
        stream.at_epoch(-1)
    with pytest.raises(DatasetError, match="no column 'speed'"):
        stream.column("speed")
