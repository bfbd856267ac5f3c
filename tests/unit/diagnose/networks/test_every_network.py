"""Laws of every registered network: its shape, its declared input, its way to disk, its bits."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset

from diagnose.data.inputs import NetworkInput, RecordedSignal
from diagnose.data.turns import Turns
from diagnose.data.window_input import Windows
from diagnose.data.windows import subset_segments
from diagnose.networks.registry import MODELS, build_model, check_window, input_of
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.study import settings_for, task_from
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_model, model_description, save_model
from gensig.options.compose import compose

OPTIONS = {
    "small_cnn": ["model=cnn"],
    "wdcnn": ["model=wdcnn"],
    "spectrum_cnn": ["model=spectrum"],
    "order_cnn": ["model=order", "model.samples_per_tooth=16", "model.kernels=[9,5,5]"],
}
DECLARED = {
    "small_cnn": Windows,
    "wdcnn": Windows,
    "spectrum_cnn": Windows,
    "order_cnn": Turns,
}
QUICK = [
    "window_samples=1200", "stride_samples=1000", "seeds=[0]", "n_threads=1", "n_bootstrap=50",
    "epochs=1", "epoch_fraction=0.2", "protocols=[by_unit]",
]  # fmt: skip
TRAINING = Job(protocols=("by_unit",), seed=0)


@pytest.fixture(scope="module")
def dataset():
    torch.set_num_threads(1)
    return FakeDataset(n_units=8, records_per_unit=4, n_channels=2, duration=0.2)


@pytest.fixture(params=MODELS)
def study(request, dataset):
    """Task and settings of a study with one kind of network."""
    words = ["data=x", "out=y", *QUICK, *OPTIONS[request.param]]
    settings = settings_for(dataset, settings_from(compose("train", words)))
    return task_from(dataset, settings), settings


def trained(task, settings, seed=0):
    (found,) = run_jobs(
        task,
        settings,
        [replace(TRAINING, seed=seed)],
        n_workers=1,
        on_done=lambda _: None,
    )
    return found


def built(settings):
    torch.manual_seed(0)
    return build_model(settings.model, n_channels=2, n_classes=4).eval()


def test_every_network_declares_what_it_reads():
    assert {kind: network.inputs for kind, network in MODELS.items()} == DECLARED


def test_scores_have_their_shape_for_the_declared_input(study):
    task, settings = study
    inputs, model = input_of(settings.model), built(settings)
    n_points = inputs.n_points(task.window_samples)
    check_window(model, 2, n_points)
    windows = inputs.load(task, subset_segments(task, "by_unit", "test"))
    batch = torch.from_numpy(windows.cut(np.arange(3)))
    assert batch.shape == (3, 2, n_points)
    with torch.inference_mode():
        assert model(batch).shape == (3, 4)
        assert model.answers(batch)["classes"].equal(model(batch))


def fed_to(network, monkeypatch, task, settings):
    """Shapes of the batches that a training gives to the network."""
    shapes = set()
    forward = network.look

    def look(self, windows):
        shapes.add(tuple(windows.shape[1:]))
        return forward(self, windows)

    monkeypatch.setattr(network, "look", look)
    trained(task, settings)
    return shapes


def test_a_training_feeds_the_declared_input(study, monkeypatch):
    task, settings = study
    expected = {(2, input_of(settings.model).n_points(task.window_samples))}
    assert (
        fed_to(MODELS[settings.model["kind"]], monkeypatch, task, settings) == expected
    )


def test_a_network_that_declares_another_input_is_fed_that(dataset, monkeypatch):
    """The twin of the law above: the declaration decides, not the name of the network."""

    class OnTurns(MODELS["small_cnn"]):
        inputs: ClassVar[type[NetworkInput]] = Turns

        def __init__(self, *, n_teeth, samples_per_tooth, **parameters):
            super().__init__(**parameters)

    monkeypatch.setitem(MODELS, "small_cnn", OnTurns)
    words = ["data=x", "out=y", *QUICK, "model=cnn", "+model.samples_per_tooth=16"]
    settings = settings_for(dataset, settings_from(compose("train", words)))
    task = task_from(dataset, settings)
    assert settings.model["n_teeth"] == [23, 84]
    fed = fed_to(OnTurns, monkeypatch, task, settings)
    assert fed == {(2, 16 * (23 + 84 + 1))}
    assert fed != {(2, task.window_samples)}


def test_stored_and_loaded_it_says_the_same_of_records_and_recordings(study, tmp_path):
    task, settings = study
    found = trained(task, settings)
    save_model(tmp_path / "m", found.weights, model_description(task, settings, found))
    model, description = load_model(tmp_path / "m")
    inputs = input_of(description.model)
    assert inputs == input_of(settings.model)
    windows = inputs.load(task, subset_segments(task, "by_unit", "test"))
    said = predict_windows(model, windows)
    np.testing.assert_allclose(
        said, found.windows.log_probability, rtol=1e-4, atol=1e-5
    )
    record = int(windows.record[0])
    recorded = RecordedSignal(
        signal=task.dataset.signals(record),
        sampling_rate=task.dataset.sampling_rate,
        speed_rpm=float(task.dataset.column("speed_rpm")[record]),
        file="a.npz",
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
    )
    mine = np.flatnonzero(windows.record == record)
    of_recording = inputs.of_recording(recorded)
    np.testing.assert_array_equal(
        of_recording.cut(np.arange(mine.size)), windows.cut(mine)
    )
    faster = inputs.of_recording(replace(recorded, speed_rpm=1.01 * recorded.speed_rpm))
    same = np.array_equal(faster.cut(np.arange(1)), windows.cut(mine[:1]))
    assert same == inputs.has_window_length  # turns depend on the speed, windows do not


def test_the_same_seed_gives_the_same_bits(study):
    task, settings = study
    first, again = (trained(task, settings).weights for _ in range(2))
    assert all(np.array_equal(first[name], again[name]) for name in first)
    other = trained(task, settings, seed=1).weights
    assert any(not np.array_equal(first[name], other[name]) for name in first)
