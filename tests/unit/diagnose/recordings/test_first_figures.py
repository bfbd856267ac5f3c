"""What a reader of a study sees first: scores on unknown machines, and pictures of teeth."""

import numpy as np
import pytest
from runs import NETWORK_ONLY, QUICK, metrics_of, train
from small_studies import two_channels

from diagnose.recordings.accused import MOST_PICTURES, shown
from diagnose.report.headlines import headline_protocol, headlines
from diagnose.report.tooth_figure import AccusedTooth, tooth_figure
from diagnose.training.sham import sham_method


def score(mean):
    interval = {"mean": mean, "low": mean - 0.1, "high": mean + 0.1, "too_few": None}
    return {"balanced_accuracy": interval}


def metrics_with(protocol, **methods):
    chance = {"balanced_accuracy": 0.25}
    result = {"leaky": False, "methods": {"tooth": score(0.8), "chance": chance}}
    result["methods"] |= methods
    settings = {"reference": "other_condition"}
    return {"model": "tooth", "protocols": {protocol: result}, "settings": settings}


def test_the_score_on_new_machines_comes_first():
    alone = metrics_with("new_machine")
    line = "unknown machine: balanced accuracy 0.80 [0.70, 0.90], chance 0.25"
    assert headlines(alone) == [line]
    both = metrics_with("new_machine", with_reference=score(0.85))
    assert headlines(both) == [
        line,
        "unknown machine with one healthy record of its own from another condition: "
        "balanced accuracy 0.85 [0.75, 0.95], chance 0.25",
    ]


def test_a_study_without_new_machines_has_no_headline():
    other = metrics_with("by_unit")
    assert headlines(other) == []
    assert headline_protocol(other) == "by_unit"
    other["protocols"]["by_unit"]["leaky"] = True
    assert headline_protocol(other) is None


def answers(*pairs):
    return [
        {"record_id": f"r{index}", "label": truth, "predicted": answer}
        for index, (truth, answer) in enumerate(pairs)
    ]


def test_the_first_found_fault_of_each_class_and_a_wrong_answer_are_shown():
    given = answers(
        ("healthy", "healthy"),
        ("crack", "pitting"),
        ("crack", "crack"),
        ("crack", "crack"),
        ("pitting", "healthy"),
        ("broken", "broken"),
    )
    assert [row["record_id"] for row in shown(given)] == ["r2", "r5", "r1"]
    many = answers(*((f"c{k}", f"c{k}") for k in range(9)), ("crack", "healthy"))
    assert len(shown(many)) == MOST_PICTURES
    assert shown(many)[-1]["label"] == "crack"


def test_the_version_of_the_metrics_is_that_of_their_keys(tooth_study):
    """A reader finds these keys in version 1; others are another version."""
    metrics = metrics_of(tooth_study)
    assert metrics["metrics_schema_version"] == 1
    assert {
        *("data", "data_fingerprint", "n_records", "sampling_rate_hz"),
        *("channel_names", "model", "settings", "environment", "protocols"),
    } <= set(metrics)


def test_pictures_lie_beside_the_report(tooth_study):
    pictures = sorted(tooth_study.glob("tooth_*.png"))
    assert 1 <= len(pictures) <= MOST_PICTURES
    text = (tooth_study / "report.md").read_text()
    page = (tooth_study / "report.html").read_text()
    assert "What the network saw" in page
    for picture in pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert f"]({picture.name})" in text


def test_a_picture_marks_the_tooth_among_its_sisters_under_its_title(monkeypatch):
    accused = AccusedTooth(
        gear="wheel",
        tooth=2,
        channel="housing",
        turn=np.arange(20.0).reshape(5, 4),
        log_odds={"pinion": np.zeros(3), "wheel": np.arange(5.0)},
    )
    saved = []

    def save(figure, _):
        saved.append((figure.get_suptitle(), figure.axes))

    monkeypatch.setattr("diagnose.report.tooth_figure.save", save)
    tooth_figure("tooth.png", accused, "record 7")
    ((title, (turn, passage, odds)),) = saved
    assert title == "record 7"
    assert turn.get_xlabel() == "teeth of the wheel, from the first in mesh"
    *sisters, mine = (line.get_ydata() for line in passage.lines)
    assert np.array_equal(mine, accused.turn[2])
    assert np.array_equal(sisters, accused.turn[[0, 1, 3, 4]])
    assert [len(line.get_ydata()) for line in odds.lines[:2]] == [3, 5]


@pytest.mark.parametrize("page", ["report.md", "report.html"])
def test_a_caption_says_record_truth_and_answer(tooth_study, page):
    text = (tooth_study / page).read_text()
    assert ", truth " in text
    assert ", answer " in text


def test_the_sham_control_runs_on_the_network_of_teeth(known_machines, tmp_path):
    sham = two_channels(duration=0.3, sham=True)
    sham.columns = known_machines.columns
    datasets = {"good": known_machines, "sham": sham}
    small = ("model=tooth", "model.samples_per_tooth=16", "model.widths=[8,4]")
    words = (*QUICK, *small, *NETWORK_ONLY, "oracle=false", "sham=sham", "epochs=1")
    out = train(tmp_path / "out", datasets, *words, "reference=other_condition")
    methods = metrics_of(out)["protocols"]["by_unit"]["methods"]
    for name in ("tooth", "with_reference"):
        sham_of = sham_method(name, "tooth")
        assert name in methods
        assert methods[sham_of]["balanced_accuracy"]["mean"] is not None
