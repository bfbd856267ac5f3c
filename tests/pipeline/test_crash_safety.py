"""Kills, Ctrl-C, full disks, closed folders and changed settings, each mended by resume."""

import json
import multiprocessing
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace

import pytest
from small_sets import TINY, contents, make

from benchmarks._kill_verbs import kill_verbs
from benchmarks._process_groups import alive_in_group
from benchmarks.kill_campaign import campaign, n_kills_of
from gensig.cli import main
from gensig.dataset.folder import beginning
from gensig.dataset.folder.layout import read_manifest, shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.receipts import receipt_path, write_receipt
from gensig.text.installation import install


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return make(tmp_path_factory.mktemp("reference") / "data")


@pytest.fixture
def begun(reference, tmp_path):
    """The reference as an interrupted run leaves it: shards 0 and 1 done, shard 2 unfinished."""
    out = tmp_path / "data"
    shutil.copytree(reference, out)
    content = json.loads((out / "manifest.json").read_text())
    content["state"] = "incomplete"
    del content["files"]["index.h5"]
    for entry in content["shards"][2:]:
        entry.update(state="planned", sha256="", bytes=0)
        (out / "shards" / entry["name"]).unlink()
    (out / "manifest.json").write_text(json.dumps(content))
    (out / "index.h5").unlink()
    (out / "shards" / ".shard-00002.h5.99-abc.tmp").write_bytes(b"half of it")
    assert not verify(out).complete
    return out


def resume(out, *words):
    """In this process, unless the words choose an executor."""
    own = (
        () if any(word.startswith("executor") for word in words) else ("--workers", "1")
    )
    return main(["resume", "--quiet", str(out), *words, *own])


def test_killed_at_random_moments_it_ends_byte_equal(tmp_path):
    seed = time.time_ns()
    outcome, problems = campaign(3, seed, tmp_path)
    assert problems == [], seed
    assert n_kills_of(outcome) >= 3, (outcome, seed)


@pytest.mark.parametrize("name", ["plan --freeze", "finalize", "export wav"])
def test_a_verb_killed_between_file_operations_is_finished_as_it_says(tmp_path, name):
    seed = time.time_ns()
    assert list(kill_verbs(1, seed, tmp_path, [name])) == [(name, [])], seed


def heed_interrupts():
    """Undo the disposition that a child of ``nohup`` or of a background job inherits."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize(
    ("number", "status", "said_first"),
    [
        (signal.SIGINT, 130, "gensig: interrupted;"),
        (signal.SIGTERM, 143, "gensig: stopped by SIGTERM;"),
    ],
)
def test_a_signal_to_all_processes_is_one_line(
    reference, tmp_path, number, status, said_first
):
    out = tmp_path / "data"
    words = ["generate", "--quiet", *TINY, "executor.n_workers=2", f"out={out}"]
    process = subprocess.Popen(
        [sys.executable, "-m", "gensig.cli", *words],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heed_interrupts,
    )
    while not (out / "manifest.json").is_file():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(0.3)  # its workers are importing now
    os.killpg(process.pid, number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == status
    (line,) = said.splitlines()
    assert line.startswith(said_first)
    assert line.endswith(f"and gensig resume {out} finishes it")
    deadline = time.monotonic() + 10.0
    while left := alive_in_group(process.pid):
        assert time.monotonic() < deadline, left
        time.sleep(0.05)
    assert not verify(out).complete
    assert resume(out) == 0
    assert contents(out) == contents(reference)


def test_full_disk_is_mended_by_space_and_resume(reference, tmp_path, capsys):
    """No file of a shard's size can be written."""
    out = tmp_path / "data"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        status = main(
            ["generate", "--quiet", *TINY, "executor.n_workers=1", f"out={out}"]
        )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert status in (1, 2)
    assert "cannot write" in capsys.readouterr().err
    assert not verify(out).complete
    assert not list(out.rglob("*.tmp"))
    assert resume(out) == 0
    assert contents(out) == contents(reference)


@contextmanager
def closed(folder):
    """A folder that may not be written, not even by root."""
    if os.geteuid() != 0:
        lock, free = ["chmod", "500"], ["chmod", "700"]
    else:
        lock, free = ["chattr", "+i"], ["chattr", "-i"]
    if not shutil.which(lock[0]) or subprocess.run([*lock, folder]).returncode:
        pytest.skip("root writes everywhere on this file system")
    try:
        yield
    finally:
        subprocess.run([*free, folder], check=True)


@pytest.mark.parametrize("part", [".", "shards"])
def test_closed_folder_is_one_line_and_changes_nothing(begun, reference, part, capsys):
    before = contents(begun)
    with closed(begun / part):
        assert resume(begun) in (1, 2)
    said = capsys.readouterr().err
    assert "cannot write" in said
    assert "Traceback" not in said
    assert not verify(begun).complete
    assert contents(begun).items() >= before.items()
    assert resume(begun) == 0
    assert contents(begun) == contents(reference)


def test_resume_on_another_executor_is_byte_equal(begun, reference):
    assert resume(begun, "executor=local", "executor.n_workers=2", "seed=0") == 0
    assert contents(begun) == contents(reference)


def change_config(out):
    path = out / "config.yaml"
    path.write_text(path.read_text().replace("torque_nm: 20", "torque_nm: 21"))


def change_version(out):
    path = out / "manifest.json"
    content = json.loads(path.read_text()) | {"generator_version": "0.0.1"}
    path.write_text(json.dumps(content))


def change_plan(out):
    path = out / "plan.csv"
    path.write_text(path.read_text().replace("unit-0001", "unit-0002"))


@pytest.mark.parametrize(
    ("change", "words", "hints"),
    [
        (change_config, (), ("operating.torque_nm",)),
        (change_version, (), ("0.0.1",)),
        (change_plan, (), ("plan.csv",)),
        (
            lambda out: None,
            ("seed=3", "mesh.damping_ratio=0.1"),
            ("mesh.damping_ratio", "seed"),
        ),
    ],
)
def test_resume_with_another_identity_is_refused(begun, change, words, hints, capsys):
    change(begun)
    before = contents(begun), (begun / "manifest.json").read_bytes()
    assert resume(begun, *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert all(hint in line for hint in hints)
    assert (contents(begun), (begun / "manifest.json").read_bytes()) == before


def test_what_was_begun_says_how_it_is_finished(begun, capsys):
    how = f"; `gensig resume {begun}` finishes it"
    assert main(["generate", *TINY, f"out={begun}"]) == 2
    assert f"2 of 6 records done{how}" in capsys.readouterr().err
    assert main(["inspect", str(begun)]) == 0
    assert f"2 of 6 records{how}" in capsys.readouterr().out


def test_a_change_is_refused_where_the_options_it_began_with_are_not_known(
    tmp_path, capsys
):
    own = tmp_path / "own" / "experiment"
    own.mkdir(parents=True)
    (own / "mine.yaml").write_text("# @package _global_\nseed: 1\n")
    out = tmp_path / "data"
    words = ["--config-dir", str(own.parent), "experiment=mine", *TINY]
    assert main(["plan", "--freeze", *words, f"out={out}"]) == 0
    capsys.readouterr()
    assert resume(out, "seed=2") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("only executor.* may change: leave out seed=2")
    assert resume(out) == 0


def test_a_killed_beginning_says_what_to_do_and_is_begun_anew(
    reference, tmp_path, capsys
):
    """SIGKILL of the command as soon as it has begun its folder, before the manifest is there."""
    out = tmp_path / "data"
    words = ["generate", "--quiet", *TINY, "executor.n_workers=1", f"out={out}"]

    def killed():
        beginning.write_manifest = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
        main(words)

    process = multiprocessing.get_context("fork").Process(target=killed)
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    assert (out / "plan.csv").is_file()
    assert not (out / "manifest.json").exists()
    for verb in ("resume", "verify", "finalize", "inspect"):
        assert main([verb, str(out)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "gensig generate" in line
        assert "again" in line
    assert main(words) == 0
    assert contents(out) == contents(reference)


def test_resume_without_the_compression_is_refused_before_anything_runs(
    tmp_path, monkeypatch, capsys
):
    out = tmp_path / "data"
    assert (
        main(["plan", "--freeze", *TINY, "dataset.compression=blosc2", f"out={out}"])
        == 0
    )
    monkeypatch.setitem(sys.modules, "hdf5plugin", None)
    capsys.readouterr()
    assert resume(out) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert install("blosc2") in line
    assert not any((out / "shards").iterdir())


def test_a_shard_lost_since_is_made_again(begun, reference):
    shard_path(begun, 0).unlink()
    shard_path(begun, 1).write_bytes(shard_path(begun, 1).read_bytes()[:-1])
    assert resume(begun) == 0
    assert contents(begun) == contents(reference)


@pytest.mark.parametrize("damage", ["none", "cut shard", "no json", "other rows"])
def test_receipts_are_taken_only_of_whole_shards(begun, reference, damage):
    entry = read_manifest(reference).shards[2]
    shutil.copy(shard_path(reference, 2), shard_path(begun, 2))
    rows = 2 if damage == "other rows" else 1
    write_receipt(begun, 2, replace(entry, rows=rows))
    if damage == "cut shard":
        shard_path(begun, 2).write_bytes(b"short")
    if damage == "no json":
        receipt_path(begun, 2).write_text("{")
    before = shard_path(begun, 2).stat().st_ino
    assert resume(begun) == 0
    assert (shard_path(begun, 2).stat().st_ino == before) == (damage == "none")
    assert contents(begun) == contents(reference)
