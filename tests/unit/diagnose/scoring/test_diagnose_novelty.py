"""Scores of novelty: nothing new is chance, something plain is found, alarms are as rare as promised."""

import dataclasses
import json

import numpy as np
import pytest
import torch
from novelty_sets import OpenDataset
from scipy.stats import norm

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import load_windows, subset_segments
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.novelty import NoveltyRun, network_outputs
from diagnose.studies.novelty_metrics import (
    alarm_threshold,
    false_positive_rate_95,
    novelty_protocol_result,
    novelty_result,
)
from diagnose.studies.study import plan_study, task_from
from diagnose.training.autoencoder import (
    WindowAutoencoder,
    fit_autoencoder,
    reconstruction_error,
)
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import train_network
from gensig.errors import ConfigError
from gensig.options.compose import compose

FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=3", "seeds=[0]", "n_bootstrap=200", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]",
]  # fmt: skip


def settings_of(*overrides):
    return settings_from(compose("train", ["data=x", "out=y", *FAST, *overrides]))


def result_of(task, protocol, runs):
    return novelty_protocol_result(task, protocol, runs, n_bootstrap=200, seed=0)


@pytest.fixture(scope="module")
def studies():
    """Results of both protocols on a set with plain faults and on one with none but in name."""
    torch.set_num_threads(1)
    found = {}
    for name, strength in (("plain", 4.0), ("none", 0.0)):
        settings = settings_of(
            "protocols=[healthy_only,open_set]",
            "epochs=8",
            "learning_rate=0.01",
            "epoch_fraction=0.6",
        )
        task = task_from(OpenDataset(strength=strength, n_units=24), settings)
        protocols, jobs = plan_study(task, settings)
        runs = run_jobs(task, settings, jobs, n_workers=1, on_done=lambda _: None)
        found[name] = {
            protocol: result_of(task, protocol, runs) for protocol in protocols
        }
    return found


def test_a_plain_fault_is_found_by_those_who_know_only_health(studies):
    result = studies["plain"]["healthy_only"]
    assert (result["known_classes"], len(result["novel_classes"])) == (["healthy"], 3)
    assert set(result["methods"]) == {
        "nearest_band_levels", "nearest_indicators", "forest_indicators", "nearest_indicators_without_level",
        "forest_indicators_without_level", "autoencoder",
    }  # fmt: skip
    for method in result["methods"].values():
        assert method["auroc_by_class"]["missing_tooth"]["low"] > 0.9
        assert method["found"]["missing_tooth"]["mean"] > 0.6


def test_a_plain_class_never_shown_is_noticed_and_the_known_ones_are_told_apart(
    studies,
):
    result = studies["plain"]["open_set"]
    assert result["novel_classes"] == ["missing_tooth"]
    assert result["methods"]["nearest_band_levels"]["auroc"]["low"] > 0.8
    for name in ("largest_probability", "energy", "nearest_features"):
        rate = result["methods"][name]["fpr95"]
        assert 0 <= rate["low"] <= rate["mean"] <= rate["high"] <= 1
    for method in result["methods"].values():
        parts = [
            area["mean"] for area in method["auroc_by_known_class"].values()
        ]  # as many records of each class
        assert len(parts) == 3
        assert method["auroc"]["mean"] == pytest.approx(np.mean(parts))
    assert (
        result["known"]["balanced_accuracy"]["mean"]
        > result["known"]["chance"]
        == pytest.approx(1 / 3)
    )


@pytest.mark.parametrize("protocol", ["healthy_only", "open_set"])
def test_a_fault_in_name_only_is_not_found(studies, protocol):
    result = studies["none"][protocol]
    n = result["n_records"]["test"]
    n_known = n // 4 * len(result["known_classes"])
    deviation = np.sqrt(
        (n + 1) / (12 * n_known * (n - n_known))
    )  # of the Mann-Whitney statistic when nothing differs
    for name, method in result["methods"].items():
        assert abs(method["auroc"]["mean"] - 0.5) < 3.5 * deviation < 0.4, name


@pytest.fixture
def labelled():
    """Task and a way to score its test records."""
    task = task_from(OpenDataset(n_units=16), settings_of())
    record = np.unique(subset_segments(task, "healthy_only", "test").record)
    novel = task.labels()[record] > 0

    def judge(*scores, validation=None, predicted=None):
        known = np.linspace(0, 1, 40) if validation is None else validation
        runs = [
            NoveltyRun(
                protocol="healthy_only", method="m", seed=seed, detail="", record=record, score=score,
                validation_score=known, predicted=predicted,
            )
            for seed, score in enumerate(scores)
        ]  # fmt: skip
        return novelty_result(task, runs, [0], 300, np.random.default_rng(0))

    return judge, novel, task, record


def test_perfect_and_empty_scores(labelled):
    judge, novel, _, record = labelled
    perfect = judge(novel * 5.0, predicted=record)
    assert perfect["auroc"]["low"] == perfect["auroc"]["mean"] == 1
    assert perfect["false_alarms"]["mean"] == perfect["fpr95"]["mean"] == 0
    assert all(found["low"] == 1 for found in perfect["found"].values())
    empty = judge(np.zeros(novel.size), predicted=record)
    assert (
        empty["auroc"]["mean"] == empty["auroc"]["low"] == empty["auroc"]["high"] == 0.5
    )
    assert empty["fpr95"]["mean"] == 1
    assert "fpr95" not in judge(np.zeros(novel.size))


def test_units_that_are_copies_leave_nothing_to_resample(labelled):
    judge, novel, task, record = labelled
    units = np.asarray(task.dataset.column("unit_id"))[record]
    score = np.concatenate(
        [np.arange(np.sum(units == unit)) ** 2 % 5 for unit in np.unique(units)]
    ).astype(float)
    area = judge(score)["auroc"]
    assert 0 < area["mean"] < 1
    np.testing.assert_allclose(
        [area["low"], area["high"]], area["mean"], rtol=1e-12, atol=0
    )
    uneven = judge(score + (units == units[0]) * np.where(novel, 3, 0))["auroc"]
    assert uneven["low"] < uneven["mean"] < uneven["high"]


def test_interval_covers_the_seeds(labelled):
    judge, novel, _, _ = labelled
    area = judge(novel * 1.0, np.zeros(novel.size))["auroc"]
    assert area["per_seed"] == (1.0, 0.5)
    assert (area["low"], area["high"]) == (0.5, 1.0)


@pytest.mark.parametrize("n", [19, 20, 21, 58, 400])
def test_new_known_records_raise_no_more_alarms_than_promised(n):
    rng = np.random.default_rng(n)
    shares = [
        1 - norm.cdf(alarm_threshold(rng.standard_normal(n))) for _ in range(4000)
    ]
    assert 0.05 - 1 / (n + 1) < np.mean(shares) < 0.05 + 4 * np.std(shares) / 63


def test_too_few_records_give_their_largest_score():
    assert alarm_threshold(np.arange(5.0)) == 4
    assert alarm_threshold(np.arange(100.0)) == 95


@pytest.mark.parametrize("shift", [0.0, 1.0, 3.0])
def test_false_positive_rate_of_two_normal_scores(shift):
    rng = np.random.default_rng(1)
    novel = np.arange(80000) % 2 == 1
    score = rng.standard_normal(novel.size) + shift * novel
    expected = norm.cdf(norm.ppf(0.95) - shift)
    assert false_positive_rate_95(novel, score) == pytest.approx(expected, abs=0.01)
    weight = np.where(novel, 1.0, np.where(score > 0, 0.0, 1.0))
    assert false_positive_rate_95(novel, score, weight) < expected


def test_features_and_outputs_are_those_of_the_last_layer():
    settings = settings_of()
    task = task_from(OpenDataset(), settings)
    train, validation = (
        load_windows(task, subset_segments(task, "by_unit", part))
        for part in ("train", "validation")
    )
    model = train_network(
        train, validation, target=Classes(n_classes=4), settings=settings, seed=0
    ).model
    every = np.arange(len(validation))
    features, logits = network_outputs(model, validation, every)
    layer = model.head[-1]
    rebuilt = features @ layer.weight.detach().numpy().T + layer.bias.detach().numpy()
    np.testing.assert_allclose(logits, rebuilt, rtol=1e-4, atol=1e-5)
    scaled = logits - np.logaddexp.reduce(logits, axis=1, keepdims=True)
    np.testing.assert_allclose(
        predict_windows(model, validation), scaled, rtol=1e-4, atol=1e-5
    )


def healthy_windows(task, subset):
    return load_windows(task, subset_segments(task, "healthy_only", subset))


@pytest.mark.parametrize("window", [128, 1200, 6400])
def test_the_autoencoder_answers_for_every_whole_step(window):
    model = WindowAutoencoder([1.0, 2.0]).eval()
    windows = torch.randn(3, 2, window)
    assert model(windows).shape == (3, window // 128 * 128)
    assert torch.isfinite(model(torch.zeros(1, 2, window))).all()
    doubled = WindowAutoencoder([2.0, 4.0]).eval()
    doubled.load_state_dict({**model.state_dict(), "scale": 2 * model.scale})
    torch.testing.assert_close(doubled(2 * windows), model(windows))


def test_the_autoencoder_is_the_same_for_the_same_seed():
    settings = settings_of()
    task = task_from(OpenDataset(), settings)
    train, validation = (
        healthy_windows(task, part) for part in ("train", "validation")
    )
    before = torch.random.get_rng_state()
    first, again, other = (
        fit_autoencoder(train, validation, settings=settings, seed=seed)
        for seed in (1, 1, 2)
    )
    assert torch.equal(before, torch.random.get_rng_state())
    error = reconstruction_error(first, validation)
    np.testing.assert_array_equal(error, reconstruction_error(again, validation))
    few = reconstruction_error(first, validation, batch_size=3)
    np.testing.assert_allclose(error, few, rtol=1e-4, atol=0)
    assert not np.array_equal(error, reconstruction_error(other, validation))


def test_the_autoencoder_learns_and_a_moment_that_it_cannot_rebuild_is_seen():
    task = task_from(OpenDataset(), settings_of())
    train, validation = (
        healthy_windows(task, part) for part in ("train", "validation")
    )
    short, long = (
        fit_autoencoder(
            train,
            validation,
            settings=settings_of(f"epochs={n}", "patience=30"),
            seed=0,
        )
        for n in (1, 30)
    )
    windows = torch.from_numpy(validation.cut(np.arange(9)))
    mean = [part.model(windows).mean().item() for part in (short, long)]
    assert mean[1] < 0.7 * mean[0]
    burst = dataclasses.replace(
        validation, signals=tuple(signal.copy() for signal in validation.signals)
    )
    for signal in burst.signals:
        signal[:, 1100:1164] += 3 * np.sin(np.arange(64))
    seen = validation.start <= 1000  # the burst lies whole in these windows
    assert (
        reconstruction_error(long, burst) > 1.5 * reconstruction_error(long, validation)
    )[seen].all()


def test_two_processes_give_what_one_gives():
    settings = settings_of("seeds=[3]")
    task = task_from(OpenDataset(), settings)
    jobs = [
        Job(protocols=(name,), seed=seed)
        for name in ("healthy_only", "open_set")
        for seed in (None, 3)
    ]
    one, two = (
        run_jobs(task, settings, jobs, n_workers=n, on_done=lambda _: None)
        for n in (1, 2)
    )
    assert [run.method for run in one] == [run.method for run in two]
    assert len(one) == 10
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.score, b.score)
        np.testing.assert_array_equal(a.validation_score, b.validation_score)


@pytest.mark.parametrize(
    ("changes", "overrides", "message"),
    [
        ({}, ["protocols=[healthy_only]", "window_samples=100"], "at least 128"),
        (
            {},
            ["protocols=[open_set]", "classes=[healthy,crack,pitting]"],
            "it needs known and new ones",
        ),
        (
            {},
            ["protocols=[open_set]", "classes=[healthy,missing_tooth]"],
            "one known class only",
        ),
        (
            {},
            ["protocols=[healthy_only]", "classes=[crack,pitting]"],
            "its train part is empty",
        ),
    ],
)
def test_mistakes(changes, overrides, message):
    settings = settings_of(*overrides)
    task = task_from(OpenDataset(**changes), settings)
    with pytest.raises(ConfigError, match=message):
        plan_study(task, settings)


def test_the_command_reports_novelty_alone(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: OpenDataset()
    )
    out = tmp_path / "out"
    assert (
        main(
            [
                "train",
                "data=x",
                f"out={out}",
                *FAST,
                "protocols=[healthy_only,open_set]",
            ]
        )
        == 0
    )
    assert "**healthy_only**: Trained on" in capsys.readouterr().out
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["protocols"] == {}
    assert list(metrics["novelty"]) == ["healthy_only", "open_set"]
    page = (out / "report.html").read_text()
    for text in (
        "noticed by who knows health alone (healthy_only)",
        '<th scope="col">FPR95</th><th scope="col">false alarms</th><th scope="col">missing_tooth found',
        "Balanced accuracy of the network on the known classes", "healthy_only: only 3 test unit(s)", "Caveats",
        "<b>AUROC of energy</b>: against healthy ",
        "validation record(s); with fewer than 19",
    ):  # fmt: skip
        assert text in page, text
    for text in ("LEAKY", "In short", "nan ["):
        assert text not in page
    rows = [line.split(",") for line in (out / "novelty.csv").read_text().splitlines()]
    assert rows[0] == [
        "protocol",
        "method",
        "seed",
        "record_id",
        "unit_id",
        "label",
        "score",
        "threshold",
    ]
    mine = [
        row
        for row in rows
        if row[:2] == ["healthy_only", "autoencoder"] and row[5] == "missing_tooth"
    ]
    found = metrics["novelty"]["healthy_only"]["methods"]["autoencoder"]["found"][
        "missing_tooth"
    ]["mean"]
    assert np.mean([float(row[6]) > float(row[7]) for row in mine]) == pytest.approx(
        found
    )


def test_null_runs_everything_and_both_kinds_share_a_report(monkeypatch, tmp_path):
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: OpenDataset(n_channels=2)
    )
    out = tmp_path / "out"
    few = [
        "protocols=null",
        "shuffle_control=false",
        "baselines=[rms_threshold]",
        "epochs=1",
    ]
    assert main(["train", "data=x", f"out={out}", *FAST, *few]) == 0
    metrics = json.loads((out / "metrics.json").read_text())
    assert list(metrics["protocols"]) == ["by_unit", "cross_sensor"]
    assert list(metrics["novelty"]) == ["healthy_only", "open_set"]
    page = (out / "report.html").read_text()
    assert "Which faults are found" in page
    assert "never trained on (open_set)" in page
    assert "trained on channel_0, tested on channel_1" in page
