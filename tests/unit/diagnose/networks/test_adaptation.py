"""Healthy matched to healthy: what adaptation must undo, what it must leave alone, and what the command says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from safetensors.numpy import load_file, save_file

import diagnose.networks.adaptation as adaptation
import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import load_windows, subset_segments, task_of
from diagnose.networks.adaptation import (
    METHODS,
    Statistics,
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
from gensig.errors import ConfigError, DatasetError
from gensig.options.compose import compose

NETWORKS = ("cnn", "wdcnn", "spectrum")
RATE = 12800
FAST = [
    "window_samples=1200", "stride_samples=600", "epochs=3", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "shuffle_control=false", "baselines=false",
]  # fmt: skip


def fake():
    return FakeDataset(n_units=12, records_per_unit=8, duration=0.5, n_channels=2)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Small work: threads cost more than they bring."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def windows():
    """Windows of the training part that keep their level, and which of them are healthy."""
    dataset = fake()
    task = task_of(dataset, window_samples=2048, stride_samples=2048, normalise="none")
    return load_windows(task, subset_segments(task, "by_unit", "train"))


def healthy_of(windows):
    return chosen_windows(windows, np.flatnonzero(windows.label == 0))


def network(name):
    """A network whose batch normalisations know moments, of all classes as in training."""
    torch.manual_seed(0)
    model = build_model(
        compose("train", ["data=x", "out=y", f"model={name}"])["model"],
        n_channels=2,
        n_classes=4,
    )
    for layer in model.modules():
        if isinstance(layer, torch.nn.BatchNorm1d):
            layer.running_mean.normal_(0.0, 0.1)
            layer.running_var.uniform_(0.5, 2.0)
            torch.nn.init.uniform_(layer.weight, 0.5, 1.5)
    return model.eval()


def moved(windows, gain):
    """The same windows through another path: a gain for each channel."""
    return replace(
        windows,
        signals=tuple((gain * signal).astype(np.float32) for signal in windows.signals),
    )


def heard_at_the_machine(name, method, windows, gain):
    """Log-probabilities of windows in their own world, and through the path before and after adaptation."""
    model, source = network(name), healthy_of(windows)
    statistics = statistics_of(model, source)
    adapted = adapt_network(model, statistics, moved(source, gain), method)
    return tuple(predict_windows(net, part) for net, part in (
        (model, windows), (model, moved(windows, gain)), (adapted, moved(windows, gain)),
    ))  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", NETWORKS)
def test_the_own_world_changes_nothing(name, method, windows):
    own, _, adapted = heard_at_the_machine(name, method, windows, 1.0)
    assert_allclose(adapted, own, rtol=0, atol=1e-3)


@pytest.mark.parametrize("name", ["cnn", "wdcnn"])
def test_adabn_undoes_a_gain_also_for_faults_that_it_never_saw(name, windows):
    own, before, after = heard_at_the_machine(name, "adabn", windows, 3.0)
    moved_by = np.abs(before - own).max()
    assert moved_by > 0.01  # there was something to undo
    assert_allclose(after, own, rtol=0, atol=0.02 * moved_by)


def test_a_mixture_taken_for_healthy_is_adaptive_batch_normalisation_as_published(
    windows,
):
    model, healthy = network("cnn"), healthy_of(windows)
    every = chosen_windows(windows, np.arange(len(windows)))
    mixture = statistics_of(model, every)
    for layer, mean, variance in zip(
        (layer for layer in model.modules() if isinstance(layer, torch.nn.BatchNorm1d)),
        mixture.mean.values(), mixture.variance.values(), strict=True,
    ):  # fmt: skip
        layer.running_mean.copy_(torch.from_numpy(mean))
        layer.running_var.copy_(torch.from_numpy(variance))
    mixture = statistics_of(model, every)
    first, target = next(iter(mixture.mean)), statistics_of(model, healthy)
    naive = dict(adapt_network(model, mixture, healthy, "adabn").named_modules())[first]
    right = dict(adapt_network(model, target, healthy, "adabn").named_modules())[first]
    own = dict(model.named_modules())[first]
    assert_allclose(
        naive.running_mean.numpy(),
        target.mean[first],
        rtol=0,
        atol=1e-4 * np.abs(target.mean[first]).max(),
    )
    assert_allclose(
        right.running_mean.numpy(), own.running_mean.numpy(), rtol=0, atol=1e-6
    )
    assert_allclose(
        right.running_var.numpy(), own.running_var.numpy(), rtol=1e-4, atol=0
    )
    assert not np.allclose(
        naive.running_var.numpy(), own.running_var.numpy(), rtol=0.02, atol=0
    )


class Levels(torch.nn.Module):
    """Scores that are linear in the RMS of each channel and its square: features one can calculate."""

    def __init__(self):
        super().__init__()
        self.head = torch.nn.Linear(4, 4)
        torch.nn.init.eye_(self.head.weight)
        torch.nn.init.zeros_(self.head.bias)

    def forward(self, windows):
        level = windows.square().mean(dim=-1).sqrt()
        return self.head(torch.cat([level, level**2], dim=1))


def scores(model, windows):
    with torch.inference_mode():
        return (
            model(torch.from_numpy(windows.cut(np.arange(len(windows)))))
            .numpy()
            .astype(float)
        )


def test_coral_gives_healthy_features_the_mean_and_covariance_of_the_training(
    windows, monkeypatch
):
    monkeypatch.setattr(adaptation, "RIDGE", 1e-9)
    model, source = Levels(), healthy_of(windows)
    target = moved(source, 2.0)
    expected, before = scores(model, source), scores(model, target)
    after = scores(
        adapt_network(model, statistics_of(model, source), target, "coral"), target
    )
    scale = expected.std(axis=0)
    assert np.abs((before.mean(axis=0) - expected.mean(axis=0)) / scale).max() > 1.0
    assert_allclose(
        after.mean(axis=0) / scale, expected.mean(axis=0) / scale, rtol=0, atol=1e-3
    )
    assert_allclose(
        np.cov((after / scale).T), np.cov((expected / scale).T), rtol=0, atol=1e-2
    )


def test_coral_keeps_directions_of_which_few_windows_say_nothing(windows):
    """With the published ridge, features of almost no scatter are shifted and not blown up."""
    model, source = Levels(), healthy_of(windows)
    one = replace(source, segment=source.segment[:1].repeat(9), start=source.start[:1].repeat(9),
                  label=source.label[:9], record=source.record[:9])  # fmt: skip
    adapted = adapt_network(model, statistics_of(model, source), one, "coral")
    assert np.abs(adapted.head.weight.detach().numpy()).max() < 20.0
    assert_allclose(
        scores(adapted, one).mean(axis=0),
        scores(model, source).mean(axis=0),
        rtol=0,
        atol=1e-3,
    )


def test_coral_needs_linear_scores_and_adabn_batch_normalisation(windows):
    healthy = healthy_of(windows)
    with pytest.raises(ConfigError, match="take coral"):
        adapt_network(Levels(), statistics_of(Levels(), healthy), healthy, "adabn")
    bent = Levels()
    bent.head = torch.nn.Tanh()
    with pytest.raises(ConfigError, match="not linear"):
        statistics_of(bent, healthy)


def test_the_domain_moves_as_healthy_windows_do_and_no_farther(windows):
    healthy, model = healthy_of(windows), network("cnn")
    domain, statistics = fit_domain(windows, windows), statistics_of(model, healthy)
    far = moved(windows, 10.0)
    assert (distances(domain, far) > domain.threshold).mean() == 1.0
    shifted = adapt_domain(domain, statistics, moved(healthy, 10.0))
    assert_allclose(
        distances(shifted, far), distances(domain, windows), rtol=0, atol=1e-3
    )
    assert shifted.threshold == domain.threshold
    rng = np.random.default_rng(0)
    noise = replace(
        far,
        signals=tuple(
            rng.standard_normal(s.shape).astype(np.float32) for s in far.signals
        ),
    )
    assert (distances(shifted, noise) > shifted.threshold).mean() == 1.0


def test_statistics_are_those_of_healthy_training_windows_and_survive_the_disk(windows):
    model, names = network("cnn"), fake().class_names
    found = healthy_statistics(model, windows, names)
    assert len(found.features) == (windows.label == 0).sum()
    back = statistics_from({**found.tensors(), "blocks.0.weight": np.zeros(3)})
    assert isinstance(back, Statistics)
    for name, tensor in found.tensors().items():
        assert_allclose(back.tensors()[name], tensor, rtol=0, atol=0)
    assert healthy_statistics(model, windows, ("sound", *names[1:])) is None
    assert statistics_from({"blocks.0.weight": np.zeros(3)}) is None
    broken = found.tensors()
    del broken["adaptation.features"]
    with pytest.raises(DatasetError, match="not whole"):
        statistics_from(broken)
    with pytest.raises(DatasetError, match="no statistic"):
        statistics_from({**found.tensors(), "adaptation.levels": np.array([np.nan])})


def test_statistics_of_another_network_are_refused(windows):
    healthy = healthy_of(windows)
    for method in METHODS:
        with pytest.raises(DatasetError, match="another network"):
            adapt_network(
                network("cnn"),
                statistics_of(network("spectrum"), healthy),
                healthy,
                method,
            )
    own = statistics_of(network("cnn"), healthy)
    with pytest.raises(DatasetError, match="another out-of-distribution flag"):
        adapt_domain(
            fit_domain(windows, windows), replace(own, levels=own.levels[:3]), healthy
        )
    with pytest.raises(ConfigError, match="there is adabn, coral"):
        adapt_network(network("cnn"), own, healthy, "magic")


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        assert main(["train", "data=good", f"out={folder / 'out'}", *FAST]) == 0
    return str(folder / "out" / "models" / "by_unit-seed0")


@pytest.fixture
def recordings(tmp_path):
    """Two healthy recordings of a machine with another path, and a faulty one."""
    dataset, files = fake(), []
    labels = dataset.column("label")
    for record in [
        *np.flatnonzero(labels == 0)[:2],
        int(np.flatnonzero(labels == 3)[0]),
    ]:
        signal = dataset.signals(record)
        rolled = signal + 0.7 * np.roll(signal, 3, axis=-1)
        files.append(str(tmp_path / f"r{record}.npz"))
        np.savez(files[-1], acceleration=rolled, sampling_rate_hz=RATE)
    return files


@pytest.mark.parametrize("method", METHODS)
def test_the_command_writes_a_model_that_predict_takes_and_that_says_what_it_is(
    method, model, recordings, tmp_path, capsys
):
    out = tmp_path / "mine"
    assert (
        main(
            [
                "adapt",
                "--model",
                model,
                "--healthy",
                *recordings[:2],
                "--method",
                method,
                "--out",
                str(out),
            ]
        )
        == 0
    )
    said = capsys.readouterr().out
    assert "2 healthy recording(s)" in said
    assert "docs/howto/bridge.md" in said
    told = json.loads((out / "model.json").read_text())["adaptation"]
    assert (told["method"], told["matched"]) == (method, "healthy")
    assert [one["file"] for one in told["recordings"]] == [
        Path(file).name for file in recordings[:2]
    ]
    assert all(
        len(one["sha256"]) == 64 and one["n_windows"] == 9 for one in told["recordings"]
    )
    before, after = (
        load_file(Path(folder) / "model.safetensors") for folder in (model, out)
    )
    changed = {name for name in after if not np.array_equal(after[name], before[name])}
    moving = (
        ("running_mean", "running_var")
        if method == "adabn"
        else ("head.1.weight", "head.1.bias")
    )
    assert changed
    assert all(name.endswith((*moving, "domain.levels")) for name in changed)
    assert not any(name.startswith("adaptation.") for name in after)
    assert main(["predict", "--model", str(out), recordings[2], "--json"]) in (0, 3)
    assert json.loads(capsys.readouterr().out)["adaptation"] == told
    assert main(["predict", "--model", model, recordings[2], "--json"]) in (0, 3)
    assert json.loads(capsys.readouterr().out)["adaptation"] is None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--method", "dann"], "dann is not one of adabn, coral"),
        (["--speed-rpm", "5000"], "5000 is outside the 1"),
        (["--channels", "channel_0"], "names 1 channel"),
    ],
)
def test_mistakes_are_one_line(words, message, model, recordings, tmp_path, capsys):
    given = [
        "adapt",
        "--model",
        model,
        "--healthy",
        *recordings[:2],
        "--out",
        str(tmp_path / "mine"),
    ]
    assert main([*given, "--method", "adabn", *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "mine").exists()


def test_what_cannot_be_adapted_is_refused(model, recordings, tmp_path, capsys):
    def refused(message, folder=model, files=recordings[:2], out="new"):
        words = ["--healthy", *files, "--method", "adabn", "--out", str(tmp_path / out)]
        assert main(["adapt", "--model", str(folder), *words]) == 2
        assert message in capsys.readouterr().err

    short = str(tmp_path / "short.npz")
    np.savez(
        short,
        acceleration=np.random.default_rng(0).standard_normal((2, 3000)),
        sampling_rate_hz=RATE,
    )
    refused("4 window(s)", files=[short])
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("mine")
    refused("not an empty folder", out="full")
    assert main(["adapt", "--model", model, "--healthy", recordings[0], "--method", "coral",
                 "--out", str(tmp_path / "once")]) == 0  # fmt: skip
    capsys.readouterr()
    refused("adapted before", folder=tmp_path / "once")
    old = tmp_path / "old"
    old.mkdir()
    (old / "model.json").write_bytes((Path(model) / "model.json").read_bytes())
    kept = {
        k: v
        for k, v in load_file(Path(model) / "model.safetensors").items()
        if not k.startswith("adaptation.")
    }
    save_file(kept, old / "model.safetensors")
    refused("stores no healthy statistics", folder=old)
