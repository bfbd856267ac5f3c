"""Answers made of predictions: perfect and random ones, planted weaknesses, known thresholds."""

import copy
import dataclasses
import itertools
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from fake_dataset import CLASSES, FakeDataset
from judged_tables import judged_table
from numpy.testing import assert_allclose
from small_studies import settings_of, task_on

from diagnose.data.groups import groups_of
from diagnose.report.answer_figures import (
    conditions_figure,
    detection_figure,
    graded_classes,
    window_length_figure,
)
from diagnose.report.answer_tables import write_tables
from diagnose.scoring.conditions import by_condition, condition_columns
from diagnose.scoring.intervals import with_interval
from diagnose.scoring.machines import Support
from diagnose.scoring.paired import compare, holm, permutation_p_value
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.scoring.window_length import by_window_length
from diagnose.studies.answers import protocol_answers

N_CLASSES = 4


def scores_of(predicted, sure=5.0):
    """Log-probabilities (..., class) that name a class."""
    values = np.zeros((*np.shape(predicted), N_CLASSES))
    np.put_along_axis(values, np.asarray(predicted)[..., None], sure, axis=-1)
    return values - np.log(np.exp(values).sum(axis=-1, keepdims=True))


def judged(predicted, label, unit, method="cnn"):
    return judged_table(scores_of(np.atleast_2d(predicted)), label, unit, method)


def records(n_units=12, per_unit=12):
    unit = np.repeat(np.arange(n_units), per_unit)
    return np.arange(unit.size) % N_CLASSES, unit


def conditions_of(columns, predicted, label, unit, rng, n_bootstrap=100):
    methods = [judged(predicted, label, unit)]
    return by_condition(columns, methods, n_bootstrap=n_bootstrap, rng=rng)


def test_groups_hold_every_record_once_and_equal_values_together():
    values = np.random.default_rng(0).integers(0, 30, 200).astype(float)
    groups = groups_of(values, most=4)
    assert 2 <= len(groups) <= 4
    assert (np.sum([group.member for group in groups], axis=0) == 1).all()
    assert all(first.high < second.low for first, second in itertools.pairwise(groups))


@pytest.mark.parametrize(
    ("values", "most", "expected"),
    [
        ([3.0, 1.0, 3.0], 5, ["1", "3"]),
        (["b", "a"], 1, ["a", "b"]),
        ([1.0, 2.0], 1, ["1 to 2"]),
    ],
)
def test_groups_have_texts(values, most, expected):
    groups = groups_of(np.array(values), most=most)
    assert [group.text for group in groups] == expected


def test_a_planted_weak_condition_is_named_and_no_other():
    label, unit = records(16, 16)
    rng = np.random.default_rng(1)
    columns = {
        "snr_db": rng.uniform(0, 30, label.size),
        "torque_nm": rng.uniform(10, 40, label.size),
    }
    wrong = (columns["snr_db"] < 7) & (rng.uniform(size=label.size) < 0.7)
    predicted = np.where(wrong, (label + 1) % N_CLASSES, label)
    result = conditions_of(columns, predicted, label, unit, rng, n_bootstrap=300)
    assert len(result["weakest"]) == 1
    assert result["weakest"][0].startswith("snr_db")
    assert "weakest at snr_db" in result["summary"]
    rows = [row for row in result["rows"] if row["column"] == "snr_db"]
    means = [row["scores"]["cnn"]["mean"] for row in rows]
    assert means[0] < min(means[1:])


def test_no_condition_is_named_if_all_are_equal():
    """Never for perfect answers, and in at most 5 % of studies for guesses: 5 of 40 are rare."""
    label, unit = records()
    rng = np.random.default_rng(2)
    named = 0
    columns = {"snr_db": rng.uniform(0, 30, label.size)}
    perfect = conditions_of(columns, label, label, unit, rng)
    assert "No condition stands out" in perfect["summary"]
    for _ in range(40):
        predicted = rng.integers(0, N_CLASSES, label.size)
        columns = {"snr_db": rng.uniform(0, 30, label.size)}
        result = conditions_of(columns, predicted, label, unit, rng)
        assert result["n_groups_compared"] == 5
        named += bool(result["weakest"])
    assert named <= 4


def test_groups_without_every_class_are_scored_by_the_share_right():
    label, unit = records()
    columns, rng = {"snr_db": label.astype(float)}, np.random.default_rng(3)
    rows = conditions_of(columns, np.zeros_like(label), label, unit, rng)["rows"]
    assert {row["measure"] for row in rows} == {"share_right"}
    assert [row["scores"]["cnn"]["mean"] for row in rows] == [1, 0, 0, 0]


def test_fault_parameters_seeds_repetitions_and_gaps_are_no_conditions():
    dataset = FakeDataset(n_units=4)
    speed, n = dataset.column("speed_rpm"), dataset.n_records
    dataset.columns |= {
        "params/fault.crack_depth_mm": speed,
        "params/operating.course_seed": speed,
        "params/operating.speed_rpm": 2 * speed,
        "params/lubricant.temperature_c": dataset.column("unit_gain"),
        "params/sensor.position_mm": np.ones((n, 2)),
        "params/sensing.snr_db": np.where(np.arange(n) > 3, np.arange(n), np.nan),
        "torque_nm": np.full(n, 30.0),
        "gearbox_id": dataset.column("record_id"),  # more names than conditions
    }
    columns = condition_columns(dataset, np.arange(n))
    assert list(columns) == ["speed_rpm", "params/lubricant.temperature_c"]


def test_equal_methods_are_not_told_apart_and_better_ones_are():
    label, unit = records()
    rng = np.random.default_rng(4)
    good = judged(label, label, unit)
    bad = judged(rng.integers(0, N_CLASSES, label.size), label, unit, "guess")
    others = [dataclasses.replace(good, method="same"), bad]
    same, worse = compare(good, others, n_bootstrap=300, rng=rng)
    assert same["difference"] == {"mean": 0, "low": 0, "high": 0, "too_few": None}
    assert same["p_value"] == 1
    assert "not told apart" in same["summary"]
    assert worse["difference"]["low"] > 0.5
    assert_allclose(worse["p_value"], 2 / 2**12, rtol=1e-9, atol=0)
    assert_allclose(worse["p_value_holm"], 2 * worse["p_value"], rtol=1e-9, atol=0)
    assert worse["summary"].endswith("better")


def test_the_permutation_test_keeps_its_level():
    """About 5 % of 60 pairs of equally good guessers may be told apart; 6 of 60 would be rare."""
    label, unit = records(8, 12)
    rng = np.random.default_rng(5)
    n_different = 0
    for _ in range(60):
        skill = rng.uniform(0.2, 1.0, 8)[unit]
        pair = []
        for _ in range(2):
            knows = rng.uniform(size=label.size) < skill
            guess = rng.integers(0, N_CLASSES, label.size)
            pair.append(judged(np.where(knows, label, guess), label, unit))
        n_different += permutation_p_value(*pair, rng) < 0.05
    assert n_different <= 8


@pytest.mark.parametrize(
    ("p_values", "expected"),
    [([0.01, 0.04, 0.03], [0.03, 0.06, 0.06]), ([], []), ([0.9, 0.8], [1.0, 1.0])],
)
def test_holm_is_the_textbook_correction(p_values, expected):
    assert_allclose(holm(p_values), expected, rtol=1e-12, atol=0)


def test_one_unit_has_no_interval():
    label, unit = records(1, 40)
    network = judged(label, label, unit)
    guess = judged(np.zeros_like(label), label, unit, "guess")
    rng = np.random.default_rng(6)
    (row,) = compare(network, [guess], n_bootstrap=50, rng=rng)
    assert (row["difference"]["low"], row["p_value"]) == (None, 1.0)
    assert "too few machines, so that nothing can be said" in row["summary"]
    result = conditions_of({"snr_db": np.arange(40.0)}, label, label, unit, rng)
    assert all(row["scores"]["cnn"]["low"] is None for row in result["rows"])
    assert result["weakest"] == []
    assert "Too few test records or machines" in result["summary"]
    unknown = with_interval(
        np.array([0.5] + 10 * [np.nan]), Support(kind="machines", n_groups=9)
    )
    assert unknown == {"mean": 0.5, "low": None, "high": None, "too_few": None}


@pytest.mark.parametrize(
    ("copied", "verdict"), [(True, "not told apart"), (False, "more signal helps")]
)
def test_window_length_shows_the_gain_of_later_windows(copied, verdict):
    """The mean of several lucky windows is right more often; that of copies is not."""
    label, unit = records()
    rng = np.random.default_rng(7)
    record = np.repeat(np.arange(label.size), 4)
    noise = rng.normal(size=(record.size, N_CLASSES))
    scores = 1.5 * scores_of(label[record], 1.0) + noise
    if copied:
        scores = np.repeat(scores[::4], 4, axis=0)
    result = by_window_length(
        judged(label, label, unit),
        [Rows(record=record, answers=scores)],
        window_seconds=0.1,
        step_seconds=0.05,
        n_bootstrap=300,
        rng=rng,
    )
    rows = result["rows"]
    assert [row["n_windows"] for row in rows] == [1, 2, 4]
    assert_allclose([row["seconds"] for row in rows], [0.1, 0.15, 0.25], rtol=1e-12)
    assert verdict in result["summary"]


@pytest.fixture
def study():
    """20 units, 5 of them tested; a network and a baseline that know some of the answers."""
    dataset = FakeDataset(n_units=20, records_per_unit=16)
    task = task_on(dataset, 800)
    split, label = dataset.split("by_unit"), task.labels()
    test, validation = (
        np.array([row[0] for row in split[name]]) for name in ("test", "validation")
    )
    rng = np.random.default_rng(8)

    def rows(record, skill):
        knows = rng.uniform(size=record.size) < skill
        scores = scores_of(np.where(knows, label[record], 0))
        return Rows(record=record, answers=scores)

    def prediction(method, seed, skill):
        parts = {}
        if method == "cnn":
            parts["windows"] = rows(np.repeat(test, 2), skill)
        return Prediction(
            protocol="by_unit",
            method=method,
            seed=seed,
            record=test,
            answers=rows(test, skill).answers,
            detail="",
            parts=parts | {"validation": rows(validation, skill)},
        )

    trained = (("cnn", 0, 0.9), ("cnn", 1, 0.9), ("indicators", 0, 0.5))
    settings = settings_of("model=cnn", "n_bootstrap=100")
    return task, settings, [prediction(*values) for values in trained]


def metrics_of(task, answers):
    scored = {"mean": 0.5, "low": 0.4, "high": 0.6, "per_seed": [0.5]}
    confusion = np.eye(N_CLASSES, dtype=int).tolist()
    network = {"balanced_accuracy": scored, "confusion": confusion}
    clean = {
        "leaky": False,
        "methods": {"cnn": network, "chance": {"balanced_accuracy": 0.25}},
        "answers": answers,
        "n_records": {"test": 80},
        "n_units": {"test": 5},
    }
    protocols = {"by_unit": clean, "leaky": {**clean, "leaky": True, "answers": None}}
    names = list(task.class_names)
    return {"model": "cnn", "class_names": names, "protocols": protocols}


def test_every_part_is_there_and_can_be_written(study, tmp_path):
    task, *rest = study
    answers = protocol_answers(task, *rest)
    assert answers == protocol_answers(task, *rest)
    json.dumps(answers, allow_nan=False)
    assert answers["best_baseline"] == "indicators"
    assert answers["comparisons"][0]["difference"]["mean"] > 0.2
    assert set(answers["detection"]) == {"cnn", "indicators"}
    assert graded_classes(answers) == list(CLASSES[1:])
    names = write_tables(tmp_path, metrics_of(task, answers))
    tables = {"scores", "by_condition", "by_severity", "confusion_by_unit"}
    assert {f"{name}.csv" for name in tables} <= set(names)
    head, *rows = (tmp_path / "scores.csv").read_text().splitlines()
    assert head.startswith("protocol,leaky,method,score,mean,low,high")
    assert rows[0] == "by_unit,False,cnn,balanced_accuracy,0.5,0.4,0.6,1,80,5"


def test_the_best_baseline_is_chosen_on_validation_machines(study):
    """Not on the test records, where another one is better."""
    task, settings, runs = study
    indicators, label = runs[-1], task.labels()
    validation = indicators.parts["validation"].record
    lucky = dataclasses.replace(
        indicators,
        method="nearest_spectrum",
        answers=scores_of(label[indicators.record]),
        parts={
            "validation": Rows(
                record=validation, answers=scores_of(np.zeros_like(validation))
            )
        },
    )
    answers = protocol_answers(task, settings, [*runs, lucky])
    assert answers["best_baseline"] == "indicators"
    against = {row["against"]: row["difference"] for row in answers["comparisons"]}
    assert against["nearest_spectrum"]["mean"] < against["indicators"]["mean"]


@pytest.fixture
def axes(monkeypatch):
    """Axes of the figures that are drawn."""
    drawn = []
    savefig = plt.Figure.savefig

    def save(figure, *args, **options):
        drawn.extend(figure.axes)
        return savefig(figure, *args, **options)

    monkeypatch.setattr(plt.Figure, "savefig", save)
    return drawn


def test_figures_show_conditions_severities_and_window_lengths(study, tmp_path, axes):
    answers = protocol_answers(*study)
    conditions_figure(tmp_path / "a.png", answers)
    columns = {row["column"] for row in answers["conditions"]["rows"]}
    assert {axis.get_xlabel() for axis in axes if axis.get_xlabel()} & columns
    axes.clear()
    detection_figure(tmp_path / "b.png", answers)
    texts = [axis.get_title() + axis.get_xlabel() for axis in axes]
    assert all(any(name in text for text in texts) for name in CLASSES[1:])
    axes.clear()
    window_length_figure(tmp_path / "c.png", {"by_unit": answers})
    assert any(axis.lines or axis.containers for axis in axes)


def test_a_figure_marks_the_limits_of_severity_that_are_reached(study, tmp_path, axes):
    answers = copy.deepcopy(protocol_answers(*study))
    ends = {"low": None, "high": None, "largest_tested": 1.0}
    rows = [
        ("severity", "reached", 0.3),
        ("severity", "not_reached", 0.4),
        ("crack_depth_mm", "reached", 0.5),
        ("crack_depth_mm", "not_reached", 0.6),
    ]
    limits = [
        {"quantity": quantity, "status": status, "value": value, "share": 0.5, **ends}
        for quantity, status, value in rows
    ]
    for part in answers["detection"][answers["network"]]["classes"].values():
        part["limits"] = limits
    detection_figure(tmp_path / "limits.png", answers)
    texts = [text.get_text() for axis in axes for text in axis.texts]
    assert {text for text in texts if " at " in text} == {"50% at 0.30"}


def crack_of(study):
    """Summary and number of records of the cracks."""
    answers = protocol_answers(*study)
    crack = answers["detection"]["cnn"]["classes"]["crack"]
    return answers, crack["summary"], crack["n_records"]


def test_a_class_of_few_records_names_their_number(study, tmp_path):
    task, settings, runs = study
    _, summary, n_records = crack_of(study)
    assert f"of {n_records} records of 5 machines found" in summary
    assert "not told" not in summary
    few = [
        dataclasses.replace(
            run,
            record=run.record[:24],
            answers=run.answers[:24],
            parts={"validation": run.parts["validation"]},
        )
        for run in runs
    ]
    answers, summary, n_records = crack_of((task, settings, few))
    assert n_records == 6
    assert "[too few machines] of 6 records of 2 machines found" in summary
    needs = "a curve needs 10 records of 3 severities"
    assert f"from what severity on is not told: {needs}" in summary
    detection_figure(tmp_path / "few.png", answers)


def test_parts_without_ground_are_left_out(study, tmp_path):
    task, settings, runs = study
    task.dataset.columns["severity"] = np.where(task.labels() > 0, 1.0, 0.0)
    alone = [dataclasses.replace(run, parts={}) for run in runs[:2]]
    answers = protocol_answers(task, settings, alone)
    assert "window_length" not in answers
    assert (answers["best_baseline"], answers["comparisons"]) == (None, [])
    assert graded_classes(answers) == []
    classes = answers["detection"]["cnn"]["classes"].values()
    assert all(part["limits"] == [] for part in classes)
    assert "by_severity.csv" not in write_tables(tmp_path, metrics_of(task, answers))
    task.dataset.class_names = ("sound", *CLASSES[1:])
    other = protocol_answers(task_on(task.dataset, 800), settings, alone)
    assert "detection" not in other
