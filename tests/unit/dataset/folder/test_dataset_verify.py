"""Verification names every defect of a data set; inspection and card show its content."""

import os

import h5py
import numpy as np
import pytest
from dataset_samples import (
    ATTRIBUTES,
    CLASSES,
    build,
    forge,
    setting,
    write_shard,
)
from refusals import refused

from gensig.dataset.folder.inspection import inspect
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.plan import Plan, plan_text
from gensig.errors import DatasetError


def test_whole_set_passes(folder):
    result = verify(folder)
    assert result.problems == []
    assert (result.complete, result.n_records, result.n_failed) == (True, 36, 0)
    assert verify(folder, quick=True).complete


def test_failed_record_is_counted_not_hidden(tmp_path, plan):
    result = verify(build(tmp_path / "a", plan, failed=12))
    assert result.complete
    assert result.n_failed == 1


def test_split_with_a_unit_on_two_sides_is_found(folder):
    path = folder / "splits" / "by_unit.csv"
    header, first, *others = path.read_text().splitlines(keepends=True)
    record, _, subset = first.strip().partition(",0,1,")
    other = ({"train", "test"} - {subset}).pop()
    path.write_text("".join([header, f"{record},0,1,{other}\n", *others]))
    problem = "splits/by_unit: unit_id u0 is in more than one subset (1 such)"
    assert problem in verify(folder).problems


def test_truncated_swapped_extra_and_foreign_shards_are_named(folder):
    first, second, _, last = (shard_path(folder, shard) for shard in range(4))
    last.write_bytes(last.read_bytes()[:-10])
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    (folder / "shards" / "shard-00004.h5").write_bytes(b"x")
    (folder / "shards" / ".shard-00001.h5.1-a.tmp").write_bytes(b"x")
    text = "\n".join(verify(folder).problems)
    for part in (
        "shard-00003.h5 is truncated",
        "shard-00000.h5 is swapped: it holds what belongs in shard-00001.h5",
        "shard-00001.h5 is swapped: it holds what belongs in shard-00000.h5",
        "shard-00004.h5' is extra",
        ".shard-00001.h5.1-a.tmp' is extra",
    ):
        assert part in text
    assert "shard-00002.h5" not in text
    assert "is truncated" in "\n".join(verify(folder, quick=True).problems)


def test_quick_reads_no_record(folder, monkeypatch):
    def refuse(path, **_):
        raise AssertionError(f"{path} was read")

    for name in ("open_shard", "sha256_file", "read_plan"):
        monkeypatch.setattr(f"gensig.dataset.folder.verify.{name}", refuse)
    path = shard_path(folder, 1)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert verify(folder, quick=True).problems == []  # it does not look at content
    path.write_bytes(content + b"x")
    (problem,) = verify(folder, quick=True).problems
    assert "shard-00001.h5 is not the recorded file" in problem


def test_foreign_shard_is_found_even_when_the_manifest_agrees(folder, plan):
    names = np.char.replace(plan.columns["record_id"], "r", "x")
    renamed = Plan(columns={**plan.columns, "record_id": names})
    path = shard_path(folder, 1)
    path.unlink()
    write_shard(path, renamed, 1, attributes=ATTRIBUTES | {"config_json": '{"a": 2}'})
    assert "altered" in "\n".join(verify(folder).problems)
    text = forge(folder, 1, lambda file: None)
    assert "shard-00001.h5 is foreign: its attributes config_json" in text
    row = "shard-00001.h5 row 0: record_id is 'x000010', the plan says 'r000010'"
    assert row in text


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


def test_altered_plan_and_identity_are_found(folder, plan):
    label = plan.columns["label"].copy()
    label[5] = 0
    altered = Plan(columns={**plan.columns, "label": label})
    (folder / "plan.csv").write_text(plan_text(altered))
    (folder / "config.yaml").write_text("seed: 8\n")
    text = "\n".join(verify(folder).problems)
    assert "plan.csv was altered" in text
    assert "shard-00000.h5 row 5: label is 2, the plan says 0" in text
    assert "the identity in the manifest" in text


@pytest.mark.parametrize("n_shards", [0, 2, 4])
def test_interrupted_set_never_looks_whole(tmp_path, plan, n_shards):
    folder = build(tmp_path / "a", plan, shards=range(n_shards), close=False)
    problem = (
        f"incomplete: {n_shards} of 4 shards are done and the data set was never closed; "
        f"run `gensig resume {folder}`"
    )
    for quick in (False, True):
        result = verify(folder, quick=quick)
        assert (result.complete, result.problems) == (False, [problem])
    assert "incomplete" in inspect(folder)


def test_a_folder_of_data_sets_names_them(tmp_path, plan):
    for name in "ba":
        build(tmp_path / "runs" / name, plan)
    runs = tmp_path / "runs"
    (runs / "notes").mkdir()
    (runs / "linked").symlink_to(tmp_path / "runs" / "a")
    for read in (verify, inspect):
        with pytest.raises(DatasetError) as caught:
            read(runs)
        advice = f"it holds 2 data sets, give one: {runs / 'a'}, {runs / 'b'}"
        assert str(caught.value).endswith(advice)
    for number in range(5):
        (runs / f"c{number}").mkdir()
        (runs / f"c{number}" / "manifest.json").touch()
    with pytest.raises(DatasetError, match=r"it holds 7 data sets, .*c2 and 2 more$"):
        verify(runs)


def test_folder_that_is_no_data_set(tmp_path):
    with refused("no gensig data set", DatasetError):
        verify(tmp_path)
    with refused("none does not exist", DatasetError):
        verify(tmp_path / "none")
    os.mkfifo(tmp_path / "manifest.json")  # must not hang
    with refused("is no ordinary file", DatasetError):
        verify(tmp_path)


def test_inspect_shows_what_is_there(folder, tmp_path):
    text = inspect(folder)
    facts = (
        "complete|36, 0 failed|4 done|crack 12|6: u0 6|1800 to 1835 r/min|20 N m|ok 36"
    )
    for part in facts.split("|"):
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
    assert "value 3.5" in text
    assert "/deep/er/y (3,) float64" in text
    assert "/out -> ExternalLink, not followed" in text
    for bad in (tmp_path / "none", folder / "plan.csv", tmp_path):
        with pytest.raises(DatasetError):
            inspect(bad)


def test_card_states_facts_and_escapes(tmp_path, plan):
    names = np.where(plan.columns["label"] == 1, "<script>|`*", "healthy")
    named = Plan(columns={**plan.columns, "label_name": names})
    card = (build(tmp_path / "a_b", named, failed=3) / "README.md").read_text()
    for part in (
        "\n# a_b\n",
        "36, of which 1 failed",
        "1000 Hz",
        "0.2 s (200 samples)",
        "n_teeth_pinion | 23",
        "CC BY 4.0",
        "1800 to 1835 r/min",
        "wheel_ü (m/s^2)",
        "by_unit |",
        "&lt;script&gt;\\|\\`\\* | 12 | 0.25 |",
    ):
        assert part in card, part
    assert "<script>" not in card
