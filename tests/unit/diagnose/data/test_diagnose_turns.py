"""Networks on turns, and further heads: laws, a training, and predictions of a stored network."""

import json
from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import LEARNS, accuracy, plan_of, run, study_of

from diagnose.data.packed_turns import HEADER
from diagnose.data.targets import (
    fault_positions,
    further_loss,
    position_loss,
    record_targets,
)
from diagnose.data.windows import subset_segments
from diagnose.networks.registry import build_model, input_of
from diagnose.recordings.evaluate import evaluate_network
from diagnose.recordings.predict import predict_recording
from diagnose.recordings.registry import open_network
from diagnose.recordings.source import Source
from diagnose.scoring.predictions import Prediction
from diagnose.training.heads import head_scores, heads_notes, predict_heads
from diagnose.training.store import model_description, save_model
from gensig.errors import ConfigError, DatasetError

ORDER = [
    "model=order",
    "heads=[severity,gear]",
    "model.samples_per_tooth=32",
    "model.widths=[12,16,24]",
    "model.kernels=[17,5,5]",
]
PER_TOOTH = 2  # positions: 32 samples a tooth over strides 4, 2, 2
TEETH = (23, 84)


def make_model(dataset, *overrides):
    torch.manual_seed(0)
    config = study_of(dataset, *ORDER, *overrides)[1].model
    return build_model(config, n_channels=1, n_classes=2).eval()


@pytest.fixture(scope="module")
def dataset():
    classes = ("healthy", "missing_tooth")
    shape = {"n_units": 16, "records_per_unit": 6, "duration": 0.3}
    made = FakeDataset(classes=classes, noise=0.4, **shape)
    made.columns["fault_gear"] = np.where(made.columns["label"] > 0, "pinion", "")
    return made


@pytest.fixture(scope="module")
def turns():
    random = torch.randn(3, 1, 32 * 108, generator=torch.Generator().manual_seed(0))
    return torch.cat([header(), random], dim=-1)


def header():
    """Tooth counts before the turns of three windows."""
    return torch.tensor(TEETH, dtype=torch.float32).expand(3, 1, HEADER)


def test_a_record_is_one_input_and_in_training_its_halves_too(dataset):
    task, settings = study_of(dataset, *ORDER)
    segments = subset_segments(task, "by_unit", "train")
    inputs = input_of(settings.model)
    whole = inputs.load(task, segments)
    more = inputs.load(task, segments, training=True)
    assert settings.model["n_teeth"] == list(TEETH)
    assert len(more) == 3 * len(whole) == 3 * len(segments.record)
    assert inputs.example(1, 1).shape == (1, 1, HEADER + 32 * 108)
    packed = whole.cut(np.arange(5))
    assert packed.shape == (5, 1, HEADER + 32 * 108)
    assert_array_equal(packed[:, 0, :HEADER], [TEETH] * 5)
    assert_allclose(np.mean(packed[..., HEADER:] ** 2, axis=-1), 1.0, rtol=1e-4)
    assert set(np.unique(more.record)) == set(segments.record)


def test_scores_do_not_depend_on_which_tooth_comes_first(dataset, turns):
    model = make_model(dataset, "model.gears=[pinion,wheel]")
    lengths = [HEADER, 32 * 23, 32 * 84, 32]
    _, driving, driven, mesh = turns.split(lengths, dim=-1)
    rolled = [driving.roll(5 * 32, -1), driven.roll(-9 * 32, -1), mesh]
    other = driving.reshape(3, 1, 23, 32)[:, :, torch.randperm(23)].reshape(3, 1, -1)
    for parts, same in ((rolled, True), ([other, driven, mesh], False)):
        scores = model(torch.cat([header(), *parts], dim=-1))
        assert torch.allclose(scores, model(turns), rtol=1e-4, atol=1e-5) == same


@pytest.mark.parametrize(("gears", "same"), [("pinion", True), ("wheel", False)])
def test_a_gear_that_is_left_out_has_no_effect(dataset, turns, gears, same):
    changed = turns.clone()
    changed[..., HEADER + 32 * 23 : -32] += 1.0
    model = make_model(dataset, f"model.gears=[{gears}]")
    assert torch.allclose(model(turns), model(changed)) == same


def test_the_position_of_a_fault_moves_with_the_window():
    """A passage later every tooth is one nearer; the first tooth in mesh is at minus the phase."""
    columns = {
        "fault_gear": np.array(["pinion", "wheel", "", "pinion"]),
        "fault_tooth": np.array([7, 80, -1, -1]),
        "start_tooth_pinion": np.array([7, 3, 0, 0]),
        "start_tooth_wheel": np.array([1, 2, 0, 0]),
        "start_phase": np.array([0.25, 0.5, 0.0, 0.0]),
    }

    def positions(passages):
        dataset = SimpleNamespace(column_names=list(columns), column=columns.get)
        return fault_positions(
            dataset, np.arange(4), np.array(passages), np.tile(TEETH, (4, 1))
        )

    first = positions([0.0] * 4)
    assert_allclose(first, [22.75, 77.5, np.nan, np.nan])
    assert_allclose(positions([3.5] * 4)[:2], [19.25, 74.0])
    assert_allclose(positions([23.0, 84.0, 0.0, 0.0]), first)
    del columns["start_phase"]
    assert np.isnan(positions([0.0] * 4)).all()


def test_the_position_loss_is_small_if_the_scores_point_at_the_fault_only():
    label, gear = torch.tensor([1, 1]), torch.tensor([1, 2])
    position, gears = torch.tensor([22.5, 40.0]), ((1, 23), (2, 84))
    right = torch.zeros(2, 2, 107 * PER_TOOTH)
    # 1.5 teeth after tooth 22.5: around the end of the turn
    right[0, 1, 1 * PER_TOOTH] = 20.0
    right[1, 1, (23 + 41) * PER_TOOTH] = 20.0
    assert position_loss(right, label, gear, position, gears) < 1e-3
    other_gear = right.flip(0)
    assert position_loss(other_gear, label, gear, position, gears) > 10
    of_other_class, blind = (
        position_loss(places, 1 - label, gear, position, gears)
        for places in (right, 0 * right)
    )
    torch.testing.assert_close(of_other_class, blind)
    unknown = position * np.nan
    assert position_loss(right, label, 0 * gear, unknown, gears) == 0.0


def test_a_sound_record_has_no_severity_to_learn():
    severity, label = torch.tensor([[-9.0, 5.0], [-5.0, -5.0]]), torch.tensor([1, 0])
    known = {"severity": torch.tensor([1.0, float("nan")])}
    assert further_loss({"severity": severity}, label, known) < 0.01
    assert further_loss({"severity": -severity}, label, known) > 4


def test_a_visible_fault_is_learnt_stored_evaluated_and_predicted(dataset, tmp_path):
    task, settings = study_of(dataset, *ORDER, *LEARNS)
    plan_of(task, settings)
    (prediction,) = run(task, settings)
    assert accuracy(task, prediction.record, prediction.predicted) > 0.8
    trained_on = subset_segments(task, "by_unit", "train").record
    scores = head_scores(task, trained_on, [prediction], n_bootstrap=50)
    gear = scores["faulted_gear"]
    assert gear["balanced_accuracy"]["mean"] > 0.7 > gear["chance"] == 0.5
    json.dumps(scores, allow_nan=False)
    assert len(heads_notes({"by_unit": {"heads": scores}})) == 1

    description = model_description(task, settings, prediction)
    save_model(tmp_path / "m", prediction.weights, description)
    network = open_network(tmp_path / "m")
    assert network.description.model["heads"] == ["severity", "gear"]
    evaluated, _ = evaluate_network(network, dataset)
    assert evaluated["balanced_accuracy"]["mean"] > 0.8

    record, label = int(prediction.record[0]), prediction.predicted[0]
    file = str(tmp_path / "a.npz")
    np.savez(file, acceleration=dataset.signals(record))
    speed = float(dataset.column("speed_rpm")[record])
    source = Source(file=file, sampling_rate=12800.0, speed_rpm=speed)
    result = predict_recording(network, None, source)
    assert result["class"] == task.class_names[label]
    severity = prediction.further["severity"][0, label]
    assert_allclose(result["severity"], severity, rtol=1e-3)
    assert (result["gear"] != "none") == (", severity" in network.line(result))
    with pytest.raises(ConfigError, match="give --speed-rpm"):
        predict_recording(network, None, replace(source, speed_rpm=None))


def test_faults_of_further_gears_are_on_neither_of_the_two(dataset):
    columns = {**dataset.columns, "fault_gear": dataset.columns["fault_gear"].copy()}
    record = np.flatnonzero(columns["fault_gear"] != "")[:2]
    columns["fault_gear"] = columns["fault_gear"].astype("U16")
    columns["fault_gear"][record] = "output_gear"
    line = copy(dataset)
    line.columns = columns
    targets = record_targets(line, record)
    assert targets["gear"].tolist() == [0, 0]
    assert np.all(targets["severity"] > 0.0)
    assert np.all(record_targets(dataset, record)["gear"] > 0)


def test_heads_that_are_right_have_no_error(dataset):
    task, _ = study_of(dataset, *ORDER)
    record = np.arange(dataset.n_records)
    truth = record_targets(dataset, record)
    severity = np.tile(np.nan_to_num(truth["severity"])[:, None], 2)
    right = Prediction(
        protocol="by_unit",
        method="order",
        seed=0,
        record=record,
        answers=np.zeros((record.size, 2)),
        detail="",
        further={"severity": severity, "gear": np.log(np.eye(3)[truth["gear"]] + 1e-9)},
    )
    scores = head_scores(task, record, [right], n_bootstrap=20)
    assert scores["faulted_gear"]["balanced_accuracy"]["low"] == 1.0
    error = scores["severity_mae"]["missing_tooth"]
    assert error["mean"] == error["high"] == 0.0 < error["constant"]


def test_a_network_without_heads_has_no_further_answers(dataset):
    task, settings = study_of(dataset, *ORDER, "heads=false")
    assert "heads" not in settings.model
    segments = subset_segments(task, "by_unit", "test")
    windows = input_of(settings.model).load(task, segments)
    assert predict_heads(make_model(dataset, "heads=false"), windows) == {}


def test_missing_tooth_counts_and_short_records_are_refused():
    dataset = FakeDataset(duration=0.01)
    task, settings = study_of(dataset, *ORDER)
    message = r"holds 0\.\d+ turns of the pinion, and model order needs a whole one"
    with pytest.raises(ConfigError, match=message):
        plan_of(task, settings)
    with pytest.raises(DatasetError, match="this model needs longer records"):
        input_of(settings.model).load(task, subset_segments(task, "by_unit", "test"))
    del dataset.attributes["n_teeth_wheel"]
    with pytest.raises(ConfigError, match="does not say n_teeth_wheel"):
        study_of(dataset, *ORDER)
