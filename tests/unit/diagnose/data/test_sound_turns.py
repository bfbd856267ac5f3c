"""Turns with what a sound record of the same machine does not explain behind them."""

import numpy as np
import pytest
from fake_dataset import N_TEETH, FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import run, study_of

from diagnose.data.inputs import RecordedSignal, SoundSignal
from diagnose.data.packed_turns import HEADER
from diagnose.data.references import reference_kind, references
from diagnose.data.turns import Turns
from diagnose.data.windows import all_segments, read_signal
from diagnose.studies.class_jobs import WITH_REFERENCE, with_reference
from diagnose.studies.controls import control_jobs
from gensig.errors import ConfigError

GEARS = tuple(N_TEETH.values())
TEETH, PER_TOOTH, RATE, SPEED = (5, 12), 16, 6400.0, 1200.0
TOOTH = 64  # samples of a passage: 1200 r/min x 5 teeth = 100 Hz
OF_TEETH = PER_TOOTH * sum(TEETH)


def machine(first, n_passages=130):
    """Signal (2, sample) of gears whose teeth differ, begun at one of them."""
    rng = np.random.default_rng(3)
    shapes = [rng.standard_normal((z, 2, 3)) for z in TEETH]
    t = np.arange(TOOTH) / TOOTH
    orders = np.sin(2 * np.pi * np.arange(1, 4)[:, None] * t) * np.sin(np.pi * t) ** 2
    passage = first + np.arange(n_passages)
    sizes = sum(shape[passage % z] for shape, z in zip(shapes, TEETH, strict=True))
    return np.einsum("pco,os->cps", sizes, orders).reshape(2, -1).astype(np.float32)


def recording(first, *sound):
    healthy = tuple(SoundSignal(signal=machine(k), speed_rpm=SPEED) for k in sound)
    return RecordedSignal(
        signal=machine(first),
        sampling_rate=RATE,
        speed_rpm=SPEED,
        file="a.npz",
        window_samples=100,
        stride_samples=100,
        normalise="none",
        n_teeth=TEETH,
        healthy=healthy,
    )


def turns(reference="other_condition"):
    return Turns(samples_per_tooth=PER_TOOTH, reference=reference)


@pytest.mark.parametrize("sound", [(0,), (7,), (23, 48)])
def test_a_sound_recording_of_the_same_teeth_explains_the_recording(sound):
    (both,) = turns().of_recording(recording(2, *sound)).signals
    assert both.shape == (2, HEADER + 2 * OF_TEETH + PER_TOOTH)
    mine, changed = both[:, HEADER : HEADER + OF_TEETH], both[:, -OF_TEETH:]
    assert_allclose(changed, np.zeros_like(mine), atol=0.05 * np.abs(mine).max())


@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_the_mean_turn_of_a_gear_comes_back_tooth_by_tooth(gear):
    signal = recording(2).signal
    alone = turns("none").turns(signal, RATE, SPEED, TEETH)
    packed = turns("none").packed(alone)
    whole = {"pinion": alone.driving, "wheel": alone.driven}[gear]
    n_teeth = whole.shape[-1] // PER_TOOTH
    whole = whole + np.tile(alone.mesh, n_teeth)
    teeth = turns("none").of_gear(packed, gear, 3)
    assert teeth.shape == (2, n_teeth, PER_TOOTH)
    assert_allclose(teeth[:, 1, 0], whole[:, PER_TOOTH + 3], rtol=1e-6)
    assert_allclose(teeth[:, -1, -1], whole[:, 2], rtol=1e-6)


@pytest.mark.parametrize(
    ("reference", "sound", "message"),
    [
        ("other_condition", (), "say --healthy FILE"),
        ("none", (1,), "takes no healthy recording"),
    ],
)
def test_healthy_recordings_and_the_model_must_agree(reference, sound, message):
    with pytest.raises(ConfigError, match=message):
        turns(reference).of_recording(recording(2, *sound))


@pytest.fixture(scope="module")
def dataset():
    """Two sound records a unit, at two conditions."""
    made = FakeDataset(n_units=8, records_per_unit=8, n_channels=2, duration=0.2)
    n = made.n_records
    made.columns["condition_id"] = np.array([f"c{row // 4:02d}" for row in range(n)])
    made.columns["speed_set_rpm"] = 1000.0 + np.arange(n) // 4
    made.columns["fault_gear"] = np.where(made.columns["label"] > 0, "pinion", "")
    return made


OPTIONS = ["model=tooth", "model.samples_per_tooth=16", "reference=other_condition"]


def test_every_record_is_followed_by_its_reference(dataset):
    task, settings = study_of(dataset, *OPTIONS)
    inputs = Turns.of(with_reference(settings).model)
    segments = all_segments(task)
    signals = inputs.load(task, segments).signals
    chosen = references(task, reference_kind("other_condition"))
    rate, speed = dataset.sampling_rate, dataset.column("speed_rpm")
    for record in (0, 5, 63):
        alone, sound = (
            inputs.turns(
                read_signal(task, k, 0, dataset.n_samples), rate, speed[k], GEARS
            )
            for k in (record, chosen[record])
        )
        assert_array_equal(signals[record], inputs.packed(alone, [sound]))
        assert (
            dataset.column("condition_id")[chosen[record]]
            != (dataset.column("condition_id")[record])
        )


def test_the_network_is_trained_with_and_without(dataset):
    task, settings = study_of(dataset, *OPTIONS, "epochs=1", "oracle=false")
    jobs = [
        job
        for job in control_jobs(task, settings, ["by_unit"])
        if job.control == WITH_REFERENCE
    ]
    assert sorted(job.shuffled for job in jobs) == [False, True]
    trained = [job for job in jobs if not job.shuffled]
    (prediction,) = run(task, settings, *trained)
    assert prediction.method == WITH_REFERENCE
    assert prediction.weights is not None


def test_a_machine_without_a_second_sound_record_is_refused(dataset):
    task, settings = study_of(dataset, *OPTIONS)
    task.dataset.columns["fault_gear"][0] = "pinion"
    inputs = Turns.of(with_reference(settings).model)
    with pytest.raises(ConfigError, match="record 0 has no healthy record"):
        inputs.load(task, all_segments(task))
    task.dataset.columns["fault_gear"][0] = ""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["model=cnn", "reference=other_condition"], "model=tooth does"),
        (["model=tooth", "reference=twin"], "reference must be one of auto, none"),
    ],
)
def test_what_cannot_be_compared_is_refused(dataset, words, message):
    with pytest.raises(ConfigError, match=message):
        study_of(dataset, *words)


def test_without_marked_records_auto_compares_with_none(dataset):
    settings = study_of(dataset, "model=tooth")[1]
    assert settings.reference == "none"
    dataset.columns["is_reference"] = np.zeros(dataset.n_records, dtype=int)
    assert study_of(dataset, "model=tooth")[1].reference == "other_condition"
    assert study_of(dataset, "model=cnn")[1].reference == "none"
    del dataset.columns["is_reference"]


def test_records_to_compare_with_are_no_examples(dataset):
    task = study_of(dataset, "model=tooth")[0]
    labels = task.labels()
    dataset.columns["is_reference"] = (np.arange(dataset.n_records) % 8 == 0).astype(
        int
    )
    assert_array_equal(task.labels()[::8], -1)
    assert_array_equal(
        np.delete(task.labels(), np.s_[::8]), np.delete(labels, np.s_[::8])
    )
    del dataset.columns["is_reference"]
