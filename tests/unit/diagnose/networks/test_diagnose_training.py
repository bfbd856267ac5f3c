"""Training learns what is there, nothing that is not, and the same for the same seed."""

import dataclasses

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset

from diagnose.data.windows import load_windows, subset_segments
from diagnose.networks.registry import build_model
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import plan_study, score_predictions, task_from
from diagnose.training.classes import Classes, with_shuffled_labels
from diagnose.training.train import train_network
from gensig.errors import ConfigError
from gensig.options.compose import compose

SMALL = [
    "epoch_fraction=0.6",
    "window_samples=1200",
    "stride_samples=1000",
    "epochs=8",
    "seeds=[0]",
    "n_bootstrap=300",
    "n_threads=1",
]
MODEL = [
    "model.widths=[12,24]",
    "model.kernels=[32,5]",
    "model.strides=[8,4]",
    "learning_rate=0.01",
]


def make_settings(*overrides):
    return settings_from(
        compose("train", ["data=x", "out=y", *SMALL, *MODEL, *overrides])
    )


@pytest.fixture(scope="module")
def study():
    """One fault that shows, learnt for real and with shuffled labels."""
    torch.set_num_threads(1)
    dataset = FakeDataset(
        n_units=16,
        records_per_unit=8,
        classes=("healthy", "missing_tooth"),
        duration=0.3,
        noise=0.4,
        seed=1,
    )
    settings = make_settings("protocols=[by_unit]", "baselines=false")
    task = task_from(dataset, settings)
    jobs = [Job(protocols=("by_unit",), seed=0)]
    jobs += [Job(protocols=("by_unit",), seed=seed, shuffled=True) for seed in range(3)]
    return (
        task,
        settings,
        run_jobs(task, settings, jobs, n_workers=1, on_done=lambda _: None),
    )


def score(study, method):
    task, settings, predictions = study
    runs = [(p.record, p.predicted) for p in predictions if p.method == method]
    scores = score_predictions(
        task, runs, settings.n_bootstrap, shuffled=method == "label_shuffle"
    )
    return scores["balanced_accuracy"]


def test_a_visible_fault_is_learnt_above_chance(study):
    assert score(study, "cnn")["low"] > 0.6


def test_shuffled_labels_stay_at_chance_within_their_interval(study):
    result = score(study, "label_shuffle")
    assert result["low"] <= 0.5 <= result["high"]


def test_same_seed_same_weights_and_another_seed_others(study):
    task = study[0]
    settings = make_settings("epochs=2")
    sets = [
        load_windows(task, subset_segments(task, "by_unit", name))
        for name in ("train", "validation")
    ]

    def weights(seed):
        model = train_network(
            *sets, target=Classes(n_classes=2), settings=settings, seed=seed
        ).model
        return torch.cat(
            [value.flatten().double() for value in model.state_dict().values()]
        )

    before = torch.random.get_rng_state()
    first = weights(3)
    assert torch.equal(before, torch.random.get_rng_state())
    torch.rand(5)
    assert torch.equal(first, weights(3))
    assert not torch.equal(first, weights(4))


def test_two_processes_give_what_one_gives(study):
    task, _, _ = study
    settings = make_settings("epochs=2")
    jobs = [
        Job(protocols=("by_unit",), seed=5),
        Job(protocols=("by_unit",), seed=6, shuffled=True),
    ]
    one, two = (
        run_jobs(task, settings, jobs, n_workers=n, on_done=lambda _: None)
        for n in (1, 2)
    )
    assert [p.method for p in one] == [p.method for p in two]
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.predicted, b.predicted)
        assert a.validation_loss == b.validation_loss


def test_early_stopping_keeps_the_best_epoch(study):
    _, settings, predictions = study
    losses = predictions[0].validation_loss
    assert predictions[0].best_epoch == int(np.argmin(losses)) + 1
    assert len(losses) <= settings.epochs


def test_shuffled_labels_tell_nothing_and_keep_records_whole(study):
    task, _, _ = study
    windows = load_windows(task, subset_segments(task, "by_unit", "train"))
    shuffled = with_shuffled_labels(windows, 2, np.random.default_rng(0))
    for record in np.unique(windows.record):
        assert np.unique(shuffled.label[windows.record == record]).size == 1
    for label in (0, 1):
        assert abs(shuffled.label[windows.label == label].mean() - 0.5) < 0.05
    assert not np.array_equal(shuffled.label, windows.label)


def test_the_default_network_is_small():
    config = compose("train", ["data=x", "out=y"])
    model = build_model(config["model"], n_channels=4, n_classes=4)
    assert sum(parameter.numel() for parameter in model.parameters()) < 100_000
    assert model(torch.zeros(2, 4, 6400)).shape == (2, 4)


def test_leaky_protocols_come_last_and_every_job_is_there():
    settings = make_settings("seeds=[0,1]")
    dataset = FakeDataset(n_units=8, records_per_unit=8, duration=0.5)
    dataset.protocols = ("random_window_leaky", "by_unit")
    protocols, jobs = plan_study(task_from(dataset, settings), settings)
    assert protocols == ("by_unit", "random_window_leaky")
    assert len(jobs) == 1 + 2 * (2 + 1) + 1
    assert jobs[-1].protocols == ("by_unit",)  # controls are for clean protocols alone


def test_a_part_with_one_class_is_refused():
    settings = make_settings("protocols=[by_unit]")
    dataset = FakeDataset(n_units=8, records_per_unit=8, duration=0.5)
    dataset.usable[48:] = dataset.columns["label"][48:] == 1
    with pytest.raises(ConfigError, match=r"one class only in its test part \(crack\)"):
        plan_study(task_from(dataset, settings), settings)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("epochs=0", "epochs must be a whole number of at least 1"),
        ("seeds=[]", "seeds must be a list"),
        ("seeds=[1,1]", "seeds must be a list of different"),
        ("epoch_fraction=2", "epoch_fraction must be a number from 0 to 1"),
        ("learning_rate=high", "learning_rate must be a number"),
        ("+extra=1", "knows no key 'extra'"),
        ("shuffle_control=3", "must be true or false"),
    ],
)
def test_settings_refuse(override, message):
    with pytest.raises(ConfigError, match=message):
        make_settings(override)


def test_models_refuse():
    settings = make_settings()
    for change, message in (
        ({"kind": "huge"}, "no model kind 'huge'"),
        ({"widths": [4]}, "same length"),
    ):
        with pytest.raises(ConfigError, match=message):
            build_model({**settings.model, **change}, n_channels=1, n_classes=2)
    with pytest.raises(ConfigError, match="unexpected keyword"):
        build_model({**settings.model, "depth": 3}, n_channels=1, n_classes=2)
    assert dataclasses.is_dataclass(settings)
