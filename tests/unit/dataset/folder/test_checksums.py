"""Every changed byte of a closed data set is found; only edits of the card are accepted."""

import hashlib
import json
import shutil
import subprocess
from pathlib import Path

import pytest
from dataset_samples import build, make_plan
from refusals import refused

from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.folder.quick_check import absences
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.checksums import accept_edits, read_checksums
from gensig.errors import DatasetError

FILES = (
    "README.md",
    "SHA256SUMS",
    "config.yaml",
    "croissant.json",
    "index.h5",
    "manifest.json",
    "overrides.yaml",
    "plan.csv",
    "run.log",
    "figures/0-healthy.png",
    "shards/shard-00000.h5",
    "splits/by_unit.csv",
)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """A data set with everything that a run leaves in it."""
    folder = build(tmp_path_factory.mktemp("logged") / "set", make_plan(), close=False)
    (folder / "run.log").write_text("begun\n")
    (folder / "figures").mkdir()
    (folder / "figures" / "0-healthy.png").write_bytes(b"\x89PNG, for one")
    finalize(folder)
    assert verify(folder).problems == []
    return folder


@pytest.fixture
def with_log(logged, tmp_path):
    """The same, to be damaged."""
    return shutil.copytree(logged, tmp_path / "logged")


def test_every_file_is_listed_as_sha256sum_does(with_log):
    paths = [path for path in with_log.rglob("*") if path.is_file()]
    result = {str(path.relative_to(with_log)) for path in paths}
    listed = read_checksums(with_log)
    assert listed.keys() == result - {"SHA256SUMS"}
    assert set(FILES) <= result
    for name, digest in listed.items():
        assert hashlib.sha256((with_log / name).read_bytes()).hexdigest() == digest
    if command := shutil.which("sha256sum"):
        words = [command, "--check", "--strict", "SHA256SUMS"]
        subprocess.run(words, cwd=with_log, capture_output=True, check=True)


@pytest.mark.parametrize("name", FILES)
def test_a_flipped_byte_anywhere_is_found_and_its_file_named(with_log, name):
    path = with_log / name
    content = path.read_bytes()
    n = len(content)
    for index, bit in ((0, 5), (n // 3, 0), (n - 1, 5)):
        damaged = bytearray(content)
        damaged[index] ^= 1 << bit
        path.write_bytes(damaged)
        result = verify(with_log)
        assert not result.complete
        text = " ".join(result.problems)
        assert path.name in text, (index, bit)
        assert "\n" not in text
    path.write_bytes(content)
    assert verify(with_log).complete


@pytest.mark.parametrize("name", sorted({*FILES} - {"manifest.json"}))
@pytest.mark.parametrize("quick", [False, True])
def test_a_missing_file_is_named(with_log, name, quick):
    (with_log / name).unlink()
    text = "\n".join(verify(with_log, quick=quick).problems)
    assert f"{Path(name).name} is missing" in text


@pytest.mark.parametrize("quick", [False, True])
def test_environment_cannot_be_rewritten(with_log, quick):
    path = with_log / "manifest.json"
    content = json.loads(path.read_text())
    content["environment"]["numpy"] = "9.9.9"
    path.write_text(json.dumps(content, indent=1) + "\n")
    problems = "\n".join(verify(with_log, quick=quick).problems)
    assert "manifest.json was altered" in problems


def test_an_extra_figure_is_named(with_log):
    (with_log / "figures" / "7-foreign.png").write_bytes(b"x")
    assert any("7-foreign.png" in line for line in verify(with_log).problems)


def test_hand_written_words_are_accepted_when_asked(with_log):
    assert accept_edits(with_log) == []
    with (with_log / "README.md").open("a") as card:
        card.write("\nOur rig has a loose bolt.\n")
    (line,) = verify(with_log).problems
    assert "README.md was altered" in line
    assert "gensig finalize" in line
    before = (with_log / "manifest.json").read_bytes()
    assert accept_edits(with_log) == ["README.md"]
    assert verify(with_log).complete
    assert (with_log / "manifest.json").read_bytes() == before


@pytest.mark.parametrize(
    "name", ["manifest.json", "run.log", "figures/0-healthy.png", "SHA256SUMS"]
)
def test_nothing_else_is_accepted(with_log, name):
    content = bytearray((with_log / name).read_bytes())
    content[-2] ^= 1
    (with_log / name).write_bytes(content)
    with pytest.raises(DatasetError, match=r"may be edited|damaged|no JSON"):
        accept_edits(with_log)
    assert not verify(with_log).complete


def test_an_edited_card_is_there_and_one_that_is_gone_is_not(with_log):
    """`gensig resume` leaves a complete set with other words complete."""
    manifest = read_manifest(with_log)
    (with_log / "README.md").write_text("# Mine\n")
    assert absences(with_log, manifest) == []
    (with_log / "README.md").unlink()
    (line,) = absences(with_log, manifest)
    assert line.startswith("README.md is missing")


def test_a_card_that_is_gone_is_not_accepted(with_log):
    (with_log / "README.md").unlink()
    with refused("README.md is missing", DatasetError):
        accept_edits(with_log)


def test_checksums_that_are_gone_are_written_when_asked(with_log):
    path = with_log / "SHA256SUMS"
    before = path.read_bytes()
    path.unlink()
    assert accept_edits(with_log) == ["SHA256SUMS"]
    assert path.read_bytes() == before


def test_an_incomplete_set_has_nothing_to_accept(tmp_path, plan):
    with refused("incomplete", DatasetError):
        accept_edits(build(tmp_path / "a", plan, close=False))


@pytest.mark.parametrize(
    "line",
    [
        "0" * 64 + "  ../secret",
        "0" * 64 + "  shards/../../x.h5",
        "short  README.md",
        "0" * 64 + " README.md",
    ],
)
def test_forged_lines_are_refused(with_log, line):
    with (with_log / "SHA256SUMS").open("a") as file:
        file.write(line + "\n")
    with refused("none of a data set", DatasetError):
        read_checksums(with_log)
    assert not verify(with_log).complete
