"""Canaries: test units with random labels, on which only a leak scores above chance.

A method fails where a binomial test gives its number of right answers less than 1 in 1000. The
same method with a leak put in must fail, else the test could not find it.
"""

from dataclasses import replace

import pytest
from canaries import (
    A_UNIT,
    CANARIES,
    DURATION,
    UNLIKELY,
    Canaries,
    chance_of,
    joined,
    random_labels,
)
from small_studies import TINY_CNN, run, study_of

from diagnose.baselines.base import Source
from diagnose.baselines.registry import BASELINES
from diagnose.studies import class_jobs, jobs
from diagnose.studies.baseline_runs import _prediction

N_CANARIES = A_UNIT * CANARIES
WHOLE = round(DURATION * 12800)  # samples of a record
WINDOW = (f"window_samples={WHOLE}", f"stride_samples={WHOLE}", "normalise=none")
LEARNS = ("epochs=20", "patience=0", "epoch_fraction=1", "learning_rate=0.01")
# Draws of labels. A model of few numbers learns little of one draw by heart.
DRAWS = {"rms_threshold": 20}


@pytest.fixture(scope="module")
def source():
    """Data of the canaries and of the units before them."""
    task, _ = study_of(Canaries(), *WINDOW)
    yield Source(
        task=task,
        protocol="by_unit",
        features="basic",
        windows=lambda: class_jobs._windows(task, "by_unit"),
        caches={},
    )
    jobs._held.clear()


def honest(parts):
    """Tables as they are."""
    return parts


def leaky(parts):
    """Tables of a study that trains on the test too, and chooses on it."""
    return replace(parts, train=joined(parts.train, parts.test), validation=parts.test)


def chance_of_baseline(name, parts, source, seen):
    """Probability of the right answers of a baseline, over all draws of labels."""
    n_records, n_right = source.task.dataset.n_records, 0
    n_draws = DRAWS.get(name, 1)
    for draw in range(n_draws):
        label = random_labels(n_records, draw)
        test = replace(parts.test, label=label[parts.test.record])
        run_of_draw = _prediction(
            BASELINES[name](), seen(replace(parts, test=test)), source
        )
        chosen = run_of_draw.answers.argmax(axis=1)
        assert len(chosen) == N_CANARIES >= 200
        n_right += (chosen == label[run_of_draw.record]).sum()
    return chance_of(n_right, n_draws * N_CANARIES)


@pytest.mark.parametrize("name", BASELINES)
def test_a_baseline_is_at_chance_on_canaries(name, parts_of, source):
    parts = parts_of(BASELINES[name])
    assert chance_of_baseline(name, parts, source, honest) >= UNLIKELY


@pytest.mark.parametrize("name", BASELINES)
def test_a_baseline_with_a_leak_knows_the_canaries(name, parts_of, source):
    parts = parts_of(BASELINES[name])
    assert chance_of_baseline(name, parts, source, leaky) < UNLIKELY


def chance_of_network():
    """Probability of the right answers of a network trained by a study."""
    task, settings = study_of(Canaries(), *TINY_CNN, *WINDOW, *LEARNS)
    (prediction,) = run(task, settings)
    chosen = prediction.answers.argmax(axis=1)
    assert len(chosen) == N_CANARIES
    n_right = (chosen == task.labels()[prediction.record]).sum()
    return chance_of(n_right, N_CANARIES)


def test_a_network_is_at_chance_on_canaries():
    assert chance_of_network() >= UNLIKELY


def test_a_network_with_a_leak_knows_the_canaries(monkeypatch):
    """Its training windows are those of the training and of the test.

    Without the control, which relabels test records wherever they are.
    """
    windows = class_jobs._windows
    monkeypatch.setattr(class_jobs, "canary_labels", lambda *_: None)

    def with_leak(*args):
        sets = windows(*args)
        return sets | {"train": joined(sets["train"], sets["test"])}

    monkeypatch.setattr(class_jobs, "_windows", with_leak)
    assert chance_of_network() < UNLIKELY
