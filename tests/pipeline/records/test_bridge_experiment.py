"""``experiment=bridge``: everything but the class is drawn, recorded, and taught from re-draws."""

import json

import numpy as np
import pytest
from record_sets import rows_of

import gensig
from diagnose.cli import main as diagnose_main
from gensig.plan.request import read_request

DRAWN = (
    "gear.pinion.n_teeth",
    "gear.normal_module_mm",
    "quality.iso1328_grade",
    "operating.speed_rpm",
    "operating.torque_nm",
    "operating.speed_profile.scatter",
    "sensing.snr_db",
    "sensing.fault_gain",
)
OF_UNIT = DRAWN[:3]
SMALL = (
    "experiment=bridge",
    "plan.n_units=5",
    "plan.n_records=10",
    "plan.classes=[healthy,missing_tooth]",
    "operating.duration_s=0.2",
    # a short memory of the path, so that little is simulated before a record
    "sensing.path.natural_frequency_hz=[2000,12000]",
    "sensing.path.damping_ratio=[0.04,0.08]",
    "dataset.store_source=true",
    "dataset.store_healthy_twin=true",
    "executor.n_workers=1",
)


def test_its_plan_draws_what_it_says_alike_for_all_classes_of_a_condition():
    rows = rows_of(read_request(["experiment=bridge"]).config)
    examples = [row for row in rows if row["is_reference"] == 0]
    assert len(examples) == 400
    assert len(rows) - len(examples) == 2 * len({row["unit_id"] for row in rows})
    for key in DRAWN:
        of_condition = {}
        for row in rows:
            place = "unit_id" if key in OF_UNIT else "condition_id"
            of_condition.setdefault(row[place], set()).add(row[f"params/{key}"])
        assert {len(values) for values in of_condition.values()} == {1}
    grades = {row["params/quality.iso1328_grade"] for row in rows}
    assert grades == set(range(4, 12))
    gains = np.array([row["params/sensing.fault_gain"] for row in rows])
    assert gains.min() >= 1.0
    assert gains.max() <= 30.0
    assert np.median(gains) == pytest.approx(np.sqrt(30.0), rel=0.15)


def test_a_small_set_is_made_and_trained_with_its_redraws(tmp_path, capsys):
    data, out = tmp_path / "data", tmp_path / "out"
    with gensig.generate(*SMALL, out=data) as made:
        assert made.usable.all()
        gain = np.asarray(made.column("params/sensing.fault_gain"))
        for record in range(made.n_records):
            source = made.trace(record, "acceleration_source")
            twin = made.trace(record, "healthy_twin_source")
            is_sound = made.column("fault_gear")[record] == ""
            assert np.array_equal(source, twin) == is_sound
        assert np.unique(gain).size > 6
    words = (
        "protocols=[new_machine]",
        "seeds=[0]",
        "epochs=1",
        "baselines=false",
        "shuffle_control=false",
        "metadata_probe=false",
        "oracle=false",
        "n_bootstrap=20",
        "n_threads=1",
        "reference=none",
        "model.reference=every_condition",
        "model.samples_per_tooth=16",
        "model.whitened=machine",
        "model.redraws=2",
    )
    assert diagnose_main(["train", f"data={data}", f"out={out}", *words]) == 0
    described = json.loads(
        (out / "models" / "new_machine-seed0" / "model.json").read_text()
    )
    assert described["model"]["redraws"] == 2
    assert described["model"]["reference"] == "every_condition"
    capsys.readouterr()
