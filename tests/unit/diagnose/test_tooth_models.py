"""Laws of the features of unexplained teeth, and data sets without turns."""

import json
import shutil

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from runs import metrics_of, model_of, refuses, rows_of, says, serve, train
from safetensors.numpy import load_file, save_file
from scipy.special import logsumexp
from small_studies import TINY_CNN, study_of

from benchmarks._damaged_models import forge
from diagnose.baselines.estimators import linear_model, logistic_regression
from diagnose.baselines.features import FeatureTable
from diagnose.baselines.tooth_features import (
    GEAR_FEATURES,
    tooth_features,
    unexplained_teeth,
)
from diagnose.baselines.tooth_models import why_no_turns
from diagnose.recordings.onnx_export import export_onnx
from diagnose.recordings.registry import open_network
from gensig.errors import ConfigError

N_CHANNELS, N_SAMPLES = 2, 64
N_TEETH = (11, 17)
WORDS = ("protocols=[by_unit]", "shuffle_control=false", "metadata_probe=false")
QUICK = ("seeds=[0]", "epochs=1", "n_threads=1", "n_bootstrap=50", *TINY_CNN)


def turns_of(rng, damage=0.0, tooth=4):
    """Turns of sound teeth of one shape and of different size, one of them damaged."""
    shape, other = rng.standard_normal((2, N_CHANNELS, 1, N_SAMPLES))
    noise = 0.01
    turns = [
        rng.standard_normal((1, n, 1)) * shape
        + noise * rng.standard_normal((N_CHANNELS, n, N_SAMPLES))
        for n in N_TEETH
    ]
    turns[0][:, tooth] += damage * other[:, 0]
    return turns


def test_damage_below_the_errors_of_sound_teeth_is_farthest_from_them():
    rng = np.random.default_rng(0)
    for tooth in range(N_TEETH[0]):
        turns = turns_of(rng, damage=0.4, tooth=tooth)
        loudest = np.square(turns[0]).sum(axis=(0, 2)).argmax()
        driving, driven = unexplained_teeth(*turns)
        assert driving.distance.argmax() == tooth
        assert driving.distance.max() > 3 * driven.distance.max()
        if tooth != loudest:
            break
    else:
        pytest.fail("the damaged tooth was always the loudest, which proves nothing")


def test_the_rest_is_the_error_of_a_prediction_by_the_other_teeth():
    driving, driven = turns_of(np.random.default_rng(1))
    teeth = np.concatenate([np.moveaxis(x, 1, 0) for x in (driving, driven)])
    level = np.sqrt(np.square(teeth).mean(axis=(0, 2)))[:, None]
    teeth = (teeth / level).reshape(sum(N_TEETH), -1)
    gram = teeth @ teeth.T
    ridge = 0.03 * np.trace(gram) / teeth.shape[1]
    sisters = np.setdiff1d(np.arange(len(teeth)), [3, 4, 5])
    inner = gram[np.ix_(sisters, sisters)] + ridge * np.eye(sisters.size)
    weights = np.linalg.solve(inner, gram[sisters, 4])
    found = unexplained_teeth(driving, driven)[0]
    rest = (found.rest[:, 4] / level).ravel()
    assert_allclose(rest, teeth[4] - weights @ teeth[sisters], rtol=1e-6, atol=1e-9)
    distance = (gram[4, 4] - weights @ gram[sisters, 4]) / ridge
    assert_allclose(found.distance[4], distance, rtol=1e-6, atol=1e-9)


def test_a_channel_counts_alike_however_loud_it_is():
    turns = turns_of(np.random.default_rng(1))
    gain = np.array([1.0, 1e3])[:, None, None]
    alone, louder = (
        unexplained_teeth(*turns),
        unexplained_teeth(*(gain * t for t in turns)),
    )
    for before, after in zip(alone, louder, strict=True):
        assert_allclose(after.rest, gain * before.rest, rtol=1e-6, atol=1e-9)
        assert_allclose(after.distance, before.distance, rtol=1e-6)


def test_features_depend_neither_on_level_nor_on_the_first_tooth():
    turns = turns_of(np.random.default_rng(2), damage=0.5)
    features = tooth_features(*turns)
    assert features.shape == (2 * len(GEAR_FEATURES),)
    assert np.isfinite(features).all()
    gain = np.array([100.0, 3.0])[:, None, None]
    louder = tooth_features(*(gain * turn for turn in turns))
    assert_allclose(louder, features, rtol=1e-6, atol=1e-6)
    later = tooth_features(*(np.roll(turn, 3, axis=1) for turn in turns))
    assert_allclose(later, features, rtol=1e-6, atol=1e-6)
    other = tooth_features(*turns_of(np.random.default_rng(3)))
    assert np.abs(other - features).max() > 0.1


def test_silence_and_teeth_that_never_passed_have_finite_features():
    driving, driven = turns_of(np.random.default_rng(4))
    driven[:, 12:] = 0
    assert np.isfinite(tooth_features(driving, driven)).all()
    driven[:, 2:] = 0
    assert np.isnan(tooth_features(driving, driven)).all()
    assert np.isnan(tooth_features(0 * driving, 0 * driven)).all()


def without_teeth():
    dataset = FakeDataset()
    del dataset.attributes["n_teeth_wheel"]
    return dataset


@pytest.mark.parametrize(
    ("dataset", "reason"),
    [
        (without_teeth(), "the data set does not say n_teeth_wheel"),
        (FakeDataset(duration=0.04), "turns of the pinion, and it needs a whole one"),
    ],
)
def test_a_set_without_turns_says_why(dataset, reason):
    task, _ = study_of(dataset, "window_samples=400", "stride_samples=400")
    assert reason in why_no_turns(task, "by_unit")
    task, _ = study_of(FakeDataset())
    assert why_no_turns(task, "by_unit") is None


def test_a_study_leaves_the_baseline_out_and_says_so(tmp_path, capsys):
    words = ("window_samples=400", "stride_samples=400", *WORDS, *QUICK)
    out = train(tmp_path / "out", FakeDataset(duration=0.04), *words)
    metrics = metrics_of(out)
    methods = metrics["protocols"]["by_unit"]["methods"]
    assert "tooth_logistic" not in methods
    assert "indicators" in methods
    assert list(metrics["baselines_left_out"]) == ["tooth_logistic"]
    text = "tooth_logistic is left out of by_unit, where a stretch holds"
    assert text in capsys.readouterr().err
    assert text in (out / "report.html").read_text()


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Data set, and the folder of a study whose baseline is stored."""
    dataset = FakeDataset(duration=0.5, n_channels=2)
    words = (*WORDS, *QUICK, "baselines=[tooth_logistic]", "normalise=rms")
    out = train(tmp_path_factory.mktemp("study") / "out", dataset, *words)
    return dataset, out


def test_the_stored_baseline_repeats_its_scores(stored, capsys):
    dataset, out = stored
    model = model_of(out, "by_unit-tooth_logistic-seed0")
    with pytest.MonkeyPatch.context() as patch:
        serve(patch, {"good": dataset})
        says(capsys, "evaluate", "data=good", f"--model={model}", f"out={out / 'e'}")
    mine = metrics_of(out)["protocols"]["by_unit"]["methods"]["tooth_logistic"]
    assert metrics_of(out / "e")["confusion"] == mine["confusion"]
    assert not list(out.rglob("*.pkl"))


def test_a_recording_gets_the_probabilities_of_its_record(stored, capsys, tmp_path):
    dataset, out = stored
    rows = [
        row
        for row in rows_of(out / "predictions.csv")
        if (row["method"], row["protocol"]) == ("tooth_logistic", "by_unit")
    ]
    row = rows[0]
    record = list(dataset.column("record_id")).index(row["record_id"])
    file = tmp_path / "a.npy"
    np.save(file, 3 * dataset.signals(record))
    model = model_of(out, "by_unit-tooth_logistic-seed0")
    words = ["predict", "--model", model, file, "--sampling-rate", "12800"]
    speed = ["--speed-rpm", repr(float(dataset.column("speed_rpm")[record]))]
    teeth = ["--teeth", "23", "84", "--as-recorded"]
    answer = json.loads(says(capsys, *words, *speed, *teeth, "--json"))
    for name, probability in answer["probabilities"].items():
        expected = np.exp(float(row[f"log_probability_{name}"]))
        assert probability == pytest.approx(expected, abs=2e-3)
    assert answer["n_windows"] == 1
    assert "its spectrum is not compared" in says(capsys, *words, *speed, *teeth)
    refuses(capsys, words, "must know the speed")
    away = [*words, *speed, "--teeth", "31", "57", "--as-recorded"]
    refuses(capsys, away, "no sign of the mesh near")
    wheel = [*words, *speed, "--teeth", "23", "57", "--as-recorded"]
    other = says(capsys, *wheel, status=3)
    assert "those of the training 23/84" in other
    with pytest.raises(ConfigError, match="looks at turns"):
        export_onnx(open_network(model), tmp_path / "b.onnx")


def test_arrays_of_another_baseline_are_refused(stored, capsys, tmp_path):
    _, out = stored
    folder = tmp_path / "model"
    shutil.copytree(model_of(out, "by_unit-tooth_logistic-seed0"), folder)
    tensors = load_file(folder / "model.safetensors")
    save_file({**tensors, "mean": tensors["mean"][:5]}, folder / "model.safetensors")
    forge(folder)
    words = ["predict", "--model", folder, "a.npy"]
    refuses(capsys, words, "does not fit model.json: mean is float32 (5)")


@pytest.mark.parametrize("classes", [(0, 1, 3), (1, 3)])
def test_a_linear_model_answers_as_the_regression_that_it_is_made_of(classes):
    rng = np.random.default_rng(5)
    values = rng.standard_normal((60, 6))
    values[:, 2] = np.nan
    values[3, 1] = np.nan
    label = np.repeat(classes, 60 // len(classes))
    names = tuple("abcdef")
    table = FeatureTable(values=values, names=names, label=label, record=np.arange(60))
    fitted = logistic_regression(table, 4, 0.1)
    scores = linear_model(fitted, 6).scores(values)
    probability = np.exp(scores - logsumexp(scores, axis=1, keepdims=True))
    assert_allclose(probability, fitted.probability(table), rtol=1e-9, atol=1e-12)
    assert (probability[:, 2] == 0).all()
