"""Garbage in the test or validation records, which nothing that is fitted may notice."""

import pytest
from poison import STUDIES, changes, training_on

from diagnose.baselines import life_models
from diagnose.baselines.estimators import FittedModel

NO_CHOICE = "patience=0"  # all epochs run, whatever the validation loss is
# Parts that validation records may decide besides a choice: thresholds and calibration.
CALIBRATED = {
    "baselines": {"validation"},
    "network": {
        "validation",
        "validation_loss",
        "temperature",
        "domain_threshold",
    },
    "novelty": {"validation", "threshold"},
    "lives": {"validation", "hours_half_width_h", "domain_threshold"},
}
BY_TEMPERATURE = "open_set/largest_probability"  # its scores are calibrated


@pytest.fixture
def without_choice(monkeypatch):
    """Every method keeps its first candidate."""
    first = dict([*life_models._candidates().items()][:1])
    monkeypatch.setattr(FittedModel, "accuracy", lambda *_: 0.0)
    monkeypatch.setattr(life_models, "_candidates", lambda: first)


def before_scoring(study):
    """Method -> parts that garbage in the test changes, without the scores of the test."""
    return {
        method: names - {"score"} for method, names in changes(study, "test").items()
    }


def beside_calibration(study):
    """Method -> parts that garbage in the validation changes, which decides no choice here."""
    parts = changes(study, "validation", NO_CHOICE)
    parts = {method: names - CALIBRATED[study] for method, names in parts.items()}
    if BY_TEMPERATURE in parts:
        parts[BY_TEMPERATURE] -= {"score"}
    return parts


def noticed(parts):
    """Methods with a changed part."""
    return {method for method, names in parts.items() if names}


@pytest.mark.parametrize("study", STUDIES)
def test_nothing_fitted_notices_a_poisoned_test_set(study):
    """Models, scalings, thresholds and choices are equal to the bit before the scoring."""
    assert noticed(before_scoring(study)) == set()


@pytest.mark.parametrize("study", STUDIES)
def test_every_method_that_trains_on_test_records_is_noticed(study):
    with training_on("test"):
        parts = before_scoring(study)
    assert noticed(parts) == set(parts)


@pytest.mark.parametrize("study", STUDIES)
def test_validation_records_scale_and_fit_nothing(study, without_choice):
    """Validation records decide thresholds and calibration alone if nothing is chosen."""
    assert noticed(beside_calibration(study)) == set()


@pytest.mark.parametrize("study", STUDIES)
def test_every_method_that_trains_on_validation_records_is_noticed(
    study, without_choice
):
    with training_on("validation"):
        parts = beside_calibration(study)
    # of this one calibrated scores alone are known; its network is that of the energy
    assert noticed(parts) == set(parts) - {BY_TEMPERATURE}
