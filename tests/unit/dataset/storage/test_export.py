"""Exports hold the same numbers for the libraries that read them."""

import csv
import json
import weakref

import h5py
import numpy as np
import pandas
import pytest
from dataset_samples import ATTRIBUTES, CLASSES, build, make_plan
from numpy.testing import assert_array_equal
from pyarrow import parquet
from refusals import refused
from scipy.io import wavfile

import gensig.dataset.exports.export as export_module
import gensig.dataset.exports.export_tables as tables_module
from gensig.cli import main
from gensig.dataset.exports.export import FORMATS, export
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.storage.attributes import read_attributes
from gensig.dataset.storage.guard import open_shard, read_rows
from gensig.errors import DatasetError

NAMES = {
    "hdf5": "all.h5",
    "parquet": "all.parquet",
    "npz": "all.npz",
    "wav": "all",
    "hf": "hub",
}


@pytest.fixture(scope="module", params=["float32", "int16"])
def stored(request, tmp_path_factory):
    """A data set with a failed record and clean signals, in both ways to store samples."""
    out = tmp_path_factory.mktemp("stored") / "set"
    return build(out, make_plan(), failed=12, clean=True, sample_type=request.param)


def _signals(folder, name="acceleration"):
    with open_dataset(folder) as data:
        return np.stack([data.signals(index, name=name) for index in range(36)])


def _columns(folder):
    with open_dataset(folder) as data:
        names = [name for name in data.column_names if not name.endswith("_scale")]
        return {name: data.column(name) for name in names}


def _check_arrays(found, stored):
    """Signals and columns are those of the data set, in physical units."""
    for name in ("acceleration", "acceleration_clean"):
        assert_array_equal(found[name][...], _signals(stored, name))
        assert found[name].dtype == np.float32
    for name, values in _columns(stored).items():
        assert_array_equal(found[name][...], values)


def test_hdf5_is_one_shard_in_physical_units(stored, tmp_path):
    out = tmp_path / "all.h5"
    made = export(stored, "hdf5", out)
    assert made == {"records": 36, "files": 1, "bytes": out.stat().st_size}
    shard_file = shard_path(stored, 0)
    with open_shard(out) as file, h5py.File(shard_file, locking=False) as shard:
        assert read_attributes(file) == {"schema_version": 1, **ATTRIBUTES}
        assert "acceleration_scale" not in file
        assert file["acceleration"].attrs["unit"] == b"m/s^2"
        columns = {name: read_rows(file[name]) for name in _columns(stored)}
        _check_arrays({**file, **columns}, stored)
        for name in columns:
            assert file[name].dtype == shard[name].dtype


def test_npz_needs_no_pickle(stored, tmp_path):
    out = tmp_path / "all.npz"
    export(stored, "npz", out)
    with np.load(out, allow_pickle=False) as arrays:
        _check_arrays(arrays, stored)
        attributes = json.loads(str(arrays["attributes_json"]))
    assert attributes == {"schema_version": 1, **ATTRIBUTES}


@pytest.mark.parametrize("samples", [False, True])
def test_parquet(stored, tmp_path, samples, monkeypatch):
    monkeypatch.setattr(tables_module, "ROW_GROUP_BYTES", 3 * 2 * 2 * 200 * 4)
    out = tmp_path / "all.parquet"
    export(stored, "parquet", out, samples=samples)
    frame = pandas.read_parquet(out)
    for name, values in _columns(stored).items():
        assert_array_equal(frame[name].tolist(), values.tolist())
    assert ("acceleration" in frame) is samples
    if samples:
        result = [np.stack(channels) for channels in frame["acceleration"]]
        assert_array_equal(result, _signals(stored))
    file = parquet.ParquetFile(out)
    assert file.schema_arrow.field("speed_rpm").metadata[b"unit"] == b"r/min"
    assert json.loads(file.schema_arrow.metadata[b"gensig"])["class_names"] == CLASSES
    # with samples 3 rows a group, 10, 10, 10 and 6 a shard
    assert file.num_row_groups == {True: 4 + 4 + 4 + 2, False: 4}[samples]


@pytest.mark.parametrize("n_files", [36, 72])
def test_wav(stored, tmp_path, n_files):
    out = tmp_path / "all"
    one_channel = n_files == 72
    made = export(stored, "wav", out, one_channel=one_channel)
    signals = _signals(stored)
    with (out / "labels.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert made["files"] - 2 == len(rows) == n_files
    for number, row in enumerate(rows):
        record, channel = divmod(number, n_files // 36)
        channels = channel if one_channel else slice(None)
        rate, samples = wavfile.read(out / row["file"])
        assert (rate, samples.dtype) == (1000, np.float32)
        assert_array_equal(samples.T, signals[record, channels])
        assert row["record_id"] == f"r{record:06d}"
        assert float(row["speed_rpm"]) == 1800.0 + record
        if one_channel:
            assert row["channel"] == ATTRIBUTES["channel_names"][channel]
    attributes = json.loads((out / "attributes.json").read_text(encoding="utf-8"))
    assert attributes["channel_units"] == ["m/s^2", "m/s^2"]


@pytest.mark.parametrize("to", FORMATS)
def test_nothing_is_overwritten_and_nothing_half_written(folder, tmp_path, to):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    with refused("exists and is left alone", DatasetError):
        export(folder, to, taken)
    assert taken.read_text() == "mine"
    out = tmp_path / NAMES[to]
    shard_path(folder, 3).write_bytes(shard_path(folder, 3).read_bytes()[:-2000])
    before = {path.name for path in tmp_path.iterdir()}
    with refused("", DatasetError):
        export(folder, to, out, samples=to == "parquet")
    assert {path.name for path in tmp_path.iterdir()} == before


def test_a_full_disk_is_said_before_anything_is_written(folder, tmp_path, monkeypatch):
    usage = type("Usage", (), {"free": 36 * 2 * 200 * 4 - 1})
    monkeypatch.setattr(export_module.shutil, "disk_usage", lambda _path: usage)
    with refused("57600 bytes and 57599 are free", DatasetError):
        export(folder, "hdf5", tmp_path / "all.h5")
    assert not (tmp_path / "all.h5").exists()
    usage.free += 1  # all of the disk may be filled
    export(folder, "hdf5", tmp_path / "all.h5")
    assert (tmp_path / "all.h5").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--to matlab --out OUT/x", "allowed are hdf5, parquet, npz, wav"),
        ("--to npz --out OUT/no/x", "there is no folder"),
        ("--to npz --out OUT/set/x.npz", "lies in the data set"),
        ("--to npz --samples --out OUT/x", "'samples' belongs to parquet"),
        ("--to npz --one-channel --out OUT/x", "'one_channel' to wav"),
    ],
)
def test_mistakes_are_one_line(folder, capsys, words, message):
    arguments = words.replace("OUT", str(folder.parent)).split()
    assert main(["export", str(folder), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_the_command_names_what_it_wrote(folder, tmp_path, capsys):
    out = str(tmp_path / "x.npz")
    assert main(["export", str(folder), "--to", "npz", "--out", out]) == 0
    assert "36 records as npz, 1 file(s)" in capsys.readouterr().out


def test_a_foreign_plan_names_no_file(folder, tmp_path):
    """Ids become file names, so that a shard cannot choose where a wav file goes."""
    with h5py.File(shard_path(folder, 0), "r+") as file:
        file["record_id"][1] = b"../../evil"
    with refused("different record ids", DatasetError):
        export(folder, "wav", tmp_path / "all")
    assert not list(tmp_path.rglob("evil*"))


def test_incomplete_sets_and_odd_rates_are_refused(tmp_path, plan, monkeypatch):
    with refused("is incomplete", DatasetError):
        export(build(tmp_path / "a", plan, close=False), "npz", tmp_path / "x.npz")
    monkeypatch.setitem(ATTRIBUTES, "sampling_rate_hz", 1000.5)
    folder = build(tmp_path / "b", plan)
    with refused("whole hertz", DatasetError):
        export(folder, "wav", tmp_path / "x")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("to", FORMATS)
def test_few_records_are_in_memory_at_once(folder, tmp_path, to, monkeypatch):
    monkeypatch.setattr(tables_module, "ROW_GROUP_BYTES", 3 * 2 * 200 * 4)
    read, alive, most = Dataset.signals, set(), [0]

    def watched(*arguments, **options):
        signal = read(*arguments, **options)
        alive.add(id(signal))
        weakref.finalize(signal, alive.discard, id(signal))
        most[0] = max(most[0], len(alive))
        return signal

    monkeypatch.setattr(Dataset, "signals", watched)
    export(folder, to, tmp_path / NAMES[to], samples=to == "parquet")
    assert 1 <= most[0] <= 4
