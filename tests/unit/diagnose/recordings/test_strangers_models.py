"""Damaged models and those of strangers: none answers, hangs or ends in a traceback."""

import json
import os
import shutil

import numpy as np
import pytest
from refusals import refused
from safetensors.numpy import load_file, save_file

import diagnose.networks.registry
from benchmarks import _fuzz_judge, _model_judge
from benchmarks._damaged_folders import Mutant
from benchmarks._damaged_models import FAMILIES, SIZES, forge
from benchmarks._model_judge import judge, said
from benchmarks._stored_models import ASKED, make_models
from diagnose.networks.registry import build_model
from diagnose.recordings.model_check import check_model, models_in
from diagnose.recordings.registry import open_network, shipped_network
from diagnose.recordings.stored_network import require_finite
from diagnose.training.description_checks import LONGEST_TEXT, text
from diagnose.training.model_files import content_digest, tensors_of
from gensig.errors import DatasetError, GensigError

UMASKS = (0o022, 0o027, 0o077)


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    folder = tmp_path_factory.mktemp("strangers") / "models"
    make_models(folder)
    return folder


@pytest.fixture
def cnn(template, tmp_path):
    """Folder of a copy of a small classifier."""
    return shutil.copytree(template / "cnn", tmp_path / "cnn")


@pytest.fixture(scope="module")
def tried(template, tmp_path_factory):
    """Verdicts on a mutant of each family, in a process that may die."""
    scratch = tmp_path_factory.mktemp("mutants")
    n_models = len(ASKED)
    seeds = range(0, n_models * len(FAMILIES), n_models)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_fuzz_judge, "METHOD", "fork")
        campaign = _model_judge.CAMPAIGN
        return list(_fuzz_judge.verdicts(template, scratch, seeds, campaign))


def test_no_mutant_of_a_model_does_harm(tried):
    """One of every family; `python -m benchmarks.model_campaign` tries 300."""
    assert len(tried) == len(FAMILIES)
    harmful = [verdict for verdict in tried if verdict.fault]
    assert [f"{one.seed} ({one.kind}): {one.fault}" for one in harmful] == []
    assert any(verdict.refused for verdict in tried)


@pytest.mark.parametrize(
    ("answer", "forged", "message"),
    [
        ({"probability": float("nan")}, True, "not finite"),
        ({"probability": 0.2}, False, "another answer"),
        ({"probability": 0.2}, True, ""),
        ({"probability": 0.1, "model": "elsewhere"}, False, ""),
    ],
)
def test_the_judge_sees_a_wrong_answer(monkeypatch, tmp_path, answer, forged, message):
    def answered(words):
        return (0, json.dumps(answer), "") if words[0] == "predict" else (0, "", "")

    monkeypatch.setattr(_model_judge, "said", answered)
    untouched = {"cnn": {"probability": 0.1, "model": "here"}}
    mutant = Mutant(kind="cnn: nothing", forged=forged)
    fault, _, refused = judge(tmp_path, mutant, untouched)
    assert message in fault
    assert bool(message) == bool(fault)
    assert not refused


def flipped(path, bit):
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def test_one_flipped_bit_anywhere_in_the_weights_is_refused(cnn):
    path = cnn / "model.safetensors"
    assert open_network(cnn).description.is_signed
    untouched = path.read_bytes()
    n_bits = 8 * len(untouched)
    for bit in np.random.default_rng(0).integers(0, n_bits, 20).tolist():
        flipped(path, bit)
        with pytest.raises(DatasetError, match="safetensors"):
            tensors_of(cnn)
        path.write_bytes(untouched)
    flipped(path, n_bits - 1)
    assert "sha256" in check_model(cnn).problems[0]
    path.write_bytes(untouched)
    assert not check_model(cnn).problems


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3e38])
def test_weights_that_give_no_finite_answer_are_refused_even_signed(cnn, value):
    """A stranger can sign anything; the digests alone would not do."""
    tensors = dict(load_file(cnn / "model.safetensors"))
    tensors["head.1.weight"] = np.full_like(tensors["head.1.weight"], value)
    tensors["blocks.0.weight"] = np.full_like(tensors["blocks.0.weight"], 3e38)
    tensors["blocks.1.running_var"] = np.full_like(
        tensors["blocks.1.running_var"], 1e-9
    )
    tensors["blocks.1.bias"] = np.full_like(tensors["blocks.1.bias"], 3e38)
    save_file(tensors, cnn / "model.safetensors")
    forge(cnn)
    with pytest.raises(DatasetError, match="not finite"):
        open_network(cnn)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_one_weight_that_is_not_finite_names_its_tensor(cnn, value):
    tensors = dict(load_file(cnn / "model.safetensors"))
    tensors["head.1.weight"].flat[-1] = value
    save_file(tensors, cnn / "model.safetensors")
    forge(cnn)
    with refused("tensor 'head.1.weight' holds numbers that are not", DatasetError):
        open_network(cnn)


def test_an_answer_that_is_not_finite_is_none():
    require_finite(severity=np.array([0.0, 1.0]))
    with pytest.raises(DatasetError, match="1 of 2 values of its severity"):
        require_finite(severity=np.array([0.0, np.nan]))


@pytest.mark.parametrize(
    "name",
    [
        "10^6 channels",
        "200 channels",
        "10^5 classes",
        "900 classes",
        "window of 10^9",
        "widths of 10^9",
        "widths of 2000",
        "kernels of 10^9",
        "kernels of 1999",
        "10^5 layers",
        "strides of 0",
        "hidden of 10^9",
        "teeth of 10^9",
        "resamples of 10^12",
    ],
)
def test_absurd_sizes_are_refused(cnn, name):
    content = json.loads((cnn / "model.json").read_text())
    SIZES[name](content)
    forge(cnn, content)
    with pytest.raises(GensigError) as refusal:
        open_network(cnn)
    assert "\n" not in str(refusal.value)


def test_a_network_is_built_without_memory_before_the_file_is_read(cnn, monkeypatch):
    """Weights of 16 MB that a file of 6 kB cannot hold are never allocated."""
    content = json.loads((cnn / "model.json").read_text())
    SIZES["widths of 2000"](content)
    forge(cnn, content)
    devices = []

    def built(*given, **named):
        network = build_model(*given, **named)
        devices.append(next(network.parameters()).device.type)
        return network

    monkeypatch.setattr(diagnose.networks.registry, "build_model", built)
    with pytest.raises(DatasetError, match="does not fit"):
        open_network(cnn)
    assert devices == ["meta"]


@pytest.mark.parametrize("name", ["model.json", "model.safetensors"])
@pytest.mark.parametrize("kind", ["pipe", "link", "folder", "device"])
def test_only_ordinary_files_are_read(cnn, name, kind):
    path = cnn / name
    path.rename(cnn / "kept")
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to({"link": cnn / "kept", "device": "/dev/zero"}[kind])
    with pytest.raises(DatasetError, match=r"link|no ordinary file"):
        open_network(cnn)
    assert check_model(cnn).problems


def test_of_a_description_that_cannot_be_read_nothing_is_counted(cnn):
    (cnn / "model.json").write_text("{")
    counted = check_model(cnn).content()
    assert (counted["n_files"], counted["n_weights"]) == (0, 0)


@pytest.mark.parametrize("value", ["", "a" * (LONGEST_TEXT + 1), 1])
def test_a_text_has_a_length(value):
    with pytest.raises(ValueError, match="is no text of 1 to"):
        text("method", value)


def test_an_older_model_opens_with_a_note(template, cnn):
    content = json.loads((cnn / "model.json").read_text())
    old = {key: content[key] for key in content if key not in ("files", "sha256")}
    (cnn / "model.json").write_text(json.dumps(old | {"model_schema_version": 2}))
    check = check_model(cnn)
    assert not check.problems
    assert "without the sha256" in check.notes[0]
    words = ASKED[0].words(template)
    words[words.index("--model") + 1] = str(cnn)
    status, answer, error = said(words)
    assert status == 3
    assert "without the sha256" in error
    whole = json.loads(said(ASKED[0].words(template))[1])
    assert json.loads(answer)["probabilities"] == whole["probabilities"]


@pytest.mark.parametrize(
    "change",
    [
        lambda content: content | {"model_schema_version": 2},
        lambda content: {k: v for k, v in content.items() if k != "files"},
        lambda content: {k: v for k, v in content.items() if k != "sha256"},
        lambda content: content | {"temperature": 1.31},
    ],
)
def test_the_digests_cannot_be_lost_by_accident(cnn, change):
    content = json.loads((cnn / "model.json").read_text())
    (cnn / "model.json").write_text(json.dumps(change(content)))
    with pytest.raises(DatasetError, match="was altered"):
        open_network(cnn)


def test_layout_and_order_of_a_description_do_not_matter(cnn):
    content = json.loads((cnn / "model.json").read_text())
    (cnn / "model.json").write_text(json.dumps(dict(reversed(content.items()))))
    assert not check_model(cnn).problems
    assert content["sha256"] == content_digest(content)


def test_verify_names_every_problem_of_a_study(template, tmp_path):
    study = shutil.copytree(template, tmp_path / "study" / "models").parent
    assert said(["verify", str(study)])[0] == 0
    flipped(study / "models" / "cnn" / "model.safetensors", 9000)
    (study / "models" / "hours" / "notes.txt").write_text("mine")
    (study / "models" / "any_pair" / "README.md").write_text("better")
    (study / "models" / "tooth_logistic" / "model.json").unlink()
    status, text, _ = said(["verify", str(study)])
    assert status == 1
    found = (
        "sha256 is not the one",
        "is not listed",
        "README.md was altered",
        "no model.json",
    )
    assert all(line in text for line in found)
    status, text, _ = said(["verify", str(study), "--json"])
    contents = json.loads(text)
    assert status == 1
    assert [content["complete"] for content in contents] == [False] * 4
    assert len(models_in(study)) == 4


def test_verify_of_a_folder_without_models_is_a_mistake(tmp_path):
    status, _, error = said(["verify", str(tmp_path)])
    assert status == 2
    assert error.count("\n") == 1


def test_the_shipped_network_has_the_digests_of_its_files():
    check = check_model(shipped_network())
    assert not check.problems
    assert not check.notes
    assert check.n_files == 3


@pytest.mark.parametrize("umask", UMASKS)
def test_stored_files_have_the_mode_of_the_umask(umask, tmp_path):
    before = os.umask(umask)
    try:
        make_models(tmp_path / "models")
    finally:
        os.umask(before)
    stored = [path for path in (tmp_path / "models" / "cnn").iterdir()]
    assert len(stored) == 2
    assert {path.stat().st_mode & 0o777 for path in stored} == {0o666 & ~umask}
