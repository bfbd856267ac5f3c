"""Detection at 5 % false alarms: thresholds that keep their promise, curves whose limits are known in advance."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnose.scoring.detection_curve import curve_at, fit_curves, limits
from diagnose.scoring.detection_limit import (
    alarm_threshold,
    detection,
    detection_score,
    size_columns,
)
from diagnose.scoring.judged import Judged, share_with_interval

CLASSES = ("healthy", "crack")


def judged(score, label, unit):
    """Two classes whose detection score is given, (seed, record)."""
    score = np.atleast_2d(score)
    return Judged(
        method="cnn",
        label=label,
        unit=unit,
        n_units=int(unit.max()) + 1,
        log_probability=np.stack([np.zeros_like(score), score], axis=-1),
    )


def study(n_units=20, per_unit=20, shift=0.0, seed=0):
    """Healthy scores normal; cracks of severity s score 12 s - 4 more: half found at 5 % alarms near 0.47."""
    rng = np.random.default_rng(seed)
    unit = np.repeat(np.arange(n_units), per_unit)
    label = np.arange(unit.size) % 2
    severity = rng.uniform(0.1, 0.9, unit.size)
    score = (
        rng.normal(size=(2, unit.size))
        + np.where(label == 1, 12 * severity - 4, 0)
        + shift
    )
    return judged(score, label, unit), severity[label == 1]


def answer(test, validation, severity, n_bootstrap=200):
    return detection(
        test,
        validation,
        class_names=CLASSES,
        sizes={"crack": {"severity": severity, "crack_depth_mm": 4 * severity}},
        n_bootstrap=n_bootstrap,
        rng=np.random.default_rng(1),
    )


def test_the_score_ranks_by_the_odds_of_any_fault_and_knows_no_offset():
    logs = np.log(np.array([[0.5, 0.3, 0.2], [0.2, 0.4, 0.4]]))
    assert_allclose(
        detection_score(logs, 0), np.log([1.0, 4.0]), rtol=1e-12, atol=1e-12
    )
    assert_allclose(
        detection_score(logs + 7, 0), np.log([1.0, 4.0]), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("n_records", [19, 20, 57, 400])
def test_at_most_one_in_twenty_new_healthy_records_is_an_alarm(n_records):
    rng = np.random.default_rng(n_records)
    once = np.ones((1, n_records), dtype=int)
    alarms = [
        np.mean(
            rng.normal(size=200)
            > alarm_threshold(rng.normal(size=n_records), once, new=True)[0]
        )
        for _ in range(400)
    ]
    assert np.mean(alarms) < 0.055
    own = rng.normal(size=n_records)
    assert np.mean(own > alarm_threshold(own, once, new=False)[0]) <= 0.05


def test_a_repeated_record_counts_as_often_as_it_was_drawn():
    values, often = np.array([3.0, 1.0, 2.0]), np.array([[1, 30, 9]])
    expanded = np.repeat(values, often[0])
    assert alarm_threshold(values, often, new=False)[0] == np.sort(expanded)[38 - 1]


def test_curves_are_those_of_the_ordinary_logistic_regression():
    from sklearn.linear_model import LogisticRegression

    rng = np.random.default_rng(2)
    size = rng.uniform(0.1, 0.9, 400)
    hit = rng.uniform(size=400) < 1 / (1 + np.exp(-3 * np.log(size / 0.4)))
    weight = rng.integers(0, 3, (3, 400)).astype(float)
    ours = fit_curves(size, np.tile(hit, (3, 1)).astype(float), weight)
    scaled = (np.log(size) - np.log(size).mean()) / np.log(size).std()
    for row, drawn in zip(ours, weight, strict=True):
        model = LogisticRegression(C=1e6).fit(scaled[:, None], hit, drawn)
        assert_allclose(
            row, [model.intercept_[0], model.coef_[0, 0]], rtol=0.02, atol=0.02
        )
    for share in (0.5, 0.9):
        at = limits(ours, size, share)
        assert_allclose(np.diag(curve_at(ours, at, size)), share, rtol=1e-6, atol=0)
    assert_allclose(limits(ours, size, 0.5), 0.4, rtol=0.2, atol=0)


def test_limits_say_nothing_of_sizes_that_were_not_tested():
    size, once = np.linspace(0.2, 0.8, 40), np.ones((1, 40))
    none, every = (
        fit_curves(size, np.full((1, 40), value), once) for value in (0.0, 1.0)
    )
    assert np.isinf(limits(none, size, 0.5)[0])
    assert limits(every, size, 0.9)[0] == 0.2


def test_a_curve_never_falls_and_a_sharp_step_is_found():
    size, once = np.linspace(0.2, 0.8, 40), np.ones((1, 40))
    falling = fit_curves(size, (size < 0.5).astype(float)[None], once)
    assert_allclose(
        curve_at(falling, np.array([0.2, 0.8]), size), 0.5, rtol=1e-9, atol=0
    )
    step = fit_curves(size, (size > 0.5).astype(float)[None], once)
    assert_allclose(limits(step, size, 0.5), 0.5, rtol=0.03, atol=0)


def test_a_known_limit_lies_in_the_interval():
    test, severity = study()
    validation, _ = study(seed=1)
    result = answer(test, validation, severity)
    assert result["threshold_from"] == "healthy validation records"
    assert result["false_alarms"]["low"] < 0.06
    crack = result["classes"]["crack"]
    half, most = (row for row in crack["limits"] if row["quantity"] == "severity")
    assert half["low"] < (4 + 1.645) / 12 < half["high"]
    assert half["value"] < most["value"] < 0.75
    depth = next(row for row in crack["limits"] if row["quantity"] == "crack_depth_mm")
    assert_allclose(depth["value"], 4 * half["value"], rtol=1e-6, atol=0)
    shares = [row["share_found"]["mean"] for row in crack["by_severity"]]
    assert shares == sorted(shares)
    assert "crack_depth_mm" in crack["summary"]


def test_perfect_and_blind_scores():
    test, severity = study()
    perfect = answer(judged(100.0 * test.label, test.label, test.unit), None, severity)[
        "classes"
    ]["crack"]
    assert perfect["auroc"]["mean"] == 1
    assert perfect["share_found"]["mean"] == 1
    assert perfect["share_found"]["low"] < 0.9
    assert {row["status"] for row in perfect["limits"]} == {"at_smallest_tested"}
    blind_scores = np.random.default_rng(3).normal(size=test.label.size)
    blind = answer(judged(blind_scores, test.label, test.unit), None, severity)[
        "classes"
    ]["crack"]
    assert blind["auroc"]["low"] < 0.5 < blind["auroc"]["high"]
    assert {row["status"] for row in blind["limits"]} == {"not_reached"}
    assert "at no severity" in blind["summary"]
    equal = answer(
        judged(np.zeros(test.label.size), test.label, test.unit), None, severity
    )["classes"]["crack"]
    assert (equal["auroc"]["mean"], equal["share_found"]["mean"]) == (0.5, 0.0)


def test_the_area_is_that_of_scikit_learn():
    from sklearn.metrics import roc_auc_score

    test, severity = study()
    rounded = np.round(test.log_probability[0, :, 1])
    area = answer(judged(rounded, test.label, test.unit), None, severity)["classes"][
        "crack"
    ]["auroc"]
    assert_allclose(
        area["mean"], roc_auc_score(test.label, rounded), rtol=1e-12, atol=0
    )


def test_too_many_false_alarms_are_said():
    test, severity = study(shift=1.5)
    validation, _ = study(seed=1)
    assert answer(test, validation, severity)["too_many_false_alarms"]
    assert not answer(study(seed=2)[0], validation, severity)["too_many_false_alarms"]


def test_few_healthy_validation_records_are_not_used():
    test, severity = study()
    few = study(n_units=2, per_unit=18)[0]
    result = answer(test, few, severity)
    assert result["threshold_from"] == "healthy test records"
    assert result["false_alarms"]["mean"] <= 0.05


def test_one_unit_has_no_interval_and_one_severity_no_curve():
    test, severity = study(n_units=1, per_unit=60)
    crack = answer(test, None, severity)["classes"]["crack"]
    assert crack["auroc"]["low"] is None
    assert crack["share_found"]["low"] is None
    assert all(row["low"] is None for row in crack["limits"])
    flat = answer(test, None, np.ones_like(severity))["classes"]["crack"]
    assert (flat["by_severity"], flat["limits"], flat["curve"]["severity"]) == (
        [],
        [],
        [],
    )


def test_all_of_few_units_do_not_prove_a_share_of_one():
    interval = share_with_interval(1.0, np.ones(50), 8)
    assert_allclose(interval["low"], 0.025 ** (1 / 8), rtol=1e-6, atol=0)
    assert interval["high"] == 1
    half = share_with_interval(0.5, np.linspace(0.3, 0.7, 101), 8)
    assert_allclose([half["low"], half["high"]], [0.31, 0.69], rtol=0.01, atol=0)


def test_only_what_grows_with_the_severity_is_a_size():
    rng = np.random.default_rng(4)
    severity = rng.uniform(0.2, 0.8, 40)

    class Columns:
        column_names = (
            "params/fault.crack_depth_mm",
            "params/fault.crack_angle_deg",
            "params/fault.pit_width_mm",
        )

        def column(self, name):
            made = {
                "crack_depth": 4 * severity,
                "crack_angle": np.full(40, 45.0),
                "pit_width": rng.uniform(1, 9, 40),
            }
            return made[name.removeprefix("params/fault.").rsplit("_", 1)[0]]

    found = size_columns(Columns(), np.arange(40), severity)
    assert list(found) == ["crack_depth_mm"]
