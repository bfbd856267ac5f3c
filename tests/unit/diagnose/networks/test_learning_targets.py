"""Laws of both learning targets: loss of right answers, one training loop, one entry at each door."""

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from fake_lives import FakeLives

from diagnose.commands.train import STUDIES
from diagnose.data.windows import load_windows, subset_segments
from diagnose.recordings.registry import STORED
from diagnose.settings import TASKS, settings_from
from diagnose.studies.study import task_from
from diagnose.training.classes import Classes
from diagnose.training.remaining_life import RemainingLife
from diagnose.training.train import train_network
from gensig.options.compose import compose

QUICK = [
    "window_samples=1200", "stride_samples=1000", "seeds=[0]", "epochs=2", "epoch_fraction=0.3",
    "model.widths=[6,8]", "model.kernels=[32,5]", "model.strides=[8,4]",
]  # fmt: skip


def classes(dataset):
    return Classes(n_classes=len(dataset.class_names))


def remaining_life(dataset):
    remaining = np.minimum(dataset.column("remaining_life_h"), 100.0)
    return RemainingLife(
        conditions=dataset.column("torque_nm")[:, None],
        share=remaining / 100.0,
        weight=np.ones(dataset.n_records),
    )


CASES = {
    "classes": (lambda: FakeDataset(duration=0.2), classes),
    "remaining_life": (lambda: FakeLives(n_lives=8, duration=0.2), remaining_life),
}


@pytest.fixture(params=CASES)
def case(request):
    """Target, training and validation windows, and settings."""
    torch.set_num_threads(1)
    make, target_of = CASES[request.param]
    dataset = make()
    words = ["data=x", "out=y", f"task={request.param}", *QUICK]
    settings = settings_from(compose("train", words))
    task = task_from(dataset, settings)
    parts = ("train", "validation")
    sets = [
        load_windows(task, subset_segments(task, "by_unit", part)) for part in parts
    ]
    return target_of(dataset), *sets, settings


def perfect(target, windows):
    """Answers of windows that are all right."""
    if isinstance(target, RemainingLife):
        return target.share[windows.record][:, None]
    return np.where(np.eye(target.n_classes, dtype=bool)[windows.label], 0.0, -50.0)


def test_every_task_has_a_study_and_a_stored_network():
    assert set(TASKS) == set(CASES) == set(STUDIES) == set(STORED)


def test_right_answers_have_no_loss_and_the_reverse_have_one(case):
    target, _, validation, _ = case
    right = perfect(target, validation)
    assert target.record_loss(right, validation) == pytest.approx(0.0, abs=1e-9)
    assert target.record_loss(right[::-1], validation) > 0.1


def test_the_loss_of_a_record_does_not_depend_on_the_order_of_its_windows(case):
    target, _, validation, _ = case
    rng = np.random.default_rng(0)
    answers = perfect(target, validation) + 0.1 * rng.standard_normal(
        (len(validation), 1)
    )
    same = [np.flatnonzero(validation.record == record) for record in validation.record]
    turned = answers[[mine[::-1][list(mine).index(i)] for i, mine in enumerate(same)]]
    expected = target.record_loss(answers, validation)
    assert target.record_loss(turned, validation) == pytest.approx(expected, rel=1e-12)


def test_a_training_is_that_of_its_seed_and_returns_its_best_epoch(case):
    target, train, validation, settings = case
    first, again, other = (
        train_network(train, validation, target=target, settings=settings, seed=seed)
        for seed in (0, 0, 1)
    )
    weights = first.weights()
    assert all(np.array_equal(weights[name], again.weights()[name]) for name in weights)
    assert any(
        not np.array_equal(weights[name], other.weights()[name]) for name in weights
    )
    signals = torch.from_numpy(validation.cut(np.arange(len(validation))))
    answers = target.answers(first.model, signals, validation)
    loss = target.record_loss(answers, validation)
    assert (
        loss
        == first.validation_loss[first.best_epoch - 1]
        == min(first.validation_loss)
    )
