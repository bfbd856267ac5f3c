"""Sets of a stranger, every digest recomputed: some forgeries of
``python -m benchmarks.fuzz_campaign --forged``, which calls every verb on hundreds."""

import shutil

import h5py
import numpy as np
import pytest
from dataset_samples import build, make_plan
from refusals import refused

from benchmarks import _forged_hdf5 as hdf5
from benchmarks import _forged_tables as tables
from benchmarks._damaged_folders import forge
from benchmarks._forged_sets import FORGERIES, REFUSED
from gensig.cli import main
from gensig.dataset import plan
from gensig.dataset.folder.inspection import inspect
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.dataset.splitting.splits import read_split
from gensig.dataset.storage import guard
from gensig.dataset.storage.guard import open_shard
from gensig.errors import DatasetError

RNG = 0
ONE_LINE = r"^[^\n]*$"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    plan = make_plan(n_records=24, records_per_shard=8, n_units=4, n_classes=3)
    return build(tmp_path_factory.mktemp("whole") / "set", plan, labelled=True)


@pytest.fixture
def folder(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "set")


def refused_by_all(folder, words, tmp_path, capsys):
    """Verify, inspect, report, export and open_dataset name a forgery in one line."""
    (problem,) = verify(folder).problems[:1]
    assert words in problem
    assert "\n" not in problem
    for read in (open_dataset, inspect):
        with pytest.raises(DatasetError, match=ONE_LINE) as caught:
            read(folder)
        assert words in str(caught.value)
    export = ["export", str(folder), "--to", "npz", "--out", str(tmp_path / "x.npz")]
    for command in (["report", str(folder)], export):
        capsys.readouterr()
        assert main(command) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert words in line


def test_the_good_set_is_signed_again_without_complaint(folder):
    forge(folder)
    hdf5.every_shard(folder, lambda file: None)
    assert verify(folder).problems == []
    assert inspect(folder)
    open_dataset(folder).close()


UNITS = "attribute channel_units"
ROWS = "plan.csv has 24 records and the manifest"
MANY = np.array([b"a" * 400] * 200)
FORGED = {
    "units of numbers": (hdf5.attribute_value("channel_units", [1, 2]), UNITS),
    "one unit": (hdf5.attribute_value("channel_units", "m/s^2"), UNITS),
    "units too many": (hdf5.attribute_value("channel_units", MANY), UNITS),
    "names too many": (
        hdf5.attribute_value("channel_names", MANY),
        "more than 60000 bytes",
    ),
    "teeth": (hdf5.attribute_value("n_teeth_pinion", -1), "attribute n_teeth_pinion"),
    "band": (hdf5.attribute_value("usable_band_hz", [2.0, 1.0]), "usable_band_hz"),
    "unit": (
        hdf5.attribute_value("unit", 5, where="acceleration"),
        "has a unit of type",
    ),
    "no sample": (hdf5.resized("acceleration", (2, 0)), "at least one channel"),
    "rows": (tables.manifest_rows("done"), ROWS),
    "shards": (tables.many_shards("done"), ROWS),
    "files": (tables.manifest_change(tables.listed_files), "files beside the shards"),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_set_is_refused_in_one_line(
    name, folder, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(tables, "COUNTS", (10**8,))
    monkeypatch.setattr(tables, "MANY_SHARDS", (100,))
    forgery, words = FORGED[name]
    forgery(folder, np.random.default_rng(RNG))
    refused_by_all(folder, words, tmp_path, capsys)


def test_what_one_record_may_take_is_bounded(folder, monkeypatch):
    options = {"chunks": (1, 2, 50_000), "compression": "gzip"}
    resize = hdf5.resized("acceleration", (2, 50_000), **options)
    resize(folder, np.random.default_rng(RNG))
    with h5py.File(folder / "shards" / "shard-00000.h5", "r+") as file:
        file["acceleration"][...] = np.random.default_rng(0).normal(size=(8, 2, 50_000))
    path = folder / "shards" / "shard-00000.h5"
    open_shard(path).close()
    monkeypatch.setattr(guard, "COMPRESSED_LIMIT", 399_999)
    with pytest.raises(DatasetError, match="it was never written or is a bomb"):
        open_shard(path)


@pytest.mark.parametrize("count", [10**9, 2**63 - 1, 2**63, 10**30])
def test_no_count_of_a_manifest_is_believed(
    count, folder, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(tables, "COUNTS", (count,))
    tables.manifest_rows("done")(folder, np.random.default_rng(RNG))
    refused_by_all(folder, "at most 715827882 is possible", tmp_path, capsys)


def soft_link(file):
    del file["label"]
    file["label"] = h5py.SoftLink("/fault_tooth")


def external_link(file):
    del file["label"]
    file["label"] = h5py.ExternalLink("/etc/outside.h5", "/label")


def mapped(source, column="label", n_rows=24):
    """The index with a data set that is mapped to one other source."""

    def change(file):
        dtype = file["label"].dtype
        del file["label"]
        layout = h5py.VirtualLayout((n_rows,), dtype)
        layout[:8] = h5py.VirtualSource(source, column, (8,))
        for number in (1, 2):
            part = h5py.VirtualSource(f"shards/shard-0000{number}.h5", "label", (8,))
            layout[8 * number : 8 * number + 8] = part
        file.create_virtual_dataset("label", layout, fillvalue=-1)

    return change


def stored(file):
    values = np.zeros(24, file["label"].dtype)
    del file["label"]
    file["label"] = values


def outside(file):
    del file["label"]
    file.create_dataset("label", (24,), "i2", external=[("/etc/passwd", 0, 48)])


def other_attribute(file):
    file.attrs["class_names"] = ["a", "b"]


INDEXES = {
    "soft link": (soft_link, "is a link"),
    "external link": (external_link, "is a link"),
    "absolute source": (mapped("/etc/outside.h5"), "is mapped to '/etc/outside.h5'"),
    "source outside": (mapped("../outside.h5"), "is mapped to '../outside.h5'"),
    "source through shards": (mapped("shards/../../outside.h5"), "is mapped to"),
    "another shard": (
        mapped("shards/shard-00001.h5"),
        "is mapped to 'shards/shard-00001.h5'",
    ),
    "another column": (
        mapped("shards/shard-00000.h5", "repeat"),
        "to another data set",
    ),
    "more rows": (
        mapped("shards/shard-00000.h5", n_rows=10**12),
        "shape (1000000000000,)",
    ),
    "values of its own": (stored, "holds or names data of its own"),
    "external storage": (outside, "holds or names data of its own"),
    "a data set more": (
        lambda file: file.create_dataset("x", data=1),
        "has besides those",
    ),
    "a data set less": (
        lambda file: file.__delitem__("label"),
        "lacks the data set 'label'",
    ),
    "attribute": (other_attribute, "other attributes than the shards"),
}


@pytest.mark.parametrize("name", INDEXES)
def test_an_index_that_is_not_over_the_shards_is_refused(
    name, folder, tmp_path, capsys
):
    change, words = INDEXES[name]
    with h5py.File(folder / "index.h5", "r+") as file:
        change(file)
    forge(folder)
    refused_by_all(folder, words, tmp_path, capsys)


def test_the_twin_of_those_changes_is_taken(folder):
    """The mapping that the tests above change, made by hand as gensig makes it."""
    with h5py.File(folder / "index.h5", "r+") as file:
        mapped("shards/shard-00000.h5")(file)
        file["label"].attrs["unit"] = "1"
    forge(folder)
    assert verify(folder).problems == []
    open_dataset(folder).close()


def test_a_label_without_a_class_is_named(folder):
    hdf5.data_values("label", 7)(folder, np.random.default_rng(RNG))
    assert any(
        "it has the label 7, and 3 classes" in line for line in verify(folder).problems
    )
    with (
        open_dataset(folder) as data,
        pytest.raises(DatasetError, match="it has the label 7, and 3 classes"),
    ):
        data.column("label")


def test_one_long_text_does_not_widen_a_column_without_bound():
    assert plan._texts("a", ("x", "x" * 1000)).dtype.itemsize == 4000
    with refused("which would take 2000000000 bytes in 5000 records", DatasetError):
        plan._texts("a", ("x",) * 4999 + ("x" * 100_000,))


def test_a_split_is_bounded_by_the_records_of_the_plan(folder):
    path = folder / "splits" / "by_unit.csv"
    rows = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*rows, rows[1] * 2000]))
    assert len(read_split(path).record_id) > 2000
    with refused("bytes, at most 32896 are allowed", DatasetError):
        read_split(path, n_records=4)


def test_every_forgery_that_must_be_refused_is_one():
    assert FORGERIES.keys() >= REFUSED
