"""Scores of a bridge: intervals by recording and by specimen, and areas under the curve."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnose.bridge.bridge_scores import (
    RECORDINGS,
    SPECIMENS,
    Judged,
    accuracy,
    advantage,
    class_recalls,
    confusion,
    separation,
    specimen_counts,
)

LABELS = ("healthy", "one_tooth", "many_teeth")


def judged(n_specimens: int, n_recordings: int, classes=(0, 1, 2)) -> Judged:
    """``n_recordings`` of each specimen, ``n_specimens`` of each class."""
    label = np.repeat(classes, n_specimens * n_recordings)
    number = np.tile(np.repeat(np.arange(n_specimens), n_recordings), len(classes))
    return Judged(
        names=tuple(f"r{k}" for k in range(label.size)),
        label=label,
        specimen=tuple(f"{a}-{b}" for a, b in zip(label, number, strict=True)),
        labels=LABELS,
    )


def test_counts_and_recalls_are_those_of_the_answers() -> None:
    of = judged(1, 2)
    counts = confusion(of, np.array([[0, 0, 1, 2, 2, 2], [0, 1, 1, 1, 2, 0]]))
    assert counts.tolist() == [[3, 1, 0], [0, 3, 1], [1, 0, 3]]
    assert class_recalls(counts) == [0.75, 0.75, 0.75]
    absent = confusion(judged(1, 2, (0, 1)), np.zeros((1, 4), dtype=int))
    assert class_recalls(absent) == [1.0, 0.0, None]


def test_every_class_counts_the_same() -> None:
    """One recording of a class weighs as much as nine of another."""
    of = Judged(
        names=tuple("abcdefghij"),
        label=np.array([0] * 9 + [1]),
        specimen=("s",) * 9 + ("t",),
        labels=LABELS,
    )
    always_healthy = np.zeros((1, 10), dtype=int)
    assert accuracy(of, always_healthy, n_bootstrap=10).mean == 0.5


def test_one_specimen_gives_no_interval_and_says_so() -> None:
    of = judged(1, 8)
    score = accuracy(of, of.label[None], n_bootstrap=50)
    assert score.by_specimen is None
    assert score.by_recording == (1.0, 1.0)
    assert specimen_counts(of) == dict.fromkeys(LABELS, 1)
    assert specimen_counts(judged(3, 1)) == dict.fromkeys(LABELS, 3)


def test_specimens_that_agree_in_themselves_widen_the_interval() -> None:
    """All recordings of a specimen are right or wrong together: half the specimens are right."""
    of = judged(6, 20)
    is_right = np.array([int(name.split("-")[1]) % 2 == 0 for name in of.specimen])
    answers = np.where(is_right, of.label, (of.label + 1) % 3)[None]
    score = accuracy(of, answers, n_bootstrap=2000)
    width = {
        kind: high - low
        for kind, (low, high) in (
            (RECORDINGS, score.by_recording),
            (SPECIMENS, score.by_specimen),
        )
    }
    assert width[SPECIMENS] > 3.0 * width[RECORDINGS]
    # standard error of the mean of three shares of six: sqrt(0.25 / 18), twice 1.96 of it
    assert_allclose(width[SPECIMENS], 2 * 1.96 * np.sqrt(0.25 / 18), rtol=0.15)


def test_recordings_that_are_independent_have_the_same_interval_either_way() -> None:
    of = judged(40, 1)
    rng = np.random.default_rng(0)
    answers = rng.integers(3, size=(1, of.label.size))
    score = accuracy(of, answers, n_bootstrap=500)
    assert score.by_recording == score.by_specimen


def test_a_method_has_no_advantage_over_itself() -> None:
    of = judged(5, 3)
    answers = np.random.default_rng(1).integers(3, size=(3, of.label.size))
    difference = advantage(of, answers, answers, n_bootstrap=50)
    assert difference.mean == 0.0
    assert difference.by_recording == (0.0, 0.0)
    assert difference.by_specimen == (0.0, 0.0)


def test_a_difference_on_the_same_recordings_is_paired() -> None:
    """Two methods that fail on the same recordings differ by what differs alone."""
    of = judged(10, 4)
    rng = np.random.default_rng(2)
    hard = rng.random(of.label.size) < 0.4
    ours = np.where(hard, (of.label + 1) % 3, of.label)[None]
    worse = ours.copy()
    worse[0, np.flatnonzero(~hard)[:6]] += 1
    worse %= 3
    difference = advantage(of, ours, worse, n_bootstrap=500)
    low, high = difference.by_recording
    assert 0.0 < low < difference.mean < high
    alone = accuracy(of, ours, n_bootstrap=500).by_recording
    assert high - low < alone[1] - alone[0]


@pytest.mark.parametrize(
    ("values", "area"),
    [([0, 0, 1, 1, 1, 1], 1.0), ([1, 1, 0, 0, 0, 0], 0.0), ([5] * 6, 0.5)],
)
def test_the_area_is_the_share_of_pairs_in_order(values, area) -> None:
    of = judged(1, 2)
    assert separation(of, np.array([values], dtype=float)) == area


def test_yes_and_no_are_values_too() -> None:
    answers = np.array([[False, False, True, True, True, False]])
    assert separation(judged(1, 2), answers) == pytest.approx(7 / 8)


def test_what_was_not_judged_is_left_out_of_the_area() -> None:
    of = judged(1, 2)
    values = np.array([[0.0, np.nan, 1.0, 1.0, -1.0, np.nan]])
    assert separation(of, values) == pytest.approx(2 / 3)
    assert separation(of, np.full((1, 6), np.nan)) is None
