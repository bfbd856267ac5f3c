"""A small set of lives from the generator, and the remaining-life task on it."""

import csv
import json

from small_sets import make

from diagnose.cli import main as diagnose

LIVES = (
    "experiment=run_to_failure",
    "life=crack_growth",
    "plan.classes=[crack]",
    "plan.n_records=null",
    "plan.n_units=16",
    "life.snapshot_count=5",
    "operating.duration_s=0.05",
    "dataset.records_per_shard=60",
)
TRAINING = (
    "task=remaining_life",
    "protocols=[by_unit]",
    "model=cnn",
    "epochs=1",
    "seeds=[1]",
    "window_samples=1024",
    "n_threads=1",
    "n_bootstrap=50",
)


def test_lives_are_made_and_learnt_whole(tmp_path):
    lives, out = make(tmp_path / "lives", *LIVES), tmp_path / "report"
    assert diagnose(["train", f"data={lives}", f"out={out}", *TRAINING]) == 0
    result = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"]
    assert {"constant", "age_only", "indicators", "cnn"} <= set(result["methods"])
    assert all(result["n_lives"][part] for part in ("train", "validation", "test"))
    assert "Remaining life, by_unit" in (out / "report.html").read_text()
    with (out / "predictions.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["method"] for row in rows} == set(result["methods"])
