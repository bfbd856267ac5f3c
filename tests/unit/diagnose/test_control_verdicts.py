"""Controls of every method: one that fails takes the headline of its method away."""

from pathlib import Path

import numpy as np
import pytest
from fake_dataset import FakeDataset
from runs import FAST, by_unit, metrics_of, train
from scipy.stats import binom

from diagnose.baselines.base import Baseline, MethodText, Role
from diagnose.baselines.indicator_models import INDICATOR_INPUT
from diagnose.baselines.registry import BASELINES
from diagnose.report.headlines import headlines
from diagnose.report.text import WITHHELD
from diagnose.studies import baseline_runs, class_jobs
from diagnose.studies.verdicts import control_verdicts

SMALL = {"n_units": 16, "records_per_unit": 4, "duration": 0.5}
WORDS = (*FAST, "protocols=[by_unit]", "epochs=1", "metadata_probe=false")


class _Cheat(Baseline):
    """A method that learns nothing and answers labels that it should not have."""

    role = Role.RIVAL
    reads = INDICATOR_INPUT

    def fit(self, train, validation, n_classes):
        self.n_classes = n_classes
        return "nothing"

    def predict_proba(self, table):
        return np.eye(self.n_classes)[self.labels_of(table)]


def _text(name):
    return MethodText(name=name, label=name, card_label=name, meaning=f"{name}.")


class Handed(_Cheat):
    """It returns the labels that it is handed with the test records."""

    text = _text("handed")

    def labels_of(self, table):
        return table.label


class Knowing(_Cheat):
    """It knows the true labels of all records from elsewhere."""

    text = _text("knowing")
    truth = np.array([])

    def labels_of(self, table):
        return self.truth[table.record]


CHEATS = {cheat.text.name: cheat for cheat in (Handed, Knowing)}


def study(out, *words):
    dataset = FakeDataset(**SMALL)
    dataset.folder = Path("good")
    with pytest.MonkeyPatch.context() as patch:
        for name, cheat in CHEATS.items():
            patch.setitem(BASELINES, name, cheat)
        patch.setattr(Knowing, "truth", dataset.columns["label"])
        return train(out, dataset, *WORDS, *words)


@pytest.fixture(scope="module")
def cheated(tmp_path_factory):
    """Study of an honest baseline and two that are not."""
    out = tmp_path_factory.mktemp("cheated") / "out"
    return study(out, "baselines=[rms_threshold,handed,knowing]")


def test_a_method_that_returns_labels_fails_its_control(cheated):
    """Random labels show what is handed over, shuffled ones what is known from elsewhere."""
    controls = by_unit(cheated)["controls"]
    assert set(controls) == {"cnn", "rms_threshold", *CHEATS}
    for name in ("cnn", "rms_threshold"):
        assert controls[name]["holds"]
        assert controls[name]["ran"] == ["label shuffle", "canaries"]
        followed = controls[name]["canaries"]
        assert followed["probability"] > 1e-4
        chance = binom(followed["n_records"], 1 / len(FakeDataset(**SMALL).class_names))
        as_many = range(followed["n_followed"], followed["n_records"] + 1)
        assert followed["probability"] == pytest.approx(chance.pmf(as_many).sum())
    (handed,) = controls["handed"]["failed"]
    assert handed.startswith(
        "its answers follow random labels of the test records (16 of"
    )
    (knowing,) = controls["knowing"]["failed"]
    assert knowing == "label shuffle above chance (1.00)"


def test_it_is_no_headline_and_no_rival(cheated):
    result = by_unit(cheated)
    assert result["methods"]["knowing"]["balanced_accuracy"]["mean"] == 1.0
    assert result["answers"]["best_baseline"] == "rms_threshold"
    text = (cheated / "report.md").read_text()
    head, _, row = text[text.index("| protocol") :].splitlines()[:3]
    cells = dict(zip(head.split(" | "), row.split(" | "), strict=True))
    assert cells["handed"] == cells["knowing"] == WITHHELD
    assert cells["RMS threshold"] != WITHHELD
    page = (cheated / "report.html").read_text()
    assert "knowing has no score on by_unit: label shuffle above chance" in page


def test_without_the_controls_nothing_would_be_said(tmp_path, monkeypatch):
    for module in (baseline_runs, class_jobs):
        monkeypatch.setattr(module, "canary_labels", lambda *_: None)
    out = study(tmp_path / "out", "baselines=[handed,knowing]")
    result = by_unit(out)
    for name in CHEATS:
        assert result["methods"][name]["balanced_accuracy"]["mean"] == 1.0
        assert result["controls"][name]["holds"]


def test_a_network_that_is_handed_the_labels_has_no_headline(tmp_path, monkeypatch):
    def told(model, windows):
        return np.log(np.eye(4)[windows.label] + 1e-9)

    monkeypatch.setattr(class_jobs, "predict_windows", told)
    out = study(tmp_path / "out", "baselines=false", "shuffle_control=false")
    metrics = metrics_of(out)
    assert not metrics["protocols"]["by_unit"]["controls"]["cnn"]["holds"]
    assert WITHHELD in (out / "report.md").read_text()
    metrics["protocols"]["new_machine"] = metrics["protocols"]["by_unit"]
    (line,) = headlines(metrics)
    assert "no score, a control failed: its answers follow random labels" in line


def test_a_method_that_trains_on_test_records_follows_the_canaries(
    tmp_path, monkeypatch
):
    """They are labelled by the canaries in the training too."""
    make = INDICATOR_INPUT.make

    def joined(source):
        parts = make(source)
        from dataclasses import replace

        return replace(parts, train=parts.test)

    class Nearest(_Cheat):
        text = _text("nearest")
        reads = type(INDICATOR_INPUT)(name="joined", make=joined)

        def fit(self, train, validation, n_classes):
            self.known = dict(zip(train.record, train.label, strict=True))
            return super().fit(train, validation, n_classes)

        def labels_of(self, table):
            return np.array([self.known.get(one, 0) for one in table.record])

    monkeypatch.setitem(BASELINES, "nearest", Nearest)
    verdict = by_unit(study(tmp_path / "out", "baselines=[nearest]"))["controls"]
    assert any("random labels" in text for text in verdict["nearest"]["failed"])


def test_canaries_change_no_answer_of_an_honest_method(cheated, tmp_path, monkeypatch):
    for module in (baseline_runs, class_jobs):
        monkeypatch.setattr(module, "canary_labels", lambda *_: None)
    plain = by_unit(study(tmp_path / "out", "baselines=[rms_threshold]"))["methods"]
    watched = by_unit(cheated)["methods"]
    for name in ("cnn", "rms_threshold", "label_shuffle"):
        assert plain[name] == watched[name]


def scored(mean):
    return {"balanced_accuracy": {"mean": mean, "low": mean - 0.1, "high": mean + 0.1}}


@pytest.mark.parametrize(
    ("control", "fails"),
    [
        ("label_shuffle", {"cnn"}),
        ("label_shuffle_indicators", {"indicators"}),
        ("sham", {"cnn"}),
        ("sham_indicators", {"indicators"}),
        ("sham_with_reference", {"with_reference"}),
        ("sham_level_kept", {"level_kept"}),
        ("metadata_probe", {"cnn", "indicators", "with_reference", "level_kept"}),
        (None, set()),
    ],
)
def test_each_control_speaks_for_its_methods(control, fails):
    shown = ("cnn", "indicators", "with_reference", "level_kept")
    methods = {name: scored(0.9) for name in shown}
    methods |= {"chance": {"balanced_accuracy": 0.25}, "rotation_probe": scored(0.9)}
    names = ("label_shuffle", "sham", "label_shuffle_indicators", "metadata_probe")
    methods |= {name: scored(0.25) for name in names}
    if control:
        methods[control] = scored(0.6)
    verdicts = control_verdicts(methods, dict.fromkeys(shown, ()), "cnn")
    assert {name for name, each in verdicts.items() if not each["holds"]} == fails
