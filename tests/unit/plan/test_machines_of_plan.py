"""``plan.machines``: sets of gears crossed with gearboxes, or every unit with both of its own."""

import pytest

from gensig.dataset.plan import plan_text
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

SHORT = ("operating.duration_s=0.02", "plan.n_records=40", "plan.n_units=20")
OWN = "plan.machines=separate"
IDS = ("unit_id", "specimen_id", "gearbox_id")


def planned(*words):
    return make_plan(read_request([*words]).config)


def numbers(plan):
    """Numbers of unit, set of gears and gearbox of every record."""
    columns = (plan.columns[name].tolist() for name in IDS)
    return [
        tuple(int(name.rpartition("-")[2]) for name in row)
        for row in zip(*columns, strict=True)
    ]


@pytest.mark.parametrize(
    "words",
    [
        SHORT,
        (*SHORT, "plan.conditions_per_unit=2"),
        ("experiment=run_to_failure", "plan.n_gearboxes=null", "plan.n_units=7"),
    ],
    ids=["counted", "by unit", "lives"],
)
def test_every_unit_has_gears_and_a_gearbox_of_its_own(words):
    of_records = set(numbers(planned(*words, OWN)))
    assert len(of_records) > 1
    assert all(unit == specimen == gearbox for unit, specimen, gearbox in of_records)
    shared = {gearbox for _, _, gearbox in numbers(planned(*words))}
    assert len(shared) < len(of_records)


def test_nothing_but_the_ids_of_gears_and_gearboxes_changes():
    crossed, own = planned(*SHORT), planned(*SHORT, OWN)
    changed = {
        name
        for name, values in crossed.columns.items()
        if values.tolist() != own.columns[name].tolist()
    }
    assert changed == {"specimen_id", "gearbox_id"}
    assert plan_text(planned(*SHORT, "plan.machines=crossed")) == plan_text(crossed)


def test_a_number_of_gearboxes_contradicts_machines_of_their_own():
    with pytest.raises(ConfigError) as caught:
        planned(*SHORT, OWN, "plan.n_gearboxes=4")
    assert str(caught.value) == (
        "plan.n_gearboxes = 4: with plan.machines=separate every machine has a gearbox of its own; "
        "give plan.n_gearboxes=null"
    )


def test_another_word_is_refused():
    text = "plan.machines = 'own'; allowed: crossed, separate"
    with pytest.raises(ConfigError, match=text):
        planned(*SHORT, "plan.machines=own")
