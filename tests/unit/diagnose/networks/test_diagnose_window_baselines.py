"""MiniRocket against its definition; baselines on windows find a visible fault and nothing else."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from small_studies import accuracy, task_on, windows_of

from diagnose.baselines.base import Parts
from diagnose.baselines.estimators import record_scores
from diagnose.baselines.minirocket import (
    KERNELS,
    MiniRocket,
    _dilations,
    fit_minirocket,
    minirocket_features,
    rocket_tables,
)
from diagnose.baselines.nearest_spectrum import NearestSpectrum, spectrum_table
from diagnose.baselines.window_features import over_stretches
from diagnose.data.windows import SUBSETS


def make_windows(n_channels=1, n=6, n_samples=400, seed=0):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, n_channels, n_samples)).astype(np.float32)


def banks_of(windows, per_kernel):
    rng = np.random.default_rng(0)
    return fit_minirocket(windows, n_features=84 * per_kernel, rng=rng)


def make_sets(**changes):
    values = {"n_units": 12, "strength": 2.0, "noise": 0.2} | changes
    dataset = FakeDataset(**values)
    task = task_on(dataset, 1000)
    return dict(zip(SUBSETS, windows_of(task, *SUBSETS), strict=True)), task


def test_every_feature_of_a_stretch_is_the_mean_of_its_windows_and_has_a_name():
    sets, _ = make_sets()
    train = sets["train"]

    def level_and_mean(windows):
        return np.stack([windows.std(axis=(1, 2)), windows.mean(axis=(1, 2))], axis=1)

    table = over_stretches(train, level_and_mean, "feature")
    assert table.names == ("feature_0", "feature_1")
    assert table.values.shape == (len(table.label), 2)
    cut = level_and_mean(train.cut(np.arange(len(train.label))))
    first = train.segment == train.segment.min()
    assert_allclose(table.values[0], cut[first].mean(axis=0), rtol=1e-6)


def test_kernels_are_the_84_and_see_no_offset():
    assert KERNELS.shape == (84, 9)
    assert len({tuple(kernel) for kernel in KERNELS.tolist()}) == 84
    assert_allclose(KERNELS.sum(axis=1), 0.0, atol=1e-12)


def test_features_follow_the_definition():
    """Every share by a loop over taps, kernels and thresholds in numpy."""
    windows = make_windows(n_channels=3, n=4)
    banks = banks_of(windows, 6)
    expected = []
    for bank in banks:
        margin = 4 * bank.dilation
        padded = np.pad(windows.astype(float), ((0, 0), (0, 0), (margin, margin)))
        starts = [tap * bank.dilation for tap in range(9)]
        taps = np.stack([padded[..., start:][..., :400] for start in starts], axis=-1)
        output = np.einsum("wcsk,fck->wfs", taps, bank.weight.numpy().astype(float))
        for kernel in range(84):
            inner = slice(None) if bank.padded[kernel] else slice(margin, -margin)
            values = output[:, kernel, inner]
            expected += [(values > bias).mean(axis=1) for bias in bank.bias[kernel]]
    assert len(expected) == 84 * 6
    features = minirocket_features(windows, banks)
    assert_allclose(features, np.transpose(expected), atol=0.006)
    assert 0 < sum(bank.padded.sum() for bank in banks) < 84 * len(banks)


def test_thresholds_are_spread_over_the_output():
    """On windows of the same kind the shares are spread evenly from 0 to 1."""
    banks = banks_of(make_windows(n=40), 10)
    shares = minirocket_features(make_windows(n=40, seed=1), banks).mean(axis=0)
    assert_allclose(np.sort(shares), np.linspace(0, 1, shares.size), atol=0.06)


def test_every_kernel_sees_some_channel_and_not_always_all():
    bank = banks_of(make_windows(n_channels=4), 1)[0]
    n_channels = (bank.weight.abs().sum(dim=2) > 0).sum(dim=1)
    assert n_channels.min() == 1
    assert n_channels.max() == 4


@pytest.mark.parametrize(
    ("n_samples", "per_kernel"), [(400, 1), (400, 6), (6400, 119), (9, 3), (50, 40)]
)
def test_dilations_fit_the_window_and_give_the_wanted_features(n_samples, per_kernel):
    dilations, counts = zip(*_dilations(n_samples, per_kernel), strict=True)
    assert 8 * max(dilations) <= n_samples - 1
    assert sum(counts) == per_kernel
    assert len(set(dilations)) == len(dilations) <= 32


def test_rows_are_stretches_and_their_mean_over_windows():
    sets, _ = make_sets(n_units=4, duration=0.3)
    train = sets["train"]
    table = spectrum_table(train, [1.0])
    assert len(table.label) == len(train.signals)
    windows = np.flatnonzero(train.segment == 2)
    assert windows.size > 1
    alone = [train.subset(windows[index : index + 1]) for index in range(windows.size)]
    rows = [spectrum_table(part, [1.0]).values[0] for part in alone]
    assert_allclose(table.values[2], np.mean(rows, axis=0), rtol=1e-5, atol=1e-6)
    louder = spectrum_table(train, [0.1]).values
    assert np.median(louder - table.values) == pytest.approx(np.log(10), abs=0.2)


def fit_and_score(baseline, parts, task):
    """Description of the fit, and balanced accuracy over the test records."""
    detail = baseline.fit(parts.train, parts.validation, len(task.class_names))
    probability = baseline.predict_proba(parts.test)
    record, scores = record_scores(probability, parts.test.record)
    return detail, accuracy(task, record, scores.argmax(axis=1))


@pytest.mark.parametrize(
    ("strength", "low", "high"), [(2.0, 0.6, 1.0), (0.0, 0.0, 0.55)]
)
def test_both_find_the_fault_and_stay_at_chance_without_one(strength, low, high):
    sets, task = make_sets(strength=strength)
    rockets = rocket_tables(sets, n_features=84 * 4)
    spectra = Parts.of(lambda subset: spectrum_table(sets[subset], [1.0]))
    detail, score = fit_and_score(MiniRocket(), rockets, task)
    assert detail.startswith("ridge, penalty ")
    assert low <= score <= high
    detail, score = fit_and_score(NearestSpectrum(), spectra, task)
    assert detail == f"1-NN of {len(sets['train'].signals)} spectra"
    assert low <= score <= high


def test_two_classes_have_one_score_in_the_right_direction():
    sets, task = make_sets(classes=("healthy", "missing_tooth"), n_units=8)
    rockets = rocket_tables(sets, n_features=84 * 2)
    assert fit_and_score(MiniRocket(), rockets, task)[1] > 0.8
