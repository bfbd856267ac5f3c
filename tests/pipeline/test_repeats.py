"""Repeats on disk: a column counts them, and the whole set is made from counts alone."""

import numpy as np

import gensig
from gensig.cli import main
from gensig.dataset.folder.verify import verify
from gensig.dataset.plan import read_plan

WORDS = (
    "plan.n_records=null",
    "plan.n_units=3",
    "plan.conditions_per_unit=1",
    "plan.n_repeats=2",
    "plan.classes=[healthy,crack]",
    "operating.duration_s=0.02",
    "sensing.channels=[pinion_y]",
    "executor.n_workers=1",
)


def test_repeats_are_stored_and_told_apart(tmp_path, capsys):
    out = tmp_path / "data"
    assert main(["generate", *WORDS, f"out={out}"]) == 0
    assert "12 records in " in capsys.readouterr().out
    assert verify(out).problems == []
    plan = read_plan(out / "plan.csv")
    with gensig.open_dataset(out) as data:
        assert data.column("repeat").tolist() == [0, 0, 1, 1] * 3
        assert plan.columns["repeat"].tolist() == [0, 0, 1, 1] * 3
        for condition in set(data.column("condition_id").tolist()):
            pair = data.where(condition_id=condition, fault="crack")
            assert sorted(pair.column("repeat")) == [0, 1]
            one, two = pair.array()[:, 0]
            assert abs(np.corrcoef(one, two)[0, 1]) < 0.999
        assert len(data.where(repeat=0)) == 6


def test_one_record_of_a_plan_with_repeats_can_be_looked_at(tmp_path):
    for words in (
        WORDS,
        ("plan.design=grid", "plan.n_repeats=3", "operating.duration_s=0.02"),
    ):
        output = str(tmp_path / "record.csv")
        assert main(["simulate", *words, "--output", output, "--force"]) == 0
