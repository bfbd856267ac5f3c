"""Executors: every shard once, a dead worker replaced, and the same bytes from all."""

import functools
import itertools
import operator
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from distributed import LocalCluster
from small_sets import TINY, contents, make

from gensig.cli import main
from gensig.dataset.folder.verify import verify
from gensig.errors import ConfigError
from gensig.execution.array import ArrayExecutor
from gensig.execution.base import TRIES, ShardFailure
from gensig.execution.dask import DaskExecutor
from gensig.execution.local import LocalExecutor
from gensig.execution.registry import read_executor
from gensig.text.installation import install

LOCAL = LocalExecutor(n_workers=2)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return make(tmp_path_factory.mktemp("reference") / "data")


def deadly(notes, poison, deaths, index):
    """Ten times the index; the poisonous one kills its process the first few times."""
    begun = len(list(notes.glob(f"{index}-*")))
    (notes / f"{index}-{begun}").touch()
    if index == poison and begun < deaths:
        time.sleep(0.3)  # while the other worker has something in hand
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.1)
    return 10 * index


def outcome(executor, notes, deaths):
    """Results of the others, that of the poisonous one, and how often each was begun."""
    results = dict(executor.run(functools.partial(deadly, notes, 2, deaths), range(6)))
    begun = [len(list(notes.glob(f"{index}-*"))) for index in range(6)]
    poisoned = results.pop(2)
    assert results == {index: 10 * index for index in (0, 1, 3, 4, 5)}
    return poisoned, begun


def test_only_the_shard_of_a_killed_worker_runs_again(tmp_path):
    assert outcome(LOCAL, tmp_path, 1) == (20, [1, 1, 2, 1, 1, 1])


def test_a_shard_that_always_kills_is_given_up_and_the_others_are_made(tmp_path):
    failure, begun = outcome(LOCAL, tmp_path, 99)
    reason = f"its worker process died {TRIES} times"
    assert failure == ShardFailure(reason=reason)
    assert begun == [1, 1, TRIES, 1, 1, 1]


def refuse(notes, index):
    (notes / f"{index}-{time.monotonic_ns()}").touch()
    if index == 1:
        raise ValueError("no\nsuch luck")
    return index


@pytest.mark.parametrize("n_workers", [1, 2])
def test_an_exception_is_one_line_and_not_tried_again(tmp_path, n_workers):
    work = functools.partial(refuse, tmp_path)
    results = dict(LocalExecutor(n_workers=n_workers).run(work, range(3)))
    assert results == {0: 0, 1: ShardFailure(reason="ValueError: no such luck"), 2: 2}
    assert len(list(tmp_path.iterdir())) == 3


def announce(notes, index):
    (notes / f"pid-{os.getpid()}").touch()
    time.sleep(120.0)


def test_workers_end_with_a_killed_parent(tmp_path):
    code = (
        "import functools, pathlib, test_executors as "
        f"t\nlist(t.LOCAL.run(functools.partial(t.announce, pathlib.Path({str(tmp_path)!r})), "
        "range(2)))"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    process = subprocess.Popen([sys.executable, "-c", code], env=environment)
    wait_until(lambda: len(list(tmp_path.glob("pid-*"))) == 2)
    process.kill()
    process.wait()
    workers = [int(path.name.removeprefix("pid-")) for path in tmp_path.iterdir()]
    wait_until(lambda: not any(is_alive(pid) for pid in workers))


def is_alive(pid):
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        )
    except OSError:
        return False


def wait_until(condition):
    deadline = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def test_a_script_without_a_main_guard_runs_once(tmp_path):
    script = tmp_path / "mine.py"
    script.write_text(
        "import operator\n"
        "from gensig.execution.local import LocalExecutor\n"
        "print('begun')\n"
        "print(sorted(LocalExecutor(n_workers=2).run(operator.neg, range(4))))\n"
        "print(__file__, __spec__)\n"
    )
    ran = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=120
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.splitlines() == [
        "begun",
        "[(0, 0), (1, -1), (2, -2), (3, -3)]",
        f"{script} None",
    ]
    assert not ran.stderr


def test_tasks_of_an_array_share_all_shards_out():
    def task(index, count):
        return ArrayExecutor(shard_index=index, shard_count=count, n_workers=1)

    shares = [task(index, 3).share(range(8)) for index in range(3)]
    assert sorted(itertools.chain(*shares)) == list(range(8))
    assert all(shares)
    assert dict(task(1, 3).run(operator.neg, range(8))) == {1: -1, 4: -4, 7: -7}
    assert task(9, 10).share(range(8)) == []


@pytest.mark.parametrize(
    ("section", "hint"),
    [
        ({"kind": "cloud"}, "local, dask, slurm"),
        ({"kind": "local", "n_workers": 0}, "n_workers = 0 .* at least 1, or null$"),
        ({"kind": "dask", "n_workers": 1, "address": 3}, "executor.address"),
        (
            {"kind": "slurm", "n_workers": 1, "shard_index": None, "shard_count": 2},
            "executor.shard_index",
        ),
        (
            {"kind": "slurm", "n_workers": 1, "shard_index": 2, "shard_count": 2},
            "--array=0-1",
        ),
        (
            {"kind": "slurm", "n_workers": 1, "shard_index": -1, "shard_count": 2},
            "at least 0$",
        ),
    ],
)
def test_a_mistake_is_one_line(section, hint):
    with pytest.raises(ConfigError, match=hint) as caught:
        read_executor(section)
    assert "\n" not in str(caught.value)


def test_missing_dask_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=re.escape(install("dask"))):
        read_executor({"kind": "dask", "n_workers": 1, "address": None})


def test_two_tasks_at_a_time_make_the_same_bytes(reference, tmp_path, capsys):
    out = tmp_path / "data"
    assert main(["plan", "--freeze", *TINY, "executor=slurm", f"out={out}"]) == 0
    frozen = (out / "manifest.json").read_bytes()
    line = "generate --quiet executor=slurm executor.n_workers=1 executor.shard_count=2"
    words = [*line.split(), f"out={out}"]
    first, second = (f"executor.shard_index={index}" for index in (0, 1))
    capsys.readouterr()
    assert main([*words, first, "seed=5", "operating.torque_nm=7"]) == 2
    assert "operating.torque_nm, seed" in capsys.readouterr().err
    command = [sys.executable, "-m", "gensig.cli", *words, second]
    other = subprocess.Popen(command)
    assert main([*words, first, "seed=0"]) == 0
    assert not verify(out).complete
    assert other.wait(timeout=300) == 0
    assert (out / "manifest.json").read_bytes() == frozen  # tasks leave it alone
    # As if that task had been killed just before its receipt.
    (out / "shards" / ".shard-00003.h5.done").unlink()
    assert main(["finalize", str(out)]) == 2
    missing = "5 of 6 shards are done, shard-00003.h5 is planned"
    assert missing in capsys.readouterr().err
    assert main([*words, second]) == 0
    assert main(["finalize", str(out)]) == 0
    assert verify(out).problems == []
    assert contents(out) == contents(reference)


@pytest.fixture
def cluster():
    """A Dask scheduler and two worker processes."""
    options = {"threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=2, **options) as cluster:
        yield cluster


def test_dask_survives_a_killed_worker_with_the_same_bytes(
    reference, cluster, tmp_path
):
    out = tmp_path / "data"
    is_complete = []

    def kill_in_mid_run():
        wait_until(lambda: any((out / "shards").glob("shard-*.h5")))
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        is_complete.append(verify(out).complete)

    thread = threading.Thread(target=kill_in_mid_run)
    thread.start()
    address = f"executor.address={cluster.scheduler_address}"
    words = ["generate", "--quiet", *TINY, "executor=dask", address, f"out={out}"]
    assert main(words) == 0
    thread.join()
    assert is_complete == [False]
    assert contents(out) == contents(reference)


def test_dask_on_this_machine_gives_up_a_shard_that_always_kills(tmp_path):
    executor = DaskExecutor(n_workers=2, address=None)
    failure, begun = outcome(executor, tmp_path, 99)
    assert "KilledWorker" in failure.reason
    # Dask also counts a worker that is lost before it has begun the shard, on a busy machine.
    assert 1 <= begun[2] <= TRIES


def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr("gensig.execution.dask.CONNECT_SECONDS", 0.2)
    with pytest.raises(ConfigError, match="no Dask scheduler answers"):
        list(DaskExecutor(n_workers=1, address="tcp://127.0.0.1:9").run(abs, [1]))
