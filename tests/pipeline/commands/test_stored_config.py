"""plan --show-config and generate --config: a configuration goes out and comes back."""

import pytest
import yaml
from small_sets import TINY, contents

import gensig
from gensig.cli import main
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.folder.verify import verify
from gensig.terminal.run_progress import RunProgress

ONE = "executor.n_workers=1"


@pytest.fixture
def first(tiny_set, tmp_path, monkeypatch):
    """A folder with a data set in ``first``, which is also the working folder."""
    monkeypatch.chdir(tmp_path)
    return tiny_set.copy_to(tmp_path / "first")


def run(status, *words):
    assert main(list(words)) == status, words


@pytest.mark.parametrize("given", ["first/config.yaml", "first"])
def test_the_configuration_of_a_data_set_makes_the_same_bits(first, given, tmp_path):
    run(0, "generate", "--quiet", "--config", given, "out=again")
    again = tmp_path / "again"
    assert contents(again) == contents(first)
    assert read_manifest(again).identity == read_manifest(first).identity
    text = (first / "config.yaml").read_text()
    assert (again / "config.yaml").read_text() == text
    recorded = yaml.safe_load((again / "overrides.yaml").read_text())
    assert recorded == [f"--config {given}", "out=again"]
    assert verify(again).complete


def test_what_show_config_prints_makes_what_the_words_make(first, tmp_path, capsys):
    for flag in (("--show-config",), ("--cfg", "job")):
        capsys.readouterr()
        run(0, "plan", *TINY, ONE, "out=ignored", *flag)
        printed = capsys.readouterr().out
        assert printed == (first / "config.yaml").read_text()
    (tmp_path / "shown.yaml").write_text(printed)
    run(0, "generate", "--quiet", "--config", "shown.yaml", "--out", "again")
    assert contents(tmp_path / "again") == contents(first)


def test_words_on_top_change_what_they_say(first, tmp_path):
    words = ("seed=7", "fault.crack_depth_mm=1.1")
    run(0, "generate", "--quiet", "--config", "first", *words, "out=changed")
    run(0, "generate", "--quiet", *TINY, ONE, *words, "out=typed")
    assert contents(tmp_path / "changed") == contents(tmp_path / "typed")
    assert contents(tmp_path / "changed") != contents(first)
    run(0, "plan", "--config", "changed", "plan.n_records=2", "--freeze", "out=two")
    assert read_manifest(tmp_path / "two").n_records == 2


def test_several_data_sets_of_one_configuration(first, tmp_path, capsys):
    words = ("-m", "--config", "first", "seed=0,4")
    run(0, "generate", "--quiet", *words, "out=both")
    assert contents(tmp_path / "both" / "0-seed=0") == contents(first)
    with gensig.open_dataset(tmp_path / "both" / "1-seed=4") as data:
        assert data.attributes["config_json"].count('"seed": 4') == 1
    capsys.readouterr()
    run(0, "plan", *words, "--show-config")
    shown = list(yaml.safe_load_all(capsys.readouterr().out))
    assert [content["seed"] for content in shown] == [0, 4]


def test_an_interrupted_set_of_a_stored_configuration_goes_on(
    first, tmp_path, monkeypatch, capsys
):
    def interrupt(_progress, _state):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(RunProgress, "__call__", interrupt)
        run(130, "generate", "--quiet", "--config", "first", "out=again")
    (first / "config.yaml").unlink()  # what was begun does not need it
    run(2, "resume", "--quiet", "again", "-j", "1", "seed=5")
    assert "another seed" in capsys.readouterr().err
    run(2, "resume", "--quiet", "again", "-j", "1", "experiment=quickstart")
    assert "leave out experiment=quickstart" in capsys.readouterr().err
    run(0, "resume", "--quiet", "again", "-j", "1", "seed=0")
    assert contents(tmp_path / "again") == contents(first)


def test_tasks_of_an_array_join_a_folder_of_a_stored_configuration(first, tmp_path):
    words = ("--config", "first", "out=array")
    run(0, "plan", "--freeze", *words)
    for index in range(2):
        task = (f"executor.shard_index={index}", "executor.shard_count=2")
        run(0, "generate", "--quiet", *words, "executor=slurm", *task)
    run(0, "finalize", "array")
    assert contents(tmp_path / "array") == contents(first)
