"""Verification names every defect of a data set; inspection and card show its content."""

import os
import shutil

import h5py
import numpy as np
import pytest
from dataset_samples import (
    ATTRIBUTES,
    CLASSES,
    build,
    forge,
    make_plan,
    setting,
    write_shard,
)

from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import inspect, verify
from gensig.dataset.plan import Plan, plan_text, read_plan
from gensig.errors import DatasetError


def _flip(path, offset):
    content = bytearray(path.read_bytes())
    content[offset] ^= 1
    path.write_bytes(content)


def test_whole_set_passes(folder):
    result = verify(folder)
    assert result.problems == []
    assert result.complete
    assert (result.n_records, result.n_failed) == (36, 0)
    assert verify(folder, quick=True).complete


def test_failed_record_is_counted_not_hidden(tmp_path, plan):
    result = verify(build(tmp_path / "a", plan, failed=12))
    assert result.complete
    assert result.n_failed == 1


def test_split_with_a_unit_on_two_sides_is_found(folder):
    path = folder / "splits" / "by_unit.csv"
    header, first, *others = path.read_text().splitlines(keepends=True)
    record, _, subset = first.strip().partition(",0,1,")
    path.write_text(
        "".join(
            [
                header,
                f"{record},0,1,{'test' if subset != 'test' else 'train'}\n",
                *others,
            ]
        )
    )
    problems = [
        problem
        for problem in verify(folder).problems
        if problem.startswith("splits/by_unit: ")
    ]
    assert problems == [
        "splits/by_unit: unit_id u0 is in more than one subset (1 such)"
    ]


def test_truncated_swapped_extra_and_foreign_shards_are_named(folder, tmp_path):
    path = shard_path(folder, 3)
    path.write_bytes(path.read_bytes()[:-10])
    _swap(shard_path(folder, 0), shard_path(folder, 1))
    (folder / "shards" / "shard-00004.h5").write_bytes(b"x")
    (folder / "shards" / ".shard-00001.h5.1-a.tmp").write_bytes(b"x")
    text = "\n".join(verify(folder).problems)
    assert "shard-00003.h5 is truncated" in text
    assert "shard-00000.h5 is swapped: it holds what belongs in shard-00001.h5" in text
    assert "shard-00001.h5 is swapped: it holds what belongs in shard-00000.h5" in text
    assert "shard-00004.h5' is extra" in text
    assert ".shard-00001.h5.1-a.tmp' is extra" in text
    assert "shard-00002.h5" not in text
    assert any(
        "truncated" in problem for problem in verify(folder, quick=True).problems
    )


def test_quick_reads_no_record(folder, monkeypatch):
    def refuse(path, **_):
        raise AssertionError(f"{path} was read")

    monkeypatch.setattr("gensig.dataset.folder.verify.open_shard", refuse)
    monkeypatch.setattr("gensig.dataset.folder.verify.sha256_file", refuse)
    monkeypatch.setattr("gensig.dataset.folder.verify.read_plan", refuse)
    assert verify(folder, quick=True).problems == []
    path = shard_path(folder, 1)
    _flip(path, path.stat().st_size // 2)
    assert verify(folder, quick=True).complete  # what it does not look at
    path.write_bytes(path.read_bytes() + b"x")
    (problem,) = verify(folder, quick=True).problems
    assert "shard-00001.h5 is not the recorded file" in problem


def _swap(a, b):
    content = a.read_bytes()
    shutil.copyfile(b, a)
    b.write_bytes(content)


def test_foreign_shard_is_found_even_when_the_manifest_agrees(folder, tmp_path):
    other = tmp_path / "other.h5"
    plan = make_plan()
    renamed = Plan(
        columns={
            **plan.columns,
            "record_id": np.char.replace(plan.columns["record_id"], "r", "x"),
        }
    )
    write_shard(other, renamed, 1, attributes=ATTRIBUTES | {"config_json": '{"a": 2}'})
    shutil.copyfile(other, shard_path(folder, 1))
    assert any("altered" in problem for problem in verify(folder).problems)
    text = forge(folder, 1, lambda file: None)
    assert "shard-00001.h5 is foreign: its attributes config_json" in text
    assert (
        "shard-00001.h5 row 0: record_id is 'x000010', the plan says 'r000010'" in text
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (setting("acceleration", 3, np.nan), "row 3: acceleration is not finite"),
        (setting("label", 3, 1), "row 3: label is 1, the plan says 2"),
        (setting("unit_id", 0, b"u9"), "row 0: unit_id is 'u9'"),
        (setting("status", 3, b"failed"), "1 failed records, recorded are 0"),
        (
            lambda file: file.create_dataset("more", data=np.zeros(10)),
            "foreign: its data sets more",
        ),
        (lambda file: file.__delitem__("torque_nm"), "no data set torque_nm"),
    ],
)
def test_forged_content_is_found(folder, change, message):
    assert forge(folder, 2, lambda file: None) == ""  # forging alone changes nothing
    assert message in forge(folder, 2, change)


def test_altered_plan_and_identity_are_found(folder):
    plan = read_plan(folder / "plan.csv")
    label = plan.columns["label"].copy()
    label[5] = 0
    (folder / "plan.csv").write_text(
        plan_text(Plan(columns={**plan.columns, "label": label}))
    )
    text = "\n".join(verify(folder).problems)
    assert "plan.csv was altered" in text
    assert "shard-00000.h5 row 5: label is 2, the plan says 0" in text
    (folder / "config.yaml").write_text("seed: 8\n")
    assert "the identity in the manifest" in "\n".join(verify(folder).problems)


@pytest.mark.parametrize("n_shards", [0, 2, 4])
def test_interrupted_set_never_looks_whole(tmp_path, plan, n_shards):
    folder = build(tmp_path / "a", plan, shards=range(n_shards), close=False)
    for quick in (False, True):
        result = verify(folder, quick=quick)
        assert not result.complete
        assert result.problems == [
            f"incomplete: {n_shards} of 4 shards are done and the data set was never closed; "
            f"run `gensig resume {folder}`"
        ]
    assert "incomplete" in inspect(folder)


def test_folder_that_is_no_datasetting(tmp_path):
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(DatasetError, match="no gensig data set"):
            verify(path)
    os.mkfifo(tmp_path / "manifest.json")  # must not hang
    with pytest.raises(DatasetError, match="no gensig data set"):
        verify(tmp_path)


def test_linked_shards_outside_the_folder_are_refused(folder, tmp_path):
    (folder / "shards").rename(tmp_path / "elsewhere")
    (folder / "shards").symlink_to(tmp_path / "elsewhere")
    assert any("leads out" in problem for problem in verify(folder).problems)


def test_inspect_shows_what_is_there(folder, tmp_path):
    text = inspect(folder)
    for part in (
        "complete",
        "36, 0 failed",
        "4 done",
        "crack 12",
        "6: u0 6",
        "1800 to 1835 r/min",
        "20 N m",
        "ok 36",
    ):
        assert part in text, part
    text = inspect(shard_path(folder, 0))
    assert "/acceleration (10, 2, 200) float32, m/s^2" in text
    assert "class_names = " + str(CLASSES) in text
    assert "virtual" in inspect(folder / "index.h5")
    with h5py.File(tmp_path / "any.h5", "w") as file:
        file["x\x1b[31m"] = 3.5
        file["deep/er/y"] = np.zeros(3)
        file["deep/loop"] = file["deep"]
        file["out"] = h5py.ExternalLink("/etc/passwd", "/x")
    text = inspect(tmp_path / "any.h5")
    assert "\x1b" not in text
    for part in (
        "value 3.5",
        "/deep/er/y (3,) float64",
        "/out -> ExternalLink, not followed",
    ):
        assert part in text, part
    for bad in (tmp_path / "none", folder / "plan.csv", tmp_path):
        with pytest.raises(DatasetError):
            inspect(bad)


def test_card_states_facts_and_escapes(tmp_path):
    plan = make_plan()
    evil = "<script>|`*"
    units = np.where(plan.columns["label"] == 1, evil, plan.columns["label_name"])
    folder = build(
        tmp_path / "a_b", Plan(columns={**plan.columns, "label_name": units}), failed=3
    )
    card = (folder / "README.md").read_text()
    assert "\n# a\\_b\n" in card
    for part in (
        "36, of which 1 failed",
        "1000 Hz",
        "0.2 s (200 samples)",
        "n\\_teeth\\_pinion | 23",
        "CC BY 4.0",
        "1800 to 1835 r/min",
        "wheel\\_ü (m/s^2)",
        "by\\_unit |",
        "| healthy | 12 | 0 |",
    ):
        assert part in card, part
    assert "<script>" not in card
    assert "&lt;script&gt;\\|\\`\\* | 12 | 0.25 |" in card
