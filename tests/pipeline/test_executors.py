"""Executors: every shard once, a dead worker replaced, and the same bytes from all."""

import functools
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest
from small_sets import TINY, contents, make

from gensig.cli import main
from gensig.dataset.folder.verify import verify
from gensig.errors import ConfigError
from gensig.execution.array import ArrayExecutor
from gensig.execution.base import TRIES, ShardFailure
from gensig.execution.dask import DaskExecutor
from gensig.execution.local import LocalExecutor
from gensig.execution.registry import read_executor

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
    """Results by index, and how often each was begun."""
    results = dict(executor.run(functools.partial(deadly, notes, 2, deaths), range(6)))
    return results, {index: len(list(notes.glob(f"{index}-*"))) for index in range(6)}


def test_only_the_shard_of_a_killed_worker_runs_again(tmp_path):
    results, begun = outcome(LOCAL, tmp_path, 1)
    assert results == {index: 10 * index for index in range(6)}
    assert begun == {0: 1, 1: 1, 2: 2, 3: 1, 4: 1, 5: 1}


def test_a_shard_that_always_kills_is_given_up_and_the_others_are_made(tmp_path):
    results, begun = outcome(LOCAL, tmp_path, 99)
    failure = results.pop(2)
    assert isinstance(failure, ShardFailure)
    assert failure.reason == f"its worker process died {TRIES} times"
    assert results == {index: 10 * index for index in (0, 1, 3, 4, 5)}
    assert begun == {0: 1, 1: 1, 2: TRIES, 3: 1, 4: 1, 5: 1}


def refuse(notes, index):
    (notes / f"{index}-{time.monotonic_ns()}").touch()
    if index == 1:
        raise ValueError("no\nsuch luck")
    return index


@pytest.mark.parametrize("n_workers", [1, 2])
def test_an_exception_is_one_line_and_not_tried_again(tmp_path, n_workers):
    results = dict(
        LocalExecutor(n_workers=n_workers).run(
            functools.partial(refuse, tmp_path), range(3)
        )
    )
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
    wait_until(lambda: len(list(tmp_path.glob("pid-*"))) == 2, process)
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


def wait_until(condition, process=None, seconds=120.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert process is None or process.poll() is None, "the process ended too early"
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
    tasks = [
        ArrayExecutor(shard_index=index, shard_count=3, n_workers=1)
        for index in range(3)
    ]
    shares = [task.share(range(8)) for task in tasks]
    assert sorted(index for share in shares for index in share) == list(range(8))
    assert all(shares)
    assert dict(tasks[1].run(lambda index: -index, range(8))) == {1: -1, 4: -4, 7: -7}
    assert (
        ArrayExecutor(shard_index=9, shard_count=10, n_workers=1).share(range(8)) == []
    )


@pytest.mark.parametrize(
    ("section", "hint"),
    [
        ({"kind": "cloud"}, "local, dask, slurm"),
        ({"kind": "local", "n_workers": 0}, "executor.n_workers"),
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
            "at least 0",
        ),
    ],
)
def test_a_mistake_is_one_line(section, hint):
    with pytest.raises(ConfigError, match=hint) as caught:
        read_executor(section)
    assert "\n" not in str(caught.value)


def test_missing_dask_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"gensig\[dask\]"):
        read_executor({"kind": "dask", "n_workers": 1, "address": None})


def test_two_tasks_at_a_time_make_the_same_bytes(reference, tmp_path, capsys):
    out = tmp_path / "data"
    assert main(["plan", "--freeze", *TINY, "executor=slurm", f"out={out}"]) == 0
    frozen = (out / "manifest.json").read_bytes()
    words = [
        "generate",
        "--quiet",
        "executor=slurm",
        "executor.n_workers=1",
        "executor.shard_count=2",
        f"out={out}",
    ]
    capsys.readouterr()
    assert (
        main([*words, "executor.shard_index=0", "seed=5", "operating.torque_nm=7"]) == 2
    )
    assert "operating.torque_nm, seed" in capsys.readouterr().err
    command = [sys.executable, "-m", "gensig.cli", *words, "executor.shard_index=1"]
    other = subprocess.Popen(command)
    assert main([*words, "executor.shard_index=0", "seed=0"]) == 0
    assert not verify(out).complete
    assert other.wait(timeout=300) == 0
    assert (out / "manifest.json").read_bytes() == frozen  # tasks leave it alone
    # As if that task had been killed just before its receipt.
    (out / "shards" / ".shard-00003.h5.done").unlink()
    assert main(["finalize", str(out)]) == 2
    assert (
        "5 of 6 shards are done, shard-00003.h5 is planned" in capsys.readouterr().err
    )
    assert main([*words, "executor.shard_index=1"]) == 0
    assert main(["finalize", str(out)]) == 0
    assert verify(out).problems == []
    assert contents(out) == contents(reference)


def test_a_task_needs_a_frozen_folder(tmp_path, capsys):
    words = [
        "executor=slurm",
        "executor.shard_index=0",
        "executor.shard_count=1",
        f"out={tmp_path / 'x'}",
    ]
    assert main(["generate", *words]) == 2
    assert "--freeze" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    assert main(["plan", "--freeze"]) == 2
    assert "out=DIR" in capsys.readouterr().err


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Address of a Dask scheduler process, and two worker processes."""
    import json

    folder = tmp_path_factory.mktemp("dask")
    note = folder / "scheduler.json"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}

    def start(*words):
        command = [
            sys.executable,
            "-m",
            "distributed.cli.dask_" + words[0],
            *words[1:],
            "--scheduler-file",
            str(note),
        ]
        with (folder / "log").open("a") as log:
            return subprocess.Popen(
                command, cwd=folder, env=environment, stdout=log, stderr=log
            )

    scheduler = start(
        "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"
    )
    wait_until(note.is_file, scheduler)
    workers = [
        start("worker", "--nthreads", "1", "--no-nanny", "--no-dashboard")
        for _ in range(2)
    ]
    address = json.loads(note.read_text())["address"]
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=120)
    yield address, workers
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


def test_dask_survives_a_killed_worker_with_the_same_bytes(
    reference, cluster, tmp_path
):
    address, workers = cluster
    out = tmp_path / "data"
    killed = threading.Event()

    def kill_in_mid_run():
        with suppress(AssertionError):
            wait_until(lambda: any((out / "shards").glob("shard-*.h5")))
            workers[0].kill()
            if not verify(out).complete:
                killed.set()

    thread = threading.Thread(target=kill_in_mid_run)
    thread.start()
    assert (
        main(
            [
                "generate",
                "--quiet",
                *TINY,
                "executor=dask",
                f"executor.address={address}",
                f"out={out}",
            ]
        )
        == 0
    )
    thread.join()
    assert killed.is_set()
    assert contents(out) == contents(reference)


def test_dask_on_this_machine_gives_up_a_shard_that_always_kills(tmp_path):
    results, begun = outcome(DaskExecutor(n_workers=2, address=None), tmp_path, 99)
    failure = results.pop(2)
    assert isinstance(failure, ShardFailure)
    assert "KilledWorker" in failure.reason
    assert results == {index: 10 * index for index in (0, 1, 3, 4, 5)}
    # Dask also counts a worker that is lost before it has begun the shard, on a busy machine.
    assert 1 <= begun[2] <= TRIES


def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr("gensig.execution.dask.CONNECT_SECONDS", 0.2)
    with pytest.raises(ConfigError, match="no Dask scheduler answers"):
        list(DaskExecutor(n_workers=1, address="tcp://127.0.0.1:9").run(abs, [1]))
