"""Reports of a run: a bar on a terminal, lines elsewhere, nothing when quiet, always a log."""

import errno
import os
import pickle
import pty
import re
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest
from small_sets import TINY, contents, make

from gensig.cli import main
from gensig.dataset.folder import run_log
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.checksums import read_checksums
from gensig.execution.local import LocalExecutor
from gensig.production.folder import run_folder
from gensig.production.record_counts import RecordCounts, record_counts
from gensig.production.shard_writing import write_shard
from gensig.terminal import run_progress
from gensig.terminal.interruptions import AGAIN
from gensig.terminal.run_progress import COMPILING, STARTING, Progress, RunProgress

STATE = Progress(
    n_done=60, n_records=100, n_failed=2, n_made=40, n_bytes=8_000_000, reason=""
)


@pytest.fixture
def data(tiny_set, tmp_path):
    """A copy of a small data set."""
    return tiny_set.copy_to(tmp_path / "data")


@dataclass
class FakeCounts:
    """Records of shards at work, as a test says."""

    n_made: int = 0
    begun: float | None = None
    is_compiling: bool = False
    compile_seconds: float = 0.0


def quiet_progress(counts=None):
    return RunProgress(quiet=True, n_records=100, counts=counts)


def test_lines_come_every_few_seconds_and_count_records_of_shards_at_work(
    monkeypatch, capsys
):
    monkeypatch.setattr(run_progress, "LINE_SECONDS", 0.03)
    counts = FakeCounts(is_compiling=True)
    progress = RunProgress(quiet=False, n_records=100, counts=counts)
    with progress:
        time.sleep(0.12)
        before = capsys.readouterr().err.splitlines()
        counts.is_compiling, counts.compile_seconds = False, 21.0
        counts.n_made, counts.begun = 7, time.monotonic()
        time.sleep(0.12)
        at_work = capsys.readouterr().err.splitlines()
        counts.n_made = 0
        progress(STATE)
        time.sleep(0.12)
    after = capsys.readouterr().err.splitlines()
    assert len(before) >= 2
    assert set(before) == {f"0 of 100 records, 0 s; {COMPILING}"}
    assert at_work.pop(0) == "compiled in 21 s"
    assert len(at_work) >= 2
    assert all(re.match(r"7 of 100 records, [0-9.]+ records/s, ", x) for x in at_work)
    running = r"60 of 100 records, [0-9.]+ records/s, 8 MB, \d+ s left, 2 failed"
    assert len(after) >= 2
    assert all(re.fullmatch(running, line) for line in after)


def test_rate_and_time_left_are_those_of_this_run():
    """The mean since its first record was begun: neither what was there, nor compiling counts."""
    counts = FakeCounts()
    progress = quiet_progress(counts)
    progress(replace(STATE, n_done=20, n_made=0, n_bytes=0, n_failed=0))
    progress._begin -= 30.0
    assert progress.facts() == f"30 s; {STARTING}"
    counts.begun = time.monotonic() - 10.0
    counts.n_made = 10
    assert progress.facts() == "1.0 records/s, 1 min 10 s left"
    counts.n_made = 34
    assert progress.facts() == "3.4 records/s, 14 s left"
    counts.n_made = 0
    progress(replace(STATE, n_done=70, n_made=50))
    assert progress.facts() == "5.0 records/s, 8 MB, 6 s left, 2 failed"


def test_the_last_line_repeats_the_mean_of_the_run(capsys):
    """Whatever was shown before it, and although records come in blocks."""
    counts = FakeCounts(begun=time.monotonic() - 40.0)
    progress = RunProgress(quiet=False, n_records=100, counts=counts)
    for n_made in (0, 16, 32, 32, 96):
        counts.n_made = n_made
        progress.facts()
    counts.n_made = 0
    progress(replace(STATE, n_done=100, n_made=100, n_failed=0))
    last = "100 of 100 records, 2.5 records/s, 8 MB; checksums, figures and card follow"
    assert capsys.readouterr().err.splitlines() == [last]


def test_without_counts_a_record_counts_with_its_shard():
    progress = quiet_progress()
    progress._begin -= 20.0
    progress(STATE)
    assert progress.facts() == "2.0 records/s, 8 MB, 20 s left, 2 failed"


def test_workers_tell_their_records_and_their_compiling():
    with record_counts(3) as counts:
        assert (counts.n_made, counts.begun, counts.is_compiling) == (0, None, False)
        seen = pickle.loads(pickle.dumps(counts))
        seen.begin(0)
        seen.compiling(0)
        assert (counts.begun, counts.is_compiling) == (None, True)
        before = time.monotonic()
        seen.compiled(0, 21.0)
        assert before <= counts.begun <= time.monotonic()
        assert (counts.is_compiling, counts.compile_seconds) == (False, 21.0)
        begun = counts.begun
        seen.begin(2)
        seen.set(0, 4)
        seen.set(2, 5)
        seen.compiling(0)  # a kernel that only a later record needs
        seen.compiled(0, 22.0)
        assert (counts.n_made, counts.begun) == (9, begun)
        counts.set(0, 0)
        assert counts.n_made == 5
    seen.set(1, 3)  # a worker that outlives the run, or does not see the file
    assert not counts.path.exists()


def test_records_are_counted_while_a_shard_is_made(tmp_path):
    out = tmp_path / "data"
    words = [*TINY, "dataset.records_per_shard=6", f"out={out}"]
    assert main(["plan", "--freeze", *words]) == 0
    seen = []

    class Counts(RecordCounts):
        def set(self, shard, n_records):
            seen.append((shard, n_records))

    counts = Counts(path=tmp_path / "none", n_shards=1)
    write_shard(out, 0, counts=counts)
    assert seen == [(0, n) for n in range(1, 7)]


def test_every_compilation_is_told_and_a_kernel_within_another_is_a_part_of_it():
    """In a process with an empty cache; what is compiled already is not compiled again."""
    code = (
        "import gensig.compilation as c, numba, sys; c.watch(); told = []\n"
        "f = numba.njit(lambda x: x + 1); g = numba.njit(lambda x: f(x) + 2)\n"
        "with c.on_compilation(lambda: told.append(0), told.append):\n"
        "    g(1); g(1); f(1); f(1.0)\n"
        "f(1j)\n"
        "print([seconds > 0 for seconds in told])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"{[False, True] * 2}\n"


def test_a_terminal_shows_a_bar_with_rate_bytes_and_time_left(tmp_path):
    ours, theirs = pty.openpty()
    words = [*TINY, "executor.n_workers=1", f"out={tmp_path / 'x'}"]
    process = subprocess.Popen(
        [sys.executable, "-m", "gensig.cli", "generate", *words],
        stderr=theirs,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "120", "NO_COLOR": "1"},
    )
    os.close(theirs)
    shown = b""
    try:
        while part := os.read(ours, 65536):
            shown += part
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    assert process.wait(timeout=60) == 0
    assert re.search(rb"6/6 [0-9.]+ records/s, \d+ kB", shown), shown[-500:]


def test_the_log_tells_what_happened_and_is_closed_with_the_set(data):
    lines = (data / "run.log").read_text().splitlines()
    stamp = re.compile(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00 (?=\S)")
    assert all(stamp.match(line) for line in lines)
    planned, begun, first, *_, last = (stamp.sub("", line) for line in lines)
    assert "6 records in 6 shards are planned" in planned
    assert "LocalExecutor(n_workers=1): 6 of 6 shards to make" in begun
    assert re.fullmatch(r"shard 0: 1 records, 0 failed, \d+ bytes", first)
    assert last == "every shard is done; closing"
    assert len(lines) == 9
    assert "run.log" in read_checksums(data)
    before = (data / "run.log").read_bytes()
    assert main(["resume", "--quiet", str(data)]) == 0
    assert main(["finalize", str(data)]) == 0
    executor = LocalExecutor(n_workers=1)
    assert run_folder(data, executor=executor, on_shard=print) == (0, [])
    assert main(["verify", str(data)]) == 0
    assert (data / "run.log").read_bytes() == before


def test_the_log_tells_of_a_run_that_ended_early(tmp_path, monkeypatch, capsys):
    def interrupt(_progress, state):
        if state.n_made:
            raise KeyboardInterrupt

    out = tmp_path / "data"
    with monkeypatch.context() as patch:
        patch.setattr(RunProgress, "__call__", interrupt)
        words = ["--quiet", *TINY, "executor.n_workers=1", f"out={out}"]
        assert main(["generate", *words]) == 130
    last = (out / "run.log").read_text().splitlines()[-1]
    assert "ended by KeyboardInterrupt" in last
    capsys.readouterr()
    assert main(["resume", "--quiet", "--workers", "1", str(out)]) == 0
    assert capsys.readouterr() == ("", "")  # quiet says nothing
    assert "5 of 6 shards to make" in (out / "run.log").read_text()
    assert verify(out).complete


def test_a_log_that_cannot_be_written_stops_nothing(tmp_path, monkeypatch):
    def refuse(*_words):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    out = tmp_path / "data"
    assert main(["plan", "--freeze", *TINY, f"out={out}"]) == 0
    (out / "run.log").unlink()
    refusing = SimpleNamespace(**{**vars(os), "open": refuse})
    monkeypatch.setattr(run_log, "os", refusing)
    assert main(["resume", "--quiet", "--workers", "1", str(out)]) == 0
    assert verify(out).complete
    assert not (out / "run.log").exists()


def test_an_edited_card_is_named_and_accepted_when_asked(data, capsys):
    def said(status, *words):
        assert main([*words, str(data)]) == status
        return capsys.readouterr().out

    with (data / "README.md").open("a") as card:
        card.write("\nThe third unit was run in.\n")
    assert "README.md was altered" in said(1, "verify")
    assert "accepted as it is now: README.md" in said(0, "finalize")
    said(0, "verify")
    shard_path(data, 3).write_bytes(b"short")
    assert "shard-00003.h5 is truncated" in said(1, "verify", "--quick")


@pytest.mark.parametrize("folder", ["data", "my data"])
def test_an_interruption_names_the_folder_to_resume(
    folder, tmp_path, monkeypatch, capsys
):
    def interrupt(_progress, _state):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    out = tmp_path / folder
    with monkeypatch.context() as patch:
        patch.setattr(RunProgress, "__call__", interrupt)
        assert main(["generate", "--quiet", *TINY, "-j", "1", "--out", folder]) == 130
        first = capsys.readouterr().err
        assert main(["resume", "--quiet", "--workers", "1", folder]) == 130
        assert capsys.readouterr().err == first
    words = shlex.split(first.partition("and ")[2].removesuffix(" finishes it\n"))
    assert words == ["gensig", "resume", folder]
    assert main([*words[1:], "--quiet", "-j", "1"]) == 0
    plain = make(tmp_path / "plain")
    assert contents(out) == contents(plain)


def test_an_interruption_without_a_data_set_names_none(monkeypatch, capsys):
    def interrupt(*_words):
        raise KeyboardInterrupt

    monkeypatch.setattr("gensig.commands.options.groups", interrupt)
    assert main(["options"]) == 130
    assert capsys.readouterr().err == f"gensig: interrupted; {AGAIN}\n"


def test_quiet_shows_no_note_and_no_result(tmp_path, capsys):
    """Notes of the plan and of typed words, results, and a set that is complete already."""
    out = str(tmp_path / "data")
    words = ["solver.max_error=null", "solver.oversampling=2", "executor.n_workers=1"]
    generate = ["generate", *TINY, *words, f"out={out}"]
    assert main([*generate, "--quiet"]) == 0
    assert main(["resume", out, "--quiet"]) == 0
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "")
    assert main(["resume", out]) == 0
    assert "is complete" in capsys.readouterr().out
    assert (
        main(["resume", f"{out}/none", "--quiet"]) == 2
    )  # a mistake is said all the same
    assert capsys.readouterr().err.startswith("gensig: ")
