"""Remaining lives: scores against values by hand, intervals that hold, lives whole on one side, what is learnt."""

import csv
import json
import re

import numpy as np
import pytest
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from numpy.testing import assert_allclose

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.lives import (
    balanced_weights,
    choose_life_protocols,
    early_level,
    lives_of,
)
from diagnose.scoring.life_scores import (
    MEASURES,
    Snapshots,
    by_life,
    conformal_half_width,
    gain,
    life_scores,
    phm_score,
    prognostic_horizon,
)
from diagnose.settings import settings_from
from diagnose.studies.life_study import plan_life_study
from diagnose.studies.study import task_from
from gensig.errors import ConfigError, DatasetError
from gensig.options.compose import compose

FAST = [
    "task=remaining_life", "window_samples=1600", "stride_samples=1600", "epochs=5", "seeds=[0]", "n_bootstrap=200",
    "n_threads=1", "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "epoch_fraction=1",
    "learning_rate=0.01",
]  # fmt: skip


def settings_of(*overrides):
    return settings_from(compose("train", ["data=x", "out=y", *FAST, *overrides]))


def planned(dataset, *overrides):
    settings = settings_of(*overrides)
    return plan_life_study(task_from(dataset, settings), settings)


def trained(dataset, out, *overrides):
    """Metrics and the rows of ``predictions.csv`` of the command on a data set in memory."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: dataset)
        assert main(["train", "data=lives", f"out={out}", *FAST, *overrides]) == 0
    with (out / "predictions.csv").open() as file:
        return json.loads((out / "metrics.json").read_text()), list(
            csv.DictReader(file)
        )


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    out = tmp_path_factory.mktemp("lives") / "out"
    return out, *trained(FakeLives(n_lives=24, n_censored=6, seed=1), out)


# ---- scores


def test_the_phm_score_has_its_printed_values():
    # exp(13/13) - 1 for 13 units too short, exp(10/10) - 1 for 10 too long: 1.718 both
    assert_allclose(
        phm_score([-13.0, 0.0, 10.0], 125.0),
        [np.e - 1, 0, np.e - 1],
        rtol=1e-12,
        atol=1e-15,
    )
    assert_allclose(
        phm_score([-26.0, 20.0], 250.0), [np.e - 1, np.e - 1], rtol=1e-12, atol=0
    )
    assert phm_score(np.array(20.0), 125.0) > phm_score(np.array(-20.0), 125.0)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ([100, 50, 62, 70, 25, 5], 20.0),
        ([95, 85, 60, 40, 20, 0], 100.0),
        ([100, 80, 60, 40, 20, 30], 0.0),
    ],
)
def test_the_horizon_is_where_predictions_stay_within_the_band(said, expected):
    true = np.array([100.0, 80, 60, 40, 20, 0])
    assert prognostic_horizon(true, np.array(said, dtype=float), 10.0) == expected
    shuffled = np.array([3, 0, 5, 1, 4, 2])
    assert (
        prognostic_horizon(true[shuffled], np.array(said, dtype=float)[shuffled], 10.0)
        == expected
    )


def test_every_life_counts_the_same():
    # life 0: one snapshot, error 6; life 1: three, error 2 too late each and the failure itself at the end
    snapshots = Snapshots(
        life=np.array([0, 1, 1, 1]),
        true=np.array([50.0, 60.0, 30.0, 0.0]),
        said=np.array([44.0, 62.0, 32.0, 2.0]),
        half_width=3.0,
        early_life=125.0,
    )
    values = {name: row[None] for name, row in by_life(snapshots).items()}
    assert set(values) == set(MEASURES)
    scores = life_scores(values, n_bootstrap=100, rng=np.random.default_rng(0))
    expected = {
        "rmse_h": np.sqrt((36 + 4) / 2),
        "mae_h": 4.0,
        "phm_score": (np.expm1(6 / 13) + np.expm1(2 / 10)) / 2,
        "phm_score_last": (np.expm1(6 / 13) + np.expm1(2 / 10)) / 2,
        "coverage": 0.5,
        "width_h": (6 + (6 + 6 + 5) / 3) / 2,  # the interval about 2 h begins at 0
        "horizon_h": (50 + 60) / 2,
    }
    assert {name: score["mean"] for name, score in scores.items()} == pytest.approx(
        expected, rel=1e-12
    )
    assert scores["mae_h"]["low"] == 2
    assert scores["mae_h"]["high"] == 6
    better = gain(
        values["rmse_h"],
        4 * values["rmse_h"],
        n_bootstrap=100,
        rng=np.random.default_rng(0),
    )
    assert better["mean"] == pytest.approx(np.sqrt(20))
    assert better["low"] > 0


def test_the_half_width_is_a_rank_of_lives():
    error, life = np.array([4.0, 1.0, 3.0, 2.0]), np.array(["d", "a", "c", "b"])
    assert (
        conformal_half_width(error, life, 0.8) == 4.0
    )  # weights 1/5 each: the fourth reaches 0.8
    assert conformal_half_width(error, life, 0.6) == 3.0
    assert (
        conformal_half_width(error[:3], life[:3], 0.8) == np.inf
    )  # three lives cannot promise 80 %
    many = conformal_half_width(
        np.repeat(error, [50, 1, 1, 1]), np.repeat(life, [50, 1, 1, 1]), 0.6
    )
    assert many == 3.0  # fifty snapshots of one life are one life


def test_intervals_hold_for_new_lives_where_pooled_ones_do_not():
    rng = np.random.default_rng(0)
    held, pooled = [], []
    for _ in range(2000):
        spread = rng.lognormal(
            sigma=1.0, size=6
        )  # errors of a life resemble each other
        error = spread[:, None] * rng.uniform(0.8, 1.2, size=(6, 20))
        life = np.repeat(np.arange(5), 20)
        new = rng.choice(error[5])
        held.append(new <= conformal_half_width(error[:5].ravel(), life, 0.8))
        pooled.append(new <= np.quantile(error[:5], 0.8))
    assert np.mean(held) >= 0.8 - 3 * np.sqrt(0.16 / 2000)
    assert np.mean(pooled) < 0.78


# ---- lives


def test_a_bound_above_the_early_level_is_known_and_one_below_is_not():
    dataset = FakeLives(n_lives=12, n_censored=4)
    lives = lives_of(task_from(dataset, settings_of()))
    censored = ~lives.failed
    assert 0 < censored.sum() < censored.size
    known = lives.known(60.0)
    assert known[lives.failed].all()
    assert_allclose(known[censored], lives.remaining[censored] >= 60.0, rtol=0, atol=0)
    assert known[censored].any()
    assert not known[censored].all()


def test_the_early_level_is_of_training_lives_that_failed():
    dataset = FakeLives(n_lives=12, n_censored=4)
    settings = settings_of()
    lives = lives_of(task_from(dataset, settings))
    record = np.flatnonzero(np.char.startswith(lives.name, "u0"))
    names = np.unique(lives.name[record[lives.failed[record]]])
    lengths = [(lives.age + lives.remaining)[lives.name == name][0] for name in names]
    share = settings.remaining_life.early_life_share
    level = early_level(lives, record, level_h=None, share=share)
    assert level == pytest.approx(0.6 * np.median(lengths), rel=1e-12)
    assert early_level(lives, record, level_h=42, share=share) == 42


def test_weights_of_a_life_do_not_grow_with_its_snapshots():
    weight = balanced_weights(np.array(["a", "b", "b", "b"]))
    assert_allclose(weight, [2, 2 / 3, 2 / 3, 2 / 3], rtol=1e-12, atol=0)


def test_a_split_that_cuts_lives_is_left_out():
    dataset = FakeLives(n_lives=12)
    settings = settings_of()
    task = task_from(dataset, settings)
    protocols, left_out = choose_life_protocols(
        task, lives_of(task), settings.protocols
    )
    assert protocols == ("by_unit",)
    assert (
        left_out["random_window_leaky"]
        == "life u00 is in its train and its validation part"
    )
    with pytest.raises(ConfigError, match="life u00 is in its train"):
        planned(dataset, "protocols=[random_window_leaky]")
    dataset.columns["life_id"] = np.where(
        dataset.columns["unit_id"] == "u11", "u00", dataset.columns["life_id"]
    )
    with pytest.raises(
        ConfigError, match="by_unit: life u00 is in its train and its test part"
    ):
        planned(dataset, "protocols=[by_unit]")


def test_protocols_about_classes_and_sensors_are_left_out():
    with pytest.raises(
        ConfigError, match="cross_sensor: it is of no use for remaining lives"
    ):
        planned(FakeLives(n_lives=8, n_channels=2), "protocols=[cross_sensor]")


def test_what_is_no_set_of_lives_is_refused_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: FakeDataset()
    )
    assert main(["train", "data=x", f"out={tmp_path / 'out'}", *FAST]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert "has no column life_id" in lines[0]
    assert "experiment=run_to_failure" in lines[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("column", ["life_time_h", "remaining_life_h", "life_failed"])
def test_each_column_is_needed(column):
    with pytest.raises(DatasetError, match=f"has no column {column}"):
        planned(FakeLives(n_lives=8).without(column))


def test_columns_that_contradict_are_refused():
    dataset = FakeLives(n_lives=8)
    dataset.columns["life_failed"][3] = 0
    with pytest.raises(
        DatasetError, match="life u00 has failed in some of its records"
    ):
        planned(dataset)
    dataset = FakeLives(n_lives=8)
    dataset.columns["remaining_life_h"][5] = -1.0
    with pytest.raises(DatasetError, match=r"record r00005: .* must not be below 0"):
        planned(dataset)


def test_a_part_without_failures_is_refused():
    with pytest.raises(ConfigError, match="no life of its train part failed"):
        planned(FakeLives(n_lives=8, n_censored=8))


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("task=lifetime", "task must be one of classes, remaining_life"),
        (
            "remaining_life.coverage=1",
            "remaining_life.coverage must be a number above 0 and below 1",
        ),
        (
            "remaining_life.early_life_share=0",
            "early_life_share must be a number above 0 and below 1",
        ),
        (
            "remaining_life.early_life_h=-3",
            "early_life_h must be a number above 0, not -3",
        ),
        ("remaining_life.with_age=yes", "with_age must be true or false"),
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
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: FakeLives(n_lives=8)
    )
    assert main(["train", "data=x", f"out={tmp_path / 'out'}", *FAST, word]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert re.search(message, line), line


# ---- what is learnt


def test_vibration_that_tells_the_life_beats_the_clock(study):
    _, metrics, _ = study
    methods = metrics["protocols"]["by_unit"]["methods"]
    assert set(methods) == {
        "constant",
        "age_only",
        "indicators",
        "indicators_and_age",
        "cnn",
        "cnn_and_age",
    }
    for name in ("indicators", "indicators_and_age", "cnn_and_age"):
        assert methods[name]["gain_over_age_only_h"]["low"] > 0, name
    assert (
        methods["indicators"]["rmse_h"]["mean"]
        < 0.6 * methods["age_only"]["rmse_h"]["mean"]
    )
    assert (
        methods["indicators"]["horizon_h"]["mean"]
        > methods["age_only"]["horizon_h"]["mean"]
    )


def test_vibration_that_tells_nothing_does_not(tmp_path):
    metrics, _ = trained(
        FakeLives(n_lives=24, seed=1, strength=0.0), tmp_path / "out", "epochs=1"
    )
    methods = metrics["protocols"]["by_unit"]["methods"]
    for name in ("indicators", "cnn"):
        assert methods[name]["gain_over_age_only_h"]["low"] <= 0, name


def test_censored_lives_are_told_and_never_scored(study):
    _, metrics, rows = study
    result = metrics["protocols"]["by_unit"]
    assert sum(result["n_lives"].values()) == 18
    assert sum(result["n_lives_censored"].values()) == 6
    assert {row["scored"] for row in rows if row["life_failed"] == "0"} <= {"0"}
    mine = [
        row for row in rows if row["method"] == "indicators" and row["scored"] == "1"
    ]
    assert len({row["life_id"] for row in mine}) == result["n_lives"]["test"]
    level = result["early_life_h"]
    by_name = {}
    for row in mine:
        error = float(row["predicted_h"]) - min(float(row["remaining_life_h"]), level)
        by_name.setdefault(row["life_id"], []).append(error**2)
    rmse = np.sqrt(np.mean([np.mean(errors) for errors in by_name.values()]))
    assert result["methods"]["indicators"]["rmse_h"]["mean"] == pytest.approx(
        rmse, rel=1e-4
    )
    for row in rows:
        assert (
            0
            <= float(row["low_h"])
            <= float(row["predicted_h"])
            <= float(row["high_h"])
            <= level * 1.00001
        )


def test_the_report_is_whole(study):
    out, metrics, _ = study
    assert {path.name for path in out.iterdir()} == {
        "metrics.json", "predictions.csv", "scores.csv", "report.html", "remaining_life_by_unit.png", "models",
    }  # fmt: skip
    page = (out / "report.html").read_text()
    for text in (
        "How long the machines still run",
        "age only",
        "PHM score",
        "random_window_leaky is left out",
    ):
        assert text in page
    assert metrics["protocols_left_out"]["random_window_leaky"].startswith("life u00")
    with (out / "scores.csv").open() as file:
        rows = {
            (row["method"], row["measure"]): float(row["mean"])
            for row in csv.DictReader(file)
        }
    rmse = metrics["protocols"]["by_unit"]["methods"]["cnn"]["rmse_h"]["mean"]
    assert rows["cnn", "rmse_h"] == pytest.approx(rmse, rel=1e-5)


def test_the_bits_do_not_depend_on_the_workers(study, tmp_path):
    out, metrics, _ = study
    again, _ = trained(
        FakeLives(n_lives=24, n_censored=6, seed=1), tmp_path / "out", "n_threads=2"
    )
    assert again["protocols"] == metrics["protocols"]
    assert (tmp_path / "out" / "predictions.csv").read_bytes() == (
        out / "predictions.csv"
    ).read_bytes()


def test_too_few_validation_lives_give_intervals_that_say_nothing(tmp_path):
    metrics, _rows = trained(
        FakeLives(n_lives=8),
        tmp_path / "out",
        "epochs=1",
        "remaining_life.coverage=0.9",
        "remaining_life.with_age=false",
    )
    result = metrics["protocols"]["by_unit"]
    assert not result["intervals_hold"]
    assert set(result["methods"]) == {"constant", "age_only", "indicators", "cnn"}
    assert result["methods"]["cnn"]["coverage"]["mean"] == 1
    assert (
        "validation lives are too few" in (tmp_path / "out" / "report.html").read_text()
    )
