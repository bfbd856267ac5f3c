"""Protocols of real plans: units, conditions and noise stay on one side."""

import numpy as np
import pytest

from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits, why_left_out
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.streams import Stream, stream

CLEAN = [name for name in PROTOCOLS if name != "random_window_leaky"]
DESIGNS = {
    "latin_hypercube": [],
    "sobol": ["plan.design=sobol", "plan.n_repeats=2"],
    "cut_short": ["plan.n_records=399", "plan.n_units=30"],
    "grid": ["plan.design=grid", "plan.n_records=null", "plan.n_units=8"],
}


def planned(*overrides):
    config = read_request(["experiment=quickstart", *overrides]).config
    if config["plan"]["design"] == "grid":
        for specs in (
            config["plan"]["vary"],
            *(fault.get("vary") or {} for fault in config["classes"].values()),
        ):
            for spec in specs.values():
                spec["levels"] = 2
    return make_plan(config)


@pytest.mark.parametrize("design", DESIGNS)
def test_unit_condition_and_noise_stay_on_one_side(design):
    plan = planned(*DESIGNS[design])
    tables = make_splits(plan, 0)
    assert {
        "by_unit",
        "cross_speed",
        "cross_torque",
        "cross_snr",
        "healthy_only",
        "open_set",
    } <= set(tables)
    names = plan.columns["record_id"].tolist()
    noise = [
        stream(0, Stream.NOISE, int(name.lstrip("r"))).integers(2**62) for name in names
    ]
    columns = {"noise": np.array(noise)} | {
        name: plan.columns[name] for name in ("unit_id", "condition_id")
    }
    for protocol in set(CLEAN) & set(tables):
        subset = dict(
            zip(
                tables[protocol].record_id.tolist(),
                tables[protocol].subset.tolist(),
                strict=True,
            )
        )
        for column, values in columns.items():
            sides = {}
            for name, value in zip(names, values.tolist(), strict=True):
                if name in subset:
                    sides.setdefault(value, set()).add(subset[name])
            assert all(len(seen) == 1 for seen in sides.values()), (protocol, column)
            assert set.union(*sides.values()) == {"train", "validation", "test"}


def test_quickstart_has_all_protocols_with_ten_units_to_test_what_is_held_out():
    plan = planned()
    tables = make_splits(plan, 0)
    assert set(tables) == set(PROTOCOLS)
    for name in set(CLEAN) - {"cross_specimen"}:  # two sets of gears, in eight units
        test = tables[name].record_id[tables[name].subset == "test"]
        tested = np.isin(plan.columns["record_id"], test)
        assert len(np.unique(plan.columns["unit_id"][tested])) >= 10
        assert tested.sum() >= 40


def test_a_sham_plan_has_no_severity_to_hold_out_and_keeps_the_others():
    sham, real = planned("plan.sham=true"), planned()
    tables = make_splits(sham, 0)
    assert set(PROTOCOLS) - set(tables) == {
        "unseen_severity_inner",
        "unseen_severity_outer",
    }
    assert (
        "no class has enough different severities"
        in why_left_out(sham, 0)["unseen_severity_outer"]
    )
    assert all(
        table.to_csv() == make_splits(real, 0)[name].to_csv()
        for name, table in tables.items()
    )
