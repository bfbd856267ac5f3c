"""Comparison with a sound record of the same machine: the changed tooth is found."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import run, study_of

from diagnose.baselines.sound_record import chosen_references, sound_record_table
from diagnose.data.references import ReferenceKind, references
from diagnose.data.windows import all_segments
from diagnose.studies.jobs import Job
from gensig.errors import ConfigError


class Machines(FakeDataset):
    """Every unit has its pattern of loud and quiet teeth; a fault makes one tooth quieter."""

    def __init__(self, fall=0.4, **options):
        classes = ("healthy", "missing_tooth")
        rates = {"duration": 2.0, "sampling_rate": 6400.0}
        super().__init__(classes=classes, **rates, **options)
        self.attributes |= {"n_teeth_pinion": 12, "n_teeth_wheel": 12}
        self.fall = fall
        rng, n = np.random.default_rng(1), self.n_records
        faulty = self.columns["label"] > 0
        self.columns |= {
            "speed_rpm": np.full(n, 600.0),
            "speed_set_rpm": np.full(n, 600.0),
            "condition_id": np.char.add("c", (np.arange(n) // 2).astype(str)),
            "fault_gear": np.where(faulty, "wheel", ""),
            "fault_tooth": np.where(faulty, rng.integers(12, size=n), -1),
            "start_tooth_wheel": rng.integers(12, size=n),
            "start_phase": rng.uniform(size=n),
        }
        self.columns["start_tooth_pinion"] = self.columns["start_tooth_wheel"]

    def signals(self, record_index, start=0, stop=None, channels=None, **_):
        row = {name: values[record_index] for name, values in self.columns.items()}
        unit = int(row["unit_id"][1:])
        gains = 10 ** np.random.default_rng([2, unit]).uniform(-0.5, 0.5, 12)
        if row["label"]:
            gains[row["fault_tooth"]] *= self.fall
        passages = np.arange(self.n_samples) / self.sampling_rate * 120.0
        tooth = np.floor(passages + row["start_tooth_wheel"] + row["start_phase"])
        shape = (len(self.channel_names), self.n_samples)
        noise = np.random.default_rng([3, record_index]).normal(size=shape)
        signal = (gains[tooth.astype(int) % 12] * noise).astype(np.float32)
        return signal[channels if channels is not None else slice(None), start:stop]


def opened(dataset):
    return study_of(dataset, "baselines=[sound_record]", "window_samples=null")


def sham(n_units=40, n_conditions=5, n_repeats=1, seed=0):
    """Plan of four classes that change nothing: conditions, then classes, then repeats."""
    classes = ("healthy", "crack", "pitting", "missing_tooth")
    a_condition = 4 * n_repeats
    dataset = FakeDataset(
        n_units=n_units, records_per_unit=n_conditions * a_condition, classes=classes
    )
    condition = np.arange(dataset.n_records) // a_condition
    label = np.arange(dataset.n_records) % a_condition // n_repeats
    speeds = np.random.default_rng(seed).uniform(1200, 2400, condition.max() + 1)
    dataset.columns |= {
        "label": label,
        "condition_id": np.char.add("c", condition.astype(str)),
        "speed_set_rpm": speeds[condition],
        "fault_gear": np.where(label > 0, "wheel", ""),
    }
    return dataset


def chosen(dataset, kind):
    return references(opened(dataset)[0], kind)


@pytest.mark.parametrize(
    ("kind", "n_repeats"),
    [
        (ReferenceKind.OTHER_CONDITION, 1),
        (ReferenceKind.OTHER_CONDITION, 2),
        (ReferenceKind.SAME_CONDITION, 2),
        (ReferenceKind.SAME_CONDITION, 3),
    ],
)
def test_the_reference_is_a_sound_record_of_the_unit_and_says_nothing_of_the_class(
    kind, n_repeats
):
    """Distance in set speed, condition and place of the reference are alike for all classes."""
    dataset = sham(n_repeats=n_repeats)
    column, every = dataset.columns, np.arange(dataset.n_records)
    reference = chosen(dataset, kind)
    assert (reference != every).all()
    assert (column["unit_id"][reference] == column["unit_id"]).all()
    assert (column["label"][reference] == 0).all()
    same = column["condition_id"][reference] == column["condition_id"]
    assert same.all() == (kind is ReferenceKind.SAME_CONDITION)
    assert same.any() == (kind is ReferenceKind.SAME_CONDITION)
    away = np.abs(column["speed_set_rpm"][reference] - column["speed_set_rpm"])
    repeat = every % n_repeats
    for label in range(1, 4):
        healthy, faulty = (np.flatnonzero(column["label"] == k) for k in (0, label))
        np.testing.assert_array_equal(away[healthy], away[faulty])
        np.testing.assert_array_equal(repeat[healthy], repeat[faulty])
        np.testing.assert_array_equal(reference[healthy], reference[faulty])


def test_the_reference_at_another_condition_is_nearest_in_set_speed():
    dataset = sham(n_units=1, n_conditions=3)
    dataset.columns["speed_set_rpm"] = np.repeat([1000.0, 1900.0, 1300.0], 4)
    reference = chosen(dataset, ReferenceKind.OTHER_CONDITION)
    np.testing.assert_array_equal(reference, np.repeat([8, 8, 0], 4))


@pytest.mark.parametrize(
    ("kind", "options", "remedy"),
    [
        (ReferenceKind.OTHER_CONDITION, {"n_conditions": 1}, "n_reference=1"),
        (ReferenceKind.SAME_CONDITION, {"n_repeats": 1}, "n_repeats=2"),
    ],
)
def test_a_set_without_such_records_is_refused_with_the_remedy(kind, options, remedy):
    with pytest.raises(ConfigError, match=rf"no machine has .*plan\.{remedy}"):
        chosen(sham(**options), kind)


def test_a_unit_that_lacks_one_reference_has_none_for_any_record():
    dataset = sham(n_units=2, n_conditions=2)
    dataset.columns["fault_gear"][0] = "wheel"  # sound records at one condition only
    reference = chosen(dataset, ReferenceKind.OTHER_CONDITION)
    assert (reference[:8] == -1).all()
    assert (reference[8:] >= 0).all()


def test_only_marked_records_are_references_and_they_have_none():
    dataset = sham(n_units=2, n_conditions=3, n_repeats=2)
    marked = (dataset.columns["label"] == 0) & (np.arange(dataset.n_records) % 2 == 1)
    dataset.columns["is_reference"] = marked.astype(int)
    for kind in ReferenceKind:
        reference = chosen(dataset, kind)
        assert marked[reference[~marked]].all()
        assert (reference[marked] == -1).all()


def test_one_condition_a_machine_gives_the_next_repeat():
    one = sham(n_conditions=1, n_repeats=2)
    one.columns |= dict.fromkeys(
        ("start_phase", "start_tooth_pinion", "start_tooth_wheel"),
        np.zeros(one.n_records),
    )
    expected = chosen(one, ReferenceKind.SAME_CONDITION)
    np.testing.assert_array_equal(chosen_references(opened(one)[0]), expected)


@pytest.mark.parametrize(("fall", "low", "high"), [(0.4, 0.9, 1.0), (1.0, 0.0, 0.85)])
def test_unseen_machines_are_told_apart_if_a_tooth_changed(fall, low, high):
    task, settings = opened(Machines(fall=fall, n_units=12, records_per_unit=6))
    job = Job(protocols=("by_unit",), seed=None)
    prediction, *shuffled = run(task, settings, job)
    assert prediction.method == "sound_record"
    assert {each.method for each in shuffled} == {"label_shuffle_sound_record"}
    share_right = np.mean(prediction.predicted == task.labels()[prediction.record])
    assert low <= share_right <= high


def test_a_unit_without_reference_is_unknown_and_a_set_without_any_is_refused():
    dataset = Machines(n_units=4, records_per_unit=6)
    dataset.columns["fault_gear"][dataset.columns["unit_id"] == "u00"] = "wheel"
    task, _ = opened(dataset)
    table = sound_record_table(task, all_segments(task), {})
    assert np.isnan(table.values[:6]).all()
    assert np.isfinite(table.values[6:]).all()
    assert table.values.shape[1] == len(table.names) == len(set(table.names))
    alone, _ = opened(Machines(n_units=12, records_per_unit=2))
    with pytest.raises(ConfigError, match=r"plan\.n_reference=1.*n_repeats=2"):
        sound_record_table(alone, all_segments(alone), {})
    with pytest.raises(ConfigError, match="does not say start_phase"):
        chosen_references(opened(FakeDataset())[0])
    with pytest.raises(ConfigError, match="does not say condition_id"):
        references(opened(FakeDataset())[0], ReferenceKind.OTHER_CONDITION)
