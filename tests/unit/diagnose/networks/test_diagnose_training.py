"""Training finds a visible fault, and nothing with shuffled labels."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from small_studies import LEARNS, plan_of, run, study_of, windows_of

from diagnose.studies.controls import method_result
from diagnose.studies.jobs import Job
from diagnose.training.classes import with_shuffled_labels
from diagnose.training.train import _Descent
from gensig.errors import ConfigError

MODEL = [
    "model=cnn",
    "model.widths=[12,24]",
    "model.kernels=[32,5]",
    "model.strides=[8,4]",
]
BY_UNIT = ("by_unit",)


@pytest.fixture(scope="module")
def study():
    """A visible fault, learnt with its labels and with shuffled ones."""
    classes = ("healthy", "missing_tooth")
    dataset = FakeDataset(n_units=16, classes=classes, duration=0.3, noise=0.4, seed=1)
    task, settings = study_of(dataset, *LEARNS, *MODEL, "n_bootstrap=300")
    shuffled = [Job(protocols=BY_UNIT, seed=seed, shuffled=True) for seed in range(3)]
    jobs = [Job(protocols=BY_UNIT, seed=0), *shuffled]
    return task, settings, run(task, settings, *jobs)


def score(study, method):
    task, settings, predictions = study
    runs = [each for each in predictions if each.method == method]
    return method_result(task, settings, runs)["balanced_accuracy"]


def test_a_visible_fault_is_learnt_above_chance(study):
    assert score(study, "cnn")["low"] > 0.6


def test_shuffled_labels_stay_at_chance_within_their_interval(study):
    result = score(study, "label_shuffle")
    assert result["low"] <= 0.5 <= result["high"]


def test_the_shuffle_judges_a_network_that_learnt_its_labels(study):
    """All epochs run; a network of the first ones would name one class and could show no leak."""
    _, settings, predictions = study
    for trained in predictions:
        if trained.method == "label_shuffle":
            assert trained.best_epoch == len(trained.validation_loss) == settings.epochs
            assert np.unique(trained.predicted).size == 2


def test_shuffled_labels_say_nothing_and_keep_records_whole(study):
    (windows,) = windows_of(study[0], "train")
    shuffled = with_shuffled_labels(windows, 2, np.random.default_rng(0))
    for record in np.unique(windows.record):
        assert np.unique(shuffled.label[windows.record == record]).size == 1
    for label in (0, 1):
        assert abs(shuffled.label[windows.label == label].mean() - 0.5) < 0.05
    assert not np.array_equal(shuffled.label, windows.label)


def test_leaky_protocols_come_last_and_every_job_is_planned():
    dataset = FakeDataset(duration=0.5)
    dataset.protocols = ("random_window_leaky", "by_unit")
    both = "protocols=[random_window_leaky,by_unit]"
    plan = plan_of(*study_of(dataset, both, "seeds=[0,1]"))
    assert plan.protocols == ("by_unit", "random_window_leaky")
    assert len(plan.jobs) == 1 + 2 * (2 + 1) + 1
    assert plan.jobs[-1].protocols == BY_UNIT  # controls are for clean protocols alone


def test_a_part_with_one_class_is_refused():
    dataset = FakeDataset(duration=0.5)
    dataset.usable[48:] = dataset.columns["label"][48:] == 1
    with pytest.raises(ConfigError, match=r"one class only in its test part \(crack\)"):
        plan_of(*study_of(dataset))


def test_the_learning_rate_rises_for_15_percent_of_the_steps_and_falls_to_nothing():
    settings = SimpleNamespace(learning_rate=0.01, weight_decay=0.0)
    model = torch.nn.Linear(1, 1)
    descent = _Descent(model, settings, 1000)
    rates = []
    for _ in range(1000):
        rates.append(descent.optimizer.param_groups[0]["lr"])
        descent.step(model(torch.ones(1)).sum())

    assert_allclose(max(rates), 0.01)
    greatest = int(np.argmax(rates))
    assert abs(greatest - 150) <= 1
    assert (np.diff(rates[: greatest + 1]) > 0).all()
    assert (np.diff(rates[greatest:]) < 0).all()
    assert rates[-1] < 1e-6 * 0.01 + 1e-7
