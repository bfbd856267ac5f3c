"""Thresholds, calibrations and choices of a page do not know the signals of the test records."""

import json

import numpy as np
import pytest
from fake_dataset import CompleteDataset
from poison import Poisoned
from small_studies import TINY_CNN, run, study_of

from diagnose.data.windows import REFERENCES, subset_segments
from diagnose.scoring.judged import judged_runs
from diagnose.studies import answers
from diagnose.studies.jobs import Job
from diagnose.studies.protocol_results import protocol_result

# Keys of metrics.json that are set before a record is scored, or say from which records.
SET_BEFORE = {
    "best_baseline",
    "best_epoch",
    "chosen",
    "missing",
    "temperature",
    "threshold",
    "threshold_from",
}
WORDS = (
    "baselines=[indicators,rms_threshold]",
    "shuffle_control=false",
    "metadata_probe=false",
    "epochs=2",
)
CNN = "/answers/detection/cnn"
A_UNIT, N_UNITS = 10, 20


class WithReferences(CompleteDataset):
    """Each machine has two reference records and two of each class."""

    def __init__(self):
        sizes = {"n_units": N_UNITS, "records_per_unit": A_UNIT, "duration": 0.3}
        super().__init__(**sizes, n_channels=1)
        place = np.arange(self.n_records) % A_UNIT
        is_reference = place < 2
        label = np.where(is_reference, 0, place % 4)
        self.columns |= {
            "is_reference": is_reference.astype(int),
            "label": label,
            "label_name": np.array(self.class_names)[label],
            "fault_gear": np.where(label > 0, "wheel", ""),
            "severity": np.where(label > 0, self.columns["severity"], 0.0),
        }


def set_before_scoring(content, path=""):
    """Path -> value, of every key of `SET_BEFORE` in nested results."""
    found = {}
    if isinstance(content, dict):
        for key, value in content.items():
            if key in SET_BEFORE:
                found[f"{path}/{key}"] = json.dumps(value)
            found |= set_before_scoring(value, f"{path}/{key}")
    return found


@pytest.fixture(scope="module")
def studies():
    """Task, settings and predictions: with the signals of the test records, and with others."""
    made = []
    for dataset in (
        WithReferences(),
        Poisoned(WithReferences(), "test", signals_alone=True),
    ):
        task, settings = study_of(dataset, *TINY_CNN, *WORDS)
        jobs = [Job(protocols=("by_unit",), seed=seed) for seed in (None, 0)]
        made.append((task, settings, run(task, settings, *jobs)))
    return made


def before_scoring(studies):
    """Values that are set before the scoring, in both studies."""
    results = [
        protocol_result(task, settings, "by_unit", predictions)
        for task, settings, predictions in studies
    ]
    known, other = (result["answers"]["detection"]["cnn"] for result in results)
    assert known["classes"] != other["classes"]
    return [set_before_scoring(result) for result in results]


def test_nothing_that_is_set_follows_the_signals_that_are_scored(studies):
    known, other = before_scoring(studies)
    assert known == other
    source = "20 healthy records of 5 validation machines"
    assert known[f"{CNN}/threshold_from"] == json.dumps(source)
    assert "null" not in known[f"{CNN}/threshold"]


def on_the_test(task, runs):
    """Leak put in on purpose: healthy test records, each twice, in place of those held back."""
    judged = judged_runs(task, runs)
    healthy = np.flatnonzero(judged.truth == task.class_names.index("healthy"))
    return judged.of(np.tile(healthy, 2))


def test_a_threshold_from_the_records_that_are_scored_is_noticed(studies, monkeypatch):
    monkeypatch.setattr(answers, "_held_back", on_the_test)
    known, other = before_scoring(studies)
    assert {path for path in known if known[path] != other[path]} == {
        f"/answers/detection/{method}/threshold" for method in ("cnn", "indicators")
    }


@pytest.mark.parametrize("subset", ["train", "test"])
def test_references_of_scored_and_training_machines_set_nothing(subset):
    """Reference records of validation machines alone are held back."""

    task, _ = study_of(WithReferences())
    unit = task.dataset.column("unit_id")
    held_back = subset_segments(task, "by_unit", REFERENCES).record
    assert held_back.size == 10
    assert task.dataset.column("is_reference")[held_back].all()
    elsewhere = unit[subset_segments(task, "by_unit", subset).record]
    assert not np.isin(unit[held_back], elsewhere).any()
    leaky = subset_segments(task, "random_window_leaky", REFERENCES)
    assert leaky.record.size == 0
