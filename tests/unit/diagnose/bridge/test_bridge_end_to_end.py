"""The whole protocol in small, on a made-up rig: answers of every method, and the page."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from made_rig import write_rig
from offline_pages import NOTHING, outward, sent_by

from diagnose.bridge.bridge_machine import bridge_machine
from diagnose.bridge.bridge_networks import bridge_settings, network_answers
from diagnose.bridge.bridge_page import ANSWERS, MARKDOWN, NUMBERS, PAGE, write_bridge
from diagnose.bridge.bridge_run import METHODS, NOVELTY, OURS, run_bridge
from diagnose.bridge.bridge_scores import Answers, Judged
from diagnose.bridge.bridge_words import comparisons, headline
from diagnose.bridge.implanted_windows import (
    implanted,
    judged_stretches,
    judged_windows,
)
from diagnose.bridge.protocol import FROZEN
from gensig.dataset.reader import open_dataset
from gensig.measured import load

SMALL = replace(FROZEN, version=0, n_records=48, epochs=2, seeds=(0,), n_bootstrap=100)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return load(None, write_rig(tmp_path_factory.mktemp("rig")))


@pytest.fixture(scope="module")
def result(found, pairs_folder):
    with open_dataset(pairs_folder) as data:
        return run_bridge(bridge_machine(found, SMALL), data, SMALL)


@pytest.fixture(scope="module")
def page(found, pairs_folder, result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    write_bridge(folder, found, pairs_folder, result)
    return folder


def test_every_comparator_answers_for_every_recording(result) -> None:
    assert list(result.answers) == list(METHODS)
    for answers in result.answers.values():
        assert answers.faulty.shape == (1, 6)
        assert np.isfinite(answers.faulty).all()
    assert result.answers[NOVELTY].predicted is None


def test_the_distance_from_healthy_needs_no_fault(result) -> None:
    """Knocks and rough teeth of the rig are far from its healthy recordings."""
    assert result.answers[NOVELTY].alarm.tolist() == [False] * 2 + [True] * 4


def test_the_page_says_one_specimen_a_class(page) -> None:
    words = "one specimen a class: says nothing about others"
    assert words in (page / MARKDOWN).read_text()
    assert words in (page / PAGE).read_text()
    numbers = json.loads((page / NUMBERS).read_text())
    assert numbers["specimens"] == {"healthy": 1, "one_tooth": 1, "many_teeth": 1}
    for method in numbers["methods"].values():
        assert method.get("balanced_accuracy", {}).get("by_specimen") is None


def test_the_page_says_what_physics_does_not_beat(page, result) -> None:
    text = (page / MARKDOWN).read_text()
    for one in comparisons(result):
        assert f"Physics does not beat '{one.method}'" in text
    assert "## Does physics beat it?" in text
    for method in METHODS:
        assert method in text


def test_the_page_names_nothing_outside_of_it(page) -> None:
    assert outward((page / PAGE).read_text()) == []


def test_the_page_fetches_nothing(browser, page) -> None:
    assert sent_by(browser, page / PAGE) == NOTHING


def test_the_page_has_protocol_and_hashes(page, found) -> None:
    text = (page / MARKDOWN).read_text()
    for name, value in SMALL.rows():
        assert f"| {name} | {value} |" in text
    for one in found.recordings:
        assert one.sha256 in text
    with (page / ANSWERS).open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * len(METHODS)
    assert {row["answer"] for row in rows if row["method"] == NOVELTY} == {""}


def test_the_same_seed_gives_the_same_answers(found, pairs_folder) -> None:
    protocol = replace(SMALL, n_records=36, epochs=1)
    machine, settings = bridge_machine(found, protocol), bridge_settings(protocol)
    with open_dataset(pairs_folder) as data:
        implants = implanted(machine, data, protocol, residual="physics", seed=3)
        again = implanted(machine, data, protocol, residual="physics", seed=3)
    stretches = judged_stretches(machine, implants.blocks)
    windows = judged_windows(stretches, implants.window_samples, protocol)
    first, second = (
        network_answers(one, windows, settings, 3) for one in (implants, again)
    )
    np.testing.assert_array_equal(first, second)


def many(result, *, ours, other):
    """The result as if of 8 specimens a class with these shares of right answers."""
    label = np.repeat([0, 1, 2], 8)
    judged = Judged(
        names=tuple(map(str, range(24))),
        label=label,
        specimen=tuple(map(str, range(24))),
        labels=result.judged.labels,
    )

    def answers(n_right: int) -> Answers:
        right = np.tile(np.arange(8) < n_right, 3)
        predicted = np.where(right, label, (label + 1) % 3)[None]
        return Answers(predicted=predicted, faulty=(predicted > 0).astype(float))

    chosen = {OURS: answers(ours), "handbook rule": answers(other)}
    return replace(result, judged=judged, answers=chosen, why_not={})


@pytest.mark.parametrize(
    ("ours", "other", "says"),
    [
        (8, 2, "Physics beats every comparator, over specimens."),
        (5, 5, "Physics does not beat: handbook rule."),
        (2, 8, "Physics does not beat: handbook rule."),
    ],
)
def test_words_follow_the_interval_by_specimen(result, ours, other, says) -> None:
    lines = headline(many(result, ours=ours, other=other))
    assert says in lines
    assert "one specimen a class" not in lines[0]


def test_ahead_by_recordings_alone_is_not_called_better(result) -> None:
    """Eight recordings of two specimens a class: only these recordings are spoken of."""
    of = many(result, ours=8, other=2)
    specimen = tuple(f"{k // 4}" for k in range(24))
    of = replace(of, judged=replace(of.judged, specimen=specimen))
    sentence = comparisons(of)[0].sentence
    assert sentence.startswith("Physics is ahead of 'handbook rule'")
    assert "of other specimens nothing is known" in sentence
