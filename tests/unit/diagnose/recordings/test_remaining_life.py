"""Remaining lives: scores against values by hand, intervals, splits of lives, what is learnt."""

import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from numpy.testing import assert_allclose, assert_array_equal
from offline_pages import NOTHING, outward, sent_by
from refusals import refused
from runs import LIFE, by_unit, refuses, rows_of, serve, settings_of, train
from small_studies import plan_of, run

from diagnose.baselines import life_models
from diagnose.data.lives import (
    balanced_weights,
    choose_life_protocols,
    early_level,
    lives_of,
)
from diagnose.report import life_report
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.intervals import interval_text
from diagnose.scoring.judged import Judged
from diagnose.scoring.life_scores import (
    MEASURES,
    by_life,
    conformal_half_width,
    gain,
    life_scores,
    phm_score,
    prognostic_horizon,
)
from diagnose.scoring.machines import Machines
from diagnose.scoring.predictions import Prediction
from diagnose.studies import life_jobs
from diagnose.studies.study import task_from
from gensig.errors import ConfigError, DatasetError


def settled(dataset, *overrides):
    settings = settings_of(*LIFE, *overrides)
    return task_from(dataset, settings), settings


def hours(**values):
    return LifeFacts(method="cnn", coverage=0.8, n_calibration_lives=9, **values)


def planned(dataset, *overrides):
    return plan_of(*settled(dataset, *overrides))


# ---- scores


@pytest.mark.parametrize(
    ("error", "early_life"),
    [(-13.0, 125.0), (10.0, 125.0), (-26.0, 250.0), (20, 250.0)],
)
def test_the_phm_score_has_its_printed_values(error, early_life):
    """exp(13/13) - 1 for 13 units too short, exp(10/10) - 1 for 10 too long: 1.718 both."""
    assert phm_score(np.array(error), early_life) == pytest.approx(np.e - 1)
    assert phm_score(np.array(0.0), early_life) == 0.0


@pytest.mark.parametrize(
    ("predicted", "expected"),
    [
        ([100, 50, 62, 70, 25, 5], 20.0),
        ([95, 85, 60, 40, 20, 0], 100.0),
        ([100, 80, 60, 40, 20, 30], 0.0),
    ],
)
def test_the_horizon_is_where_predictions_stay_within_the_band(predicted, expected):
    true, predicted = np.array([100.0, 80, 60, 40, 20, 0]), np.array(predicted, float)
    for order in (np.arange(6), np.array([3, 0, 5, 1, 4, 2])):
        assert prognostic_horizon(true[order], predicted[order], 10.0) == expected


def test_every_life_counts_the_same():
    # life 0: one snapshot, error 6; life 1: three, each 2 too late, the last at the failure
    judged = Judged(
        method="cnn",
        unit=np.array([0, 1, 1, 1]),
        machines=Machines.alone(2, "lives"),
        truth=np.array([50.0, 60.0, 30.0, 0.0]),
        answers=np.array([44.0, 62.0, 32.0, 2.0])[None, :, None],
    )
    values = by_life(judged, [hours(early_life_h=125.0, half_width_h=3.0)])
    assert set(values) == set(MEASURES)

    drawn = {
        "machines": judged.machines,
        "n_bootstrap": 1000,
        "rng": np.random.default_rng(0),
    }
    scores = life_scores(values, **drawn)
    phm = (np.expm1(6 / 13) + np.expm1(2 / 10)) / 2
    expected = {
        "rmse_h": np.sqrt((36 + 4) / 2),
        "mae_h": 4.0,
        "phm_score": phm,
        "phm_score_last": phm,
        "coverage": 0.5,
        "width_h": (6 + (6 + 6 + 5) / 3) / 2,  # the interval about 2 h begins at 0
        "horizon_h": (50 + 60) / 2,
    }
    means = {name: score["mean"] for name, score in scores.items()}
    assert means == pytest.approx(expected)
    assert scores["mae_h"]["low"] is scores["mae_h"]["high"] is None
    assert interval_text(scores["mae_h"], ".3g") == "4 [too few lives]"
    four = {name: np.tile(row, 2) for name, row in values.items()}
    drawn["machines"] = Machines.alone(4, "lives")
    scores = life_scores(four, **drawn)
    assert scores["mae_h"]["mean"] == 4
    assert (scores["mae_h"]["low"], scores["mae_h"]["high"]) == (2, 6)

    better = gain(
        four["rmse_h"],
        4 * four["rmse_h"],
        **drawn,
    )
    assert_allclose(better["mean"], np.sqrt(20))
    assert better["low"] > 0


def test_the_half_width_is_a_rank_of_lives():
    error, life = np.array([4.0, 1.0, 3.0, 2.0]), np.array(["d", "a", "c", "b"])
    # weights 1/5 each: the fourth reaches 0.8
    assert conformal_half_width(error, life, 0.8) == 4.0
    assert conformal_half_width(error, life, 0.6) == 3.0
    # three lives cannot promise 80 %
    assert conformal_half_width(error[:3], life[:3], 0.8) == np.inf

    # fifty snapshots of one life are one life
    many = np.repeat(
        np.arange(4),
        [50, 1, 1, 1],
    )
    assert conformal_half_width(error[many], life[many], 0.6) == 3.0


def test_intervals_hold_for_new_lives_where_pooled_ones_do_not():
    rng = np.random.default_rng(0)
    life = np.repeat(np.arange(5), 20)
    held, pooled = [], []
    for _ in range(1000):
        spread = rng.lognormal(
            sigma=1.0,
            size=(6, 1),
        )  # of the errors of a life
        error = spread * rng.uniform(0.8, 1.2, size=(6, 20))
        known, new = error[:5].ravel(), rng.choice(error[5])
        held.append(new <= conformal_half_width(known, life, 0.8))
        pooled.append(new <= np.quantile(known, 0.8))

    assert np.mean(held) >= 0.8 - 3 * np.sqrt(0.16 / 1000)
    assert np.mean(pooled) < 0.78


# ---- lives


@pytest.mark.parametrize(("curve", "is_line"), [(np.abs, False), (np.negative, True)])
def test_a_curve_that_no_line_follows_is_learnt_by_boosting(curve, is_line):
    lives = lives_of(settled(FakeLives(n_lives=40, n_snapshots=10))[0])
    x = np.random.default_rng(0).uniform(-1.0, 1.0, lives.age.size)
    target, record = 100.0 * curve(x), np.arange(x.size)
    train, validation = (
        life_models.Table(values=x[part][:, None], record=part)
        for part in (record[::2], record[1::2])
    )
    name, predict = life_models.fit_regression(train, validation, lives, target)
    assert (name != life_models.BOOSTING) == is_line
    error = predict(validation) - target[validation.record]
    assert np.sqrt(np.mean(error**2)) < 0.05 * np.ptp(target)


def test_a_figure_of_lives_ends_at_the_failure_on_the_right(monkeypatch):
    lives, level = lives_of(settled(FakeLives(n_lives=4))[0]), 150.0
    prediction = Prediction(
        protocol="by_unit",
        method="network",
        seed=0,
        record=np.arange(lives.age.size),
        answers=np.minimum(lives.remaining, level)[:, None],
        detail="",
        hours=hours(early_life_h=level, half_width_h=10.0),
    )
    figures = []
    monkeypatch.setattr(
        life_report, "save", lambda figure, path: figures.append(figure)
    )
    life_report.life_figure("lives.png", lives, [prediction])
    (panel,) = figures[0].axes
    early, late = panel.get_xlim()
    low, high = panel.get_ylim()
    assert late <= 0 < level <= early
    assert low <= 0 < level <= high
    assert early - late < 1.2 * level
    cone = panel.collections[0].get_paths()[0].vertices
    assert cone[cone[:, 0] == level, 1].min() == pytest.approx(0.8 * level)


def test_a_bound_above_the_early_level_is_known_and_one_below_is_not():
    lives = lives_of(settled(FakeLives(n_lives=12, n_censored=4))[0])
    censored = ~lives.failed
    known = lives.known(60.0)

    assert known[lives.failed].all()
    assert_array_equal(known[censored], lives.remaining[censored] >= 60.0)
    assert set(known[censored]) == {True, False}


def test_the_early_level_is_of_training_lives_that_failed():
    task, settings = settled(FakeLives(n_lives=12, n_censored=4))
    lives = lives_of(task)
    record = np.flatnonzero(np.char.startswith(lives.name, "u0"))
    failed = record[lives.failed[record]]
    _, first = np.unique(
        lives.name[failed],
        return_index=True,
    )
    lengths = (lives.age + lives.remaining)[failed[first]]
    share = settings.remaining_life.early_life_share
    level = early_level(lives, record, level_h=None, share=share)

    assert_allclose(level, 0.6 * np.median(lengths))
    assert early_level(lives, record, level_h=42, share=share) == 42


def test_weights_of_a_life_do_not_grow_with_its_snapshots():
    weight = balanced_weights(np.array(["a", "b", "b", "b"]))
    assert_allclose(
        weight,
        [2, 2 / 3, 2 / 3, 2 / 3],
    )


def test_a_split_that_cuts_lives_is_left_out():
    dataset = FakeLives(n_lives=12)
    task, settings = settled(dataset)
    result = choose_life_protocols(task, lives_of(task), settings.protocols)
    reason = "life u00 is in its train and its validation part"

    assert result[0] == ("by_unit",)
    assert result[1]["random_window_leaky"] == reason

    life = dataset.columns["life_id"]
    dataset.columns["life_id"] = np.where(
        life == "u11",
        "u00",
        life,
    )
    for protocol in ("random_window_leaky", "by_unit"):
        with refused("life u00 is in its train"):
            planned(dataset, f"protocols=[{protocol}]")


def changed(column, record, value):
    dataset = FakeLives(n_lives=8)
    dataset.columns[column][record] = value
    return dataset


@pytest.mark.parametrize(
    ("dataset", "message"),
    [
        *(
            (FakeLives(n_lives=8).without(column), f"has no column {column}")
            for column in ("life_time_h", "remaining_life_h", "life_failed")
        ),
        (changed("life_failed", 3, 0), "life u00 has failed in some of its records"),
        (changed("remaining_life_h", 5, -1.0), "record r00005: .* must not be below 0"),
        (FakeLives(n_lives=8, n_censored=8), "no life of its train part failed"),
    ],
)
def test_columns_that_are_missing_or_contradict_are_refused(dataset, message):
    with pytest.raises((ConfigError, DatasetError), match=message):
        planned(dataset)


def test_protocols_about_sensors_are_left_out():
    with refused("it is of no use for remaining lives"):
        planned(FakeLives(n_lives=8, n_channels=2), "protocols=[cross_sensor]")


def test_a_data_set_without_lives_is_refused(monkeypatch, capsys, tmp_path):
    serve(monkeypatch, {"x": FakeDataset()})
    words = ["train", "data=x", f"out={tmp_path / 'out'}", *LIFE]
    refuses(capsys, words, "has no column life_id", "experiment=run_to_failure")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("remaining_life.cut=3", "cut"),
        ("heads=[severity]", "heads is not for task=remaining_life"),
        ("tensorboard=true", "tensorboard is not for task=remaining_life"),
        ("normalise=both", "normalise=both is not for task=remaining_life"),
        ("protocols=[by_machine]", "no protocol 'by_machine'"),
    ],
)
def test_a_wrong_key_is_refused_in_one_line(
    word, message, monkeypatch, capsys, tmp_path
):
    serve(monkeypatch, {"x": FakeLives(n_lives=8)})
    words = ["train", "data=x", f"out={tmp_path / 'out'}", *LIFE, word]
    refuses(capsys, words, message)


# ---- what is learnt


ENDS = ("low_h", "predicted_h", "high_h")


def mean_of(methods, method, measure):
    return methods[method][measure]["mean"]


def test_vibration_that_tells_the_life_beats_the_age(life_study):
    methods = by_unit(life_study)["methods"]
    by_vibration = {"indicators", "indicators_and_age", "cnn_and_age"}
    assert set(methods) == {"constant", "age_only", "cnn"} | by_vibration
    for name in by_vibration:
        assert methods[name]["gain_over_age_only_h"]["low"] > 0, name

    indicators, age = (methods[name] for name in ("indicators", "age_only"))
    assert indicators["rmse_h"]["mean"] < 0.6 * age["rmse_h"]["mean"]
    assert indicators["horizon_h"]["mean"] > age["horizon_h"]["mean"]


def test_vibration_that_tells_nothing_does_not(tmp_path):
    dataset = FakeLives(n_lives=16, seed=1, strength=0.0)
    methods = by_unit(train(tmp_path / "out", dataset, *LIFE, "epochs=1"))["methods"]
    for name in ("indicators", "cnn"):
        assert methods[name]["gain_over_age_only_h"]["low"] <= 0, name


def test_censored_lives_are_counted_and_never_scored(life_study):
    result, rows = by_unit(life_study), rows_of(life_study / "predictions.csv")
    assert sum(result["n_lives"].values()) == 18
    assert sum(result["n_lives_censored"].values()) == 6
    assert [row["scored"] for row in rows] == [row["life_failed"] for row in rows]

    scored = {row["life_id"] for row in rows if row["scored"] == "1"}
    assert len(scored) == result["n_lives"]["test"]

    ends = [[float(row[name]) for row in rows] for name in ENDS]
    assert np.min(ends) >= 0
    assert np.all(np.diff(ends, axis=0) >= 0)
    assert np.max(ends) <= result["early_life_h"] * 1.00001


def test_the_page_fetches_nothing(browser, life_study):
    assert sent_by(browser, life_study / "report.html") == NOTHING


def test_the_report_is_whole(life_study):
    tables = {"metrics.json", "predictions.csv", "scores.csv", "study.json"}
    pages = {"report.html", "remaining_life_by_unit.png", "models"}
    assert {path.name for path in life_study.iterdir()} == tables | pages

    page = (life_study / "report.html").read_text()
    heads = ("How long the machines still run", "age only", "PHM score")
    for text in (*heads, "random_window_leaky is left out"):
        assert text in page
    assert outward(page) == []

    methods = by_unit(life_study)["methods"]
    for row in rows_of(life_study / "scores.csv"):
        expected = mean_of(methods, row["method"], row["measure"])
        assert_allclose(float(row["mean"]), expected, rtol=1e-5)


def test_a_job_that_is_sent_to_another_process_gives_the_same_bits(life_study, lives):
    """A process of its own gets copies; it needs nothing else of this one."""
    task, settings = settled(lives, "normalise=none")
    job = plan_of(task, settings).jobs[-1]
    task, settings, job = pickle.loads(pickle.dumps((task, settings, job)))
    rows = rows_of(life_study / "predictions.csv")

    for each in run(task, settings, job):
        expected = [row["predicted_h"] for row in rows if row["method"] == each.method]
        assert [f"{hours:.6g}" for hours in each.answers[:, 0]] == expected


def test_only_the_training_part_has_what_a_training_profits_from(monkeypatch):
    dataset = FakeLives(n_lives=8)
    task, settings = settled(dataset, "epochs=1", "remaining_life.with_age=false")
    job = plan_of(task, settings).jobs[-1]
    load, asked = life_jobs.input_of(settings.model).load, {}

    def watched(task, part, *, training):
        asked[tuple(np.unique(part.record))] = training
        return load(task, part, training=training)

    monkeypatch.setattr(life_jobs, "input_of", lambda _: SimpleNamespace(load=watched))
    run(task, settings, job)
    parts = life_jobs.life_sets(task, settings, job.protocols[0]).parts
    wanted = {
        tuple(np.unique(part.record)): name == "train" for name, part in parts.items()
    }
    assert asked == wanted


def test_too_few_validation_lives_give_intervals_that_say_nothing(tmp_path):
    words = ("remaining_life.coverage=0.9", "remaining_life.with_age=false")
    out = train(
        tmp_path / "out",
        FakeLives(n_lives=8),
        *LIFE,
        "epochs=1",
        *words,
    )
    result = by_unit(out)

    assert not result["intervals_hold"]
    assert set(result["methods"]) == {"constant", "age_only", "indicators", "cnn"}
    assert mean_of(result["methods"], "cnn", "coverage") == 1
    assert "validation lives are too few" in (out / "report.html").read_text()
