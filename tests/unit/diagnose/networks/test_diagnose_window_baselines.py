"""MiniRocket against its definition; baselines on windows find a fault where there is one and only there."""

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from threadpoolctl import threadpool_limits

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
from diagnose.data.windows import SUBSETS, load_windows, subset_segments, task_of
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)
    with threadpool_limits(1):
        yield


def make_windows(n_channels=1, n=6, n_samples=400, seed=0):
    return (
        np.random.default_rng(seed)
        .standard_normal((n, n_channels, n_samples))
        .astype(np.float32)
    )


def make_sets(**changes):
    dataset = FakeDataset(
        **{
            "n_units": 12,
            "records_per_unit": 8,
            "strength": 2.0,
            "noise": 0.2,
            **changes,
        }
    )
    task = task_of(dataset, window_samples=1000, stride_samples=1000, normalise="rms")
    return [
        load_windows(task, subset_segments(task, "by_unit", name)) for name in SUBSETS
    ], task


def accuracy(task, record, predicted):
    label = task.labels()[record]
    n_classes = len(task.class_names)
    return float(
        balanced_accuracy(
            confusion_by_unit(label, predicted, np.zeros_like(label), n_classes)[0]
        )
    )


def test_kernels_are_the_84_and_see_no_offset():
    assert KERNELS.shape == (84, 9)
    assert len({tuple(kernel) for kernel in KERNELS.tolist()}) == 84
    assert_allclose(KERNELS.sum(axis=1), 0.0, atol=1e-12)


def test_features_are_what_the_definition_says():
    """Every share again, by a loop over taps, kernels and thresholds in numpy."""
    windows = make_windows(n_channels=3, n=4)
    banks = fit_minirocket(windows, n_features=84 * 6, rng=np.random.default_rng(0))
    features = minirocket_features(windows, banks)
    column = 0
    for bank in banks:
        margin = 4 * bank.dilation
        padded = np.pad(windows.astype(float), ((0, 0), (0, 0), (margin, margin)))
        taps = np.stack(
            [padded[..., k * bank.dilation :][..., :400] for k in range(9)], axis=-1
        )
        output = np.einsum("wcsk,fck->wfs", taps, bank.weight.numpy().astype(float))
        for kernel in range(84):
            values = (
                output[:, kernel]
                if bank.padded[kernel]
                else output[:, kernel, margin:-margin]
            )
            for bias in bank.bias[kernel]:
                assert_allclose(
                    features[:, column], (values > bias).mean(axis=1), atol=0.006
                )
                column += 1
    assert column == features.shape[1] == 84 * 6
    assert 0 < sum(bank.padded.sum() for bank in banks) < 84 * len(banks)


def test_thresholds_are_spread_over_the_output():
    """On windows like those that gave them, the shares are spread evenly from 0 to 1."""
    banks = fit_minirocket(
        make_windows(n=40), n_features=84 * 10, rng=np.random.default_rng(0)
    )
    shares = np.sort(
        minirocket_features(make_windows(n=40, seed=1), banks).mean(axis=0)
    )
    assert_allclose(shares, np.linspace(0, 1, shares.size), atol=0.06)


def test_every_kernel_sees_some_channel_and_not_always_all():
    bank = fit_minirocket(
        make_windows(n_channels=4), n_features=84, rng=np.random.default_rng(0)
    )[0]
    n_seen = (bank.weight.abs().sum(dim=2) > 0).sum(dim=1)
    assert n_seen.min() == 1
    assert n_seen.max() == 4


@pytest.mark.parametrize(
    ("n_samples", "per_kernel"), [(400, 1), (400, 6), (6400, 119), (9, 3), (50, 40)]
)
def test_dilations_fit_into_the_window_and_give_the_features_asked_for(
    n_samples, per_kernel
):
    dilations = _dilations(n_samples, per_kernel)
    assert all(8 * dilation <= n_samples - 1 for dilation, _ in dilations)
    assert sum(count for _, count in dilations) == per_kernel
    assert len({dilation for dilation, _ in dilations}) == len(dilations) <= 32


def test_rows_are_stretches_and_their_mean_over_windows():
    (train, _, _), _ = make_sets(n_units=4, duration=0.3)
    table = spectrum_table(train, [1.0])
    assert len(table.label) == len(train.signals)
    mine = np.flatnonzero(train.segment == 2)
    parts = [
        spectrum_table(subset(train, [window]), [1.0]).values[0] for window in mine
    ]
    assert mine.size > 1
    assert_allclose(table.values[2], np.mean(parts, axis=0), rtol=1e-5, atol=1e-6)
    louder = spectrum_table(train, [0.1]).values
    assert np.median(louder - table.values) == pytest.approx(np.log(10), abs=0.2)


def subset(windows, chosen):
    """The same signals with some of the windows."""
    from dataclasses import replace

    parts = {
        name: getattr(windows, name)[chosen]
        for name in ("segment", "start", "label", "record")
    }
    return replace(windows, **parts)


def judged(baseline, parts, n_classes=4):
    """What was fitted, the test records, and their log-probabilities."""
    detail = baseline.fit(parts.train, parts.validation, n_classes)
    return detail, *record_scores(baseline.predict_proba(parts.test), parts.test.record)


def test_both_find_the_fault_and_stay_at_chance_without_one():
    for strength, low, high in ((2.0, 0.6, 1.0), (0.0, 0.0, 0.55)):
        sets, task = make_sets(strength=strength)
        text, record, score = judged(
            MiniRocket(), rocket_tables(*sets, n_features=84 * 4)
        )
        assert low <= accuracy(task, record, score.argmax(axis=1)) <= high
        assert text.startswith("ridge, penalty ")
        tables = [spectrum_table(windows, [1.0]) for windows in sets]
        parts = Parts(train=tables[0], validation=tables[1], test=tables[2])
        text, record, score = judged(NearestSpectrum(), parts)
        assert low <= accuracy(task, record, score.argmax(axis=1)) <= high
        assert text == f"1-NN of {len(sets[0].signals)} spectra"


def test_two_classes_have_one_score_and_it_points_the_right_way():
    sets, task = make_sets(classes=("healthy", "missing_tooth"), n_units=8)
    _, record, score = judged(
        MiniRocket(), rocket_tables(*sets, n_features=84 * 2), n_classes=2
    )
    assert accuracy(task, record, score.argmax(axis=1)) > 0.8
