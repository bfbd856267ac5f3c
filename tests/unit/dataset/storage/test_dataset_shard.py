"""Shards: equal bytes for equal input, written whole or not at all, foreign content refused."""

import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from dataset_samples import ATTRIBUTES, make_plan, row_of, write_shard, writer_of
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dataset.storage.atomic import sha256_file
from gensig.dataset.storage.attributes import read_attributes
from gensig.dataset.storage.guard import open_shard, read_rows
from gensig.errors import DatasetError


@pytest.mark.parametrize("compression", ["none", "gzip", "lzf", "blosc2"])
def test_what_goes_in_comes_out(tmp_path, compression):
    plan = make_plan()
    path = tmp_path / "a.h5"
    writer = write_shard(path, plan, compression=compression)
    assert writer.sha256 == sha256_file(path)
    assert writer.n_bytes == path.stat().st_size
    with open_shard(path) as file:
        assert read_attributes(file) == {"schema_version": 1, **ATTRIBUTES}
        chunks = None if compression == "none" else (1, 2, 200)
        assert file["acceleration"].chunks == chunks
        for row, index in enumerate(plan.rows(0).tolist()):
            signals, values = row_of(plan, index)
            for name, array in signals.items():
                assert_array_equal(file[name][row], array)
            for name, value in values.items():
                assert_array_equal(read_rows(file[name])[row], value)
        assert file["speed_rpm"].attrs["unit"] == b"r/min"
        assert np.isnan(file["integration_error"][...]).all()


def test_bytes_depend_neither_on_time_nor_name_nor_order(tmp_path):
    plan = make_plan()
    first = write_shard(tmp_path / "a.h5", plan).sha256
    time.sleep(1.1)  # HDF5 time stamps have a resolution of 1 s
    assert write_shard(tmp_path / "b.h5", plan).sha256 == first
    writer = writer_of(tmp_path / "c.h5", 10)
    with writer:
        for row in reversed(range(10)):
            writer.write(row, *row_of(plan, row))
    assert writer.sha256 == first
    assert write_shard(tmp_path / "d.h5", make_plan(n_classes=2)).sha256 != first


def test_exception_or_an_unwritten_row_leaves_nothing(tmp_path):
    def write_one(error=None):
        with writer_of(tmp_path / "a.h5", 2) as writer:
            writer.write(0, *row_of(make_plan(), 0))
            if error:
                raise error

    with pytest.raises(KeyboardInterrupt):
        write_one(KeyboardInterrupt)
    text = "1 of 2 rows were never written, the first is row 1"
    with refused(text, DatasetError):
        write_one()
    assert list(tmp_path.iterdir()) == []


def test_failed_record_keeps_its_parameters(tmp_path):
    writer = write_shard(tmp_path / "a.h5", make_plan(), failed=4)
    assert writer.n_failed == 1
    with open_shard(tmp_path / "a.h5") as file:
        assert np.isnan(file["acceleration"][4]).all()
        assert np.isfinite(file["acceleration"][5]).all()
        assert file["params/crack_depth_mm"][4] == pytest.approx(0.4)
        assert read_rows(file["status"]).tolist().count("failed") == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"label": 1.5}, "label: 1.5 is no value of type int16"),
        ({"label_name": "Riß"}, "ASCII text of at most 64 bytes"),
        ({"label": 2**15}, "label"),
        ({"severity": 1.2}, "outside 0"),
        ({"severity": float("nan")}, "outside 0"),
        ({"label_name": "x" * 65}, "label_name"),
        ({"label_name": 3}, "label_name"),
        ({"status": "fine"}, "status"),
        ({"speed_rmp": 3.0}, "did you mean speed_rpm"),
        ({"params/unknown": 3.0}, "not declared"),
    ],
)
def test_value_that_does_not_fit_is_refused(tmp_path, change, message):
    signals, values = row_of(make_plan(), 0)
    with writer_of(tmp_path / "a.h5") as writer:
        with refused(message, DatasetError):
            writer.write(0, signals, values | change)
        writer.write(0, signals, values)
        with refused("written already", DatasetError):
            writer.write(0, signals, values)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        ({"acceleration": np.full((2, 200), np.inf)}, "acceleration"),
        ({"acceleration": np.ones((1, 200))}, "acceleration"),
        ({"noise_power": np.ones(3)}, "noise_power"),
        ({"noise_power": None}, "signal noise_power is missing"),
        ({"torque_nm": None}, "column torque_nm is missing"),
    ],
)
def test_bad_and_missing_values_are_refused(tmp_path, signal, message):
    given = row_of(make_plan(), 0)
    wrong = [
        {name: value for name, value in (part | signal).items() if value is not None}
        for part in given
    ]
    with writer_of(tmp_path / "a.h5") as writer:
        with refused(message, DatasetError):
            writer.write(0, wrong[0], given[1] if message in wrong[0] else wrong[1])
        writer.write(0, *given)


@pytest.mark.parametrize(
    "change",
    [
        {"n_records": 0},
        {"signals": {"acceleration": (2,)}},
        {"signals": {"acceleration": (3, 200)}},
        {"signals": {"acceleration": (2, 200), "sound": (2, 200)}},
        {"params": ["../x"]},
        {"params": ["a", "a"]},
        {"compression": "zip"},
        {"sample_type": "int8"},
        {"signals": {"acceleration": (2, 200), "acceleration_scale": (2,)}},
        {"attributes": {k: v for k, v in ATTRIBUTES.items() if k != "class_names"}},
        {"attributes": ATTRIBUTES | {"schema_version": 2}},
    ],
)
def test_declaration_that_could_not_be_read_back_is_refused(tmp_path, change):
    with pytest.raises(DatasetError):
        writer_of(tmp_path / "a.h5", **change)


@pytest.mark.parametrize(
    "value", [{"a": 1}, None, ["a", 1, None], "a\0b", "x" * 70_000]
)
def test_attribute_that_would_not_come_back_is_refused(tmp_path, value):
    writer = writer_of(tmp_path / "a.h5", attributes=ATTRIBUTES | {"odd": value})
    with refused("odd", DatasetError):
        writer.__enter__()
    assert list(tmp_path.iterdir()) == []


def _replace(name, **declaration):
    """A change of a file that declares a data set anew."""

    def change(file):
        del file[name]
        file.create_dataset(name, **declaration)

    return change


def _samples(kind, **more):
    return _replace("acceleration", data=np.ones((10, 2, 200), kind), **more)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda file: file.__setitem__("params/more", h5py.SoftLink("/label")),
            "'params/more' is a link",
        ),
        (
            _replace("torque_nm", shape=(10,), dtype="f8", external="/tmp/no.bin"),
            "in another file",
        ),
        (
            _replace("label_name", data=["x"] * 10, dtype=h5py.string_dtype()),
            "has type object",
        ),
        (
            _replace(
                "acceleration", shape=(10, 2, 10**9), dtype="f4", chunks=(1, 2, 9)
            ),
            "bomb",
        ),
        (_replace("torque_nm", data=np.zeros(9)), "has shape"),
        (_replace("torque_nm", data=np.zeros((10, 1))), "axes"),
        (_replace("label", data=np.zeros(10)), "has type"),
        (_samples("i4"), "wants float32 or int16"),
        (_samples("u2"), "wants float32 or int16"),
        (_samples("i2"), "no data set acceleration_scale"),
        (_samples("f8", scaleoffset=2), "allowed are gzip, lzf and blosc2"),
        (lambda file: file.attrs.update(schema_version=3), "format version 3"),
        (lambda file: file.attrs.update(sampling_rate_hz=np.nan), "positive"),
        (lambda file: file.attrs.update(channel_names=3), "list of text"),
        (lambda file: file.pop("status"), "no data set status"),
        (lambda file: file.attrs.pop("class_names"), "no root attribute class_names"),
    ],
)
def test_stranger_is_refused(tmp_path, change, message):
    path = tmp_path / "a.h5"
    write_shard(path, make_plan())
    with h5py.File(path, "r+") as file:
        file.create_dataset("from_the_future", data=np.zeros((10, 2)))
    open_shard(path).close()  # an unknown column is ignored
    with h5py.File(path, "r+") as file:
        change(file)
    with refused(message, DatasetError):
        open_shard(path)


def test_a_link_in_a_folder_is_refused(tmp_path):
    (tmp_path / "in").mkdir()
    write_shard(tmp_path / "a.h5", make_plan())
    (tmp_path / "in" / "a.h5").symlink_to(tmp_path / "a.h5")
    open_shard(tmp_path / "in" / "a.h5").close()
    with refused("symbolic link", DatasetError):
        open_shard(tmp_path / "in" / "a.h5", folder=tmp_path / "in")


def test_no_hdf5_and_truncated_are_one_line(tmp_path):
    path = tmp_path / "a.h5"
    write_shard(path, make_plan())
    path.write_bytes(path.read_bytes()[:-1000])
    (tmp_path / "b.h5").write_text("hello")
    for name in ("a.h5", "b.h5", "missing.h5"):
        with refused(name, DatasetError):
            open_shard(tmp_path / name)


FULL_DISK = """
import resource, sys
from pathlib import Path
from dataset_samples import make_plan, write_shard
from gensig.errors import DatasetError

folder = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
try:
    write_shard(folder / "a.h5", make_plan())
except DatasetError as error:
    sys.exit(str(error))
"""


@pytest.mark.parametrize(
    ("limit", "files", "error"),
    [("20000", [], ["cannot write"]), ("10000000", ["a.h5"], [])],
)
def test_full_disk_is_one_line_and_leaves_nothing(tmp_path, limit, files, error):
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path), limit]
    folder = Path(__file__).parents[1]
    run = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert [path.name for path in tmp_path.iterdir()] == files
    assert [line[: len("cannot write")] for line in run.stderr.splitlines()] == error


def test_exception_while_renaming_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(*_):
        assert len(list(tmp_path.iterdir())) == 1  # the temporary file is there
        raise KeyboardInterrupt

    monkeypatch.setattr("gensig.dataset.storage.atomic.os.replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_shard(tmp_path / "a.h5", make_plan())
    assert list(tmp_path.iterdir()) == []


def test_a_reason_becomes_ascii_and_is_cut(tmp_path):
    signals, values = row_of(make_plan(), 0, status="failed")
    with writer_of(tmp_path / "a.h5") as writer:
        writer.write(0, signals, values | {"status_reason": "gap of 3 µm " + "x" * 300})
    with h5py.File(tmp_path / "a.h5") as file:
        reason = file["status_reason"][0]
    assert reason.startswith(b"gap of 3 \\xb5m xxx")
    assert len(reason) == 256
