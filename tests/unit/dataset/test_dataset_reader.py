"""Reading of data sets in plan order, from several processes, finished or not."""

import pickle
import sys

import numpy as np
import pytest
from dataset_samples import CLASSES, build, row_of
from numpy.testing import assert_array_equal
from refusals import refused

import gensig.dataset.shard_files as shard_files
from gensig.dataset.reader import open_dataset
from gensig.errors import DatasetError
from gensig.text.installation import install


def test_facts(data):
    assert (data.n_records, len(data), data.n_samples) == (36, 36, 200)
    assert data.sampling_rate == pytest.approx(1000.0)
    assert data.channel_names == ["pinion_y", "wheel_ü"]
    assert data.class_names == CLASSES
    assert data.attributes["n_teeth_wheel"] == 84
    names = (
        "new_machine",
        "by_unit",
        "cross_gearbox",
        "cross_specimen",
        "random_window_leaky",
    )
    assert data.protocols == list(names)
    columns = {"label", "params/crack_depth_mm", "noise_power"}
    assert columns <= set(data.column_names)
    assert "acceleration" not in data.column_names
    assert data.usable.all()


def test_columns_and_signals_come_in_plan_order(data, plan):
    for name in ("record_id", "label", "label_name", "params/crack_depth_mm"):
        assert_array_equal(data.column(name), plan.columns[name])
    assert data.column("noise_power").shape == (36, 2)
    for index in (0, 9, 10, 35):
        expected = row_of(plan, index)[0]["acceleration"]
        assert_array_equal(data.signals(index), expected, strict=True)
        part = data.signals(index, 20, 70, ["wheel_ü"])
        assert_array_equal(part, expected[1:, 20:70])
        turned = data.signals(index, channels=[1, 0])
        assert_array_equal(turned, expected[::-1])


def test_signals_of_several_records_come_together(data, plan):
    one = [data.signals(index) for index in range(data.n_records)]
    ids = plan.columns["record_id"].tolist()
    assert_array_equal(data.signals(ids[7]), one[7], strict=True)
    chosen = {
        "list": ([30, 2, 2], [30, 2, 2]),
        "ids": ([ids[9], ids[35]], [9, 35]),
        "both": ([ids[9], 3], [9, 3]),
        "array": (np.array([11, 0]), [11, 0]),
        "slice": (slice(3, 30, 9), [3, 12, 21]),
        "last": (slice(-2, None), [34, 35]),
        "none": ([], []),
        "mask": (data.column("label") == 2, np.flatnonzero(data.column("label") == 2)),
    }
    for records, numbers in chosen.values():
        expected = np.array([one[number] for number in numbers]).reshape(-1, 2, 200)
        assert_array_equal(data.signals(records), expected)
    part = data.signals([4, 5], 20, 70, ["wheel_ü"])
    assert_array_equal(part, np.stack(one[4:6])[:, 1:, 20:70], strict=True)


def test_signals_of_a_selection_count_its_records(data):
    cracked = data.where(label=1)
    numbers = cracked.index.tolist()
    assert_array_equal(cracked.signals(slice(1, 3)), data.signals(numbers[1:3]))
    assert_array_equal(cracked.signals([2, 0]), data.signals([numbers[2], numbers[0]]))
    assert_array_equal(cracked.signals(-1), data.signals(numbers[-1]))
    name = cracked.column("record_id")[3]
    assert_array_equal(cracked.signals(str(name)), cracked.signals(3))


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ("r99", "record 'r99' does not exist"),
        (["r99"], "record 'r99' does not exist"),
        ([0, 36], "record 36 does not exist; .* has 0 to 35"),
        ([0.5], "record 0.5: give a number, an id, a slice, or a list"),
        (np.array([True, False]), "2 values of True and False for 36 records"),
    ],
)
def test_records_that_do_not_exist_are_named(data, records, message):
    with pytest.raises(DatasetError, match=message):
        data.signals(records)


def test_a_data_frame_has_the_columns_and_the_numbers_of_the_records(data):
    frame = data.to_pandas()
    plain = [name for name in data.column_names if data.column(name).ndim == 1]
    assert frame.columns.tolist() == plain
    for name in plain:
        assert_array_equal(frame[name].to_numpy(), data.column(name))
    assert all(isinstance(name, str) for name in frame["label_name"])
    part = data.where(label=2).to_pandas(["label_name", "params/crack_depth_mm"])
    assert part.index.tolist() == data.where(label=2).index.tolist()
    assert part.columns.tolist() == ["label_name", "params/crack_depth_mm"]
    with refused("'noise_power' holds several values a record", DatasetError):
        data.to_pandas(["noise_power"])


def test_without_pandas_it_says_what_to_install(data, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with refused(install("pandas"), DatasetError):
        data.to_pandas()


def test_few_files_stay_open(data, monkeypatch):
    monkeypatch.setattr(shard_files, "MAX_OPEN_SHARDS", 2)
    for index in (0, 10, 20, 30, 0):
        data.signals(index)
    assert len(data._shards._files) == 2


def test_split(data):
    split = data.split("by_unit")
    assert list(split) == ["train", "validation", "test"]
    numbers = [number for part in split.values() for number, _, _ in part]
    assert sorted(numbers) == list(range(36))
    assert all(part[0][1:] == (0.0, 1.0) for part in split.values())
    assert sum(map(len, data.split("random_window_leaky").values())) == 8 * 36


def test_mistakes_are_one_line(data):
    for call in (
        lambda: data.column("acceleration"),
        lambda: data.split("../plan"),
        lambda: data.signals(36),
        lambda: data.signals(-1),
        lambda: data.signals(0, 5, 5),
        lambda: data.signals(0, 0, 201),
        lambda: data.signals(0, channels=["z"]),
        lambda: data.signals(0, channels=[2]),
        lambda: data.signals(0, name="acceleration_clean"),
        lambda: data.signals(0, name="label"),
    ):
        with refused("", DatasetError):
            call()


def test_incomplete_set_is_refused_unless_asked_for(tmp_path, plan):
    folder = build(tmp_path / "a", plan, shards=range(1, 3), close=False, failed=12)
    with refused("2 of 4 shards are done", DatasetError):
        open_dataset(folder)
    with open_dataset(folder, allow_incomplete=True) as data:
        assert data.usable.tolist() == [10 <= i < 30 and i != 12 for i in range(36)]
        assert data.column("record_id")[0] == ""
        assert np.isnan(data.column("torque_nm")[:10]).all()
        assert data.column("label")[35] == -1
        expected = row_of(plan, 10)[0]["acceleration"]
        assert_array_equal(data.signals(10), expected)
        missing = r"shard-00000\.h5, which is not made yet"
        with pytest.raises(DatasetError, match=missing):
            data.signals(0)
    empty = build(tmp_path / "b", plan, shards=range(0), close=False)
    with refused("no finished shard", DatasetError):
        open_dataset(empty, allow_incomplete=True)


def test_pickle_drops_open_files(data):
    data.signals(0)
    data.column("label")
    copy = pickle.loads(pickle.dumps(data))
    assert copy._shards._files == {}
    assert_array_equal(copy.signals(35), data.signals(35))
    copy.close()


def test_reading_changes_nothing_and_works_read_only(folder):
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    for path in folder.rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    with open_dataset(folder) as data:
        data.signals(5)
        data.column("severity")
    for path in folder.rglob("*"):
        path.chmod(0o755 if path.is_dir() else 0o644)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before


def test_a_protocol_that_is_left_out_is_explained(data):
    assert "cross_specimen" not in data.left_out
    reason = "the plan has no column speed_set_rpm"
    assert data.left_out["cross_speed"] == reason
    text = f"split .cross_speed. does not exist in .*{reason}"
    with pytest.raises(DatasetError, match=text):
        data.split("cross_speed")
    del data.manifest.files["splits/by_unit.csv"]
    unknown = "gensig 0.1.0, which made the set, did not know it"
    assert data.left_out["by_unit"] == unknown
