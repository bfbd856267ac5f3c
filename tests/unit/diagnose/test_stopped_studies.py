"""A study that is stopped goes on with the same bits; a folder in work or stopped says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from novelty_sets import OpenDataset
from runs import FAST, LIFE, NETWORK_ONLY, refuses, serve

from benchmarks._kill_training import contents, differences
from diagnose.cli import main
from diagnose.commands import train as train_command
from diagnose.recordings.registry import TARGETS
from diagnose.training.study_folder import (
    FINISHED_JOBS,
    STUDY,
    complete_study,
    read_study,
    study_at_work,
)
from gensig.dataset.storage.atomic import at_work
from gensig.errors import SimulationError

SIZES = {"n_units": 8, "records_per_unit": 4, "duration": 0.2}
BRIEF = (*FAST, *NETWORK_ONLY, "epochs=1", "n_bootstrap=20", "epoch_fraction=0.1")
STUDIES = {
    "classes": (FakeDataset(**SIZES), (*BRIEF, "seeds=[0,1]")),
    "novelty": (OpenDataset(**SIZES), (*BRIEF, "protocols=[open_set]")),
    "lives": (FakeLives(n_lives=8), (*LIFE, "epochs=1", "protocols=[by_unit]")),
}


def stop(words, n_finished):
    """Status of a command that is stopped after so many finished jobs, and these."""
    begun = []
    with pytest.MonkeyPatch.context() as patch:
        for target in TARGETS.values():
            function = target.study.run_job

            def run(study, job, function=function):
                if len(begun) == n_finished:
                    raise KeyboardInterrupt
                begun.append(job)
                return function(study, job)

            patch.setattr(target.study, "run_job", run)
        return main(words), begun


@pytest.mark.parametrize("name", STUDIES)
def test_a_stopped_study_goes_on_with_the_same_bits(
    name, tmp_path, monkeypatch, capsys
):
    dataset, words = STUDIES[name]
    words = ["train", "data=good", "out=study", *words]
    serve(monkeypatch, {"good": dataset})
    for folder in ("whole", "stopped"):
        (tmp_path / folder).mkdir()
    monkeypatch.chdir(tmp_path / "whole")
    status, begun = stop(words, -1)
    assert status == 0
    wanted = contents(tmp_path / "whole" / "study")
    monkeypatch.chdir(tmp_path / "stopped")
    capsys.readouterr()
    status, first = stop(words, 1)
    assert status == 130
    *_, line = capsys.readouterr().err.splitlines()
    going_on = "study is incomplete, and diagnose resume study finishes it"
    assert line == f"diagnose: interrupted; {going_on}"
    status, then = stop(["resume", "study"], -1)
    assert status == 0
    assert first + then == begun
    assert differences(wanted, contents(tmp_path / "stopped" / "study")) == []
    refuses(capsys, words, "exists and is not an empty folder")
    assert main(["resume", "study"]) == 0
    assert capsys.readouterr().out == "study is complete\n"
    wanted["predictions.csv"] += b"\n"
    assert differences(wanted, contents(tmp_path / "stopped" / "study")) == [
        "predictions.csv differs"
    ]


class Brief:
    """A study of no jobs, which is stopped after as many runs as are left."""

    def __init__(self):
        self.left, self.made = 99, []

    def __call__(self, settings, asked):
        out = Path(settings.out)
        with study_at_work(out, asked) as kept:
            if self.error is not None:
                raise self.error
            (kept / "a.json").touch()
            self.left -= 1
            if self.left < 0:
                raise KeyboardInterrupt
            complete_study(out)
        self.made.append(out.name)
        return out / "report.html", []

    error = None


@pytest.fixture
def brief(monkeypatch, tmp_path):
    """A brief study in place of one of classes, in an empty folder."""
    study = Brief()
    monkeypatch.setattr(train_command, "make_report", study)
    monkeypatch.chdir(tmp_path)
    return study


@pytest.fixture
def stopped(brief, capsys):
    """Folder of a study that was stopped, begun by `WORDS`."""
    brief.left = 0
    assert main(WORDS) == 130
    brief.left = 99
    return Path("study")


WORDS = ["train", "data=good", "out=study"]


def test_another_study_is_refused_and_another_number_of_workers_is_not(
    brief, stopped, capsys
):
    refuses(capsys, [*WORDS, "learning_rate=0.01"], "another learning_rate;")
    refuses(capsys, ["train", "data=other", "out=study"], "another data;")
    refuses(capsys, [*WORDS, "model=order"], "another model;")
    assert brief.made == []
    assert main([*WORDS, "n_threads=3"]) == 0
    assert brief.made == ["study"]


def test_a_folder_in_work_and_one_that_was_stopped_say_so(brief, stopped, capsys):
    model = ["evaluate", "data=good", "--model", "study/models/by_unit-seed0"]
    predict = ["predict", "a.wav", "--model", "study/models/by_unit-seed0"]
    readers = ["verify", "study"], model, predict
    for reader in readers:
        refuses(capsys, reader, "was stopped; diagnose resume study finishes it")
    with at_work(stopped / FINISHED_JOBS, others=False):
        for each in (WORDS, ["resume", "study"], *readers):
            refuses(capsys, each, "another process is at work in study; wait until")
    assert brief.made == []
    assert main(["resume", "study"]) == 0
    assert brief.made == ["study"]


def test_an_error_before_any_job_is_finished_leaves_nothing_in_the_folder(
    brief, capsys
):
    brief.error = SimulationError("diverged")
    refuses(capsys, WORDS, "diverged")
    assert list(Path("study").iterdir()) == []
    brief.error = None
    assert main(WORDS) == 0


def test_a_beginning_that_was_killed_is_begun_anew(brief):
    kept = Path("study") / FINISHED_JOBS
    kept.mkdir(parents=True)
    Path("study", f".{STUDY}.1-a.tmp").write_text("{")
    assert main(WORDS) == 0
    assert not kept.exists()


def test_a_study_that_was_moved_goes_on(brief, stopped, tmp_path, monkeypatch, capsys):
    moved = tmp_path / "elsewhere" / "mine"
    moved.parent.mkdir()
    stopped.rename(moved)
    monkeypatch.chdir(moved.parent)
    assert main(["resume", "mine"]) == 0
    assert brief.made == ["mine"]
    config = read_study(moved).goes_on(Path("mine")).config
    assert (config["out"], config["data"]) == ("mine", str(tmp_path / "good"))


@pytest.mark.parametrize("harm", ["{", "[]", "other version", "altered", "link"])
def test_a_damaged_study_is_one_line(brief, stopped, capsys, harm):
    path = stopped / STUDY
    content = json.loads(path.read_text())
    if harm == "altered":
        path.write_text(json.dumps(content | {"is_complete": True}))
    elif harm == "other version":
        path.write_text(json.dumps(content | {"study_schema_version": 9}))
    elif harm == "link":
        path.rename("elsewhere.json")
        path.symlink_to("elsewhere.json")
    else:
        path.write_text(harm)
    for each in (["resume", "study"], WORDS):
        refuses(capsys, each, STUDY)
    assert brief.made == []


def test_a_folder_without_its_study_is_no_study(brief, stopped, capsys):
    (stopped / STUDY).unlink()
    refuses(capsys, ["resume", "study"], f"study holds no {STUDY}")
    refuses(capsys, WORDS, "exists and is not an empty folder")


def test_a_multirun_goes_on_with_what_it_lacks(brief, capsys):
    words = ["train", "-m", "data=good", "out=levels", "normalise=rms,none"]
    brief.left = 1
    assert main(words) == 130
    first, second = sorted(Path("levels").iterdir())
    assert read_study(first).is_complete
    assert not read_study(second).is_complete
    refuses(capsys, [*words, "epochs=2"], "another epochs;")
    brief.left = 99
    assert main(words) == 0
    assert brief.made == [first.name, second.name]
    refuses(capsys, words, "exists and is not an empty folder")


def test_a_multirun_writes_nothing_beside_files_of_others(brief, capsys):
    Path("levels", "empty").mkdir(parents=True)
    Path("levels", "notes.txt").write_text("mine")
    words = ["train", "-m", "data=good", "out=levels", "normalise=rms,none"]
    refuses(capsys, words, "exists and is not an empty folder")
