"""A folder whose creation was killed is no data set, is recognized, and is begun anew."""

import os
import signal
from contextlib import contextmanager

import pytest
from dataset_samples import CONFIG, make_plan
from refusals import refused

from gensig.dataset.folder import beginning
from gensig.dataset.folder.beginning import create_folder, refuse_used
from gensig.dataset.folder.layout import BEGINNING, read_manifest
from gensig.dataset.folder.verify import verify
from gensig.errors import DatasetError

CHANGES = ("mkdir", "replace", "unlink", "fsync", "rename")


def begin(out):
    create_folder(
        out,
        config=CONFIG,
        overrides=[],
        plan=make_plan(n_records=9, n_units=3),
        seed=7,
        generator_version="0.1.0",
    )


def killed_before(number, work):
    """Do the work in a process of its own that is killed before its change of this number; False if
    it has fewer."""
    process = os.fork()
    if process == 0:
        left = [number]

        def deadly(name):
            real = getattr(os, name)

            def change(*words, **options):
                if left[0] == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                left[0] -= 1
                return real(*words, **options)

            return change

        for name in CHANGES:
            setattr(os, name, deadly(name))
        try:
            work()
        finally:
            os._exit(0)
    _, status = os.waitpid(process, 0)
    return os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL


def files(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("exists", [False, True])
def test_killed_at_every_change_it_is_no_data_set_and_is_begun_anew(tmp_path, exists):
    begin(tmp_path / "whole")
    whole = files(tmp_path / "whole")
    number, unfinished, finished = 0, 0, 0
    while True:
        out = tmp_path / f"{number}" / "deep" / "set"
        if exists:
            out.mkdir(parents=True)
        if not killed_before(number, lambda out=out: begin(out)):
            break
        number += 1
        if (out / "manifest.json").is_file():
            finished += 1
            assert not verify(out).complete
            with refused("not empty", DatasetError):
                begin(out)
        else:
            unfinished += 1
            with refused("", DatasetError) as caught:
                read_manifest(out)
            assert ("again" in str(caught.value)) == (out / BEGINNING).is_file()
            begin(out)
        made = files(out)
        left = {name for name in made if name.endswith(".tmp")}
        # BEGINNING stays where the kill came between manifest and its end
        assert made.keys() - left - {BEGINNING} == whole.keys()
        for name in whole.keys() - {"manifest.json"}:
            assert made[name] == whole[name]
    assert unfinished > 20
    assert finished >= 1
    assert read_manifest(out).n_done == 0


@pytest.mark.parametrize(
    "name", ["mine.txt", "shards/mine.h5", "splits/mine.txt", "splits/deep/mine.csv"]
)
def test_a_killed_beginning_that_holds_anything_else_is_not_touched(tmp_path, name):
    out = tmp_path / "set"
    begin(out)
    (out / "manifest.json").unlink()
    with refused("not empty", DatasetError):
        begin(out)
    (out / BEGINNING).touch()
    refuse_used(out)
    (out / name).parent.mkdir(exist_ok=True)
    (out / name).write_text("keep")
    before = files(out)
    with refused("not empty", DatasetError):
        begin(out)
    assert files(out) == before


def test_two_processes_do_not_begin_the_same_folder(tmp_path):
    """The second waits for the first, and then finds a data set."""
    for number in range(5):
        out = tmp_path / f"{number}"
        children = []
        for _child in range(2):
            process = os.fork()
            if process == 0:
                try:
                    begin(out)
                except DatasetError as error:
                    os._exit(7 if "not empty" in str(error) else 8)
                finally:
                    os._exit(0)
            children.append(process)
        statuses = [os.waitpid(child, 0)[1] for child in children]
        assert sorted(map(os.waitstatus_to_exitcode, statuses)) == [0, 7]


@pytest.mark.timeout(60)  # it would wait for a lock that it holds
def test_a_folder_begun_by_another_process_before_the_lock_is_refused(
    tmp_path, monkeypatch
):
    out = tmp_path / "set"
    unhurried = beginning.locked

    @contextmanager
    def locked_late(folder):
        monkeypatch.setattr(beginning, "locked", unhurried)
        begin(out)
        with unhurried(folder):
            yield

    monkeypatch.setattr(beginning, "locked", locked_late)
    with refused("not empty: another process has begun", DatasetError):
        begin(out)
    assert read_manifest(out).n_records == 9
