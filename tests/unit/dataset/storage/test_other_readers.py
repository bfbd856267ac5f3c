"""Shards load with Hugging Face `datasets`, pandas and plain HDF5 programs."""

import re
from pathlib import Path

import datasets
import h5py
import numpy as np
import pandas
import pytest
from dataset_samples import build, make_plan, row_of

from gensig.dataset.folder.layout import shard_path

FORMAT = (Path(__file__).parents[4] / "docs" / "format.md").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _offline(tmp_path, monkeypatch):
    """`datasets` keeps what it read in the test's own folder."""
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")
    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    datasets.disable_progress_bars()


@pytest.mark.parametrize("sample_type", ["float32", "int16"])
def test_hugging_face_example_of_the_format(tmp_path, plan, sample_type):
    """The example in docs/format.md runs, and gives every record of every shard."""
    folder = build(tmp_path / "set", plan, sample_type=sample_type)
    (code,) = [
        example
        for example in re.findall(r"```python\n(.*?)```", FORMAT, re.DOTALL)
        if "load_dataset" in example
    ]
    names = {}
    exec(code.replace("DIR", str(folder)), names)
    records = names["records"]
    assert len(records) == 36
    expected = row_of(plan, 0)[0]["acceleration"]
    np.testing.assert_allclose(
        names["signal"], expected, rtol=0, atol=1e-4 if sample_type == "int16" else 0
    )
    for name in ("record_id", "label_name"):
        np.testing.assert_array_equal(
            [text.decode() for text in records[name][:]], plan.columns[name]
        )
    np.testing.assert_array_equal(records["label"][:], plan.columns["label"])


def test_hugging_face_takes_the_folder_by_its_card(folder):
    """The front matter of README.md says where the records are, so that splits and index are no
    records."""
    records = datasets.load_dataset(str(folder), split="train")
    assert len(records) == 36
    assert "start_fraction" not in records.column_names
    assert np.array(records[7]["acceleration"]).shape == (2, 200)


def test_pandas(folder, plan):
    """The example in docs/format.md: every column with one value a record becomes one of a
    frame."""
    (code,) = [
        example
        for example in re.findall(r"```python\n(.*?)```", FORMAT, re.DOTALL)
        if "pandas" in example
    ]
    names = {}
    exec(code.replace("DIR", str(folder)), names)
    frame = names["labels"]
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == 10
    assert frame["label_name"].tolist() == plan.columns["label_name"][:10].tolist()
    assert frame.groupby("label_name")["speed_rpm"].mean()["crack"] == pytest.approx(
        1804.0
    )


@pytest.mark.parametrize("sample_type", ["float32", "int16"])
def test_types_are_those_old_programs_know(tmp_path, sample_type):
    """MATLAB and Octave are not run here: what their HDF5 readers cannot take is looked for in the
    file itself."""
    folder = build(
        tmp_path / "set",
        make_plan(n_records=4, records_per_shard=4),
        sample_type=sample_type,
    )
    path = shard_path(folder, 0)
    assert (
        path.read_bytes()[8] == 0
    )  # superblock version 0, which every HDF5 library reads
    with h5py.File(path, locking=False) as file:
        found = []
        file.visititems(
            lambda name, item: (
                found.append(name) if isinstance(item, h5py.Dataset) else None
            )
        )
        assert {"acceleration", "label_name", "params/crack_depth_mm"} <= set(found)
        types = {name: file[name].id.get_type() for name in found}
        types |= {
            f"attribute {name}": file.attrs.get_id(name).get_type()
            for name in file.attrs
        }
        for name, kind in types.items():
            if isinstance(kind, h5py.h5t.TypeStringID):
                assert not kind.is_variable_str(), name
                assert kind.get_strpad() == h5py.h5t.STR_NULLPAD, name
                utf8 = name.startswith("attribute")  # Octave reads no attributes
                assert kind.get_cset() == (
                    h5py.h5t.CSET_UTF8 if utf8 else h5py.h5t.CSET_ASCII
                ), name
                assert kind.get_size() > 0, name
            else:
                assert type(kind) in (h5py.h5t.TypeIntegerID, h5py.h5t.TypeFloatID), (
                    name
                )
                assert kind.get_order() in (h5py.h5t.ORDER_LE, h5py.h5t.ORDER_NONE), (
                    name
                )
                assert kind.get_size() in (1, 2, 4, 8), name
        spaces = {name: file[name].id.get_space() for name in found}
        spaces |= {
            f"attribute {name}": file.attrs.get_id(name).get_space()
            for name in file.attrs
        }
        allowed = (h5py.h5s.SCALAR, h5py.h5s.SIMPLE)
        assert all(
            space.get_simple_extent_type() in allowed for space in spaces.values()
        )
        assert file["acceleration"].id.get_type().get_size() == (
            2 if sample_type == "int16" else 4
        )
        assert all(
            not file[name].is_virtual and not file[name].external for name in found
        )
        assert file["acceleration"].id.get_create_plist().get_nfilters() == 0
        layout = file["label"].id.get_create_plist().get_layout()
        assert layout in (h5py.h5d.CONTIGUOUS, h5py.h5d.COMPACT)


def test_text_is_read_the_way_octave_asks_for_it(folder, plan):
    """Octave's `load` wants every text as NUL-terminated ASCII and gives up at the first that
    cannot be had so."""
    with h5py.File(shard_path(folder, 0), locking=False) as file:
        texts = [
            name
            for name, data in file.items()
            if isinstance(data, h5py.Dataset) and data.dtype.kind == "S"
        ]
        assert {"record_id", "label_name", "status_reason"} <= set(texts)
        for name in texts:
            data = file[name].id
            wanted = h5py.h5t.C_S1.copy()
            wanted.set_size(data.get_type().get_size() + 1)
            values = np.zeros(data.shape, f"S{wanted.get_size()}")
            data.read(h5py.h5s.ALL, h5py.h5s.ALL, values, mtype=wanted)
            np.testing.assert_array_equal(values, file[name][:])
        assert (
            file["label_name"][:].astype(str).tolist()
            == plan.columns["label_name"][:10].tolist()
        )


def test_utf8_text_could_not_be_read_that_way(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["text"] = np.array([b"crack"], dtype=h5py.string_dtype("utf-8", 8))
        wanted = h5py.h5t.C_S1.copy()
        wanted.set_size(9)
        with pytest.raises(OSError, match="conversion path"):
            file["text"].id.read(
                h5py.h5s.ALL, h5py.h5s.ALL, np.zeros(1, "S9"), mtype=wanted
            )
