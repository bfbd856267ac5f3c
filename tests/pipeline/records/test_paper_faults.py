"""Faults on perfect gears: all four classes are told, on machines never seen."""

import numpy as np
import pytest

import gensig
from diagnose.baselines.tooth_models import ToothLogistic, tooth_table
from diagnose.data.windows import subset_segments, task_of
from diagnose.scoring.metrics import confusion_by_unit, recall

SIZES = ("fault.crack_depth_mm=1", "fault.pit_length_mm=1", "fault.pit_width_mm=10")
SMALL = ("plan.n_records=80", "operating.duration_s=0.5", "executor.n_workers=1")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    out = tmp_path_factory.mktemp("paper") / "data"
    made = gensig.generate("experiment=paper_faults", *SIZES, *SMALL, out=str(out))
    yield made
    made.close()


def test_all_four_classes_are_told(data):
    whole = int(data.n_samples)
    task = task_of(data, window_samples=whole, stride_samples=whole, normalise="rms")
    train, validation, test = (
        tooth_table(task, subset_segments(task, "new_machine", part), {})
        for part in ("train", "validation", "test")
    )
    model = ToothLogistic()
    model.fit(train, validation, len(data.class_names))
    said = model.predict_proba(test).argmax(axis=1)
    one_machine = np.zeros_like(said)
    confusion = confusion_by_unit(test.label, said, one_machine, len(data.class_names))
    assert recall(confusion)[0].min() >= 0.9


def test_sizes_are_those_of_the_paper(data):
    depth = data.where(fault="crack").column("params/fault.crack_depth_mm")
    np.testing.assert_array_equal(depth, 1.0)
    pits = data.where(fault="pitting")
    np.testing.assert_array_equal(pits.column("params/fault.pit_length_mm"), 1.0)
    np.testing.assert_array_equal(pits.column("params/fault.pit_width_mm"), 10.0)
