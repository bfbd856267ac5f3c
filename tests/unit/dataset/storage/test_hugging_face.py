"""`datasets.load_dataset` opens an export: splits apart, class names, text, signals to the bit."""

import json
import re
import sys
from types import SimpleNamespace

import datasets
import h5py
import numpy as np
import pytest
import yaml
from dataset_samples import build, trust
from numpy.testing import assert_array_equal
from pyarrow import parquet
from refusals import refused
from split_samples import CLASSES, FAILED, LEAKY, REFERENCES, every_protocol_plan

import gensig.dataset.exports.export as export_module
import gensig.dataset.exports.export_tables as tables_module
import gensig.dataset.exports.hugging_face as hub_module
from gensig.cli import main
from gensig.dataset.exports.export import FORMATS, export
from gensig.dataset.exports.hub_card import OF_SHARDS
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.reader import open_dataset
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.splitting.splits import SUBSETS, read_split
from gensig.errors import DatasetError

CLEAN = [name for name in PROTOCOLS if name != LEAKY]


@pytest.fixture(autouse=True)
def _offline(tmp_path, monkeypatch):
    """`datasets` keeps what it read in the test's own folder."""
    monkeypatch.setattr(datasets.config, "HF_DATASETS_CACHE", tmp_path / "cache")
    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    datasets.disable_progress_bars()


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A data set of counts with a scale, which has every protocol."""
    out = tmp_path_factory.mktemp("stored") / "set"
    plan = every_protocol_plan()
    return build(out, plan, failed=FAILED, references=True, sample_type="int16")


@pytest.fixture(scope="module")
def hub(stored):
    """Every protocol of it exported, the leaky one on request; small groups of rows."""
    out = stored.parent / "hub"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tables_module, "ROW_GROUP_BYTES", 7 * 2 * 200 * 4)
        export(stored, "hf", out, protocols=["all", LEAKY])
    return out


@pytest.fixture
def folder(tmp_path):
    """A data set that has every protocol, to be changed."""
    return build(tmp_path / "set", every_protocol_plan(), references=True)


@pytest.fixture
def poisoned(folder):
    """A data set with a record of a training unit dealt to the test as well."""
    path = folder / "splits" / "by_unit.csv"
    text = path.read_text()
    moved = re.sub(r"(?m)^(\w+,0,1),train$", r"\1,test", text, count=1)
    assert moved != text
    path.write_text(moved)
    trust(folder)
    return folder


def of_split(folder, protocol):
    """Ids of the usable records of each subset, as the split's file deals them."""
    table = read_split(folder / "splits" / f"{protocol}.csv")
    failed = f"r{FAILED:06d}"
    sides = [set(table.record_id[table.subset == subset]) for subset in SUBSETS]
    return [side - {failed} for side in sides]


@pytest.mark.parametrize("protocol", CLEAN)
def test_no_unit_is_on_two_sides_of_a_clean_protocol(stored, hub, protocol):
    loaded = datasets.load_dataset(str(hub), protocol)
    assert tuple(loaded) == SUBSETS
    for column in ("record_id", "unit_id", *PROTOCOLS[protocol].apart):
        sides = [set(loaded[subset][column]) for subset in SUBSETS]
        assert all(sides)
        assert sum(map(len, sides)) == len(set.union(*sides))
    ids = [set(loaded[subset]["record_id"]) for subset in SUBSETS]
    assert ids == of_split(stored, protocol)
    assert not set.union(*ids) & {f"r{number:06d}" for number in REFERENCES}


def test_the_same_check_finds_the_leak(hub):
    """Twin of the check above: with windows of records it fails, as it must."""
    loaded = datasets.load_dataset(str(hub), LEAKY)
    for column in ("record_id", "unit_id"):
        sides = [set(loaded[subset][column]) for subset in SUBSETS]
        assert sum(map(len, sides)) > len(set.union(*sides))


def test_values_are_those_of_the_data_set(stored, hub):
    """Class names, text as str, numbers and signals to the bit."""
    loaded = datasets.load_dataset(str(hub), "by_unit")
    with open_dataset(stored) as data:
        number = {name: k for k, name in enumerate(data.column("record_id").tolist())}
        columns = {name: data.column(name) for name in data.column_names}
        for part in loaded.values():
            assert part.features["label"].names == data.class_names == list(CLASSES)
            signals = part.with_format("numpy")["acceleration"]
            for row, signal in zip(part, signals, strict=True):
                record = number[row["record_id"]]
                assert signal.dtype == np.float32
                assert_array_equal(signal, data.signals(record))
                for name, values in columns.items():
                    if name == "acceleration_scale":
                        assert name not in row
                        continue
                    value = row[name]
                    assert_array_equal(value, values[record])
                    assert isinstance(value, str) == (values.dtype.kind == "U")


def test_stretches_are_cut_and_no_sample_is_given_twice(stored, hub):
    loaded = datasets.load_dataset(str(hub), LEAKY)
    seen = np.zeros((144, 200), dtype=int)
    with open_dataset(stored) as data:
        for part in loaded.values():
            for row in part.with_format("numpy"):
                record = int(row["record_id"][1:])
                start, stop = int(row["start_sample"]), int(row["stop_sample"])
                whole = data.signals(record)
                assert_array_equal(row["acceleration"], whole[:, start:stop])
                seen[record, start:stop] += 1
    left_out = [*REFERENCES, FAILED]
    assert (seen[left_out] == 0).all()
    assert (np.delete(seen, left_out, axis=0) == 1).all()


def test_stretches_of_different_length(folder, tmp_path):
    """Signals are lists of any length; a sample that a cut halves is in no row."""
    path = folder / "splits" / f"{LEAKY}.csv"
    rows = "r000001,0,0.3025,train\nr000001,0.3025,1,test\nr000002,0,0.001,test\n"
    path.write_text(f"record_id,start_fraction,stop_fraction,subset\n{rows}")
    trust(folder)
    export(folder, "hf", tmp_path / "hub", protocols=[LEAKY])
    loaded = datasets.load_dataset(str(tmp_path / "hub"))
    assert set(loaded) == {"train", "test"}
    with open_dataset(folder) as data:
        signal = data.signals(1)
    for subset, (start, stop) in {"train": (0, 60), "test": (61, 200)}.items():
        (row,) = loaded[subset].with_format("numpy")
        assert (row["start_sample"], row["stop_sample"]) == (start, stop)
        assert_array_equal(np.stack(row["acceleration"]), signal[:, start:stop])


def test_the_hardest_protocol_alone_unless_asked(stored, tmp_path):
    """The leaky protocol is in no export that does not name it."""
    export(stored, "hf", tmp_path / "one")
    export(stored, "hf", tmp_path / "all", protocols=["all"])
    export(stored, "hf", tmp_path / "two", protocols=["cross_speed", "by_unit"] * 2)
    one, every, two = (
        datasets.get_dataset_config_names(str(tmp_path / name))
        for name in ("one", "all", "two")
    )
    assert one == ["new_machine"]
    assert sorted(every) == sorted(CLEAN)
    assert two == ["cross_speed", "by_unit"]
    export(stored, "hf", tmp_path / "last", protocols=[LEAKY, "by_unit"])
    last = datasets.load_dataset(str(tmp_path / "last"))
    assert "start_sample" not in last["train"].column_names
    for folder, config in (("one", "new_machine"), ("two", "cross_speed")):
        default = datasets.load_dataset(str(tmp_path / folder))
        named = datasets.load_dataset(str(tmp_path / folder), config)
        assert default["test"]["record_id"][:] == named["test"]["record_id"][:]
    card = (tmp_path / "all" / "README.md").read_text(encoding="utf-8")
    assert LEAKY not in card
    assert "leaks" not in card


def test_parquet_files_need_no_card(hub):
    """The schema holds class names and types; files in the order of the plan."""
    loaded = datasets.load_dataset("parquet", data_dir=str(hub / "data" / "by_unit"))
    by_card = datasets.load_dataset(str(hub), "by_unit")
    for subset in SUBSETS:
        assert loaded[subset].features == by_card[subset].features
        ids = loaded[subset]["record_id"][:]
        assert ids == by_card[subset]["record_id"][:] == sorted(ids)


def test_large_subsets_are_several_files(stored, tmp_path, monkeypatch):
    monkeypatch.setattr(hub_module, "FILE_BYTES", 10 * 2 * 200 * 4)
    made = export(stored, "hf", tmp_path / "hub", protocols=["by_unit"])
    names = sorted(path.name for path in (tmp_path / "hub" / "data").rglob("train-*"))
    n_files = len(names)
    numbers = range(n_files)
    assert names == [f"train-{k:05d}-of-{n_files:05d}.parquet" for k in numbers]
    loaded = datasets.load_dataset(str(tmp_path / "hub"))
    n_rows = [len(loaded[subset]) for subset in SUBSETS]
    assert n_files == -(-n_rows[0] // 10) > 5
    assert made["files"] == 1 + sum(-(-n // 10) for n in n_rows)
    assert made["records"] == sum(n_rows) == 144 - 3
    train = loaded["train"]["record_id"][:]
    assert train == sorted(of_split(stored, "by_unit")[0])


def test_card_is_silent_about_shards_that_an_export_has_not(hub):
    card = (hub / "README.md").read_text(encoding="utf-8")
    assert "| records |" in card
    for fact in OF_SHARDS:
        assert f"| {fact} |" not in card


def test_card_states_sizes_and_warns_of_the_leak(hub):
    card = (hub / "README.md").read_text(encoding="utf-8")
    _, front, text = card.split("---\n", 2)
    facts = yaml.safe_load(front)
    assert facts["license"] == "cc-by-4.0"
    configs = [entry["config_name"] for entry in facts["configs"]]
    assert configs == [entry["config_name"] for entry in facts["dataset_info"]]
    for entry in facts["dataset_info"]:
        folder = hub / "data" / entry["config_name"]
        files = list(folder.glob("*.parquet"))
        assert entry["download_size"] == sum(path.stat().st_size for path in files)
        sizes = {split["name"]: split["num_examples"] for split in entry["splits"]}
        rows = {
            subset: sum(
                parquet.read_metadata(path).num_rows
                for path in folder.glob(f"{subset}-*")
            )
            for subset in SUBSETS
        }
        assert sizes == rows
        cells = " | ".join(map(str, sizes.values()))
        name = entry["config_name"].replace("_", r"\_")
        assert re.search(rf"^\| {re.escape(name)} \| [^|]+ \| {cells} \|", text, re.M)
    assert f"`{LEAKY}` leaks" in text
    assert "Failed records are left out everywhere: 1." in text
    assert "| speed_rpm | r/min | result |" in text


def test_a_protocol_of_a_later_version_is_exported_by_its_name_only(folder, tmp_path):
    """A protocol of unknown units is exported only by its name, and the card says so."""
    text = (folder / "splits" / "by_unit.csv").read_text()
    (folder / "splits" / "by_moon.csv").write_text(text)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"]["splits/by_moon.csv"] = "0" * 64
    (folder / "manifest.json").write_text(json.dumps(manifest))
    trust(folder)
    export(folder, "npz", tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as arrays:
        assert "split/by_unit" in arrays
        assert "split/by_moon" not in arrays
    export(folder, "hf", tmp_path / "hub", protocols=["by_moon"])
    card = (tmp_path / "hub" / "README.md").read_text(encoding="utf-8")
    assert "`by_moon` is unchecked" in card
    assert "leaks" not in card


@pytest.mark.parametrize("to", FORMATS)
def test_a_split_with_a_unit_on_two_sides_is_refused(poisoned, tmp_path, to):
    out = tmp_path / "out"
    with pytest.raises(DatasetError, match=r"unit_id u\d+ is in more than one subset"):
        export(poisoned, to, out, protocols=["by_unit"])
    assert not out.exists()
    export(poisoned, to, out, protocols=["cross_gearbox"])  # its file is untouched


@pytest.mark.parametrize("column", ["unit_id", "specimen_id", "gearbox_id"])
def test_a_shard_with_another_machine_than_the_plan_is_refused(
    folder, tmp_path, column
):
    """The check of a split looks at the plan; what is loaded comes from the shards."""
    with h5py.File(shard_path(folder, 2), "r+") as file:
        file[column][3] = b"u5"
    kind = column.removesuffix("_id")
    with refused(f"plan have different {kind} ids", DatasetError):
        export(folder, "hf", tmp_path / "hub")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--protocol by_unti", "did you mean 'by_unit'"),
        ("--protocol by_unit --samples", "'samples' belongs to parquet"),
        ("--protocol new_machine", "does not exist in"),
    ],
)
def test_mistakes_are_one_line(tmp_path, capsys, words, message):
    plan = every_protocol_plan(n_records=3 * 4)
    folder = build(tmp_path / "set", plan, references=True)
    out = str(tmp_path / "hub")
    arguments = ["export", str(folder), "--to", "hf", "--out", out, *words.split()]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "hub").exists()


def test_a_set_without_a_clean_split_says_why(tmp_path):
    folder = build(tmp_path / "set", every_protocol_plan(n_records=3), references=True)
    for protocols in (None, ["all"]):
        with refused(
            "no split that keeps machines apart (the plan has 1 mach", DatasetError
        ):
            export(folder, "hf", tmp_path / "hub", protocols=protocols)
    assert export(folder, "npz", tmp_path / "x.npz")["records"] == 3


@pytest.mark.parametrize("to", ["hf", "parquet"])
def test_a_missing_package_is_named(stored, tmp_path, monkeypatch, to):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with refused(rf"format {to} needs the package pyarrow", DatasetError):
        export(stored, to, tmp_path / "out")


def test_a_full_disk_is_said_before_anything_is_written(stored, tmp_path, monkeypatch):
    """By the rows of all protocols that are asked for."""
    needed = 2 * 141 * 2 * 200 * 4
    usage = SimpleNamespace(free=needed - 1)
    monkeypatch.setattr(export_module.shutil, "disk_usage", lambda _path: usage)
    with refused(f"needs about {needed} bytes", DatasetError):
        export(stored, "hf", tmp_path / "hub", protocols=["by_unit", "cross_gearbox"])
    assert not (tmp_path / "hub").exists()


def test_a_damaged_shard_leaves_nothing(folder, tmp_path):
    path = shard_path(folder, 5)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(DatasetError):
        export(folder, "hf", tmp_path / "hub")
    assert {path.name for path in tmp_path.iterdir()} == {"set"}


def test_the_command_prints_how_to_load(stored, tmp_path, capsys):
    out = str(tmp_path / "hub")
    assert main(["export", str(stored), "--to", "hf", "--out", out]) == 0
    printed = capsys.readouterr().out
    assert "141 records as hf, 4 file(s)" in printed
    call = printed.splitlines()[-1]
    loaded = eval(call, {"datasets": datasets})
    assert sum(map(len, loaded.values())) == 141
