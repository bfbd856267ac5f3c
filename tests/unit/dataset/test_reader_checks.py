"""Damage that a reader notices: on opening a set, on reading a shard, or only in a full check."""

import pickle

import h5py
import numpy as np
import pytest
from dataset_samples import build, forge, make_plan, setting, trust
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.reader import open_dataset
from gensig.dataset.storage.attributes import read_attributes
from gensig.errors import DatasetError

PLAN = make_plan(n_records=40)  # four shards of one size


@pytest.fixture(params=[True, False], ids=["labelled", "older"])
def labelled(request):
    """True where shards name their data set and number; those of older versions do not."""
    return request.param


@pytest.fixture
def folder(tmp_path, labelled):
    return build(tmp_path / "set", PLAN, labelled=labelled)


@pytest.fixture
def new_folder(tmp_path):
    return build(tmp_path / "new", PLAN, labelled=True)


def swap(folder, one, other):
    """Give two shards each other's name."""
    first, second = shard_path(folder, one), shard_path(folder, other)
    kept = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(kept)


def first_reading(folder, record):
    """The line with which the first reading of a record is refused."""
    with open_dataset(folder) as data, refused("", DatasetError) as caught:
        data.signals(record)
    return str(caught.value)


def test_a_whole_set_is_read_in_every_way(folder):
    for check in ("quick", "full"):
        with open_dataset(folder, check=check) as data:
            assert_array_equal(data.column("record_id"), PLAN.columns["record_id"])


def test_another_check_is_refused(folder):
    with pytest.raises(DatasetError, match="check='deep'; allowed are quick, full"):
        open_dataset(folder, check="deep")


def test_swapped_shards_are_noticed_on_the_first_read(folder, labelled):
    swap(folder, 1, 2)
    line = first_reading(folder, 10)
    text = "it is swapped: it says that it is shard 2" if labelled else "first record"
    assert "shard-00001.h5" in line
    assert text in line
    with open_dataset(folder) as data:
        data.signals(0)  # the others are whole
        copy = pickle.loads(pickle.dumps(data))
    with refused("shard-00001.h5", DatasetError):
        copy.signals(19)


def test_a_zeroed_shard_is_noticed_on_the_first_read(folder):
    path = shard_path(folder, 3)
    path.write_bytes(bytes(path.stat().st_size))
    assert "shard-00003.h5 cannot be read" in first_reading(folder, 35)


def test_a_shard_of_another_set_is_noticed_on_the_first_read(new_folder, tmp_path):
    other = build(tmp_path / "other", PLAN, labelled=True, seed=8)
    path = shard_path(new_folder, 2)
    path.write_bytes(shard_path(other, 2).read_bytes())
    assert path.stat().st_size == shard_path(new_folder, 1).stat().st_size
    assert "is of another data set" in first_reading(new_folder, 25)
    problems = "\n".join(verify(new_folder).problems)
    assert "shard-00002.h5 was altered" in problems


@pytest.mark.parametrize(
    ("part", "name", "value", "text"),
    [
        ("/", "schema_version", 2, "has format version 2, the manifest says 1"),
        ("/", "identity", "0" * 64, "is of another data set"),
        ("record_id", "shard_index", 0, "is swapped: it says that it is shard 0"),
    ],
)
def test_foreign_labels_are_noticed_though_every_digest_fits(
    new_folder, part, name, value, text
):
    def relabel(file):
        file[part].attrs.modify(name, value)

    assert text in forge(new_folder, 2, relabel)
    assert text in first_reading(new_folder, 25)


def test_a_shard_without_a_label_among_others_that_have_one_is_refused(new_folder):
    def unlabel(file):
        del file.attrs["identity"], file["record_id"].attrs["shard_index"]

    forge(new_folder, 2, unlabel)
    assert "another version than the other shards" in first_reading(new_folder, 25)


def test_a_shard_that_changes_while_it_is_open_is_checked_again(new_folder):
    with open_dataset(new_folder) as data:
        data.signals(10)
        data.close()
        swap(new_folder, 1, 2)
        with pytest.raises(DatasetError, match="swapped"):
            data.signals(10)


def cut(path):
    path.write_bytes(path.read_bytes()[:-1])


def lengthened(path):
    path.write_bytes(path.read_bytes() + b" ")


@pytest.mark.parametrize(
    ("name", "change", "text"),
    [
        ("shards/shard-00002.h5", cut, "shard-00002.h5 is truncated"),
        ("shards/shard-00002.h5", lengthened, "not the recorded file"),
        ("shards/shard-00002.h5", lambda path: path.unlink(), "00002.h5 is missing"),
        ("plan.csv", lengthened, "plan.csv is missing or was altered"),
        ("plan.csv", lambda path: path.unlink(), "plan.csv is missing or was altered"),
        ("manifest.json", lengthened, "manifest.json was altered"),
        ("SHA256SUMS", cut, "SHA256SUMS was altered"),
    ],
)
def test_noticed_on_opening(folder, name, change, text):
    change(folder / name)
    with refused(text, DatasetError):
        open_dataset(folder)


def test_a_set_without_checksums_is_opened(folder):
    (folder / "SHA256SUMS").unlink()
    with open_dataset(folder) as data:
        assert data.signals(39).shape == (2, 200)


def test_an_altered_split_is_noticed_when_it_is_read(folder):
    path = folder / "splits" / "by_unit.csv"
    path.write_text(path.read_text().replace(",test", ",train"))
    with open_dataset(folder) as data:
        data.split("random_window_leaky")
        with refused("by_unit.csv was altered", DatasetError):
            data.split("by_unit")
        trust(folder)
    with open_dataset(folder) as data:
        assert not data.split("by_unit")["test"]


def test_a_plan_that_changes_after_opening_is_noticed_when_it_is_read(folder):
    with open_dataset(folder) as data:
        lengthened(folder / "plan.csv")
        with refused("plan.csv was altered", DatasetError):
            _ = data.plan


def test_one_bit_of_a_sample_is_noticed_by_the_full_check_only(folder):
    with open_dataset(folder) as data:
        before = data.signals(25)
    path = shard_path(folder, 2)
    size = path.stat().st_size
    with h5py.File(path, "r+") as file:
        file["acceleration"][5, 0, 0] += np.float32(1.0)
    assert path.stat().st_size == size
    with open_dataset(folder) as data:
        assert (data.signals(25) != before).sum() == 1
    with refused("NOT whole: shard-00002.h5 was altered", DatasetError):
        open_dataset(folder, check="full")


def test_the_full_check_of_an_interrupted_set_looks_at_what_is_made(tmp_path):
    folder = build(tmp_path / "a", PLAN, shards=range(2), close=False, labelled=True)
    options = {"allow_incomplete": True, "check": "full"}
    with open_dataset(folder, **options) as data:
        assert data.usable.sum() == 20
    with h5py.File(shard_path(folder, 1), "r+") as file:
        setting("acceleration", (0, 0, 0), 5.0)(file)
    with refused("shard-00001.h5 was altered", DatasetError):
        open_dataset(folder, **options)


def test_root_attributes_are_the_same_in_all_shards_and_the_index(new_folder):
    """The checks that older versions of gensig make; the number of a shard is elsewhere."""
    paths = [shard_path(new_folder, index) for index in range(4)]
    with open_dataset(new_folder) as data:
        attributes, identity = data.attributes, data.manifest.identity
    assert attributes["identity"] == identity
    for number, path in enumerate([*paths, new_folder / "index.h5"]):
        with h5py.File(path, locking=False) as file:
            assert read_attributes(file) == attributes
            stored = file["record_id"].attrs.get("shard_index")
            assert stored == (None if path.name == "index.h5" else number)
    assert verify(new_folder).problems == []
