"""The scorer: the scores of a study from its predictions, and refusals of unfair comparisons."""

import csv
import json
from importlib.resources import files

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import command, task_on, train

import diagnose.studies.benchmark
import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import subset_segments
from diagnose.studies.benchmark import Benchmark, score_file, sha256, signal_rms


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    made = FakeDataset(n_units=16, records_per_unit=4)
    made.folder = tmp_path / "data"
    (made.folder / "splits").mkdir(parents=True)
    (made.folder / "plan.csv").write_text("record_id\n")
    (made.folder / "splits" / "by_unit.csv").write_text("record_id,subset\n")
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: made)
    return made


@pytest.fixture
def truth(dataset):
    """Rows (record id, true class) of the test part of by_unit."""
    task = task_on(dataset, 1)
    records = np.unique(subset_segments(task, "by_unit", "test").record)
    columns = (dataset.columns[name][records] for name in ("record_id", "label_name"))
    return [list(row) for row in zip(*columns, strict=True)]


def write(path, rows, head=("record_id", "predicted")):
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    return path


@pytest.fixture
def perfect(truth, tmp_path):
    return write(tmp_path / "mine.csv", truth)


@pytest.fixture
def score(capsys):
    """Function that runs the command on a file of predictions."""

    def run(path, *words):
        given = ["score", "--data", "x", "--predictions", path, *words]
        return command(capsys, *given)

    return run


def test_the_truth_scores_one_and_one_class_for_all_scores_chance(
    dataset, truth, perfect, tmp_path
):
    result = score_file(dataset, perfect)
    assert result["scores"]["by_unit"]["mine"]["balanced_accuracy"]["mean"] == 1
    assert result["benchmark"] is None
    rows = [[name, "crack"] for name, _ in truth]
    result = score_file(dataset, write(tmp_path / "lazy.csv", rows))
    mean = result["scores"]["by_unit"]["lazy"]["balanced_accuracy"]["mean"]
    assert mean == result["chance"]["by_unit"] == 0.25


def test_predictions_of_a_study_score_as_in_the_study(dataset, tmp_path):
    words = ["window_samples=800", "stride_samples=800", "epochs=1", "seeds=[0,1]"]
    words.append("baselines=[indicators,rms_threshold]")
    protocols = "protocols=[by_unit,random_window_leaky]"
    metrics = train(dataset, tmp_path / "out", *words, protocols)
    study = metrics["protocols"]["by_unit"]["methods"]
    scores = score_file(dataset, tmp_path / "out" / "predictions.csv")["scores"]
    assert list(scores) == ["by_unit"]
    for method, result in scores["by_unit"].items():
        # means only: the study's interval of shuffled labels covers the luck of the shuffle too
        for name in ("balanced_accuracy", "macro_f1"):
            expected = study[method][name]["mean"]
            assert result[name]["mean"] == pytest.approx(expected, abs=1e-12)
    assert scores["by_unit"]["cnn"]["n_seeds"] == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows[1:], "1 are missing, 0 are not of the test part"),
        (
            lambda rows: [*rows, ["r00000", "crack"]],
            "0 are missing, 1 are not of the test part",
        ),
        (lambda rows: [*rows, rows[0]], "twice for by_unit, mine, 0"),
        (
            lambda rows: [["r99999", "crack"], *rows],
            "line 2: the data set has no record 'r99999'",
        ),
        (
            lambda rows: [[rows[0][0], "broken"], *rows[1:]],
            "line 2: there is no class 'broken'; there is healthy",
        ),
        (lambda rows: [], "has no rows"),
        (
            lambda rows: [[*rows[0], "more"], *rows[1:]],
            "not all as many cells as its head",
        ),
        (b"record_id,label\nr1,crack\n", "has no column predicted"),
        (b"\xff\xfe\x00", "no CSV file in UTF-8"),
        (
            b"protocol,record_id,predicted\nrandom_window_leaky,r00000,crack\n",
            "leaky protocols only",
        ),
        (
            b"protocol,record_id,predicted\nby_moon,r00000,crack\n",
            "no protocol 'by_moon'",
        ),
    ],
)
def test_wrong_files_are_refused_in_one_line(truth, tmp_path, score, change, message):
    path = tmp_path / "mine.csv"
    if isinstance(change, bytes):
        path.write_bytes(change)
    else:
        write(path, change(truth))
    status, _, error = score(path)
    assert status == 2
    assert message in error
    assert error.count("\n") == 1


def frozen(dataset, **changes):
    """A benchmark of this data set."""
    rms = {f"r{record:05d}": signal_rms(dataset, record).tolist() for record in (0, 7)}
    values = {
        "name": "benchmark_v9",
        "generator_version": "9.9.9",
        "signal_rms": rms,
        "plan_sha256": sha256(dataset.folder / "plan.csv"),
        "split_sha256": {"by_unit": sha256(dataset.folder / "splits" / "by_unit.csv")},
        "results": {"by_unit": {"cnn": {"mean": 0.5, "low": 0.4, "high": 0.6}}},
    }
    return Benchmark(**(values | changes))


def test_a_benchmark_shows_its_results_too(perfect, monkeypatch, score):
    monkeypatch.setattr(diagnose.studies.benchmark, "benchmark_of", frozen)
    status, text, _ = score(perfect)
    assert status == 0
    assert "| by_unit | mine | 1.000 [1.000, 1.000] | 0.250 |" in text
    assert "| by_unit | cnn (shipped) | 0.500 [0.400, 0.600] | 0.250 |" in text
    assert json.loads(score(perfect, "--json")[1])["benchmark"]["differences"] == []


def test_other_noise_of_the_same_strength_is_another_signal(dataset):
    benchmark = frozen(dataset)
    assert benchmark.differences(dataset) == []
    noise = np.random.default_rng(5).standard_normal((1, dataset.n_samples))
    clean = dataset.signals
    dataset.signals = lambda record: clean(record) + 0.05 * noise
    expected = "its signals are not those that gensig 9.9.9 made"
    assert benchmark.differences(dataset) == [expected]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"signal_rms": {"r00003": [1.0]}},
            "its signals are not those that gensig 9.9.9 made",
        ),
        ({"split_sha256": {"by_unit": "0" * 64}}, "its split by_unit is another one"),
    ],
)
def test_a_data_set_that_differs_from_the_benchmark_is_not_compared(
    perfect, monkeypatch, score, changes, message
):
    def benchmark_of(dataset):
        return frozen(dataset, **changes)

    monkeypatch.setattr(diagnose.studies.benchmark, "benchmark_of", benchmark_of)
    status, text, error = score(perfect)
    assert status == 0
    assert message in error
    assert "shipped" not in text


def test_of_benchmarks_with_one_plan_the_signals_choose(dataset, monkeypatch):
    """Two methods of integration make the same plan with signals of their own."""
    other = frozen(dataset, name="other", signal_rms={"r00003": [1.0]})
    same = frozen(dataset, name="same")
    elsewhere = frozen(dataset, name="elsewhere", plan_sha256="0" * 64)
    module = diagnose.studies.benchmark
    for order in ([other, same, elsewhere], [elsewhere, same, other]):
        monkeypatch.setattr(module, "frozen_benchmarks", lambda order=order: order)
        assert module.benchmark_of(dataset) is same
    monkeypatch.setattr(module, "frozen_benchmarks", lambda: [elsewhere])
    assert module.benchmark_of(dataset) is None


def test_frozen_benchmarks_are_whole():
    folder = files("diagnose").joinpath("frozen")
    entries = [entry for entry in folder.iterdir() if entry.name.endswith(".json")]
    assert entries
    for entry in entries:
        benchmark = Benchmark(**json.loads(entry.read_text(encoding="utf-8")))
        assert f"{benchmark.name}.json" == entry.name
        assert set(benchmark.results) == set(benchmark.split_sha256)
        for methods in benchmark.results.values():
            for result in methods.values():
                assert 0 <= result["low"] <= result["mean"] <= result["high"] <= 1


def test_a_frozen_set_is_said_to_be_one(monkeypatch, capsys):
    benchmark = {"name": "b", "differences": []}
    of = "diagnose.studies.benchmark."
    monkeypatch.setattr("gensig.dataset.reader.open_dataset", lambda _: None)
    monkeypatch.setattr(f"{of}score_file", lambda *_, **__: {"benchmark": benchmark})
    monkeypatch.setattr(f"{of}score_table", lambda _: ["scores"])
    for said in ("plan, splits and signals are the frozen ones", "not comparable"):
        assert main(["score", "--data", "set", "--predictions", "a.csv"]) == 0
        assert said in "".join(capsys.readouterr())
        benchmark["differences"].append("another plan")
