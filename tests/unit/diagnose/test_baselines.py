"""Laws of every registered baseline, and a baseline that breaks them."""

import json
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from fake_dataset import CompleteDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import task_on, train, windows_of

from diagnose.baselines.base import Baseline, MethodText, Parts, Role, Source
from diagnose.baselines.features import FEATURES, FeatureTable
from diagnose.baselines.indicator_models import INDICATOR_INPUT
from diagnose.baselines.registry import BASELINES, baseline_names
from diagnose.data.windows import SUBSETS
from diagnose.studies.baseline_runs import baseline_predictions

N_CLASSES = 4


@pytest.fixture(scope="module")
def source():
    """All data that a baseline may read."""
    dataset = CompleteDataset()
    task = task_on(dataset, normalise="none")
    sets = dict(zip(SUBSETS, windows_of(task, *SUBSETS), strict=True))
    return Source(
        task=task,
        protocol="by_unit",
        features="basic",
        windows=lambda: sets,
        caches={},
    )


@pytest.mark.parametrize("features", FEATURES)
def test_a_table_has_the_chosen_indicators_of_each_channel(source, features):
    chosen = replace(source, features=features, caches={})
    names = INDICATOR_INPUT.make(chosen).test.names
    wanted = {
        f"{channel}_{name}"
        for channel in source.task.channel_names
        for name in FEATURES[features]
    }
    assert len(names) == len(wanted)
    assert {name.replace("/", "_") for name in names} == wanted


def fitted(baseline, parts):
    """A new object of the baseline, fitted, and its description of the fit."""
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
    """Law: two fits predict the same to the bit, whatever was drawn in between."""
    first, detail = fitted(baseline, parts)
    np.random.default_rng().uniform()
    second, second_detail = fitted(baseline, parts)
    assert detail == second_detail
    assert_array_equal(
        first.predict_proba(parts.test), second.predict_proba(parts.test)
    )


def check_order(baseline, parts):
    """Law: the order of the rows changes nothing but the order of the answers."""
    rng = np.random.default_rng(3)
    orders = {
        name: rng.permutation(len(getattr(parts, name).label)) for name in SUBSETS
    }
    shuffled = Parts.of(lambda name: rows_of(getattr(parts, name), orders[name]))
    (made, _), (other, _) = fitted(baseline, parts), fitted(baseline, shuffled)
    expected = made.predict_proba(parts.test)[orders["test"]]
    assert_allclose(other.predict_proba(shuffled.test), expected, rtol=0, atol=1e-3)


def check_text(baseline):
    """Law: no text of the page is empty; a sentence ends with a full stop."""
    text = baseline.text
    assert text.name.isidentifier()
    assert text.label.strip()
    assert text.meaning.strip().endswith(".")
    assert text.card_label is None or text.card_label.strip()
    assert isinstance(baseline.role, Role)


def rows_of(table, rows):
    """A table with its rows in another order."""
    columns = {
        name: getattr(table, name)[rows] for name in ("values", "label", "record")
    }
    return replace(table, **columns)


CHECKS = (check_probabilities, check_seed, check_order)


@pytest.mark.parametrize("name", BASELINES)
@pytest.mark.parametrize("check", CHECKS)
def test_it_obeys_the_laws(check, name, parts_of):
    check(BASELINES[name], parts_of(BASELINES[name]))


@pytest.mark.parametrize("name", BASELINES)
def test_it_has_its_texts(name):
    assert BASELINES[name].text.name == name
    check_text(BASELINES[name])


def test_no_name_and_no_label_of_a_role_is_used_twice():
    pairs = [(baseline.role, baseline.text.label) for baseline in BASELINES.values()]
    assert len(set(pairs)) == len(pairs)
    assert sorted(baseline_names(*Role)) == sorted(BASELINES)


class Careless(Baseline):
    """Breaks every law: random, not normalised, dependent on the order of rows, without texts."""

    text = MethodText(name="not a name", label=" ", meaning="", card_label="")
    role = Role.RIVAL
    reads = INDICATOR_INPUT

    def fit(self, train, validation, n_classes):
        self.n_classes = n_classes
        self.first = train.label[0]
        return " "

    def predict_proba(self, table):
        n = len(table.label)
        chance = np.random.default_rng().uniform(size=(n, self.n_classes))
        chance[:, self.first] += np.arange(n)
        return chance


def test_the_laws_can_be_broken(parts_of):
    for check in CHECKS:
        with pytest.raises(AssertionError):
            check(Careless, parts_of(Careless))
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
        "good": CompleteDataset(),
        "sham": CompleteDataset(sham=True),
    }
    for name, dataset in sets.items():
        dataset.folder = Path(name)
    out = tmp_path_factory.mktemp("study") / "out"
    rivals = f"baselines=[{','.join(baseline_names(Role.RIVAL))}]"
    words = ["sham=sham", "oracle=auto", "metadata_probe=true", "epochs=1"]
    train(sets, out, rivals, *words)
    return out


def metrics_of(study):
    return json.loads((study / "metrics.json").read_text())


def missing_on_page(page, baseline):
    """Texts of a baseline and of its sham counterpart that a page lacks."""
    text = baseline.text
    words = [text.label, text.meaning]
    if baseline.role is Role.RIVAL:
        words.append(f">sham, {text.label}<")
    return [word for word in words if word not in unescape(page)]


@pytest.mark.parametrize("name", BASELINES)
def test_it_is_on_the_page(name, study):
    assert name in metrics_of(study)["protocols"]["by_unit"]["methods"]
    assert missing_on_page((study / "report.html").read_text(), BASELINES[name]) == []


@pytest.mark.parametrize(
    ("validation", "judged"), [([0, 1], [0, 1, 4, 5]), ([0, 4], [4, 5])]
)
def test_a_record_of_two_subsets_leaves_the_test_alone(validation, judged):
    def table(records):
        return FeatureTable(
            values=np.zeros((len(records), 1)),
            names=("a",),
            label=np.zeros(len(records), dtype=int),
            record=np.array(records),
        )

    parts = Parts(train=table([2]), validation=table(validation), test=table([4, 5]))
    assert_array_equal(parts.judged().record, judged)
