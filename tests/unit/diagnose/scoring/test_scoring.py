"""The scorer: what diagnose train says of its predictions, and the refusals that keep a comparison fair."""

import csv
import json
from importlib.resources import files

import numpy as np
import pytest
from fake_dataset import FakeDataset

import diagnose.studies.benchmark
import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import subset_segments, task_of
from diagnose.studies.benchmark import Benchmark, score_file, sha256, signal_rms


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    found = FakeDataset(n_units=16, records_per_unit=4)
    found.folder = tmp_path / "data"
    (found.folder / "splits").mkdir(parents=True)
    (found.folder / "plan.csv").write_text("record_id\n")
    (found.folder / "splits" / "by_unit.csv").write_text("record_id,subset\n")
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: found)
    return found


def truth(dataset):
    """Rows (record id, true class) of the test part of by_unit."""
    task = task_of(dataset, window_samples=1, stride_samples=1, normalise="none")
    records = np.unique(subset_segments(task, "by_unit", "test").record)
    names = dataset.columns["label_name"]
    return [
        [str(dataset.columns["record_id"][record]), str(names[record])]
        for record in records
    ]


def write(path, rows, head=("record_id", "predicted")):
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    return path


def test_the_truth_scores_one_and_one_class_for_all_scores_chance(dataset, tmp_path):
    rows = truth(dataset)
    perfect = score_file(dataset, write(tmp_path / "perfect.csv", rows))
    assert perfect["scores"]["by_unit"]["perfect"]["balanced_accuracy"]["mean"] == 1
    lazy = score_file(
        dataset, write(tmp_path / "lazy.csv", [[name, "crack"] for name, _ in rows])
    )
    assert (
        lazy["scores"]["by_unit"]["lazy"]["balanced_accuracy"]["mean"]
        == lazy["chance"]["by_unit"]
        == 0.25
    )
    assert lazy["benchmark"] is None


def test_predictions_of_a_study_score_as_in_the_study(dataset, tmp_path):
    out = tmp_path / "out"
    fast = [
        "epochs=1", "seeds=[0,1]", "batch_size=16", "window_samples=800", "stride_samples=800", "n_threads=1",
        "n_bootstrap=20", "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]",
    ]  # fmt: skip
    assert (
        main(
            [
                "train",
                "data=x",
                f"out={out}",
                *fast,
                "protocols=[by_unit,random_window_leaky]",
            ]
        )
        == 0
    )
    study = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"][
        "methods"
    ]
    scores = score_file(dataset, out / "predictions.csv")["scores"]
    assert list(scores) == ["by_unit"]
    for method, result in scores["by_unit"].items():
        for name in ("balanced_accuracy", "macro_f1"):
            # the interval of shuffled labels covers the luck of the shuffle too, which a scorer knows nothing of
            assert result[name]["mean"] == pytest.approx(
                study[method][name]["mean"], abs=1e-12
            )
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
    ],
)
def test_files_that_do_not_fit_are_refused_in_one_line(
    dataset, tmp_path, capsys, change, message
):
    path = write(tmp_path / "mine.csv", change(truth(dataset)))
    assert main(["score", "--data", "x", "--predictions", str(path)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
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
def test_contents_that_are_none_are_refused(
    dataset, tmp_path, capsys, content, message
):
    path = tmp_path / "mine.csv"
    path.write_bytes(content)
    assert main(["score", "--data", "x", "--predictions", str(path)]) == 2
    assert message in capsys.readouterr().err


def frozen(dataset, **changes):
    """The benchmark that this very data set is."""
    values = {
        "name": "benchmark_v9",
        "generator_version": "9.9.9",
        "signal_rms": {
            f"r{record:05d}": signal_rms(dataset, record).tolist() for record in (0, 7)
        },
        "plan_sha256": sha256(dataset.folder / "plan.csv"),
        "split_sha256": {"by_unit": sha256(dataset.folder / "splits" / "by_unit.csv")},
        "results": {"by_unit": {"cnn": {"mean": 0.5, "low": 0.4, "high": 0.6}}},
    }
    return Benchmark(**(values | changes))


def test_a_benchmark_shows_its_own_results_beside(
    dataset, tmp_path, monkeypatch, capsys
):
    path = write(tmp_path / "mine.csv", truth(dataset))
    monkeypatch.setattr(diagnose.studies.benchmark, "benchmark_of", frozen)
    assert main(["score", "--data", "x", "--predictions", str(path)]) == 0
    out = capsys.readouterr().out
    assert "| by_unit | mine | 1.000 [1.000, 1.000] | 0.250 |" in out
    assert "| by_unit | cnn (shipped) | 0.500 [0.400, 0.600] | 0.250 |" in out
    assert main(["score", "--data", "x", "--predictions", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["benchmark"]["differences"] == []


def test_other_noise_of_the_same_strength_is_another_signal(dataset):
    benchmark = frozen(dataset)
    assert benchmark.differences(dataset) == []
    other = FakeDataset(n_units=16, records_per_unit=4, seed=dataset.seed)
    other.folder = dataset.folder
    noise = np.random.default_rng(5).standard_normal((1, other.n_samples))
    clean = other.signals
    other.signals = lambda record: clean(record) + 0.05 * noise
    assert benchmark.differences(other) == [
        "its signals are not those that gensig 9.9.9 made"
    ]


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
def test_what_differs_from_the_benchmark_is_not_compared(
    dataset, tmp_path, monkeypatch, capsys, changes, message
):
    path = write(tmp_path / "mine.csv", truth(dataset))
    monkeypatch.setattr(
        diagnose.studies.benchmark, "benchmark_of", lambda data: frozen(data, **changes)
    )
    assert main(["score", "--data", "x", "--predictions", str(path)]) == 0
    captured = capsys.readouterr()
    assert message in captured.err
    assert "shipped" not in captured.out


def test_frozen_benchmarks_are_whole():
    entries = [
        entry
        for entry in files("diagnose").joinpath("frozen").iterdir()
        if entry.name.endswith(".json")
    ]
    assert entries
    for entry in entries:
        benchmark = Benchmark(**json.loads(entry.read_text(encoding="utf-8")))
        assert f"{benchmark.name}.json" == entry.name
        assert set(benchmark.results) == set(benchmark.split_sha256)
        for score in [
            score
            for methods in benchmark.results.values()
            for score in methods.values()
        ]:
            assert 0 <= score["low"] <= score["mean"] <= score["high"] <= 1
