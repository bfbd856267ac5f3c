"""Exports hold the subset of every record, as text, for every protocol that keeps units apart."""

import csv
import json

import h5py
import numpy as np
import pandas
import pytest
from dataset_samples import build
from numpy.testing import assert_array_equal
from split_samples import FAILED, LEAKY, REFERENCES, every_protocol_plan

from gensig.dataset.exports.export import FORMATS, export
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.splitting.splits import SUBSETS, read_split
from gensig.dataset.storage.guard import open_shard

CLEAN = {f"split/{name}" for name in PROTOCOLS if name != LEAKY}
TABLES = [name for name in FORMATS if name != "hf"]
TEXTS = ("record_id", "label_name", "unit_id", "faults_json", "status_reason")


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    out = tmp_path_factory.mktemp("stored") / "set"
    return build(out, every_protocol_plan(), failed=FAILED, references=True)


def text_columns(path, to):
    """Columns of text of an export, read without gensig: name -> list of str."""
    if to == "parquet":
        frame = pandas.read_parquet(path)
        return {name: frame[name].tolist() for name in frame if is_text(frame[name])}
    if to == "npz":
        with np.load(path, allow_pickle=False) as arrays:
            texts = {name: arrays[name] for name in arrays if arrays[name].ndim == 1}
        kinds = {name: values.dtype.kind for name, values in texts.items()}
        return {name: texts[name].tolist() for name in texts if kinds[name] == "U"}
    if to == "wav":
        with (path / "labels.csv").open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        return {name: [row[name] for row in rows] for name in rows[0]}
    texts = {}

    def collect(name, item):
        is_data = isinstance(item, h5py.Dataset)
        if is_data and h5py.check_string_dtype(item.dtype) is not None:
            texts[name] = item.asstr()[:].tolist()

    with h5py.File(path) as file:
        file.visititems(collect)
    return texts


def is_text(column):
    return pandas.api.types.is_string_dtype(column)


@pytest.fixture(params=TABLES)
def exported(request, stored, tmp_path):
    """Path of an export with all its protocols, the leaky one too, and its format."""
    out = tmp_path / "out"
    export(stored, request.param, out, protocols=["all", LEAKY])
    return out, request.param


def test_subsets_are_those_of_the_split_files(stored, exported):
    """Failed records keep their subset; records in none have an empty text."""
    columns = text_columns(*exported)
    ids = columns["record_id"]
    for name in CLEAN:
        table = read_split(stored / f"{name.replace('split', 'splits')}.csv")
        subsets = dict(zip(table.record_id, table.subset, strict=True))
        assert columns[name] == [subsets.get(record_id, "") for record_id in ids]
        assert set(columns[name]) == {*SUBSETS, ""}
        assert {columns[name][number] for number in REFERENCES} == {""}


def test_no_unit_is_on_two_sides(exported):
    columns = text_columns(*exported)
    for name in CLEAN:
        for group in ("unit_id", *PROTOCOLS[name.removeprefix("split/")].apart):
            pairs = set(zip(columns[group], columns[name], strict=True))
            used = [value for value, subset in pairs if subset]
            assert len(used) == len(set(used))


def test_protocols_that_cut_records_name_stretches(stored, exported):
    """JSON of [subset, start, stop], so that no record looks as if it were on one side."""
    column = text_columns(*exported)[f"split/{LEAKY}"]
    table = read_split(stored / "splits" / f"{LEAKY}.csv")
    expected = [[] for _ in range(144)]
    for record_id, start, stop, subset in table.rows():
        bounds = [round(200 * start), round(200 * stop)]
        expected[int(record_id[1:])].append([subset, *bounds])
    assert [json.loads(text) for text in column] == expected
    assert not set(column) & {*SUBSETS, ""}


def test_text_is_text(stored, exported):
    columns = text_columns(*exported)
    for name in (*TEXTS, *CLEAN):
        assert all(type(value) is str for value in columns[name])
    assert columns["label_name"][:4] == ["healthy", "crack", "pitting", "healthy"]


@pytest.mark.parametrize("to", TABLES)
def test_the_leaky_protocol_is_there_on_request_only(stored, tmp_path, to):
    export(stored, to, tmp_path / "all")
    export(stored, to, tmp_path / "one", protocols=["by_unit", "by_unit"])
    export(stored, to, tmp_path / "leaky", protocols=[LEAKY])
    every, one, leaky = (
        {
            name
            for name in text_columns(tmp_path / path, to)
            if name.startswith("split/")
        }
        for path in ("all", "one", "leaky")
    )
    assert every == CLEAN
    assert one == {"split/by_unit"}
    assert leaky == {f"split/{LEAKY}"}


def test_one_channel_a_file_repeats_the_subset(stored, tmp_path):
    export(stored, "wav", tmp_path / "both")
    export(stored, "wav", tmp_path / "one", one_channel=True)
    both = text_columns(tmp_path / "both", "wav")["split/by_unit"]
    one = text_columns(tmp_path / "one", "wav")["split/by_unit"]
    assert_array_equal(one, np.repeat(both, 2))


def test_hdf5_with_splits_is_still_a_shard(stored, tmp_path):
    export(stored, "hdf5", tmp_path / "all.h5", protocols=["all", LEAKY])
    with open_shard(tmp_path / "all.h5") as file:
        assert {f"split/{name}" for name in file["split"]} == {
            *CLEAN,
            f"split/{LEAKY}",
        }
