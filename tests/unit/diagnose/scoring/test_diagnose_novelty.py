"""Scores of novelty: chance without faults, visible faults found, alarms as rare as promised."""

import dataclasses

import numpy as np
import pytest
import torch
from novelty_sets import OpenDataset
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from runs import rows_of
from scipy.special import log_softmax, logsumexp, softmax
from scipy.stats import norm
from small_studies import LEARNS, TINY_CNN, plan_of, run, study_of, train, windows_of

from diagnose.data.windows import SUBSETS, subset_segments
from diagnose.scoring.alarms import alarm_threshold
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.studies import novelty
from diagnose.studies.jobs import Job
from diagnose.studies.novelty import network_outputs, trained_runs
from diagnose.studies.novelty_metrics import (
    false_positive_rate_95,
    novelty_protocol_result,
    novelty_result,
)
from diagnose.training import autoencoder
from diagnose.training.autoencoder import (
    WindowAutoencoder,
    fit_autoencoder,
    reconstruction_error,
)
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import train_network
from gensig.errors import SimulationError

BOTH = "protocols=[healthy_only,open_set]"


@pytest.fixture(scope="module")
def studies():
    """Results of both protocols with visible faults and with faults in name only."""
    results = {}
    for name, strength, epochs in (("plain", 4.0, 5), ("none", 0.0, 1)):
        dataset = OpenDataset(strength=strength, n_units=24)
        words = [BOTH, *TINY_CNN, *LEARNS, f"epochs={epochs}"]
        task, settings = study_of(dataset, *words)
        plan = plan_of(task, settings)
        runs = run(task, settings, *plan.jobs)
        results[name] = {
            protocol: novelty_protocol_result(task, protocol, runs, n_bootstrap=100)
            for protocol in plan.protocols
        }
    return results


def test_a_visible_fault_is_found_by_methods_that_know_only_healthy_records(studies):
    result = studies["plain"]["healthy_only"]
    assert (result["known_classes"], len(result["novel_classes"])) == (["healthy"], 3)

    tables = ("indicators", "indicators_without_level")
    names = {f"{kind}_{table}" for kind in ("nearest", "forest") for table in tables}
    assert set(result["methods"]) == names | {"nearest_band_levels", "autoencoder"}
    for method in result["methods"].values():
        assert method["auroc_by_class"]["missing_tooth"]["low"] > 0.9
        assert method["found"]["missing_tooth"]["mean"] > 0.6


def test_a_visible_new_class_is_noticed_and_the_known_ones_are_told_apart(studies):
    result = studies["plain"]["open_set"]
    assert result["novel_classes"] == ["missing_tooth"]

    methods, known = result["methods"], result["known"]
    assert methods["nearest_band_levels"]["auroc"]["low"] > 0.8
    for name in ("largest_probability", "energy", "nearest_features"):
        rate = methods[name]["fpr95"]
        assert 0 <= rate["low"] <= rate["mean"] <= rate["high"] <= 1
    for method in methods.values():
        # the classes have the same number of records
        parts = [area["mean"] for area in method["auroc_by_known_class"].values()]
        assert len(parts) == 3
        assert_allclose(
            method["auroc"]["mean"],
            np.mean(parts),
        )
    assert_allclose(known["chance"], 1 / 3)
    assert known["balanced_accuracy"]["mean"] > known["chance"]


@pytest.mark.parametrize("protocol", ["healthy_only", "open_set"])
def test_a_fault_in_name_only_is_not_found(studies, protocol):
    result = studies["none"][protocol]
    n = result["n_records"]["test"]
    n_known = n // 4 * len(result["known_classes"])
    # of the Mann-Whitney statistic if nothing differs
    deviation = np.sqrt((n + 1) / (12 * n_known * (n - n_known)))

    for name, method in result["methods"].items():
        assert abs(method["auroc"]["mean"] - 0.5) < 3.5 * deviation < 0.4, name


@pytest.fixture
def labelled():
    """Function that gives the result of scores, novel records, task and test records."""
    task, _ = study_of(OpenDataset(n_units=16))
    record = np.unique(subset_segments(task, "healthy_only", "test").record)
    novel = task.labels()[record] > 0
    same = {
        "protocol": "healthy_only",
        "method": "m",
        "detail": "",
        "record": record,
        "parts": {
            "validation": Rows(
                record=np.arange(40), answers=np.linspace(0, 1, 40)[:, None]
            )
        },
    }

    def judge(*scores, **further):
        runs = [
            Prediction(seed=seed, answers=score[:, None], further=further, **same)
            for seed, score in enumerate(scores)
        ]
        return novelty_result(
            task,
            runs,
            [0],
            100,
            np.random.default_rng(0),
        )

    return judge, novel, task, record


def test_perfect_and_empty_scores(labelled):
    judge, novel, _, record = labelled
    perfect = judge(novel * 5.0, known_classes=record)
    assert perfect["auroc"]["low"] == perfect["auroc"]["mean"] == 1
    assert perfect["false_alarms"]["mean"] == perfect["fpr95"]["mean"] == 0
    for found in perfect["found"].values():
        assert found["mean"] == found["high"] == 1
        assert 0.2 < found["low"] < 1  # exact, of few machines

    empty = judge(
        np.zeros(novel.size),
        known_classes=record,
    )
    assert {empty["auroc"][key] for key in ("mean", "low", "high")} == {0.5}
    assert empty["fpr95"]["mean"] == 1
    assert "fpr95" not in judge(np.zeros(novel.size))


def test_units_that_are_copies_leave_nothing_to_resample(labelled):
    judge, novel, task, record = labelled
    units = np.asarray(task.dataset.column("unit_id"))[record]
    copies = [np.arange(np.sum(units == unit)) ** 2 % 5.0 for unit in np.unique(units)]
    score = np.concatenate(copies)
    area = judge(score)["auroc"]

    assert 0 < area["mean"] < 1
    assert_allclose(
        [area["low"], area["high"]],
        [area["mean"]] * 2,
    )

    uneven = judge(score + (units == units[0]) * np.where(novel, 3, 0))["auroc"]
    assert uneven["low"] < uneven["mean"] < uneven["high"]


def test_interval_covers_the_seeds(labelled):
    judge, novel, _, _ = labelled
    area = judge(novel * 1.0, np.zeros(novel.size))["auroc"]
    assert area["per_seed"] == (1.0, 0.5)
    assert (area["low"], area["high"]) == (0.5, 1.0)


@pytest.mark.parametrize(
    "n",
    [19, 20, 21, 58, 400],
)
def test_new_known_records_raise_no_more_alarms_than_promised(n):
    rng = default_rng(n)
    thresholds = [alarm_threshold(rng.standard_normal(n))[0] for _ in range(2000)]
    shares = norm.sf(thresholds)
    assert 0.05 - 1 / (n + 1) < np.mean(shares) < 0.05 + 4 * np.std(shares) / 44


def test_too_few_records_give_their_largest_score():
    assert alarm_threshold(np.arange(5.0)) == 4
    assert alarm_threshold(np.arange(100.0)) == 95


@pytest.mark.parametrize(
    "shift",
    [0.0, 1.0, 3.0],
)
def test_false_positive_rate_of_two_normal_scores(shift):
    rng = default_rng(1)
    novel = np.arange(40000) % 2 == 1
    score = rng.standard_normal(novel.size) + shift * novel
    expected = norm.cdf(norm.ppf(0.95) - shift)

    assert false_positive_rate_95(novel, score) == pytest.approx(expected, abs=0.01)

    weight = np.where(
        novel,
        1.0,
        np.where(score > 0, 0.0, 1.0),
    )
    assert false_positive_rate_95(novel, score, weight) < expected


@pytest.fixture(scope="module")
def open_study():
    """Task and settings of a short study."""
    return study_of(OpenDataset(), BOTH, "epochs=3", *TINY_CNN)


def test_features_and_outputs_are_those_of_the_last_layer(open_study):
    task, settings = open_study
    train_set, validation = windows_of(task, "train", "validation")
    options = {
        "target": Classes(n_classes=4),
        "settings": settings,
        "seed": 0,
    }
    model = train_network(train_set, validation, **options).model
    every = np.arange(len(validation))
    features, logits = network_outputs(model, validation, every)
    layer = model.head[-1]
    weight, bias = (part.detach().numpy() for part in (layer.weight, layer.bias))

    assert_allclose(
        logits,
        features @ weight.T + bias,
        rtol=1e-4,
        atol=1e-5,
    )

    scaled = log_softmax(logits, axis=1)
    expected = predict_windows(model, validation)
    assert_allclose(expected, scaled, rtol=1e-4, atol=1e-5)


def test_scores_of_a_classifier_are_those_of_its_probabilities_and_outputs(
    open_study, monkeypatch
):
    """Doubt is 1 - the largest calibrated probability, energy -log of the sum of exponents."""
    task, settings = open_study
    trainings = []

    def remembered(*parts, **options):
        trainings.append(train_network(*parts, **options))
        return trainings[-1]

    monkeypatch.setattr(novelty, "train_network", remembered)
    sets = dict(zip(SUBSETS, windows_of(task, *SUBSETS), strict=True))
    runs = {run.method: run for run in trained_runs(settings, "open_set", 0, sets)}
    (training,) = trainings
    test = sets["test"]
    doubt, energy = [], []
    _, logits = network_outputs(training.model, test, np.arange(len(test)))
    for record in runs["energy"].record:
        of_record = logits[test.record == record]
        mean = log_softmax(of_record, axis=1).mean(axis=0)
        probability = softmax(mean / training.temperature)
        doubt.append(1.0 - probability.max())
        energy.append(-logsumexp(of_record, axis=1).mean())

    assert np.ptp(doubt) > 1e-3
    assert_allclose(runs["largest_probability"].answers[:, 0], doubt, atol=1e-5)
    assert_allclose(runs["energy"].answers[:, 0], energy, rtol=1e-4)


@pytest.mark.parametrize(
    "window",
    [128, 1200, 6400],
)
def test_the_autoencoder_answers_for_every_whole_step(window):
    model = WindowAutoencoder([1.0, 2.0]).eval()
    windows = torch.randn(3, 2, window)
    assert model(windows).shape == (3, window // 128 * 128)
    assert torch.isfinite(model(torch.zeros(1, 2, window))).all()

    doubled = WindowAutoencoder([2.0, 4.0]).eval()
    doubled.load_state_dict({**model.state_dict(), "scale": 2 * model.scale})
    torch.testing.assert_close(
        doubled(2 * windows),
        model(windows),
    )


@pytest.fixture(scope="module")
def healthy(open_study):
    """Healthy training and validation windows."""
    return windows_of(open_study[0], "train", "validation", protocol="healthy_only")


def test_the_autoencoder_is_the_same_for_the_same_seed(healthy, open_study):
    validation, settings = healthy[1], open_study[1]
    state = torch.random.get_rng_state()
    first, second, other = (
        fit_autoencoder(*healthy, settings=settings, seed=seed)[0] for seed in (1, 1, 2)
    )

    assert torch.equal(state, torch.random.get_rng_state())

    error = reconstruction_error(first, validation)
    assert_array_equal(error, reconstruction_error(second, validation))

    few = reconstruction_error(first, validation, batch_size=3)
    assert_allclose(error, few, rtol=1e-4)
    assert not np.array_equal(error, reconstruction_error(other, validation))


@pytest.fixture
def fit_with(healthy, open_study, monkeypatch):
    """Function that fits an autoencoder whose epochs have given errors on the validation."""

    def fit(errors, patience):
        given = iter(errors)
        monkeypatch.setattr(
            autoencoder, "_errors", lambda *_: torch.full((1, 1), next(given))
        )
        changes = {"epochs": len(errors), "patience": patience}
        settings = dataclasses.replace(open_study[1], **changes)
        return fit_autoencoder(*healthy, settings=settings, seed=0)

    return fit


@pytest.mark.parametrize(("patience", "kept"), [(1, 1), (0, 3)])
def test_without_patience_the_autoencoder_runs_every_epoch(patience, kept, fit_with):
    assert fit_with([1.0, 2.0, 3.0], patience)[1] == kept


def test_an_autoencoder_that_diverges_at_its_end_is_refused_without_patience(fit_with):
    with pytest.raises(SimulationError, match="diverged before its last epoch"):
        fit_with([1.0, np.nan], patience=0)


def test_the_autoencoder_learns_and_shows_a_moment_that_it_cannot_rebuild(
    healthy, open_study
):
    _, validation = healthy
    windows = torch.from_numpy(validation.cut(np.arange(9)))
    short, long = (
        fit_autoencoder(
            *healthy,
            settings=dataclasses.replace(open_study[1], epochs=n, patience=30),
            seed=0,
        )[0]
        for n in (1, 30)
    )
    few, many = (part(windows).mean().item() for part in (short, long))

    assert many < 0.7 * few

    signals = tuple(signal.copy() for signal in validation.signals)
    for signal in signals:
        signal[:, 1100:1164] += 3 * np.sin(np.arange(64))
    burst = dataclasses.replace(validation, signals=signals)
    ratio = reconstruction_error(long, burst) / reconstruction_error(long, validation)
    whole = validation.start <= 1000  # windows that hold the whole burst
    assert (ratio[whole] > 1.5).all()


def test_two_processes_give_the_results_of_one(open_study):
    """Of all kinds of jobs: novelty with and without a network, classes, shuffled labels."""
    task, settings = open_study
    settings = dataclasses.replace(settings, epochs=1)
    kinds = [
        ("healthy_only", None, False),
        ("healthy_only", 3, False),
        ("open_set", 3, False),
        ("by_unit", 5, False),
        ("by_unit", 5, True),
    ]
    jobs = [
        Job(protocols=(protocol,), seed=seed, shuffled=shuffled)
        for protocol, seed, shuffled in kinds
    ]
    serial, parallel = (run(task, settings, *jobs, n_workers=n) for n in (1, 2))

    assert sum(result.protocol != "by_unit" for result in serial) == 9
    for first, second in zip(serial, parallel, strict=True):
        np.testing.assert_equal(*map(dataclasses.asdict, (first, second)))


REFUSED = [
    ("healthy_only window_samples=100", "at least 128"),
    ("open_set classes=[healthy,crack,pitting]", "it needs known and new ones"),
    ("open_set classes=[healthy,missing_tooth]", "one known class only"),
    ("healthy_only classes=[crack,pitting]", "its train part is empty"),
]


@pytest.mark.parametrize(("typed", "message"), REFUSED)
def test_studies_without_known_or_new_classes_are_refused(typed, message):
    protocol, word = typed.split()
    words = [*TINY_CNN, f"protocols=[{protocol}]", word]
    with refused(message):
        plan_of(*study_of(OpenDataset(), *words))


def test_the_command_reports_novelty_alone(tmp_path, capsys):
    metrics = train(OpenDataset(), tmp_path, "epochs=1", BOTH)
    assert "**healthy_only**: Trained on" in capsys.readouterr().out
    assert metrics["protocols"] == {}
    assert list(metrics["novelty"]) == ["healthy_only", "open_set"]

    page = (tmp_path / "report.html").read_text()
    heads = ("FPR95", "false alarms", "missing_tooth found")
    for text in (
        "noticed by who knows health alone (healthy_only)",
        "</th>".join(f'<th scope="col">{head}' for head in heads),
        "Balanced accuracy of the network on the known classes",
        "healthy_only: only 3 machines in the test part",
        "Caveats",
        "<b>AUROC of energy</b>: against healthy ",
        "validation record(s); with fewer than 19",
    ):
        assert text in page, text
    assert not any(text in page for text in ("LEAKY", "In short", "nan ["))

    path = tmp_path / "novelty.csv"
    head = "protocol,method,seed,record_id,unit_id,label,score,threshold"
    assert path.read_text().startswith(f"{head}\n")

    found = [
        float(row["score"]) > float(row["threshold"])
        for row in rows_of(path)
        if row["protocol"] == "healthy_only"
        and row["method"] == "autoencoder"
        and row["label"] == "missing_tooth"
    ]
    method = metrics["novelty"]["healthy_only"]["methods"]["autoencoder"]
    share = method["found"]["missing_tooth"]["mean"]
    assert_allclose(np.mean(found), share)


def test_null_runs_all_protocols_and_both_kinds_share_a_report(tmp_path):
    words = ["protocols=null", "shuffle_control=false", "baselines=[rms_threshold]"]
    metrics = train(
        OpenDataset(n_channels=2, records_per_unit=4), tmp_path, "epochs=1", *words
    )
    assert list(metrics["protocols"]) == ["by_unit", "cross_sensor"]
    assert list(metrics["novelty"]) == ["healthy_only", "open_set"]

    page = (tmp_path / "report.html").read_text()
    assert "Which faults are found" in page
    assert "never trained on (open_set)" in page
    assert "trained on channel_0, tested on channel_1" in page
