"""Comparison with a sound record of the same machine: the changed tooth is found."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import run, study_of

from diagnose.baselines.reference import reference_table, references
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
    return study_of(dataset, "baselines=[reference]", "window_samples=null")


def test_the_reference_is_another_sound_record_of_the_same_unit():
    dataset = Machines(n_units=4, records_per_unit=6)
    unit = dataset.columns["unit_id"]
    reference = references(opened(dataset)[0])
    assert np.all(reference != np.arange(dataset.n_records))
    assert np.all(unit[reference] == unit)
    assert np.all(dataset.columns["label"][reference] == 0)
    dataset.columns["fault_gear"][unit == "u00"] = "wheel"
    assert np.all(references(opened(dataset)[0])[:6] == -1)


@pytest.mark.parametrize(("fall", "low", "high"), [(0.4, 0.9, 1.0), (1.0, 0.0, 0.85)])
def test_unseen_machines_are_told_apart_if_a_tooth_changed(fall, low, high):
    task, settings = opened(Machines(fall=fall, n_units=12, records_per_unit=6))
    (prediction,) = run(task, settings, Job(protocols=("by_unit",), seed=None))
    assert prediction.method == "reference"
    share_right = np.mean(prediction.predicted == task.labels()[prediction.record])
    assert low <= share_right <= high


def test_a_unit_without_reference_is_unknown_and_a_set_without_any_is_refused():
    dataset = Machines(n_units=4, records_per_unit=6)
    dataset.columns["fault_gear"][dataset.columns["unit_id"] == "u00"] = "wheel"
    task, _ = opened(dataset)
    table = reference_table(task, all_segments(task), {})
    assert np.isnan(table.values[:6]).all()
    assert np.isfinite(table.values[6:]).all()
    assert table.values.shape[1] == len(table.names) == len(set(table.names))
    alone, _ = opened(Machines(n_units=12, records_per_unit=2))
    with pytest.raises(ConfigError, match=r"plan\.n_repeats=2"):
        reference_table(alone, all_segments(alone), {})
    with pytest.raises(ConfigError, match="does not say fault_gear"):
        references(opened(FakeDataset())[0])
