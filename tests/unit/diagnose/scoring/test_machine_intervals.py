"""Resamples of machines that share gears and gearboxes: what is shared is drawn."""

import numpy as np
import pytest
from fake_dataset import FakeDataset
from numpy.random import default_rng
from numpy.testing import assert_array_equal
from small_studies import task_on

from diagnose.report.text import resampled_sentence, score_cell
from diagnose.scoring.intervals import percentile_interval, spread_text
from diagnose.scoring.judged import class_scores, judged_answers
from diagnose.scoring.machines import (
    Grouping,
    Machines,
    Support,
    machines_of,
    units_drawn,
)
from diagnose.scoring.metrics import score_with_interval


def dataset_of(gears, gearboxes, **options):
    """Data set whose units have these sets of gears and gearboxes, (unit,) each."""
    dataset = FakeDataset(n_units=len(gears), records_per_unit=4, **options)
    unit = np.repeat(np.arange(len(gears)), 4)
    dataset.columns["specimen_id"] = np.array([f"g{k}" for k in gears])[unit]
    dataset.columns["gearbox_id"] = np.array([f"b{k}" for k in gearboxes])[unit]
    return dataset


def machines_on(gears, gearboxes):
    dataset = dataset_of(gears, gearboxes)
    return machines_of(dataset, np.arange(dataset.n_records))


def crossed(n_gears, n_gearboxes):
    return np.divmod(np.arange(n_gears * n_gearboxes), n_gearboxes)


def test_machines_that_share_nothing_are_drawn_as_units():
    machines = machines_on(range(6), range(6))
    assert machines.counts() == {"machines": 6}
    assert_array_equal(
        machines.drawn(50, default_rng(0)), units_drawn(6, 50, default_rng(0))
    )
    without = FakeDataset(n_units=6)
    assert machines_of(without, np.arange(without.n_records)).counts() == {
        "machines": 6
    }


def test_only_records_that_are_judged_count():
    """Two units in one gearbox are alone where only one of them is tested."""
    dataset = dataset_of(range(4), [0, 0, 1, 2])
    assert machines_of(dataset, np.arange(16)).counts() == {"gearboxes": 3}
    assert machines_of(dataset, np.arange(4, 16)).counts() == {"machines": 3}


@pytest.mark.parametrize(
    ("gears", "gearboxes", "counts"),
    [
        ([0, 0, 1, 1, 2, 2, 3, 3], range(8), {"sets of gears": 4}),
        (range(8), [0, 1, 2, 3, 0, 1, 2, 3], {"gearboxes": 4}),
    ],
)
def test_units_that_share_one_thing_are_drawn_with_it(gears, gearboxes, counts):
    machines = machines_on(gears, gearboxes)
    assert machines.counts() == counts
    drawn = machines.drawn(200, default_rng(0))
    assert (drawn.sum(axis=1) == 8).all()
    shared = np.asarray(gears if len(set(gears)) == 4 else gearboxes)
    for group in range(4):
        assert (np.ptp(drawn[:, shared == group], axis=1) == 0).all()


def test_units_that_share_both_weigh_the_product_of_both_draws():
    machines = machines_on(*crossed(5, 4))
    assert machines.counts() == {"sets of gears": 5, "gearboxes": 4}
    drawn = machines.drawn(4000, default_rng(0)).reshape(-1, 5, 4)
    assert (drawn.sum(axis=(1, 2)) == 20).all()
    products = drawn.sum(axis=2)[:, :, None] * drawn.sum(axis=1)[:, None]
    assert_array_equal(20 * drawn, products)
    assert drawn.mean(axis=0) == pytest.approx(np.ones((5, 4)), abs=0.1)


def test_too_few_of_either_kind_give_no_interval_and_say_so():
    """Two sets of gears in four gearboxes are eight machines, and two sets of gears."""
    dataset = dataset_of(*crossed(2, 4))
    task, record = task_on(dataset), np.arange(dataset.n_records)
    right = judged_answers(task, "cnn", record, np.eye(4)[task.labels()][None])
    scores = class_scores(right, task.class_names, 100)
    score = scores["balanced_accuracy"]
    assert score["low"] is score["high"] is None
    assert score_cell(scores) == "1.00 [too few sets of gears]"
    counts = machines_of(dataset, record).counts()
    assert spread_text(score, counts, ".2f") == (
        "no 95 % interval: too few sets of gears"
    )
    gearboxes = machines_on(*crossed(4, 2)).support()
    assert gearboxes == Support(kind="gearboxes", n_groups=2)
    enough = machines_on(*crossed(4, 4)).support()
    assert enough.too_few is None


def test_a_score_of_some_machines_counts_what_they_share():
    machines = machines_on(*crossed(4, 5))
    assert machines.support(np.array([0, 5, 10, 15])).too_few == "gearboxes"
    assert machines.support(np.array([0, 1, 2, 3, 4])).too_few == "sets of gears"
    assert machines.support(np.arange(20)).too_few is None


def covers(machines, resampled_as, value, rng):
    """True if the interval of the mean holds 0."""
    weight = resampled_as.drawn(300, rng)
    means = (weight @ value) / weight.sum(axis=1)
    low, high = percentile_interval(means, machines.support())
    return low <= 0 <= high


def test_the_interval_of_shared_gears_covers_new_gears_and_that_of_units_does_not():
    """Values are a part of the gears, a part of the gearbox and one of the machine."""
    gears, gearboxes = crossed(12, 12)
    shared = Machines(
        groupings=(
            Grouping(kind="sets of gears", group=gears),
            Grouping(kind="gearboxes", group=gearboxes),
        )
    )
    alone, rng = Machines.alone(144), default_rng(1)
    covered = np.zeros((150, 2))
    for row in covered:
        value = rng.normal(size=12)[gears] + rng.normal(size=12)[gearboxes]
        value = value + rng.normal(size=144)
        row[:] = [covers(shared, kind, value, rng) for kind in (shared, alone)]
    of_shared, of_units = covered.mean(axis=0)
    assert 0.88 < of_shared <= 1.0
    assert of_units < 0.7


def test_a_score_is_resampled_by_its_machines():
    """Each set of gears is all right or all wrong in both of its gearboxes."""
    confusion = np.zeros((1, 16, 2, 2), dtype=int)
    confusion[0, :8, [0, 1], [0, 1]] = 5
    confusion[0, 8:, [0, 1], [1, 0]] = 5
    gears = np.arange(16) // 2
    shared = Machines(groupings=(Grouping(kind="sets of gears", group=gears),))

    def width(machines):
        score = score_with_interval(
            "balanced_accuracy",
            confusion,
            n_bootstrap=4000,
            rng=default_rng(0),
            machines=machines,
        )
        return score["high"] - score["low"]

    assert width(None) == width(Machines.alone(16))
    assert width(shared) == pytest.approx(np.sqrt(2) * width(None), rel=0.15)


def test_the_sentence_names_what_is_resampled():
    by_unit, gears = {"machines": 10}, {"sets of gears": 4, "gearboxes": 5}
    one = resampled_sentence({"by_unit": {"resampled": by_unit}})
    assert one == (
        "The interval resamples machines: windows of one machine are not independent."
    )
    both = resampled_sentence(
        {"by_unit": {"resampled": by_unit}, "cross_specimen": {"resampled": gears}}
    )
    assert "machines (by_unit); sets of gears and gearboxes (cross_specimen)" in both
    assert both.endswith("nor are machines that share gears or a gearbox.")
