"""Split tables: the leaky protocol, protocols left out, and CSV files."""

import hashlib

import numpy as np
import pytest
from dataset_samples import make_plan, sides
from numpy.testing import assert_allclose, assert_array_equal

from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import make_splits
from gensig.dataset.splitting.splits import SUBSETS, read_split
from gensig.errors import DatasetError

HEADER = "record_id,start_fraction,stop_fraction,subset\n"
OLD_DIGESTS = {
    "random_window_leaky": "672ec8f53ae644fb",
    "by_unit": "960f6bfc3b8dfc14",
    "cross_specimen": "67d65a0b728714b0",
}


def test_leaky_protocol_has_every_record_on_several_sides():
    plan = make_plan()
    table = make_splits(plan, 1)["random_window_leaky"]
    for column, n_values in (("record_id", plan.n_records), ("label", 3)):
        parts = [set(side.tolist()) for side in sides(table, plan, column)]
        assert sum(map(len, parts)) > len(set.union(*parts)) == n_values
    subset = table.subset.reshape(plan.n_records, 8)
    starts = table.start_fraction.reshape(subset.shape)
    assert (starts == np.arange(8) / 8).all()
    assert_array_equal(table.stop_fraction, table.start_fraction + 1 / 8)
    shares = [np.mean(subset == name) for name in SUBSETS]
    assert_allclose(shares, [0.6, 0.2, 0.2], rtol=0, atol=0.06)
    assert len(set(map(tuple, subset.tolist()))) > 10  # scattered


def test_protocol_that_lacks_a_class_or_groups_is_left_out():
    by_unit = {"by_unit", "cross_gearbox"}
    columns = make_plan().columns
    one_unit_only = np.where(columns["unit_id"] == "u0", 2, 0)
    bare = {name: columns[name] for name in ("record_id", "shard", "row", "label")}
    for plan, names in (
        (make_plan(n_units=3), by_unit),
        (make_plan(n_units=2), set()),
        (Plan(columns={**columns, "label": one_unit_only}), set()),
        (Plan(columns=bare), set()),
    ):
        assert set(make_splits(plan, 1)) == {"random_window_leaky", *names}


def test_csv_round_trip_and_header(tmp_path):
    for name, table in make_splits(make_plan(), 5).items():
        path = tmp_path / f"{name}.csv"
        path.write_text(table.to_csv())
        back = read_split(path)
        for field in ("record_id", "start_fraction", "stop_fraction", "subset"):
            assert_array_equal(getattr(back, field), getattr(table, field))
    text = (tmp_path / "by_unit.csv").read_text()
    assert text.startswith(f"{HEADER}r000000,0,1,")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "record_id,subset\nr0,train\n",
        HEADER,
        f"{HEADER}r0,0,1,exam\n",
        f"{HEADER}r0,0.5,0.5,train\n",
        f"{HEADER}r0,0,nan,train\n",
        f"{HEADER}r0,0,1\n",
        f"{HEADER}r0,0,1,train\nr0,0,1\n",
    ],
)
def test_malformed_split_is_refused(tmp_path, text):
    path = tmp_path / "by_unit.csv"
    path.write_text(text)
    with pytest.raises(DatasetError, match=r"by_unit\.csv"):
        read_split(path)


def test_the_first_three_protocols_keep_their_bits():
    """Digests of the tables of gensig 0.5.0: data sets are compared by them."""
    digests = {
        name: hashlib.sha256(table.to_csv().encode()).hexdigest()[:16]
        for name, table in make_splits(make_plan(n_records=300, n_units=10), 1).items()
    }
    assert {name: digests[name] for name in OLD_DIGESTS} == OLD_DIGESTS
