"""Selections of records by their columns, in plan order, with a hint for every mistake."""

import os
import time

import numpy as np
import pytest
from dataset_samples import build, row_of, write_shard
from numpy.testing import assert_array_equal
from refusals import refused

import gensig.dataset.reader as reader_module
import gensig.dataset.shard_files as shard_files
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.reader import open_dataset
from gensig.dataset.storage.guard import open_shard
from gensig.errors import DatasetError

EVERY = np.arange(36)


@pytest.mark.parametrize(
    ("conditions", "expected"),
    [
        ({}, EVERY),
        ({"fault": "crack"}, EVERY[1::3]),
        ({"label_name": ["crack", "healthy"]}, EVERY[EVERY % 3 < 2]),
        ({"label": [0, 2]}, EVERY[EVERY % 3 != 1]),
        ({"speed_rpm": (1803.0, 1807.0)}, EVERY[3:8]),  # both ends belong to the range
        ({"speed_rpm": (None, 1801)}, EVERY[:2]),
        ({"speed_rpm": 1812.0}, [12]),
        ({"fault": "crack", "speed_rpm": (1800, 1810)}, [1, 4, 7, 10]),
        ({"params/crack_depth_mm": (1.0, 2.0)}, [10, 13, 16, 19]),
        ({"crack_depth_mm": (1.0, 2.0)}, [10, 13, 16, 19]),
        ({"crack_depth_mm": float("nan")}, EVERY[EVERY % 3 != 1]),
        ({"shard": 3}, EVERY[30:]),  # a column of the plan only
        ({"unit_id": {"u0", "u5"}, "row": range(3)}, [0, 1, 2, 20]),
        ({"status": "failed"}, []),
        ({"fault": "crack", "label": 0}, []),
    ],
)
def test_conditions(data, conditions, expected):
    chosen = data.where(**conditions)
    assert_array_equal(chosen.index, expected)
    assert len(chosen) == len(expected)
    assert_array_equal(
        chosen.column("record_id"), data.column("record_id")[chosen.index]
    )


def test_choosing_reads_no_signal(data, monkeypatch):
    monkeypatch.setattr(
        reader_module, "read_signal", lambda *_: pytest.fail("a signal was read")
    )
    chosen = data.where(fault="crack").where(severity=0.25)
    assert [record.values["label_name"] for record in chosen] == ["crack"] * 12
    with pytest.raises(pytest.fail.Exception):
        chosen.signals(0)


def test_records_tables_and_arrays(data, plan):
    def stored(index, start=0, stop=None):
        return row_of(plan, index)[0]["acceleration"][:, start:stop]

    chosen = data.where(fault="pitting")
    third = chosen[2]
    assert (third.index, third.values["record_id"]) == (8, "r000008")
    assert third.values["speed_rpm"] == 1808.0
    assert third.values["signal_power"].tolist() == [1.0, 2.0]
    assert_array_equal(third.signals(5, 9), stored(8, 5, 9))
    assert_array_equal(chosen.signals(-1), stored(35))
    assert chosen.array().shape == (12, 2, 200)
    block = chosen.array(0, 50, ["wheel_ü"])
    expected = np.stack([stored(index, 0, 50)[1:] for index in chosen.index])
    assert_array_equal(block, expected, strict=True)
    table = chosen.table(["label", "unit_id"])
    assert (table.dtype.names, len(table)) == (("label", "unit_id"), 12)
    assert set(table["label"].tolist()) == {2}
    assert "noise_power" not in chosen.table().dtype.names
    assert [record.index for record in data][:3] == [0, 1, 2]
    assert data[35].values["record_id"] == "r000035"
    with pytest.raises(IndexError):
        data[36]


def test_plan_is_a_structured_table(data, plan):
    table = data.plan_table
    assert table.dtype.names == tuple(plan.columns)
    assert table[7]["record_id"] == "r000007"
    assert_array_equal(
        table["params/crack_depth_mm"], plan.columns["params/crack_depth_mm"]
    )


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ({"sped_rpm": 1}, "did you mean 'speed_rpm'"),
        ({"crack_dept_mm": 1}, "did you mean 'crack_depth_mm'"),
        ({"params/crack_depth": 1}, "did you mean 'params/crack_depth_mm'"),
        ({"xyz": 1}, "it has "),
        ({"fault": "crak"}, "did you mean 'crack'"),
        ({"fault": ["crack", "piting"]}, "did you mean 'pitting'"),
        ({"fault": ("a", "b")}, "closed range"),
        ({"fault": 1}, "holds text"),
        ({"speed_rpm": "1800"}, "holds numbers"),
        ({"speed_rpm": (1, 2, 3)}, "closed range"),
        ({"speed_rpm": (2, 1)}, "lower limit first"),
        ({"speed_rpm": {"min": 1}}, "holds numbers"),
        ({"noise_power": 1.0}, "one a record"),
    ],
)
def test_mistakes_have_a_hint(folder, conditions, message):
    with (
        open_dataset(folder) as data,
        refused(message, DatasetError),
    ):
        data.where(**conditions)


def test_a_shard_is_checked_again_only_when_it_changed(folder, plan, monkeypatch):
    checks = []

    def counted(path, **more):
        checks.append(path)
        return open_shard(path, **more)

    with open_dataset(folder) as data:
        data.signals(10)
        monkeypatch.setattr(shard_files, "open_shard", counted)
        data.close()
        data.signals(10)
        assert checks == []
        data.close()
        write_shard(folder / "other.h5", plan, 1)
        os.replace(folder / "other.h5", shard_path(folder, 1))
        data.signals(10)
        assert checks == [shard_path(folder, 1)]
        data.close()
        shard_path(folder, 1).write_bytes(b"no hdf5")
        with refused("shard-00001.h5", DatasetError):
            data.signals(10)


def test_random_access_is_quick(data):
    """The promise is 1 ms a record; the best of many tries on a busy machine stays below it."""
    data.signals(0)
    times = []
    for index in np.random.default_rng(0).integers(0, 10, 200).tolist():
        begin = time.perf_counter()
        data.signals(index)
        times.append(time.perf_counter() - begin)
    assert min(times) < 1e-3


def test_missing_shards_meet_no_condition(tmp_path, plan):
    folder = build(tmp_path / "a", plan, shards=range(1, 3), close=False, failed=12)
    made = list(range(10, 30))
    with open_dataset(folder, allow_incomplete=True) as data:
        assert data.where(torque_nm=(None, None)).index.tolist() == made
        made.remove(12)
        assert data.where(status="ok").index.tolist() == made
