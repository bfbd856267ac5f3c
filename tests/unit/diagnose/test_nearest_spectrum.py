"""The nearest spectrum finds a visible fault and nothing else; its spectra in closed form."""

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose
from small_studies import accuracy, task_on, windows_of

from diagnose.baselines.base import Parts
from diagnose.baselines.estimators import record_scores
from diagnose.baselines.nearest_spectrum import (
    NearestSpectrum,
    log_spectrum,
    spectrum_table,
)
from diagnose.data.windows import SUBSETS


def make_sets(**changes):
    values = {"n_units": 12, "strength": 2.0, "noise": 0.2} | changes
    dataset = FakeDataset(**values)
    task = task_on(dataset, 1000)
    return dict(zip(SUBSETS, windows_of(task, *SUBSETS), strict=True)), task


def test_spectrum_of_noise_and_of_a_tone_in_closed_form():
    noise = np.random.default_rng(0).standard_normal((200, 1000))
    magnitude = torch.exp(log_spectrum(torch.from_numpy(noise), 1e-9)).numpy()
    assert_allclose(np.mean(magnitude[:, 5:-5] ** 2), 1.0, rtol=0.02)
    tone = np.sqrt(2) * np.sin(2 * np.pi * 100 * np.arange(1000) / 1000)
    spectrum = torch.exp(log_spectrum(torch.from_numpy(tone), 1e-9)).numpy()
    assert spectrum.argmax() == 100
    # amplitude times half the sum of the taper (n/4), over the root of its sum of squares (3n/8)
    assert_allclose(spectrum[100], np.sqrt(2) * 250 / np.sqrt(375), rtol=1e-6)
    assert_allclose(log_spectrum(torch.zeros(2, 1000), 0.01), np.log(0.01), rtol=1e-6)


def test_rows_are_stretches_and_their_mean_over_windows():
    sets, _ = make_sets(n_units=4, duration=0.3)
    train = sets["train"]
    table = spectrum_table(train, [1.0])
    assert len(table.label) == len(train.signals)
    assert table.names == tuple(f"bin_{index}" for index in range(501))
    assert table.values.shape == (len(table.label), 501)
    windows = np.flatnonzero(train.segment == 2)
    assert windows.size > 1
    alone = [train.subset(windows[index : index + 1]) for index in range(windows.size)]
    rows = [spectrum_table(part, [1.0]).values[0] for part in alone]
    assert_allclose(table.values[2], np.mean(rows, axis=0), rtol=1e-5, atol=1e-6)
    louder = spectrum_table(train, [0.1]).values
    assert np.median(louder - table.values) == pytest.approx(np.log(10), abs=0.2)


@pytest.mark.parametrize(
    ("strength", "low", "high"), [(2.0, 0.6, 1.0), (0.0, 0.0, 0.55)]
)
def test_it_finds_the_fault_and_stays_at_chance_without_one(strength, low, high):
    sets, task = make_sets(strength=strength)
    spectra = Parts.of(lambda subset: spectrum_table(sets[subset], [1.0]))
    baseline = NearestSpectrum()
    detail = baseline.fit(spectra.train, spectra.validation, len(task.class_names))
    assert detail == f"1-NN of {len(sets['train'].signals)} spectra"
    probability = baseline.predict_proba(spectra.test)
    record, scores = record_scores(probability, spectra.test.record)
    assert low <= accuracy(task, record, scores.argmax(axis=1)) <= high
