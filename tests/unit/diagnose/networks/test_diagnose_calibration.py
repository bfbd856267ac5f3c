"""Temperature scaling recovers a given temperature, changes no label, and keeps some doubt."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnose.networks.calibration import (
    calibration_error,
    calibration_scores,
    error_by_chance,
    fit_temperature,
    probabilities,
    reliability,
)


def make_records(temperature, n=4000, seed=0):
    """Log-probabilities whose labels are drawn at a temperature."""
    rng = np.random.default_rng(seed)
    scores = 2 * rng.standard_normal((n, 4))
    share = probabilities(scores, temperature)
    label = (rng.uniform(size=(n, 1)) > np.cumsum(share, axis=1)).sum(axis=1)
    return scores, label


@pytest.mark.parametrize("temperature", [0.4, 1.0, 3.0])
def test_the_given_temperature_is_recovered(temperature):
    assert_allclose(fit_temperature(*make_records(temperature)), temperature, rtol=0.1)


def test_scaling_changes_no_label_and_keeps_probabilities():
    scores, _ = make_records(1.0, n=50)
    for temperature in (0.1, 1.0, 10.0):
        scaled = probabilities(scores, temperature)
        assert_allclose(scaled.sum(axis=1), 1.0, rtol=1e-12)
        assert (scaled.argmax(axis=1) == scores.argmax(axis=1)).all()
    # a constant in a row has no effect, and very small log-probabilities give no 0/0
    assert_allclose(probabilities(scores - 5000.0), probabilities(scores), rtol=1e-9)


def test_no_error_on_few_records_is_no_certainty():
    label = np.arange(8) % 2
    log_probability = np.log(np.where(np.eye(2)[label] > 0, 0.9, 0.1))
    few = fit_temperature(log_probability, label)
    many = fit_temperature(np.tile(log_probability, (50, 1)), np.tile(label, 50))
    assert 0.2 < few < 1.0
    assert many < 0.7 * few


@pytest.mark.parametrize(("sure", "expected"), [(0.8, 0.0), (0.95, 0.15)])
def test_calibration_error_in_closed_form(sure, expected):
    rows = reliability(np.full(10, sure), np.arange(10) < 8)
    assert calibration_error(rows) == pytest.approx(expected, abs=1e-12)


def test_reliability_has_a_row_for_each_bin_with_records():
    right = np.array([True, False, True, True])
    rows = reliability(np.array([0.31, 0.39, 1.0, 1.0]), right)
    assert [row["n_records"] for row in rows] == [2, 2]
    assert rows[0]["confidence"] == pytest.approx(0.35)
    assert calibration_error(rows) == pytest.approx(0.5 * 0.15)


def test_error_by_chance_falls_with_the_root_of_the_records():
    # mean distance of a share of n tosses from 1/2: sqrt(1 / (2 pi n))
    for n in (25, 2500):
        expected = np.sqrt(1 / (2 * np.pi * n))
        assert_allclose(error_by_chance(np.full(n, 0.5)), expected, rtol=0.2)


def test_scaling_by_other_records_corrects_an_overconfident_network():
    scores, label = make_records(3.0)
    temperature = fit_temperature(*make_records(3.0, seed=1))
    result = calibration_scores([scores, scores], [label, label], [temperature, 1.0])
    before, after = result["before"], result["after"]
    assert before["expected_calibration_error"][0] > 0.2
    assert after["expected_calibration_error"][0] < 0.05
    assert after["error_by_chance"][0] < 0.03
    assert after["cross_entropy"][0] < before["cross_entropy"][0] - 0.2
    assert after["cross_entropy"][1] == pytest.approx(before["cross_entropy"][1])
    assert sum(row["n_records"] for row in after["reliability"]) == 2 * label.size
