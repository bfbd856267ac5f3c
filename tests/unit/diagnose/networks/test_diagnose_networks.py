"""Every network: sizes as published, what it must be blind to, what it learns, and its way to disk and back."""

import dataclasses
import json

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose

from diagnose.data.windows import load_windows, subset_segments
from diagnose.networks.registry import build_model, check_window
from diagnose.networks.spectrum import log_spectrum
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import plan_study, task_from
from diagnose.training.classes import Classes, predict_windows
from diagnose.training.store import load_model, model_description, save_model
from diagnose.training.train import device_of, train_network
from gensig.errors import ConfigError, DatasetError
from gensig.options.compose import compose

NAMES = ("cnn", "wdcnn", "spectrum")


def make_settings(*overrides):
    few = [
        "window_samples=1200",
        "stride_samples=1000",
        "seeds=[0]",
        "n_threads=1",
        "n_bootstrap=100",
    ]
    return settings_from(compose("train", ["data=x", "out=y", *few, *overrides]))


def make_model(name, n_channels=1, n_classes=4):
    torch.manual_seed(0)
    return build_model(
        make_settings(f"model={name}").model, n_channels=n_channels, n_classes=n_classes
    ).eval()


@pytest.fixture(scope="module")
def task():
    torch.set_num_threads(1)
    dataset = FakeDataset(
        n_units=16,
        records_per_unit=8,
        classes=("healthy", "missing_tooth"),
        duration=0.3,
        noise=0.4,
        seed=1,
    )
    return task_from(dataset, make_settings())


def test_wdcnn_has_the_published_sizes():
    """Table 2 of Zhang et al. (2017), and the weights that follow from it for one channel and ten classes."""
    model = make_model("wdcnn", n_classes=10)
    x, maps = torch.randn(2, 1, 2048), []
    for layer in model.blocks:
        x = layer(x)
        if isinstance(layer, torch.nn.Conv1d | torch.nn.MaxPool1d):
            maps.append((x.shape[2], x.shape[1]))
    assert maps == [
        (128, 16), (64, 16), (64, 32), (32, 32), (32, 64), (16, 64), (16, 64), (8, 64), (6, 64), (3, 64),
    ]  # fmt: skip
    torch.testing.assert_close(model.hidden[0](x), x, rtol=0, atol=0)
    convolutions = (
        (64 * 1 + 1) * 16
        + (3 * 16 + 1) * 32
        + (3 * 32 + 1) * 64
        + 2 * (3 * 64 + 1) * 64
    )
    normalisations = 2 * (16 + 32 + 3 * 64 + 100)
    expected = convolutions + normalisations + (3 * 64 + 1) * 100 + 101 * 10
    assert sum(parameter.numel() for parameter in model.parameters()) == expected


@pytest.mark.parametrize("name", NAMES)
def test_scores_have_their_shape_for_any_window(name):
    for n_channels, n_samples in ((1, 1024), (4, 6400), (2, 5001)):
        model = make_model(name, n_channels=n_channels)
        check_window(model, n_channels, n_samples)
        assert model(torch.zeros(3, n_channels, n_samples)).shape == (3, 4)


def test_a_window_too_short_for_the_network_is_refused_before_training(task):
    with pytest.raises(ConfigError, match="window_samples=1023 is too short"):
        check_window(make_model("wdcnn"), 1, 1023)
    settings = make_settings("model=wdcnn", "window_samples=500", "protocols=[by_unit]")
    with pytest.raises(ConfigError, match="window_samples=500 is too short"):
        plan_study(task_from(task.dataset, settings), settings)


def test_spectrum_of_noise_and_of_a_tone_in_closed_form():
    noise = np.random.default_rng(0).standard_normal((200, 1000))
    magnitude = torch.exp(log_spectrum(torch.from_numpy(noise), 1e-9)).numpy()
    assert_allclose(np.mean(magnitude[:, 5:-5] ** 2), 1.0, rtol=0.02)
    tone = np.sqrt(2) * np.sin(2 * np.pi * 100 * np.arange(1000) / 1000)
    spectrum = torch.exp(log_spectrum(torch.from_numpy(tone), 1e-9)).numpy()
    assert spectrum.argmax() == 100
    # amplitude sqrt(2) times n/4, half the sum of the taper, over the root of its sum of squares 3n/8
    assert_allclose(spectrum[100], np.sqrt(2) * 250 / np.sqrt(375), rtol=1e-6)
    silent = log_spectrum(torch.zeros(2, 1000), 0.01)
    assert_allclose(silent, np.log(0.01), rtol=1e-6)


def test_spectrum_network_is_blind_to_sign_and_gain_and_the_others_are_not():
    x = torch.randn(4, 2, 2048, generator=torch.Generator().manual_seed(0))
    for name in NAMES:
        model = make_model(name, n_channels=2)
        if name == "spectrum":
            model.floor = 1e-7
        for changed in (-x, 5 * x):
            same = torch.allclose(model(x), model(changed), rtol=1e-3, atol=1e-3)
            assert same == (name == "spectrum"), name


@pytest.mark.parametrize("name", ["wdcnn", "spectrum"])
def test_a_visible_fault_is_learnt_and_what_was_learnt_can_be_stored(
    name, task, tmp_path
):
    settings = make_settings(
        f"model={name}",
        "epochs=8",
        "epoch_fraction=0.6",
        "learning_rate=0.01",
        "protocols=[by_unit]",
    )
    (found,) = run_jobs(
        task,
        settings,
        [Job(protocols=("by_unit",), seed=0)],
        n_workers=1,
        on_done=lambda _: None,
    )
    label = task.labels()[found.record]
    assert (
        balanced_accuracy(
            confusion_by_unit(label, found.predicted, np.zeros_like(label), 2)[0]
        )
        > 0.8
    )
    assert len(found.validation_loss) <= 8
    assert 0.02 < found.temperature < 50
    save_model(tmp_path / "m", found.weights, model_description(task, settings, found))
    model, description = load_model(tmp_path / "m")
    assert description.temperature == found.temperature
    windows = load_windows(task, subset_segments(task, "by_unit", "test"))
    first = torch.from_numpy(
        windows.cut(np.flatnonzero(windows.record == found.record[0]))
    )
    with torch.inference_mode():
        mean = torch.log_softmax(model(first), dim=1).mean(dim=0).numpy()
    assert_allclose(mean, found.log_probability[0], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_same_seed_same_weights(name, task):
    settings = make_settings(f"model={name}", "epochs=1", "epoch_fraction=0.2")
    sets = [
        load_windows(task, subset_segments(task, "by_unit", part))
        for part in ("train", "validation")
    ]

    def weights(seed):
        model = train_network(
            *sets, target=Classes(n_classes=2), settings=settings, seed=seed
        ).model
        return torch.cat(
            [value.flatten().double() for value in model.state_dict().values()]
        )

    first = weights(3)
    assert torch.equal(first, weights(3))
    assert not torch.equal(first, weights(4))


def test_the_last_epoch_stands_beside_the_best_one(task):
    """Validation labels the wrong way round: what is learnt makes it worse, so that the best epoch is an early one."""
    settings = make_settings(
        "epochs=5", "patience=5", "epoch_fraction=0.6", "learning_rate=0.01"
    )
    train, validation = (
        load_windows(task, subset_segments(task, "by_unit", part))
        for part in ("train", "validation")
    )
    wrong = dataclasses.replace(validation, label=1 - validation.label)

    def trained(held_out):
        return train_network(
            train, held_out, target=Classes(n_classes=2), settings=settings, seed=0
        )

    training = trained(wrong)
    assert training.best_epoch < len(training.validation_loss)
    assert training.last_model is not None
    losses = [
        Classes(n_classes=2).record_loss(predict_windows(model, train), train)
        for model in (training.model, training.last_model)
    ]
    assert losses[1] < 0.8 * losses[0]
    training = trained(validation)
    assert (training.last_model is None) == (
        training.best_epoch == len(training.validation_loss)
    )


def test_a_model_of_before_has_temperature_one_and_a_bad_one_is_refused(task, tmp_path):
    settings = make_settings("epochs=1", "epoch_fraction=0.1")
    (found,) = run_jobs(
        task,
        settings,
        [Job(protocols=("by_unit",), seed=0)],
        n_workers=1,
        on_done=lambda _: None,
    )
    save_model(tmp_path / "m", found.weights, model_description(task, settings, found))
    path = tmp_path / "m" / "model.json"
    content = json.loads(path.read_text())
    path.write_text(
        json.dumps(
            {key: value for key, value in content.items() if key != "temperature"}
        )
    )
    assert load_model(tmp_path / "m")[1].temperature == 1.0
    for bad in (0, -1.0, "warm", float("nan")):
        path.write_text(json.dumps({**content, "temperature": bad}))
        with pytest.raises(
            DatasetError, match=r"model\.json does not describe a model"
        ):
            load_model(tmp_path / "m")


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("device=tpu", "device must be one of auto, cpu, cuda"),
        (
            "baselines=[minirockets]",
            "baselines must be false or a list of different names",
        ),
        (
            "baselines=[minirocket,minirocket]",
            "baselines must be false or a list of different names",
        ),
        ("baselines=true", "baselines must be false or a list of different names"),
        (
            "minirocket_features=83",
            "minirocket_features must be a whole number of at least 84",
        ),
    ],
)
def test_settings_refuse(override, message):
    with pytest.raises(ConfigError, match=message):
        make_settings(override)


def test_baselines_may_be_left_out_or_be_one():
    assert (
        make_settings("baselines=false").baselines
        == make_settings("baselines=[]").baselines
        == ()
    )
    assert make_settings("baselines=minirocket").baselines == ("minirocket",)


def test_networks_refuse():
    config = make_settings("model=spectrum").model
    for change, message in (
        ({"floor": 0}, "floor must be greater than 0"),
        ({"widths": [4]}, "same length"),
    ):
        with pytest.raises(ConfigError, match=message):
            build_model({**config, **change}, n_channels=1, n_classes=2)


def test_a_device_that_is_not_there_is_refused(monkeypatch, task):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert device_of("auto") == device_of("cpu") == torch.device("cpu")
    settings = make_settings("device=cuda", "protocols=[by_unit]")
    with pytest.raises(ConfigError, match="device=cuda: torch finds no GPU here"):
        plan_study(task, settings)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert device_of("auto") == torch.device("cuda")
    assert device_of("cpu") == torch.device("cpu")
