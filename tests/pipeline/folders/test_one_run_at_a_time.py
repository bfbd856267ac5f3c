"""One run at a time makes the shards of a folder; tasks of an array job share it."""

import errno
import multiprocessing
import os
import signal

import filelock
import pytest
from small_sets import TINY, contents, make, resume

from gensig.cli import main
from gensig.dataset.folder.layout import SHARDS
from gensig.dataset.folder.verify import verify
from gensig.dataset.storage.atomic import at_work

TASKS = ("executor=slurm", "executor.shard_index=0", "executor.shard_count=1")


@pytest.fixture
def frozen(tmp_path):
    """A folder that is planned, and not made."""
    out = tmp_path / "data"
    assert main(["plan", "--freeze", *TINY, f"out={out}"]) == 0
    return out


def refused(capsys, out, *words):
    capsys.readouterr()
    assert main(list(words)) == 2
    message = f"another process is at work in {out}; wait until it ends, or stop it"
    assert capsys.readouterr().err == f"gensig: {message}\n"


def test_a_second_run_is_refused_and_the_set_is_whole_after_the_first(
    frozen, tmp_path, capsys
):
    with at_work(frozen / SHARDS, others=False):
        refused(capsys, frozen, "resume", str(frozen))
        refused(capsys, frozen, "generate", "--quiet", *TASKS, f"out={frozen}")
    assert resume(frozen) == 0
    assert verify(frozen).problems == []
    assert contents(frozen) == contents(make(tmp_path / "plain"))


def work_until_killed(shards, others, begun):
    with at_work(shards, others=others):
        begun.set()
        signal.pause()


@pytest.mark.parametrize("others", [True, False])
def test_the_lock_of_a_killed_run_counts_for_nothing(frozen, capsys, others):
    shards = frozen / SHARDS
    context = multiprocessing.get_context("spawn")
    begun = context.Event()
    run = context.Process(target=work_until_killed, args=(shards, others, begun))
    run.start()
    assert begun.wait(60)
    assert len(list(shards.iterdir())) == int(others)
    refused(capsys, frozen, "resume", str(frozen))

    os.kill(run.pid, signal.SIGKILL)
    run.join()
    assert resume(frozen) == 0
    assert verify(frozen).problems == []
    assert not [path for path in shards.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("others", [True, False])
def test_a_run_that_ends_leaves_no_file(frozen, others):
    with at_work(frozen / SHARDS, others=others):
        pass
    assert list((frozen / SHARDS).iterdir()) == []


def test_a_system_without_locks_locks_nothing(frozen, monkeypatch):
    def refuse(_descriptor, **_):
        raise OSError(errno.ENOSYS, "no locks")

    monkeypatch.setattr(filelock, "lock_descriptor", refuse)
    with at_work(frozen / SHARDS, others=False), at_work(frozen / SHARDS, others=True):
        assert resume(frozen) == 0
    assert verify(frozen).problems == []


def test_a_folder_in_work_says_so_and_one_that_was_stopped_how_it_goes_on(
    frozen, capsys
):
    again = ["generate", "--quiet", *TINY, f"out={frozen}"]
    with at_work(frozen / SHARDS, others=False):
        refused(capsys, frozen, *again)
        assert main(["inspect", str(frozen)]) == 0
        said = capsys.readouterr().out
        assert "; another process is at work in it" in said
        assert "gensig resume" not in said
    assert main(again) == 2
    assert f"`gensig resume {frozen}` finishes it" in capsys.readouterr().err
    assert main(["inspect", str(frozen)]) == 0
    assert f"`gensig resume {frozen}` finishes it" in capsys.readouterr().out


def test_tasks_share_a_folder_that_nobody_closes_meanwhile(frozen, capsys):
    with at_work(frozen / SHARDS, others=True):
        assert main(["generate", "--quiet", *TASKS, f"out={frozen}"]) == 0
        refused(capsys, frozen, "finalize", str(frozen))
        refused(capsys, frozen, "resume", "--quiet", str(frozen))
    assert main(["finalize", str(frozen)]) == 0
    assert verify(frozen).complete
