"""Laws of both learning targets: loss of right answers, one training loop, one registry entry."""

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from fake_lives import FakeLives
from small_studies import TINY_CNN, study_of, windows_of

from diagnose.recordings.registry import TARGETS
from diagnose.settings import TASKS
from diagnose.training.classes import Classes
from diagnose.training.remaining_life import RemainingLife
from diagnose.training.train import train_network


def classes(dataset):
    return Classes(n_classes=len(dataset.class_names))


def remaining_life(dataset):
    return RemainingLife(
        conditions=dataset.column("torque_nm")[:, None],
        share=np.minimum(dataset.column("remaining_life_h"), 100.0) / 100.0,
        weight=np.ones(dataset.n_records),
    )


CASES = {
    "classes": (FakeDataset(duration=0.2), classes),
    "remaining_life": (FakeLives(n_lives=8, duration=0.2), remaining_life),
}


@pytest.fixture(params=CASES)
def case(request):
    """Target, training and validation windows, and settings."""
    dataset, target_of = CASES[request.param]
    words = [f"task={request.param}", "epochs=2", "epoch_fraction=0.3", *TINY_CNN]
    task, settings = study_of(dataset, *words)
    return target_of(dataset), *windows_of(task, "train", "validation"), settings


def perfect(target, windows):
    """Answers of windows that are all right."""
    if isinstance(target, RemainingLife):
        return target.share[windows.record][:, None]
    return np.where(np.eye(target.n_classes, dtype=bool)[windows.label], 0.0, -50.0)


def test_every_task_has_a_study_a_report_and_a_stored_network():
    assert set(TASKS) == set(CASES) == set(TARGETS)


def test_right_answers_have_no_loss_and_the_reverse_have_one(case):
    target, _, validation, _ = case
    right = perfect(target, validation)
    assert target.record_loss(right, validation) == pytest.approx(0.0, abs=1e-9)
    assert target.record_loss(right[::-1], validation) > 0.1


def test_the_loss_of_a_record_does_not_depend_on_the_order_of_its_windows(case):
    target, _, validation, _ = case
    noise = np.random.default_rng(0).standard_normal((len(validation), 1))
    answers = perfect(target, validation) + 0.1 * noise
    reversed_answers = np.empty_like(answers)
    for record in np.unique(validation.record):
        of_record = np.flatnonzero(validation.record == record)
        reversed_answers[of_record] = answers[of_record[::-1]]
    expected = target.record_loss(answers, validation)
    loss = target.record_loss(reversed_answers, validation)
    assert loss == pytest.approx(expected, rel=1e-12)


def test_a_training_depends_on_its_seed_alone_and_returns_its_best_epoch(case):
    target, train, validation, settings = case
    state = torch.random.get_rng_state()
    first, second, other = (
        train_network(train, validation, target=target, settings=settings, seed=seed)
        for seed in (0, 0, 1)
    )
    assert torch.equal(state, torch.random.get_rng_state())
    weights = first.weights()
    assert all(np.array_equal(weights[k], second.weights()[k]) for k in weights)
    assert any(not np.array_equal(weights[k], other.weights()[k]) for k in weights)
    signals = torch.from_numpy(validation.cut(np.arange(len(validation))))
    answers = target.answers(first.model, signals, validation)
    losses = first.validation_loss
    assert target.record_loss(answers, validation) == losses[first.best_epoch - 1]
    assert losses[first.best_epoch - 1] == min(losses)
