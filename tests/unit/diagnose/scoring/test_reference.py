"""Records against a sound record of the same machine: the tooth that changed is found, the record itself never used."""

import numpy as np
import pytest
from fake_dataset import FakeDataset

from diagnose.baselines.reference import reference_table, references
from diagnose.data.windows import all_segments
from diagnose.settings import settings_from
from diagnose.studies.jobs import Job, run_job
from diagnose.studies.study import settings_for, task_from
from gensig.errors import ConfigError
from gensig.options.compose import compose

TEETH = {"pinion": 12, "wheel": 12}


class Machines(FakeDataset):
    """Every unit has a pattern of loud and quiet teeth of its own; a faulty record has one tooth quieter."""

    def __init__(self, fall=0.4, **options):
        super().__init__(
            classes=("healthy", "missing_tooth"),
            duration=2.0,
            sampling_rate=6400.0,
            **options,
        )
        self.attributes |= {f"n_teeth_{gear}": number for gear, number in TEETH.items()}
        rng, n = np.random.default_rng(1), self.n_records
        self.fall = fall
        self.columns["speed_rpm"] = np.full(n, 600.0)
        self.columns["fault_gear"] = np.where(self.columns["label"] > 0, "wheel", "")
        self.columns["fault_tooth"] = np.where(
            self.columns["label"] > 0, rng.integers(12, size=n), -1
        )
        self.columns["start_tooth_pinion"] = self.columns["start_tooth_wheel"] = (
            rng.integers(12, size=n)
        )
        self.columns["start_phase"] = rng.uniform(size=n)

    def signals(
        self, record_index, start=0, stop=None, channels=None, *, name="acceleration"
    ):
        unit = int(self.columns["unit_id"][record_index][1:])
        gains = 10 ** np.random.default_rng([2, unit]).uniform(-0.5, 0.5, 12)
        if self.columns["label"][record_index]:
            gains[self.columns["fault_tooth"][record_index]] *= self.fall
        first = (
            self.columns["start_tooth_wheel"][record_index]
            + self.columns["start_phase"][record_index]
        )
        tooth = (
            np.floor(
                np.arange(self.n_samples) / self.sampling_rate * 120.0 + first
            ).astype(int)
            % 12
        )
        noise = np.random.default_rng([3, record_index]).normal(
            size=(len(self.channel_names), self.n_samples)
        )
        signal = (gains[tooth] * noise).astype(np.float32)
        return (signal if channels is None else signal[channels])[:, start:stop]


def settings_of(*overrides):
    words = [
        "data=x",
        "out=y",
        "baselines=[reference]",
        "protocols=[by_unit]",
        *overrides,
    ]
    return settings_from(compose("train", words))


def opened(dataset):
    settings = settings_for(dataset, settings_of())
    return task_from(dataset, settings), settings


def test_the_reference_is_another_sound_record_of_the_same_unit():
    dataset = Machines(n_units=4, records_per_unit=6)
    found = references(opened(dataset)[0])
    assert np.all(found != np.arange(dataset.n_records))
    assert np.all(dataset.columns["unit_id"][found] == dataset.columns["unit_id"])
    assert np.all(dataset.columns["label"][found] == 0)
    dataset.columns["fault_gear"][
        np.flatnonzero(dataset.columns["unit_id"] == "u00")
    ] = "wheel"
    assert np.all(references(opened(dataset)[0])[:6] == -1)


def test_machines_never_seen_are_told_apart_by_their_own_reference():
    task, settings = opened(Machines(n_units=12, records_per_unit=6))
    (prediction,) = run_job(task, settings, Job(protocols=("by_unit",), seed=None))
    assert prediction.method == "reference"
    assert np.mean(prediction.predicted == task.labels()[prediction.record]) > 0.9


def test_nothing_is_found_where_nothing_changed():
    task, settings = opened(Machines(fall=1.0, n_units=12, records_per_unit=6))
    (prediction,) = run_job(task, settings, Job(protocols=("by_unit",), seed=None))
    assert np.mean(prediction.predicted == task.labels()[prediction.record]) < 0.85


def test_a_unit_without_reference_is_unknown_and_none_at_all_is_refused():
    dataset = Machines(n_units=4, records_per_unit=6)
    dataset.columns["fault_gear"][dataset.columns["unit_id"] == "u00"] = "wheel"
    task, _ = opened(dataset)
    table = reference_table(task, all_segments(task), {})
    assert np.isnan(table.values[:6]).all()
    assert np.isfinite(table.values[6:]).all()
    assert table.values.shape[1] == len(table.names) == len(set(table.names))
    alone = Machines(n_units=12, records_per_unit=2)
    with pytest.raises(ConfigError, match=r"plan\.n_repeats=2"):
        reference_table(opened(alone)[0], all_segments(opened(alone)[0]), {})
    with pytest.raises(ConfigError, match="does not say fault_gear"):
        references(opened(FakeDataset())[0])
