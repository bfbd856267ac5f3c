"""Networks: shapes, invariances, schedules of a training, and refusals."""

import dataclasses

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from small_studies import LEARNS, plan_of, settings_of, study_of, windows_of
from torch.nn.functional import conv1d

from diagnose.networks.registry import build_model, check_example, input_of
from diagnose.networks.small_cnn import SmallCnn
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.train import device_of, train_network
from gensig.errors import ConfigError, SimulationError
from gensig.options.compose import compose

LONG_KERNEL = torch.ones(1, 1, 1024)


def make_model(name, n_channels=1, n_classes=4):
    torch.manual_seed(0)
    config = settings_of(f"model={name}").model
    return build_model(config, n_channels=n_channels, n_classes=n_classes).eval()


@pytest.fixture(scope="module")
def dataset():
    classes = ("healthy", "missing_tooth")
    return FakeDataset(n_units=16, classes=classes, duration=0.3, noise=0.4, seed=1)


def test_features_of_the_cnn_do_not_grow_with_the_window():
    """The mean features of a window are the means of those of its halves."""
    model = make_model("cnn")
    window = torch.from_numpy(np.random.default_rng(0).normal(size=(1, 1, 2**15)))
    halves = window.float().reshape(2, 1, -1)
    with torch.no_grad():
        whole, of_halves = model.look(window.float())[0][0], model.look(halves)[0]
    n = len(whole) // 2

    assert whole[:n].abs().max() > 0.01
    assert_allclose(whole[:n], of_halves[:, :n].mean(dim=0), rtol=0.02, atol=1e-3)


@pytest.mark.parametrize("shape", [(1, 1024), (4, 6400), (2, 5001)])
def test_scores_have_their_shape_for_any_window(shape):
    model = make_model("cnn", n_channels=shape[0])
    check_example(model, np.zeros((1, *shape), dtype=np.float32))
    assert model(torch.zeros(3, *shape)).shape == (3, 4)


def test_the_loss_counts_windows_by_the_weight_of_their_class():
    """Weighted mean of the negative logarithms of the probabilities of the true classes."""
    model = make_model("cnn", n_classes=3)
    windows, label = torch.randn(6, 1, 2048), torch.tensor([0, 0, 0, 0, 1, 2])
    weight = torch.tensor([0.5, 1.0, 4.0])
    with torch.no_grad():
        logarithm = torch.log_softmax(model(windows), dim=1)
        loss = model.loss(windows, label, {}, weight)
    missed = -logarithm[torch.arange(6), label]
    expected = (weight[label] * missed).sum() / weight[label].sum()
    torch.testing.assert_close(loss, expected)
    assert abs(loss - missed.mean()) > 1e-3


def test_a_window_too_short_for_the_network_is_refused_before_training(
    dataset, monkeypatch
):
    monkeypatch.setattr(SmallCnn, "look", lambda _, x: (conv1d(x, LONG_KERNEL), None))
    with pytest.raises(ConfigError, match="window_samples=1023 is too short"):
        check_example(make_model("cnn"), np.zeros((1, 1, 1023), dtype=np.float32))
    with pytest.raises(ConfigError, match="window_samples=500 is too short"):
        plan_of(*study_of(dataset, "model=cnn", "window_samples=500"))


def test_the_last_epoch_is_kept_with_the_best_one(dataset):
    """With wrong validation labels learning increases the loss, and an early epoch is the best."""
    task, settings = study_of(dataset, "model=cnn", *LEARNS, "epochs=5", "patience=5")
    train, validation = windows_of(task, "train", "validation")
    wrong = dataclasses.replace(validation, label=1 - validation.label)
    target = Classes(n_classes=2)

    def trained(held_out):
        return train_network(train, held_out, target=target, settings=settings, seed=0)

    training = trained(wrong)
    assert training.best_epoch < len(training.validation_loss)
    best, last = (
        target.record_loss(predict_windows(model, train), train)
        for model in (training.model, training.last_model)
    )
    assert last < 0.8 * best
    training = trained(validation)
    is_last = training.best_epoch == len(training.validation_loss)
    assert (training.last_model is None) == is_last


def test_without_patience_every_epoch_runs_and_the_last_weights_are_kept(dataset):
    """With wrong validation labels the loss rises, so that early stopping would end at once."""
    task, settings = study_of(dataset, "model=cnn", *LEARNS, "epochs=5", "patience=1")
    train, validation = windows_of(task, "train", "validation")
    wrong = dataclasses.replace(validation, label=1 - validation.label)
    stopped, whole = (
        train_network(
            train,
            wrong,
            target=Classes(n_classes=2),
            settings=dataclasses.replace(settings, patience=patience),
            seed=0,
        )
        for patience in (1, 0)
    )
    assert len(stopped.validation_loss) < 5
    assert whole.best_epoch == len(whole.validation_loss) == 5
    assert whole.last_model is None
    assert whole.validation_loss[-1] > min(whole.validation_loss)


def test_a_last_epoch_that_diverges_is_refused_without_patience(dataset, monkeypatch):
    task, settings = study_of(dataset, "model=cnn", *LEARNS, "epochs=2", "patience=0")
    train, validation = windows_of(task, "train", "validation")
    losses = iter([0.5, np.nan])
    monkeypatch.setattr(Classes, "record_loss", lambda *_: next(losses))
    with pytest.raises(SimulationError, match="diverged before its last epoch; reduce"):
        train_network(
            train,
            validation,
            target=Classes(n_classes=2),
            settings=settings,
            seed=0,
        )


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("cnn", {"kind": "huge"}, "no model kind 'huge'"),
        ("cnn", {"widths": [4]}, "same length"),
        ("cnn", {"depth": 3}, "unexpected keyword"),
        ("order", {"gears": ["sun"]}, "gears must be a list out of pinion, wheel"),
        ("order", {"gears": []}, "gears must be a list"),
        ("order", {"kernels": [16, 5, 5]}, "kernels must be odd"),
        ("order", {"widths": [8]}, "lists of the same length"),
        ("cnn", {"heads": ["tooth"]}, "no head 'tooth'; there is severity, gear"),
    ],
)
def test_networks_refuse(name, changes, message):
    config = {**settings_of(f"model={name}").model, **changes}
    if name == "order":
        config["n_teeth"] = [23, 84]
    with pytest.raises(ConfigError, match=message):
        build_model(config, n_channels=1, n_classes=2)


def test_the_default_network_is_small():
    config = compose("train", ["data=x", "out=y"]).section("model")
    model = build_model(config, n_channels=4, n_classes=4)
    assert sum(parameter.numel() for parameter in model.parameters()) < 100_000
    example = torch.from_numpy(input_of(config).example(4, 1))
    assert model(example).shape == (1, 4)


@pytest.mark.parametrize("present", [False, True])
def test_a_device_that_does_not_exist_is_refused(present, monkeypatch, dataset):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: present)
    assert device_of("auto") == torch.device("cuda" if present else "cpu")
    assert device_of("cpu") == torch.device("cpu")
    if not present:
        with pytest.raises(ConfigError, match="device=cuda: torch finds no GPU here"):
            plan_of(*study_of(dataset, "device=cuda"))
