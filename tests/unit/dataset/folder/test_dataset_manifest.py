"""Folders: creation, entry of shards and closing; existing files are not touched."""

import functools
import json
import multiprocessing
import operator
from dataclasses import replace

import h5py
import numpy as np
import pytest
import yaml
from dataset_samples import CONFIG, build, make_plan, write_shard
from refusals import refused

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import (
    ShardEntry,
    read_config,
    read_manifest,
    shard_path,
)
from gensig.dataset.folder.manifest import (
    deciding,
    differing_keys,
    identity_hash,
    record_shards,
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
    create_folder(out, **(given | changes))


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
    nested = {"gear": {"n_teeth": 23, "out": 1}}
    for change in ({"seed": 8}, nested):
        assert identity_hash(CONFIG | change, "0.1.0") != base
    with refused("plain data", DatasetError):
        identity_hash({"a": object()}, "0.1.0")


def with_backend(name):
    return CONFIG | {"solver": {"oversampling": 5, "backend": name}}


def test_a_key_that_came_after_0_9_counts_only_where_it_is_not_at_its_default():
    """A folder that was begun without the key goes on, and is another data set than one of another
    backend."""
    before = CONFIG | {"solver": {"oversampling": 5}}
    default, other = with_backend("runge_kutta"), with_backend("other")
    assert stored_config(default) == before
    assert deciding(default) == deciding(before)
    assert default["solver"]["backend"] == "runge_kutta"
    old, same, new = (
        identity_hash(config, "0.9.0") for config in (before, default, other)
    )
    assert old == same != new
    assert differing_keys(before, default) == differing_keys(default, before) == []
    assert differing_keys(before, other) == ["solver.backend"]


def test_folder_holds_what_is_needed(folder, plan):
    files = (
        "config.yaml",
        "overrides.yaml",
        "plan.csv",
        "manifest.json",
        "index.h5",
        "README.md",
    )
    protocols = (
        "new_machine",
        "by_unit",
        "cross_gearbox",
        "cross_specimen",
        "random_window_leaky",
    )
    assert set(_tree(folder)) == {
        *files,
        "croissant.json",
        "SHA256SUMS",
        *(f"splits/{name}.csv" for name in protocols),
        *(f"shards/shard-0000{i}.h5" for i in range(4)),
    }
    manifest = read_manifest(folder)
    assert manifest.is_complete
    assert (manifest.seed, manifest.n_records, manifest.n_done) == (7, 36, 4)
    facts = (
        "python",
        "numpy",
        "h5py",
        "cpu_model",
        "git_commit",
        "created",
        "finished",
    )
    assert set(manifest.environment) >= set(facts)
    assert read_config(folder) == CONFIG
    assert yaml.safe_load((folder / "overrides.yaml").read_text()) == ["seed=7"]
    assert read_plan(folder / "plan.csv").n_records == plan.n_records


def test_two_runs_are_byte_equal(tmp_path, plan):
    first, second = (_tree(build(tmp_path / name, plan)) for name in ("a", "b"))
    different = {name for name in first if first[name] != second[name]}
    # times and the folder's name
    named = {"manifest.json", "README.md", "croissant.json", "SHA256SUMS"}
    assert different <= named


def test_existing_folder_is_not_touched(tmp_path, plan):
    used = tmp_path / "used"
    used.mkdir()
    (used / "mine.txt").write_text("keep")
    (tmp_path / "file").write_text("keep")
    for out in (used, tmp_path / "file"):
        with refused("exists", DatasetError):
            _create(out, plan)
    assert _tree(tmp_path) == {"used/mine.txt": b"keep", "file": b"keep"}
    (tmp_path / "empty").mkdir()
    _create(tmp_path / "empty", plan)
    assert not read_manifest(tmp_path / "empty").is_complete


def test_failure_while_creating_leaves_nothing(tmp_path, plan, monkeypatch):
    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("gensig.dataset.storage.atomic.publish", full_disk)
    with refused("No space left on device", DatasetError):
        _create(tmp_path / "a" / "b", plan)
    assert list(tmp_path.iterdir()) == []


def test_unfinished_set_cannot_be_closed(tmp_path, plan):
    folder = build(tmp_path / "a", plan, shards=range(3), close=False)
    with refused("3 of 4 shards are done", DatasetError):
        finalize(folder)
    with refused("does not exist", DatasetError):
        record_shards(folder, {3: done(3)})
    entry = write_shard(shard_path(folder, 3), plan, 3).entry
    for wrong in ({"sha256": "abc"}, {"bytes": -1}, {"n_failed": 7}):
        with pytest.raises(DatasetError, match=r"negative|sha256|failed of"):
            record_shards(folder, {3: replace(entry, **wrong)})
    record_shards(folder, {3: entry})
    shard_path(folder, 1).write_bytes(b"x")
    with refused("recorded", DatasetError):
        finalize(folder)
    assert not (folder / "index.h5").exists()
    assert not read_manifest(folder).is_complete


def test_closed_set_takes_no_more_shards(folder):
    finalize(folder)  # twice is harmless
    with refused("closed", DatasetError):
        record_shards(folder, {0: done(0)})


def done(shard):
    """Entry of a shard of one row, with made-up bytes."""
    name = f"shard-{shard:05d}.h5"
    return ShardEntry(
        name=name, rows=1, state="done", sha256="0" * 64, bytes=10 + shard
    )


def _record(folder, shard):
    record_shards(folder, {shard: done(shard)})


def test_processes_do_not_overwrite_each_other(tmp_path):
    plan = make_plan(n_records=24, records_per_shard=1)
    folder = build(tmp_path / "a", plan, shards=range(0), close=False)
    for shard in range(24):
        shard_path(folder, shard).touch()
    with multiprocessing.get_context("fork").Pool(4) as pool:
        pool.starmap(_record, [(folder, shard) for shard in range(24)])
    sizes = [entry.bytes for entry in read_manifest(folder).shards]
    assert sizes == list(range(10, 34))


def test_index_shows_all_shards_from_any_folder_and_nan_for_a_missing_one(
    folder, tmp_path, monkeypatch
):
    shard_path(folder, 1).unlink()
    monkeypatch.chdir(tmp_path)
    with h5py.File(folder / "index.h5", locking=False) as file:
        signals = file["acceleration"][...]
        is_missing = np.isnan(signals).all(axis=(1, 2))
        assert np.flatnonzero(is_missing).tolist() == list(range(10, 20))
        assert np.isfinite(signals[~is_missing]).all()
        assert file["record_id"][35] == b"r000035"
        assert file["label"][10] == -1
        assert file["params/crack_depth_mm"].shape == (36,)


def test_index_sources_are_relative(folder):
    with h5py.File(folder / "index.h5") as file:
        sources = [s.file_name for s in file["acceleration"].virtual_sources()]
        assert sources == [f"shards/shard-0000{i}.h5" for i in range(4)]
        assert np.isnan(file["acceleration"].fillvalue)
        assert file.attrs["sampling_rate_hz"] == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["shards", 1, "name"], "../../other.h5", "only name allowed"),
        (["shards", 1, "name"], "shard-00002.h5", "only name allowed"),
        (["files"], {"../plan.csv": "0" * 64}, "not one of a data set"),
        (["files", "plan.csv"], 5, "sha256"),
        (["shards", 0, "sha256"], "xyz", "sha256"),
        (["shards", 0, "rows"], "10", "no int"),
        (["shards", 0, "rows"], 11, "shards hold"),
        (["shards", 0, "rows"], -1, "negative"),
        (["shards", 0, "state"], "fine", "allowed are"),
        (["shards", 0, "state"], "planned", "not every shard"),
        (["shards", 0, "n_failed"], 11, "failed of"),
        (["shards"], {}, "no list"),
        (["schema_version"], 3, "format version 3"),
    ],
)
def test_forged_manifest_is_refused_in_one_line(folder, path, value, message):
    content = json.loads((folder / "manifest.json").read_text())
    *parents, key = path
    functools.reduce(operator.getitem, parents, content)[key] = value
    (folder / "manifest.json").write_text(json.dumps(content))
    with refused(message, DatasetError):
        read_manifest(folder)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "[" * 100_000, '{"schema_version": 1}', "\0"]
)
def test_manifest_that_is_none_is_refused(folder, text):
    (folder / "manifest.json").write_text(text)
    with refused("manifest.json", DatasetError):
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
    with refused("config.yaml", DatasetError):
        read_config(folder)
