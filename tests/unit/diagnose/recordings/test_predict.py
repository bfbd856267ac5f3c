"""A recording and a trained network: the answer for the data set, and a flag for strangers."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from runs import metrics_of, refuses, says
from safetensors.numpy import load_file, save_file
from scipy import io
from scipy.io import wavfile
from small_studies import task_on

from benchmarks._damaged_models import forge
from diagnose.data.windows import Segments, load_windows
from diagnose.networks.domain import band_levels
from diagnose.recordings.predict import predict_recording
from diagnose.recordings.registry import open_network
from diagnose.recordings.source import Source
from diagnose.recordings.verdict import class_text, score_text, verdict
from diagnose.training.classes import predict_windows
from diagnose.training.model_files import MODEL_SCHEMA_VERSION
from diagnose.training.store import load_domain, load_model

RATE = 12800


def predicted(model, file, **options):
    network = open_network(model)
    source = Source(file=str(file), **options)
    return predict_recording(network, load_domain(model, network.description), source)


@pytest.fixture(scope="module")
def held_out(two_channels):
    """Records of the units that neither training nor validation had."""
    return [record for record, _, _ in two_channels.split("by_unit")["test"]]


@pytest.fixture(scope="module")
def signals(two_channels, held_out):
    return [two_channels.signals(record) for record in held_out]


def write_all(folder, signal):
    """The same recording with named columns, with its rate, and without: file -> options."""
    time = np.arange(signal.shape[1]) / RATE
    table = np.column_stack([time, *signal[::-1]])  # columns are found by name
    names = "time_s,channel_1_m_per_s2,channel_0"
    np.savetxt(folder / "r.csv", table, "%.9g", ",", header=names, comments="")
    np.savez(folder / "r.npz", acceleration=signal, sampling_rate_hz=RATE)
    io.savemat(folder / "r.mat", {"x": signal.T})
    named = ["--sampling-rate", str(RATE), "--array", "x"]
    return {"r.csv": [], "r.npz": [], "r.mat": named}


@pytest.mark.parametrize("which", ["model", "levels_model"])
def test_files_give_the_answer_for_the_data_set(
    which, request, two_channels, held_out, tmp_path, capsys
):
    folder = request.getfixturevalue(which)
    network, description = load_model(folder)
    task = task_on(two_channels, 1200, 1000, description.normalise)
    stop = np.array([two_channels.n_samples])
    record = held_out[0]
    whole = Segments(record=np.array([record]), start=np.array([0]), stop=stop)
    expected = np.exp(predict_windows(network, load_windows(task, whole)))
    overall = np.exp(np.log(expected).mean(axis=0) / description.temperature)
    overall = overall / overall.sum()
    files = write_all(tmp_path, two_channels.signals(record))
    for name, options in files.items():
        words = ["predict", "--model", folder, str(tmp_path / name), "--json", *options]
        result = json.loads(says(capsys, *words))
        windows = [[*row["probabilities"].values()] for row in result["windows"]]
        assert_allclose(windows, expected, rtol=0, atol=1e-4)
        probabilities = [*result["probabilities"].values()]
        assert_allclose(probabilities, overall, rtol=0, atol=1e-4)
        assert list(result["probabilities"]) == list(two_channels.class_names)
        assert result["class"] == two_channels.class_names[int(overall.argmax())]
        assert result["windows"][1]["start_s"] == pytest.approx(1000 / RATE)


def test_held_out_units_are_known_and_strangers_are_not(model, signals, recorded):
    rng = np.random.default_rng(0)
    n_samples = signals[0].shape[1]
    time = np.arange(n_samples) / RATE

    def flagged(strangers):
        """Share of recordings that are called out of distribution."""
        results = [predicted(model, recorded(signal)) for signal in strangers]
        return np.mean([result["out_of_distribution"] for result in results])

    def gearing(mesh):
        tones = np.sin(2 * np.pi * mesh * time)
        tones = tones + 0.3 * np.sin(2 * np.pi * 2.6 * mesh * time)
        return tones + 0.5 * rng.standard_normal((2, n_samples))

    assert flagged(signals) <= 0.1
    assert flagged([rng.standard_normal((2, n_samples)) for _ in range(8)]) == 1.0
    assert flagged([np.tile(signal[:, ::2], 2) for signal in signals[:8]]) == 1.0
    assert flagged([gearing(mesh) for mesh in rng.uniform(900, 2e3, 8)]) == 1.0


def test_the_given_speed_is_compared_with_those_of_the_training(
    model, two_channels, signals, recorded, capsys
):
    file = recorded(signals[0])
    train = [record for record, _, _ in two_channels.split("by_unit")["train"]]
    speeds = two_channels.column("speed_rpm")[train]
    assert load_model(model)[1].speed_rpm_range == (speeds.min(), speeds.max())
    words = ["predict", "--model", model, file, "--speed-rpm"]
    assert "like the training data" in says(capsys, *words, "1500")
    (line,) = says(capsys, *words, "4000", status=3).strip().splitlines()
    assert "OUT OF DISTRIBUTION" in line
    assert "4000 r/min is outside" in line


def test_a_folder_of_a_version_that_adapted_is_still_predicted_with(
    model, signals, recorded, tmp_path, capsys
):
    """Statistics of healthy windows beside the weights are left alone, and the answer says so."""
    file = recorded(signals[0])
    tensors = load_file(f"{model}/model.safetensors")
    assert not any(name.startswith("adaptation.") for name in tensors)
    description = json.loads(Path(model, "model.json").read_text())
    old = {"adaptation.features": np.ones((3, 2)), "adaptation.mean.x": np.ones(2)}
    facts = {"method": "coral", "matched": "healthy", "recordings": []}
    save_file(tensors | old, tmp_path / "model.safetensors")
    forge(tmp_path, {**description, "adaptation": facts})

    words = ("predict", file, "--json", "--model")
    as_trained, adapted = (
        json.loads(says(capsys, *words, folder)) for folder in (model, tmp_path)
    )
    assert as_trained.pop("adaptation") is None
    assert adapted.pop("adaptation") == facts
    assert as_trained | {"model": ""} == adapted | {"model": ""}
    assert "before it was adapted" in says(capsys, *words[:2], "--model", tmp_path)


CLEAR = {"healthy": 0.61, "crack": 0.3, "pitting": 0.09}
CLOSE = {"healthy": 0.35, "crack": 0.3, "pitting": 0.26, "missing_tooth": 0.09}
SCORE = {
    "balanced_accuracy": {"mean": 0.8, "low": 0.6, "high": 0.9},
    "chance": 0.25,
    "n_units": 8,
    "leaky": False,
}


def test_the_score_of_the_model_is_told():
    result = {**verdict(CLEAR, SCORE), "adaptation": None}
    assert class_text(result) == "healthy, probability 0.61, next crack 0.30"
    assert score_text(result) == (
        "this model: balanced accuracy 0.80 [0.60, 0.90] on 8 machines it never saw, "
        "chance 0.25"
    )
    assert ", before it was adapted" in score_text({**result, "adaptation": {}})
    leaky = {**result, "model_test_score": {**SCORE, "leaky": True}}
    assert "LEAKY" in score_text(leaky)


def test_close_classes_and_weak_models_are_undecided():
    assert class_text(verdict(CLOSE, SCORE)) == (
        "undecided, healthy 0.35 or crack 0.30 (the two are less than 0.10 apart)"
    )
    for low in (0.2, None):
        accuracy = {"mean": 0.35, "low": low, "high": low}
        result = verdict(CLEAR, {**SCORE, "balanced_accuracy": accuracy})
        reason = "the model was not shown to be better than chance"
        assert result["undecided_because"] == [reason]
        assert class_text(result).startswith("undecided, healthy 0.61 or crack 0.30")
    assert not verdict(CLEAR, None)["undecided"]  # an older model


def test_a_model_stores_its_score_and_several_recordings_are_answered(
    model, signals, recorded, capsys
):
    files = [recorded(signal, name=f"{k}.npz") for k, signal in enumerate(signals[:2])]
    noise = np.random.default_rng(0).standard_normal((2, 6400))
    strange = recorded(noise, name="noise.npz")
    result = metrics_of(Path(model).parents[1])["protocols"]["by_unit"]
    stored = load_model(model)[1].test_score
    expected = result["methods"]["cnn"]["balanced_accuracy"]["mean"]
    assert stored["balanced_accuracy"]["mean"] == expected
    assert stored["n_units"] == result["n_units"]["test"] < 4
    assert stored["balanced_accuracy"]["low"] is None
    lines = says(capsys, "predict", files[0], "--model", model, files[1]).splitlines()
    assert [line.partition(": ")[0] for line in lines] == files
    for line in lines:
        assert "undecided" in line
        assert "[too few machines] on" in line
    words = ["predict", "--model", model, "--json", files[0], strange]
    first, second = json.loads(says(capsys, *words, status=3))
    assert not first["out_of_distribution"]
    assert second["out_of_distribution"]
    assert first["model_test_score"] == stored


def copied(model, folder, change, tensors):
    """Copy of a model with another description and other tensors."""
    content = json.loads(Path(model, "model.json").read_text())
    save_file(tensors, folder / "model.safetensors")
    forge(folder, content)
    content = json.loads((folder / "model.json").read_text())
    change(content)
    if content["model_schema_version"] == MODEL_SCHEMA_VERSION:
        forge(folder, content)
    else:
        (folder / "model.json").write_text(json.dumps(content))
    return str(folder)


def test_an_older_model_predicts_without_a_flag(
    model, signals, recorded, tmp_path, capsys
):
    def of_version_1(content):
        added = ("speed_rpm_range", "out_of_distribution", "test_score", "temperature")
        for key in (*added, "files", "sha256"):
            del content[key]
        content["model_schema_version"] = 1

    stored = load_file(f"{model}/model.safetensors")
    weights = {key: stored[key] for key in stored if not key.startswith("domain.")}
    old = copied(model, tmp_path, of_version_1, weights)
    file = recorded(signals[0])
    line = says(capsys, "predict", "--model", old, file, "--speed-rpm", "9999")
    assert "no out-of-distribution flag" in line
    assert "stores no test score" in line
    result = predicted(old, file)
    assert result["out_of_distribution"] is None
    found, expected = (
        [window["probabilities"] for window in answer["windows"]]
        for answer in (result, predicted(model, file))
    )
    assert found == expected
    assert load_model(old)[1].temperature == 1.0


def test_band_levels_of_a_tone_and_of_noise():
    time = np.arange(4096) / 4096
    tone = band_levels(np.sin(2 * np.pi * 500.0 * time))
    edges = np.geomspace(4, 2048, 13)
    assert tone.shape == (12,)
    assert tone.argmax() == np.searchsorted(edges, 500.0) - 1
    noise = np.random.default_rng(0).standard_normal((400, 4096))
    levels = band_levels(noise)
    assert np.ptp(np.log(np.exp(levels).mean(axis=0))) < 0.3
    louder = band_levels(10.0 * noise)
    assert_allclose(louder, levels + np.log(100.0), rtol=0, atol=1e-9)
    assert np.isfinite(band_levels(np.zeros((2, 64)))).all()


FITS = [
    (
        "slow.npz",
        "",
        "10240 samples a second and so nothing above 5120 Hz; the model was trained at 12800",
    ),
    (
        "one.npz",
        "",
        "has 1 channel(s), channel_0; the model takes 2, channel_0, channel_1",
    ),
    (
        "three.npz",
        "--channels channel_0",
        "--channels names 1 channel(s); the model takes 2",
    ),
    ("three.npz", "--channels channel_0 channel_7", "no channel channel_7"),
    ("short.npz", "", "is too short: 0.0859 s, a window of the model is 0.0938 s"),
    ("good.npz", "--speed-rpm -5", "--speed-rpm -5 must be positive"),
    ("good.npz", "--speed-rpm nan", "--speed-rpm nan must be positive"),
    ("good.npz", "--sampling-rate 25600", "leave --sampling-rate out"),
    ("good.npz", "--unit mm", "--unit mm: allowed: m/s2, g"),
    (
        "names.csv",
        "--sampling-rate 12800",
        "say which is which with --channels, in this order",
    ),
    ("", "", "for a data set use diagnose evaluate"),
]


def test_recordings_that_do_not_fit_are_refused(
    model, levels_model, recorded, tmp_path, capsys
):
    rng = np.random.default_rng(0)
    good, three = rng.standard_normal((2, 6400)), rng.standard_normal((3, 6400))
    short = good[:, :1100]
    signals = {"good": good, "one": good[:1], "three": three, "short": short}
    for name, signal in signals.items():
        recorded(signal, name=f"{name}.npz")
    recorded(good, 10240, name="slow.npz")
    np.savetxt(tmp_path / "names.csv", good.T, "%.6g", ",", header="a,b", comments="")
    for name, options, message in FITS:
        words = ["predict", "--model", model, str(tmp_path / name), *options.split()]
        refuses(capsys, words, message)
    refuses(capsys, ["predict", str(tmp_path / "good.npz")], "--teeth DRIVING DRIVEN")
    refuses(capsys, ["predict", "--model", model], "RECORDING")
    whole = tmp_path / "whole.wav"
    wavfile.write(whole, RATE, np.round(3000 * good.T).astype(np.int16))
    words = ["predict", "--model", levels_model, str(whole)]
    refuses(capsys, words, "no level in m/s2")
    says(capsys, "predict", "--model", model, str(whole), status=3)


NO_MODEL = "does not describe a model"
DESCRIPTIONS = [
    ({"model_schema_version": 9}, "model schema 9, this program reads 1, 2 and 3"),
    ({"sampling_rate_hz": "fast"}, NO_MODEL),
    ({"temperature": 0}, NO_MODEL),
    ({"temperature": "warm"}, NO_MODEL),
    ({"class_names": ["healthy", "crack"]}, "does not fit model.json"),
    ({"window_samples": 0}, "window_samples 0 is no whole number from 1"),
    ({"speed_rpm_range": [1]}, NO_MODEL),
    ({"flag": {"method": "guess"}}, "out-of-distribution flag is 'guess'"),
    ({"flag": {"threshold": None}}, "flag is not whole"),
    ({"flag": {"threshold": -1.0}}, "threshold of its out-of-distribution flag is -1"),
]


@pytest.mark.parametrize(("values", "message"), DESCRIPTIONS)
def test_a_wrong_description_is_refused(values, message, model, tmp_path, capsys):
    def change(content):
        flag = content["out_of_distribution"] | values.get("flag", {})
        flag = {key: value for key, value in flag.items() if value is not None}
        content |= {**values, "out_of_distribution": flag}
        content.pop("flag", None)

    tensors = load_file(f"{model}/model.safetensors")
    folder = copied(model, tmp_path, change, tensors)
    refuses(capsys, ["predict", "--model", folder, "r.npz"], message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda levels: levels * np.nan, "'domain.levels' holds numbers that are not"),
        (lambda levels: levels[0], "holds no levels of windows"),
        (lambda levels: levels[:, 1:], "flag has 23 levels, a window 24"),
    ],
)
def test_wrong_tensors_are_refused(
    change, message, model, signals, recorded, tmp_path, capsys
):
    tensors = load_file(f"{model}/model.safetensors")
    levels = change(tensors["domain.levels"])
    tensors["domain.levels"] = np.ascontiguousarray(levels)
    folder = copied(model, tmp_path, lambda content: None, tensors)
    refuses(capsys, ["predict", "--model", folder, recorded(signals[0])], message)


def test_the_help_explains_the_exit_status(capsys):
    shown = says(capsys, "predict", "--help")
    assert re.search(r"3 +predicted, but out of distribution", shown)
