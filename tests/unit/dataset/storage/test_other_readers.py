"""Shards load with Hugging Face `datasets`, pandas and plain HDF5 programs."""

import re
from pathlib import Path

import datasets
import h5py
import numpy as np
import pandas
import pytest
from dataset_samples import build, make_plan, row_of
from numpy.testing import assert_allclose, assert_array_equal

from gensig.dataset.folder.layout import shard_path

FORMAT = (Path(__file__).parents[4] / "docs" / "format.md").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _offline(tmp_path, monkeypatch):
    """`datasets` keeps what it read in the test's own folder."""
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")
    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    datasets.disable_progress_bars()


def example(word):
    """The Python example of docs/format.md that has a word."""
    codes = re.findall(r"```python\n(.*?)```", FORMAT, re.DOTALL)
    (code,) = [code for code in codes if word in code]
    return code


@pytest.mark.parametrize(("sample_type", "error"), [("float32", 0), ("int16", 1e-4)])
def test_hugging_face_example_of_the_format(tmp_path, plan, sample_type, error):
    """The example in docs/format.md runs, and gives every record of every shard."""
    folder = build(tmp_path / "set", plan, sample_type=sample_type)
    names = {}
    exec(example("load_dataset").replace("DIR", str(folder)), names)
    records = names["records"]
    expected = row_of(plan, 0)[0]["acceleration"]
    assert_allclose(names["signal"], expected, rtol=0, atol=error)
    for name in ("record_id", "label_name"):
        result = [text.decode() for text in records[name][:]]
        assert_array_equal(result, plan.columns[name])
    assert_array_equal(records["label"][:], plan.columns["label"])


def test_hugging_face_takes_the_folder_by_its_card(folder):
    """The front matter of README.md says where the records are, so that splits and index are no
    records."""
    records = datasets.load_dataset(str(folder), split="train")
    assert len(records) == 36
    assert "start_fraction" not in records.column_names
    assert np.array(records[7]["acceleration"]).shape == (2, 200)


def test_pandas(folder, plan):
    """Every column with one value a record becomes one of a frame."""
    names = {}
    exec(example("pandas").replace("DIR", str(folder)), names)
    frame = names["labels"]
    assert isinstance(frame, pandas.DataFrame)
    assert frame["label_name"].tolist() == plan.columns["label_name"][:10].tolist()
    means = frame.groupby("label_name")["speed_rpm"].mean()
    assert means["crack"] == pytest.approx(1804.0)


def check_type(kind, is_attribute):
    """A type of HDF5 is one that MATLAB and Octave take."""
    if isinstance(kind, h5py.h5t.TypeStringID):
        utf8 = {True: h5py.h5t.CSET_UTF8, False: h5py.h5t.CSET_ASCII}
        assert not kind.is_variable_str()
        assert kind.get_strpad() == h5py.h5t.STR_NULLPAD
        assert kind.get_cset() == utf8[is_attribute]  # Octave reads no attributes
        assert kind.get_size() > 0
    else:
        assert type(kind) in (h5py.h5t.TypeIntegerID, h5py.h5t.TypeFloatID)
        assert kind.get_order() in (h5py.h5t.ORDER_LE, h5py.h5t.ORDER_NONE)
        assert kind.get_size() in (1, 2, 4, 8)


@pytest.mark.parametrize(("sample_type", "n_bytes"), [("float32", 4), ("int16", 2)])
def test_types_are_those_old_programs_know(tmp_path, sample_type, n_bytes):
    """MATLAB and Octave are not run here: what their HDF5 readers cannot take is looked for in the
    file itself."""
    plan = make_plan(n_records=4, records_per_shard=4)
    folder = build(tmp_path / "set", plan, sample_type=sample_type)
    path = shard_path(folder, 0)
    # superblock version 0, which every HDF5 library reads
    assert path.read_bytes()[8] == 0
    with h5py.File(path, locking=False) as file:
        items = [*file.values(), *file["params"].values()]
        result = [item for item in items if isinstance(item, h5py.Dataset)]
        attributes = [file.attrs.get_id(name) for name in file.attrs]
        assert len(result) > 10
        for stored in [*(item.id for item in result), *attributes]:
            check_type(stored.get_type(), stored in attributes)
            extent = stored.get_space().get_simple_extent_type()
            assert extent in (h5py.h5s.SCALAR, h5py.h5s.SIMPLE)
        assert not any(item.is_virtual or item.external for item in result)
        signal, label = file["acceleration"].id, file["label"].id
        assert signal.get_type().get_size() == n_bytes
        assert signal.get_create_plist().get_nfilters() == 0
        layout = label.get_create_plist().get_layout()
        assert layout in (h5py.h5d.CONTIGUOUS, h5py.h5d.COMPACT)


def test_text_is_read_the_way_octave_asks_for_it(folder):
    """Octave's `load` wants every text as NUL-terminated ASCII and gives up at the first that
    cannot be had so."""
    with h5py.File(shard_path(folder, 0), locking=False) as file:
        for name in ("record_id", "label_name", "status_reason"):
            data = file[name]
            expected = h5py.h5t.C_S1.copy()
            expected.set_size(data.dtype.itemsize + 1)
            values = np.zeros(data.shape, f"S{expected.get_size()}")
            data.id.read(h5py.h5s.ALL, h5py.h5s.ALL, values, mtype=expected)
            assert_array_equal(values, data[:])
