"""The first screen of a report answers from results: always, from a size on, sometimes, not."""

import json
import re

import numpy as np
import pytest
from judged_tables import cracks_table, found_cracks
from numpy.random import default_rng
from runs import metrics_of, train
from small_studies import two_channels

from diagnose.report.fault_answers import (
    NO_THRESHOLD,
    NOT_FOUND,
    OPEN,
    fault_answers,
    fault_section,
    found_phrase,
)
from diagnose.report.page import ClassReport
from diagnose.report.text import leaky_card

SEVERITY = np.linspace(0.1, 0.9, 200)


def detected(is_found, *, n_units=20, sizes=None, threshold=True):
    """Detection of cracks of `SEVERITY` that raise an alarm exactly where they are found."""
    n_cracks = len(is_found)
    label = np.repeat([0, 1], [200, n_cracks])
    unit = np.concatenate([np.arange(200), np.arange(n_cracks)]) % n_units
    healthy = default_rng(4).normal(size=200)
    score = np.concatenate([healthy, np.where(is_found, 50.0, -50.0)])
    healthy_elsewhere = None
    if threshold:
        others = np.arange(400) % 20
        score_there = default_rng(5).normal(size=400)
        healthy_elsewhere = cracks_table(score_there, np.zeros(400, dtype=int), others)
    if sizes is None:
        sizes = {"severity": SEVERITY, "crack_depth_mm": 4.0 * SEVERITY}
    judged = cracks_table(score, label, unit)
    return found_cracks(judged, healthy_elsewhere, sizes, n_bootstrap=100)


def phrase(result):
    return found_phrase(result["classes"]["crack"], result["false_alarms"])


def test_a_fault_found_at_every_size_is_found_always():
    text = phrase(detected(np.ones(200, dtype=bool)))
    assert text.startswith("always")
    assert "from 0.4 mm crack depth on (10 % of the root chord)" in text


def test_a_fault_found_from_half_of_the_root_on_says_so_in_millimetres():
    text = phrase(detected(SEVERITY > 0.5))
    limit, low, high = map(
        float, re.match(r"from ([\d.]+) \[([\d.]+), ([\d.]+)\] mm", text).groups()
    )
    assert 1.8 < low <= limit <= high < 2.3  # 2 mm is half of the root chord
    assert re.search(r"mm crack depth on \((49|5[0-5]) % of the root chord\)", text)


def test_a_fault_found_by_halves_is_found_sometimes():
    rng = default_rng(3)
    half = rng.uniform(size=200) < 0.2 + 0.5 * SEVERITY
    assert phrase(detected(half)).startswith("sometimes: half of them from ")
    few = rng.uniform(size=200) < 0.25
    text = phrase(detected(few))
    assert text == "sometimes: fewer than half of them at every tested size"


def test_a_fault_that_raises_no_more_alarms_than_healthy_records_is_not_found():
    assert phrase(detected(np.arange(200) % 20 == 0)) == NOT_FOUND
    assert phrase(detected(np.zeros(200, dtype=bool))) == NOT_FOUND


@pytest.mark.parametrize(
    ("share", "text"), [(1.0, "always"), (0.5, "sometimes"), (0.0, NOT_FOUND)]
)
def test_a_fault_of_one_size_is_answered_without_a_limit(share, text):
    found = np.arange(200) % 2 < 2 * share
    assert phrase(detected(found, sizes={"severity": np.ones(200)})) == text


def test_too_few_records_give_no_size_and_too_few_machines_no_verdict():
    sizes = {"severity": SEVERITY[:9]}
    text = phrase(detected(np.arange(9) > 0, sizes=sizes))
    assert text == "sometimes; from what size on is not told: too few records"
    assert phrase(detected(np.arange(9) > 6, sizes=sizes)) == OPEN
    few = detected(np.ones(200, dtype=bool), n_units=3)
    assert phrase(few) == "no verdict: too few machines"


def test_without_a_threshold_there_is_no_verdict_and_the_page_says_what_is_missing():
    result = detected(np.ones(200, dtype=bool), threshold=False)
    assert phrase(result) == NO_THRESHOLD
    section = fault_section(metrics_with(result))
    assert ("no verdict", result["missing"]) in section.notes
    assert "False alarms" not in section.text[0]


def score(mean, low, high):
    return {"mean": mean, "low": low, "high": high, "too_few": None}


def metrics_with(result, **protocols):
    methods = {
        "cnn": {
            "balanced_accuracy": score(0.41, 0.31, 0.52),
            "recall": {"healthy": 0.93, "crack": 0.37},
        },
        "chance": {"balanced_accuracy": 0.5},
    }
    answers = {"network": "cnn"}
    if result is not None:
        answers["detection"] = {"cnn": result}
    clean = {"leaky": False, "methods": methods, "answers": answers}
    settings = {"reference": "other_condition"}
    given = {"new_machine": clean, **protocols}
    return {"model": "cnn", "settings": settings, "protocols": given}


def test_the_first_section_has_one_line_a_fault():
    result = detected(SEVERITY > 0.5)
    section = fault_section(metrics_with(result))
    ((name, found, share, records, right),) = section.table.rows
    assert (name, found) == ("crack", phrase(result))
    mean = result["classes"]["crack"]["share_found"]["mean"]
    assert share.startswith(f"{mean:.2f} [")
    assert records == "200 of 20 machines"
    assert right == "0.37"
    assert any(line.startswith("unknown machine: ") for _, line in section.notes)


def test_without_healthy_records_the_first_section_gives_what_is_named_right():
    section = fault_section(metrics_with(None))
    assert ("crack", "0.37") in section.table.rows
    assert fault_answers(metrics_with(None)) == {}


def test_a_study_of_leaky_protocols_alone_has_no_answer():
    metrics = metrics_with(None)
    metrics["protocols"]["new_machine"]["leaky"] = True
    section = fault_section(metrics)
    assert section.table is None
    assert section.text[0].startswith("No answer")


@pytest.mark.parametrize(
    ("difference", "words"),
    [
        (score(0.52, 0.44, 0.61), "it shows 0.52 more than new_machine"),
        (score(-0.2, -0.3, -0.1), "it shows 0.20 less than new_machine"),
        (score(0.03, -0.04, 0.11), "it is not told from new_machine"),
    ],
)
def test_the_card_of_a_leaky_split_says_what_was_measured(difference, words):
    leaky = {
        "leaky": True,
        "methods": {"cnn": {"balanced_accuracy": score(0.93, 0.9, 0.96)}},
        "leak": {"against": "new_machine", "difference": difference},
    }
    card = leaky_card("leaky_split", metrics_with(None, leaky_split=leaky))
    mean, low, high = (difference[key] for key in ("mean", "low", "high"))
    measured = f"{mean:+.2f} [{low:+.2f}, {high:+.2f}] against new_machine (0.41)"
    assert card.verdict == f"not a result; {measured}"
    assert words in card.meaning
    assert (card.value, card.mark) == ("0.93", "quiet")


def test_a_study_measures_its_leak_and_says_it_on_the_page(tmp_path):
    words = ("model=cnn", "epochs=1", "seeds=[0]", "n_bootstrap=50", "baselines=[]")
    small = ("shuffle_control=false", "window_samples=256")
    both = "protocols=[by_unit,random_window_leaky]"
    out = train(tmp_path / "out", two_channels(duration=0.5), *words, *small, both)
    metrics = metrics_of(out)
    results = metrics["protocols"]
    means = [
        result["methods"]["cnn"]["balanced_accuracy"]["mean"]
        for result in results.values()
    ]
    leak = results["random_window_leaky"]["leak"]
    assert leak["against"] == "by_unit"
    assert leak["difference"]["mean"] == pytest.approx(means[1] - means[0], abs=1e-12)
    assert "leak" not in results["by_unit"]
    page = (out / "report.html").read_text()
    assert f"not a result; {leak['difference']['mean']:+.2f} [" in page
    text = json.dumps(metrics)
    changed = json.loads(text)
    changed["protocols"]["random_window_leaky"]["leak"]["difference"]["mean"] = 0.77
    page = ClassReport(metrics=changed).write(tmp_path)
    assert "not a result; +0.77 [" in page.read_text()
