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
from small_studies import NETWORK_ALONE, SMALL


@pytest.fixture
def data(monkeypatch):
    """A small data set in place of a folder, and the example among the networks."""
    torch.set_num_threads(1)
    made = FakeDataset(n_units=8, records_per_unit=4)
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: made)
    monkeypatch.setitem(MODELS, CONFIG["kind"], EnvelopeCnn)
    return made


@pytest.fixture
def words(tmp_path):
    """Words of a study with a folder of configuration that has the network's YAML."""
    folder = tmp_path / "mine" / "model"
    folder.mkdir(parents=True)
    lines = [f"{key}: {value}\n" for key, value in CONFIG.items()]
    (folder / "envelope.yaml").write_text("".join(lines))
    options = ["model=envelope", f"--config-dir={folder.parent}", "epochs=1"]
    return [
        "train",
        "data=any",
        f"out={tmp_path / 'out'}",
        *SMALL,
        *options,
        *NETWORK_ALONE,
    ]


def test_it_is_trained_stored_and_loaded(data, words, tmp_path):
    assert main(words) == 0
    assert "envelope" in (tmp_path / "out" / "report.html").read_text()
    folder = tmp_path / "out" / "models" / "by_unit-seed0"
    model, description = load_model(folder)
    assert isinstance(model, EnvelopeCnn)
    assert description.model == CONFIG
    file, rate = tmp_path / "a.npz", data.sampling_rate
    np.savez(file, acceleration=data.signals(0), sampling_rate_hz=rate)
    assert main(["predict", "--model", str(folder), str(file)]) in (0, 3)
    assert main(["evaluate", "data=any", f"--model={folder}"]) == 0


def test_it_is_deterministic_and_reads_the_declared_input(data):
    sizes = {"kernel": 16, "width": 8}
    model = EnvelopeCnn(n_channels=1, n_classes=4, input_scale=[1.0], **sizes).eval()
    inputs = input_of(CONFIG)
    assert isinstance(inputs, EnvelopeCnn.inputs)
    assert inputs.example(1, 1200).shape == (1, 1, 1200)
    x = torch.randn(3, 1, 1200, generator=torch.Generator().manual_seed(0))
    with torch.inference_mode():
        assert_allclose(model(x), model(x.clone()), rtol=0, atol=0)


def test_a_network_that_is_not_registered_is_refused(data, words, monkeypatch, capsys):
    monkeypatch.delitem(MODELS, CONFIG["kind"])
    assert main(words) == 2
    assert "no model kind 'envelope_cnn'; there is small_cnn" in capsys.readouterr().err
