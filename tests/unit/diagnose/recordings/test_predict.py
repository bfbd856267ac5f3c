"""A recording and a trained network: the same answer whatever the format, and a flag for what was never seen."""

import json
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from safetensors.numpy import load_file, save_file
from scipy import io
from scipy.io import wavfile
from scipy.signal import resample

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.data.windows import Segments, load_windows, task_of
from diagnose.networks.domain import band_levels
from diagnose.recordings.predict import predict_recording
from diagnose.recordings.registry import open_network
from diagnose.recordings.source import Source
from diagnose.recordings.verdict import class_text, score_text, verdict
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_domain, load_model

RATE = 12800
FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=5", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "shuffle_control=false", "baselines=false",
]  # fmt: skip


def fake(**changes):
    return FakeDataset(
        **{
            "n_units": 12,
            "records_per_unit": 8,
            "duration": 0.5,
            "n_channels": 2,
            **changes,
        }
    )


def train(folder, *overrides):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        assert (
            main(["train", "data=good", f"out={folder / 'out'}", *FAST, *overrides])
            == 0
        )
    return str(folder / "out" / "models" / "by_unit-seed0")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Small work: threads cost more than they bring."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return train(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="module")
def levels_model(tmp_path_factory):
    """A network that sees levels in m/s2."""
    return train(tmp_path_factory.mktemp("levels"), "normalise=none")


def predicted(model, file, **options):
    network = open_network(model)
    source = Source(file=str(file), **options)
    return predict_recording(network, load_domain(model, network.description), source)


def array(path, signal, rate=RATE):
    np.savez(path, acceleration=signal, sampling_rate_hz=rate)
    return path


def held_out(dataset):
    """Records of the units that neither training nor validation had."""
    return [record for record, _, _ in dataset.split("by_unit")["test"]]


def flagged(model, folder, signals):
    """Share of recordings that are called out of distribution."""
    files = [
        array(folder / f"{index}.npz", signal) for index, signal in enumerate(signals)
    ]
    return np.mean([predicted(model, file)["out_of_distribution"] for file in files])


def written(folder, signal):
    """The same recording in every format, and what the command must be told."""
    time = np.arange(signal.shape[1]) / RATE
    table = np.column_stack(
        [time, *signal[::-1]]
    )  # columns are found by name, in whatever order
    names = "time_s,channel_1_m_per_s2,channel_0"
    np.savetxt(folder / "r.csv", table, "%.9g", ",", header=names, comments="")
    wavfile.write(folder / "r.wav", RATE, signal.T)
    content = {"acceleration": signal, "sampling_rate_hz": RATE}
    np.savez(folder / "r.npz", **content)
    np.save(folder / "r.npy", signal)
    io.savemat(folder / "r.mat", {"x": signal.T})
    with h5py.File(folder / "r73.mat", "w", userblock_size=512) as file:
        file["x"] = signal
    with h5py.File(folder / "r.h5", "w") as file:
        file["acceleration"] = signal
        file.attrs["sampling_rate_hz"] = RATE
    own = ["--sampling-rate", str(RATE)]
    named = [*own, "--array", "x"]
    return {
        "r.csv": [],
        "r.wav": [],
        "r.npz": [],
        "r.npy": own,
        "r.mat": named,
        "r73.mat": named,
        "r.h5": [],
    }


@pytest.mark.parametrize("which", ["model", "levels_model"])
def test_every_format_says_what_the_data_set_says(which, request, tmp_path, capsys):
    folder, dataset = request.getfixturevalue(which), fake()
    capsys.readouterr()  # of the training
    network, description = load_model(folder)
    task = task_of(
        dataset,
        window_samples=1200,
        stride_samples=1000,
        normalise=description.normalise,
    )
    for record in held_out(dataset)[:2]:
        whole = Segments(
            record=np.array([record]),
            start=np.array([0]),
            stop=np.array([dataset.n_samples]),
        )
        expected = np.exp(predict_windows(network, load_windows(task, whole)))
        for name, options in written(tmp_path, dataset.signals(record)).items():
            status = main(
                ["predict", "--model", folder, str(tmp_path / name), "--json", *options]
            )
            result = json.loads(capsys.readouterr().out)
            windows = [
                [row["probabilities"][name] for name in dataset.class_names]
                for row in result["windows"]
            ]
            assert_allclose(windows, expected, rtol=0, atol=1e-4)
            assert status == (3 if result["out_of_distribution"] else 0)
            overall = np.exp(np.log(expected).mean(axis=0) / description.temperature)
            assert_allclose(
                list(result["probabilities"].values()),
                overall / overall.sum(),
                rtol=0,
                atol=1e-4,
            )
            assert result["class"] == dataset.class_names[int(overall.argmax())]
            assert result["windows"][1]["start_s"] == pytest.approx(1000 / RATE)


@pytest.mark.parametrize("rate", [25600, 51200, 44100])
def test_a_recording_made_faster_is_resampled(model, tmp_path, rate):
    dataset = fake()
    for record in held_out(dataset)[:4]:
        signal = dataset.signals(record)
        faster = resample(signal, signal.shape[1] * rate // RATE, axis=1)
        own = predicted(model, array(tmp_path / "own.npz", signal))
        other = predicted(model, array(tmp_path / "faster.npz", faster, rate))
        assert other["n_windows"] == own["n_windows"]
        difference = [
            other["probabilities"][name] - own["probabilities"][name]
            for name in dataset.class_names
        ]
        assert np.abs(difference).max() < 0.05


def test_held_out_units_are_known_and_strangers_are_not(model, tmp_path):
    dataset, rng = fake(), np.random.default_rng(0)
    records = [dataset.signals(record) for record in held_out(dataset)]
    assert flagged(model, tmp_path, records) <= 0.1
    assert (
        flagged(
            model,
            tmp_path,
            [rng.standard_normal(signal.shape) for signal in records[:8]],
        )
        == 1.0
    )
    assert (
        flagged(model, tmp_path, [np.tile(signal[:, ::2], 2) for signal in records[:8]])
        == 1.0
    )
    time = np.arange(dataset.n_samples) / RATE
    foreign = [
        np.sin(2 * np.pi * mesh * time) + 0.3 * np.sin(2 * np.pi * 2.6 * mesh * time)
        for mesh in rng.uniform(900, 2e3, 8)
    ]
    noise = 0.5 * rng.standard_normal((8, 2, dataset.n_samples))
    assert flagged(model, tmp_path, np.asarray(foreign)[:, None, :] + noise) == 1.0


def test_the_stated_speed_is_held_beside_those_of_the_training(model, tmp_path, capsys):
    dataset = fake()
    file = str(array(tmp_path / "r.npz", dataset.signals(held_out(dataset)[0])))
    capsys.readouterr()
    low, high = load_model(model)[1].speed_rpm_range
    train = [record for record, _, _ in dataset.split("by_unit")["train"]]
    assert (low, high) == (
        dataset.column("speed_rpm")[train].min(),
        dataset.column("speed_rpm")[train].max(),
    )
    assert main(["predict", "--model", model, file, "--speed-rpm", "1500"]) == 0
    assert "like the training data" in capsys.readouterr().out
    assert main(["predict", "--model", model, file, "--speed-rpm", "4000"]) == 3
    line = capsys.readouterr().out.strip()
    assert "OUT OF DISTRIBUTION" in line
    assert "4000 r/min is outside" in line
    assert "\n" not in line


SCORE = {
    "balanced_accuracy": {"mean": 0.8, "low": 0.6, "high": 0.9}, "chance": 0.25, "n_records": 64, "n_units": 8,
    "leaky": False,
}  # fmt: skip


def test_the_class_is_said_beside_the_next_one_and_the_models_own_score():
    clear = {"healthy": 0.61, "crack": 0.3, "pitting": 0.09}
    said = {**verdict(clear, SCORE), "adaptation": None}
    assert class_text(said) == "healthy, probability 0.61, next crack 0.30"
    whole = "this model: balanced accuracy 0.80 [0.60, 0.90] on 8 machines it never saw, chance 0.25"
    assert score_text(said) == whole
    assert (
        score_text({**said, "adaptation": {}}).replace(", before it was adapted", "")
        == whole
    )
    assert "LEAKY" in score_text({**said, "model_test_score": {**SCORE, "leaky": True}})
    close = verdict(
        {"healthy": 0.35, "crack": 0.3, "pitting": 0.26, "missing_tooth": 0.09}, SCORE
    )
    assert (close["undecided"], close["class"], close["runner_up"]) == (
        True,
        "healthy",
        "crack",
    )
    assert (
        class_text(close)
        == "undecided, healthy 0.35 or crack 0.30 (the two are less than 0.10 apart)"
    )
    for low in (0.2, None):
        weak = {
            **SCORE,
            "balanced_accuracy": {"mean": 0.35, "low": low, "high": low and 0.5},
        }
        said = verdict(clear, weak)
        assert said["undecided_because"] == [
            "the model was not shown to be better than chance"
        ]
        assert class_text(said).startswith(
            "undecided, healthy 0.61 or crack 0.30 (the model was not shown"
        )
    assert not verdict(clear, None)["undecided"]  # an older model


def test_a_model_stores_what_it_scored_and_several_recordings_are_answered(
    model, tmp_path, capsys
):
    dataset = fake()
    files = [
        str(array(tmp_path / f"{k}.npz", dataset.signals(record)))
        for k, record in enumerate(held_out(dataset))
    ]
    metrics = json.loads(Path(model).parents[1].joinpath("metrics.json").read_text())[
        "protocols"
    ]["by_unit"]
    stored = load_model(model)[1].test_score
    assert (
        stored["balanced_accuracy"]["mean"]
        == metrics["methods"]["cnn"]["balanced_accuracy"]["mean"]
    )
    assert stored["n_units"] == metrics["n_units"]["test"] < 4
    assert stored["balanced_accuracy"]["low"] is None
    capsys.readouterr()
    strange = str(
        array(
            tmp_path / "noise.npz", np.random.default_rng(0).standard_normal((2, 6400))
        )
    )
    assert main(["predict", files[0], "--model", model, files[1]]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[0] for line in lines] == files[:2]
    assert all(
        "undecided" in line and "[too few machines] on" in line for line in lines
    )
    assert main(["predict", "--model", model, "--json", files[0], strange]) == 3
    first, second = json.loads(capsys.readouterr().out)
    assert (first["out_of_distribution"], second["out_of_distribution"]) == (
        False,
        True,
    )
    assert first["model_test_score"] == stored


def older(model, folder):
    """The model as a version before the flag wrote it."""
    description = json.loads(Path(model, "model.json").read_text())
    for key in ("speed_rpm_range", "out_of_distribution", "test_score"):
        del description[key]
    (folder / "model.json").write_text(
        json.dumps({**description, "model_schema_version": 1})
    )
    tensors = load_file(f"{model}/model.safetensors")
    save_file(
        {k: v for k, v in tensors.items() if not k.startswith("domain.")},
        folder / "model.safetensors",
    )
    return str(folder)


def test_an_older_model_predicts_and_says_that_it_has_no_flag(model, tmp_path, capsys):
    dataset = fake()
    file = str(array(tmp_path / "r.npz", dataset.signals(held_out(dataset)[0])))
    old = older(model, tmp_path)
    capsys.readouterr()
    assert main(["predict", "--model", old, file, "--speed-rpm", "9999"]) == 0
    shown = capsys.readouterr().out
    assert "no out-of-distribution flag" in shown
    assert "stores no test score" in shown
    assert predicted(old, file)["out_of_distribution"] is None
    assert (
        predicted(old, file)["probabilities"] == predicted(model, file)["probabilities"]
    )


def test_band_levels_of_a_tone_and_of_noise():
    time = np.arange(4096) / 4096
    tone = band_levels(np.sin(2 * np.pi * 500.0 * time))
    assert tone.shape == (12,)
    edges = np.geomspace(4, 2048, 13)
    assert tone.argmax() == np.searchsorted(edges, 500.0) - 1
    noise = band_levels(np.random.default_rng(0).standard_normal((400, 4096)))
    assert np.ptp(np.log(np.exp(noise).mean(axis=0))) < 0.3
    assert_allclose(
        band_levels(10.0 * noise), band_levels(noise) + np.log(100.0), rtol=0, atol=1e-9
    )
    assert np.isfinite(band_levels(np.zeros((2, 64)))).all()


def fails(capsys, words, message):
    assert main(["predict", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("diagnose: ")
    assert message in lines[0]


def test_recordings_that_do_not_fit_are_refused(model, levels_model, tmp_path, capsys):
    rng = np.random.default_rng(0)
    signal = rng.standard_normal((2, 6400))
    bad = signal.copy()
    bad[0, 5] = np.nan
    wavfile.write(
        tmp_path / "whole.wav", RATE, np.round(3000 * signal.T).astype(np.int16)
    )
    np.savetxt(tmp_path / "names.csv", signal.T, "%.6g", ",", header="a,b", comments="")
    np.save(tmp_path / "silent.npy", signal)
    files = {
        "nan": array(tmp_path / "nan.npz", bad),
        "slow": array(tmp_path / "slow.npz", signal, 10240),
        "one": array(tmp_path / "one.npz", signal[:1]),
        "three": array(tmp_path / "three.npz", rng.standard_normal((3, 6400))),
        "short": array(tmp_path / "short.npz", signal[:, :1100]),
        "good": array(tmp_path / "good.npz", signal),
    }
    capsys.readouterr()
    for name, options, message in [
        ("nan", [], "sample 5 of channel_0 is no finite number"),
        (
            "slow",
            [],
            "10240 samples a second and so nothing above 5120 Hz; the model was trained at 12800",
        ),
        (
            "one",
            [],
            "has 1 channel(s), channel_0; the model takes 2, channel_0, channel_1",
        ),
        (
            "three",
            ["--channels", "channel_0"],
            "--channels names 1 channel(s); the model takes 2",
        ),
        ("three", ["--channels", "channel_0", "channel_7"], "no channel channel_7"),
        ("short", [], "is too short: 0.0859 s, a window of the model is 0.0938 s"),
        ("good", ["--speed-rpm", "-5"], "--speed-rpm -5 must be positive"),
        ("good", ["--speed-rpm", "nan"], "--speed-rpm nan must be positive"),
        (
            "good",
            ["--sampling-rate", "25600"],
            "--sampling-rate says 25600; leave --sampling-rate out",
        ),
        ("good", ["--unit", "mm"], "--unit mm: allowed: m/s2, g"),
    ]:
        fails(capsys, ["--model", model, str(files[name]), *options], message)
    fails(
        capsys,
        ["--model", model, str(tmp_path / "silent.npy")],
        "give the samples a second with --sampling-rate",
    )
    names = [str(tmp_path / "names.csv"), "--sampling-rate", str(RATE)]
    fails(
        capsys,
        ["--model", model, *names],
        "say which is which with --channels, in this order",
    )
    fails(
        capsys,
        ["--model", levels_model, str(tmp_path / "whole.wav")],
        "no level in m/s2",
    )
    assert main(["predict", "--model", model, str(tmp_path / "whole.wav")]) == 3
    capsys.readouterr()
    fails(
        capsys,
        ["--model", model, str(tmp_path)],
        "for a data set use diagnose evaluate",
    )
    fails(
        capsys,
        ["--model", model, str(tmp_path / "none.wav")],
        "cannot be read: No such file",
    )
    fails(capsys, [str(files["good"])], "--model")
    fails(capsys, ["--model", model], "RECORDING")


def damaged(model, folder, *, change=lambda content: None, tensors=None):
    content = json.loads(Path(model, "model.json").read_text())
    change(content)
    (folder / "model.json").write_text(json.dumps(content))
    stored = load_file(f"{model}/model.safetensors")
    save_file({**stored, **(tensors or {})}, folder / "model.safetensors")
    return str(folder)


def test_models_that_are_none_are_refused(model, tmp_path, capsys):
    file = str(
        array(tmp_path / "r.npz", np.random.default_rng(0).standard_normal((2, 6400)))
    )
    capsys.readouterr()
    fails(capsys, ["--model", str(tmp_path), file], "holds no model.json")
    for change, message in [
        (
            lambda c: c.update(model_schema_version=9),
            "model schema 9, this program reads 1 and 2",
        ),
        (lambda c: c.update(sampling_rate_hz="fast"), "does not describe a model"),
        (
            lambda c: c.update(window_samples=0),
            "window_samples 0 is no positive whole number",
        ),
        (lambda c: c.update(speed_rpm_range=[1]), "does not describe a model"),
        (lambda c: c.update(out_of_distribution=3), "does not describe a model"),
        (
            lambda c: c["out_of_distribution"].update(method="guess"),
            "out-of-distribution flag is 'guess'",
        ),
        (lambda c: c["out_of_distribution"].pop("threshold"), "flag is not whole"),
        (
            lambda c: c["out_of_distribution"].update(threshold=-1.0),
            "threshold of its out-of-distribution flag is -1",
        ),
    ]:
        fails(
            capsys, ["--model", damaged(model, tmp_path, change=change), file], message
        )
    levels = load_file(f"{model}/model.safetensors")["domain.levels"]
    wrong = levels.copy()
    wrong[0, 0] = np.nan
    for changed, message in [
        (wrong, "holds no levels of windows"),
        (levels[0], "holds no levels of windows"),
        (np.ascontiguousarray(levels[:, 1:]), "flag has 23 levels, a window 24"),
    ]:
        fails(
            capsys,
            [
                "--model",
                damaged(model, tmp_path, tensors={"domain.levels": changed}),
                file,
            ],
            message,
        )
    (tmp_path / "model.safetensors").write_bytes(b"PK\x03\x04" + bytes(400))
    fails(capsys, ["--model", str(tmp_path), file], "is not a safetensors file")


def test_predict_loads_neither_numba_nor_the_physics():
    code = (
        "import sys, diagnose.recordings.predict, diagnose.recordings.registry, diagnose.networks.domain\n"
        "bad = [n for n in sys.modules if n == 'numba' or re.match('gensig.(mesh|geometry|faults|dynamics|systems|"
        "sensing|twin)', n)]\n"
        "assert not bad, bad"
    )
    shown = subprocess.run(
        [sys.executable, "-c", f"import re, {code[7:]}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.returncode == 0, shown.stderr


def test_the_help_says_what_the_exit_status_means(capsys):
    assert main(["predict", "--help"]) == 0
    assert re.search(r"3 +predicted, but out of distribution", capsys.readouterr().out)
