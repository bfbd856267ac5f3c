"""Answers made of predictions: perfect and chance ones, planted weaknesses and thresholds known in advance."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from fake_dataset import CLASSES, FakeDataset
from numpy.testing import assert_allclose

from diagnose.data.groups import groups_of
from diagnose.data.windows import task_of
from diagnose.report.answer_figures import (
    conditions_figure,
    detection_figure,
    graded_classes,
    window_length_figure,
)
from diagnose.report.answer_tables import write_tables
from diagnose.scoring.conditions import by_condition, condition_columns
from diagnose.scoring.judged import Judged, with_interval
from diagnose.scoring.paired import compare, holm, permutation_p_value
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.scoring.window_length import by_window_length
from diagnose.settings import settings_from
from diagnose.studies.answers import protocol_answers
from gensig.options.compose import compose

N_CLASSES = 4


def scores_of(predicted, sure=5.0):
    """Log-probabilities (..., class) that name a class."""
    values = np.zeros((*np.shape(predicted), N_CLASSES))
    np.put_along_axis(values, np.asarray(predicted)[..., None], sure, axis=-1)
    return values - np.log(np.exp(values).sum(axis=-1, keepdims=True))


def judged(predicted, label, unit, method="cnn"):
    return Judged(
        method=method,
        label=label,
        unit=unit,
        n_units=int(unit.max()) + 1,
        log_probability=scores_of(np.atleast_2d(predicted)),
    )


def records(n_units=12, per_unit=12):
    unit = np.repeat(np.arange(n_units), per_unit)
    return np.arange(unit.size) % N_CLASSES, unit


def test_groups_hold_every_record_once_and_equal_values_together():
    values = np.random.default_rng(0).integers(0, 30, 200).astype(float)
    groups = groups_of(values, most=4)
    assert 2 <= len(groups) <= 4
    assert_allclose(
        np.sum([group.member for group in groups], axis=0), 1, rtol=0, atol=0
    )
    assert all(first.high < second.low for first, second in itertools.pairwise(groups))
    assert [group.text for group in groups_of(np.array([3.0, 1.0, 3.0]), most=5)] == [
        "1",
        "3",
    ]
    assert [group.text for group in groups_of(np.array(["b", "a"]), most=1)] == [
        "a",
        "b",
    ]


def test_a_planted_weak_condition_is_named_and_no_other():
    label, unit = records(16, 16)
    rng = np.random.default_rng(1)
    noise, torque = rng.uniform(0, 30, label.size), rng.uniform(10, 40, label.size)
    wrong = (noise < 7) & (rng.uniform(size=label.size) < 0.7)
    result = by_condition(
        {"snr_db": noise, "torque_nm": torque},
        [judged(np.where(wrong, (label + 1) % N_CLASSES, label), label, unit)],
        n_bootstrap=300,
        rng=rng,
    )
    assert len(result["weakest"]) == 1
    assert result["weakest"][0].startswith("snr_db")
    assert "weakest at snr_db" in result["summary"]
    low, *others = (row for row in result["rows"] if row["column"] == "snr_db")
    assert low["scores"]["cnn"]["mean"] < min(
        row["scores"]["cnn"]["mean"] for row in others
    )


def test_no_condition_is_named_where_all_are_alike():
    """Perfect answers never; guesses in at most 5 % of studies, so that 5 of 40 would be rare."""
    label, unit = records()
    rng = np.random.default_rng(2)
    named = 0
    for study in range(40):
        predicted = label if study == 0 else rng.integers(0, N_CLASSES, label.size)
        columns = {"snr_db": rng.uniform(0, 30, label.size)}
        result = by_condition(
            columns, [judged(predicted, label, unit)], n_bootstrap=100, rng=rng
        )
        assert result["n_groups_compared"] == 5
        assert study > 0 or "No condition stands out" in result["summary"]
        named += bool(result["weakest"])
    assert named <= 4


def test_groups_without_every_class_are_judged_by_the_share_right():
    label, unit = records()
    result = by_condition(
        {"snr_db": label.astype(float)},
        [judged(np.zeros_like(label), label, unit)],
        n_bootstrap=100,
        rng=np.random.default_rng(3),
    )
    assert {row["measure"] for row in result["rows"]} == {"share_right"}
    assert [row["scores"]["cnn"]["mean"] for row in result["rows"]] == [1, 0, 0, 0]


def test_fault_parameters_seeds_and_repetitions_are_no_conditions():
    dataset = FakeDataset(n_units=4)
    speed = dataset.column("speed_rpm")
    dataset.columns |= {
        "params/fault.crack_depth_mm": speed,
        "params/operating.course_seed": speed,
        "params/operating.speed_rpm": 2 * speed,
        "params/lubricant.temperature_c": dataset.column("unit_gain"),
        "torque_nm": np.full(dataset.n_records, 30.0),
    }
    found = condition_columns(dataset, np.arange(dataset.n_records))
    assert list(found) == ["speed_rpm", "params/lubricant.temperature_c"]


def test_equal_methods_are_not_told_apart_and_better_ones_are():
    label, unit = records()
    rng = np.random.default_rng(4)
    good = judged(label, label, unit)
    bad = judged(rng.integers(0, N_CLASSES, label.size), label, unit, "guess")
    same, worse = compare(
        good, [dataclasses.replace(good, method="same"), bad], n_bootstrap=300, rng=rng
    )
    assert (
        same["difference"]["mean"],
        same["difference"]["low"],
        same["difference"]["high"],
    ) == (
        0,
        0,
        0,
    )
    assert same["p_value"] == 1
    assert "not told apart" in same["summary"]
    assert worse["difference"]["low"] > 0.5
    assert_allclose(worse["p_value"], 2 / 2**12, rtol=1e-9, atol=0)
    assert_allclose(worse["p_value_holm"], 2 * worse["p_value"], rtol=1e-9, atol=0)
    assert worse["summary"].endswith("better")


def test_the_permutation_test_keeps_its_level():
    """Of 60 pairs of equally good guessers whose units differ, about 5 % may be told apart; 6 of 60 would be rare."""
    label, unit = records(8, 12)
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(60):
        skill = rng.uniform(0.2, 1.0, 8)[unit]
        pair = [
            np.where(
                rng.uniform(size=label.size) < skill,
                label,
                rng.integers(0, N_CLASSES, label.size),
            )
            for _ in range(2)
        ]
        first, second = (judged(predicted, label, unit) for predicted in pair)
        found += permutation_p_value(first, second, rng) < 0.05
    assert found <= 8


def test_holm_is_the_textbook_correction():
    assert_allclose(holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06], rtol=1e-12, atol=0)
    assert holm([]) == []
    assert holm([0.9, 0.8]) == [1.0, 1.0]


def test_one_unit_has_no_interval():
    label, unit = records(1, 40)
    network = judged(label, label, unit)
    rng = np.random.default_rng(6)
    row = compare(
        network,
        [judged(np.zeros_like(label), label, unit, "guess")],
        n_bootstrap=50,
        rng=rng,
    )[0]
    assert (row["difference"]["low"], row["p_value"]) == (None, 1.0)
    assert "one unit" in row["summary"]
    result = by_condition(
        {"snr_db": np.arange(40.0)}, [network], n_bootstrap=50, rng=rng
    )
    assert all(row["scores"]["cnn"]["low"] is None for row in result["rows"])
    assert result["weakest"] == []
    assert with_interval(0.5, np.full(10, np.nan), 3) == {
        "mean": 0.5,
        "low": None,
        "high": None,
    }


@pytest.mark.parametrize(
    ("shown", "verdict"), [(1, "not told apart"), (4, "more signal helps")]
)
def test_window_length_shows_what_later_windows_bring(shown, verdict):
    """Each window names the class with some luck: the mean of several is right more often; of copies, not."""
    label, unit = records()
    rng = np.random.default_rng(7)
    record = np.repeat(np.arange(label.size), 4)
    scores = 1.5 * scores_of(label[record], 1.0) + rng.normal(
        size=(record.size, N_CLASSES)
    )
    if shown == 1:
        scores = np.repeat(scores[::4], 4, axis=0)
    result = by_window_length(
        judged(label, label, unit),
        [(record, scores)],
        window_seconds=0.1,
        step_seconds=0.05,
        n_bootstrap=300,
        rng=rng,
    )
    assert [row["n_windows"] for row in result["rows"]] == [1, 2, 4]
    assert_allclose(
        [row["seconds"] for row in result["rows"]],
        [0.1, 0.15, 0.25],
        rtol=1e-12,
        atol=0,
    )
    assert verdict in result["summary"]


@pytest.fixture
def study():
    """A data set of 20 units, 5 of them tested, and a network and a baseline that know some of the answers."""
    dataset = FakeDataset(n_units=20, records_per_unit=16)
    task = task_of(dataset, window_samples=800, stride_samples=800, normalise="rms")
    settings = settings_from(compose("train", ["data=x", "out=y", "n_bootstrap=100"]))
    split, label = dataset.split("by_unit"), task.labels()
    test, validation = (
        np.array([row[0] for row in split[name]]) for name in ("test", "validation")
    )
    rng = np.random.default_rng(8)

    def prediction(method, seed, skill):
        def says(record):
            return scores_of(
                np.where(rng.uniform(size=record.size) < skill, label[record], 0)
            )

        windows = Rows(
            record=np.repeat(test, 2), log_probability=says(np.repeat(test, 2))
        )
        return Prediction(
            protocol="by_unit",
            method=method,
            seed=seed,
            record=test,
            log_probability=says(test),
            detail="",
            validation=Rows(record=validation, log_probability=says(validation)),
            windows=windows if method == "cnn" else None,
        )

    runs = [
        prediction("cnn", 0, 0.9),
        prediction("cnn", 1, 0.9),
        prediction("indicators", 0, 0.5),
    ]
    return task, settings, runs


def metrics_of(task, answers):
    confusion = np.eye(N_CLASSES, dtype=int).tolist()
    scored = {"mean": 0.5, "low": 0.4, "high": 0.6, "per_seed": [0.5]}
    methods = {
        "cnn": {"balanced_accuracy": scored, "confusion": confusion},
        "chance": {"balanced_accuracy": 0.25},
    }
    result = {
        "leaky": False,
        "methods": methods,
        "answers": answers,
        "n_records": {"test": 80},
        "n_units": {"test": 5},
    }
    return {
        "model": "cnn",
        "class_names": list(task.class_names),
        "protocols": {
            "by_unit": result,
            "leaky": {**result, "leaky": True, "answers": None},
        },
    }


def test_every_part_is_there_and_can_be_written(study, tmp_path):
    task, settings, runs = study
    answers = protocol_answers(task, settings, runs)
    json.dumps(answers, allow_nan=False)
    assert answers["best_baseline"] == "indicators"
    assert answers["comparisons"][0]["difference"]["mean"] > 0.2
    assert set(answers["detection"]) == {"cnn", "indicators"}
    assert graded_classes(answers) == list(CLASSES[1:])
    names = write_tables(tmp_path, metrics_of(task, answers))
    assert {
        "scores.csv",
        "by_condition.csv",
        "by_severity.csv",
        "confusion_by_unit.csv",
    } <= set(names)
    head, *rows = (tmp_path / "scores.csv").read_text().splitlines()
    assert head.startswith("protocol,leaky,method,score,mean,low,high")
    assert rows[0] == "by_unit,False,cnn,balanced_accuracy,0.5,0.4,0.6,1,80,5"
    conditions_figure(tmp_path / "a.png", answers)
    detection_figure(tmp_path / "b.png", answers)
    window_length_figure(tmp_path / "c.png", {"by_unit": answers})
    assert all(
        (tmp_path / name).stat().st_size > 5000 for name in ("a.png", "b.png", "c.png")
    )


def test_a_class_of_few_records_says_how_few(study, tmp_path):
    task, settings, runs = study
    found = protocol_answers(task, settings, runs)["detection"]["cnn"]["classes"][
        "crack"
    ]
    assert f"of {found['n_records']} records of 5 machines found" in found["summary"]
    assert "not told" not in found["summary"]
    runs = [dataclasses.replace(run, record=run.record[:24], log_probability=run.log_probability[:24], windows=None)
            for run in runs]  # fmt: skip
    answers = protocol_answers(task, settings, runs)
    few = answers["detection"]["cnn"]["classes"]["crack"]
    assert few["n_records"] < 10
    assert "[too few machines] of 6 records of 2 machines found" in few["summary"]
    assert (
        "from what severity on is not told: a curve needs 10 records of 3 severities"
        in few["summary"]
    )
    detection_figure(tmp_path / "few.png", answers)


def test_parts_without_ground_are_left_out(study, tmp_path):
    task, settings, runs = study
    task.dataset.columns["severity"] = np.where(task.labels() > 0, 1.0, 0.0)
    alone = [
        dataclasses.replace(run, windows=None) for run in runs if run.method == "cnn"
    ]
    answers = protocol_answers(task, settings, alone)
    assert "window_length" not in answers
    assert (answers["best_baseline"], answers["comparisons"]) == (None, [])
    assert graded_classes(answers) == []
    assert all(
        part["limits"] == [] for part in answers["detection"]["cnn"]["classes"].values()
    )
    assert "by_severity.csv" not in write_tables(tmp_path, metrics_of(task, answers))
    task.dataset.class_names = ("sound", *CLASSES[1:])
    other = task_of(
        task.dataset, window_samples=800, stride_samples=800, normalise="rms"
    )
    assert "detection" not in protocol_answers(other, settings, alone)


def test_the_order_of_questions_and_runs_does_not_matter(study):
    task, settings, runs = study
    first, second = (
        protocol_answers(task, settings, runs),
        protocol_answers(task, settings, runs),
    )
    assert first == second
