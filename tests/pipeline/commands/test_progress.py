"""What a run says of itself: a bar on a terminal, plain lines elsewhere, nothing when quiet, and always a log."""

import io
import os
import pty
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_sets import TINY, contents, make

from gensig.cli import main
from gensig.commands import console
from gensig.commands.console import ShardProgress
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.checksums import read_checksums
from gensig.execution.local import LocalExecutor
from gensig.production.folder import Progress, run_folder

STATE = Progress(
    n_done=60, n_records=100, n_failed=2, n_made=40, n_bytes=8_000_000, reason=""
)


def test_plain_lines_come_every_few_seconds_even_before_a_shard(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(console, "LINE_SECONDS", 0.05)
    with ShardProgress(
        quiet=False, n_records=100, n_shards=17, n_at_work=3
    ) as progress:
        time.sleep(0.3)
        before = capsys.readouterr().err.splitlines()
        progress(STATE)
        time.sleep(0.3)
    after = capsys.readouterr().err.splitlines()
    assert len(before) >= 2
    assert all(
        re.fullmatch(
            r"0 of 100 records, 0 s; 3 of 17 shards at work, counted when whole", line
        )
        for line in before
    )
    assert len(after) >= 2
    assert all(
        re.fullmatch(
            r"60 of 100 records, [0-9.]+ records/s, 8\.0 MB, 0 s left, 2 failed", line
        )
        for line in after
    )


def test_a_long_wait_for_the_first_record_is_explained() -> None:
    progress = ShardProgress(quiet=True, n_records=100, n_shards=1, n_at_work=1)
    progress._begin -= 15.0
    assert (
        progress.facts()
        == "15 s; 1 of 1 shards at work, counted when whole; the first run compiles for a minute or two"
    )


def test_rate_and_time_left_are_those_of_this_run() -> None:
    """Records that were there before a resume were not made by it."""
    progress = ShardProgress(quiet=True, n_records=100, n_shards=1, n_at_work=2)
    assert progress.facts() == "0 s; 1 of 1 shards at work, counted when whole"
    progress._begin -= 20.0
    progress(STATE)
    assert progress.facts() == "2.0 records/s, 8.0 MB, 20 s left, 2 failed"
    progress._last_time -= 5.0  # nothing came since
    progress._begin -= 5.0
    assert progress.facts() == "2.0 records/s, 8.0 MB, 15 s left, 2 failed"


@pytest.mark.parametrize(
    ("seconds", "text"), [(59.4, "59 s"), (190.0, "3 min 10 s"), (7500.0, "2 h 5 min")]
)
def test_durations_are_read_by_people(seconds: float, text: str) -> None:
    assert console._duration(seconds) == text


def test_quiet_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make(tmp_path / "data")
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_a_terminal_shows_a_bar_with_rate_bytes_and_time_left(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-m",
        "gensig.cli",
        "generate",
        *TINY,
        "executor.n_workers=1",
        f"out={tmp_path / 'x'}",
    ]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120", "NO_COLOR": "1"}
    process = subprocess.Popen(
        command, stderr=theirs, stdout=subprocess.DEVNULL, env=environment
    )
    os.close(theirs)
    shown = io.BytesIO()
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown.write(part)
    os.close(ours)
    assert process.wait(timeout=60) == 0
    text = shown.getvalue().decode(errors="replace")
    assert re.search(r"6/6 [0-9.]+ records/s, 0\.2 MB, 0 s left", text), text[-500:]


def test_the_log_tells_what_happened_and_is_closed_with_the_set(tmp_path: Path) -> None:
    out = make(tmp_path / "data")
    lines = (out / "run.log").read_text().splitlines()
    assert all(
        re.match(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00 \S", line) for line in lines
    )
    text = [line.partition(" ")[2] for line in lines]
    assert "6 records in 6 shards are planned" in text[0]
    assert "LocalExecutor(n_workers=1): 6 of 6 shards to make" in text[1]
    assert re.fullmatch(r"shard 0: 1 records, 0 failed, \d+ bytes", text[2])
    assert text[-1] == "every shard is done; closing"
    assert len(text) == 9
    assert "run.log" in read_checksums(out)
    before = (out / "run.log").read_bytes()
    assert main(["resume", "--quiet", str(out)]) == 0
    assert main(["finalize", str(out)]) == 0
    assert run_folder(
        out, executor=LocalExecutor(n_workers=1), on_shard=lambda _: None
    ) == (0, [])
    assert main(["verify", str(out)]) == 0
    assert (out / "run.log").read_bytes() == before


def test_the_log_tells_of_a_run_that_ended_early(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(_progress: ShardProgress, _state: Progress) -> None:
        raise KeyboardInterrupt

    out = tmp_path / "data"
    with monkeypatch.context() as patch:
        patch.setattr(ShardProgress, "__call__", interrupt)
        assert (
            main(["generate", "--quiet", *TINY, "executor.n_workers=1", f"out={out}"])
            == 130
        )
    assert (
        "ended by KeyboardInterrupt" in (out / "run.log").read_text().splitlines()[-1]
    )
    assert main(["resume", "--quiet", "--workers", "1", str(out)]) == 0
    assert "5 of 6 shards to make" in (out / "run.log").read_text()
    assert verify(out).complete


def test_a_log_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    out = tmp_path / "data"
    assert main(["plan", "--freeze", *TINY, f"out={out}"]) == 0
    (out / "run.log").unlink()
    (out / "run.log").mkdir()
    assert main(["resume", "--quiet", "--workers", "1", str(out)]) == 0
    assert verify(out).complete


def test_figures_are_the_same_however_the_set_was_made(tmp_path: Path) -> None:
    one, other = (
        make(tmp_path / "one"),
        make(tmp_path / "other", "executor.n_workers=2"),
    )
    names = sorted(path.name for path in (one / "figures").iterdir())
    assert names == ["0-healthy.png", "1-crack.png"]
    assert all(
        (one / "figures" / name).read_bytes() == (other / "figures" / name).read_bytes()
        for name in names
    )
    assert "](figures/1-crack.png)" in (one / "README.md").read_text()
    assert contents(one) == contents(other)


def test_an_edited_card_is_named_and_accepted_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = make(tmp_path / "data")
    with (out / "README.md").open("a") as card:
        card.write("\nThe third unit was run in.\n")
    assert main(["verify", str(out)]) == 1
    assert "README.md was altered" in capsys.readouterr().out
    assert main(["finalize", str(out)]) == 0
    assert "accepted as it is now: README.md" in capsys.readouterr().out
    assert main(["verify", str(out)]) == 0
    content = bytearray(shard_path(out, 3).read_bytes())
    content[len(content) // 2] ^= 4
    shard_path(out, 3).write_bytes(content)
    assert main(["verify", str(out)]) == 1
    assert "shard-00003.h5 was altered" in capsys.readouterr().out
    assert main(["verify", "--quick", str(out)]) == 0
    shard_path(out, 3).write_bytes(content[:-1])
    assert main(["verify", "--quick", str(out)]) == 1
    assert "shard-00003.h5 is truncated" in capsys.readouterr().out
