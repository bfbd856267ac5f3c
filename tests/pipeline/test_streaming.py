"""A stream makes the bits that generate stores: whole, by number, in parts, in other processes, epoch by epoch."""

import hashlib
import itertools
from pathlib import Path

import numpy as np
import pytest
from torch.utils.data import DataLoader

import gensig
from diagnose.data.torch_sets import StreamingDataset, VibrationDataset
from gensig.dataset.folder.verify import verify
from gensig.dataset.schema import SIGNALS
from gensig.errors import ConfigError, DatasetError
from gensig.production.streaming import (
    RecordStream,
    _as_stored,
    epoch_seed,
    open_stream,
)
from gensig.record.simulate import Record

SMALL = (
    "plan.n_records=6",
    "plan.n_units=3",
    "plan.classes=[healthy,missing_tooth]",
    "operating.duration_s=0.05",
    "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}",
    "dataset.store_clean=true",
)


def digest(records) -> str:
    return hashlib.sha256(
        b"".join(record.signals["acceleration"].tobytes() for record in records)
    ).hexdigest()


def bits(items) -> list[tuple[bytes, int]]:
    return [(window.numpy().tobytes(), label) for window, label in items]


def ids(part) -> list[str]:
    return part.column("record_id").tolist()


@pytest.fixture(scope="module")
def stream() -> RecordStream:
    return gensig.stream(*SMALL)


@pytest.fixture(scope="module")
def records(stream: RecordStream) -> list[Record]:
    return list(stream)


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("stored") / "data"
    with gensig.generate(
        *SMALL, "executor.n_workers=1", "dataset.records_per_shard=4", out=out
    ):
        return out


def test_records_are_those_of_generate_bit_for_bit(
    stream, records, stored: Path
) -> None:
    assert verify(stored).complete
    with gensig.open_dataset(stored) as data:
        assert len(stream) == data.n_records == len(records)
        assert (stream.class_names, stream.channels) == (
            data.class_names,
            data.channel_names,
        )
        assert (stream.sampling_rate_hz, stream.n_samples) == (
            data.sampling_rate,
            data.n_samples,
        )
        assert stream.seed == data.manifest.seed
        for name in data.column_names:
            key = "signals" if name in SIGNALS else "values"
            streamed = np.array([getattr(record, key)[name] for record in records])
            np.testing.assert_array_equal(
                streamed, data.column(name), err_msg=name, strict=name in SIGNALS
            )
        for index, record in enumerate(records):
            assert set(record.values) == set(data.column_names) - set(SIGNALS)
            for name in ("acceleration", "acceleration_clean"):
                assert record.signals[name].dtype == np.float32
                assert (
                    record.signals[name].tobytes()
                    == data.signals(index, name=name).tobytes()
                )
        for name, values in data.plan.columns.items():
            if name not in ("shard", "row"):
                np.testing.assert_array_equal(stream.column(name), values, err_msg=name)
        assert stream.protocols == data.protocols
        for protocol in stream.protocols:
            assert stream.split(protocol) == data.split(protocol)


def test_random_access_is_iteration(stream, records) -> None:
    for place in (4, -1):
        assert stream[place].values["record_id"] == records[place].values["record_id"]
        assert (
            stream[place].signals["acceleration"].tobytes()
            == records[place].signals["acceleration"].tobytes()
        )
    with pytest.raises(IndexError):
        stream[6]


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_shards_are_disjoint_complete_and_keep_a_condition_whole(
    stream, count: int
) -> None:
    parts = [stream.shard(index, count) for index in range(count)]
    assert sorted(name for part in parts for name in ids(part)) == ids(stream)
    conditions = [set(part.column("condition_id")) for part in parts]
    assert sum(len(part) for part in conditions) == 3
    assert all(ids(part) == sorted(ids(part)) for part in parts)
    assert [ids(stream.shard(index, count)) for index in range(count)] == [
        ids(part) for part in parts
    ]


def test_shard_of_a_shard_and_its_records(stream, records) -> None:
    part = stream.shard(0, 2)
    assert digest(part) == digest([records[number] for number in part.numbers])
    inner = [stream.shard(0, 2).shard(index, 2) for index in range(2)]
    assert sorted(name for part in inner for name in ids(part)) == ids(part)
    assert part.split("random_window_leaky")["train"][0][0] == 0
    assert ids(part.take(part.column("label") == 1)) == [
        name
        for name, label in zip(ids(part), part.column("label"), strict=True)
        if label == 1
    ]


def test_a_later_epoch_is_a_data_set_of_its_own_and_can_be_stored(
    stream, records, tmp_path: Path
) -> None:
    words = ("plan.n_records=1", "operating.duration_s=0.02")
    later = gensig.stream(*words, epoch=1)
    with gensig.generate(
        *words, f"seed={later.seed}", "executor.n_workers=1", out=tmp_path / "data"
    ) as data:
        assert later[0].signals["acceleration"].tobytes() == data.signals(0).tobytes()
    assert digest(stream.at_epoch(1).take([0])) != digest(records[:1])
    assert (
        len({epoch_seed(seed, epoch) for seed in range(3) for epoch in range(50)})
        == 150
    )


def test_epochs_follow_one_another_and_keep_the_part(stream) -> None:
    part = stream.shard(1, 2)
    assert [following.epoch for following in part.at_epoch(1).epochs(3)] == [1, 2, 3]
    endless = part.epochs()
    assert [next(endless).epoch for _ in range(5)] == [0, 1, 2, 3, 4]
    assert ids(part.at_epoch(1)) == ids(stream.at_epoch(1).shard(1, 2)) == ids(part)
    again = stream.at_epoch(1)
    for name, values in part.at_epoch(1).plan.columns.items():
        np.testing.assert_array_equal(values, again.plan.columns[name])
    assert not np.array_equal(
        again.column("speed_set_rpm"), stream.column("speed_set_rpm")
    )


def test_windows_are_those_of_the_stored_set_also_from_workers_and_a_fresh_process(
    stream, stored: Path
) -> None:
    options = {
        "window_samples": 300,
        "stride_samples": 100,
        "channels": ["wheel_y", "pinion_x"],
    }
    windows = StreamingDataset(stream, "random_window_leaky", "train", **options)
    with gensig.open_dataset(stored) as data:
        reference = VibrationDataset(data, "random_window_leaky", "train", **options)
        expected = [reference[index] for index in range(len(reference))]
        condition = np.unique(data.column("condition_id"), return_inverse=True)[1][
            reference.record
        ]
    assert windows.n_windows == len(expected) > 6
    assert bits(windows) == bits(expected)
    # a loader asks its workers in turn; each has every other condition
    mine = [
        [
            item
            for item, place in zip(expected, condition, strict=True)
            if place % 2 == worker
        ]
        for worker in (0, 1)
    ]
    in_turn = [
        item
        for pair in itertools.zip_longest(*mine)
        for item in pair
        if item is not None
    ]
    assert bits(
        DataLoader(
            windows, batch_size=None, num_workers=2, multiprocessing_context="fork"
        )
    ) == bits(in_turn)
    assert bits(
        DataLoader(
            windows, batch_size=None, num_workers=1, multiprocessing_context="spawn"
        )
    ) == bits(expected)


def test_a_failed_record_has_the_values_of_a_stored_one() -> None:
    record = Record(
        signals={},
        values={
            "record_id": "r0",
            "status": "failed",
            "status_reason": "x" + "\u00e9" * 200,
        },
    )
    values = _as_stored(record).values
    assert values["status_reason"] == ("x" + "\\xe9" * 200)[:256]
    assert np.isnan(values["contact_loss_fraction"])
    assert _as_stored(Record(signals={}, values={})).values["status"] == "ok"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("operating.sped_rpm=1",),
            "unknown key 'operating.sped_rpm'; did you mean 'operating.speed_rpm'",
        ),
        (("fault=healthy,crack",), "a stream is one data set: give one value a key"),
        (("-m", "fault=crack"), "cannot read the override"),
        ((["seed=1", "fault=crack"],), "an override is a text such as 'seed=1', not"),
    ],
)
def test_mistakes_are_one_line(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        gensig.stream(*words)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"plan.n_records": 0},
            "plan.n_records = 0 must be a whole number of at least 1",
        ),
        (
            {"dataset.store_clean": "maybe"},
            "dataset.store_clean = 'maybe' must be true or false",
        ),
        ({"seed": -1}, "seed = -1 must be a whole number"),
    ],
)
def test_values_that_generate_refuses_are_refused(
    config_with, changes, message: str
) -> None:
    with pytest.raises(ConfigError, match=message):
        open_stream(config_with(changes).with_entries(classes={}))


def test_parts_and_epochs_that_do_not_exist_are_refused(stream) -> None:
    for index, count in ((2, 2), (-1, 2), (0, 0)):
        with pytest.raises(ConfigError):
            stream.shard(index, count)
    with pytest.raises(ConfigError, match="epoch = -1 must be"):
        stream.at_epoch(-1)
    with pytest.raises(DatasetError, match="no column 'speed'"):
        stream.column("speed")
