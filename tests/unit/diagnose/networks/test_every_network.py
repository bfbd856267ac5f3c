"""Laws of every registered network: its shape, its declared input, its stored form, its bits."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from small_studies import run, study_of

from diagnose.data.inputs import RecordedSignal
from diagnose.data.windows import subset_segments
from diagnose.networks.registry import MODELS, build_model, check_example, input_of
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_model, model_description, save_model

OPTIONS = {
    "small_cnn": ["model=cnn"],
    "order_cnn": ["model=order", "model.samples_per_tooth=16", "model.kernels=[9,5,5]"],
    "tooth_network": ["model=tooth", "model.samples_per_tooth=16"],
}
QUICK = ["epochs=1", "epoch_fraction=0.2"]


@pytest.fixture(scope="module")
def dataset():
    return FakeDataset(n_units=8, records_per_unit=4, n_channels=2, duration=0.2)


@pytest.fixture(scope="module", params=MODELS)
def study(request, dataset):
    """Task, settings, prediction and input shapes of a study with one kind of network."""
    network = MODELS[request.param]
    task, settings = study_of(dataset, *QUICK, *OPTIONS[request.param])
    shapes = set()
    loss = network.loss

    def watched(self, windows, *targets):
        shapes.add(tuple(windows.shape[1:]))
        return loss(self, windows, *targets)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(network, "loss", watched)
        (prediction,) = run(task, settings)
    return task, settings, prediction, shapes


def test_scores_have_their_shape_for_the_declared_input(study):
    task, settings, *_ = study
    torch.manual_seed(0)
    model = build_model(settings.model, n_channels=2, n_classes=4).eval()
    inputs = input_of(settings.model)
    example = inputs.example(2, task.window_samples)
    check_example(model, example)
    windows = inputs.load(task, subset_segments(task, "by_unit", "test"))
    batch = torch.from_numpy(windows.cut(np.arange(3)))
    assert batch.shape[:2] == (3, example.shape[1])
    with torch.inference_mode():
        assert model(batch).shape == (3, 4)
        assert model.answers(batch)["classes"].equal(model(batch))


def test_a_training_feeds_the_declared_input(study):
    task, settings, _, shapes = study
    inputs = input_of(settings.model)
    windows = inputs.load(task, subset_segments(task, "by_unit", "test"))
    assert shapes == {windows.cut(np.arange(1)).shape[1:]}


def test_stored_and_loaded_it_predicts_the_same(study, tmp_path):
    task, settings, prediction, _ = study
    description = model_description(task, settings, prediction)
    save_model(tmp_path, prediction.weights, description)
    model, description = load_model(tmp_path)
    assert description.temperature == prediction.temperature
    inputs = input_of(description.model)
    assert inputs == input_of(settings.model)
    windows = inputs.load(task, subset_segments(task, "by_unit", "test"))
    log_probability = predict_windows(model, windows)
    expected = prediction.parts["windows"].answers
    np.testing.assert_allclose(log_probability, expected, rtol=1e-4, atol=1e-5)
    record = int(windows.record[0])
    recorded = RecordedSignal(
        signal=task.dataset.signals(record),
        sampling_rate=task.dataset.sampling_rate,
        speed_rpm=float(task.dataset.column("speed_rpm")[record]),
        file="a.npz",
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        n_teeth=description.n_teeth,
    )
    stored = windows.cut(np.flatnonzero(windows.record == record))
    of_recording = inputs.of_recording(recorded).cut(np.arange(len(stored)))
    np.testing.assert_array_equal(of_recording, stored)
    faster = inputs.of_recording(replace(recorded, speed_rpm=1.01 * recorded.speed_rpm))
    same = np.array_equal(faster.cut(np.arange(1)), stored[:1])
    assert same == inputs.has_window_length  # turns depend on the speed, windows do not


def test_the_same_seed_gives_the_same_bits(study):
    task, settings, prediction, _ = study
    (second,) = run(task, settings)
    np.testing.assert_equal(prediction.weights, second.weights)
