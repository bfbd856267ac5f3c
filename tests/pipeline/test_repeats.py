"""Repeats on disk: a column counts them, and the whole set is made from counts alone."""

import numpy as np
from small_sets import make

import gensig
from gensig.cli import main
from gensig.dataset.folder.verify import verify

COUNTS = (
    "plan.n_records=null",
    "plan.n_units=3",
    "plan.conditions_per_unit=1",
    "plan.n_repeats=2",
)


def test_repeats_are_stored_and_told_apart(tmp_path):
    out = make(tmp_path / "data", *COUNTS)
    assert verify(out).problems == []
    with gensig.open_dataset(out) as data:
        assert data.column("repeat").tolist() == [0, 0, 1, 1] * 3
        for condition in set(data.column("condition_id").tolist()):
            pair = data.where(condition_id=condition, fault="crack")
            assert abs(np.corrcoef(pair.array()[:, 0])[0, 1]) < 0.999


def test_one_record_of_a_plan_with_repeats_can_be_looked_at(tmp_path):
    words = ("plan.design=grid", "plan.n_repeats=3", "operating.duration_s=0.02")
    output = str(tmp_path / "record.csv")
    assert main(["simulate", *words, "--output", output]) == 0
