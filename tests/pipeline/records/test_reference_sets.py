"""Data sets with reference records: the examples keep their bits, and both numbers are told."""

import numpy as np
import pytest
from small_sets import contents, make

import gensig
from gensig.dataset.folder.verify import verify
from gensig.plan.request import read_request
from gensig.production.prediction import predict
from gensig.production.streaming import open_stream
from gensig.record.inputs import InputReader

WORDS = ("plan.n_units=3", "plan.machines=separate", "plan.n_reference=2")
N_EXAMPLES = 6


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A data set without references, and the same with two a unit."""
    parent = tmp_path_factory.mktemp("references")
    return make(parent / "plain", *WORDS[:2]), make(parent / "more", *WORDS)


def test_examples_have_the_same_bits(folders):
    plain, more = map(gensig.open_dataset, folders)
    with plain, more:
        assert (plain.n_records, more.n_records) == (N_EXAMPLES, N_EXAMPLES + 6)
        for index in range(N_EXAMPLES):
            assert np.array_equal(plain.signals(index), more.signals(index))
        for name in set(plain.column_names):
            ours, theirs = plain.column(name), more.column(name)[:N_EXAMPLES]
            assert np.array_equal(ours, theirs, equal_nan=ours.dtype.kind == "f"), name


def test_references_are_made_and_marked(folders):
    plain, more = map(gensig.open_dataset, folders)
    with plain, more:
        assert "is_reference" not in plain.column_names
        assert not plain.is_reference.any()
        assert more.is_reference.tolist() == [False] * N_EXAMPLES + [True] * 6
        assert more.usable.all()
        signals = [more.signals(index) for index in np.flatnonzero(more.is_reference)]
        assert all(signal.any() for signal in signals)
        assert len({signal.tobytes() for signal in signals}) == len(signals)


def test_verify_is_content_and_splits_are_the_same(folders):
    assert [verify(folder).problems for folder in folders] == [[], []]
    splits = [
        {name: text for name, text in contents(folder).items() if "splits" in name}
        for folder in folders
    ]
    assert splits[0] == splits[1] != {}


def test_card_and_plan_tell_both_numbers(folders):
    card = (folders[1] / "README.md").read_text()
    assert "| records | 12: 6 examples, 6 reference records in no split |" in card
    assert "| healthy | 3 | 0 |" in card
    words = ["plan.n_records=6", "plan.classes=[healthy,crack]", *WORDS]
    facts = predict(
        InputReader(read_request([*words, "operating.duration_s=0.02"]).config)
    )
    assert facts["records"] == "6"
    assert facts["references"] == "6 more (2 a machine, healthy, in no split)"
    assert sorted(facts["classes"].split(", ")) == ["crack 3", "healthy 3"]
    assert facts["conditions"] == "3"


def test_a_stream_has_the_examples_alone():
    words = ["plan.n_records=6", "plan.classes=[healthy,crack]", *WORDS]
    stream = open_stream(read_request([*words, "operating.duration_s=0.02"]).config)
    assert len(stream) == N_EXAMPLES
    assert not stream.column("is_reference").any()
