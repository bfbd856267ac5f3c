"""Scores of the sound records with the faults of each gear."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import study_of

from diagnose.scoring.predictions import Prediction
from diagnose.studies.protocol_results import _by_gear
from diagnose.training.heads import heads_notes

SOUND = ""


def network_that_misses(task, gear):
    """Predictions of one seed that call every fault of a gear sound."""
    label = task.labels()
    missed = np.asarray(task.dataset.column("fault_gear")) == gear
    named = np.where(missed, 0, label)
    return Prediction(
        protocol="by_unit",
        method="tooth",
        seed=0,
        record=np.arange(label.size),
        answers=np.log(np.eye(len(task.class_names))[named] + 1e-9),
        detail="",
    )


@pytest.fixture
def study():
    """Faults on either gear in turn."""
    dataset = FakeDataset(n_units=8, records_per_unit=8, n_channels=1, duration=0.2)
    label = dataset.columns["label"]
    gears = np.where(np.arange(label.size) // 8 % 2 == 0, "pinion", "wheel")
    dataset.columns["fault_gear"] = np.where(label > 0, gears, SOUND)
    return study_of(dataset)


def test_each_gear_is_scored_with_the_sound_records(study):
    task, settings = study
    scores = _by_gear(task, settings, [network_that_misses(task, "wheel")])
    assert list(scores) == ["pinion", "wheel"]
    assert scores["pinion"]["mean"] == 1.0
    assert scores["wheel"]["mean"] == pytest.approx(1 / len(task.class_names))


def test_faults_on_one_gear_have_no_scores_of_gears(study):
    task, settings = study
    gears = task.dataset.columns["fault_gear"]
    task.dataset.columns["fault_gear"] = np.where(gears == SOUND, SOUND, "wheel")
    assert _by_gear(task, settings, [network_that_misses(task, "pinion")]) == {}


def test_the_page_states_the_score_of_each_gear(study):
    task, settings = study
    scores = _by_gear(task, settings, [network_that_misses(task, "wheel")])
    ((_, text),) = heads_notes({"by_unit": {"heads": {}, "by_gear": scores}})
    assert "balanced accuracy with faults on the pinion 1.00" in text
