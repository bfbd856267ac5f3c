"""Reading of data sets in plan order, from several processes, finished or not."""

import pickle

import numpy as np
import pytest
from dataset_samples import CLASSES, build, row_of
from numpy.testing import assert_array_equal

import gensig.dataset.reader as reader_module
from gensig.dataset.reader import open_dataset
from gensig.errors import DatasetError


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


def test_few_files_stay_open(data, monkeypatch):
    monkeypatch.setattr(reader_module, "MAX_OPEN_SHARDS", 2)
    for index in (0, 10, 20, 30, 0):
        data.signals(index)
    assert len(data._files) == 2


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
        with pytest.raises(DatasetError) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_incomplete_set_is_refused_unless_asked_for(tmp_path, plan):
    folder = build(tmp_path / "a", plan, shards=range(1, 3), close=False, failed=12)
    with pytest.raises(DatasetError, match="2 of 4 shards are done"):
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
    with pytest.raises(DatasetError, match="no finished shard"):
        open_dataset(empty, allow_incomplete=True)


def test_pickle_drops_open_files(data):
    data.signals(0)
    data.column("label")
    copy = pickle.loads(pickle.dumps(data))
    assert copy._files == {}
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
