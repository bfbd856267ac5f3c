"""Protocols of a study: where no two machines share a part, ``new_machine`` stands for all."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import settings_of

from diagnose.data.protocols import (
    BY_PART,
    MEANING,
    NOTHING_SHARED,
    choose_protocols,
    left_out_lines,
)
from diagnose.studies.study import task_from
from gensig.dataset.splitting.protocols import PROTOCOLS

OTHERS = ("cross_speed", "random_window_leaky")


def task_of(*, shared=""):
    """A data set of eight units and all splits by machine; two share a part."""
    dataset = FakeDataset()
    dataset.protocols = ("new_machine", *BY_PART, *OTHERS)
    dataset.left_out = {}
    for column in ("specimen_id", "gearbox_id"):
        names = dataset.columns["unit_id"].copy()
        if column == shared:
            names[names == "u01"] = "u00"
        dataset.columns[column] = names
    return task_from(dataset, settings_of())


def test_splits_by_part_are_left_out_where_they_say_the_same():
    chosen, left_out = choose_protocols(task_of(), None)
    assert chosen[0] == "new_machine"
    assert set(OTHERS) <= set(chosen)
    assert {name: left_out[name] for name in BY_PART} == dict.fromkeys(
        BY_PART, NOTHING_SHARED
    )


@pytest.mark.parametrize("shared", ["specimen_id", "gearbox_id"])
def test_they_are_kept_where_units_share_a_part(shared):
    chosen, left_out = choose_protocols(task_of(shared=shared), None)
    assert set(BY_PART) < set(chosen)
    assert not set(BY_PART) & set(left_out)


def test_they_are_kept_where_new_machine_is_not_wanted():
    assert choose_protocols(task_of(), BY_PART) == (BY_PART, {})
    wanted = ("by_unit", "new_machine")
    assert choose_protocols(task_of(), wanted)[0] == ("new_machine",)


def test_a_set_without_it_keeps_them():
    task = task_of()
    task.dataset.protocols = BY_PART
    task.dataset.left_out = {"new_machine": "too few"}
    chosen, left_out = choose_protocols(task, ("new_machine", *BY_PART))
    assert chosen == BY_PART
    assert left_out == {"new_machine": "too few"}


def test_every_clean_protocol_of_a_classifier_has_a_meaning():
    open_ones = {"healthy_only", "open_set", "random_window_leaky"}
    assert set(PROTOCOLS) - open_ones <= set(MEANING)
    assert next(iter(MEANING)) == "new_machine"
    assert np.all([text.strip() == text for text in MEANING.values()])


def test_one_line_tells_all_that_are_left_out_for_one_reason():
    left_out = choose_protocols(task_of(), None)[1]
    (line,) = left_out_lines(left_out)
    assert line == (
        "protocols by_unit, cross_specimen, cross_gearbox are left out: the set has no machines "
        "that share gears or a gearbox, so new_machine tests the same"
    )
    assert left_out_lines({"a": "it is full", "b": "it is empty"}) == [
        "protocol a is left out: it is full",
        "protocol b is left out: it is empty",
    ]
