"""Adaptation by healthy windows: the effects that it undoes, its limits, and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from runs import refuses, says
from safetensors.numpy import load_file, save_file
from small_studies import settings_of, task_on, two_channels, windows_of

import diagnose.networks.adaptation as adaptation
from diagnose.networks.adaptation import (
    METHODS,
    adapt_domain,
    adapt_network,
    chosen_windows,
    healthy_statistics,
    statistics_from,
    statistics_of,
)
from diagnose.networks.domain import distances, fit_domain
from diagnose.networks.registry import build_model
from diagnose.training.classes import predict_windows
from gensig.errors import DatasetError

RATE = 12800
# endings of the tensors that each method changes
ADAPTED = {
    "adabn": ("running_mean", "running_var"),
    "coral": ("head.1.weight", "head.1.bias"),
}


@pytest.fixture(scope="module")
def windows():
    """Windows of the training part, not normalised."""
    return windows_of(task_on(two_channels(), 2048, normalise="none"), "train")[0]


@pytest.fixture(scope="module")
def healthy(windows):
    return chosen_windows(windows, np.flatnonzero(windows.label == 0))


def network(name):
    """A network whose batch normalisations have moments, as after a training."""
    torch.manual_seed(0)
    config = settings_of(f"model={name}").model
    model = build_model(config, n_channels=2, n_classes=4)
    for layer in model.modules():
        if isinstance(layer, torch.nn.BatchNorm1d):
            layer.running_mean.normal_(0.0, 0.1)
            layer.running_var.uniform_(0.5, 2.0)
            torch.nn.init.uniform_(layer.weight, 0.5, 1.5)
    return model.eval()


def moved(windows, gain):
    """The same windows through another path: a gain for each channel."""
    signals = ((gain * signal).astype(np.float32) for signal in windows.signals)
    return replace(windows, signals=tuple(signals))


def through_a_path(name, method, windows, healthy, gain):
    """Log-probabilities as trained, and through a path before and after adaptation."""
    model = network(name)
    source = statistics_of(model, healthy)
    adapted = adapt_network(
        model,
        source,
        moved(healthy, gain),
        method,
    )
    far = moved(windows, gain)
    pairs = ((model, windows), (model, far), (adapted, far))
    return tuple(predict_windows(net, part) for net, part in pairs)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "name",
    ["cnn", "wdcnn", "spectrum"],
)
def test_the_windows_of_the_training_change_nothing(name, method, windows, healthy):
    trained, _, adapted = through_a_path(name, method, windows, healthy, 1.0)
    assert_allclose(adapted, trained, atol=1e-3)


@pytest.mark.parametrize("name", ["cnn", "wdcnn"])
def test_adabn_undoes_a_gain_also_for_unseen_faults(name, windows, healthy):
    trained, before, after = through_a_path(name, "adabn", windows, healthy, 3.0)
    change = np.abs(before - trained).max()
    assert change > 0.01
    assert_allclose(after, trained, atol=0.02 * change)


def layer_of(model, name):
    return dict(model.named_modules())[name]


def test_a_mixture_taken_for_healthy_is_adabn_as_published(windows, healthy):
    model = network("cnn")
    mixture = statistics_of(model, windows)
    for name, mean in mixture.mean.items():
        layer = layer_of(model, name)
        layer.running_mean.copy_(torch.from_numpy(mean))
        layer.running_var.copy_(torch.from_numpy(mixture.variance[name]))
    mixture, target = (statistics_of(model, part) for part in (windows, healthy))
    first = next(iter(mixture.mean))
    trained = layer_of(model, first)
    naive, right = (
        layer_of(adapt_network(model, source, healthy, "adabn"), first)
        for source in (mixture, target)
    )
    mean = target.mean[first]

    assert_allclose(
        naive.running_mean,
        mean,
        atol=1e-4 * np.abs(mean).max(),
    )
    assert_allclose(right.running_mean, trained.running_mean, atol=1e-6)
    assert_allclose(right.running_var, trained.running_var, rtol=1e-4)

    same = np.isclose(
        naive.running_var,
        trained.running_var,
        rtol=0.02,
        atol=0,
    )
    assert not same.all()


class Levels(torch.nn.Module):
    """Scores linear in the RMS of each channel and its square: features in closed form."""

    def __init__(self):
        super().__init__()
        self.head = torch.nn.Linear(4, 4)
        torch.nn.init.eye_(self.head.weight)
        torch.nn.init.zeros_(self.head.bias)

    def forward(self, windows):
        level = windows.square().mean(dim=-1).sqrt()
        return self.head(torch.cat([level, level**2], dim=1))


def scores(model, windows):
    batch = torch.from_numpy(windows.cut(np.arange(len(windows))))
    with torch.inference_mode():
        return model(batch).numpy().astype(float)


def test_coral_gives_healthy_features_the_moments_of_the_training(healthy, monkeypatch):
    monkeypatch.setattr(adaptation, "RIDGE", 1e-9)
    model, target = Levels(), moved(healthy, 2.0)
    adapted = adapt_network(
        model,
        statistics_of(model, healthy),
        target,
        "coral",
    )
    pairs = ((model, healthy), (model, target), (adapted, target))
    features = np.array([scores(*pair) for pair in pairs])
    features /= features[0].std(axis=0)
    expected, before, after = features.mean(axis=1)

    assert np.abs(before - expected).max() > 1.0
    assert_allclose(after, expected, atol=1e-3)
    assert_allclose(
        np.cov(features[2].T),
        np.cov(features[0].T),
        atol=1e-2,
    )


def test_coral_keeps_directions_without_scatter_in_the_windows(healthy):
    """With the published ridge, features of almost no scatter are shifted and not amplified."""
    model, equal = Levels(), healthy.subset(np.zeros(9, dtype=int))
    adapted = adapt_network(
        model,
        statistics_of(model, healthy),
        equal,
        "coral",
    )
    assert np.abs(adapted.head.weight.detach().numpy()).max() < 20.0

    expected = scores(model, healthy).mean(axis=0)
    assert_allclose(
        scores(adapted, equal).mean(axis=0),
        expected,
        atol=1e-3,
    )


def test_coral_needs_linear_scores_and_adabn_batch_normalisation(healthy):
    with refused("take coral"):
        adapt_network(
            Levels(),
            statistics_of(Levels(), healthy),
            healthy,
            "adabn",
        )
    bent = Levels()
    bent.head = torch.nn.Tanh()
    with refused("not linear"):
        statistics_of(bent, healthy)


def test_the_domain_moves_with_healthy_windows_and_no_farther(windows, healthy):
    domain = fit_domain(windows, windows)
    far = moved(windows, 10.0)
    assert (distances(domain, far) > domain.threshold).all()

    statistics = statistics_of(network("cnn"), healthy)
    shifted = adapt_domain(domain, statistics, moved(healthy, 10.0))
    expected = distances(domain, windows)
    assert_allclose(distances(shifted, far), expected, atol=1e-3)
    assert shifted.threshold == domain.threshold

    rng = default_rng(0)
    noise = tuple(rng.standard_normal(x.shape).astype(np.float32) for x in far.signals)
    noisy = distances(shifted, replace(far, signals=noise))
    assert (noisy > shifted.threshold).all()


def test_statistics_are_those_of_healthy_windows_and_can_be_stored(windows):
    model, names = network("cnn"), two_channels().class_names
    statistics = healthy_statistics(model, windows, names)
    assert len(statistics.features) == (windows.label == 0).sum()

    tensors, weights = statistics.tensors(), {"blocks.0.weight": np.zeros(3)}
    loaded = statistics_from(tensors | weights).tensors()
    for name, tensor in tensors.items():
        assert_array_equal(loaded[name], tensor)
    assert healthy_statistics(model, windows, ("sound", *names[1:])) is None
    assert statistics_from(weights) is None
    with refused("no statistic", DatasetError):
        statistics_from(tensors | {"adaptation.levels": np.array([np.nan])})

    del tensors["adaptation.features"]
    with refused("not whole", DatasetError):
        statistics_from(tensors)


def test_statistics_of_another_network_are_refused(windows, healthy):
    model, other = network("cnn"), statistics_of(network("spectrum"), healthy)
    for method in METHODS:
        with refused("another network", DatasetError):
            adapt_network(model, other, healthy, method)
    with refused("there is adabn, coral"):
        adapt_network(model, other, healthy, "magic")

    few = replace(other, levels=other.levels[:3])
    with refused("another out-of-distribution flag", DatasetError):
        adapt_domain(fit_domain(windows, windows), few, healthy)


@pytest.fixture
def recordings(tmp_path):
    """Two healthy recordings of a machine with another path, and a faulty one."""
    dataset, files = two_channels(), []
    for record in (0, 4, 3):
        signal = dataset.signals(record)
        rolled = signal + 0.7 * np.roll(signal, 3, axis=-1)
        files.append(str(tmp_path / f"r{record}.npz"))
        np.savez(
            files[-1],
            acceleration=rolled,
            sampling_rate_hz=RATE,
        )
    return files


@pytest.mark.parametrize("method", METHODS)
def test_the_command_writes_a_described_model_for_predict(
    method, two_channel_model, recordings, tmp_path, capsys
):
    model, out = two_channel_model, tmp_path / "adapted"
    *mine, faulty = recordings
    words = ["--healthy", *mine, "--method", method, "--out", out]
    text = says(capsys, "adapt", "--model", model, *words)

    assert "2 healthy recording(s)" in text
    assert "docs/howto/bridge.md" in text

    facts = json.loads((out / "model.json").read_text())["adaptation"]
    assert (facts["method"], facts["matched"]) == (method, "healthy")

    rows = facts["recordings"]
    assert [row["file"] for row in rows] == [Path(file).name for file in mine]
    assert {len(row["sha256"]) for row in rows} == {64}
    assert {row["n_windows"] for row in rows} == {6}

    weights = [load_file(f"{folder}/model.safetensors") for folder in (model, out)]
    before, after = weights
    changed = {name for name in after if not np.array_equal(after[name], before[name])}
    endings = ADAPTED[method]
    assert changed
    assert all(name.endswith((*endings, "domain.levels")) for name in changed)
    assert not any(name.startswith("adaptation.") for name in after)

    for folder, expected in ((out, facts), (model, None)):
        answer = says(capsys, "predict", "--model", folder, faulty, "--json", status=3)
        assert json.loads(answer)["adaptation"] == expected


@pytest.fixture
def models(two_channel_model, recordings, tmp_path, capsys):
    """Folders of a trained model, an adapted one and one without healthy statistics."""
    model = Path(two_channel_model)
    adapted, old = tmp_path / "adapted", tmp_path / "old"
    words = [
        "--healthy",
        *recordings[:2],
        "--method",
        "coral",
        "--out",
        adapted,
    ]
    says(capsys, "adapt", "--model", model, *words)
    old.mkdir()
    (old / "model.json").write_bytes((model / "model.json").read_bytes())
    tensors = load_file(model / "model.safetensors")
    kept = {k: v for k, v in tensors.items() if not k.startswith("adaptation.")}
    save_file(kept, old / "model.safetensors")
    return {"trained": model, "adapted": adapted, "old": old}


REFUSED = [
    ("trained --method dann", "dann is not one of adabn, coral"),
    ("trained --speed-rpm 5000", "5000 is outside the 1"),
    ("trained --channels channel_0", "names 1 channel"),
    ("trained --healthy short.npz", "2 window(s)"),
    ("trained --out full", "not an empty folder"),
    ("adapted", "adapted before"),
    ("old", "stores no healthy statistics"),
]


def test_refusals_are_one_line(models, recordings, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    signal = default_rng(0).standard_normal((2, 3000))
    np.savez("short.npz", acceleration=signal, sampling_rate_hz=RATE)
    Path("full").mkdir()
    Path("full/x").write_text("mine")
    given = [
        "--healthy",
        *recordings[:2],
        "--method",
        "adabn",
        "--out",
        "new",
    ]

    for typed, message in REFUSED:
        name, *words = typed.split()
        refuses(
            capsys,
            ["adapt", "--model", models[name], *given, *words],
            message,
        )
        assert not Path("new").exists()
