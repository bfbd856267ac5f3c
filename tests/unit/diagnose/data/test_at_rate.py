"""Training at a lower rate: the samples of a slower recorder, and the rate of the model."""

import json
import pickle

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from runs import refuses, says, serve
from small_studies import train

from diagnose.cli import main
from diagnose.data.at_rate import at_rate
from diagnose.training.store import load_model
from gensig.errors import ConfigError


def test_rate_length_and_samples_are_those_of_the_lower_rate():
    dataset = FakeDataset(n_channels=2, noise=0.0)
    slower = at_rate(dataset, 6400)
    assert (slower.sampling_rate, slower.n_samples) == (6400.0, dataset.n_samples // 2)
    assert slower.n_records == dataset.n_records
    assert_array_equal(slower.column("label"), dataset.column("label"))
    healthy = 0  # its tones lie below 0.39 of 6400 Hz
    inner = slice(50, -50)
    expected = dataset.signals(healthy)[:, ::2][:, inner]
    decimated = slower.signals(healthy)
    assert_allclose(decimated[:, inner], expected, rtol=0, atol=2e-3)
    assert decimated.dtype == np.float32


def test_parts_channels_and_copies_read_the_same():
    slower = at_rate(FakeDataset(n_channels=3), 5000)
    whole = slower.signals(1)
    part = slower.signals(1, 100, 300, [2, 0])
    assert_allclose(part, whole[[2, 0], 100:300], rtol=0, atol=1e-6)
    copied = pickle.loads(pickle.dumps(slower))
    assert_array_equal(copied.signals(1), whole)
    assert copied.class_names == slower.class_names


@pytest.mark.parametrize("rate", [None, 12800])
def test_null_and_the_stored_rate_leave_the_data_set_alone(rate):
    dataset = FakeDataset()
    assert at_rate(dataset, rate) is dataset


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (25600, "sampling_rate_hz=25600 is above the 12800 samples a second"),
        (
            6400.123,
            "no ratio of small whole numbers away from 12800; the nearest .* 6400",
        ),
        (12.8, "leaves no sample"),
    ],
)
def test_impossible_rates_are_refused(rate, message):
    with pytest.raises(ConfigError, match=message):
        at_rate(FakeDataset(duration=0.05), rate)


def test_a_model_at_a_lower_rate_takes_faster_recordings_and_refuses_slower_ones(
    tmp_path, monkeypatch, capsys
):
    data = FakeDataset(n_units=8, records_per_unit=8, duration=0.5)
    out = tmp_path / "out"
    words = ["window_samples=600", "stride_samples=500", "shuffle_control=false"]
    metrics = train(data, out, "sampling_rate_hz=6400", "epochs=1", *words)
    model = out / "models" / "by_unit-seed0"
    assert (
        load_model(model)[1].sampling_rate_hz == metrics["sampling_rate_hz"] == 6400.0
    )
    signals = {12800: data.signals(60), 6400: at_rate(data, 6400).signals(60)}
    probabilities = []
    capsys.readouterr()
    for rate, signal in signals.items():
        file = tmp_path / f"{rate}.npz"
        np.savez(file, acceleration=signal, sampling_rate_hz=rate)
        main(["predict", "--model", str(model), str(file), "--json"])
        answer = json.loads(capsys.readouterr().out)
        probabilities.append([*answer["probabilities"].values()])
    assert_allclose(*probabilities, rtol=0, atol=1e-4)
    slow = tmp_path / "slow.npz"
    np.savez(slow, acceleration=signals[12800], sampling_rate_hz=5120)
    words = ["predict", "--model", model, slow]
    refuses(capsys, words, "the model was trained at 6400")
    serve(monkeypatch, {"good": data})
    text = says(capsys, "evaluate", "data=good", f"--model={model}")
    score = metrics["protocols"]["by_unit"]["methods"]["cnn"]["balanced_accuracy"]
    assert f"balanced_accuracy {score['mean']:.3f}" in text
