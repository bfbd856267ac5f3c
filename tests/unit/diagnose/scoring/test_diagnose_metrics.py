"""Scores in closed form, intervals over units, indicators and baselines."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from threadpoolctl import threadpool_limits

from diagnose.baselines.estimators import record_scores
from diagnose.baselines.features import (
    FEATURES,
    GEARS,
    INDICATORS,
    FeatureTable,
    feature_table,
    indicators,
)
from diagnose.baselines.indicator_models import (
    IndicatorModel,
    IndicatorModelWithoutLevel,
)
from diagnose.baselines.rms_threshold import RmsThreshold
from diagnose.data.windows import SUBSETS, subset_segments, task_of
from diagnose.report.page import without_interval
from diagnose.report.text import score_cell
from diagnose.scoring.metrics import (
    LEAST_UNITS,
    balanced_accuracy,
    confusion_by_unit,
    is_above,
    macro_f1,
    over_records,
    ratio_with_interval,
    recall,
    score_with_interval,
)
from gensig.errors import DatasetError


@pytest.fixture(autouse=True)
def one_thread():
    """As in a worker; many small OpenMP loops on busy cores take minutes."""
    with threadpool_limits(1):
        yield


CONFUSION = np.array([[8, 2, 0], [1, 1, 0], [0, 0, 0]])


def test_scores_of_a_known_confusion():
    assert_allclose(recall(CONFUSION), [0.8, 0.5, np.nan])
    assert_allclose(balanced_accuracy(CONFUSION), 0.65)
    assert_allclose(macro_f1(CONFUSION), (16 / 19 + 2 / 5) / 2)


def test_scores_agree_with_scikit_learn():
    from sklearn.metrics import balanced_accuracy_score, f1_score

    rng = np.random.default_rng(0)
    true, predicted = rng.integers(4, size=200), rng.integers(4, size=200)
    confusion = confusion_by_unit(true, predicted, rng.integers(5, size=200), 4)
    assert confusion.shape == (5, 4, 4)
    assert_allclose(
        balanced_accuracy(confusion.sum(axis=0)),
        balanced_accuracy_score(true, predicted),
        rtol=1e-12,
    )
    assert_allclose(
        macro_f1(confusion.sum(axis=0)),
        f1_score(true, predicted, average="macro"),
        rtol=1e-12,
    )


def test_record_prediction_is_the_mean_log_probability():
    values = np.log([[0.9, 0.1], [0.2, 0.8], [0.2, 0.8], [0.3, 0.7]])
    record, mean = over_records(values, np.array([7, 7, 2, 7]))
    assert record.tolist() == [2, 7]
    assert_allclose(mean[1], values[[0, 1, 3]].mean(axis=0), rtol=1e-12)


def test_interval_is_over_units_not_over_records():
    """Ten units, each all right or all wrong: the interval does not shrink with more records in a unit."""
    widths = []
    for n in (2, 200):
        confusion = np.zeros((1, 10, 2, 2), dtype=int)
        confusion[0, :5, [0, 1], [0, 1]] = n
        confusion[0, 5:, [0, 1], [1, 0]] = n
        score = score_with_interval(
            "balanced_accuracy",
            confusion,
            n_bootstrap=4000,
            rng=np.random.default_rng(0),
        )
        assert score.mean == pytest.approx(0.5)
        widths.append(score.high - score.low)
    assert_allclose(widths, [widths[0]] * 2, rtol=1e-12)
    assert widths[0] == pytest.approx(2 * 1.96 * np.sqrt(0.25 / 10), abs=0.1)


@pytest.mark.parametrize("n_units", [1, 2, 3, 4])
def test_few_units_have_no_interval(n_units):
    """Two that agree would say 0.50 [0.50, 0.50]."""
    confusion = np.ones((1, n_units, 2, 2), dtype=int)
    score = score_with_interval(
        "balanced_accuracy", confusion, n_bootstrap=100, rng=np.random.default_rng(0)
    )
    ratio = ratio_with_interval(
        "balanced_accuracy",
        confusion,
        confusion,
        n_bootstrap=100,
        rng=np.random.default_rng(0),
    )
    for found in (asdict(score), ratio):
        assert (
            (found["low"] is None) == (found["high"] is None) == (n_units < LEAST_UNITS)
        )
        assert not is_above(found, 2.0)
    assert score_cell({"balanced_accuracy": asdict(score)}).startswith(
        "0.50 [too few machines]" if n_units < LEAST_UNITS else "0.50 [0.50"
    )


def test_why_there_is_no_interval_is_said_once():
    few, many = ({"n_units": {"test": n}} for n in (2, 12))
    (line,) = without_interval(
        {
            "protocols": {"by_unit": few, "cross_speed": few, "cross_snr": many},
            "novelty": {},
        }
    )
    assert line.startswith(
        "by_unit, cross_speed: 2 test unit(s) are too few machines for an interval, 4 are the least"
    )
    assert without_interval({"protocols": {"by_unit": many}, "novelty": {}}) == []


def test_interval_covers_the_truth_about_as_often_as_it_says():
    rng = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        rate = np.clip(rng.normal(0.7, 0.1, 20), 0, 1)
        right = rng.binomial(10, rate)
        confusion = np.zeros((1, 20, 1, 2), dtype=int)
        confusion = np.stack(
            [np.stack([right, 10 - right], axis=1), np.zeros((20, 2), dtype=int)],
            axis=1,
        )[None]
        score = score_with_interval(
            "balanced_accuracy", confusion, n_bootstrap=400, rng=rng
        )
        covered += score.low <= 0.7 <= score.high
    assert 0.86 < covered / 200 < 1.0


def test_interval_of_a_shuffle_covers_the_luck_of_its_names_but_not_a_leak():
    """Groups found without names: one run scores 0, 1/4, 1/2 or 1; three runs that are all right are no luck."""

    def interval(namings):
        confusion = np.stack(
            [np.stack([5 * np.eye(4, dtype=int)[naming]] * 6) for naming in namings]
        )
        rng = np.random.default_rng(0)
        return score_with_interval(
            "balanced_accuracy", confusion, n_bootstrap=2000, rng=rng, shuffled=True
        )

    for naming in ([0, 1, 3, 2], [1, 2, 3, 0], [0, 2, 3, 1]):
        score = interval([naming])
        assert score.low - 0.01 < 0.25 < score.high + 0.01
    assert interval([[0, 1, 2, 3]] * 3).low > 0.25


def make_tables(**changes):
    dataset = FakeDataset(
        **{"n_units": 8, "records_per_unit": 8, "strength": 2.0, **changes}
    )
    task = task_of(dataset, window_samples=1000, stride_samples=1000, normalise="rms")
    return [
        feature_table(task, subset_segments(task, "by_unit", subset))
        for subset in SUBSETS
    ], task


def test_indicators_have_their_names_and_react_to_impulses():
    (train, _, _), _ = make_tables()
    assert train.values.shape[1] == len(INDICATORS) == len(train.names)
    column = train.names.index("channel_0/fm4_pinion")
    healthy, missing = (
        np.nanmedian(train.values[train.label == label, column]) for label in (0, 3)
    )
    assert missing > 1.5 * healthy


def test_indicators_are_nan_without_a_whole_turn():
    x = np.random.default_rng(0).standard_normal((2, 1000))
    table = indicators(
        x, 12800.0, {"pinion": 30.0, "wheel": 8.0}, {"pinion": 23, "wheel": 84}
    )
    for index, name in enumerate(INDICATORS):
        assert np.isnan(table[:, index]).all() == name.endswith("_wheel"), name
    assert GEARS == ("pinion", "wheel")


def test_all_features_are_the_basic_ones_and_more_from_twenty_turns_up():
    x = np.random.default_rng(0).standard_normal((2, 12800))
    speed, teeth = {"pinion": 20.0, "wheel": 19.9}, {"pinion": 23, "wheel": 84}
    basic, table = (
        indicators(x, 12800.0, speed, teeth),
        indicators(x, 12800.0, speed, teeth, features="all"),
    )
    assert table.shape == (2, len(FEATURES["all"])) == (2, 20)
    for index, name in enumerate(FEATURES["all"]):
        assert np.isnan(table[:, index]).all() == name.endswith("_wheel"), name
    known = [
        index for index, name in enumerate(INDICATORS) if not name.endswith("_wheel")
    ]
    np.testing.assert_array_equal(table[:, known], basic[:, known])
    assert np.isfinite(basic).all()
    short = indicators(x[:, :100], 12800.0, speed, teeth, features="all")
    assert np.isnan(short[:, FEATURES["all"].index("spectral_kurtosis")]).all()


def test_all_features_see_the_impulses_of_a_missing_tooth():
    dataset = FakeDataset(n_units=4, records_per_unit=16, strength=2.0, duration=1.5)
    task = task_of(dataset, window_samples=1000, stride_samples=1000, normalise="rms")
    table = feature_table(
        task, subset_segments(task, "by_unit", "train"), features="all"
    )
    assert len(table.names) == table.values.shape[1] == len(FEATURES["all"])
    for name in ("spectral_kurtosis", "fm0_pinion", "m6a_pinion", "na4_pinion"):
        column = table.values[:, table.names.index(f"channel_0/{name}")]
        healthy, missing = (column[table.label == label] for label in (0, 3))
        assert np.median(missing) > 1.5 * np.median(healthy), name


def test_all_features_at_a_rate_that_holds_no_mesh_band_are_nan():
    x = np.random.default_rng(0).standard_normal((1, 30000))
    table = indicators(
        x,
        1000.0,
        {"pinion": 16.0, "wheel": 30.0},
        {"pinion": 23, "wheel": 84},
        features="all",
    )
    found = dict(zip(FEATURES["all"], np.isnan(table[0]).tolist(), strict=True))
    assert found["fm0_wheel"]
    assert found["nb4_pinion"]
    assert found["spectral_kurtosis"]
    assert not found["fm0_pinion"]


def test_features_do_not_depend_on_threads_or_cache():
    _, task = make_tables(n_units=4, records_per_unit=4)
    segments = subset_segments(task, "by_unit", "train")
    cache = {}
    first = feature_table(task, segments, cache=cache, n_threads=2).values
    assert len(cache) == segments.record.size
    np.testing.assert_array_equal(
        first, feature_table(task, segments, cache=cache).values
    )
    np.testing.assert_array_equal(first, feature_table(task, segments).values)


def test_missing_tooth_count_is_one_clear_error():
    _, task = make_tables(n_units=4, records_per_unit=4)
    del task.dataset.attributes["n_teeth_wheel"]
    with pytest.raises(DatasetError, match="n_teeth_wheel"):
        feature_table(task, subset_segments(task, "by_unit", "train"))


def accuracy(record, predicted, task):
    label = task.labels()[record]
    return float(
        balanced_accuracy(
            confusion_by_unit(label, predicted, np.zeros_like(label), 4)[0]
        )
    )


def judged(baseline, train, validation, test):
    """What was fitted, the test records, and their log-probabilities."""
    detail = baseline.fit(train, validation, int(test.label.max()) + 1)
    return detail, *record_scores(baseline.predict_proba(test), test.record)


def test_indicator_model_finds_the_fault_and_stays_at_chance_without_one():
    tables, task = make_tables()
    _, record, score = judged(IndicatorModelWithoutLevel(), *tables)
    assert accuracy(record, score.argmax(axis=1), task) > 0.6
    tables, task = make_tables(strength=0.0, n_units=12)
    _, record, score = judged(IndicatorModel(), *tables)
    assert accuracy(record, score.argmax(axis=1), task) < 0.55


def test_indicator_model_passes_over_what_no_stretch_is_long_enough_for():
    tables, _ = make_tables(n_units=4, records_per_unit=4)
    with_gap = []
    for table in tables:
        values = np.concatenate(
            [table.values, np.full((len(table.values), 1), np.nan)], axis=1
        )
        with_gap.append(
            replace(table, values=values, names=(*table.names, "channel_0/nb4_wheel"))
        )
    first = judged(IndicatorModel(), *tables)
    second = judged(IndicatorModel(), *with_gap)
    assert first[0] == second[0]
    np.testing.assert_array_equal(first[2], second[2])


def test_the_level_changes_the_model_with_it_and_not_the_one_without():
    tables, _ = make_tables(n_units=4, records_per_unit=4)
    louder = []
    for table in tables:
        level = np.array([name.endswith("log_rms") for name in table.names])
        louder.append(
            replace(table, values=table.values + level * table.label[:, None])
        )
    without = [
        judged(IndicatorModelWithoutLevel(), *several)[2]
        for several in (tables, louder)
    ]
    np.testing.assert_array_equal(*without)
    with_level = [judged(IndicatorModel(), *several)[2] for several in (tables, louder)]
    assert (with_level[0] != with_level[1]).any()


def test_rms_threshold_uses_the_level_only():
    rng = np.random.default_rng(0)
    label = np.arange(200) % 2
    values = np.stack(
        [np.log(1 + label + 0.1 * rng.uniform(size=200)), rng.normal(size=200)], axis=1
    )
    table = FeatureTable(
        values=values,
        names=("a/log_rms", "a/kurtosis"),
        label=label,
        record=np.arange(200),
    )
    text, _, score = judged(RmsThreshold(), table, table, table)
    assert (score.argmax(axis=1) == label).all()
    assert text.startswith("thresholds 1.")
    blind = FeatureTable(
        values=values[:, ::-1], names=table.names, label=label, record=table.record
    )
    assert (
        judged(RmsThreshold(), blind, blind, blind)[2].argmax(axis=1) == label
    ).mean() < 0.7
