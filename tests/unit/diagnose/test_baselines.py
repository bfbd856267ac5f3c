"""Laws that hold for every baseline of the registry, and twins that break them."""

import json
import subprocess
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import torch
from fake_dataset import CompleteDataset
from numpy.testing import assert_allclose, assert_array_equal
from threadpoolctl import threadpool_limits

import gensig.dataset.reader
from diagnose.baselines.base import Baseline, MethodText, Parts, Role, Source
from diagnose.baselines.indicator_models import INDICATOR_INPUT
from diagnose.baselines.registry import BASELINES, baseline_names
from diagnose.cli import main
from diagnose.data.windows import SUBSETS, load_windows, subset_segments, task_of
from diagnose.report.page import write_report
from diagnose.studies.baseline_runs import baseline_predictions
from gensig.options.compose import compose

N_CLASSES = 4
SHORT = [
    "window_samples=1200", "stride_samples=1000", "epochs=1", "seeds=[0]", "n_bootstrap=50",
    "n_threads=1", "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]",
    "minirocket_features=168", "protocols=[by_unit]", "oracle=auto", "metadata_probe=true",
]  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    torch.set_num_threads(1)
    with threadpool_limits(1):
        yield


def source_of(dataset):
    """Everything that a baseline may read of a data set."""
    task = task_of(dataset, window_samples=1200, stride_samples=1200, normalise="none")
    segments = {subset: subset_segments(task, "by_unit", subset) for subset in SUBSETS}
    sets = {
        subset: load_windows(task, stretches) for subset, stretches in segments.items()
    }
    return Source(
        task=task,
        protocol="by_unit",
        features="basic",
        minirocket_features=168,
        windows=lambda: sets,
        caches={},
    )


@pytest.fixture(scope="module")
def source():
    return source_of(CompleteDataset())


@pytest.fixture(scope="module")
def parts_of(source):
    """Function that returns the tables that a baseline reads, made once."""
    made = {}

    def parts(baseline):
        if baseline.reads not in made:
            made[baseline.reads] = baseline.reads.make(source)
        return made[baseline.reads]

    return parts


def fitted(baseline, parts):
    """A new object of the baseline, fitted, with what it says of the fit."""
    made = baseline()
    return made, made.fit(parts.train, parts.validation, N_CLASSES)


def check_probabilities(baseline, parts):
    """Law: a description, and a distribution over the classes for each row."""
    made, detail = fitted(baseline, parts)
    assert detail.strip()
    for table in (parts.train, parts.validation, parts.test):
        probability = made.predict_proba(table)
        assert probability.shape == (len(table.label), N_CLASSES)
        assert (probability >= 0).all()
        assert_allclose(probability.sum(axis=1), 1, rtol=0, atol=1e-9)


def check_seed(baseline, parts):
    """Law: two fits say the same to the bit, whatever was drawn in between."""
    made, detail = fitted(baseline, parts)
    np.random.default_rng().uniform()
    again, detail_again = fitted(baseline, parts)
    assert detail == detail_again
    assert_array_equal(made.predict_proba(parts.test), again.predict_proba(parts.test))


def check_order(baseline, parts):
    """Law: the order of the rows changes nothing but the order of the answers."""
    rng = np.random.default_rng(3)
    orders = {
        subset: rng.permutation(len(getattr(parts, subset).label)) for subset in SUBSETS
    }
    shuffled = Parts(
        **{name: rows_of(getattr(parts, name), rows) for name, rows in orders.items()}
    )
    made, _ = fitted(baseline, parts)
    other, _ = fitted(baseline, shuffled)
    expected = made.predict_proba(parts.test)[orders["test"]]
    assert_allclose(other.predict_proba(shuffled.test), expected, rtol=0, atol=1e-3)


def check_text(baseline):
    """Law: every word that the page needs is there; a sentence ends with a full stop."""
    text = baseline.text
    assert text.name.isidentifier()
    assert text.label.strip()
    assert text.meaning.strip().endswith(".")
    assert text.card_label is None or text.card_label.strip()
    assert isinstance(baseline.role, Role)


def rows_of(table, rows):
    """A table with its rows in another order."""
    return replace(
        table,
        values=table.values[rows],
        label=table.label[rows],
        record=table.record[rows],
    )


@pytest.mark.parametrize("name", BASELINES)
def test_it_is_fitted_and_gives_probabilities(name, parts_of):
    check_probabilities(BASELINES[name], parts_of(BASELINES[name]))


@pytest.mark.parametrize("name", BASELINES)
def test_the_same_fit_gives_the_same_bits(name, parts_of):
    check_seed(BASELINES[name], parts_of(BASELINES[name]))


@pytest.mark.parametrize("name", BASELINES)
def test_the_order_of_the_records_does_not_matter(name, parts_of):
    check_order(BASELINES[name], parts_of(BASELINES[name]))


@pytest.mark.parametrize("name", BASELINES)
def test_it_has_its_words(name):
    assert BASELINES[name].text.name == name
    check_text(BASELINES[name])


def test_no_name_and_no_label_of_a_role_is_there_twice():
    pairs = [(baseline.role, baseline.text.label) for baseline in BASELINES.values()]
    assert len(set(pairs)) == len(pairs)
    assert sorted(baseline_names(*Role)) == sorted(BASELINES)


class Careless(Baseline):
    """Breaks every law: random, not normalised, tied to the order of rows, without words."""

    text = MethodText(name="not a name", label=" ", meaning="", card_label="")
    role = Role.RIVAL
    reads = INDICATOR_INPUT

    def fit(self, train, validation, n_classes):
        self.n_classes = n_classes
        self.first = train.label[0]
        return " "

    def predict_proba(self, table):
        chance = np.random.default_rng().uniform(
            size=(len(table.label), self.n_classes)
        )
        chance[:, self.first] += np.arange(len(table.label))
        return chance


def test_the_laws_can_be_broken(parts_of):
    parts = parts_of(Careless)
    for check in (check_probabilities, check_seed, check_order):
        with pytest.raises(AssertionError):
            check(Careless, parts)
    with pytest.raises(AssertionError):
        check_text(Careless)


def test_each_kind_of_input_is_made_once(source, monkeypatch):
    calls = []
    counted = replace(
        INDICATOR_INPUT, make=lambda s: calls.append(s) or INDICATOR_INPUT.make(s)
    )
    names = ("indicators", "indicators_without_level", "rms_threshold")
    for name in names:
        monkeypatch.setattr(BASELINES[name], "reads", counted)
    predictions = baseline_predictions(source, names)
    assert [prediction.method for prediction in predictions] == list(names)
    assert len(calls) == 1


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Folder of a study with every baseline, the sham set and the oracle."""
    sets = {
        "good": CompleteDataset(n_units=16),
        "sham": CompleteDataset(n_units=16, sham=True),
    }
    for name, dataset in sets.items():
        dataset.folder = Path(name)
    out = tmp_path_factory.mktemp("study") / "out"
    rivals = f"baselines=[{','.join(baseline_names(Role.RIVAL))}]"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            gensig.dataset.reader, "open_dataset", lambda path: sets[str(path)]
        )
        assert (
            main(["train", "data=good", "sham=sham", f"out={out}", *SHORT, rivals]) == 0
        )
    return out


def missing_on_page(page, baseline):
    """Words of a baseline that a page lacks, those of its sham counterpart too."""
    text = baseline.text
    words = [text.label, text.meaning]
    if baseline.role is Role.RIVAL:
        words.append(f">sham, {text.label}<")
    return [word for word in words if word not in unescape(page)]


@pytest.mark.parametrize("name", BASELINES)
def test_it_is_on_the_page(name, study):
    methods = json.loads((study / "metrics.json").read_text())["protocols"]["by_unit"][
        "methods"
    ]
    assert name in methods
    assert missing_on_page((study / "report.html").read_text(), BASELINES[name]) == []


def test_a_baseline_that_is_not_registered_is_not_on_the_page(
    study, tmp_path, monkeypatch
):
    reference = BASELINES["reference"]
    metrics = json.loads((study / "metrics.json").read_text())
    monkeypatch.delitem(BASELINES, "reference")
    page = write_report(tmp_path, metrics).read_text()
    assert len(missing_on_page(page, reference)) == 3


def test_what_runs_by_default_is_registered():
    config = compose("train", ["data=x", "out=y"])
    assert set(config["baselines"]) <= set(baseline_names(Role.RIVAL))


def test_settings_are_refused_without_loading_torch():
    """A mistake in a setting is answered at once; torch takes seconds to load."""
    code = (
        "import diagnose.settings, sys; print({'torch', 'sklearn'} & set(sys.modules))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert shown.stdout.strip() == "set()"
