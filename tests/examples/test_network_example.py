"""The worked example of a network: trained by the ordinary study, stored and loaded."""

import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from network_example import CONFIG, EnvelopeCnn
from numpy.testing import assert_allclose

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.networks.registry import MODELS, input_of
from diagnose.training.store import load_model

sys.path.append(str(Path(__file__).parent.parent / "unit" / "diagnose"))
from fake_dataset import FakeDataset

SMALL = [
    "window_samples=1200", "epochs=1", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "protocols=[by_unit]", "shuffle_control=false", "metadata_probe=false", "baselines=false",
]  # fmt: skip


@pytest.fixture
def data(monkeypatch):
    """A small data set in place of a folder, and the example among the networks."""
    torch.set_num_threads(1)
    made = FakeDataset(n_units=8, records_per_unit=4)
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: made)
    monkeypatch.setitem(MODELS, CONFIG["kind"], EnvelopeCnn)
    return made


@pytest.fixture
def options(tmp_path):
    """A folder of configuration with the network's YAML."""
    folder = tmp_path / "mine" / "model"
    folder.mkdir(parents=True)
    lines = [f"{key}: {value}" for key, value in CONFIG.items()]
    (folder / "envelope.yaml").write_text("\n".join(lines) + "\n")
    return str(folder.parent)


def test_it_is_trained_stored_and_loaded(data, options, tmp_path):
    out = tmp_path / "out"
    words = [
        "data=any",
        f"out={out}",
        "model=envelope",
        f"--config-dir={options}",
        *SMALL,
    ]
    assert main(["train", *words]) == 0
    assert "envelope" in (out / "report.html").read_text()

    model, description = load_model(out / "models" / "by_unit-seed0")
    assert isinstance(model, EnvelopeCnn)
    np.savez(
        tmp_path / "a.npz",
        acceleration=data.signals(0),
        sampling_rate_hz=data.sampling_rate,
    )
    words = ["--model", str(out / "models" / "by_unit-seed0"), str(tmp_path / "a.npz")]
    assert main(["predict", *words]) in (0, 3)
    assert main(["evaluate", "data=any", f"model_dir={words[1]}"]) == 0
    assert description.model == CONFIG


def test_it_is_deterministic_and_reads_what_it_declares(data):
    model = EnvelopeCnn(
        n_channels=1, n_classes=4, input_scale=[1.0], kernel=16, width=8
    ).eval()
    inputs = input_of(CONFIG)
    assert isinstance(inputs, EnvelopeCnn.inputs)
    assert inputs.n_points(1200) == 1200
    x = torch.randn(3, 1, 1200, generator=torch.Generator().manual_seed(0))
    with torch.inference_mode():
        assert_allclose(model(x), model(x.clone()), rtol=0, atol=0)


def test_a_network_that_is_not_registered_is_refused(
    data, options, tmp_path, monkeypatch, capsys
):
    monkeypatch.delitem(MODELS, CONFIG["kind"])
    words = [
        "data=any",
        f"out={tmp_path / 'out'}",
        "model=envelope",
        f"--config-dir={options}",
    ]
    assert main(["train", *words, *SMALL]) == 2
    assert "no model kind 'envelope_cnn'; there is small_cnn" in capsys.readouterr().err
