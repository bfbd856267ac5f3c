"""One run at a time makes the shards of a folder; tasks of an array job share it."""

import pytest
from small_sets import TINY, contents, make

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
        refused(capsys, frozen, "resume", "--quiet", "-j", "1", str(frozen))
        refused(capsys, frozen, "generate", "--quiet", *TASKS, f"out={frozen}")
    assert main(["resume", "--quiet", "-j", "1", str(frozen)]) == 0
    assert verify(frozen).problems == []
    assert contents(frozen) == contents(make(tmp_path / "plain"))


def test_tasks_share_a_folder_that_nobody_closes_meanwhile(frozen, capsys):
    with at_work(frozen / SHARDS, others=True):
        assert main(["generate", "--quiet", *TASKS, f"out={frozen}"]) == 0
        refused(capsys, frozen, "finalize", str(frozen))
        refused(capsys, frozen, "resume", "--quiet", str(frozen))
    assert main(["finalize", str(frozen)]) == 0
    assert verify(frozen).complete
