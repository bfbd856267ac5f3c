"""Training at a lower rate: the samples of a slower recorder, and a model that knows its rate."""

import json
import pickle

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose, assert_array_equal

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.at_rate import at_rate
from diagnose.data.windows import load_windows, subset_segments, task_of
from diagnose.training.store import load_model
from gensig.errors import ConfigError

FAST = [
    "window_samples=600", "stride_samples=500", "epochs=2", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "shuffle_control=false",
]  # fmt: skip


def test_rate_length_and_samples_are_those_of_the_lower_rate():
    dataset = FakeDataset(n_channels=2, noise=0.0)
    slower = at_rate(dataset, 6400)
    assert (slower.sampling_rate, slower.n_samples) == (6400.0, dataset.n_samples // 2)
    assert slower.n_records == dataset.n_records
    assert_array_equal(slower.column("label"), dataset.column("label"))
    healthy = int(
        np.flatnonzero(dataset.column("label") == 0)[0]
    )  # its tones lie below 0.39 of 6400 Hz
    inner = slice(50, -50)
    kept = dataset.signals(healthy)[:, ::2]
    assert_allclose(
        slower.signals(healthy)[:, inner], kept[:, inner], rtol=0, atol=2e-3
    )
    assert slower.signals(healthy).dtype == np.float32


def test_parts_channels_and_copies_read_the_same():
    slower = at_rate(FakeDataset(n_channels=3), 5000)
    whole = slower.signals(1)
    assert_allclose(
        slower.signals(1, 100, 300, [2, 0]), whole[[2, 0], 100:300], rtol=0, atol=1e-6
    )
    copied = pickle.loads(pickle.dumps(slower))
    assert_array_equal(copied.signals(1), whole)
    assert copied.class_names == slower.class_names


def test_null_and_its_own_rate_leave_the_data_set_alone():
    dataset = FakeDataset()
    assert at_rate(dataset, None) is dataset
    assert at_rate(dataset, 12800) is dataset


def test_rates_that_cannot_be_are_refused():
    dataset = FakeDataset()
    for rate, message in [
        (25600, "sampling_rate_hz=25600 is above the 12800 samples a second"),
        (
            6400.123,
            "is no ratio of small whole numbers away from 12800; the nearest that is: 6400",
        ),
        (12.8, "leaves no sample"),
    ]:
        with pytest.raises(ConfigError, match=message):
            at_rate(FakeDataset(duration=0.05) if rate == 12.8 else dataset, rate)


def test_windows_are_cut_at_the_lower_rate():
    task = task_of(
        at_rate(FakeDataset(), 6400),
        window_samples=600,
        stride_samples=500,
        normalise="rms",
    )
    windows = load_windows(task, subset_segments(task, "random_window_leaky", "train"))
    assert {signal.shape for signal in windows.signals} == {(1, 800)}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A model at 6.4 kHz of data at 12.8 kHz, with the baselines."""
    folder = tmp_path_factory.mktemp("slow")
    data = FakeDataset(n_units=12, records_per_unit=8, duration=0.5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: data)
        words = ["data=good", f"out={folder / 'out'}", "sampling_rate_hz=6400", *FAST]
        assert main(["train", *words]) == 0
    return folder / "out"


def test_the_model_and_the_report_carry_the_rate(trained):
    assert (
        load_model(trained / "models" / "by_unit-seed0")[1].sampling_rate_hz == 6400.0
    )
    assert (
        json.loads((trained / "metrics.json").read_text())["sampling_rate_hz"] == 6400.0
    )


def test_predict_and_evaluate_take_what_is_as_fast_and_refuse_what_is_slower(
    trained, tmp_path, monkeypatch, capsys
):
    model = str(trained / "models" / "by_unit-seed0")
    data = FakeDataset(n_units=12, records_per_unit=8, duration=0.5)
    np.savez(
        tmp_path / "fast.npz", acceleration=data.signals(80), sampling_rate_hz=12800
    )
    np.savez(
        tmp_path / "own.npz",
        acceleration=at_rate(data, 6400).signals(80),
        sampling_rate_hz=6400,
    )
    np.savez(
        tmp_path / "slow.npz", acceleration=data.signals(80), sampling_rate_hz=5120
    )
    capsys.readouterr()
    shown = []
    for name in ("fast", "own"):
        assert main(
            ["predict", "--model", model, str(tmp_path / f"{name}.npz"), "--json"]
        ) in (
            0,
            3,
        )
        shown.append(json.loads(capsys.readouterr().out))
    first, second = (list(result["probabilities"].values()) for result in shown)
    assert_allclose(first, second, rtol=0, atol=1e-4)
    assert main(["predict", "--model", model, str(tmp_path / "slow.npz")]) == 2
    assert "the model was trained at 6400" in capsys.readouterr().err
    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", lambda path: data)
    assert main(["evaluate", "data=good", f"model_dir={model}"]) == 0
    expected = json.loads((trained / "metrics.json").read_text())["protocols"][
        "by_unit"
    ]["methods"]["cnn"]
    assert (
        f"balanced_accuracy {expected['balanced_accuracy']['mean']:.3f}"
        in capsys.readouterr().out
    )


def test_a_rate_that_is_no_number_is_refused(tmp_path, capsys):
    for value in ("fast", "0", "-5", "true", "inf"):
        assert (
            main(
                [
                    "train",
                    "data=x",
                    f"out={tmp_path / 'o'}",
                    f"sampling_rate_hz={value}",
                ]
            )
            == 2
        )
        assert "sampling_rate_hz must be null or a number" in capsys.readouterr().err
