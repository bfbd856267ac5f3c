"""A small set of lives from the generator, and the remaining-life task on it."""

import json

from small_sets import make

from diagnose.cli import main as diagnose


def test_lives_are_made_and_learnt_whole(tmp_path, capsys):
    lives = make(
        tmp_path / "lives", "experiment=run_to_failure", "life=crack_growth", "plan.classes=[crack]",
        "plan.n_records=null", "plan.n_units=16", "life.snapshot_count=5", "operating.duration_s=0.05",
        "dataset.records_per_shard=60",
    )  # fmt: skip
    out = tmp_path / "report"
    words = [
        "task=remaining_life",
        f"data={lives}",
        f"out={out}",
        "protocols=[by_unit]",
        "model=cnn",
        "epochs=1",
    ]
    assert (
        diagnose(
            [
                "train",
                *words,
                "seeds=1",
                "window_samples=1024",
                "n_threads=1",
                "n_bootstrap=50",
            ]
        )
        == 0
    )
    capsys.readouterr()
    found = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"]
    assert {"constant", "age_only", "indicators", "cnn"} <= set(found["methods"])
    assert all(found["n_lives"][part] for part in ("train", "validation", "test"))
    assert (out / "report.html").stat().st_size > 10_000
    lines = (out / "predictions.csv").read_text().splitlines()
    assert len(lines) > 1
