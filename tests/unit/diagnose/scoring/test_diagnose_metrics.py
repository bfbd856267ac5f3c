"""Scores in closed form, intervals over units, indicators and their baselines."""

from dataclasses import replace

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import accuracy

from diagnose.baselines.base import Parts
from diagnose.baselines.estimators import record_scores
from diagnose.baselines.features import (
    FEATURES,
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
from diagnose.data.windows import subset_segments, task_of
from diagnose.report.page import without_interval
from diagnose.report.text import novelty_caveats, score_cell
from diagnose.scoring.intervals import is_above
from diagnose.scoring.machines import LEAST_UNITS
from diagnose.scoring.metrics import (
    balanced_accuracy,
    macro_f1,
    over_records,
    ratio_with_interval,
    recall,
    score_with_interval,
)
from gensig.errors import DatasetError

TEETH = {"pinion": 23, "wheel": 84}


def accuracy_with_interval(confusion, n_bootstrap=100, **options):
    rng = np.random.default_rng(0)
    resampling = {"n_bootstrap": n_bootstrap, "rng": rng, **options}
    return score_with_interval("balanced_accuracy", confusion, **resampling)


def test_scores_of_a_known_confusion():
    confusion = np.array([[8, 2, 0], [1, 1, 0], [0, 0, 0]])
    assert_allclose(recall(confusion), [0.8, 0.5, np.nan])
    assert_allclose(balanced_accuracy(confusion), 0.65)
    assert_allclose(macro_f1(confusion), (16 / 19 + 2 / 5) / 2)


def test_record_prediction_is_the_mean_log_probability():
    values = np.log([[0.9, 0.1], [0.2, 0.8], [0.2, 0.8], [0.3, 0.7]])
    record, mean = over_records(values, np.array([7, 7, 2, 7]))
    assert record.tolist() == [2, 7]
    assert_allclose(mean[1], values[[0, 1, 3]].mean(axis=0), rtol=1e-12)


def test_interval_is_over_units_not_over_records():
    """Ten units, each all right or all wrong: more records in a unit change nothing."""
    confusion = np.zeros((1, 10, 2, 2), dtype=int)
    confusion[0, :5, [0, 1], [0, 1]] = 1
    confusion[0, 5:, [0, 1], [1, 0]] = 1
    few, many = (accuracy_with_interval(n * confusion, 4000) for n in (2, 200))
    assert few["mean"] == pytest.approx(0.5)
    assert_allclose([many["low"], many["high"]], [few["low"], few["high"]], rtol=1e-12)
    expected = 2 * 1.96 * np.sqrt(0.25 / 10)
    assert few["high"] - few["low"] == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("n_units", [1, 3, 4])
def test_few_units_have_no_interval(n_units):
    """Two that agree would give 0.50 [0.50, 0.50]."""
    confusion = np.ones((1, n_units, 2, 2), dtype=int)
    resampling = {"n_bootstrap": 100, "rng": np.random.default_rng(0)}
    ratio = ratio_with_interval("balanced_accuracy", confusion, confusion, **resampling)
    score = accuracy_with_interval(confusion)
    few = n_units < LEAST_UNITS
    for result in (score, ratio):
        assert (result["low"] is None) == (result["high"] is None) == few
        assert not is_above(result, 2.0)
    text = "0.50 [too few machines]" if few else "0.50 [0.50"
    assert score_cell({"balanced_accuracy": score}).startswith(text)


def test_the_reason_for_a_missing_interval_is_given_once():
    few, many = ({"resampled": {"machines": n}} for n in (2, 12))
    gears = {"resampled": {"sets of gears": 2, "gearboxes": 4}}
    protocols = {"by_unit": few, "cross_speed": few, "cross_snr": many}
    protocols["cross_specimen"] = gears
    lines = without_interval({"protocols": protocols, "novelty": {}})
    begin = "in the test part for an interval; 4 are the least"
    assert lines[0].startswith(f"by_unit, cross_speed: too few machines (2) {begin}")
    assert lines[1].startswith(f"cross_specimen: too few sets of gears (2) {begin}")
    assert len(lines) == 2
    assert without_interval({"protocols": {"by_unit": many}, "novelty": {}}) == []


def test_interval_covers_the_truth_about_as_often_as_it_promises():
    rng = np.random.default_rng(3)
    covered = 0
    for _ in range(100):
        right = rng.binomial(10, np.clip(rng.normal(0.7, 0.1, 20), 0, 1))
        counts = np.stack([right, 10 - right, 0 * right, 0 * right], axis=1)
        score = accuracy_with_interval(counts.reshape(1, 20, 2, 2), 400, rng=rng)
        covered += score["low"] <= 0.7 <= score["high"]
    assert 0.85 < covered / 100 < 1.0


@pytest.mark.parametrize("naming", [[0, 1, 3, 2], [1, 2, 3, 0], [0, 2, 3, 1]])
def test_interval_of_a_shuffle_covers_the_luck_of_its_names_but_not_a_leak(naming):
    """Groups without names score 0, 1/4, 1/2 or 1 once; three runs that are right are no luck."""

    def interval(*namings):
        counts = [[5 * np.eye(4, dtype=int)[names]] * 6 for names in namings]
        return accuracy_with_interval(np.array(counts), 2000, shuffled=True)

    score = interval(naming)
    assert score["low"] - 0.01 < 0.25 < score["high"] + 0.01
    assert interval(*[[0, 1, 2, 3]] * 3)["low"] > 0.25


def task_on(**changes):
    dataset = FakeDataset(**({"strength": 2.0} | changes))
    return task_of(dataset, window_samples=1000, stride_samples=1000, normalise="rms")


def make_parts(task):
    return Parts.of(
        lambda name: feature_table(task, subset_segments(task, "by_unit", name))
    )


@pytest.fixture(scope="module")
def parts():
    return make_parts(task_on(n_units=4, records_per_unit=4))


def changed(parts, change):
    """Parts whose tables a function changes."""
    return Parts.of(lambda name: change(getattr(parts, name)))


@pytest.mark.parametrize(
    ("features", "columns", "changes"),
    [
        ("basic", ["fm4_pinion"], {}),
        (
            "all",
            ["spectral_kurtosis", "fm0_pinion", "m6a_pinion", "na4_pinion"],
            {"n_units": 4, "records_per_unit": 16, "duration": 1.5},
        ),
    ],
)
def test_indicators_react_to_the_impulses_of_a_missing_tooth(
    features, columns, changes
):
    task = task_on(**changes)
    segments = subset_segments(task, "by_unit", "train")
    table = feature_table(task, segments, features=features)
    assert len(table.names) == table.values.shape[1] == len(FEATURES[features])
    for name in columns:
        values = table.values[:, table.names.index(f"channel_0/{name}")]
        healthy, missing = (np.nanmedian(values[table.label == k]) for k in (0, 3))
        assert missing > 1.5 * healthy, name


def test_indicators_are_nan_without_enough_turns():
    """One turn is enough for the basic ones, twenty are needed for all."""
    x = np.random.default_rng(0).standard_normal((2, 12800))
    slow, fast = {"pinion": 30.0, "wheel": 8.0}, {"pinion": 20.0, "wheel": 19.9}
    basic = indicators(x, 12800.0, fast, TEETH)
    assert np.isfinite(basic).all()
    every = indicators(x, 12800.0, fast, TEETH, features="all")
    short = indicators(x[:, :1000], 12800.0, slow, TEETH)
    for table, features in ((every, "all"), (short, "basic")):
        assert table.shape == (2, len(FEATURES[features]))
        for index, name in enumerate(FEATURES[features]):
            assert np.isnan(table[:, index]).all() == name.endswith("_wheel"), name
    known = [k for k, name in enumerate(INDICATORS) if not name.endswith("_wheel")]
    assert_array_equal(every[:, known], basic[:, known])
    tiny = indicators(x[:, :100], 12800.0, fast, TEETH, features="all")
    assert np.isnan(tiny[:, FEATURES["all"].index("spectral_kurtosis")]).all()


def test_all_features_at_a_rate_that_holds_no_mesh_band_are_nan():
    x = np.random.default_rng(0).standard_normal((1, 30000))
    speed = {"pinion": 16.0, "wheel": 30.0}
    table = indicators(x, 1000.0, speed, TEETH, features="all")
    unknown = dict(zip(FEATURES["all"], np.isnan(table[0]).tolist(), strict=True))
    assert all(
        unknown[name] for name in ("fm0_wheel", "nb4_pinion", "spectral_kurtosis")
    )
    assert not unknown["fm0_pinion"]


def test_features_do_not_depend_on_the_cache():
    task = task_on(n_units=4, records_per_unit=4)
    segments = subset_segments(task, "by_unit", "train")
    cache = {}
    first = feature_table(task, segments, cache=cache).values
    assert len(cache) == segments.record.size
    assert_array_equal(first, feature_table(task, segments, cache=cache).values)
    assert_array_equal(first, feature_table(task, segments).values)
    del task.dataset.attributes["n_teeth_wheel"]
    with pytest.raises(DatasetError, match="n_teeth_wheel"):
        feature_table(task, segments)


def fit_and_score(baseline, parts):
    """Description of the fit, the test records, and their log-probabilities."""
    n_classes = int(parts.test.label.max()) + 1
    detail = baseline.fit(parts.train, parts.validation, n_classes)
    probability = baseline.predict_proba(parts.test)
    return detail, *record_scores(probability, parts.test.record)


@pytest.mark.parametrize(
    ("baseline", "changes", "low", "high"),
    [
        (IndicatorModelWithoutLevel, {}, 0.6, 1.0),
        (IndicatorModel, {"strength": 0.0, "n_units": 12}, 0.0, 0.55),
    ],
)
def test_indicator_models_find_the_fault_and_stay_at_chance_without_one(
    baseline, changes, low, high
):
    task = task_on(**changes)
    _, record, scores = fit_and_score(baseline(), make_parts(task))
    assert low <= accuracy(task, record, scores.argmax(axis=1)) <= high


def test_indicator_models_ignore_a_column_without_values(parts):
    def with_gap(table):
        gap = np.full((len(table.values), 1), np.nan)
        values = np.concatenate([table.values, gap], axis=1)
        return replace(
            table, values=values, names=(*table.names, "channel_0/nb4_wheel")
        )

    detail, _, scores = fit_and_score(IndicatorModel(), parts)
    other_detail, _, other = fit_and_score(IndicatorModel(), changed(parts, with_gap))
    assert detail == other_detail
    assert_array_equal(scores, other)


@pytest.mark.parametrize(
    ("baseline", "same"), [(IndicatorModelWithoutLevel, True), (IndicatorModel, False)]
)
def test_the_level_changes_only_the_model_with_it(parts, baseline, same):
    def louder(table):
        level = np.array([name.endswith("log_rms") for name in table.names])
        return replace(table, values=table.values + level * table.label[:, None])

    scores, other = (
        fit_and_score(baseline(), part)[2] for part in (parts, changed(parts, louder))
    )
    assert np.array_equal(scores, other) == same


@pytest.mark.parametrize(
    ("names", "low", "high"),
    [(("a/log_rms", "a/kurtosis"), 1.0, 1.0), (("a/kurtosis", "a/log_rms"), 0.0, 0.7)],
)
def test_rms_threshold_uses_the_level_only(names, low, high):
    """The first column tells the class, the second is noise."""
    rng = np.random.default_rng(0)
    record, label = np.arange(200), np.arange(200) % 2
    level = np.log(1 + label + 0.1 * rng.uniform(size=200))
    values = np.stack([level, rng.normal(size=200)], axis=1)
    table = FeatureTable(values=values, names=names, label=label, record=record)
    detail, _, scores = fit_and_score(RmsThreshold(), Parts.of(lambda _: table))
    assert low <= (scores.argmax(axis=1) == label).mean() <= high
    assert detail.startswith("thresholds 1.") == (low == 1.0)


def test_the_scarcest_groups_of_a_novelty_test_are_told():
    """Of machines and units, those of which there are fewest, whatever their names."""
    result = {"n_records": {"validation": 1000}, "resampled": {}}
    for kinds in (("machines", "units"), ("units", "machines")):
        result["resampled"] = dict(zip(kinds, (12, 3), strict=True))
        (line,) = novelty_caveats({"new_class": result})
        assert line.startswith(f"new_class: only 3 {kinds[1]} in the test part")
    result["resampled"] = {"machines": 12, "units": 10}
    assert novelty_caveats({"new_class": result}) == []
