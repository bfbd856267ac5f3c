"""Detection at 5 % false alarms: thresholds keep their promise, and curves have known limits."""

from types import SimpleNamespace

import numpy as np
import pytest
from judged_tables import cracks_table, found_cracks
from numpy.random import default_rng
from numpy.testing import assert_allclose
from scipy.special import expit
from scipy.stats import binomtest, zscore
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score

from diagnose.scoring.alarms import LEAST_HEALTHY, alarm_threshold
from diagnose.scoring.detection_curve import curve_at, fit_curves, limits
from diagnose.scoring.detection_limit import detection_score, size_columns
from diagnose.scoring.intervals import exact_interval, share_with_interval
from diagnose.scoring.machines import Support


def study(n_units=20, per_unit=20, shift=0.0, seed=0):
    """Normal healthy scores; those of cracks of severity s are 12 s - 4 higher.

    Half of the cracks are found at 5 % alarms near 0.47.
    """
    rng = default_rng(seed)
    unit = np.repeat(np.arange(n_units), per_unit)
    label = np.arange(unit.size) % 2
    severity = rng.uniform(0.1, 0.9, unit.size)
    score = rng.normal(size=(2, unit.size)) + label * (12 * severity - 4) + shift
    return cracks_table(score, label, unit), severity[label == 1]


@pytest.fixture(scope="module")
def cracks():
    return study()


def held_back(n_units=20, per_unit=20):
    """Healthy records of validation machines."""
    judged_there, _ = study(n_units=n_units, per_unit=per_unit, seed=1)
    return judged_there.of(judged_there.truth == 0)


@pytest.fixture(scope="module")
def validation():
    return held_back()


def answer(test, healthy_elsewhere, severity):
    sizes = {"severity": severity, "crack_depth_mm": 4 * severity}
    return found_cracks(test, healthy_elsewhere, sizes, n_bootstrap=200)


def crack_with(score, cracks):
    """Result of the cracks for other scores."""
    test, severity = cracks
    other = cracks_table(score, test.truth, test.unit)
    return answer(other, held_back(), severity)["classes"]["crack"]


@pytest.mark.parametrize("offset", [0, 7])
def test_the_score_ranks_by_the_odds_of_any_fault_without_offset(offset):
    logs = np.log(np.array([[0.5, 0.3, 0.2], [0.2, 0.4, 0.4]])) + offset
    expected = np.log([1.0, 4.0])
    assert_allclose(detection_score(logs, 0), expected, atol=1e-12)


@pytest.mark.parametrize(
    "n_records",
    [19, 20, 57, 400],
)
def test_at_most_one_in_twenty_new_healthy_records_is_an_alarm(n_records):
    rng = default_rng(n_records)
    known, new = rng.normal(size=(300, n_records)), rng.normal(size=(300, 200))
    alarms = new > np.array([alarm_threshold(scores) for scores in known])
    assert 0.02 < np.mean(alarms) < 0.055


def test_a_repeated_record_counts_as_often_as_it_was_drawn():
    values, counts = np.array([3.0, 1.0, 2.0]), np.array([[1, 30, 9]])
    expanded = np.repeat(values, counts[0])
    assert alarm_threshold(values, counts)[0] == np.sort(expanded)[39 - 1]


def test_curves_are_those_of_ordinary_logistic_regression():
    rng = default_rng(2)
    size = rng.uniform(0.1, 0.9, 400)
    hit = rng.uniform(size=400) < expit(3 * np.log(size / 0.4))
    weight = rng.integers(0, 3, (3, 400)).astype(float)
    curves = fit_curves(
        size,
        np.tile(hit, (3, 1)).astype(float),
        weight,
    )
    scaled = zscore(np.log(size))[:, None]

    for row, drawn in zip(curves, weight, strict=True):
        model = LogisticRegression(C=1e6).fit(scaled, hit, drawn)
        expected = [
            model.intercept_[0],
            model.coef_[0, 0],
        ]
        assert_allclose(row, expected, rtol=0.02, atol=0.02)
    for share in (0.5, 0.9):
        at = limits(curves, size, share)
        reached = np.diag(curve_at(curves, at, size))
        assert_allclose(reached, share, rtol=1e-6)
    assert_allclose(
        limits(curves, size, 0.5),
        0.4,
        rtol=0.2,
    )


def test_limits_stay_within_the_tested_sizes_and_curves_never_fall():
    size = np.linspace(0.2, 0.8, 40)

    def fitted(hits):
        return fit_curves(
            size,
            (hits + 0.0 * size)[None],
            np.ones((1, 40)),
        )

    def limit(hits, share=0.5):
        return limits(fitted(hits), size, share)[0]

    assert np.isinf(limit(0.0))
    assert limit(1.0, 0.9) == 0.2
    assert_allclose(limit(size > 0.5), 0.5, rtol=0.03)

    level = curve_at(
        fitted(size < 0.5),
        np.array([0.2, 0.8]),
        size,
    )
    assert_allclose(level, 0.5)


def test_a_known_limit_lies_in_the_interval(cracks, validation):
    test, severity = cracks
    result = answer(test, validation, severity)
    source = "200 healthy records of 20 validation machines"
    assert result["threshold_from"] == source
    assert result["false_alarms"]["low"] < 0.06
    assert not result["too_many_false_alarms"]

    crack = result["classes"]["crack"]
    half, most, depth, _ = crack["limits"]
    assert (half["quantity"], depth["quantity"]) == ("severity", "crack_depth_mm")
    assert half["low"] < (4 + 1.645) / 12 < half["high"]
    assert half["value"] < most["value"] < 0.75
    assert_allclose(
        depth["value"],
        4 * half["value"],
        rtol=1e-6,
    )

    shares = [row["share_found"]["mean"] for row in crack["by_severity"]]
    assert shares == sorted(shares)
    assert "crack_depth_mm" in crack["summary"]


def test_the_share_of_resamples_is_of_the_resamples_alone():
    """The scores as they are lead the rows of values, and are none of them."""
    rng = default_rng(0)
    unit = np.repeat(np.arange(8), 10)
    label = np.arange(unit.size) % 2
    severity = rng.uniform(0.1, 0.9, unit.size)
    score = rng.normal(size=(1, unit.size)) + label * (6 * severity - 3)
    test = cracks_table(score, label, unit)
    result = answer(test, held_back(), severity[label == 1])
    limits_of = result["classes"]["crack"]["limits"]
    counts = [200 * row["share_of_resamples_reached"] for row in limits_of]
    assert any(20 < count < 180 for count in counts)
    assert_allclose(counts, np.round(counts), atol=1e-9)


def test_perfect_blind_and_equal_scores(cracks):
    label = cracks[0].truth
    perfect = crack_with(100.0 * label, cracks)
    share = perfect["share_found"]

    assert perfect["auroc"]["mean"] == share["mean"] == 1
    assert share["low"] < 0.9

    blind = crack_with(
        default_rng(3).normal(size=label.size),
        cracks,
    )
    assert blind["auroc"]["low"] < 0.5 < blind["auroc"]["high"]
    assert "at no severity" in blind["summary"]
    for result, expected in ((perfect, "at_smallest_tested"), (blind, "not_reached")):
        assert {row["status"] for row in result["limits"]} == {expected}

    equal = crack_with(np.zeros(label.size), cracks)
    assert (equal["auroc"]["mean"], equal["share_found"]["mean"]) == (0.5, 0.0)


def test_the_area_is_that_of_scikit_learn(cracks):
    test, _ = cracks
    rounded = np.round(test.answers[0, :, 1])
    area = crack_with(rounded, cracks)["auroc"]["mean"]
    assert_allclose(area, roc_auc_score(test.truth, rounded))


def test_too_many_false_alarms_are_reported(validation):
    test, severity = study(shift=1.5)
    assert answer(test, validation, severity)["too_many_false_alarms"]


@pytest.mark.parametrize("healthy_elsewhere", [None, held_back(n_units=2, per_unit=18)])
def test_without_enough_healthy_records_elsewhere_no_alarm_is_told(
    cracks, healthy_elsewhere
):
    """The records that are scored never set the threshold."""
    test, severity = cracks
    result = answer(test, healthy_elsewhere, severity)
    n_records = 0 if healthy_elsewhere is None else 18
    assert f"needs {LEAST_HEALTHY} healthy" in result["missing"]
    assert f"there are {n_records}:" in result["missing"]
    assert result["threshold"] == [None, None]
    crack = result["classes"]["crack"]
    assert result["false_alarms"]["mean"] is crack["share_found"]["mean"] is None
    assert crack["limits"] == crack["by_severity"] == []
    assert crack["auroc"]["low"] > 0.6
    assert "AUROC" in crack["summary"]
    assert result["missing"] in crack["summary"]


def test_one_unit_has_no_interval_and_one_severity_no_curve():
    test, severity = study(n_units=1, per_unit=60)
    crack = answer(test, held_back(), severity)["classes"]["crack"]
    scores = (crack["auroc"], crack["share_found"], *crack["limits"])

    assert all(score["low"] is None for score in scores)

    flat = answer(test, held_back(), np.ones_like(severity))["classes"]["crack"]
    assert flat["by_severity"] == flat["limits"] == flat["curve"]["severity"] == []


def test_all_of_few_units_do_not_prove_a_share_of_one():
    eight = Support(kind="machines", n_groups=8)
    interval = share_with_interval(np.ones(51), eight)
    assert_allclose(
        interval["low"],
        0.025 ** (1 / 8),
        rtol=1e-6,
    )
    assert interval["high"] == 1


def test_the_interval_of_a_rate_is_exact_over_groups_of_machines():
    """As many independent trials, whatever few resamples show; more where these spread more."""
    twenty = Support(kind="machines", n_groups=20)
    one_of_twenty = share_with_interval(np.full(51, 0.05), twenty)
    exact = binomtest(1, 20).proportion_ci(0.95, method="exact")
    assert_allclose(
        [one_of_twenty["low"], one_of_twenty["high"]], [exact.low, exact.high]
    )
    assert 0.24 < exact.high < 0.25
    spread = share_with_interval(np.array([0.5, *np.linspace(0, 1, 101)]), twenty)
    assert_allclose([spread["low"], spread["high"]], [0.02, 0.98], atol=0.011)
    half = exact_interval(0.125, 4)  # half a success
    assert exact_interval(0.0, 4)[1] < half[1] < exact_interval(0.25, 4)[1]


def test_only_parameters_that_grow_with_the_severity_are_sizes():
    rng = default_rng(4)
    severity = rng.uniform(0.2, 0.8, 40)
    columns = {
        "params/fault.crack_depth_mm": 4 * severity,
        "params/fault.crack_angle_deg": np.full(40, 45.0),
        "params/fault.pit_width_mm": rng.uniform(1, 9, 40),
        "params/fault.shrinking_mm": 1 - severity,
        "params/fault.from_zero_mm": severity - severity.min(),
        "params/fault.two_values_mm": np.round(severity) + 1,
        "params/operating.speed_rpm": severity,
    }
    dataset = SimpleNamespace(
        column_names=list(columns),
        column=columns.get,
    )

    assert list(size_columns(dataset, np.arange(40), severity)) == ["crack_depth_mm"]
