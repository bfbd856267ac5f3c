"""Networks that look at turns, and what they are told beside the class: laws, a training, the way to disk and back."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose

from diagnose.data.targets import fault_places, further_loss, place_loss, record_targets
from diagnose.data.windows import subset_segments
from diagnose.networks.registry import build_model, input_of
from diagnose.recordings.evaluate import evaluate_network
from diagnose.recordings.predict import predict_recording
from diagnose.recordings.registry import open_network
from diagnose.recordings.source import Source
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit
from diagnose.scoring.predictions import Prediction
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import plan_study, settings_for, task_from
from diagnose.training.heads import head_scores, heads_notes, predict_heads
from diagnose.training.store import model_description, save_model
from gensig.errors import ConfigError, DatasetError
from gensig.options.compose import compose

SMALL = [
    "model=order",
    "heads=[severity,gear]",
    "model.samples_per_tooth=32",
    "model.widths=[12,16,24]",
    "model.kernels=[17,5,5]",
]
PER_TOOTH = 2  # places: 32 samples a tooth over strides 4, 2, 2


def make_settings(dataset, *overrides):
    words = [
        "data=x",
        "out=y",
        "seeds=[0]",
        "n_threads=1",
        "n_bootstrap=100",
        "protocols=[by_unit]",
        *SMALL,
    ]
    return settings_for(dataset, settings_from(compose("train", [*words, *overrides])))


def make_model(dataset, *overrides, n_classes=2):
    torch.manual_seed(0)
    return build_model(
        make_settings(dataset, *overrides).model,
        n_channels=1,
        n_classes=n_classes,
    ).eval()


@pytest.fixture(scope="module")
def dataset():
    torch.set_num_threads(1)
    made = FakeDataset(
        n_units=16,
        records_per_unit=6,
        classes=("healthy", "missing_tooth"),
        duration=0.3,
        noise=0.4,
    )
    made.columns["fault_gear"] = np.where(made.columns["label"] > 0, "pinion", "")
    return made


def test_a_record_is_one_input_and_in_training_its_halves_too(dataset):
    settings = make_settings(dataset)
    task, config = task_from(dataset, settings), settings.model
    segments = subset_segments(task, "by_unit", "train")
    inputs = input_of(config)
    whole, more = (
        inputs.load(task, segments),
        inputs.load(task, segments, training=True),
    )
    assert config["n_teeth"] == [23, 84]
    assert len(more) == 3 * len(whole) == 3 * len(segments.record)
    assert (
        whole.cut(np.arange(2)).shape == (2, 1, inputs.n_points(1)) == (2, 1, 32 * 108)
    )
    assert_allclose(np.mean(whole.cut(np.arange(5)) ** 2, axis=-1), 1.0, rtol=1e-4)
    assert set(np.unique(more.record)) == set(segments.record)


def test_scores_do_not_depend_on_which_tooth_comes_first(dataset):
    model = make_model(dataset, "model.gears=[pinion,wheel]")
    x = torch.randn(3, 1, 32 * 108, generator=torch.Generator().manual_seed(0))
    driving, driven, mesh = x.split([32 * 23, 32 * 84, 32], dim=-1)
    turned = torch.cat(
        [driving.roll(5 * 32, -1), driven.roll(-9 * 32, -1), mesh], dim=-1
    )
    torch.testing.assert_close(model(turned), model(x), rtol=1e-4, atol=1e-5)
    mixed = driving.reshape(3, 1, 23, 32)[:, :, torch.randperm(23)].reshape(
        3,
        1,
        -1,
    )  # other neighbours
    assert not torch.allclose(
        model(torch.cat([mixed, driven, mesh], dim=-1)),
        model(x),
        rtol=1e-4,
        atol=1e-5,
    )


def test_a_gear_that_is_left_out_is_not_looked_at(dataset):
    x = torch.randn(2, 1, 32 * 108, generator=torch.Generator().manual_seed(0))
    changed = x.clone()
    changed[..., 32 * 23 : -32] += 1.0
    for gears, same in (("pinion", True), ("wheel", False)):
        model = make_model(dataset, f"model.gears=[{gears}]")
        assert torch.allclose(model(x), model(changed)) == same


def test_the_place_of_a_fault_moves_with_the_window():
    """A passage later every tooth is one nearer; a tooth that is in mesh at the first sample is at minus the phase."""
    columns = {
        "fault_gear": np.array(["pinion", "wheel", "", "pinion"]),
        "fault_tooth": np.array([7, 80, -1, -1]),
        "start_tooth_pinion": np.array([7, 3, 0, 0]),
        "start_tooth_wheel": np.array([1, 2, 0, 0]),
        "start_phase": np.array([0.25, 0.5, 0.0, 0.0]),
    }
    dataset = SimpleNamespace(column_names=list(columns), column=columns.__getitem__)
    record = np.arange(4)
    first = fault_places(dataset, record, np.zeros(4), (23, 84))
    assert_allclose(first, [22.75, 77.5, np.nan, np.nan])
    assert_allclose(
        fault_places(dataset, record, np.full(4, 3.5), (23, 84))[:2], [19.25, 74.0]
    )
    assert_allclose(
        fault_places(dataset, record, np.array([23.0, 84.0, 0.0, 0.0]), (23, 84)),
        first,
    )
    del columns["start_phase"]
    dataset = SimpleNamespace(column_names=list(columns), column=columns.__getitem__)
    assert np.isnan(fault_places(dataset, record, np.zeros(4), (23, 84))).all()


def test_the_place_loss_is_small_where_the_scores_point_at_the_fault_only():
    turns = ((1, 23), (2, 84))
    label, gear, place = (
        torch.tensor([1, 1]),
        torch.tensor([1, 2]),
        torch.tensor([22.5, 40.0]),
    )
    right = torch.zeros(2, 2, 107 * PER_TOOTH)
    right[0, 1, 1 * PER_TOOTH] = (
        20.0  # a tooth and a half after the last tooth but a half: around the end of the turn
    )
    right[1, 1, (23 + 41) * PER_TOOTH] = 20.0
    wrong = right.flip(0)  # at the other gear
    assert place_loss(right, label, gear, place, turns) < 1e-3
    assert place_loss(wrong, label, gear, place, turns) > 10
    of_other_class = place_loss(right, 1 - label, gear, place, turns)
    level = place_loss(torch.zeros_like(right), label, gear, place, turns)
    torch.testing.assert_close(of_other_class, level)
    nothing = place_loss(
        right,
        label,
        torch.zeros(2, dtype=torch.long),
        torch.full((2,), float("nan")),
        turns,
    )
    assert float(nothing) == 0.0


def test_a_sound_record_has_no_severity_to_learn():
    said, label = (
        {"severity": torch.tensor([[-9.0, 5.0], [-5.0, -5.0]])},
        torch.tensor([1, 0]),
    )
    known = {"severity": torch.tensor([1.0, float("nan")])}
    assert further_loss(said, label, known) < 0.01
    assert further_loss({"severity": -said["severity"]}, label, known) > 4


def test_a_visible_fault_is_learnt_stored_judged_and_predicted(dataset, tmp_path):
    settings = make_settings(
        dataset, "epochs=8", "epoch_fraction=0.6", "learning_rate=0.01"
    )
    task = task_from(dataset, settings)
    plan_study(task, settings)
    (found,) = run_jobs(
        task,
        settings,
        [Job(protocols=("by_unit",), seed=0)],
        n_workers=1,
        on_done=lambda _: None,
    )
    label = task.labels()[found.record]
    assert (
        balanced_accuracy(
            confusion_by_unit(label, found.predicted, np.zeros_like(label), 2)[0]
        )
        > 0.8
    )
    scores = head_scores(
        task,
        subset_segments(task, "by_unit", "train").record,
        [found],
        n_bootstrap=50,
    )
    assert (
        scores["faulted_gear"]["balanced_accuracy"]["mean"]
        > 0.7
        > scores["faulted_gear"]["chance"]
        == 0.5
    )
    json.dumps(scores, allow_nan=False)
    assert len(heads_notes({"by_unit": {"heads": scores}})) == 1

    save_model(tmp_path / "m", found.weights, model_description(task, settings, found))
    network = open_network(tmp_path / "m")
    description = network.description
    assert description.model["heads"] == ["severity", "gear"]
    judged = evaluate_network(network, dataset).result
    assert judged["balanced_accuracy"]["mean"] > 0.8

    record = int(found.record[0])
    np.savez(tmp_path / "a.npz", acceleration=dataset.signals(record))
    speed = float(dataset.column("speed_rpm")[record])
    source = Source(
        file=str(tmp_path / "a.npz"), sampling_rate=12800.0, speed_rpm=speed
    )
    result = predict_recording(network, None, source)
    assert result["class"] == task.class_names[found.predicted[0]]
    assert_allclose(
        result["severity"], found.heads["severity"][0, found.predicted[0]], rtol=1e-3
    )
    assert (result["gear"] != "none") == (", severity" in network.line(result))
    with pytest.raises(ConfigError, match="say --speed-rpm"):
        predict_recording(network, None, replace(source, speed_rpm=None))


def test_heads_that_are_right_have_no_error(dataset):
    settings = make_settings(dataset)
    task = task_from(dataset, settings)
    record = np.arange(dataset.n_records)
    truth = record_targets(dataset, record)
    gear = np.log(np.eye(3)[truth["gear"]] + 1e-9)
    run = Prediction(
        protocol="by_unit",
        method="order",
        seed=0,
        record=record,
        log_probability=np.zeros((record.size, 2)),
        detail="",
        heads={
            "severity": np.tile(np.nan_to_num(truth["severity"])[:, None], 2),
            "gear": gear,
        },
    )
    scores = head_scores(task, record, [run], n_bootstrap=20)
    assert scores["faulted_gear"]["balanced_accuracy"]["low"] == 1.0
    error = scores["severity_mae"]["missing_tooth"]
    assert error["mean"] == error["high"] == 0.0 < error["constant"]


def test_a_network_without_heads_says_nothing_beside(dataset):
    settings = make_settings(dataset, "heads=false")
    assert "heads" not in settings.model
    task = task_from(dataset, settings)
    windows = input_of(settings.model).load(
        task, subset_segments(task, "by_unit", "test")
    )
    assert predict_heads(make_model(dataset, "heads=false"), windows) == {}


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ("model.gears=[sun]", "gears must be a list out of pinion, wheel"),
        ("model.gears=[]", "gears must be a list"),
        ("model.kernels=[16,5,5]", "kernels must be odd"),
        ("model.widths=[8]", "lists of the same length"),
        (
            "heads=[tooth]",
            "heads must be false or a list of different names out of severity, gear",
        ),
        ("heads=[gear,gear]", "heads must be false or a list"),
    ],
)
def test_bad_settings_are_refused_in_one_line(dataset, override, line):
    with pytest.raises(ConfigError, match=line):
        make_model(dataset, override)


def test_what_a_turn_needs_and_is_not_there_is_said(dataset):
    without = FakeDataset(duration=0.01)
    without.attributes = {
        name: value
        for name, value in without.attributes.items()
        if name != "n_teeth_wheel"
    }
    with pytest.raises(ConfigError, match="does not say n_teeth_wheel"):
        make_settings(without)
    short = FakeDataset(duration=0.01)
    settings = make_settings(short)
    task = task_from(short, settings)
    with pytest.raises(
        ConfigError,
        match=r"holds 0\.\d+ turns of the pinion, and model order needs a whole one",
    ):
        plan_study(task, settings)
    with pytest.raises(DatasetError, match="this model needs longer records"):
        input_of(settings.model).load(task, subset_segments(task, "by_unit", "test"))
