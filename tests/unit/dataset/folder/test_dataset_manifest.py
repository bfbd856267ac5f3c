"""Folders: creation, entry of shards and closing; existing files are not touched."""

import json
import multiprocessing
import os
import subprocess

import h5py
import numpy as np
import pytest
import yaml
from dataset_samples import CONFIG, build, make_plan, write_shard

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.layout import read_config, shard_path
from gensig.dataset.folder.manifest import (
    deciding,
    differing_keys,
    finalize,
    identity_hash,
    read_manifest,
    record_shard,
    stored_config,
)
from gensig.dataset.plan import read_plan
from gensig.errors import DatasetError


def _create(out, plan, **changes):
    given = {
        "config": CONFIG,
        "overrides": [],
        "plan": plan,
        "seed": 7,
        "generator_version": "0.1.0",
    }
    create_folder(
        out, **({"identity": identity_hash(CONFIG, "0.1.0")} | given | changes)
    )


def _tree(folder):
    return {
        str(p.relative_to(folder)): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def test_identity_covers_what_decides_the_bits():
    base = identity_hash(CONFIG, "0.1.0")
    assert identity_hash(dict(reversed(CONFIG.items())), "0.1.0") == base
    for key in ("out", "executor", "verbosity"):
        assert identity_hash(CONFIG | {key: "other"}, "0.1.0") == base
    assert identity_hash(CONFIG, "0.1.1") != base
    assert identity_hash(CONFIG | {"seed": 8}, "0.1.0") != base
    assert (
        identity_hash(CONFIG | {"gear": {"n_teeth": 23, "out": 1}}, "0.1.0") != base
    )  # nested names count
    with pytest.raises(DatasetError, match="plain data"):
        identity_hash({"a": object()}, "0.1.0")


def with_backend(name):
    return CONFIG | {"solver": {"oversampling": 5, "backend": name}}


def test_a_key_that_came_after_0_9_counts_only_where_it_is_not_at_its_default():
    """A folder that was begun without the key goes on, and is another data set than one of another
    backend."""
    before = CONFIG | {"solver": {"oversampling": 5}}
    default = with_backend("runge_kutta")
    assert stored_config(default) == before
    assert deciding(default) == deciding(before)
    assert default["solver"]["backend"] == "runge_kutta"
    assert identity_hash(default, "0.9.0") == identity_hash(before, "0.9.0")
    assert identity_hash(with_backend("other"), "0.9.0") != identity_hash(
        before, "0.9.0"
    )
    assert differing_keys(before, default) == differing_keys(default, before) == []
    assert differing_keys(before, with_backend("other")) == ["solver.backend"]


def test_folder_holds_what_is_needed(folder, plan):
    assert set(_tree(folder)) == {
        "config.yaml",
        "overrides.yaml",
        "plan.csv",
        "manifest.json",
        "index.h5",
        "README.md",
        "croissant.json",
        "SHA256SUMS",
        "splits/by_unit.csv",
        "splits/cross_gearbox.csv",
        "splits/cross_specimen.csv",
        "splits/random_window_leaky.csv",
        *(f"shards/shard-0000{i}.h5" for i in range(4)),
    }
    manifest = read_manifest(folder)
    assert manifest.is_complete
    assert (manifest.seed, manifest.n_records, manifest.n_done) == (7, 36, 4)
    assert set(manifest.environment) >= {
        "python",
        "numpy",
        "h5py",
        "cpu_model",
        "git_commit",
        "created",
        "finished",
    }
    assert read_config(folder) == CONFIG
    assert yaml.safe_load((folder / "overrides.yaml").read_text()) == ["seed=7"]
    assert read_plan(folder / "plan.csv").n_records == plan.n_records


def test_two_runs_are_byte_equal(tmp_path, plan):
    first, second = (_tree(build(tmp_path / name, plan)) for name in ("a", "b"))
    different = {name for name in first if first[name] != second[name]}
    assert different <= {
        "manifest.json",
        "README.md",
        "croissant.json",
        "SHA256SUMS",
    }  # times and the folder's name


def test_existing_folder_is_not_touched(tmp_path, plan):
    used = tmp_path / "used"
    used.mkdir()
    (used / "mine.txt").write_text("keep")
    (tmp_path / "file").write_text("keep")
    for out in (used, tmp_path / "file"):
        with pytest.raises(DatasetError, match="exists"):
            _create(out, plan)
    assert _tree(tmp_path) == {"used/mine.txt": b"keep", "file": b"keep"}
    (tmp_path / "empty").mkdir()
    _create(tmp_path / "empty", plan)
    assert not read_manifest(tmp_path / "empty").is_complete


def test_failure_while_creating_leaves_nothing(tmp_path, plan, monkeypatch):
    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("gensig.dataset.storage.atomic.publish", full_disk)
    with pytest.raises(DatasetError, match="No space left on device"):
        _create(tmp_path / "a" / "b", plan)
    assert list(tmp_path.iterdir()) == []


def test_identity_of_another_configuration_is_refused(tmp_path, plan):
    with pytest.raises(DatasetError, match="does not belong"):
        _create(tmp_path / "a", plan, identity="0" * 64)
    assert list(tmp_path.iterdir()) == []


def test_unfinished_set_cannot_be_closed(tmp_path, plan):
    folder = build(tmp_path / "a", plan, shards=range(3), close=False)
    with pytest.raises(DatasetError, match="3 of 4 shards are done"):
        finalize(folder)
    with pytest.raises(DatasetError, match="does not exist"):
        record_shard(folder, 3, "0" * 64, 1, 0)
    writer = write_shard(shard_path(folder, 3), plan, 3)
    for wrong in (("abc", 1, 0), (writer.sha256, -1, 0), (writer.sha256, 1, 7)):
        with pytest.raises(DatasetError, match=r"negative|sha256|failed of"):
            record_shard(folder, 3, *wrong)
    record_shard(folder, 3, writer.sha256, writer.n_bytes, writer.n_failed)
    shard_path(folder, 1).write_bytes(b"x")
    with pytest.raises(DatasetError, match="recorded"):
        finalize(folder)
    assert not (folder / "index.h5").exists()
    assert not read_manifest(folder).is_complete


def test_closed_set_takes_no_more_shards(folder):
    finalize(folder)  # twice is harmless
    with pytest.raises(DatasetError, match="closed"):
        record_shard(folder, 0, "0" * 64, 1, 0)


def _record(folder, shard):
    record_shard(folder, shard, f"{shard:064d}", 10 + shard, 0)


def test_processes_do_not_overwrite_each_other(tmp_path):
    folder = build(
        tmp_path / "a",
        make_plan(n_records=24, records_per_shard=1),
        shards=range(0),
        close=False,
    )
    for shard in range(24):
        shard_path(folder, shard).touch()
    context = multiprocessing.get_context("fork")
    with context.Pool(4) as pool:
        pool.starmap(_record, [(folder, shard) for shard in range(24)])
    assert [entry.bytes for entry in read_manifest(folder).shards] == list(
        range(10, 34)
    )


def test_index_shows_all_shards_from_any_folder_and_nan_for_a_missing_one(folder):
    shard_path(folder, 1).unlink()
    code = (
        "import h5py, sys; f = h5py.File(sys.argv[1], locking=False); a = "
        "f['acceleration'];print(a.shape, f['record_id'][35].decode(), (a[10:20] != "
        "a[10:20]).all(), (a[20:] == a[20:]).all(), f['label'][10], "
        "f['params/crack_depth_mm'].shape)"
    )
    run = subprocess.run(
        [os.sys.executable, "-c", code, str(folder / "index.h5")],
        capture_output=True,
        text=True,
        cwd="/",
        check=True,
    )
    assert run.stdout.strip() == "(36, 2, 200) r000035 True True -1 (36,)"


def test_index_sources_are_relative(folder):
    with h5py.File(folder / "index.h5") as file:
        sources = [s.file_name for s in file["acceleration"].virtual_sources()]
        assert sources == [f"shards/shard-0000{i}.h5" for i in range(4)]
        assert np.isnan(file["acceleration"].fillvalue)
        assert file.attrs["sampling_rate_hz"] == pytest.approx(1000.0)


def _damage(content, path, value):
    for key in path[:-1]:
        content = content[key]
    content[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["shards", 1, "name"], "../../other.h5", "only name allowed"),
        (["shards", 1, "name"], "/etc/passwd", "only name allowed"),
        (["shards", 1, "name"], "shard-00002.h5", "only name allowed"),
        (["files"], {"../plan.csv": "0" * 64}, "not one of a data set"),
        (["files"], {"splits/../../x.csv": "0" * 64}, "not one of a data set"),
        (["files", "plan.csv"], 5, "sha256"),
        (["shards", 0, "sha256"], "xyz", "sha256"),
        (["shards", 0, "rows"], "10", "no int"),
        (["shards", 0, "rows"], True, "no int"),
        (["shards", 0, "rows"], 11, "shards hold"),
        (["shards", 0, "rows"], -1, "negative"),
        (["shards", 0, "state"], "fine", "allowed are"),
        (["shards", 0, "state"], "planned", "not every shard"),
        (["shards", 0, "n_failed"], 11, "failed of"),
        (["shards"], {}, "no list"),
        (["schema_version"], 2, "format version 2"),
        (["identity"], "short", "sha256"),
    ],
)
def test_forged_manifest_is_refused_in_one_line(folder, path, value, message):
    content = json.loads((folder / "manifest.json").read_text())
    _damage(content, path, value)
    (folder / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(DatasetError, match=message) as caught:
        read_manifest(folder)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "[" * 100_000, '{"schema_version": 1}', "\0"]
)
def test_manifest_that_is_none_is_refused(folder, text):
    (folder / "manifest.json").write_text(text)
    with pytest.raises(DatasetError, match=r"manifest\.json"):
        read_manifest(folder)


@pytest.mark.parametrize(
    "text",
    [
        "a: &x [1]\nb: *x\n",
        "!!python/object/apply:os.system [ls]",
        "a: [",
        "- 1\n",
        "[" * 20_000,
        "a: " + "[" * 20_000,
    ],
)
def test_configuration_that_is_not_plain_is_refused(folder, text):
    (folder / "config.yaml").write_text(text)
    with pytest.raises(DatasetError, match=r"config\.yaml"):
        read_config(folder)
