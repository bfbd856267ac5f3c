"""Option files of wrong shapes: one line each; what only a user types comes from none."""

import random
import warnings

import pytest
from refusals import refused

from benchmarks import hostile_options
from gensig.cli import main
from gensig.dataset.folder.beginning import config_text
from gensig.execution.registry import read_executor
from gensig.options.configuration import Configuration
from gensig.options.plain_values import check_values
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

DISTRIBUTION = "must be a mapping of keys to distributions"
FILES = {
    ("fault", ""): "has no key 'kind', it is empty",
    ("fault", "# nothing\n"): "has no key 'kind', it is empty",
    ("fault", "vary: [1, 2]\n"): f"fault.vary = [1, 2] {DISTRIBUTION}",
    ("fault", "kind: crack\nvary: [1, 2]\n"): f"fault.vary = [1, 2] {DISTRIBUTION}",
    ("fault", "kind: crack\nvary: abc\n"): f"fault.vary = abc {DISTRIBUTION}",
    ("fault", "kind: [crack]\n"): "fault.kind = ['crack'] must be the name of one",
    ("fault", "crack_depth_mm: 1\n"): "has no key 'kind', there is crack_depth_mm",
    ("plan", ""): "plan has no key 'classes', it is empty",
    ("plan", "defaults: [single]\nvary: abc\n"): f"plan.vary = abc {DISTRIBUTION}",
    ("life", ""): "life has no key 'kind'",
    ("system", ""): "system has no key 'kind'",
    ("executor", ""): "executor has no key 'kind'",
    ("executor", "kind: local\n"): "executor has no key 'n_workers'",
}


def dry_run(words, folder=None):
    """Everything of a plan but its records."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        config = read_request(words, config_dir=folder).config
        read_executor(config["executor"])
        make_plan(config)


@pytest.mark.parametrize(("group", "text"), FILES)
def test_a_file_of_another_shape_is_refused_in_one_line(tmp_path, group, text):
    folder = tmp_path / group
    folder.mkdir()
    (folder / "stranger.yaml").write_text(text)
    with refused(FILES[group, text]):
        dry_run([f"{group}=stranger"], tmp_path)


VALUES = {
    "a.b = nan must be a finite number": {"a": {"b": float("nan")}},
    "a[1] = inf must be a finite number": {"a": [0, float("inf")]},
    "is beyond 64 bits": {"a": 10**30},
    "the key 1 must be a text": {"a": {1: 2}},
    "a = b'x' must be a number, a text": {"a": b"x"},
    "is a text of 5000 characters": {"a": "x" * 5000},
    "a.vary.b.distribution = {} must be the name": {
        "a": {"vary": {"b": {"distribution": {}}}}
    },
    "\\x1b[31m must be the name": {"a": {"kind": ["\x1b[31m"]}},
}


@pytest.mark.parametrize("message", VALUES)
def test_values_that_no_key_can_have_are_refused(message):
    if "\\x1b" in message:
        message = "a.kind = ['\\x1b[31m'] must be the name of one"
        with refused(message):
            check_values({"a": {"kind": ["\x1b[31m"]}})
        return
    with refused(message):
        check_values(VALUES[message])


def test_ordinary_values_pass():
    check_values({"a": {"kind": None, "vary": {}, "b": [1, -2.5, True, None, "x"]}})


def test_a_missing_key_is_a_refusal_and_a_key_error_of_a_mapping():
    config = Configuration({"plan": {}})
    assert config["plan"].get("classes") is None
    assert "classes" not in config["plan"]
    with refused("plan has no key 'classes'"):
        config["plan"]["classes"]
    with refused("the configuration has no key 'gear'"):
        config["gear"]


UNTYPED = {
    "out": ({"out": "elsewhere"}, "out = elsewhere comes from a file"),
    "address": (
        {"executor": {"kind": "dask", "n_workers": 1, "address": "tcp://h:1"}},
        "executor.address = tcp://h:1 comes from a file",
    ),
}


@pytest.mark.parametrize("verb", ["generate", "plan"])
@pytest.mark.parametrize("case", UNTYPED)
def test_a_stored_configuration_neither_writes_nor_reaches_out(
    tmp_path, monkeypatch, capsys, verb, case
):
    entries, message = UNTYPED[case]
    monkeypatch.chdir(tmp_path)
    config = read_request([]).config
    (tmp_path / "config.yaml").write_text(
        config_text(config.with_entries(**entries).plain())
    )
    assert main([verb, "--config", "config.yaml"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    (line,) = printed.err.splitlines()
    assert message in line
    assert [path.name for path in tmp_path.iterdir()] == ["config.yaml"]


def test_an_experiment_of_a_stranger_neither_writes_nor_reaches_out(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "options" / "experiment"
    folder.mkdir(parents=True)
    (folder / "stranger.yaml").write_text("# @package _global_\nout: elsewhere\n")
    words = ["plan", "--config-dir", "options", "experiment=stranger"]
    assert main(words) == 2
    assert "out = elsewhere comes from a file" in capsys.readouterr().err
    assert main([*words, "out=mine", "--show-config"]) == 0  # the user's own word


def test_a_sample_of_the_campaign_ends_in_one_line():
    everything = hostile_options.cases()
    chosen = random.Random(1).sample(everything, 8)
    endings = [ending for _, ending, _ in hostile_options.run(chosen)]
    assert set(endings) <= {"one line", "accepted"}
    assert "one line" in endings


def test_the_campaign_sees_a_traceback(monkeypatch):
    def stumble(words, folder):
        return {}[words[0]]

    monkeypatch.setattr(hostile_options, "_dry_run", stumble)
    (result,) = hostile_options.run(hostile_options.cases()[:1])
    assert result[1] == "otherwise"
