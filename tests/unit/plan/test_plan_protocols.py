"""Protocols of real plans: units, conditions and noise stay on one side."""

import numpy as np
import pytest
from crossed_plan import CROSSED

from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits, why_left_out
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.streams import Stream, stream

CLEAN = [name for name in PROTOCOLS if name != "random_window_leaky"]
DESIGNS = {
    "latin_hypercube": [],
    "sobol": ["plan.design=sobol", "plan.n_repeats=2"],
    "cut_short": ["plan.n_records=399", "plan.n_units=30"],
    "separate": ["plan.machines=separate", "plan.n_gearboxes=null"],
    "grid": ["plan.design=grid", "plan.n_records=null", "plan.n_units=8"],
}


def planned(*overrides):
    config = read_request(["experiment=quickstart", *CROSSED, *overrides]).config
    if config["plan"]["design"] == "grid":
        faults = [fault.get("vary") or {} for fault in config["classes"].values()]
        for specs in (config["plan"]["vary"], *faults):
            for spec in specs.values():
                spec["levels"] = 2
    return make_plan(config)


@pytest.mark.parametrize("design", DESIGNS)
def test_unit_condition_and_noise_stay_on_one_side(design):
    plan = planned(*DESIGNS[design])
    columns = plan.columns
    tables = make_splits(plan, 0)
    needed = (
        "by_unit",
        "cross_speed",
        "cross_torque",
        "cross_snr",
        "healthy_only",
        "open_set",
    )
    assert set(needed) <= set(tables)
    if design == "latin_hypercube":
        assert set(tables) == set(PROTOCOLS) - {"new_machine"}
    if design == "separate":
        assert set(tables) == set(PROTOCOLS)
    numbers = [int(name.lstrip("r")) for name in columns["record_id"].tolist()]
    noise = [stream(0, Stream.NOISE, number).integers(2**62) for number in numbers]
    for protocol in set(CLEAN) & set(tables):
        table = tables[protocol]
        rows = np.searchsorted(columns["record_id"], table.record_id)
        for values in (np.array(noise), columns["unit_id"], columns["condition_id"]):
            pairs = set(zip(values[rows].tolist(), table.subset.tolist(), strict=True))
            assert len(pairs) == len(set(values[rows].tolist())), protocol
        assert set(table.subset.tolist()) == {"train", "validation", "test"}


def test_a_sham_plan_has_no_severity_to_hold_out_and_keeps_the_others():
    sham, real = planned("plan.sham=true"), planned()
    tables, expected = make_splits(sham, 0), make_splits(real, 0)
    severities = {"unseen_severity_inner", "unseen_severity_outer"}
    assert set(PROTOCOLS) - set(tables) == severities | {"new_machine"}
    reason = why_left_out(sham, 0)["unseen_severity_outer"]
    assert "no class has enough different severities" in reason
    for name, table in tables.items():
        assert table.to_csv() == expected[name].to_csv()
