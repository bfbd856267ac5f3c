"""Stored records as those of machines drawn anew: the laws of the draws, and no leak of a label."""

from dataclasses import replace

import numpy as np
import pytest
from fake_dataset import N_TEETH, FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import study_of

from diagnose.baselines.oracle import oracle_windows
from diagnose.data.inputs import RecordedSignal, SoundSignal
from diagnose.data.redrawn_sets import SOURCE, TWIN, RedrawnTurns
from diagnose.data.redraws import Redraws
from diagnose.data.references import ReferenceKind, all_references
from diagnose.data.turns import Turns
from diagnose.data.windows import all_segments, read_signal, subset_segments
from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.signals.separation import GearTurns

TEETH, PER_TOOTH, N_SENSORS = tuple(N_TEETH.values()), 16, 3
QUIET = Redraws(snr_db=(300.0, 300.0), tone_level=(1e-12, 1e-12))
AT = {
    "mesh_frequency": 460.0,
    "sampling_rate": 12800.0,
    "n_samples": 6400,
    "teeth": (3.25, 40.25),
}


def turns(seed):
    rng = np.random.default_rng(seed)
    sizes = [teeth * PER_TOOTH for teeth in (*TEETH, 1)]
    driving, driven, mesh = (rng.standard_normal((2, size)) for size in sizes)
    return GearTurns(driving=driving, driven=driven, mesh=mesh)


def drawn(ranges, residual, seed=1):
    machine = ranges.machine(2, N_SENSORS, np.random.default_rng(0))
    return machine.record(turns(0), residual, rng=np.random.default_rng(seed), **AT)


def parts(turns):
    return turns.driving, turns.driven, turns.mesh


def test_what_the_fault_adds_is_linear_in_the_gain_and_shares_no_draw_with_the_class():
    def with_gain(gain):
        return drawn(Redraws(fault_gain=(gain, gain)), turns(5))

    sound, one, four = drawn(Redraws(), None), with_gain(1.0), with_gain(4.0)
    for without, single, louder in zip(
        parts(sound), parts(one), parts(four), strict=True
    ):
        added = louder - without
        assert np.abs(added).max() > 0.1 * np.abs(without).max()
        assert_allclose(
            added, 4.0 * (single - without), atol=1e-9 * np.abs(added).max()
        )


def test_a_residual_of_nothing_is_a_sound_record_bit_by_bit():
    nothing = None
    zero = replace(
        turns(0),
        driving=np.zeros((2, TEETH[0] * PER_TOOTH)),
        driven=np.zeros((2, TEETH[1] * PER_TOOTH)),
        mesh=np.zeros((2, PER_TOOTH)),
    )
    for one, other in zip(
        parts(drawn(Redraws(), zero)), parts(drawn(Redraws(), nothing)), strict=True
    ):
        assert_array_equal(one, other)


def test_the_noise_has_the_level_that_its_ratio_says():
    white = replace(QUIET, snr_db=(0.0, 0.0), color=(0.0, 0.0))
    silent, noisy = drawn(QUIET, None), drawn(white, None)
    band = 0.5 * AT["sampling_rate"] / (AT["mesh_frequency"] * PER_TOOTH / 2)
    for k, (clean, dirty) in enumerate(zip(parts(silent), parts(noisy), strict=True)):
        if k == 2:
            continue  # a passage has too few lines for a mean
        power = sum(np.var(part, axis=-1) for part in parts(silent))
        expected = power * clean.shape[-1] / AT["n_samples"] * min(band, 1.0)
        assert_allclose(np.var(dirty - clean, axis=-1), expected, rtol=0.3)


class Sourced(FakeDataset):
    """Also holds records at two bearings and their twins, as sets with both switches do."""

    def __init__(self, **options):
        super().__init__(n_channels=2, twins=True, duration=0.2, **options)
        self.signal_names += [SOURCE, TWIN]
        n = self.n_records
        label = self.columns["label"]
        self.columns["fault_gear"] = np.where(label > 0, "pinion", "")
        self.columns["condition_id"] = np.array(
            [f"c{row // 4:02d}" for row in range(n)]
        )
        self.columns["speed_set_rpm"] = 1000.0 + np.arange(n) // 4
        self.columns["start_phase"] = np.linspace(0.0, 0.9, n)
        self.columns["start_tooth_pinion"] = np.arange(n) % 23
        self.columns["start_tooth_wheel"] = np.arange(n) % 84
        self.columns["fault_tooth"] = np.where(label > 0, 5, -1)

    def trace(self, record_index, name, start=0, stop=None):
        signal = self.signals(record_index, start, stop)
        return signal if name == SOURCE else signal + 0.0 * self.is_faulty(record_index)

    def is_faulty(self, record_index):
        return self.columns["label"][record_index] > 0


@pytest.fixture(scope="module")
def dataset():
    return Sourced(n_units=8, records_per_unit=8)


def redrawn(dataset, number=2, ranges=None):
    task, _ = study_of(dataset, "model=tooth", "model.samples_per_tooth=16")
    return RedrawnTurns(task, PER_TOOTH, number, ranges)


def test_a_draw_is_the_same_machine_for_a_record_and_its_sound_records(dataset):
    """The path tells them from other machines, and noise tells them apart."""
    of_three = redrawn(dataset, ranges=QUIET).of_record(0, (0, 0))
    for (own, _), (sound, _), (again, frequency) in of_three:
        assert frequency == pytest.approx(dataset.column("speed_rpm")[0] / 60 * 23)
        assert_allclose(own.driving, sound.driving, rtol=1e-9, atol=1e-9)
        assert_array_equal(sound.mesh.shape, again.mesh.shape)
    (first, _), (second, _) = of_three[0][0], of_three[1][0]
    assert np.abs(first.driving - second.driving).max() > 0.1 * first.driving.std()
    noisy = redrawn(dataset).of_record(0, (0,))[0]
    assert np.abs(noisy[0][0].driving - noisy[1][0].driving).max() > 1e-6


def test_with_no_residual_nothing_tells_the_class(dataset):
    """The canary: records that differ in nothing but their label are drawn to the same bits."""
    relabelled = Sourced(n_units=8, records_per_unit=8)
    relabelled.columns["fault_gear"] = np.full(relabelled.n_records, "")
    for record in (1, 2, 3):
        for faulty, sound in zip(
            redrawn(dataset).of_record(record),
            redrawn(relabelled).of_record(record),
            strict=True,
        ):
            for one, other in zip(parts(faulty[0][0]), parts(sound[0][0]), strict=True):
                assert_array_equal(one, other)


def inputs_of(dataset, *words):
    task, settings = study_of(
        dataset, "model=tooth", "model.samples_per_tooth=16", *words
    )
    return task, Turns.of(settings.model)


def test_a_training_has_the_redraws_behind_its_records_and_nothing_else_has(dataset):
    task, inputs = inputs_of(
        dataset,
        "model.redraws=2",
        "model.reference=every_condition",
        "model.whitened=machine",
    )
    segments = subset_segments(task, "by_unit", "train")
    trained = inputs.load(task, segments, training=True)
    judged = inputs.load(task, segments)
    n = segments.record.size
    assert len(trained) == 3 * n
    assert len(judged) == n
    assert_array_equal(trained.record[n:], np.repeat(segments.record, 2))
    assert_array_equal(trained.label[n:], np.repeat(judged.label, 2))
    assert_array_equal(
        trained.targets["entry"][n:], np.repeat(judged.targets["entry"], 2)
    )
    for mine, stored in zip(trained.signals, judged.signals, strict=False):
        assert_array_equal(mine, stored)
    again = inputs.load(task, segments, training=True)
    for one, other in zip(trained.signals, again.signals, strict=True):
        assert_array_equal(one, other)
        assert np.isfinite(one).all()


def test_the_oracle_has_records_alone_for_a_redraw_has_no_twin(dataset):
    task, inputs = inputs_of(dataset, "model.redraws=2", "model.halves=false")
    segments = subset_segments(task, "by_unit", "train")
    seen = oracle_windows(task, segments, inputs, training=True)
    assert_array_equal(seen.record, segments.record)
    assert {len(signal) for signal in seen.signals} == {2 * len(task.channel_names)}


def test_a_recording_is_prepared_as_a_record_with_its_sound_records_is(dataset):
    task, inputs = inputs_of(
        dataset, "model.reference=every_condition", "model.whitened=machine"
    )
    record, speed = 5, dataset.column("speed_rpm")
    sound = all_references(task, ReferenceKind.EVERY_CONDITION)[record]
    assert len(sound) == 1
    signals = {k: read_signal(task, k, 0, dataset.n_samples) for k in (record, *sound)}
    recording = RecordedSignal(
        signal=signals[record],
        sampling_rate=dataset.sampling_rate,
        speed_rpm=float(speed[record]),
        file="a.npz",
        window_samples=100,
        stride_samples=100,
        normalise="rms",
        n_teeth=TEETH,
        healthy=tuple(
            SoundSignal(signal=signals[k], speed_rpm=float(speed[k])) for k in sound
        ),
    )
    (own,) = inputs.of_recording(recording).signals
    assert_array_equal(own, inputs.load(task, all_segments(task)).signals[record])


def test_a_set_without_its_records_at_the_bearings_is_refused_with_what_to_do():
    task, inputs = inputs_of(FakeDataset(n_units=8, n_channels=2), "model.redraws=1")
    with pytest.raises(ConfigError, match=r"dataset\.store_source=true"):
        inputs.load(task, all_segments(task), training=True)


@pytest.mark.parametrize(
    ("odd", "message"),
    [({"redraws": -1}, "redraws"), ({"whitened": "all"}, "true, false or machine")],
)
def test_odd_values_are_refused(odd, message):
    with pytest.raises(ConfigError, match=message):
        Turns.of(Section("model", {"samples_per_tooth": 16, **odd}))
