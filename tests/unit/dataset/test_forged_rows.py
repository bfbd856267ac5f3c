"""Rows of a forged plan that records would be made of again."""

from pathlib import Path

import pytest
from refusals import refused

from gensig.dataset.folder.joining import _check_sections
from gensig.errors import DatasetError
from gensig.record.inputs import RecordNumbers, row_faults

IDS = {
    "record_id": "r000007",
    "condition_id": "condition-000001",
    "gearbox_id": "gearbox-0003",
    "specimen_id": "specimen-0002",
}


def test_numbers_stand_at_the_ends_of_ids():
    numbers = RecordNumbers.of(IDS)
    assert (numbers.record, numbers.condition) == (7, 1)
    assert (numbers.gearbox, numbers.specimen) == (3, 2)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("text", ["=cmd", "x-", "unit-1.5", "unit-" + "9" * 5000, "²"])
def test_an_id_without_a_number_is_one_line(name, text):
    with pytest.raises(DatasetError, match=f"{name} .* ends in no number"):
        RecordNumbers.of(IDS | {name: text})


@pytest.mark.parametrize(
    "text", ["", "no", "{}", "null", "[[]]", '["crack"]', "[" * 4000]
)
def test_faults_that_are_no_list_of_mappings_are_one_line(text):
    with refused("is no list of faults", DatasetError):
        row_faults({"faults_json": text})
    assert row_faults({"faults_json": "[]"}) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"plan": None}, "plan.classes must be a list of names"),
        ({"plan": {"classes": None}}, "plan.classes must be a list of names"),
        ({"plan": {"classes": [1]}}, "plan.classes must be a list of names"),
        ({"dataset": []}, "dataset.compression must be one of none, gzip"),
        (
            {"dataset": {"compression": []}},
            "dataset.compression must be one of none, gzip",
        ),
    ],
)
def test_a_configuration_without_classes_or_compression_is_one_line(changes, words):
    good = {"plan": {"classes": ["crack"]}, "dataset": {"compression": "none"}}
    _check_sections(Path("config.yaml"), good)
    with refused(words, DatasetError):
        _check_sections(Path("config.yaml"), good | changes)
