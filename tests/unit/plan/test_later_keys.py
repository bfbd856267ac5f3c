"""Keys of ``plan`` that came after 0.9.0: missing, they have their default; there, they are no
part of what a data set is."""

from dataclasses import MISSING, fields

import pytest

from gensig.dataset.folder.manifest import SINCE_0_9, identity_hash, stored_config
from gensig.dataset.plan import plan_text
from gensig.mesh.options import read_mesh_options
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.options import PlanOptions, read_plan_options

DEFAULTS = {
    field.name: field.default
    for field in fields(PlanOptions)
    if field.default is not MISSING
}
OTHERS = {"machines": "separate", "fault_gear": "drawn", "n_reference": 2}


@pytest.fixture(scope="module")
def config():
    """Nothing of it but the plan is looked at, so short records do."""
    return read_request(
        ["fault=crack", "plan.n_records=6", "operating.duration_s=0.02"]
    ).config


def without(config, key):
    return config.with_entries(plan=config["plan"].without(key))


def identity(config):
    return identity_hash(config.plain(), "0.9.0")


def test_every_later_key_is_known_and_its_default_is_that_of_the_option(config):
    prefix = "plan."
    known = {
        key.removeprefix(prefix): default
        for key, default in SINCE_0_9.items()
        if key.startswith(prefix)
    }
    assert known == DEFAULTS
    assert {key: config["plan"][key] for key in DEFAULTS} == DEFAULTS
    assert OTHERS.keys() == DEFAULTS.keys()


@pytest.mark.parametrize("key", DEFAULTS)
def test_a_stored_configuration_without_the_key_has_the_default(config, key):
    before = without(config, key)
    assert read_plan_options(before["plan"]) == read_plan_options(config["plan"])
    assert plan_text(make_plan(before)) == plan_text(make_plan(config))
    assert key not in stored_config(config.plain())["plan"]


def test_gensigs_own_law_of_heat_is_no_part_of_the_identity_and_the_papers_is(config):
    before = config.with_entries(mesh=config["mesh"].without("heat_law"))
    assert before != config
    assert identity(before) == identity(config)
    assert "heat_law" not in stored_config(config.plain())["mesh"]
    assert read_mesh_options(before["mesh"]) == read_mesh_options(config["mesh"])
    papers = config.with_keys("mesh", heat_law="paper")
    assert identity(papers) != identity(config)


@pytest.mark.parametrize("key", DEFAULTS)
def test_the_default_is_no_part_of_the_identity_and_another_value_is(config, key):
    assert identity(without(config, key)) == identity(config)
    other = config.with_keys("plan", **{key: OTHERS[key]})
    assert identity(other) != identity(config)
    assert stored_config(other.plain())["plan"][key] == OTHERS[key]
